"""Chains of lines and arcs: the projection against brute force, its derivatives by differences, fillets, refusals."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import prensa as pr
from prensa.geometry.chain import ChainError, chain, corner, signed_area
from prensa.tools.chain import Chain
from prensa.tools.flat import Flat
from prensa.tools.shapes.circle import Disc, Hollow
from prensa.tools.shapes.plane import HalfSpace

CHAINS = 200
REACH = 1e3  # where the endless ends are cut for the brute force


def random_chain(seed):
    """Pieces of a random chain without self-crossing, lines and arcs, with and without fillets; whether it is closed."""
    rng = np.random.default_rng(seed)
    while True:
        n, closed = int(rng.integers(4, 10)), bool(rng.integers(2))
        if closed:
            angle = np.sort(rng.uniform(0, 2 * np.pi, n))[:: int(rng.choice([1, -1]))]
            radius = rng.uniform(0.5, 1.5, n)
            x = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        else:
            x = np.stack([np.cumsum(rng.uniform(0.2, 1.0, n)), rng.uniform(-0.6, 0.6, n)], axis=1)
        points = [tuple(x[0])]
        for a, b in pairwise(x):
            if rng.random() < 0.4:
                d = b - a
                through = 0.5 * (a + b) + rng.uniform(-0.4, 0.4) * np.array([-d[1], d[0]])
                points.append(pr.Arc(through=tuple(through), to=tuple(b)))
            else:
                points.append(tuple(b))
        each = rng.uniform(0.0, 0.15, n) * (rng.random(n) < 0.8)
        each[[0, -1]] *= closed
        fillet = [0.0, float(rng.uniform(0.02, 0.1)), tuple(each)][int(rng.integers(3))]
        try:
            return chain(points, fillet, closed), closed
        except ChainError:
            continue


def sampled(pieces, steps):
    """Places (pieces, steps, 2) at equal coordinates along each piece, the endless ends cut; and the coordinates."""
    t = np.array([np.linspace(max(p.lo, -REACH), min(p.hi, REACH), steps) for p in pieces])
    which = np.repeat(np.arange(len(pieces)), steps)
    return places(pieces, which, t.ravel()).reshape(*t.shape, 2), t


def places(pieces, which, t):
    """Places (k, 2) of coordinates t (k,) on pieces number which (k,), vectorised beside `Piece.at`."""
    origin = np.array([p.origin for p in pieces])[which]
    along = np.array([p.direction for p in pieces])[which]
    radius, angle, side = (np.array([getattr(p, a) for p in pieces])[which] for a in ("radius", "angle", "side"))
    turn = angle + side * t / np.where(radius > 0, radius, 1.0)
    bow = origin + radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.where(radius[:, None] > 0, bow, origin + t[:, None] * along)


def brute_distance(pieces, x):
    """Unsigned distances (k,): every piece sampled, then golden section in the bracket of its best sample."""
    grid, t = sampled(pieces, 61)
    d = np.hypot(*np.moveaxis(x[:, None, None] - grid[None], -1, 0))
    j = d.argmin(axis=2)
    which = np.broadcast_to(np.arange(len(pieces)), j.shape).ravel()
    j, y, q = j.ravel(), np.repeat(x, len(pieces), axis=0), 0.5 * (np.sqrt(5) - 1)
    lo, hi = t[which, np.maximum(j - 1, 0)], t[which, np.minimum(j + 1, 60)]
    for _ in range(42):  # the distance is flat at its least: half the digits of the place give all of it
        a, b = hi - q * (hi - lo), lo + q * (hi - lo)
        da, db = (np.hypot(*(y - places(pieces, which, v)).T) for v in (a, b))
        lo, hi = np.where(da < db, lo, a), np.where(da < db, b, hi)
    found = np.hypot(*(y - places(pieces, which, 0.5 * (lo + hi))).T).reshape(len(x), -1)
    return np.minimum(found, np.minimum(d[..., 0], d[..., -1])).min(axis=1)


def inside(pieces, closed, x):
    """Whether points are on the left of the chain, by the winding number of a fine polygon."""
    polygon = sampled(pieces, 400)[0].reshape(-1, 2)
    if not closed:
        # the tool within a large circle: on along it, counter-clockwise, from the end to the start
        a, b = (np.arctan2(*polygon[k, ::-1]) for k in (-1, 0))
        turn = a + np.linspace(0, 1, 400) * ((b - a) % (2 * np.pi))
        polygon = np.vstack([polygon, 2 * REACH * np.stack([np.cos(turn), np.sin(turn)], axis=1)])
    v = polygon[None] - x[:, None]
    w = np.roll(v, -1, axis=1)
    cross, dot = v[..., 0] * w[..., 1] - v[..., 1] * w[..., 0], (v * w).sum(axis=2)
    around = np.round(np.arctan2(cross, dot).sum(axis=1) / (2 * np.pi)) != 0
    return around if not closed or signed_area(pieces) > 0 else ~around


@cache
def cases():
    """Chains with points about them."""
    out = []
    for seed in range(CHAINS):
        pieces, closed = random_chain(seed)
        rng = np.random.default_rng(10_000 + seed)
        grid = sampled(pieces, 21)[0].reshape(-1, 2)
        grid = grid[np.abs(grid).max(axis=1) < 20]
        lo, hi = grid.min(axis=0) - 0.5, grid.max(axis=0) + 0.5
        near = grid[rng.integers(len(grid), size=30)] + 0.05 * rng.normal(size=(30, 2))
        out.append((pieces, closed, np.vstack([rng.uniform(lo, hi, (30, 2)), near])))
    return out


def test_projection_equals_brute_force():
    """Signed distance to 1e-10 on 200 random chains, and the foot x − g n lies on the chain at the coordinate s."""
    for pieces, closed, x in cases():
        tool = Chain(pieces, closed)
        close = tool.closest(x)
        assert np.abs(np.abs(close.g) - brute_distance(pieces, x)).max() <= 1e-10
        clear = np.abs(close.g) > 1e-4
        assert np.array_equal((close.g < 0)[clear], inside(pieces, closed, x)[clear])
        assert np.abs(np.hypot(*close.n.T) - 1.0).max() <= 1e-12
        foot = tool.closest(x - close.g[:, None] * close.n)
        assert np.abs(foot.g).max() <= 1e-10
        jump = foot.s - close.s
        if closed:
            jump -= tool.period * np.round(jump / tool.period)
        # away from corners, where the foot of the foot may be on either side
        assert np.quantile(np.abs(jump), 0.9) <= 1e-9


def test_normal_curvature_and_coordinate_are_derivatives():
    """∂g/∂x = n, ∂n/∂x = c e⊗e and ds = (1 − g c) e·dx by central differences, wherever they exist."""
    h, counted = 1e-6, 0
    for pieces, closed, x in cases():
        tool = Chain(pieces, closed)
        at = tool.closest(x)
        e = np.stack([-at.n[:, 1], at.n[:, 0]], axis=1)
        for d in (np.array([h, 0.0]), np.array([0.0, h])):
            plus, minus = tool.closest(x + d), tool.closest(x - d)
            # the same feature of the chain on both sides, and no centre of an arc or corner nearby
            same = (np.hypot(*(plus.n - minus.n).T) < 1e-2) & (np.abs(at.c) < 100)
            same &= np.abs(plus.c - minus.c) <= 1e-3 * (1 + at.c**2)
            u = d / h
            assert np.abs((plus.g - minus.g) / (2 * h) - at.n @ u)[same].max() <= 1e-5
            dn = (plus.n - minus.n) / (2 * h)
            assert (np.abs(dn - (at.c * (e @ u))[:, None] * e).max(axis=1) / (1 + at.c**2))[same].max() <= 1e-5
            ds = plus.s - minus.s
            if closed:
                ds -= tool.period * np.round(ds / tool.period)
            assert np.abs(ds / (2 * h) - (1 - at.g * at.c) * (e @ u))[same].max() <= 1e-5
            counted += int(same.sum())
    assert counted >= 0.95 * 2 * 60 * CHAINS


def test_the_surface_coordinate_is_the_length_of_the_walk():
    """Along the chain s grows by the length walked, through lines, arcs and corners, and once around by the period."""
    for pieces, closed, _ in cases()[:50]:
        tool = Chain(pieces, closed)
        start, walked = None, 0.0
        for p in pieces:
            lo, hi = max(p.lo, -1.0), p.hi if np.isfinite(p.hi) else max(p.lo, 0.0) + 1.0
            t = np.linspace(lo, hi, 7)[1:-1]
            s = tool.closest(np.array([p.at(ti) for ti in t])).s
            start = s[0] - (t[0] - lo) if start is None else start
            assert np.abs(s - start - walked - (t - lo)).max() <= 1e-9
            walked += hi - lo
        if closed:
            assert tool.period == pytest.approx(walked, rel=1e-12)


def test_a_flat_arc_has_the_round_off_of_the_points_and_not_of_its_radius():
    """Beside the middle of an arc of radius 500 on a chord of 2, gap and slip are straight to 1e-18; ε R is 1e-13."""
    pieces = chain([(-1.0, 1.0), (-1.0, 0.0), pr.Arc(through=(0.0, -1e-3), to=(1.0, 0.0)), (1.0, 1.0)], 0.0, False)
    tool = Chain(pieces, False)
    off = np.random.default_rng(1).uniform(-1e-6, 1e-6, (2, 100))
    below = tool.closest(np.stack([np.zeros(100), -1e-3 + off[0]], axis=1))
    assert np.ptp(below.g + (-1e-3 + off[0])) <= 1e-18
    beside = tool.closest(np.stack([off[1], np.full(100, -1e-3)], axis=1))
    assert np.ptp(beside.s - off[1]) <= 4 * np.spacing(np.abs(beside.s).max())


def test_rays_meet_the_surface_first_where_they_should():
    """The point x + h d lies on the chain to 1e-10, the way there is free, and points inside look back."""
    hits = 0
    for pieces, closed, x in cases()[:100]:
        tool = Chain(pieces, closed)
        g = tool.closest(x).g
        for angle in (0.3, 2.0, 4.0):
            d = np.array([np.cos(angle), np.sin(angle)])
            h = tool.along(x, d, REACH)
            hit = np.isfinite(h)
            hits += int(hit.sum())
            assert np.abs(tool.closest(x[hit] + h[hit, None] * d).g).max(initial=0.0) <= 1e-10
            assert (h[hit] * np.where(g[hit] < 0, -1, 1) >= -1e-10).all()
            for share in (0.1, 0.5, 0.9):
                way = tool.closest(x[hit] + share * h[hit, None] * d).g
                assert (way * np.sign(g[hit]) >= -1e-10).all()
    assert hits > 0.3 * 100 * 3 * 60


def test_fillets_are_tangent():
    """Every corner with a fillet has an arc of that radius, tangent to both neighbours to 1e-9, inside them."""
    rng = np.random.default_rng(0)
    found = 0
    for _ in range(100):
        a = rng.uniform(-1, 1, (3, 2))
        points = [tuple(a[0]), pr.Arc(through=tuple(0.5 * (a[0] + a[1]) + 0.1), to=tuple(a[1])), tuple(a[2])]
        try:
            pieces = chain(points, (0.0, 0.05, 0.0), False)
        except ChainError:
            continue
        arcs = [p for p in pieces if p.radius == 0.05]
        assert len(arcs) == 1
        assert all(abs(corner(p, q)) <= 1e-7 for p, q in pairwise(pieces))
        assert all(np.hypot(*np.subtract(p.at(p.hi), q.at(q.lo))) <= 1e-12 for p, q in pairwise(pieces))
        found += 1
    assert found > 30


SQUARE = ((-2.0, -1.0), (2.0, -1.0), (2.0, 1.0), (-2.0, 1.0))


def test_chains_equal_the_tools_they_draw():
    """A half-plane, a rounded stamp, a circle and a cavity drawn as chains project like the analytic shapes."""
    x = np.random.default_rng(3).uniform(-3, 3, (200, 2))

    def compare(tool, other, points=x):
        a, b = tool.closest(points), other.closest(points)
        assert np.allclose(a.g, b.g, atol=1e-12)
        assert np.allclose(a.n, b.n, atol=1e-12)
        assert np.allclose(a.c, b.c, atol=1e-9)
        ds = (a.s - b.s) - (a.s - b.s)[0]
        if np.isfinite(other.period):
            assert tool.period == pytest.approx(other.period, rel=1e-12)
            ds -= other.period * np.round(ds / other.period)
        assert np.allclose(ds, 0.0, atol=1e-9)

    compare(Chain(*pr.Profile(points=((-1.0, 0.0), (1.0, 0.0))).pieces(0.0)), HalfSpace((0.0, -1.0)))
    stamp = pr.Profile(points=((-1.5, 1.0), (-1.5, 0.0), (1.5, 0.0), (1.5, 1.0)), fillet=0.4)
    shallow = x[(x[:, 1] < 0.3) | (np.abs(x[:, 0]) > 1.5)]
    compare(Chain(*stamp.pieces(0.0)), Flat(0.0, -1.0, -1.5, 1.5, 0.4), shallow)
    round_ = ((0.0, -2.0), pr.Arc(through=(2.0, 0.0), to=(0.0, 2.0)), pr.Arc(through=(-2.0, 0.0), to=(0.0, -2.0)))
    compare(Chain(*pr.Profile(points=round_, closed=True).pieces(0.0)), Disc(2.0))
    hole = ((0.0, -2.0), pr.Arc(through=(-2.0, 0.0), to=(0.0, 2.0)), pr.Arc(through=(2.0, 0.0), to=(0.0, -2.0)))
    compare(Chain(*pr.Profile(points=hole, closed=True).pieces(0.0)), Hollow(2.0))
    assert Chain(*pr.Profile(points=hole, closed=True).pieces(0.0)).cavity


def test_a_polygon_is_inside_whatever_its_order():
    """Both directions around give the same tool, per-point fillets included."""
    x = np.random.default_rng(4).uniform(-3, 3, (200, 2))
    fillet = (0.1, 0.2, 0.3, 0.0)
    one = Chain(*pr.Polygon(points=SQUARE, fillet=fillet).pieces(0.0))
    two = Chain(*pr.Polygon(points=SQUARE[::-1], fillet=fillet[::-1]).pieces(0.0))
    assert np.array_equal(one.closest(x).g < 0, two.closest(x).g < 0)
    assert np.allclose(one.closest(x).g, two.closest(x).g, atol=1e-12)
    assert one.closest(np.zeros((1, 2))).g[0] == pytest.approx(-1.0)
    assert one.radius == 0.0
    assert Chain(*pr.Polygon(points=SQUARE, fillet=0.5).pieces(0.0)).radius == 0.5


@pytest.mark.parametrize(
    ("points", "fillet", "closed", "message"),
    [
        (((0.0, 0.0),), 0.0, False, "give at least 2"),
        (((0.0, 0.0), (1.0, 0.0)), 0.0, True, "give at least 3"),
        (((0.0, 0.0), (0.0, 0.0), (1.0, 0.0)), 0.0, False, "points 0 and 1 coincide"),
        ((*SQUARE, SQUARE[0]), 0.0, True, "returns to its first point by itself"),
        (((0.0, 0.0), (1.0, 0.0), (0.5, 0.0)), 0.0, False, "doubles back"),
        ((*SQUARE[:2], (0.0, -1.5), (0.0, 2.0)), 0.0, True, "crosses itself"),
        (((0.0, 0.0), (1.0, 0.0), (0.9, 1.0), (-1.0, -1.0)), 0.0, False, "crosses itself"),
        (((0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0)), 0.6, False, r"fillet 0.6 does not fit at point 2.*0.5 does"),
        (SQUARE, (0.1, 0.1), True, "2 radii for 4 points"),
        (SQUARE, (0.1, 0.1, 0.1, 0.1), False, "ends of an open profile are not corners"),
        (((0.0, 0.0), pr.Arc(through=(1.0, 0.0), to=(2.0, 0.0))), 0.0, False, "is straight"),
        ((pr.Arc(through=(1.0, 0.0), to=(2.0, 0.0)), (0.0, 0.0)), 0.0, False, "cannot be the first"),
    ],
)  # fmt: skip
def test_what_is_no_chain_is_refused(points, fillet, closed, message):
    """Each with what is wrong and where."""
    with pytest.raises(ChainError, match=message):
        chain(points, fillet, closed)


def test_automatic_fillets_fit_everywhere():
    """Corners without fillets are rounded with what is asked or, between short neighbours, with less; none stays sharp."""
    teeth = [(0.1 * k, 0.05 * (k % 2)) for k in range(20)]
    tool = Chain(chain(teeth, None, False, 1.0), False)
    assert 0 < tool.radius < 0.1
    assert not len(tool.edges)


def test_the_width_near_an_end_is_that_of_lines_and_arcs():
    """A tenth from its end a square on its tip is 0.2 wide, a rounded one as its arc, one on its side as its face."""
    down = np.array([0.0, -1.0])
    tip = ((0.0, -2.0), (2.0, 0.0), (0.0, 2.0), (-2.0, 0.0))
    side = ((-1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (-1.0, 1.0))
    wide = 2 * np.sqrt(2 * 0.5 * 0.1 - 0.1**2)
    for points, fillet, width, whole in (
        (tip, 0.0, 0.2, 4.0),
        (tip, 0.5, wide, 4.0 - np.sqrt(2) + 1),
        (side, 0.0, 3.0, 3.0),
    ):
        near, across = Chain(*pr.Polygon(points=points, fillet=fillet).pieces(0.0)).across(down, 0.1)
        assert near == pytest.approx(width, rel=1e-3)
        assert across == pytest.approx(whole, rel=1e-3)


def test_a_tool_behind_a_line_has_no_thickness():
    """A line, and a bulge on it, bound all that lies behind; a strip and a wedge have a width."""
    bulge = [(-2.0, 0.0), (-1.0, 0.0), pr.Arc(through=(0.0, -0.5), to=(1.0, 0.0)), (2.0, 0.0)]
    for points in ([(0.0, 0.0), (1.0, 0.0)], bulge):
        tool = Chain(chain(points, 0.0, False), False)
        assert np.isinf(tool.across(np.array([0.0, -1.0]), 0.1)[1]) and np.isinf(
            tool.across(np.array([1.0, 0.0]), 0.1)[1]
        )
    for points in (
        [(-1.0, 3.0), (-1.0, 0.0), (1.0, 0.0), (1.0, 3.0)],
        [(-1.0, 3.0), (0.0, 0.0), (1.0, 3.0)],
    ):
        tool = Chain(chain(points, 0.0, False), False)
        assert np.isfinite(tool.across(np.array([0.0, -1.0]), 0.1)[1])
