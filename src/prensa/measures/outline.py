"""Outlines of deformed bodies, exactly: places on element edges by their shape functions, not by the nearest node.

An edge (2 or 3 nodes: its ends, then the node between) is run through by s ∈ [−1, 1]; with body on the left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.measures.measure import MeasureError
from prensa.mesh.faces import nearest_on_faces
from prensa.precision import EPS, NEGLIGIBLE, SMALLEST
from prensa.types import Array, Flags, Index


class Spot(NamedTuple):
    """A place carried by k nodes: shape functions N (k,), slopes dN and second slopes ddN (k,) along the edge.

    ``slide`` (k, 2): how s moves with the positions of the nodes; zero where the place stays with the material.
    ``at``: number of its edge along the outline plus (s + 1)/2; not a number for a single node.
    """

    nodes: Index
    N: Array
    dN: Array
    ddN: Array
    slide: Array
    at: float = float("nan")

    def of(self, values: Array) -> Array:
        """Values (…) there of nodal values (n, …)."""
        return np.asarray(self.N @ values[self.nodes])

    def slopes(self, x: Array) -> Array:
        """∂(position)/∂x (2, k, 2) of nodes at x (n, 2)."""
        moving = np.einsum("i,kj->ikj", self.dN @ x[self.nodes], self.slide)
        return moving + np.einsum("k,ij->ikj", self.N, np.eye(x.shape[1]))

    def tangent(self, x: Array) -> tuple[Array, Array]:
        """Tangent (2,) along the edge, not normalised, and its derivative (2, k, 2)."""
        if np.isnan(self.at):
            raise MeasureError("a single node has no direction; name a boundary and a place on it, 'body.boundary at x=…'")
        moving = np.einsum("i,kj->ikj", self.ddN @ x[self.nodes], self.slide)
        return self.dN @ x[self.nodes], moving + np.einsum("k,ij->ikj", self.dN, np.eye(2))


def node(number: int, dimension: int = 2) -> Spot:
    """A node as a place, in space of a dimension."""
    zero = np.zeros(1)
    return Spot(np.array([number], dtype=np.int64), np.ones(1), zero, zero, np.zeros((1, dimension)))


def functions(s: float, nodes: int) -> tuple[Array, Array, Array]:
    """Shape functions (k,) of an edge of 2 or 3 nodes at s, and their first and second slopes."""
    if nodes == 2:
        return np.array([1.0 - s, 1.0 + s]) / 2, np.array([-0.5, 0.5]), np.zeros(2)
    N = np.array([0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s])
    return N, np.array([s - 0.5, s + 0.5, -2.0 * s]), np.array([1.0, 1.0, -2.0])


def spot(edges: Index, number: int, s: float) -> Spot:
    """The place s on edge *number* of an outline, staying with the material."""
    nodes = edges[number]
    N, dN, ddN = functions(s, len(nodes))
    return Spot(nodes, N, dN, ddN, np.zeros((len(nodes), 2)), number + (s + 1.0) / 2)


def in_order(edges: Index) -> Index:
    """Edges (k, 2|3), chain after chain, each in walking order."""
    by_start = {int(e[0]): i for i, e in enumerate(edges)}
    ends = set(edges[:, 1].tolist())
    starts = [a for a in by_start if a not in ends]
    order: list[int] = []
    left = dict(by_start)
    for start in [*starts, *by_start]:
        at: int | None = start
        while at is not None and at in left:
            order.append(left.pop(at))
            at = int(edges[order[-1], 1])
    order += [i for i in range(len(edges)) if i not in set(order)]  # where chains meet in a node
    return edges[order]


def _polynomials(c: Array, edges: Index) -> tuple[Array, Array, Array]:
    """Coefficients a, b, c (k,) of a s² + b s + c for nodal values c (n,) along each edge."""
    first, last = c[edges[:, 0]], c[edges[:, 1]]
    if edges.shape[1] == 2:
        return np.zeros(len(edges)), 0.5 * (last - first), 0.5 * (last + first)
    middle = c[edges[:, 2]]
    return 0.5 * (first + last) - middle, 0.5 * (last - first), middle


def crossings(x: Array, edges: Index, values: Array, level: float, axis: int, material: bool) -> list[Spot]:
    """Places where nodal values (n,) along an outline are *level*, in walking order, a common end of two edges once.

    ``axis``: which coordinate the values are; ``material``: of the initial position, so that the places stay with the material.
    """
    a, b, c = _polynomials(values - level, edges)
    size = float(np.ptp(values[edges])) if len(edges) else 0.0
    close = NEGLIGIBLE * max(size, SMALLEST)
    found: list[Spot] = []
    for e in np.flatnonzero((np.abs(a) + np.abs(b) >= np.abs(c) - close) & (np.abs(a) + np.abs(b) > close)):
        for s in _roots(a[e], b[e], c[e]):
            # An end of the outline on the level misses it by round-off: it counts, and is put on its edge.
            beyond = 4.0 * close / (abs(a[e]) + abs(b[e]))
            if abs(s) <= 1.0 + beyond:
                place = spot(edges, int(e), min(max(s, -1.0), 1.0))
                if not material:
                    place = _sliding(place, values, axis)
                if all(np.abs(place.of(x) - other.of(x)).max() > 10 * close for other in found):
                    found.append(place)
    return found


def on_level(edges: Index, values: Array, level: float) -> Flags:
    """Edges (k,) along which nodal values (n,) are *level* all the way: no place on them is singled out by it."""
    size = float(np.ptp(values[edges])) if len(edges) else 0.0
    close = NEGLIGIBLE * max(size, abs(level), SMALLEST)
    return np.asarray((np.abs(values[edges] - level) <= close).all(axis=1))


def _roots(a: float, b: float, c: float) -> list[float]:
    """Real roots of a s² + b s + c, without cancellation."""
    if abs(a) <= EPS * abs(b):
        return [-c / b]
    under = b * b - 4.0 * a * c
    if under < 0.0:
        return []
    q = -0.5 * (b + np.copysign(np.sqrt(under), b))
    return sorted({q / a, c / q if q else 0.0})


def _sliding(place: Spot, values: Array, axis: int) -> Spot:
    """The place with how it slides along its edge when nodes move: c(s) stays, so ds = −N dc / c'(s)."""
    rate = float(place.dN @ values[place.nodes])
    slide = np.zeros((len(place.nodes), 2))
    if rate != 0.0:
        slide[:, axis] = -place.N / rate
    return place._replace(slide=slide)


