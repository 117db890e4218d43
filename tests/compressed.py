"""A square that is pressed homogeneously, for tests of hourglasses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import csc_matrix

from prensa.types import Array
from prensa.verify.drive import Drive


def stiffnesses(drive: Drive, increments: int) -> Iterator[Array]:
    """Stiffness of the free unknowns of a unit square, on rollers below and at the left, after each 5 % of its height."""
    bottom, top = (np.flatnonzero(drive.X[:, 1] == y) for y in (0.0, 1.0))
    left = np.flatnonzero(drive.X[:, 0] == 0.0)
    dofs = np.concatenate([2 * left, 2 * bottom + 1, 2 * top + 1])
    free = np.setdiff1d(np.arange(drive.system.ndof), dofs)
    for k in range(1, increments + 1):
        values = np.concatenate([np.zeros(len(left) + len(bottom)), np.full(len(top), -0.05 * k)])
        e, pattern = drive.to(0.01 * k, dofs, values), drive.system.pattern
        yield csc_matrix((e.data, pattern.indices, pattern.indptr)).toarray()[np.ix_(free, free)]
