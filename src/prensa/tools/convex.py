"""Convex polyhedra with rounded edges: a smaller polyhedron and all that is within a radius of it.

Of the inner polyhedron {ξ: n_i·ξ ≤ d_i} the point closest to ξ outside lies on the face of the largest n_i·ξ − d_i, if the foot
there is in the polyhedron, and else on an edge or corner. Faces stay flat, edges become cylinders, corners spheres of the radius:
with the distance r = |ξ − foot| of the inner polyhedron

* beside a face ∂n/∂ξ = 0;
* beside an edge along t ∂n/∂ξ = (I − n⊗n − t⊗t)/r;
* beside a corner ∂n/∂ξ = (I − n⊗n)/r.

Points inside the inner polyhedron have the nearest plane as their surface.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from prensa.errors import PrensaError
from prensa.precision import NEGLIGIBLE, ROUND_OFF
from prensa.tools.analytic import Analytic, Closest
from prensa.types import Array, Index


class PolyhedronError(PrensaError):
    """Planes or points that make no polyhedron, or a radius that leaves nothing of it."""


class Convex(Analytic):
    """A rounded convex polyhedron.

    Parameters
    ----------
    normals, offsets
        Unit normals (f, 3) and offsets (f,) of the planes of the inner polyhedron, n·ξ ≤ d inside.
    corners
        Its corners (v, 3).
    edges
        Pairs of corners (e, 2); an edge (i, −1) is endless.
    along
        Unit vectors (e, 3) along the edges, from their first corners.
    radius
        What lies within it belongs to the body.

    """

    def __init__(self, normals: Array, offsets: Array, corners: Array, edges: Index, along: Array, radius: float) -> None:
        self.normals, self.offsets, self.corners, self.radius = normals, offsets, corners, radius
        self.pairs, self.directions = edges, along
        self._starts = corners[edges[:, 0]]
        length = np.einsum("ei,ei->e", corners[edges[:, 1]] - self._starts, along)
        self._lengths = np.where(edges[:, 1] < 0, np.inf, length)
        self.bounded = bool((edges[:, 1] >= 0).all())
        self.size = float(np.abs(corners).max(initial=0.0)) + radius

    @property
    def extent(self) -> float:  # type: ignore[override]
        """Twice the farthest corner from the reference point; 0 of a body without end."""
        return 2.0 * self.size if self.bounded else 0.0

    @property
    def centre(self) -> Array:
        """The reference point."""
        return np.zeros(3)

    def closest(self, xi: Array) -> Closest:
        """Points (k, 3) → `Closest`."""
        heights = xi @ self.normals.T - self.offsets
        face = np.argmax(heights, axis=1)
        g = heights[np.arange(len(xi)), face]
        n = self.normals[face]
        H = np.zeros((len(xi), 3, 3))
        foot = xi - g[:, None] * n
        off = (foot @ self.normals.T - self.offsets).max(axis=1, initial=-np.inf)
        scale = np.abs(xi).max(axis=1, initial=0.0) + self.size
        rows = np.flatnonzero((g > 0.0) & (off > ROUND_OFF * scale))
        if len(rows):
            g[rows], n[rows], H[rows] = self._beside_edges(xi[rows], n[rows])
        return Closest(g - self.radius, n, H)

    def _beside_edges(self, xi: Array, facing: Array) -> tuple[Array, Array, Array]:
        """Distances (k,) of the inner polyhedron, normals (k, 3) and their derivatives of points whose foot is on no face.

        ``facing`` (k, 3): normals of points that lie on an edge itself.
        """
        way = np.einsum("kei,ei->ke", xi[:, None] - self._starts, self.directions)
        at = np.clip(way, 0.0, self._lengths)
        d = xi[:, None] - self._starts - at[:, :, None] * self.directions
        square = np.einsum("kei,kei->ke", d, d)
        row, edge = np.arange(len(xi)), np.argmin(square, axis=1)
        r, t, d = np.sqrt(square[row, edge]), self.directions[edge], d[row, edge]
        on_edge = (way == at)[row, edge]
        least = ROUND_OFF * (self.size + np.abs(xi).max(axis=1))
        safe = np.maximum(r, least)
        n = np.where((r > least)[:, None], d / safe[:, None], facing)
        H = np.eye(3) - n[:, :, None] * n[:, None]
        H -= np.where(on_edge, 1.0, 0.0)[:, None, None] * t[:, :, None] * t[:, None]
        return r, n, H / safe[:, None, None]


    def facets(self, depth: float) -> tuple[Array, Index]:
        """Triangles of the surface, of endless edges a length ``depth``: points (n, 3), corners (m, 3), for pictures."""
        from scipy.spatial import ConvexHull

        endless = np.flatnonzero(self.pairs[:, 1] < 0)
        ends = self._starts[endless] + depth * self.directions[endless]
        balls = self.corners[:, None] + self.radius * np.vstack([self.normals, _directions()])
        far = ends[:, None] + self.radius * self.normals
        points = np.vstack([balls.reshape(-1, 3), far.reshape(-1, 3)])
        hull = ConvexHull(points)
        turned = np.einsum("mi,mi->m", _areas(points, hull.simplices), hull.equations[:, :3]) < 0.0
        used, triangles = np.unique(np.where(turned[:, None], hull.simplices[:, ::-1], hull.simplices), return_inverse=True)
        return points[used], triangles.reshape(-1, 3)


def _directions() -> Array:
    """Unit vectors (k, 3) all around, in steps of 15 degrees."""
    up, around = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13), np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    a, b = (angle.ravel() for angle in np.meshgrid(up, around))
    return np.stack([np.cos(a) * np.cos(b), np.sin(a), np.cos(a) * np.sin(b)], axis=1)


def _areas(points: Array, triangles: Index) -> Array:
    """Normals (m, 3) of triangles, twice as long as these are large."""
    a = points[triangles]
    return np.cross(a[:, 1] - a[:, 0], a[:, 2] - a[:, 0])


def pyramid(sides: int, angle: float, radius: float) -> Convex:
    """An endless regular pyramid that points along −y, its sharp tip at the origin; one face looks towards +x.

    ``angle``: between the axis and each face; ``radius``: of tip and edges.
    """
    about = 2.0 * np.pi * np.arange(sides) / sides
    c, s = np.cos(angle), np.sin(angle)
    normals = np.stack([c * np.cos(about), np.full(sides, -s), -c * np.sin(about)], axis=1)
    along = np.cross(np.roll(normals, -1, axis=0), normals)
    along *= np.sign(along[:, 1:2]) / np.linalg.norm(along, axis=1, keepdims=True)
    tip = np.array([[0.0, radius / s, 0.0]])
    edges = np.tile(np.array([0, -1]), (sides, 1))
    return Convex(normals, np.full(sides, -radius), tip, edges, along, radius)


def turned_by(shape: Convex, Q: Array) -> Convex:
    """A polyhedron turned by a rotation Q (3, 3)."""
    return Convex(shape.normals @ Q.T, shape.offsets, shape.corners @ Q.T, shape.pairs, shape.directions @ Q.T, shape.radius)


def planes_of(points: Array) -> tuple[Array, Array]:
    """Unit normals (f, 3) and offsets (f,) of the convex hull of points (k, 3).

    Raises
    ------
    PolyhedronError
        If the points lie in a plane.

    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        raise PolyhedronError("the points make no body: four of them at least must not lie in one plane") from None
    size = float(np.abs(points).max())
    equations = hull.equations / np.append(np.ones(3), size)
    # Faces with more than three corners come in triangles, each with its own plane.
    kept: list[Any] = []
    for row in equations:
        if not any(np.abs(row - other).max() < NEGLIGIBLE for other in kept):
            kept.append(row)
    planes = np.array(kept)
    return planes[:, :3], -size * planes[:, 3]


