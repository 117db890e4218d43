"""Meshes in space: bricks, whose boundaries are faces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from prensa.mesh.mesh import Mesh, MeshError
from prensa.mesh.spacing import graded
from prensa.model import meshes as model
from prensa.types import Array, Index

# corners of the six faces of a brick, seen from outside counter-clockwise
FACES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
_SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]  # corners along x and y, in the order of a brick's lower nodes


@dataclass(frozen=True)
class BrickMesh(Mesh):
    """``points`` (n, 3), ``cells`` (m, 8), ``edges``: name → faces (k, 4), seen from outside counter-clockwise.

    Raises
    ------
    MeshError
        For coordinates and node numbers that are none, nodes of no brick, a brick with a node twice, faces of more than two.

    """

    def __post_init__(self) -> None:
        points, cells = self.points, self.cells
        if not np.isfinite(points).all():
            raise MeshError(
                f"node {int(np.argwhere(~np.isfinite(points))[0, 0])} has a coordinate that is not a number"
            )
        if len(cells) == 0 or cells.min() < 0 or cells.max() >= len(points):
            raise MeshError(f"bricks need nodes of the {len(points)} that there are")
        if len(unused := np.setdiff1d(np.arange(len(points)), cells)):
            raise MeshError(f"node {unused[0]} at {points[unused[0]].tolist()} belongs to no brick; remove it")
        if len(twice := np.flatnonzero((np.diff(np.sort(cells, axis=1), axis=1) == 0).any(axis=1))):
            raise MeshError(f"brick {twice[0]} names a node twice: {cells[twice[0]].tolist()}")
        _, count = np.unique(np.sort(cells[:, FACES].reshape(-1, 4), axis=1), axis=0, return_counts=True)
        if count.max() > 2:
            raise MeshError("three bricks have a face in common: they overlap")

    def _along(self, name: str) -> Index:
        return np.unique(self.edges[name])

    @cached_property
    def boundary(self) -> Index:
        """Faces (k, 4) of one brick only."""
        return outside(self.cells)


def outside(cells: Index) -> Index:
    """Faces (k, 4) that belong to one of the bricks cells (m, 8) only."""
    faces = cells[:, FACES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def bricks_behind(faces: Index, cells: Index) -> Index:
    """The bricks (k,) of cells (m, 8) that have faces (k, 4) of the outside."""
    owner = {tuple(side): i for i, side in enumerate(np.sort(cells[:, FACES].reshape(-1, 4), axis=1).tolist())}
    return np.array([owner[tuple(face)] for face in np.sort(faces, axis=1).tolist()], dtype=np.int64) // len(FACES)


def box(m: model.Box) -> BrickMesh:
    """Mesh of a `prensa.Box`."""
    toward = [(at,) for at in m.toward] if m.toward is not None else [()] * 3
    lines = [graded(a, a + size, n, to, m.ratio) for a, size, n, to in zip(m.origin, m.size, m.n, toward)]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([len(x) for x in lines])
    a, b, c = m.n
    corners = [number[i : a + i, j : b + j, k : c + k] for k in (0, 1) for i, j in _SQUARE]
    cells = np.stack(corners, axis=-1).reshape(-1, 8)
    names = ("left", "right"), ("bottom", "top"), ("back", "front")
    sides = {name: number.take(end, axis=axis) for axis, pair in enumerate(names) for name, end in zip(pair, (0, -1))}
    return _with_boundaries(points, cells, {name: nodes.ravel() for name, nodes in sides.items()})


def from_arrays(m: model.Bricks) -> BrickMesh:
    """Mesh of a `prensa.Bricks`."""
    named = {name: np.array(nodes, dtype=np.int64) for name, nodes in m.boundaries.items()}
    return _with_boundaries(np.array(m.points, dtype=np.float64), np.array(m.cells, dtype=np.int64), named)


def _with_boundaries(points: Array, cells: Index, named: dict[str, Index]) -> BrickMesh:
    """Bricks with the faces of the outside that lists of nodes have; of one node, a named point."""
    corners = {name: int(nodes[0]) for name, nodes in named.items() if len(nodes) == 1}
    plain = BrickMesh(points, cells, {}, corners)
    faces = {name: _within(plain.boundary, nodes) for name, nodes in named.items() if len(nodes) > 1}
    if bare := [name for name, some in faces.items() if not len(some)]:
        raise MeshError(f"boundary {bare[0]!r}: no face on the outside of the bricks has all its nodes in its list")
    return BrickMesh(points, cells, faces, corners)


def _within(faces: Index, nodes: Index) -> Index:
    return faces[np.isin(faces, nodes).all(axis=1)]
