"""Thin direction of a mesh of quadrilaterals: where the lines across its elements are the shorter ones."""

from __future__ import annotations

import numpy as np

from prensa.mesh.mesh import Mesh, keys, renumbered, sides
from prensa.precision import NEGLIGIBLE


def thin_way_up(mesh: Mesh) -> Mesh:
    """The mesh of quadrilaterals with the nodes of each cell turned on so that η is the direction in which the body is thin.

    Elements that share opposite sides form a strip. Each element lies in two strips; the shorter one runs through the
    thickness, whatever the shape of the element. Where both are equally long the cell stays as it is.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    ends = sides(mesh.cells)[..., :2]
    middle = mesh.points[ends].mean(axis=2)
    edge = np.unique(keys(ends, len(mesh.points)), return_inverse=True)[1].reshape(-1, 4)
    # sides 3 and 1 face each other along ξ, 0 and 2 along η
    pairs = np.concatenate([edge[:, [3, 1]], edge[:, [0, 2]]])
    steps = np.concatenate([middle[:, 1] - middle[:, 3], middle[:, 2] - middle[:, 0]])
    n = int(edge.max()) + 1
    _, strip = connected_components(coo_matrix((np.ones(len(pairs)), pairs.T), (n, n)), directed=False)
    of = strip[pairs[:, 0]]
    length = np.bincount(of, np.linalg.norm(steps, axis=1))[of].reshape(2, -1)
    # Strips and not sides are compared: along fillets the shorter side of an element may lie along the sheet.
    turn = length[0] < (1.0 - NEGLIGIBLE) * length[1]
    return renumbered(mesh, np.where(turn[:, None], np.roll(mesh.cells, -1, axis=1), mesh.cells)) if turn.any() else mesh
