"""Contact points on surfaces in space: nodes of faces, as `prensa.contact.integration` has them in the plane.

Those of quadrilaterals are their corners. Of triangles of six nodes they are the three in the middle of the sides: the shape
functions of the corners have no mean, and the points in the middle, with a third of the area each, integrate quadratic fields
(Zienkiewicz & Taylor 2000, vol. 1, ch. 9).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from prensa.contact.integration import SPREAD
from prensa.contact.rules.nodal import Nodal
from prensa.layout import Field
from prensa.mesh.bricks import bricks_behind
from prensa.types import Array, Flags, Index

_FACE_POINTS = list(product(np.polynomial.legendre.leggauss(2)[0].tolist(), repeat=2))
_SLOPES = np.array([
    [(-1, 1, 0, 0, 0, 0), (-1, 0, -1, -2, 2, 2)], [(1, 1, 0, -2, 2, -2), (1, 0, 1, -2, 2, -2)],
    [(-1, -1, 0, 2, 2, -2), (-1, 0, 1, 0, 0, 0)],
], dtype=np.float64)  # fmt: skip
"""Slopes (2, 6) in ξ and η of the shape functions of a triangle of six nodes, at each of those in the middle of its sides."""
_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=np.float64)


@dataclass(frozen=True)
class FacePoints:
    """Contact points that are the ``nodes`` (k,) of ``faces`` (m, 4 | 6), seen from outside counter-clockwise.

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

    @cached_property
    def has_point(self) -> Flags:
        """Whether a node (k,) has a point: all do."""
        return np.ones(len(self), dtype=bool)

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
        """Places (m, 4 | 3) in ``nodes`` of the faces' nodes that are points."""
        number = np.full(int(self.nodes.max()) + 1, -1, dtype=np.int64)
        number[self.nodes] = np.arange(len(self))
        return number[_bearing(self.faces)]

    def weights(self, x: Array) -> Array:
        """∫ N_A dΓ (k,) on node positions x (n, 3) of the whole system, by 2 × 2 Gauss points a face, of six nodes by three."""
        parts = face_measures(x[self.faces]).ravel()
        return np.asarray(np.bincount(self.slots.ravel(), parts, len(self)), dtype=np.float64)

    def tributary(self, x: Array) -> Array:
        """The same: the points are the nodes."""
        return self.weights(x)

    @cached_property
    def beside(self) -> tuple[Index, Index]:
        """Points and faces, pair by pair, of which a point is a node of a face: once each, wedges name nodes twice."""
        pairs = np.stack([self.slots.ravel(), np.repeat(np.arange(len(self.faces)), self.slots.shape[1])], axis=1)
        point, face = np.unique(pairs, axis=0).T
        return point, face

    def stretched_dofs(self, field: Field, dofs: Index, own: Index) -> Index:
        """Degrees of freedom (m, 12 | 18 + w + 4 t | 3 t) of `stretching`: of faces, of the tool, the points' ``own`` (k, t).

        ``field`` of the displacements, dofs (k, 3 + w) of the stencils, of which all but the first three are the same for all.
        """
        m = len(self.faces)
        tool = np.broadcast_to(dofs[:1, 3:], (m, dofs.shape[1] - 3))
        return np.hstack([field.dofs(self.faces).reshape(m, -1), tool, own[self.slots].reshape(m, -1)])

    def stretching(self, x: Array, force: Array, own: Array) -> Array:
        """Stiffness (m, q, q) of areas that change with all nodes of the faces, on positions x (n, 3), q as of `stretched_dofs`.

        force (k, 3 + w): forces on node and tool per area of the points; own (k, t): what their own equations gain per area.
        """
        slopes = measure_slopes(x[self.faces])
        m, points, nodes = slopes.shape[:3]
        d, t = 3 * nodes, own.shape[1]
        tool = slice(d, d + force.shape[1] - 3)
        K = np.zeros((m, tool.stop + points * t, tool.stop + points * t))
        for j, slot in enumerate(self.slots.T):
            by_x, f = slopes[:, j].reshape(m, 1, d), force[slot][:, :, None]
            node, row = 3 * (nodes - points + j if nodes == 6 else j), tool.stop + t * j
            K[:, node : node + 3, :d] -= f[:, :3] * by_x
            K[:, tool, :d] -= f[:, 3:] * by_x
            K[:, row : row + t, :d] += own[slot][:, :, None] * by_x
        return K

    def at(self, values: Array) -> Array:
        """Nodal values (n, …) of the whole system at the points (k, …)."""
        return values.take(self.nodes, axis=0)

    def to_nodes(self, values: Array) -> Array:
        """Values of the points at the nodes (k, …)."""
        return values.copy()

    def any_at_nodes(self, flags: Flags) -> Flags:
        """Flags of the points at the nodes (k,)."""
        return flags.copy()

    def elements_behind(self, cells: Index) -> Index:
        """Elements (m,) of cells (e, 8 | 10) that the faces are sides of."""
        return bricks_behind(self.faces, cells)

    def node_normals(self, x: Array) -> Array:
        """`normals`: the points are the nodes."""
        return self.normals(x)

    def normals(self, x: Array) -> Array:
        """Outward unit normals (k, 3) at the nodes, weighted by the areas of the faces."""
        a = x[self.faces]
        out = np.zeros((len(self), 3))
        if self.faces.shape[1] == 6:
            np.add.at(out, self.slots, _at_sides(a))
            return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])
        # Half the cross product of the diagonals is the area vector of a bilinear face, warped ones included.
        n = np.cross(a[:, 2] - a[:, 0], a[:, 3] - a[:, 1])
        np.add.at(out, self.slots, n[:, None])
        return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])


