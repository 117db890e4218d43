"""Newton's matrix without the unknowns of tied nodes: K_free = Tᵀ K T, its pattern and its sums found once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from prensa.fem.ties import Ties

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Tied:
    """Free unknowns of a system with ties, and its matrix in them: ``indptr``, ``indices`` (compressed columns).

    ``rows``, ``cols`` (nnz,): places of the entries of the whole matrix. Every entry goes to the places of all pairs of free
    unknowns that its row and its column are made of, so that the values of the small matrix are a fixed linear map of the
    values of the large one.
    """

    def __init__(self, ties: Ties, n: int, fixed: Index, rows: NDArray[np.int32], cols: NDArray[np.int32]) -> None:
        T = ties.free(n, fixed)
        T.sort_indices()
        self.matrix = T
        m = T.shape[1]
        self.free = ties.kept(n, fixed)
        parts = np.diff(T.indptr)
        width = parts[cols].astype(np.int64)
        times = parts[rows] * width
        entry = np.repeat(np.arange(len(rows)), times)
        k = np.arange(len(entry)) - np.repeat(np.cumsum(times) - times, times)
        a = T.indptr[rows[entry]] + k // width[entry]
        b = T.indptr[cols[entry]] + k % width[entry]
        place = T.indices[b].astype(np.int64) * m + T.indices[a]
        places, slot = np.unique(place, return_inverse=True)
        self.sums = csr_matrix((T.data[a] * T.data[b], (slot.ravel(), entry)), (len(places), len(rows)))
        self.indices = (places % m).astype(np.int32)
        self.indptr = np.searchsorted(places, np.arange(m + 1) * np.int64(m)).astype(np.int32)

    def values(self, data: Array) -> Array:
        """Values of the small matrix from those of the large one."""
        return np.asarray(self.sums @ data)

    def part(self, r: Array) -> Array:
        """Tᵀ r."""
        return np.asarray(self.matrix.T @ r)

    def whole(self, x: Array) -> Array:
        """T x."""
        return np.asarray(self.matrix @ x)
