"""Strips of a mesh of quadrilaterals or bricks: elements that share opposite sides; the shortest of each element's runs through
the thickness.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from prensa.mesh.bricks import FACES, BrickMesh
from prensa.mesh.mesh import Mesh, keys, renumbered, sides
from prensa.precision import NEGLIGIBLE
from prensa.types import Array, Flags, Index


@dataclass(frozen=True)
class Strips:
    """The strips in which each of m elements lies: along ξ in row 0, along η in row 1, in space along ζ in row 2.

    ``strip`` (d, m): its number; ``across`` (d, m, d): from the middle of the side where it enters the element to that where it
    leaves; ``sides`` (d, m, 2, a): the nodes of these.
    """

    strip: Index
    across: Array
    sides: Index

    @cached_property
    def lengths(self) -> Array:
        """Length (d, m) of the strips of each element."""
        return self._sum(np.linalg.norm(self.across, axis=2))

    @cached_property
    def numbers(self) -> Array:
        """Elements (d, m) in the strips of each element."""
        return self._sum(np.ones(self.strip.shape))

    @cached_property
    def thin(self) -> tuple[Index, Index]:
        """Of each element the row of the strip through the thickness, and its own number: an index of ``strip`` and its like."""
        near = (1.0 - NEGLIGIBLE) * self.lengths <= self.lengths.min(axis=0)  # the last one of those that are as short
        return len(near) - 1 - np.argmax(near[::-1], axis=0), np.arange(self.strip.shape[1])

    @cached_property
    def along(self) -> Flags:
        """Elements (m,) of the plane whose η is not the direction in which the body is thin; where both are as long it is."""
        # Strips and not sides are compared: along fillets the shorter side of an element may lie along the sheet.
        return np.asarray(self.lengths[0] < (1.0 - NEGLIGIBLE) * self.lengths[1])

    def _sum(self, values: Array) -> Array:
        return np.asarray(np.bincount(self.strip.ravel(), values.ravel())[self.strip])


OPPOSITE = {2: [[3, 1], [0, 2]], 3: [[5, 3], [2, 4], [0, 1]]}
"""Sides of a quadrilateral, and faces of a brick, that face each other along ξ, along η(, along ζ)."""


def strips(mesh: Mesh) -> Strips:
    """The strips of a mesh of quadrilaterals or bricks."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    ends = mesh.cells[:, FACES] if isinstance(mesh, BrickMesh) else sides(mesh.cells)[..., :2]
    middle = mesh.points[ends].mean(axis=2)
    side = side_numbers(ends, len(mesh.points))
    ways = OPPOSITE[middle.shape[2]]
    pairs = np.concatenate([side[:, pair] for pair in ways])
    n = int(side.max()) + 1
    _, strip = connected_components(coo_matrix((np.ones(len(pairs)), pairs.T), (n, n)), directed=False)
    across = np.stack([middle[:, last] - middle[:, first] for first, last in ways])
    return Strips(strip[pairs[:, 0]].reshape(len(ways), -1), across, np.stack([ends[:, pair] for pair in ways]))


def side_numbers(nodes: Index, n: int) -> Index:
    """One number (…) for the sides with the same nodes (…, a), whatever their order, of n nodes."""
    if nodes.shape[-1] == 2:
        own = np.unique(keys(nodes, n), return_inverse=True)[1]
    else:
        own = np.unique(np.sort(nodes, axis=-1).reshape(-1, nodes.shape[-1]), axis=0, return_inverse=True)[1]
    return np.asarray(own.reshape(nodes.shape[:-1]))


def thin_way_up(mesh: Mesh) -> Mesh:
    """The mesh of quadrilaterals with the nodes of each cell turned on so that η is the direction in which the body is thin."""
    turn = strips(mesh).along
    return renumbered(mesh, np.where(turn[:, None], np.roll(mesh.cells, -1, axis=1), mesh.cells)) if turn.any() else mesh
