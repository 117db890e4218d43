"""Q4 with enhanced strains: internal modes of the deformation gradient that are solved for and condensed (EAS).

F = I + ∇u + F₀ B, B = Σ αᵢ Mᵢ (Simo & Armero 1992), with F₀ the gradient at the centroid and
M = (j₀ r₀/(j r)) J₀⁻ᵀ E J₀⁻¹, E in {ξ e₁e₁, ξ e₁e₂, η e₂e₁, η e₂e₂}: the transposed modes of Glaser & Armero (1997), which in
small strain are Wilson's (QM6) and which keep the element stable in elastic compression. In axisymmetry a fifth mode ξη of the
hoop stretch (Simo & Rifai 1990); elements for sheets have further modes P₂(η), P₃(η) … e₂e₂ (Legendre). ∫ M dV = 0, so constant
stress is in equilibrium on any mesh (patch test).

The modes refer to the initial configuration, so that the answer does not depend on how many increments led to it: the
material is given f = F F_n⁻¹, and its P and A = ∂P/∂f are pulled back to ∂/∂F. Small strain: h = ∇u + B − (∇u + B)_n.
"""

from __future__ import annotations

import numpy as np

from prensa.elements.shapes import q4
from prensa.kernels.compiled import njit
from prensa.kernels.tensor import det_minus_one

_N0, _DN0 = q4(0.0, 0.0)
MODES = {False: 4, True: 5}
"""Internal degrees of freedom of every enhanced element, by whether the problem is axisymmetric."""


@njit(cache=True, error_model="numpy")
def _map(X, e, N, dN, axisymmetric, G, inverse):
    """G (4, 2) = ∂N/∂X and inverse (2, 2) = ∂ξ_I/∂X_i at a point of element e → Jacobian determinant, radius."""
    j11 = j12 = j21 = j22 = r = 0.0
    for a in range(4):
        j11 += dN[a, 0] * X[e, a, 0]
        j12 += dN[a, 0] * X[e, a, 1]
        j21 += dN[a, 1] * X[e, a, 0]
        j22 += dN[a, 1] * X[e, a, 1]
        r += N[a] * X[e, a, 0]
    det = j11 * j22 - j12 * j21
    inverse[0, 0], inverse[0, 1] = j22 / det, -j21 / det
    inverse[1, 0], inverse[1, 1] = -j12 / det, j11 / det
    for a in range(4):
        G[a, 0] = dN[a, 0] * inverse[0, 0] + dN[a, 1] * inverse[1, 0]
        G[a, 1] = dN[a, 0] * inverse[0, 1] + dN[a, 1] * inverse[1, 1]
    return det, r if axisymmetric else 1.0


@njit(cache=True, error_model="numpy")
def _gradient(u, e, N, G, r, axisymmetric, H):
    """H (5,) = ∇u at a point of element e."""
    H[:] = 0.0
    for a in range(4):
        ux, uy = u[e, a, 0], u[e, a, 1]
        H[0] += ux * G[a, 0]
        H[1] += ux * G[a, 1]
        H[2] += uy * G[a, 0]
        H[3] += uy * G[a, 1]
        if axisymmetric:
            H[4] += ux * N[a] / r


@njit(cache=True, error_model="numpy")
def _modes(at, inverse0, det0, scale, axisymmetric, M):
    """M (m, 5): the modes at a point (ξ, η), from ∂ξ/∂X and j₀ at the centroid and j₀ r₀/(j r).

    Behind the four or five (`MODES`) follow as many of the strain across, of the second degree in η and higher, as M has rows.
    They are without a dimension, j₀ times those of the source, so that the stiffnesses of all can be held against each other.
    """
    xi, eta = at[0], at[1]
    for k in range(4):
        I, J = k // 2, k % 2
        s = scale * det0 * (xi if I == 0 else eta)
        for i in range(2):
            for j in range(2):
                M[k, 2 * i + j] = s * inverse0[I, i] * inverse0[J, j]
        M[k, 4] = 0.0
    last = 4
    if axisymmetric:
        M[4, :] = 0.0
        M[4, 4] = scale * xi * eta
        last = 5
    before, legendre = eta, 1.5 * eta * eta - 0.5
    for k in range(last, M.shape[0]):
        degree = 2 + k - last
        for i in range(2):
            for j in range(2):
                M[k, 2 * i + j] = scale * det0 * legendre * inverse0[1, i] * inverse0[1, j]
        M[k, 4] = 0.0
        before, legendre = legendre, ((2 * degree + 1) * eta * legendre - degree * before) / (degree + 1)


