"""Structured meshes with curved boundaries: disc, annulus, region between four curves."""

from __future__ import annotations

import numpy as np

from prensa.mesh.convert import Draft, Midpoints
from prensa.mesh.mesh import MeshError, boundary_edges, edges_between, oriented
from prensa.mesh.spacing import graded
from prensa.model import meshes as model
from prensa.precision import DRAWN, NEGLIGIBLE, ROUND_OFF, SMALLEST
from prensa.types import Array, Index

CORE = 0.5  # half-width of the core of a disc on its axes, and …
CORE_CORNER = 0.42  # … that of its corners, over the radius: angles near 90° at the rim and 120° at the corners
_PARTS = {  # the quarters (0: top-right, counter-clockwise) that make a part, and the names of the sides that close it
    "full": ((0, 1, 2, 3), ()), "right": ((3, 0), ("left",)), "left": ((1, 2), ("right",)),
    "top": ((0, 1), ("bottom",)), "bottom": ((2, 3), ("top",)), "top-right": ((0,), ("left", "bottom")),
    "top-left": ((1,), ("right", "bottom")), "bottom-left": ((2,), ("right", "top")),
    "bottom-right": ((3,), ("left", "top")),
}  # fmt: skip
_RIM = {"rim-right": (1.0, 0.0), "rim-top": (0.0, 1.0), "rim-left": (-1.0, 0.0), "rim-bottom": (0.0, -1.0)}


def grid(points: Array) -> Index:
    """Quadrilaterals of a grid of points (ny + 1, nx + 1, 2) that are numbered row by row."""
    node = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    return np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1).reshape(-1, 4)


def chain(nodes: Index) -> Index:
    """Edges (k, 2) along a row of nodes (k + 1,)."""
    return np.stack([nodes[:-1], nodes[1:]], axis=1)


def merged_grids(parts: list[Array]) -> tuple[Array, Index]:
    """Points and quadrilaterals of several grids, those at one place made one; cells counter-clockwise."""
    first = np.cumsum([0, *(p.shape[0] * p.shape[1] for p in parts)])
    points = np.concatenate([p.reshape(-1, 2) for p in parts])
    cells = np.concatenate([grid(p) + k for p, k in zip(parts, first)])
    step = DRAWN * float(np.ptp(points, axis=0).max())
    _, keep, number = np.unique(
        np.round(points / step).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    points, cells = points[keep], number.reshape(-1)[cells]
    return points, oriented(points, cells)


def _round(centre: Array) -> Midpoints:
    """Points half way between two points of a circle about *centre*."""

    def between(a: Array, b: Array) -> Array:
        radius = 0.5 * (np.linalg.norm(a - centre, axis=1) + np.linalg.norm(b - centre, axis=1))
        middle = 0.5 * (a + b) - centre
        return np.asarray(centre + middle * (radius / np.linalg.norm(middle, axis=1))[:, None])

    return between


# ----------------------------------------------------------------------------------------------------------------- disc
def disc(m: model.Disc) -> Draft:
    """Draft of a `prensa.Disc`: a core and eight wedges round it."""
    half, layers = m.n[0] // 2, m.n[1]
    angle = np.linspace(0.0, np.pi / 2, m.n[0] + 1)
    rim = np.column_stack([np.cos(angle), np.sin(angle)])
    # cos(π/2) is 6e-17: sides on an axis have to lie on it exactly, where supports and the axis of revolution look for them.
    rim[0, 1] = rim[-1, 0] = 0.0
    s = np.linspace(0.0, 1.0, half + 1)
    east = np.column_stack([CORE + (CORE_CORNER - CORE) * s, CORE_CORNER * s])  # right side of the core, upwards
    north = east[::-1, ::-1]  # its upper side, leftwards
    core = _coons(np.column_stack([CORE * s, 0 * s]), east, north[::-1], np.column_stack([0 * s, CORE * s]))
    t = graded(0.0, 1.0, layers, (1.0,), m.ratio)
    inside = np.concatenate([east, north[1:]])
    wedges = inside[None] + t[:, None, None] * (rim - inside)[None]
    quarters, closing = _PARTS[m.part]
    parts = []
    for q in quarters:
        c, d = ((1, 0), (0, 1), (-1, 0), (0, -1))[q]
        turn = np.array([[c, d], [-d, c]], dtype=np.float64)
        parts += [core @ turn, wedges @ turn]
    points, cells = merged_grids(parts)
    outline = boundary_edges(cells)
    edges = {"rim": edges_between(outline, np.flatnonzero(np.abs(np.hypot(*points.T) - 1.0) < NEGLIGIBLE))}
    for name in closing:
        column = 0 if name in ("left", "right") else 1
        edges[name] = edges_between(outline, np.flatnonzero(np.abs(points[:, column]) < NEGLIGIBLE))
    places = {"centre": (0.0, 0.0), **_RIM}
    near = {name: np.hypot(*(points - p).T) for name, p in places.items()}
    corners = {name: int(np.argmin(d)) for name, d in near.items() if d.min() < NEGLIGIBLE}
    centre = np.array(m.centre)
    return Draft(centre + m.radius * points, cells, edges, corners, {"rim": _round(centre)})


# -------------------------------------------------------------------------------------------------------------- annulus
def annulus(m: model.Annulus) -> Draft:
    """Draft of a `prensa.Annulus`."""
    start, end = m.angles
    closed = end - start >= 2 * np.pi * (1 - NEGLIGIBLE)
    around, through = m.n
    angle = np.linspace(start, end, around + 1)
    target = {"inner": (m.inner,), "outer": (m.outer,), None: ()}[m.grade]
    radius = graded(m.inner, m.outer, through, target, m.ratio if m.grade else 1.0)
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    direction[np.abs(direction) < ROUND_OFF] = 0.0  # a side on an axis lies on it exactly
    node = np.arange((around + 1) * (through + 1)).reshape(around + 1, through + 1)
    if closed:
        node[-1] = node[0]
    points = np.array(m.centre) + direction[:, None, :] * radius[None, :, None]
    cells = np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1).reshape(-1, 4)
    # The inner rim is walked clockwise, so that the body is on its left as well.
    edges = {"inner": chain(node[::-1, 0]), "outer": chain(node[:, -1])}
    corners = {"inner-start": int(node[0, 0]), "outer-start": int(node[0, -1])}
    if not closed:
        edges |= {"start": chain(node[0]), "end": chain(node[-1, ::-1])}
        corners |= {"inner-end": int(node[-1, 0]), "outer-end": int(node[-1, -1])}
    curve = _round(np.array(m.centre))
    # Of a closed ring the last row of points is the first one again.
    points = points.reshape(-1, 2)[: int(cells.max()) + 1]
    return Draft(points, cells, edges, corners, {"inner": curve, "outer": curve})


