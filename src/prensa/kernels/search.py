"""Search in sorted rows of a sparse pattern."""

from __future__ import annotations

from prensa.kernels.compiled import njit


@njit(cache=True)
def entry(indptr, indices, row, wanted):
    """Place of an index in the sorted row ``row`` of a pattern (columns alike), where it is or would be; by bisection."""
    lo, hi = indptr[row], indptr[row + 1]
    while lo < hi:
        mid = (lo + hi) // 2
        if indices[mid] < wanted:
            lo = mid + 1
        else:
            hi = mid
    return lo
