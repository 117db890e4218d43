"""Outlines that lie in themselves: areas and perimeters against shapely, whether they end a run, wherever they cross."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

import prensa as pr
from prensa.checks.during.self_intersection import fold
from prensa.mesh.crossing import turns_back
from prensa.mesh.overlap import overlaps
from prensa.result.folding import Outlined
from problems import single_block

CUP, MOUTH, HEIGHT = 0.5, 1.0, 4.0  # of two arms: half width of the void below, where it begins to narrow, height of their ends
WRINKLE = [(3.04, 3.697), (2.867, 3.624), (2.81, 3.476), (2.749, 3.564), (2.526, 3.256), (2.749, 3.532), (2.185, 3.201)]
"""Nodes that a die with steep sides has left behind: one lies by an eighth of a side on the wrong side of the next but one."""


def arms(depth: float, shift: float = 0.0, per: int = 4) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes of an outline of two arms that lie in one another by a depth, above a void; and the two arms alone.

    There are so many nodes ``per`` length; those of the right arm are ``shift`` higher, all but its foot.
    """
    d, up = 0.5 * depth, HEIGHT + shift
    left = [(d, MOUTH + 0.5), (d, HEIGHT), (-2.0, HEIGHT), (-2.0, 0.0), (0.0, 0.0), (0.0, 0.5), (-CUP, 0.5), (-CUP, MOUTH)]
    right = [(0.0, 0.0), (2.0, 0.0), (2.0, up), (-d, up), (-d, MOUTH + 0.5 + shift), (CUP, MOUTH), (CUP, 0.5), (0.0, 0.5)]
    corners = np.array([*right[:-1], *left[-2:], *left[:4]])
    way = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    nodes = [
        a + np.arange(n)[:, None] / n * (b - a)
        for a, b, n in zip(corners, np.roll(corners, -1, axis=0), np.maximum(np.rint(per * way).astype(int), 1))
    ]
    return np.concatenate(nodes), np.array(left), np.array(right)


def chain(x: np.ndarray) -> np.ndarray:
    return np.stack([np.arange(len(x)), (np.arange(len(x)) + 1) % len(x)], axis=1)


