"""Strips of a mesh of quadrilaterals: elements that share opposite sides; the shorter one of each runs through the thickness."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from prensa.mesh.mesh import Mesh, keys, renumbered, sides
from prensa.precision import NEGLIGIBLE
from prensa.types import Array, Flags, Index


@dataclass(frozen=True)
class Strips:
    """The two strips in which each of m elements lies: along ξ in row 0, along η in row 1.

    ``strip`` (2, m): its number; ``across`` (2, m, 2): from the middle of the side where it enters the element to that where it
    leaves; ``sides`` (2, m, 2, 2): the nodes of these.
    """

    strip: Index
    across: Array
    sides: Index

    @cached_property
    def lengths(self) -> Array:
        """Length (2, m) of the strips of each element."""
        return self._sum(np.linalg.norm(self.across, axis=2))

    @cached_property
    def numbers(self) -> Array:
        """Elements (2, m) in the strips of each element."""
        return self._sum(np.ones(self.strip.shape))

    @cached_property
    def thin(self) -> tuple[Index, Index]:
        """Of each element the row of the strip through the thickness, and its own number: an index of ``strip`` and its like."""
        return np.where(self.along, 0, 1), np.arange(self.strip.shape[1])

    @cached_property
    def along(self) -> Flags:
        """Elements (m,) whose η is not the direction in which the body is thin; where both are as long it is."""
        # Strips and not sides are compared: along fillets the shorter side of an element may lie along the sheet.
        return np.asarray(self.lengths[0] < (1.0 - NEGLIGIBLE) * self.lengths[1])

    def _sum(self, values: Array) -> Array:
        return np.asarray(np.bincount(self.strip.ravel(), values.ravel())[self.strip])


def strips(mesh: Mesh) -> Strips:
    """The strips of a mesh of quadrilaterals."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    ends = sides(mesh.cells)[..., :2]
    middle = mesh.points[ends].mean(axis=2)
    edge = np.unique(keys(ends, len(mesh.points)), return_inverse=True)[1].reshape(-1, 4)
    # sides 3 and 1 face each other along ξ, 0 and 2 along η
    pairs = np.concatenate([edge[:, [3, 1]], edge[:, [0, 2]]])
    n = int(edge.max()) + 1
    _, strip = connected_components(coo_matrix((np.ones(len(pairs)), pairs.T), (n, n)), directed=False)
    across = np.stack([middle[:, 1] - middle[:, 3], middle[:, 2] - middle[:, 0]])
    return Strips(strip[pairs[:, 0]].reshape(2, -1), across, np.stack([ends[:, [3, 1]], ends[:, [0, 2]]]))


def thin_way_up(mesh: Mesh) -> Mesh:
    """The mesh of quadrilaterals with the nodes of each cell turned on so that η is the direction in which the body is thin."""
    turn = strips(mesh).along
    return renumbered(mesh, np.where(turn[:, None], np.roll(mesh.cells, -1, axis=1), mesh.cells)) if turn.any() else mesh
