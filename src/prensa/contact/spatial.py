"""Contact in space: nodes of quadrilateral faces against a rigid plane, in the terms that contact forces are made of.

What `prensa.contact.integration` and `prensa.contact.pairing` are in the plane. The coordinates of a pair are
q = (body x, y, z, tool x, y, z, rx, ry, rz). The plane does not turn: its rotations are to be prescribed as zero. Their rows, the
moments, are exact, and so are their columns of gap and slip; how the frame would turn with them is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from prensa.contact.pairing import Pairs
from prensa.contact.rules.nodal import Nodal

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

_PLACE = 1.0 / 3.0**0.5
_FACE_POINTS = [(x, y) for x in (-_PLACE, _PLACE) for y in (-_PLACE, _PLACE)]
_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=np.float64)


@dataclass(frozen=True)
class HalfSpace:
    """A rigid tool behind the plane through its reference point; ``normal`` points out of it, to the body."""

    normal: tuple[float, float, float]

    period = np.inf
    edges = ()

    @cached_property
    def frame(self) -> Array:
        """Unit normal and two tangents, the rows of a right-handed (3, 3); the first tangent is nearest to a coordinate axis."""
        n = np.array(self.normal, dtype=np.float64)
        n /= np.linalg.norm(n)
        axis = np.eye(3)[np.argmin(np.abs(n))]
        t = axis - (axis @ n) * n
        t /= np.linalg.norm(t)
        return np.stack([n, t, np.cross(n, t)])


def plane_pairs(shape: HalfSpace, x: Array, at: Array, place: Array) -> Pairs:
    """Moved surface against a plane: x (k, 3) positions, at (3,), place (6,) displacement and rotations, which are zero."""
    arm = x - (at + place[:3])
    k, frame = len(arm), shape.frame
    n, e = np.tile(frame[0], (k, 1)), np.tile(frame[1:], (k, 1, 1))
    g, s = arm @ frame[0], arm @ frame[1:].T
    ds = np.stack([_generalised(e[:, i], arm) for i in range(2)], axis=1)
    return Pairs(g, s, n, e, _generalised(n, arm), ds, np.zeros((k, 3, 9)), arm, True)


def _generalised(v: Array, arm: Array) -> Array:
    """Action (k, 9) of unit forces v (k, 3) on the body points and their opposites on the tool."""
    return np.concatenate([v, -v, -np.cross(arm, v)], axis=1)


@dataclass(frozen=True)
class FacePoints:
    """Contact points that are the ``nodes`` (k,) of quadrilateral ``faces`` (m, 4), seen from outside counter-clockwise.

    ``depth`` (k,) size of the elements behind, in the initial mesh, ``pressed_length`` (k,) what of it a point presses in.
    It answers as `prensa.contact.integration.Points` does.
    """

    nodes: Index
    faces: Index
    depth: Array
    pressed_length: Array

    rule = Nodal()
    are_nodes = True
    one_a_node = True
    with_neighbours = False

    def __len__(self) -> int:
        return len(self.nodes)

    @property
    def pairs_at_axis(self) -> Index:
        """None (0, 2): bodies in space have no axis."""
        return np.zeros((0, 2), dtype=np.int64)

    @cached_property
    def support(self) -> Index:
        """Nodes (k, 1) that carry a point."""
        return self.nodes[:, None]

    @cached_property
    def N(self) -> Array:
        """Their shape values (k, 1)."""
        return np.ones((len(self), 1))

    @cached_property
    def coefficients(self) -> Array:
        """Of the nodes and the tool's reference point (k, 2) in stencils."""
        return np.tile([1.0, -1.0], (len(self), 1))

    @cached_property
    def slots(self) -> Index:
        """Places (m, 4) of the faces' nodes in ``nodes``."""
        number = np.full(int(self.nodes.max()) + 1, -1, dtype=np.int64)
        number[self.nodes] = np.arange(len(self))
        return number[self.faces]

    def weights(self, x: Array) -> Array:
        """∫ N_A dΓ (k,) on node positions x (n, 3) of the whole system, by 2 × 2 Gauss points a face."""
        parts = face_measures(x[self.faces]).ravel()
        return np.asarray(np.bincount(self.slots.ravel(), parts, len(self)), dtype=np.float64)

    def tributary(self, x: Array) -> Array:
        """The same: the points are the nodes."""
        return self.weights(x)

    def at(self, values: Array) -> Array:
        """Nodal values (n, …) of the whole system at the points (k, …)."""
        return values.take(self.nodes, axis=0)

    def to_nodes(self, values: Array) -> Array:
        """Values of the points at the nodes (k, …)."""
        return values.copy()

    def any_at_nodes(self, flags: Flags) -> Flags:
        """Flags of the points at the nodes (k,)."""
        return flags.copy()

    def normals(self, x: Array) -> Array:
        """Outward unit normals (k, 3) at the nodes, weighted by the areas of the faces."""
        a = x[self.faces]
        n = np.cross(a[:, 2] - a[:, 0], a[:, 3] - a[:, 1])
        out = np.zeros((len(self), 3))
        np.add.at(out, self.slots, n[:, None])
        return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])


def face_measures(x: Array) -> Array:
    """∫ N_A dΓ (m, 4) of bilinear faces x (m, 4, 3)."""
    out = np.zeros(x.shape[:2])
    for xi, eta in _FACE_POINTS:
        a, b = _CORNERS.T
        N = 0.25 * (1 + a * xi) * (1 + b * eta)
        along, across = (np.einsum("a,mai->mi", d, x) for d in (0.25 * a * (1 + b * eta), 0.25 * b * (1 + a * xi)))
        out += np.linalg.norm(np.cross(along, across), axis=1)[:, None] * N
    return out