# ---------------------------------------------------------------------------------------------------------------- patch
def patch(m: model.Patch) -> Draft:
    """Draft of a `prensa.Patch`.

    Raises
    ------
    MeshError
        If a side is no curve between its corners, or sides cross.

    """
    bl, br, tr, tl = (np.array(c) for c in m.corners)
    ends = {"bottom": (bl, br), "right": (br, tr), "top": (tl, tr), "left": (bl, tl)}
    grade = m.grade or ""
    towards_x = (0.0,) if "left" in grade else (1.0,) if "right" in grade else ()
    towards_y = (0.0,) if "bottom" in grade else (1.0,) if "top" in grade else ()
    u = {k: graded(0.0, 1.0, m.n[0], towards_x, m.ratio if towards_x else 1.0) for k in ("bottom", "top")}
    u |= {k: graded(0.0, 1.0, m.n[1], towards_y, m.ratio if towards_y else 1.0) for k in ("left", "right")}
    curve = {name: _curve(name, m.sides.get(name), *ends[name]) for name in ends}
    side = {}
    for name, (a, b) in ends.items():
        side[name] = curve[name](u[name])
        # A curve meets its corners only to round-off, two sides have to meet in one point.
        side[name][0], side[name][-1] = a, b
    x = _coons(side["bottom"], side["right"], side["top"], side["left"], u["bottom"], u["left"])
    node = np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])
    edges = {
        "bottom": chain(node[0]), "right": chain(node[:, -1]), "top": chain(node[-1, ::-1]), "left": chain(node[::-1, 0])
    }  # fmt: skip
    corners = {
        "bottom-left": node[0, 0],
        "bottom-right": node[0, -1],
        "top-right": node[-1, -1],
        "top-left": node[-1, 0],
    }
    curves = {name: _midpoints_along(curve[name], u[name], side[name]) for name in m.sides}
    return Draft(x.reshape(-1, 2), grid(x), edges, {k: int(v) for k, v in corners.items()}, curves)


def _coons(
    bottom: Array, right: Array, top: Array, left: Array, u: Array | None = None, v: Array | None = None
) -> Array:
    """Transfinite interpolation of four sides given at u (nx + 1,) and v (ny + 1,) → (ny + 1, nx + 1, 2)."""
    s = (np.linspace(0, 1, len(bottom)) if u is None else u)[None, :, None]
    t = (np.linspace(0, 1, len(left)) if v is None else v)[:, None, None]
    corners = (1 - s) * (1 - t) * bottom[0] + s * (1 - t) * bottom[-1] + s * t * top[-1] + (1 - s) * t * top[0]
    x = (1 - t) * bottom[None] + t * top[None] + (1 - s) * left[:, None] + s * right[:, None] - corners
    # To the digit: supports and tools look for nodes on the sides.
    x[0], x[-1], x[:, 0], x[:, -1] = bottom, top, left, right
    return np.asarray(x)


