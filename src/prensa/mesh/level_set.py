"""Surface inside a mesh in space on which a nodal field is zero: sections through bodies, surfaces of tools on a grid.

Cells are divided into tetrahedra, in which the field is linear and the surface flat (marching tetrahedra: Doi & Koide 1991).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.types import Array, Index

# Tetrahedra that fill a cell by its number of nodes: of a brick those around the diagonal from corner 0 to corner 6.
_TETRAHEDRA = {
    4: [[0, 1, 2, 3]],
    8: [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]],
    10: [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], [4, 5, 6, 8], [6, 4, 7, 8], [6, 5, 9, 8], [6, 7, 9, 8]],
}


class LevelSet(NamedTuple):
    """Points on edges: ``pairs`` (k, 2) of nodes, ``share`` (k,) of the way to the second; ``triangles`` (t, 3) of them.

    A point that is a node has that node twice.
    """

    pairs: Index
    share: Array
    triangles: Index

    def of(self, values: Array) -> Array:
        """Nodal values (n, …) at the points (k, …)."""
        t = self.share.reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray((1.0 - t) * values[self.pairs[:, 0]] + t * values[self.pairs[:, 1]])


def level_set(cells: Index, values: Array) -> LevelSet:
    """The surface on which nodal values (n,) are zero inside cells (m, 8) of bricks, or (m, 4), (m, 10) of tetrahedra.

    A node whose value is zero counts as below: a side of the mesh with values zero and below has no surface on it.
    """
    tetrahedra = np.vstack([cells[:, t] for t in _TETRAHEDRA[cells.shape[1]]])
    above = values[tetrahedra] > 0.0
    count = above.sum(axis=1)
    corners = []
    for some, base in ((above, 1), (~above, 3)):  # one corner apart from the others: a triangle around it
        rows = count == base
        order = np.argsort(~some[rows], axis=1, kind="stable")
        a, b, c, d = np.take_along_axis(tetrahedra[rows], order, axis=1).T
        corners.append(np.stack([a, b, a, c, a, d], axis=1))
    rows = count == 2  # two and two: a quadrilateral, as two triangles
    a, b, c, d = np.take_along_axis(tetrahedra[rows], np.argsort(~above[rows], axis=1, kind="stable"), axis=1).T
    corners += [np.stack([a, c, a, d, b, d], axis=1), np.stack([a, c, b, d, b, c], axis=1)]
    ends = np.sort(np.concatenate(corners).reshape(-1, 2), axis=1)
    ends = np.where((values[ends] == 0.0).any(axis=1)[:, None], ends[np.arange(len(ends)), _zero(values[ends])][:, None], ends)
    pairs, where = np.unique(ends, axis=0, return_inverse=True)
    first, second = values[pairs].T
    share = np.divide(first, first - second, out=np.zeros(len(pairs)), where=pairs[:, 0] != pairs[:, 1])
    found = where.reshape(-1, 3)
    flat = (found == np.roll(found, 1, axis=1)).any(axis=1)  # two of its corners are one node
    return LevelSet(pairs, share, found[~flat])


def _zero(ends: Array) -> Index:
    """Which of both values (k, 2) at the ends of edges is zero; the first if none is."""
    return np.argmax(ends == 0.0, axis=1)
