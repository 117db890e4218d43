"""Geometry of bricks of eight nodes and tetrahedra of ten: sides, areas, volumes, corners; nothing is shared with the solver.

Cells (m, 8) are trilinear, cells (m, 10) quadratic: corners 0 to 3, then the middles of 01, 12, 20, 03, 13, 23. Sides of the
latter (b, 6) are corners 0 to 2 and the middles of 01, 12, 20.
"""

from __future__ import annotations

import numpy as np

from prensa.types import Array, Index

BRICK_SIDES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
FIVE = ((0, 1, 3, 4), (1, 2, 3, 6), (4, 6, 5, 1), (4, 7, 6, 3), (1, 3, 4, 6))  # tetrahedra of a brick
BRICK_SIGNS = np.array([(a, b, c) for c in (-1.0, 1.0) for a, b in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))])
TETRAHEDRON_SIDES = ((0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (2, 0, 3, 6, 7, 9))
SIDE_MIDDLES = {(0, 1): 4, (1, 2): 5, (0, 2): 6, (0, 3): 7, (1, 3): 8, (2, 3): 9}  # of a tetrahedron, by the corners beside them
GAUSS_PLACE = 0.5 / np.sqrt(3.0)  # of a side, from its middle
CUBIC = ((-0.8, (0.25,) * 4), *((0.45, (*(1 / 6,) * k, 0.5, *(1 / 6,) * (3 - k))) for k in range(4)))
"""Weights and places of a rule that is exact for determinants of quadratic tetrahedra (Zienkiewicz & Taylor 2000, vol. 1)."""
OTHERS_SHARE, OWN_SHARE = (5.0 - np.sqrt(5.0)) / 20.0, (5.0 + 3.0 * np.sqrt(5.0)) / 20.0
FOUR = tuple((0.25, (*(OTHERS_SHARE,) * k, OWN_SHARE, *(OTHERS_SHARE,) * (3 - k))) for k in range(4))
"""The same of the four points at which the stresses of a tetrahedron are known (Hammer & Stroud 1956)."""


def outer_faces(cells: Index) -> Index:
    """Faces (b, 4 | 6) that belong to one cell only."""
    faces = np.concatenate([cells[:, side] for side in (TETRAHEDRON_SIDES if cells.shape[1] == 10 else BRICK_SIDES)])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def contact_points(faces: Index) -> Index:
    """Nodes of sides (b, …) that contacts are at: in space middles of the sides of quadratic faces (b, 6), of others all."""
    return faces[:, 3:] if faces.shape[1] == 6 else faces


def tributary(faces: Index, x: Array) -> Array:
    """Areas (n,) that the nodes of faces stand for: ∫ N dΓ of bilinear ones, of others what the middles integrate with."""
    area = np.zeros(len(x))
    if faces.shape[1] == 6:
        corner, middle = faces[:, :3], faces[:, 3:]
        for k in range(3):
            a, b, c = (x[corner[:, (k + j) % 3]] for j in range(3))
            ab, bc, ca = (x[middle[:, (k + j) % 3]] for j in range(3))
            across = 2.0 * (bc + ca - ab) - a - c  # slope of the side there, towards the opposite corner
            np.add.at(area, middle[:, k], np.linalg.norm(np.cross(b - a, across), axis=1) / 6.0)
        return area
    a, b, c, d = (x[faces[:, k]] for k in range(4))
    for s in (0.5 - GAUSS_PLACE, 0.5 + GAUSS_PLACE):
        for t in (0.5 - GAUSS_PLACE, 0.5 + GAUSS_PLACE):
            along, across = (1 - t) * (b - a) + t * (c - d), (1 - s) * (d - a) + s * (c - b)
            piece = 0.25 * np.linalg.norm(np.cross(along, across), axis=1)
            for node, share in zip(faces.T, ((1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t)):
                np.add.at(area, node, share * piece)
    return area


def beside(faces: Index, x: Array) -> Array:
    """Length (n,) of the longest edge of a face at a node."""
    out = np.zeros(len(x))
    corners = faces[:, :3] if faces.shape[1] == 6 else faces
    longest = np.linalg.norm(np.roll(x[corners], -1, axis=1) - x[corners], axis=2).max(axis=1)
    for node in faces.T:
        np.maximum.at(out, node, longest)
    return out


def volumes(cells: Index, x: Array) -> Array:
    """Volumes (m,); of bricks the mean of two ways to cut them into five tetrahedra, which is that of the trilinear brick."""
    if cells.shape[1] == 10:
        return np.asarray(sum(weight * np.linalg.det(_slopes(cells, x, at)) for weight, at in CUBIC) / 6.0)
    out = np.zeros(len(cells))
    for turned in (cells, cells[:, [1, 2, 3, 0, 5, 6, 7, 4]]):
        for four in FIVE:
            a, b, c, e = (x[turned[:, k]] for k in four)
            out += np.einsum("mi,mi->m", np.cross(b - a, c - a), e - a) / 12.0
    return out


def deformation(cells: Index, X: Array, x: Array) -> Array:
    """Deformation gradients (m, 3, 3) in the middle of bricks, (4 m, 3, 3) where stresses of tetrahedra are known."""
    if cells.shape[1] == 10:
        pairs = [(_slopes(cells, x, at), _slopes(cells, X, at)) for _, at in FOUR]
        return np.concatenate([now @ np.linalg.inv(then) for now, then in pairs])
    then, now = (np.einsum("mai,aj->mij", v[cells], BRICK_SIGNS) for v in (X, x))
    return np.asarray(now @ np.linalg.inv(then))


def known_volume(cells: Index, X: Array, x: Array) -> float:
    """Volume of a body as its integration points know it: of bricks from their middles, of tetrahedra from their four points."""
    if cells.shape[1] == 10:
        return float(sum(weight * np.linalg.det(_slopes(cells, x, at)).sum() for weight, at in FOUR) / 6.0)
    return float((np.linalg.det(deformation(cells, X, x)) * volumes(cells, X)).sum())


def corners(cells: Index, x: Array) -> Array:
    """Volumes (m, 8 | 4) of what the three edges at a corner span, where they are three; zero elsewhere."""
    if cells.shape[1] == 10:
        return np.stack([np.linalg.det(_slopes(cells, x, at)) for at in np.eye(4).tolist()], axis=1)
    return np.stack([_corner(cells, x, k) for k in range(8)], axis=1)


def jacobians(cells: Index, x: Array) -> Array:
    """Volumes (m, k) that elements have for a unit of their own coordinates: at their corners, then at points of Gauss."""
    if cells.shape[1] == 10:
        inside = np.stack([np.linalg.det(_slopes(cells, x, at)) for _, at in FOUR], axis=1)
        return np.concatenate([corners(cells, x), inside], axis=1)
    inner = []
    for at in BRICK_SIGNS / np.sqrt(3.0):
        one = 1.0 + BRICK_SIGNS * at
        by = np.stack([BRICK_SIGNS[:, k] * one[:, (k + 1) % 3] * one[:, (k + 2) % 3] / 8.0 for k in range(3)], axis=1)
        inner.append(np.linalg.det(np.einsum("mai,aj->mij", x[cells], by)))
    return np.concatenate([corners(cells, x) / 8.0, np.stack(inner, axis=1)], axis=1)


def _corner(cells: Index, x: Array, k: int) -> Array:
    along = []
    for axis in range(3):
        there = BRICK_SIGNS[k].copy()
        there[axis] *= -1
        other = int(np.flatnonzero((there == BRICK_SIGNS).all(axis=1))[0])
        along.append((x[cells[:, other]] - x[cells[:, k]]) * -BRICK_SIGNS[k, axis])
    return np.asarray(np.einsum("mi,mi->m", along[0], np.cross(along[1], along[2])))


def _slopes(cells: Index, x: Array, at: tuple[float, ...] | list[float]) -> Array:
    """Slopes (m, 3, 3) of positions in quadratic tetrahedra at a barycentric place: columns towards corners 1, 2, 3 from 0."""
    by = np.zeros((10, 4))  # of Σ L (2 L − 1) x + Σ 4 L_a L_b x by each L
    for k in range(4):
        by[k, k] = 4.0 * at[k] - 1.0
    for (a, b), k in SIDE_MIDDLES.items():
        by[k, a], by[k, b] = 4.0 * at[b], 4.0 * at[a]
    return np.asarray(np.einsum("mai,aj->mij", x[cells], by[:, 1:] - by[:, :1]))