def polyhedron(normals: Array, offsets: Array, radius: float) -> Convex:
    """The bounded polyhedron n·ξ ≤ d of unit normals (f, 3) and offsets (f,), its edges rounded with a radius.

    Raises
    ------
    PolyhedronError
        If the planes enclose no body, or the radius leaves nothing of it.

    """
    from scipy.optimize import linprog
    from scipy.spatial import HalfspaceIntersection, QhullError

    # The middle of the largest ball inside, ξ·n + ρ ≤ d.
    ball = linprog([0.0, 0.0, 0.0, -1.0], np.column_stack([normals, np.ones(len(normals))]), offsets, bounds=[(None, None)] * 4)
    open_words = "the planes enclose no body: add those that close it, and let their normals look outwards"
    if ball.x is None:
        raise PolyhedronError(open_words)
    middle, largest = ball.x[:3], float(ball.x[3])
    if not largest > 0.0:
        raise PolyhedronError("the planes leave no body between them: normals look outwards, d is the distance along them")
    if radius >= largest:
        words = f"a radius of {radius:g} leaves nothing of the polyhedron"
        raise PolyhedronError(f"{words}: the largest ball in it has {largest:.4g}")
    inner = offsets - radius
    try:
        found = HalfspaceIntersection(np.column_stack([normals, -inner]), middle)
        corners = found.intersections
    except (QhullError, ValueError):
        raise PolyhedronError(open_words) from None
    reach = np.abs(corners - middle).max(axis=1)
    if not np.isfinite(corners).all() or reach.max() > max(largest, float(np.abs(offsets).max())) / NEGLIGIBLE:
        raise PolyhedronError(open_words)
    size = float(reach.max())
    distinct: list[Any] = []
    for c in corners:  # of corners with more than three faces there are several
        if not any(np.abs(c - other).max() < NEGLIGIBLE * size for other in distinct):
            distinct.append(c)
    corners = np.array(distinct)
    on = np.abs(corners @ normals.T - inner) < NEGLIGIBLE * size
    edges, along = [], []
    for i, j in combinations(range(len(normals)), 2):
        ends = np.flatnonzero(on[:, i] & on[:, j])
        if len(ends) == 2:
            way = corners[ends[1]] - corners[ends[0]]
            edges.append(ends)
            along.append(way / np.linalg.norm(way))
    return Convex(normals, inner, corners, np.array(edges), np.array(along), radius)
