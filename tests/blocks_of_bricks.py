"""Blocks of bricks and tetrahedra without a problem around them, for tests of elements in space."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from prensa.elements.element import Mode, element_of
from prensa.layout import TETRAHEDRON_EDGES, DofMap
from prensa.materials.laws import At
from prensa.materials.material import material_of
from prensa.system.assembly import Block, block_slots, make_pattern, sweep


def bricks(n, size, skew=0.0, seed=0):
    """Points (nodes, 3) and cells (elements, 8) of a box; ``skew``: how far inner nodes are moved, over an element's length."""
    grid = np.stack(np.meshgrid(*(np.arange(k + 1) for k in n), indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(grid)).reshape([k + 1 for k in n])
    face = [(0, 0), (1, 0), (1, 1), (0, 1)]
    ends = [k + 1 for k in n]
    corners = [number[i : ends[0] - 1 + i, j : ends[1] - 1 + j, k : ends[2] - 1 + k] for k in (0, 1) for i, j in face]
    cells = np.stack(corners, axis=-1).reshape(-1, 8)
    inner = ((grid > 0) & (grid < n)).all(axis=1)
    moved = grid + skew * inner[:, None] * np.random.default_rng(seed).uniform(-1, 1, size=grid.shape)
    return moved / n * size, cells.astype(np.int64), inner


def block_of(X, cells, element, material, kinematics):
    """A block of bricks and the pattern of its system."""
    pattern = make_pattern([cells], DofMap(3, len(X)), [])
    slot = np.empty((*cells.shape, cells.shape[1]), dtype=np.int32)
    block_slots(pattern.indptr, pattern.indices, cells, slot, 3)
    formulation, mode = element_of(element), Mode(False, kinematics == "finite", 1.0)
    volume, folded = formulation.volumes(X[cells], mode)
    assert not folded.any()
    law = material_of(material, kinematics, "solid")
    return Block("b", cells, X[cells], law, formulation, mode, slot, volume), pattern


def respond(block, pattern, x, du, old, stiffness=False):
    """Forces (nodes, 3), stiffness as an array and the sweep's result."""
    from scipy.sparse import csc_matrix

    r = np.zeros(x.size)
    data = np.zeros(len(pattern.indices)) if stiffness else None
    result = sweep(block, x, du.reshape(x.shape), old, At(0.1, 0.1, stiffness), r, data, pattern)
    K = csc_matrix((data, pattern.indices, pattern.indptr), (pattern.n,) * 2).toarray() if stiffness else None
    return r.reshape(x.shape), K, result


def tetrahedra(n, size, skew=0.0, seed=0):
    """Points and cells (elements, 10) of the same box, six tetrahedra to a brick (Kuhn 1960), and which nodes are inside."""
    X, cells, _ = bricks(n, size, skew, seed)
    corner = cells[:, [0, 1, 3, 2, 4, 5, 7, 6]].reshape(-1, 2, 2, 2)  # by z, y, x
    found = []
    for a, b, c in permutations(range(3)):
        at, path = [0, 0, 0], [(0, 0, 0)]
        for axis in (a, b, c):
            at[axis] = 1
            path.append(tuple(at))
        if (a, b, c) in ((0, 2, 1), (1, 0, 2), (2, 1, 0)):
            path[1], path[2] = path[2], path[1]
        found.append(np.stack([corner[:, z, y, x] for x, y, z in path], axis=1))
    tets = np.concatenate(found)
    sides = np.sort(tets[:, np.array(TETRAHEDRON_EDGES)], axis=2)
    edges, number = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    points = np.concatenate([X, X[edges].mean(axis=1)])
    inner = ((points > 1e-9) & (points < np.array(size) - 1e-9)).all(axis=1)
    return points, np.concatenate([tets, len(X) + number.reshape(-1, 6)], axis=1), inner
