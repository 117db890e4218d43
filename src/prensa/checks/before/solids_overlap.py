"""Bodies in space that lie in one another, or on one another, as they are drawn: by rays through their faces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import TOUCHING_DEPTH
from prensa.mesh.faces import nearest_on_faces
from prensa.types import Array, Flags, Index

AT_ONCE = 64
"""Faces of which is asked together whether they lie on another body: most of those that are near do."""


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
    for x in np.split(inside, range(AT_ONCE, len(inside), AT_ONCE)):
        places = np.concatenate([x, x.mean(axis=1, keepdims=True)], axis=1)
        gaps = nearest_on_faces(places.reshape(-1, 3), other.points, other.faces).reshape(places.shape[:2])
        if len(x) and (on := (gaps <= near).all(axis=1)).any():
            return np.asarray(places[np.argmax(on), -1])
    return None


def enclosed(x: Array, of: Solid) -> Flags:
    """Whether places x (n, 3) lie in a body: a ray along y leaves it an odd number of times above them."""
    from scipy.spatial import cKDTree

    c = of.corners
    triangles = c[:, :3] if of.faces.shape[1] == 6 else np.concatenate([c[:, [0, 1, 2]], c[:, [0, 2, 3]]])
    flat = of.points[triangles][..., [0, 2]]
    middle = flat.mean(axis=1)
    reach = float(np.linalg.norm(flat - middle[:, None], axis=2).max())
    found = cKDTree(middle).query_ball_point(x[:, [0, 2]], reach)
    place = np.repeat(np.arange(len(x)), [len(f) for f in found])
    triangle = triangles[np.fromiter((j for f in found for j in f), dtype=np.int64, count=len(place))]
    under = _under(x[place], of.points, triangle)
    return np.asarray(np.bincount(place[under], minlength=len(x)) % 2 == 1)


def _under(x: Array, points: Array, triangles: Index) -> Flags:
    """Whether each place x (k, 3) lies below a triangle (k, 3), seen along y.

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
    return np.asarray(within & (a[:, 1] - along / np.where(n[:, 1] == 0.0, 1.0, n[:, 1]) > x[:, 1]))
