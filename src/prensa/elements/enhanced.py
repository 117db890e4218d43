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


@njit(cache=True, error_model="numpy", forceinline=True)
def _jacobian(X, e, N, dN):
    """∂X_i/∂ξ_I as 11, 12, 21, 22 at a point of element e, and its first coordinate, the radius in axisymmetry."""
    j11 = j12 = j21 = j22 = r = 0.0
    for a in range(4):
        x, y = X[e, a, 0], X[e, a, 1]
        j11 += dN[a, 0] * x
        j12 += dN[a, 0] * y
        j21 += dN[a, 1] * x
        j22 += dN[a, 1] * y
        r += N[a] * x
    return j11, j12, j21, j22, r


@njit(cache=True, error_model="numpy")
def _map(X, e, N, dN, axisymmetric, G, inverse):
    """G (4, 2) = ∂N/∂X and inverse (2, 2) = ∂ξ_I/∂X_i at a point of element e → Jacobian determinant, radius."""
    j11, j12, j21, j22, r = _jacobian(X, e, N, dN)
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
def _tensors(inverse0, det0, axisymmetric, E):
    """E (m, 5): what the modes have in common at all points, j₀ J₀⁻ᵀ E J₀⁻¹ from ∂ξ/∂X at the centroid; see `_shares`.

    Behind the four or five (`MODES`) follow as many of the strain across, of the second degree in η and higher, as E has rows.
    They are without a dimension, j₀ times those of the source, so that the stiffnesses of all can be held against each other.
    """
    for k in range(E.shape[0]):
        I, J = (k // 2, k % 2) if k < 4 else (1, 1)
        for i in range(2):
            for j in range(2):
                E[k, 2 * i + j] = det0 * inverse0[I, i] * inverse0[J, j]
        E[k, 4] = 0.0
    if axisymmetric:
        E[4, :] = 0.0
        E[4, 4] = 1.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _shares(xi, eta, scale, axisymmetric, f):
    """Shares f (m,) of `_tensors` in the modes at a point (ξ, η); scale: j₀ r₀/(j r)."""
    f[0] = f[1] = scale * xi
    f[2] = f[3] = scale * eta
    last = 4
    if axisymmetric:
        f[4] = scale * xi * eta
        last = 5
    before, legendre = eta, 1.5 * eta * eta - 0.5
    for k in range(last, f.shape[0]):
        degree = 2 + k - last
        f[k] = scale * legendre
        before, legendre = legendre, ((2 * degree + 1) * eta * legendre - degree * before) / (degree + 1)


@njit(cache=True, error_model="numpy")
def kinematics(X, u, alpha, Hn, N, dN, weight, at, axisymmetric, finite, scale, H, h, w, failed):
    """X, u (e, 4, 2) initial positions and displacements, alpha (e, m), Hn (e, q, 5) committed → H, h (e, q, 5), w (e, q).

    N (q, 4), dN (q, 4, 2), weight (q,), at (q, 2) of `shapes.table`.
    H = F − I, h = f − I with f = F F_n⁻¹; w initial volumes. failed marks elements with det F ≤ 0 at a point.
    """
    G, G0 = np.empty((4, 2)), np.empty((4, 2))
    inverse, inverse0 = np.empty((2, 2)), np.empty((2, 2))
    m = alpha.shape[1]
    H0, E, f = np.empty(5), np.empty((m, 5)), np.empty(m)
    for e in range(X.shape[0]):
        det0, r0 = _map(X, e, _N0, _DN0, axisymmetric, G0, inverse0)
        _gradient(u, e, _N0, G0, r0, axisymmetric, H0)
        if not finite:
            H0[:] = 0.0
        _tensors(inverse0, det0, axisymmetric, E)
        for q in range(w.shape[1]):
            det, r = _map(X, e, N[q], dN[q], axisymmetric, G, inverse)
            w[e, q] = scale * weight[q] * det * r
            if not (det > 0.0 and r > 0.0):
                failed[e] = True
            F = H[e, q]
            _gradient(u, e, N[q], G, r, axisymmetric, F)
            _shares(at[q, 0], at[q, 1], det0 * r0 / (det * r), axisymmetric, f)
            b0 = b1 = b2 = b3 = b4 = 0.0
            for k in range(m):
                a = alpha[e, k] * f[k]
                b0 += a * E[k, 0]
                b1 += a * E[k, 1]
                b2 += a * E[k, 2]
                b3 += a * E[k, 3]
                b4 += a * E[k, 4]
            F[0] += (1.0 + H0[0]) * b0 + H0[1] * b2
            F[1] += (1.0 + H0[0]) * b1 + H0[1] * b3
            F[2] += H0[2] * b0 + (1.0 + H0[3]) * b2
            F[3] += H0[2] * b1 + (1.0 + H0[3]) * b3
            F[4] += (1.0 + H0[4]) * b4
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
def _stretched(H0, E):
    """E (m, 5), in place: F₀ E with F₀ − I = H0."""
    f0, f1, f2, f3, f4 = 1.0 + H0[0], H0[1], H0[2], 1.0 + H0[3], 1.0 + H0[4]
    for k in range(E.shape[0]):
        a, b, c, d = E[k, 0], E[k, 1], E[k, 2], E[k, 3]
        E[k, 0], E[k, 1], E[k, 2], E[k, 3] = f0 * a + f1 * c, f0 * b + f1 * d, f2 * a + f3 * c, f2 * b + f3 * d
        E[k, 4] *= f4


@njit(cache=True, error_model="numpy", forceinline=True)
def _moduli_times(A, e, q, wq, D, lo, AD):
    """AD (5, 8 + m) = w A D at a point, from column lo on; displacements along an axis change its components and the hoop."""
    n = D.shape[1]
    for c in range(5):
        a0, a1, a2, a3, a4 = wq * A[e, q, c, 0], wq * A[e, q, c, 1], wq * A[e, q, c, 2], wq * A[e, q, c, 3], wq * A[e, q, c, 4]
        for j in range(lo, 8, 2):
            AD[c, j] = a0 * D[0, j] + a1 * D[1, j] + a4 * D[4, j]
            AD[c, j + 1] = a2 * D[2, j + 1] + a3 * D[3, j + 1]
        for j in range(8, n):
            AD[c, j] = a0 * D[0, j] + a1 * D[1, j] + a2 * D[2, j] + a3 * D[3, j] + a4 * D[4, j]


@njit(cache=True, error_model="numpy")
def modes_left(X, u, alpha, H, Hn, N, dN, at, axisymmetric, finite, w, P, A, r, K, noise):
    """Forces r (e, m) on the modes and K = ∂r/∂α (e, m, m), for which they are sought; arguments as in `integrate`.

    noise (e, m): stresses, and the round-off of A times strains, that a zero of r is made of. H, Hn (e, q, 5): F − I now and as
    committed, both of which the strains come of: a released body has none left, but the round-off of those it had.
    """
    m = alpha.shape[1]
    G0, inverse0, H0 = np.empty((4, 2)), np.empty((2, 2)), np.empty(5)
    E, f = np.empty((m, 5)), np.empty(m)
    D, AD = np.zeros((5, 8 + m)), np.empty((5, 8 + m))
    for e in range(X.shape[0]):
        r[e], noise[e], K[e] = 0.0, 0.0, 0.0
        det0, r0 = _map(X, e, _N0, _DN0, axisymmetric, G0, inverse0)
        _gradient(u, e, _N0, G0, r0, axisymmetric, H0)
        if not finite:
            H0[:] = 0.0
        _tensors(inverse0, det0, axisymmetric, E)
        _stretched(H0, E)
        for q in range(w.shape[1]):
            j11, j12, j21, j22, rad = _jacobian(X, e, N[q], dN[q])
            scale = det0 * r0 / ((j11 * j22 - j12 * j21) * (rad if axisymmetric else 1.0))
            _shares(at[q, 0], at[q, 1], scale, axisymmetric, f)
            for k in range(m):
                for c in range(5):
                    D[c, 8 + k] = f[k] * E[k, c]
            wq, size = w[e, q], 0.0
            for c in range(5):
                size += abs(P[e, q, c])
                for b in range(5):
                    size += 1e-2 * abs(A[e, q, c, b]) * (abs(H[e, q, b]) + abs(Hn[e, q, b]))
            _moduli_times(A, e, q, wq, D, 8, AD)
            p0, p1, p2, p3, p4 = wq * P[e, q, 0], wq * P[e, q, 1], wq * P[e, q, 2], wq * P[e, q, 3], wq * P[e, q, 4]
            for i in range(m):
                d0, d1, d2, d3, d4 = D[0, 8 + i], D[1, 8 + i], D[2, 8 + i], D[3, 8 + i], D[4, 8 + i]
                r[e, i] += d0 * p0 + d1 * p1 + d2 * p2 + d3 * p3 + d4 * p4
                noise[e, i] += (abs(d0) + abs(d1) + abs(d2) + abs(d3) + abs(d4)) * (wq * size)
                for j in range(m):
                    K[e, i, j] += (
                        d0 * AD[0, 8 + j] + d1 * AD[1, 8 + j] + d2 * AD[2, 8 + j] + d3 * AD[3, 8 + j] + d4 * AD[4, 8 + j]
                    )


@njit(cache=True, error_model="numpy")
def integrate(X, u, alpha, N, dN, at, axisymmetric, finite, w, P, A, stiffness, r, K, forces):
    """Forces r (e, 8 + m) on displacements and modes and, for ``stiffness``, K = ∂r/∂(u, α) (e, 8 + m, 8 + m).

    P (e, q, 5) and A (e, q, 5, 5) per initial volume; forces (e,) = Σ |r| on displacements before points cancel.
    """
    m = alpha.shape[1]
    n = 8 + m
    G, G0 = np.empty((4, 2)), np.empty((4, 2))
    inverse, inverse0 = np.empty((2, 2)), np.empty((2, 2))
    H0, B, f = np.empty(5), np.empty(5), np.empty(m)
    E, M = np.empty((m, 5)), np.empty((m, 5))
    D, AD = np.zeros((5, n)), np.empty((5, n))
    for e in range(X.shape[0]):
        r[e] = 0.0
        forces[e] = 0.0
        if stiffness:
            K[e] = 0.0
        det0, r0 = _map(X, e, _N0, _DN0, axisymmetric, G0, inverse0)
        _gradient(u, e, _N0, G0, r0, axisymmetric, H0)
        if not finite:
            H0[:] = 0.0
        _tensors(inverse0, det0, axisymmetric, M)
        E[:] = M
        _stretched(H0, E)
        for q in range(w.shape[1]):
            det, rad = _map(X, e, N[q], dN[q], axisymmetric, G, inverse)
            _shares(at[q, 0], at[q, 1], det0 * r0 / (det * rad), axisymmetric, f)
            B[:] = 0.0
            if finite:
                for k in range(m):
                    for c in range(5):
                        B[c] += alpha[e, k] * f[k] * M[k, c]
            for a in range(4):
                g0, g1 = G0[a, 0], G0[a, 1]
                D[0, 2 * a] = D[2, 2 * a + 1] = G[a, 0] + g0 * B[0] + g1 * B[2]
                D[1, 2 * a] = D[3, 2 * a + 1] = G[a, 1] + g0 * B[1] + g1 * B[3]
                if axisymmetric:
                    D[4, 2 * a] = N[q, a] / rad + _N0[a] / r0 * B[4]
            for k in range(m):
                for c in range(5):
                    D[c, 8 + k] = f[k] * E[k, c]
            wq = w[e, q]
            p0, p1, p2, p3, p4 = wq * P[e, q, 0], wq * P[e, q, 1], wq * P[e, q, 2], wq * P[e, q, 3], wq * P[e, q, 4]
            for j in range(0, 8, 2):
                x = D[0, j] * p0 + D[1, j] * p1 + D[4, j] * p4
                y = D[2, j + 1] * p2 + D[3, j + 1] * p3
                r[e, j] += x
                r[e, j + 1] += y
                forces[e] += abs(x) + abs(y)
            for j in range(8, n):
                r[e, j] += D[0, j] * p0 + D[1, j] * p1 + D[2, j] * p2 + D[3, j] * p3 + D[4, j] * p4
            if not stiffness:
                continue
            _moduli_times(A, e, q, wq, D, 0, AD)
            for i in range(0, 8, 2):
                x0, x1, x4, y2, y3 = D[0, i], D[1, i], D[4, i], D[2, i + 1], D[3, i + 1]
                for j in range(n):
                    K[e, i, j] += x0 * AD[0, j] + x1 * AD[1, j] + x4 * AD[4, j]
                for j in range(n):
                    K[e, i + 1, j] += y2 * AD[2, j] + y3 * AD[3, j]
            for i in range(8, n):
                d0, d1, d2, d3, d4 = D[0, i], D[1, i], D[2, i], D[3, i], D[4, i]
                for j in range(n):
                    K[e, i, j] += d0 * AD[0, j] + d1 * AD[1, j] + d2 * AD[2, j] + d3 * AD[3, j] + d4 * AD[4, j]
            if not finite:
                continue
            for a in range(4):  # P : ∂²F/∂u∂α, F₀ carries the displacements too
                g0, g1 = G0[a, 0], G0[a, 1]
                for k in range(m):
                    m0, m1 = f[k] * (g0 * M[k, 0] + g1 * M[k, 2]), f[k] * (g0 * M[k, 1] + g1 * M[k, 3])
                    x, y = p0 * m0 + p1 * m1, p2 * m0 + p3 * m1
                    if axisymmetric:
                        x += p4 * _N0[a] / r0 * f[k] * M[k, 4]
                    K[e, 2 * a, 8 + k] += x
                    K[e, 8 + k, 2 * a] += x
                    K[e, 2 * a + 1, 8 + k] += y
                    K[e, 8 + k, 2 * a + 1] += y