def face_points(X: Array, cells: Index, faces: Index, volume: Array) -> FacePoints:
    """Points at nodes of faces (k, 4 | 6) of cells (m, 8 | 10) of the initial volume (m,), at positions X (n, 3)."""
    nodes = np.unique(_bearing(faces))
    return FacePoints(nodes, faces, *_depths(X, faces, volume[bricks_behind(faces, cells)], nodes))


def _depths(X: Array, faces: Index, volume: Array, nodes: Index) -> tuple[Array, Array]:
    """Means at the nodes (k,) of the size of elements into the body, volume (m,) over area, and of what of it a point presses in.

    That is no more than `SPREAD` times the width of the face, its area over its longest side.
    """
    x, bearing = X[faces], _bearing(faces)
    area, ends = face_measures(x).sum(axis=1), bearing.ravel()
    x = x[:, :3] if faces.shape[1] == 6 else x
    longest = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).max(axis=1)
    into = volume / area
    sums = [np.bincount(ends, np.repeat(h, bearing.shape[1])) for h in (into, np.minimum(into, SPREAD * area / longest))]
    depth, pressed = (total[nodes] / np.bincount(ends)[nodes] for total in sums)
    return depth, pressed


def face_measures(x: Array) -> Array:
    """∫ N_A dΓ (m, 4) of bilinear faces x (m, 4, 3), (m, 3) of the middles of quadratic ones (m, 6, 3)."""
    if x.shape[1] == 6:
        return np.asarray(np.linalg.norm(_at_sides(x), axis=2))
    out = np.zeros(x.shape[:2])
    for xi, eta in _FACE_POINTS:
        a, b = _CORNERS.T
        N = 0.25 * (1 + a * xi) * (1 + b * eta)
        along, across = (np.einsum("a,mai->mi", d, x) for d in (0.25 * a * (1 + b * eta), 0.25 * b * (1 + a * xi)))
        out += np.linalg.norm(np.cross(along, across), axis=1)[:, None] * N
    return out


def measure_slopes(x: Array) -> Array:
    """Derivatives (m, 4, 4, 3) of `face_measures` by the nodes of bilinear faces x (m, 4, 3), (m, 3, 6, 3) of those of six.

    ∂|a × b| of the tangents a, b at a point is (b × ν)·∂a + (ν × a)·∂b, ν their unit normal.
    """
    if x.shape[1] == 6:
        # A point in the middle of a side has the area at it alone.
        return np.stack([_by_tangents(x, *slopes) / 6.0 for slopes in _SLOPES], axis=1)
    out, (a, b) = np.zeros((len(x), 4, 4, 3)), _CORNERS.T
    for xi, eta in _FACE_POINTS:
        N = 0.25 * (1 + a * xi) * (1 + b * eta)
        by_x = _by_tangents(x, 0.25 * a * (1 + b * eta), 0.25 * b * (1 + a * xi))
        out += N[:, None, None] * by_x[:, None]
    return out


def _by_tangents(x: Array, along: Array, across: Array) -> Array:
    """Derivatives (m, nodes, 3) of |a × b| by the nodes x (m, nodes, 3), a = Σ along_c x_c and b = Σ across_c x_c."""
    a, b = (np.einsum("c,mci->mi", slopes, x) for slopes in (along, across))
    normal = np.cross(a, b)
    size = np.linalg.norm(normal, axis=1)[:, None]
    # A face that an iterate folds to a line has no normal: its area has a kink there.
    normal = normal / np.where(size > 0.0, size, 1.0)
    return np.asarray(along[:, None] * np.cross(b, normal)[:, None] + across[:, None] * np.cross(normal, a)[:, None])


def _bearing(faces: Index) -> Index:
    """Nodes (m, 4 | 3) of faces that are contact points."""
    return faces if faces.shape[1] == 4 else faces[:, 3:]


def _at_sides(x: Array) -> Array:
    """Outward area vectors (m, 3, 3) of the nodes in the middle of the sides of triangles x (m, 6, 3)."""
    along, across = np.einsum("qda,mai->dmqi", _SLOPES, x)
    return np.asarray(np.cross(along, across) / 6.0)
