"""Kernels that combine known columns: where the solutions of linear equations with many right-hand sides begin."""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit


@njit(cache=True, error_model="numpy")
def nearest(rows, weight, least, share):
    """Which combination of k columns a_i (f,) comes nearest to b (f,), for d of each: share (k, d) of Σ share_i a_i.

    rows (f, (k + 1) d): first the columns, k times d of them, then b, multiplied by the weight (f,). By Cholesky's factors
    of the normal equations; a column of which less than a share ``least`` is independent of those before it is left out.
    """
    k, d = share.shape
    M = np.zeros((k + 1, k, d))
    for f in range(rows.shape[0]):
        r, w = rows[f], weight[f] * weight[f]
        for i in range(k + 1):
            for j in range(min(i + 1, k)):
                for c in range(d):
                    M[i, j, c] += w * r[i * d + c] * r[j * d + c]
    for c in range(d):
        for i in range(k):
            whole = M[i, i, c]
            for j in range(i + 1):
                for m in range(j):
                    M[i, j, c] -= M[i, m, c] * M[j, m, c]
                if j < i:
                    M[i, j, c] = M[i, j, c] / M[j, j, c] if M[j, j, c] > 0.0 else 0.0
            M[i, i, c] = math.sqrt(M[i, i, c]) if M[i, i, c] > least * whole else 0.0
        for j in range(k):
            for m in range(j):
                M[k, j, c] -= M[k, m, c] * M[j, m, c]
            M[k, j, c] = M[k, j, c] / M[j, j, c] if M[j, j, c] > 0.0 else 0.0
        for i in range(k - 1, -1, -1):
            rest = M[k, i, c]
            for m in range(i + 1, k):
                rest -= M[m, i, c] * share[m, c]
            share[i, c] = rest / M[i, i, c] if M[i, i, c] > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def add_combination(columns, share, factor, out):
    """Adds factor × Σ share_i a_i to out (n, d) for columns (n, k d) and share (k, d)."""
    k, d = share.shape
    for n in range(out.shape[0]):
        for i in range(k):
            for c in range(d):
                out[n, c] += factor * share[i, c] * columns[n, i * d + c]
