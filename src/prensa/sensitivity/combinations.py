"""Kernels that combine known columns: where the solutions of linear equations with many right-hand sides begin."""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit


@njit(cache=True, error_model="numpy")
def basis_columns(past, fixed, out):
    """Of what columns are expected to consist: those of the last k increments, k times (n, d), and their differences one after
    the other → out (n, k d); 0 in fixed rows.
    """
    k, d = len(past), past[0].shape[1]
    for i in range(out.shape[0]):
        for j in range(k):
            for c in range(d):
                out[i, j * d + c] = past[j][i, c]
        # Columns of increments that follow one another are almost parallel, and the normal equations of `nearest` would lose
        # their digits: differences are what is independent in them.
        for order in range(1, k):
            for j in range(k - 1, order - 1, -1):
                for c in range(d):
                    out[i, j * d + c] = out[i, (j - 1) * d + c] - out[i, j * d + c]
    for i in fixed:
        for c in range(k * d):
            out[i, c] = 0.0


@njit(cache=True, error_model="numpy")
def nearest(columns, b, weight, least, share):
    """Which combination of k columns a_i (f,) comes nearest to b (f,), for d of each: share (k, d) of Σ share_i a_i.

    columns (f, k d), b (f, d) are multiplied by the weight (f,). By Cholesky's factors of the normal equations; a column of
    which less than a share ``least`` is independent of those before it is left out.
    """
    k, d = share.shape
    M = np.zeros((k + 1, k, d))
    for f in range(columns.shape[0]):
        r, w = columns[f], weight[f] * weight[f]
        for i in range(k):
            for j in range(i + 1):
                for c in range(d):
                    M[i, j, c] += w * r[i * d + c] * r[j * d + c]
        for j in range(k):
            for c in range(d):
                M[k, j, c] += w * b[f, c] * r[j * d + c]
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
def combined(columns, images, share, x, left):
    """Combine columns a_i (n, k d): Σ share_i a_i → x (n, d); what that makes of images (n, k d) is taken off left (n, d)."""
    k, d = share.shape
    for n in range(x.shape[0]):
        for c in range(d):
            x[n, c] = share[0, c] * columns[n, c]
            left[n, c] -= share[0, c] * images[n, c]
        for i in range(1, k):
            for c in range(d):
                x[n, c] += share[i, c] * columns[n, i * d + c]
                left[n, c] -= share[i, c] * images[n, i * d + c]


@njit(cache=True, error_model="numpy")
def sums(weight, part):
    """Σ weight |part| (d,) of rows (f, d)."""
    out = np.zeros(part.shape[1])
    for f in range(part.shape[0]):
        for c in range(part.shape[1]):
            out[c] += weight[f] * abs(part[f, c])
    return out


@njit(cache=True, error_model="numpy")
def row_sums(data, indptr, out):
    """Sums of the sizes of each row of a matrix in compressed rows → out (n,)."""
    for i in range(len(out)):
        out[i] = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            out[i] += abs(data[k])
