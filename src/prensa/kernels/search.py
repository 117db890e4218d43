"""Search in sorted rows of a sparse pattern, and in trees of boxes."""

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


@njit(cache=True, forceinline=True)
def push_children(stack, top, i, left, right):
    """Push the children 2i and 2i + 1 of a node of a heap, the nearer one last by what is ``left`` and ``right``: the new top."""
    nearer = 2 * i if left <= right else 2 * i + 1
    stack[top], stack[top + 1] = 4 * i + 1 - nearer, nearer
    return top + 2