@njit(cache=True, error_model="numpy")
def kinematics(X, u, alpha, Hn, N, dN, weight, at, axisymmetric, finite, scale, H, h, w, failed):
    """X, u (e, 4, 2) initial positions and displacements, alpha (e, m), Hn (e, q, 5) committed → H, h (e, q, 5), w (e, q).

    N (q, 4), dN (q, 4, 2), weight (q,), at (q, 2) of `shapes.table`.
    H = F − I, h = f − I with f = F F_n⁻¹; w initial volumes. failed marks elements with det F ≤ 0 at a point.
    """
    G, G0 = np.empty((4, 2)), np.empty((4, 2))
    inverse, inverse0 = np.empty((2, 2)), np.empty((2, 2))
    H0, M, B = np.empty(5), np.empty((alpha.shape[1], 5)), np.empty(5)
    for e in range(X.shape[0]):
        det0, r0 = _map(X, e, _N0, _DN0, axisymmetric, G0, inverse0)
        _gradient(u, e, _N0, G0, r0, axisymmetric, H0)
        if not finite:
            H0[:] = 0.0
        for q in range(w.shape[1]):
            det, r = _map(X, e, N[q], dN[q], axisymmetric, G, inverse)
            w[e, q] = scale * weight[q] * det * r
            if not (det > 0.0 and r > 0.0):
                failed[e] = True
            F = H[e, q]
            _gradient(u, e, N[q], G, r, axisymmetric, F)
            _modes(at[q], inverse0, det0, det0 * r0 / (det * r), axisymmetric, M)
            B[:] = 0.0
            for k in range(alpha.shape[1]):
                for c in range(5):
                    B[c] += alpha[e, k] * M[k, c]
            F[0] += (1.0 + H0[0]) * B[0] + H0[1] * B[2]
            F[1] += (1.0 + H0[0]) * B[1] + H0[1] * B[3]
            F[2] += H0[2] * B[0] + (1.0 + H0[3]) * B[2]
            F[3] += H0[2] * B[1] + (1.0 + H0[3]) * B[3]
            F[4] += (1.0 + H0[4]) * B[4]
            d0, d1, d2, d3 = F[0] - Hn[e, q, 0], F[1] - Hn[e, q, 1], F[2] - Hn[e, q, 2], F[3] - Hn[e, q, 3]
            d4 = F[4] - Hn[e, q, 4]
            if finite:
                if not (det_minus_one(F[0], F[1], F[2], F[3], F[4]) > -1.0 and F[4] > -1.0):
                    failed[e] = True
                n0, n1, n2, n3 = 1.0 + Hn[e, q, 0], Hn[e, q, 1], Hn[e, q, 2], 1.0 + Hn[e, q, 3]
                det_n = n0 * n3 - n1 * n2
                h[e, q, 0] = (d0 * n3 - d1 * n2) / det_n
                h[e, q, 1] = (-d0 * n1 + d1 * n0) / det_n
                h[e, q, 2] = (d2 * n3 - d3 * n2) / det_n
                h[e, q, 3] = (-d2 * n1 + d3 * n0) / det_n
                h[e, q, 4] = d4 / (1.0 + Hn[e, q, 4])
            else:
                h[e, q, 0], h[e, q, 1], h[e, q, 2], h[e, q, 3], h[e, q, 4] = d0, d1, d2, d3, d4


@njit(cache=True, error_model="numpy")
def pull_back(Hn, P, A):
    """In place P (e, q, 5) → J_n P F_n⁻ᵀ and A (e, q, 5, 5) → ∂P/∂F: from per committed to per initial volume."""
    for e in range(P.shape[0]):
        for q in range(P.shape[1]):
            n0, n1, n2, n3 = 1.0 + Hn[e, q, 0], Hn[e, q, 1], Hn[e, q, 2], 1.0 + Hn[e, q, 3]
            n4 = 1.0 + Hn[e, q, 4]
            det = n0 * n3 - n1 * n2
            J = det * n4
            # (F_n⁻¹)_JA of the section, by which J of every pair of components (iJ) is multiplied
            t0, t1, t2, t3, t4 = n3 / det, -n1 / det, -n2 / det, n0 / det, 1.0 / n4
            p, a = P[e, q], A[e, q]
            for i in (0, 2):
                x, y = p[i], p[i + 1]
                p[i], p[i + 1] = J * (t0 * x + t1 * y), J * (t2 * x + t3 * y)
                for c in range(5):
                    x, y = a[i, c], a[i + 1, c]
                    a[i, c], a[i + 1, c] = J * (t0 * x + t1 * y), J * (t2 * x + t3 * y)
            p[4] *= J * t4
            for c in range(5):
                a[4, c] *= J * t4
            for i in (0, 2):
                for c in range(5):
                    x, y = a[c, i], a[c, i + 1]
                    a[c, i], a[c, i + 1] = t0 * x + t1 * y, t2 * x + t3 * y
            for c in range(5):
                a[c, 4] *= t4


