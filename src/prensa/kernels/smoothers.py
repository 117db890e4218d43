"""Kernels of multigrid in space: residuals and line relaxation over blocks of 3 × 3, the degrees of freedom of a node.

Matrices are block rows: ``ptr``, ``ind`` of nodes, ``a`` (k, 3, 3). Chains of nodes, ``start`` (c + 1,) into ``nodes`` (n,), are
solved as block tridiagonals; chains of one node are block Jacobi. Arrays may be of single precision.
"""

from __future__ import annotations

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.search import entry

# fastmath stays off: with it these loops ran at a quarter of the speed


@njit(cache=True, error_model="numpy")
def residual(ptr, ind, a, x, b, r):
    """R = b − A x."""
    for i in range(len(ptr) - 1):
        s0, s1, s2 = b[3 * i], b[3 * i + 1], b[3 * i + 2]
        for k in range(ptr[i], ptr[i + 1]):
            j = 3 * ind[k]
            x0, x1, x2 = x[j], x[j + 1], x[j + 2]
            s0 -= a[k, 0, 0] * x0 + a[k, 0, 1] * x1 + a[k, 0, 2] * x2
            s1 -= a[k, 1, 0] * x0 + a[k, 1, 1] * x1 + a[k, 1, 2] * x2
            s2 -= a[k, 2, 0] * x0 + a[k, 2, 1] * x1 + a[k, 2, 2] * x2
        r[3 * i], r[3 * i + 1], r[3 * i + 2] = s0, s1, s2


@njit(cache=True, error_model="numpy")
def factor_lines(start, nodes, ptr, ind, a, D, L):
    """Block tridiagonals along the chains: D (n, 3, 3) inverse pivots and L (n, 3, 3) couplings to the node before."""
    for c in range(len(start) - 1):
        for t in range(start[c], start[c + 1]):
            i = nodes[t]
            for k in range(ptr[i], ptr[i + 1]):
                if ind[k] == i:
                    D[t] = a[k]
                elif t > start[c] and ind[k] == nodes[t - 1]:
                    L[t] = a[k]
            if t > start[c]:
                D[t] -= L[t] @ D[t - 1] @ L[t].T
            D[t] = np.linalg.inv(D[t])


@njit(cache=True, error_model="numpy")
def relax_lines(start, nodes, D, L, r, z, v, d, x, a, c):
    """D = a d + c M r, x += d, M the inverse of the block tridiagonals; z (3 n,), v (3,): room to work in."""
    for q in range(len(start) - 1):
        lo, hi = start[q], start[q + 1]
        for t in range(lo, hi):
            i, h = 3 * nodes[t], 3 * nodes[max(t - 1, lo)]
            for p in range(3):
                v[p] = r[i + p]
                if t > lo:
                    v[p] -= L[t, p, 0] * z[h] + L[t, p, 1] * z[h + 1] + L[t, p, 2] * z[h + 2]
            for p in range(3):
                z[i + p] = D[t, p, 0] * v[0] + D[t, p, 1] * v[1] + D[t, p, 2] * v[2]
        for t in range(hi - 1, lo - 1, -1):
            i, h = 3 * nodes[t], 3 * nodes[min(t + 1, hi - 1)]
            if t < hi - 1:
                for p in range(3):
                    v[p] = L[t + 1, 0, p] * z[h] + L[t + 1, 1, p] * z[h + 1] + L[t + 1, 2, p] * z[h + 2]
                for p in range(3):
                    z[i + p] -= D[t, p, 0] * v[0] + D[t, p, 1] * v[1] + D[t, p, 2] * v[2]
            for p in range(3):
                d[i + p] = a * d[i + p] + c * z[i + p]
                x[i + p] += d[i + p]


@njit(cache=True)
def walk(ptr, ind, order):
    """Chains along the edges of a graph of nodes, begun in an ``order`` (n,): their starts (c + 1,) and nodes (n,)."""
    n = len(order)
    seen, nodes, start, m, c = np.zeros(n, np.bool_), np.empty(n, np.int64), np.empty(n + 1, np.int64), 0, 0
    for i in order:
        if not seen[i]:
            start[c], c = m, c + 1
            while i >= 0:
                seen[i], nodes[m], m = True, i, m + 1
                j = -1
                for k in range(ptr[i], ptr[i + 1]):
                    if not seen[ind[k]] and j < 0:
                        j = ind[k]
                i = j
    start[c] = m
    return start[: c + 1], nodes


@njit(cache=True)
def block_places(indptr, indices, at, ptr, ind, out):
    """Out (nnz,): places of the entries of scalar rows among block values (k, 3, 3), flat; −1 where ``at`` (f,) has no block row.

    at: three times the node and the axis of each scalar unknown, −1 of those that are of no node.
    """
    for i in range(len(indptr) - 1):
        for e in range(indptr[i], indptr[i + 1]):
            j = indices[e]
            out[e] = -1
            if at[i] < 0 or at[j] < 0:
                continue
            node, other = at[i] // 3, at[j] // 3
            out[e] = 9 * entry(ptr, ind, node, other) + 3 * (at[i] % 3) + at[j] % 3


@njit(cache=True)
def mirrored(indptr, indices):
    """Places (nnz,) of the mirrored entries of a structurally symmetric pattern, sorted."""
    out = np.empty(len(indices), np.int32)
    ahead = indptr[:-1].copy()
    for j in range(len(indptr) - 1):  # column after column, each row's next entry is the one of this column
        for e in range(indptr[j], indptr[j + 1]):
            i = indices[e]
            out[e] = ahead[i]
            ahead[i] += 1
    return out
