"""Fields at the nodes of bricks and tetrahedra, from those at their integration points.

Elastic fields are extrapolated to the corners of each element and averaged there, by volume; the middle of a side has the mean of
its ends. Where metal has yielded the corner takes the point next to it instead: what is extrapolated would be above the flow
stress.
"""

from __future__ import annotations

import numpy as np

from prensa.layout import of_corners
from prensa.types import Array, Flags, Index

VTK_ORDER = [0, 1, 2, 3, 5, 4]
"""Places of xx, yy, zz, xy, yz, xz among the components of a law: xx, yy, zz, xy, xz, yz."""


def recover(cells: Index, volume: Array, N: Array, values: Array, yielded: Flags | None = None) -> Array:
    """Values (n, c) at nodes of cells (m, a) of values (m, q, c) at points with shape values N (q, a) and volumes (m, q).

    ``yielded`` (m,): elements whose values are not extrapolated.
    """
    to_nodes, linear = np.eye(N.shape[1]), N
    if N.shape[1] == 10:
        linear, to_nodes = of_corners(N)
    corner = to_nodes @ np.linalg.inv(linear) @ values  # as many points as corners: the values of a (tri)linear field
    if yielded is not None:
        corner[yielded] = to_nodes @ values[yielded][:, linear.argmax(axis=0)]
    weight = np.repeat(volume.sum(axis=1) / cells.shape[1], cells.shape[1])
    n, flat = int(cells.max()) + 1, corner.reshape(-1, values.shape[2])
    total = np.bincount(cells.ravel(), weight, n)
    return np.stack([np.bincount(cells.ravel(), weight * v, n) for v in flat.T], axis=1) / total[:, None]


def pressure_of(stress: Array, n: Array) -> Array:
    """−n·σ n (k,) of stresses (k, 6) in that order and unit normals n (k, 3)."""
    xx, yy, zz, xy, yz, xz = stress.T
    sigma = np.stack([np.stack([xx, xy, xz], -1), np.stack([xy, yy, yz], -1), np.stack([xz, yz, zz], -1)], axis=1)
    return -np.einsum("ki,kij,kj->k", n, sigma, n)
