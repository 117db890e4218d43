"""Newton's matrix without the dofs of tied nodes: K_free = Tᵀ K T, its pattern and its sums found once."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix

from prensa.system.assembly import Pattern
from prensa.system.schedule import Control
from prensa.system.ties import Ties
from prensa.types import Array, Index


class Tied:
    """Free dofs of a system with ties, u = T u_f, and its matrix in them: ``indptr``, ``indices`` (compressed columns).

    Every entry of the whole matrix goes to the places of all pairs of free dofs that its row and its column are made of, so
    that the values of the small matrix are a fixed linear map of the values of the large one. With displacement ``control``
    the equation of the lead is in the place of that of the factor.
    """

    def __init__(self, ties: Ties, pattern: Pattern, fixed: Index, control: Control | None = None) -> None:
        n, rows = pattern.n, pattern.indices
        cols = np.repeat(np.arange(n, dtype=np.int32), np.diff(pattern.indptr))
        T = ties.free(n, fixed)
        T.sort_indices()
        m = T.shape[1]
        self.free = ties.kept(n, fixed)
        self.matrix, self.equations, self.rows = T, T, self.free
        if control is not None:
            self.rows = np.where(self.free == control.factor, control.control_dof, self.free)
            at = int(np.flatnonzero(self.free == control.factor)[0])
            moved = csr_matrix(([1.0, -1.0], ([control.control_dof, control.factor], [at, at])), T.shape)
            self.equations = csr_matrix(T + moved)
            self.equations.eliminate_zeros()
            self.equations.sort_indices()
        E = self.equations
        width = np.diff(T.indptr)[cols].astype(np.int64)
        times = np.diff(E.indptr)[rows] * width
        entry = np.repeat(np.arange(len(rows)), times)
        # k counts the pairs of parts of one entry: all parts of its row by all of its column.
        k = np.arange(len(entry)) - np.repeat(np.cumsum(times) - times, times)
        a = E.indptr[rows[entry]] + k // width[entry]
        b = T.indptr[cols[entry]] + k % width[entry]
        # Column × m + row needs 64 bits from 46 000 unknowns on.
        place = T.indices[b].astype(np.int64) * m + E.indices[a]
        places, slot = np.unique(place, return_inverse=True)
        self.sums = csr_matrix((E.data[a] * T.data[b], (slot.ravel(), entry)), (len(places), len(rows)))
        self.indices = (places % m).astype(np.int32)
        self.indptr = np.searchsorted(places, np.arange(m + 1) * np.int64(m)).astype(np.int32)

    def values(self, data: Array, spent: bool = False) -> Array:
        """Values of the small matrix from those of the large one."""
        return np.asarray(self.sums @ data)

    def sparse(self, values: Array) -> csc_matrix:
        """See `prensa.linear.reduction.Restriction`."""
        return csc_matrix((values[: len(self.indices)], self.indices, self.indptr), (len(self.free),) * 2)

    def part(self, r: Array) -> Array:
        """Tᵀ r."""
        return np.asarray(self.equations.T @ r)

    def of_columns(self, columns: csr_matrix) -> csr_matrix:
        """As `part` (f, m) for forces (ndof, m)."""
        return csr_matrix(self.equations.T @ columns)

    def whole(self, x: Array, n: int) -> Array:
        """T x."""
        return np.asarray(self.matrix @ x)