def extreme(edges: Index, values: Array, sign: float) -> Spot:
    """Where nodal values (n,) along an outline are largest (sign 1) or smallest (−1).

    The place moves along the outline when nodes move, but the value there changes as if it stayed (it is stationary). On
    bilinear faces (k, 4) it is a node, on quadratic triangles (k, 6) it lies on their sides or inside.
    """
    if edges.shape[1] == 4:
        nodes = np.unique(edges)
        return node(int(nodes[np.argmax(sign * values[nodes])]), 3)
    if edges.shape[1] == 6:
        return _extreme_on_triangles(edges, values, sign)
    a, b, c = _polynomials(sign * values, edges)
    inside = np.divide(-b, 2.0 * a, out=np.ones(len(a)), where=a < 0.0)
    candidates = np.stack([-np.ones(len(a)), np.clip(inside, -1.0, 1.0), np.ones(len(a))], axis=1)
    heights = (a[:, None] * candidates + b[:, None]) * candidates + c[:, None]
    e, k = np.unravel_index(int(np.argmax(heights)), heights.shape)
    return spot(edges, int(e), float(candidates[e, k]))


def _extreme_on_triangles(faces: Index, values: Array, sign: float) -> Spot:
    """As `extreme`, on quadratic triangles (k, 6): corners, then the middles of sides 0-1, 1-2, 2-0."""
    on_side = extreme(faces[:, [[0, 1, 3], [1, 2, 4], [2, 0, 5]]].reshape(-1, 3), values, sign)
    best = on_side._replace(slide=np.zeros((3, 3)), at=float("nan"))
    f = sign * values[faces]
    # f0 + b·u + u·A u / 2 of the coordinates u along sides 0-1 and 0-2
    b = np.stack([-3.0 * f[:, 0] - f[:, 1] + 4.0 * f[:, 3], -3.0 * f[:, 0] - f[:, 2] + 4.0 * f[:, 5]], axis=1)
    a11, a22 = (4.0 * (f[:, 0] + f[:, i] - 2.0 * f[:, j]) for i, j in ((1, 3), (2, 5)))
    a12 = 4.0 * (f[:, 0] - f[:, 3] + f[:, 4] - f[:, 5])
    det = a11 * a22 - a12**2
    top = (det > 0.0) & (a11 < 0.0)
    det = np.where(top, det, 1.0)
    u, v = (a12 * b[:, 1] - a22 * b[:, 0]) / det, (a12 * b[:, 0] - a11 * b[:, 1]) / det
    top &= (u > 0.0) & (v > 0.0) & (u + v < 1.0)
    height = np.where(top, f[:, 0] + 0.5 * (b[:, 0] * u + b[:, 1] * v), -np.inf)
    k = int(np.argmax(height))
    if not height[k] > sign * float(best.of(values)):
        return best
    w, u, v = 1.0 - u[k] - v[k], u[k], v[k]
    N = np.array([w * (2 * w - 1), u * (2 * u - 1), v * (2 * v - 1), 4 * w * u, 4 * u * v, 4 * v * w])
    return Spot(faces[k], N, np.zeros(6), np.zeros(6), np.zeros((6, 3)))


