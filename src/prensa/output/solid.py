"""Bodies in space as they are seen: faces of their outsides, sections through them, and values at the points of both."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.mesh.bricks import outside
from prensa.mesh.level_set import LevelSet, level_set
from prensa.types import Array, Index


class Shell(NamedTuple):
    """Points that are seen of a body: the nodes of its outside, then those of sections, on edges of its mesh.

    ``pairs`` (n, 2) nodes and ``share`` (n,) of the way to the second; ``faces`` (k, a) of the outside, ``sections``: triangles
    (t, 3) of each.
    """

    pairs: Index
    share: Array
    faces: Index
    sections: list[Index]

    def of(self, values: Array) -> Array:
        """Nodal values (nodes, …) of the body at the points (n, …)."""
        return LevelSet(self.pairs, self.share, self.faces).of(values)


def shell(X: Array, cells: Index, planes: list[tuple[int, float]]) -> Shell:
    """Outside of a body with initial places X (nodes, 3), and its sections by planes (axis, coordinate) across them."""
    faces = outside(cells)
    nodes, where = np.unique(faces, return_inverse=True)
    sections: list[Index] = []
    pairs, shares, count = [np.stack([nodes, nodes], axis=1)], [np.zeros(len(nodes))], len(nodes)
    for axis, at in planes:
        found = level_set(cells, X[:, axis] - at)
        pairs.append(found.pairs)
        shares.append(found.share)
        sections.append(found.triangles + count)
        count += len(found.pairs)
    return Shell(np.concatenate(pairs), np.concatenate(shares), where.reshape(faces.shape), sections)