class _Curve:
    """A side as a function of its share (k,) of the length → points (k, 2)."""

    def __init__(self, a: Array, b: Array) -> None:
        self.a, self.b = a, b

    def __call__(self, s: Array) -> Array:
        return np.asarray(self.a + s[:, None] * (self.b - self.a))


class _ArcCurve(_Curve):
    def __init__(self, centre: Array, start: float, sweep: float, radius: float) -> None:
        self.centre, self.start, self.sweep, self.radius = centre, start, sweep, radius

    def __call__(self, s: Array) -> Array:
        angle = self.start + s * self.sweep
        return np.asarray(self.centre + self.radius * np.column_stack([np.cos(angle), np.sin(angle)]))


class _SplineCurve(_Curve):
    def __init__(self, points: Array) -> None:
        from scipy.interpolate import CubicSpline

        chord = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        # The parameter is the chord length; nodes are set by the arc length, which it follows only nearly.
        self.spline = CubicSpline(chord / chord[-1], points)
        fine = np.linspace(0.0, 1.0, 2001)
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.spline(fine), axis=0).T))])
        self.fine, self.share = fine, length / length[-1]

    def __call__(self, s: Array) -> Array:
        return np.asarray(self.spline(np.interp(s, self.share, self.fine)))


def _curve(name: str, side: model.ArcSide | model.SplineSide | None, a: Array, b: Array) -> _Curve:
    if isinstance(side, model.SplineSide):
        points = np.vstack([a, np.array(side.points), b])
        with np.errstate(over="ignore"):
            chords = np.hypot(*np.diff(points, axis=0).T)
            far = not np.isfinite(chords.sum() * len(chords))
        if far:
            raise MeshError(f"side {name!r}: points of the spline are too far apart to be computed with")
        share = np.cumsum(chords) / max(float(chords.sum()), SMALLEST)
        if (np.diff(share, prepend=0.0) <= 0.0).any():  # there, or so near to each other that the length does not grow
            raise MeshError(f"side {name!r}: two points of the spline are at one place")
        return _SplineCurve(points)
    if not isinstance(side, model.ArcSide):
        return _Curve(a, b)
    if side.centre is not None:
        centre = np.array(side.centre)
        radii = np.linalg.norm(a - centre), np.linalg.norm(b - centre)
        if abs(radii[0] - radii[1]) > DRAWN * max(radii):
            raise MeshError(
                f"side {name!r}: its corners are {radii[0]:g} and {radii[1]:g} from the centre {side.centre}; give 'through'"
            )
        through = None
    else:
        through = np.array(side.through)
        centre = _circumcentre(name, a, b, through)
    start = np.arctan2(*(a - centre)[::-1])
    sweep = (np.arctan2(*(b - centre)[::-1]) - start) % (2 * np.pi)
    if through is None:
        # A centre leaves both ways round open: the shorter one is meant, and 'through' says otherwise.
        sweep = sweep if sweep <= np.pi else sweep - 2 * np.pi
    elif (np.arctan2(*(through - centre)[::-1]) - start) % (2 * np.pi) > sweep:
        sweep -= 2 * np.pi
    return _ArcCurve(centre, float(start), float(sweep), float(np.linalg.norm(a - centre)))


def _circumcentre(name: str, a: Array, b: Array, c: Array) -> Array:
    """Centre of the circle through three points."""
    d = 2.0 * np.array([b - a, c - a])
    if abs(np.linalg.det(d)) <= NEGLIGIBLE * np.linalg.norm(b - a) ** 2:
        raise MeshError(f"side {name!r}: the point {c.tolist()} lies on the straight line between the corners")
    return a + np.linalg.solve(d, 0.25 * np.diag(d @ d.T))


def _midpoints_along(curve: _Curve, u: Array, nodes: Array) -> Midpoints:
    """Points of a curve half way (in its length) between neighbouring nodes, which are found by their coordinates."""
    share = {tuple(x): s for x, s in zip(nodes.tolist(), u.tolist())}

    def between(a: Array, b: Array) -> Array:
        s = [0.5 * (share[tuple(p)] + share[tuple(q)]) for p, q in zip(a.tolist(), b.tolist())]
        return curve(np.array(s))

    return between
