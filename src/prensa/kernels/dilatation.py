"""Kernels for elements whose points have one dilatation in common: what their stiffness is along it, for preconditioners."""

from __future__ import annotations

import numpy as np

from prensa.kernels.compiled import njit


@njit(cache=True, error_model="numpy")
def volumetric_part(K, x, slopes, out):
    """Of stiffnesses K (e, n, n) of elements x (e, a, 3) along γ: γ, K γ, Kᵀ γ and a modulus, (e, 3 n + 1), n = 3 a.

    γ is the direction, of length 1, in which the dilatation grows where shape functions have the ``slopes`` (a, 3). The modulus
    is the mean stiffness of the other motions, rigid ones left out, over γᵀ K γ.
    """
    n, nodes = K.shape[1], x.shape[1]
    J, g, left = np.empty((3, 3)), np.empty(n), np.empty(n)
    for e in range(len(K)):
        J[:] = 0.0
        for a in range(nodes):
            for k in range(3):
                for i in range(3):
                    J[k, i] += slopes[a, k] * x[e, a, i]
        size = 0.0
        for a in range(nodes):
            for i in range(3):
                p, q = (i + 1) % 3, (i + 2) % 3
                s = 0.0
                for k in range(3):  # cofactors of J: slopes by x but for a factor
                    m, r = (k + 1) % 3, (k + 2) % 3
                    s += slopes[a, k] * (J[m, p] * J[r, q] - J[m, q] * J[r, p])
                g[3 * a + i] = s
                size += s * s
        g /= np.sqrt(size)
        own, trace = 0.0, 0.0
        left[:] = 0.0
        for i in range(n):
            for j in range(n):
                left[j] += K[e, i, j] * g[i]
            r0, r1, r2 = 0.0, 0.0, 0.0  # sums side by side wait less for one another
            for j in range(0, n, 3):
                r0 += K[e, i, j] * g[j]
                r1 += K[e, i, j + 1] * g[j + 1]
                r2 += K[e, i, j + 2] * g[j + 2]
            right = r0 + r1 + r2
            own += g[i] * right
            trace += K[e, i, i]
            out[e, i], out[e, n + i] = g[i], right
        for i in range(n):
            out[e, 2 * n + i] = left[i]
        out[e, 3 * n] = (trace - own) / (n - 7) / own


@njit(cache=True)
def beside(gamma, right, left, share, K):
    """K (e, n, n) = w γᵀ + γ wᵀ − share (Kᵀ γ) (Kᵀ γ)ᵀ for the parts (e, n) of `volumetric_part`, w = (Kᵀ γ − K γ)/2."""
    for e in range(len(K)):
        for i in range(K.shape[1]):
            w = 0.5 * (left[e, i] - right[e, i])
            for j in range(i + 1):
                k = w * gamma[e, j] + 0.5 * (left[e, j] - right[e, j]) * gamma[e, i] - share[e] * left[e, i] * left[e, j]
                K[e, i, j] = K[e, j, i] = k