@njit(cache=True, error_model="numpy")
def integrate(X, u, alpha, H, N, dN, at, axisymmetric, finite, w, P, A, lo, r, K, forces, noise):
    """Forces r (e, 8 + m) on displacements and modes and K = ∂r/∂(u, α) from row and column lo on (8: the modes only).

    P (e, q, 5) and A (e, q, 5, 5) per initial volume; forces (e,) = Σ |r| on displacements before points cancel; noise
    (e, 8 + m): stresses, and the round-off of A H, that a zero of r is made of. H (e, q, 5): the strains they come of, in size.
    """
    m = alpha.shape[1]
    n = 8 + m
    last = 5 if axisymmetric else 4  # no displacement or mode of the plane stretches it across
    G, G0 = np.empty((4, 2)), np.empty((4, 2))
    inverse, inverse0 = np.empty((2, 2)), np.empty((2, 2))
    H0, M, B = np.empty(5), np.empty((alpha.shape[1], 5)), np.empty(5)
    D, AD = np.zeros((5, n)), np.empty((5, n))
    for e in range(X.shape[0]):
        r[e, lo:] = 0.0
        forces[e] = 0.0
        noise[e, lo:] = 0.0
        K[e, lo:, lo:] = 0.0
        det0, r0 = _map(X, e, _N0, _DN0, axisymmetric, G0, inverse0)
        _gradient(u, e, _N0, G0, r0, axisymmetric, H0)
        if not finite:
            H0[:] = 0.0
        for q in range(w.shape[1]):
            det, rad = _map(X, e, N[q], dN[q], axisymmetric, G, inverse)
            _modes(at[q], inverse0, det0, det0 * r0 / (det * rad), axisymmetric, M)
            B[:] = 0.0
            if finite and lo == 0:
                for k in range(m):
                    for c in range(last):
                        B[c] += alpha[e, k] * M[k, c]
            for a in range(4 if lo == 0 else 0):
                g0, g1 = G0[a, 0], G0[a, 1]
                D[0, 2 * a] = D[2, 2 * a + 1] = G[a, 0] + g0 * B[0] + g1 * B[2]
                D[1, 2 * a] = D[3, 2 * a + 1] = G[a, 1] + g0 * B[1] + g1 * B[3]
                if axisymmetric:
                    D[4, 2 * a] = N[q, a] / rad + _N0[a] / r0 * B[4]
            for k in range(m):
                D[0, 8 + k] = (1.0 + H0[0]) * M[k, 0] + H0[1] * M[k, 2]
                D[1, 8 + k] = (1.0 + H0[0]) * M[k, 1] + H0[1] * M[k, 3]
                D[2, 8 + k] = H0[2] * M[k, 0] + (1.0 + H0[3]) * M[k, 2]
                D[3, 8 + k] = H0[2] * M[k, 1] + (1.0 + H0[3]) * M[k, 3]
                D[4, 8 + k] = (1.0 + H0[4]) * M[k, 4]
            wq = w[e, q]
            size = 0.0
            for c in range(5):
                size += abs(P[e, q, c])
                for b in range(5):
                    size += 1e-2 * abs(A[e, q, c, b] * H[e, q, b])
            for c in range(last):
                p = wq * P[e, q, c]
                for i in range(lo, n):
                    r[e, i] += D[c, i] * p
                    noise[e, i] += abs(D[c, i]) * wq * size
            for i in range(lo, 8):
                s = 0.0
                for c in range(last):
                    s += D[c, i] * P[e, q, c]
                forces[e] += wq * abs(s)
            for c in range(last):
                for j in range(lo, n):
                    s = 0.0
                    for b in range(last):
                        s += A[e, q, c, b] * D[b, j]
                    AD[c, j] = wq * s
            for i in range(lo, n):
                for c in range(last):
                    d = D[c, i]
                    if d != 0.0:
                        for j in range(lo, n):
                            K[e, i, j] += d * AD[c, j]
            if not finite or lo > 0:
                continue
            for a in range(4):  # P : ∂²F/∂u∂α, F₀ carries the displacements too
                g0, g1 = G0[a, 0], G0[a, 1]
                for k in range(m):
                    m0, m1 = g0 * M[k, 0] + g1 * M[k, 2], g0 * M[k, 1] + g1 * M[k, 3]
                    x = wq * (P[e, q, 0] * m0 + P[e, q, 1] * m1)
                    if axisymmetric:
                        x += wq * P[e, q, 4] * _N0[a] / r0 * M[k, 4]
                    y = wq * (P[e, q, 2] * m0 + P[e, q, 3] * m1)
                    K[e, 2 * a, 8 + k] += x
                    K[e, 8 + k, 2 * a] += x
                    K[e, 2 * a + 1, 8 + k] += y
                    K[e, 8 + k, 2 * a + 1] += y
