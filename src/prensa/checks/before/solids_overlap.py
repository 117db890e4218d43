"""Bodies in space that lie in one another, or on one another, as they are drawn: by rays through their faces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import NOTABLE_DEPTH, TOUCHING_DEPTH
from prensa.mesh.faces import nearest_on_faces
from prensa.precision import DRAWN, SMALLEST
from prensa.types import Array, Flags, Index

_ASKEW = np.linalg.qr(np.array([(2, 3, 5), (7, 11, 13), (17, 19, 29)]))[0]
_ASKEW[:, 2] *= np.sign(np.linalg.det(_ASKEW))
"""Axes of no mesh: rays along them pass no node exactly."""


class Solid(NamedTuple):
    """A body: ``places`` (n, 3) to look at, node positions ``points``, ``faces`` (k, 4 | 6) of the outside."""

    body: str
    places: Array
    points: Array
    faces: Index

    @property
    def corners(self) -> Index:
        """Corners (k, 4) of the faces, of triangles one of them twice."""
        return self.faces[:, [0, 1, 2, 2]] if self.faces.shape[1] == 6 else self.faces

    @property
    def sizes(self) -> Array:
        """Longest sides (k,) of the faces."""
        x = self.points[self.corners]
        return np.asarray(np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).max(axis=1))


def solid(body: str, points: Array, cells: Index, faces: Index) -> Solid:
    """A body of nodes at ``points`` (n, 3); nodes of the outside, and the middles of cells, since bars may cross."""
    return Solid(body, np.concatenate([points[np.unique(faces)], points[cells].mean(axis=1)]), points, faces)


def deepest(one: Solid, other: Solid) -> tuple[Array, float]:
    """Place (3,) of one body that lies deepest in another, and how deep; 0 where that is what chords of round sides overlap."""
    from scipy.spatial import cKDTree

    low, high = other.points.min(axis=0), other.points.max(axis=0)
    places = one.places[((one.places > low) & (one.places < high)).all(axis=1)]
    places = places[enclosed(places, other)]
    if not len(places):
        return np.zeros(3), 0.0
    away, face = cKDTree(other.points[other.corners].mean(axis=1)).query(places)
    k = int(np.argmax(away))  # from the middles of faces: next to what is deepest
    depth = float(nearest_on_faces(places[k : k + 1], other.points, other.faces)[0])
    return places[k], depth if depth > TOUCHING_DEPTH * other.sizes[face[k]] else 0.0


def lies_on(one: Solid, other: Solid) -> Array | None:
    """Middle (3,) of a face of one body whose corners and middle lie on the outside of another; None without any."""
    corners, near = one.points[one.corners], TOUCHING_DEPTH * min(one.sizes.min(), other.sizes.min())
    low, high = other.points.min(axis=0) - near, other.points.max(axis=0) + near
    inside = corners[((corners > low) & (corners < high)).all(axis=(1, 2))]
    for x in inside:  # of those that are near most do
        places = np.concatenate([x, x.mean(axis=0, keepdims=True)])
        if (nearest_on_faces(places, other.points, other.faces) <= near).all():
            return np.asarray(places[-1])
    return None


def enclosed(x: Array, of: Solid) -> Flags:
    """Whether places x (n, 3) lie in a body."""
    return windings(x, of) > 0


def windings(x: Array, of: Solid) -> Index:
    """How often places x (n, 3) lie in a body, twice where it has passed through itself: faces by which a ray leaves it.

    Less those by which it enters. Of quadrilaterals the two triangles on one diagonal count, of others that of the corners.
    """
    from scipy.spatial import cKDTree

    c = of.corners
    triangles = c[:, :3] if of.faces.shape[1] == 6 else np.concatenate([c[:, [0, 1, 2]], c[:, [0, 2, 3]]])
    x, points = x @ _ASKEW, of.points @ _ASKEW
    flat = points[triangles][..., [0, 2]]
    middle = flat.mean(axis=1)
    reach = (1.0 + DRAWN) * np.linalg.norm(flat - middle[:, None], axis=2).max(axis=1)
    found = cKDTree(x[:, [0, 2]]).query_ball_point(middle, reach)
    triangle = triangles[np.repeat(np.arange(len(triangles)), [len(f) for f in found])]
    place = np.fromiter((j for f in found for j in f), dtype=np.int64, count=len(triangle))
    leaves = _leaves(x[place], points, triangle)
    return np.bincount(place, leaves, minlength=len(x)).round().astype(np.int64)


def _leaves(x: Array, points: Array, triangles: Index) -> Index:
    """Whether a ray along the second axis from each place x (k, 3) passes a triangle (k, 3): 1 from behind, -1 from before.

    Sides count from the lower node number on, and as half open: of triangles with a common side one alone has a place on it.
    """
    within = np.zeros(len(x), dtype=bool)
    for pair in (0, 1), (1, 2), (0, 2):
        ends = np.sort(triangles[:, pair], axis=1)
        a, b = points[ends[:, 0]], points[ends[:, 1]]
        across = (b[:, 2] > x[:, 2]) != (a[:, 2] > x[:, 2])
        rise = np.where(b[:, 2] == a[:, 2], 1.0, b[:, 2] - a[:, 2])
        within ^= across & (a[:, 0] + (x[:, 2] - a[:, 2]) / rise * (b[:, 0] - a[:, 0]) > x[:, 0])
    a, b, c = (points[triangles[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    along = ((x - a)[:, [0, 2]] * n[:, [0, 2]]).sum(axis=1)
    above = a[:, 1] - along / np.where(n[:, 1] == 0.0, 1.0, n[:, 1]) > x[:, 1]
    return np.where(within & above, np.sign(n[:, 1]), 0.0).astype(np.int64)


def twice_inside(of: Solid) -> Array:
    """Places (k, 3) of nodes on the outside of a body that lie in it once more, deeper than `NOTABLE_DEPTH` of their edges.

    A place that lies so far behind a node belongs to the body once; where another part of it has come there, twice.
    """
    c, x = of.corners, of.points
    area = np.cross(x[c[:, 2]] - x[c[:, 0]], x[c[:, 3]] - x[c[:, 1]])
    normal, least = np.zeros_like(x), np.full(len(x), np.inf)
    np.add.at(normal, c, area[:, None])
    edges = np.linalg.norm(np.roll(x[c], -1, axis=1) - x[c], axis=2)
    edges[edges == 0.0] = np.inf
    for node in c.T:
        np.minimum.at(least, node, edges.min(axis=1))
    nodes = np.unique(c)
    n = normal[nodes] / np.maximum(np.linalg.norm(normal[nodes], axis=1), SMALLEST)[:, None]
    behind = x[nodes] - NOTABLE_DEPTH * least[nodes, None] * n
    return np.asarray(x[nodes][windings(behind, of) > 1])