def between(x: Array, edges: Index, first: Spot, last: Spot) -> Array:
    """Points (m, 2) of an outline from one place to another: both, the nodes between, and where that is too few, more."""
    low, high = sorted((first, last), key=lambda p: p.at)
    ends = len(edges)
    part = edges.shape[1] - 1  # nodes lie at whole numbers, of quadratic edges at halves too
    places = [low.at, *(k / part for k in range(part * ends + 1) if low.at < k / part < high.at), high.at]
    if len(places) < 4:
        places = np.linspace(low.at, high.at, 5).tolist()
    out = []
    for at in places:
        e = min(int(at), ends - 1)
        out.append(spot(edges, e, 2.0 * (at - e) - 1.0).of(x))
    return np.array(out)


def circle_curvature(points: Array) -> float:
    """Signed curvature of the circle (or line) fitted to points (m, 2) by Pratt (1987), positive where they turn left.

    A (x² + y²) + D x + E y + F = 0 with D² + E² − 4 A F = 1: lines are circles with A = 0. m ≥ 3.
    """
    centre = points.mean(axis=0)
    # About the middle and over the size: sums of fourth powers of coordinates far from the origin would cancel.
    size = float(np.abs(points - centre).max())
    p = (points - centre) / size
    Z = np.column_stack([(p**2).sum(axis=1), p, np.ones(len(p))])
    # least |Z v| under v·B v = 1: of the eigenvectors of B⁻¹ Zᵀ Z that with the smallest non-negative value
    inverse = np.array([[0.0, 0.0, 0.0, -0.5], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-0.5, 0.0, 0.0, 0.0]])
    _, vectors = np.linalg.eig(inverse @ Z.T @ Z)
    v_all = vectors.real.T
    norms = [float(v[1] ** 2 + v[2] ** 2 - 4.0 * v[0] * v[3]) for v in v_all]
    misfit = [float(((Z @ v) ** 2).sum()) / n if n > 0 else np.inf for v, n in zip(v_all, norms)]
    best = int(np.argmin(misfit))
    A, D, E, _ = v_all[best] / np.sqrt(norms[best])
    way = p[-1] - p[0]
    middle = p[len(p) // 2]
    gradient = 2.0 * A * middle + (D, E)  # away from the centre where A > 0
    left = float(gradient[0] * -way[1] + gradient[1] * way[0])
    return float(-2.0 * A * np.sign(left)) / size


def nearest(points: Array, x: Array, edges: Index) -> Array:
    """Distances (m,) of points (m, d) from an outline of edges (k, 2|3), in space of faces (k, 4), on nodes x (n, d)."""
    if edges.shape[1] == 4:
        return nearest_on_faces(points, x, edges)
    return np.array([_distance(p, x[edges]) for p in points])


def _distance(p: Array, corners: Array) -> float:
    """Distance of a point (2,) from edges with nodes at corners (k, 2|3, 2)."""
    first, last = corners[:, 0] - p, corners[:, 1] - p
    way = last - first
    length = np.maximum((way**2).sum(axis=1), SMALLEST)
    s = np.clip(-2.0 * (first * way).sum(axis=1) / length - 1.0, -1.0, 1.0)
    if corners.shape[1] == 2:
        r = first + 0.5 * (s + 1.0)[:, None] * way
        return float(np.sqrt((r**2).sum(axis=1).min()))
    middle = corners[:, 2] - p
    a, b = 0.5 * (first + last) - middle, 0.5 * way
    for _ in range(20):  # Newton for r·r' = 0
        r, dr = (a * s[:, None] + b) * s[:, None] + middle, 2.0 * a * s[:, None] + b
        curve = (dr**2).sum(axis=1) + 2.0 * (r * a).sum(axis=1)
        # Where the distance is not convex in s, Gauss and Newton's step still goes downhill.
        step = (r * dr).sum(axis=1) / np.where(curve > 0, curve, (dr**2).sum(axis=1) + SMALLEST)
        s = np.clip(s - step, -1.0, 1.0)
    r = (a * s[:, None] + b) * s[:, None] + middle
    # Newton may have come to a foot that is not the nearest: the ends are looked at besides.
    ends = np.minimum((first**2).sum(axis=1), (last**2).sum(axis=1))
    return float(np.sqrt(np.minimum((r**2).sum(axis=1), ends).min()))


def length(x: Array, edges: Index) -> Array:
    """Lengths (k,) of edges on nodes x (n, 2): of quadratic ones by 5 Gauss points."""
    if edges.shape[1] == 2:
        return np.asarray(np.hypot(*(x[edges[:, 1]] - x[edges[:, 0]]).T))
    at, weight = np.polynomial.legendre.leggauss(5)
    slopes = np.array([functions(float(s), 3)[1] for s in at])
    along = np.einsum("qa,kai->kqi", slopes, x[edges])
    return np.asarray(np.hypot(along[..., 0], along[..., 1]) @ weight)
