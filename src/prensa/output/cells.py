"""Drawing and names of cells by their number of nodes: the polygon around, triangles inside, the type in VTK."""

from __future__ import annotations

import numpy as np

from prensa.mesh.bricks import outside
from prensa.types import Array, Index

VTK_IN_SPACE = {8: "hexahedron", 10: "tetra10"}
VTK = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8"}
MOST_EDGES = 2500  # sides of elements, or faces, that can be distinguished in a picture

_AROUND = {3: [0, 1, 2], 4: [0, 1, 2, 3], 6: [0, 3, 1, 4, 2, 5], 8: [0, 4, 1, 5, 2, 6, 3, 7]}
_INSIDE = {
    3: [[0, 1, 2]],
    4: [[0, 1, 2], [0, 2, 3]],
    6: [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    8: [[0, 4, 7], [4, 1, 5], [5, 2, 6], [6, 3, 7], [4, 5, 7], [5, 6, 7]],
}


def vtk_type(cells: Index, dimension: int) -> str:
    """Name of meshio for the cell type of VTK."""
    return VTK_IN_SPACE[cells.shape[1]] if dimension == 3 else VTK[cells.shape[1]]


def to_corners(values: Array, cells: Index, nodes: Index) -> None:
    """Give the corners of tetrahedra (m, 10) values (n,), in place, of contact points: ``nodes`` (k,) in the middle of sides.

    Means over the faces around them that have all their points among these nodes.
    """
    if cells.shape[1] != 10:
        return
    faces = outside(cells)
    faces = faces[np.isin(faces[:, 3:], nodes).all(axis=1)]
    corners, mean = faces[:, :3].ravel(), np.repeat(values[faces[:, 3:]].mean(axis=1), 3)
    count = np.bincount(corners, minlength=len(values))
    values[count > 0] = (np.bincount(corners, mean, len(values)) / np.maximum(count, 1))[count > 0]


def around(cells: Index) -> Index:
    """Nodes (m, a) of cells in walking order around each, mid-side nodes between their corners."""
    return cells[:, _AROUND[cells.shape[1]]]


def triangles(cells: Index) -> Index:
    """Triangles (k, 3) that cover the cells."""
    return np.vstack([cells[:, t] for t in _INSIDE[cells.shape[1]]])


def outline(cells: Index) -> Index:
    """Pieces (b, 2) of the sides that belong to one cell only."""
    ring = around(cells)
    edges = np.stack([ring, np.roll(ring, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return edges[first[count == 1]]


def covered(faces: Index) -> Index:
    """Triangles (t, 3) that cover faces (k, 3), (k, 4) or (k, 6) of cells in space."""
    return triangles(faces)


def drawn(cells: Index) -> Index:
    """Facets (k, 4) that cover the cells, corners in walking order; of a triangle the last corner stands twice."""
    if cells.shape[1] == 4:
        return cells
    return triangles(cells)[:, [0, 1, 2, 2]]