def folded(x: np.ndarray):
    """What the check of a run says of a block whose outline is at x; inside it nothing counts."""
    x = np.append(x, [0.5 * (x[-1] + x[0])], axis=0) if len(x) % 2 else x
    system = pr.discretise(single_block(pr.Step("rest"), n=(len(x) // 2 - 1, 1)))
    (ends,), u = system.outlines.values(), system.initial().u
    after = dict(ends.tolist())
    walk = [int(ends[0, 0])]
    while after[walk[-1]] != walk[0]:
        walk.append(after[walk[-1]])
    system.displacement(u)[walk] = x - system.X[walk]
    return fold(Outlined(system, u, u))


@pytest.mark.parametrize("shift", [0.0, 1e-12, 1e-7, 1e-3, 0.125, -0.1])
@pytest.mark.parametrize("depth", [0.01, 0.02, 0.3, 1.0])
def test_two_arms_that_lie_in_one_another(depth: float, shift: float) -> None:
    """They cross at nodes exactly, beside them by so little, or far from them: area and perimeter are those of shapely."""
    x, left, right = arms(depth, shift)
    common = max(shapely.get_parts(shapely.Polygon(left) & shapely.Polygon(right)), key=lambda part: part.area)
    (found,) = overlaps(x, chain(x))
    assert found.depth == pytest.approx(2.0 * common.area / common.length, rel=1e-6)
    assert (found.x, found.y) == pytest.approx(common.exterior.centroid.coords[0], abs=1e-6)
    assert found.size == pytest.approx(0.25, rel=0.1) and found.stretches == 2
    # a twentieth of a side is 0.0125, and along 2.5 the mean depth is hardly less than the depth
    through = folded(x)
    assert (through is not None) == (depth > 0.0125)
    assert through is None or through.depth == pytest.approx(found.depth)


@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_arms_that_touch_do_not_overlap(gap: float) -> None:
    """All along, node on node, or nearly."""
    x = arms(-gap)[0]
    assert overlaps(x, chain(x)) == [] and folded(x) is None


def test_an_outline_inside_out() -> None:
    """A square corner that is drawn through the body comes out on its other side: what is beyond has no inside."""
    x = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (2.0, -1.0), (0.0, 1.0)])
    (found,) = overlaps(x, chain(x))
    beyond = shapely.Polygon([(1.0, 0.0), (2.0, -1.0), (3.0, 0.0)])
    assert found.depth == pytest.approx(2.0 * beyond.area / beyond.length) and found.y < 0.0
    assert folded(x) is not None


def test_walls_that_cross_without_a_node_in_one_another() -> None:
    """The ends of an open ring of long elements: no node of either is inside the other."""
    foot, top = [(5.0, 0.5), (2.0, 0.5)], [(1.0, 4.0), (0.5, 4.0)]
    x = np.array([(0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (-1.0, 1.6), (-1.0, 1.4), (5.0, 4.2), *foot, *top])
    (found,) = overlaps(x, chain(x))
    a = shapely.Polygon([(0.0, 0.0), (2.0, 0.5), (1.0, 4.0), (0.5, 4.0)])
    b = shapely.Polygon([(6.0, 5.0), (-1.0, 1.6), (-1.0, 1.4), (5.0, 4.2)])
    common = a & b
    assert found.depth == pytest.approx(2.0 * common.area / common.length, rel=1e-9)
    assert found.depth < 0.05 * found.size and found.stretches == 4 and folded(x) is not None


def test_wrinkles_of_a_side_of_an_element_end_no_run() -> None:
    """A loop of two sides is seen, and its mean depth is small beside them; as deep as they are long it is a fold."""
    base = [(0.0, 2.9), (0.0, 0.0), (5.0, 0.0), (5.0, 3.7)]
    x = np.array([*WRINKLE, *base])
    (found,) = overlaps(x, chain(x))
    assert 0.01 < found.depth / found.size < 0.02 and len(found.segments) == 3 and found.stretches == 1
    assert folded(x) is None
    x[3] = (2.3, 3.9)
    assert folded(x) is not None


def test_bodies_that_fold_nowhere_have_no_overlap() -> None:
    """Walls far thinner than their sides are long, a slot whose faces touch, a hole, and corners of all angles."""
    thin = np.array([(0.0, 0.0), (4.0, 0.0), (8.0, 1.0), (8.0, 1.0 + 1e-6), (4.0, 1e-6), (0.0, 1e-6)])
    star = np.array([((1 + 2 * (k % 2)) * np.cos(k / 5 * np.pi), (1 + 2 * (k % 2)) * np.sin(k / 5 * np.pi)) for k in range(10)])
    slot = np.array([(0, 0), (4, 0), (4, 1), (3, 1), (2, 1), (3, 1), (4, 1), (4, 2), (0, 2)], dtype=float)
    for x in (thin, star, slot):
        assert overlaps(x, chain(x)) == []
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    hole, ends = np.concatenate([3.0 * square, 1.0 + square[::-1]]), np.concatenate([chain(square), 4 + chain(square)])
    assert overlaps(hole, ends) == []
    hole[4:, 0] += 1.5  # beyond the side of the body
    (found,) = overlaps(hole, ends)
    assert found.depth == pytest.approx(2.0 * 0.5 / 3.0)


def wavy(seed: int) -> np.ndarray:
    """A closed line of nodes, the body on its left: a circle with waves that fold over it in some, not in others."""
    r = np.random.default_rng(seed)
    angle = np.linspace(0.0, 2.0 * np.pi, int(r.integers(12, 90)), endpoint=False)
    waves = r.normal(size=(2, 4)) * r.uniform(0.0, 0.5) / np.arange(1, 5)
    shape = [waves[k] @ np.sin(np.outer(np.arange(2, 6), angle) + r.uniform(0.0, 6.0, 4)[:, None]) for k in range(2)]
    return np.column_stack([np.cos(angle) + shape[0], r.uniform(0.2, 1.0) * np.sin(angle) + shape[1]])


def test_what_turns_back_nowhere_lies_nowhere_in_itself() -> None:
    """Of random lines both kinds are many; only those that turn back cross themselves, or have sides that face each other."""
    lines = [wavy(seed) for seed in range(400)]
    straight = [x for x in lines if not turns_back(x)]
    assert 100 < len(straight) < 300
    assert not any(overlaps(x, chain(x)) for x in straight)
    assert sum(bool(overlaps(x, chain(x))) for x in lines) > 20
    for x in straight:
        t = np.roll(x, -1, axis=0) - x
        n = np.stack([t[:, 1], -t[:, 0]], axis=1) / np.hypot(*t.T)[:, None]
        middle = x + 0.5 * t
        way = middle[None] - middle[:, None]
        facing = (n @ n.T < 0.0) & ((way * n[:, None]).sum(axis=2) > 0.0) & ((way * n[None]).sum(axis=2) < 0.0)
        free = shapely.Polygon(x).buffer(-1e-9)
        for i, j in zip(*np.nonzero(np.triu(facing))):  # what faces has the body between, and no void alone
            assert shapely.LineString([middle[i], middle[j]]).intersects(free)


@pytest.mark.parametrize("back", [0.49, 0.51])
def test_a_dent_turns_back_by_the_angle_of_its_sides(back: float) -> None:
    """A dent whose sides stand at less than a right angle to each other, or at more; and a line that goes back along itself."""
    w = 1.0 / np.tan(0.5 * np.pi * (1.0 - back))  # half of the opening, of a dent as deep as 1
    x = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 5.0], [5.0 + 1.0 / w, 5.0], [5.0, 4.0], [5.0 - 1.0 / w, 5.0], [0.0, 5.0]])
    assert turns_back(x) is (back > 0.5)
    assert turns_back(x[[0, 1, 2, 1, 5, 6]]) and turns_back(x[::-1])
