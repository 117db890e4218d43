"""4-node quadrilateral, 2 × 2 Gauss points, plain or F-bar, in plane strain and axisymmetry, small and finite strain.

Two batch kernels bracket the material: `kinematics` turns nodal increments into h = f − I at the points, `integrate`
turns stresses P and tangents A = ∂P/∂f into nodal forces and stiffnesses. Everything refers to the last committed
configuration x_n (updated Lagrangian); in small strain that is X.

F-bar (de Souza Neto, Perić, Dutko & Owen 1996): f̄ = α f with α = (J₀/J)^(1/m), J₀ at the centroid; m = 3 in
axisymmetry (hoop component included), m = 2 in plane strain (in-plane block). Forces r_a = ∫ c P̄ ∇N_a dV with
c = α^(1−m), which is ∫ σ(f̄) ∇N_a dv. In small strain it is B-bar (Hughes 1980), symmetric.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from prensa.kernels.tensor import det_minus_one

NODES, POINTS = 4, 4
_G = 1.0 / math.sqrt(3.0)
_XI = np.array([-1.0, 1.0, 1.0, -1.0])
_ETA = np.array([-1.0, -1.0, 1.0, 1.0])


@njit(cache=True)
def _gradients(x, e, xi, eta, axisymmetric, N, dN):  # type: ignore[no-untyped-def]
    """Shape functions N (4,), gradients dN (4, 2) in x at (xi, eta) of element e → Jacobian determinant and radius."""
    j11 = j12 = j21 = j22 = r = 0.0
    for a in range(4):
        N[a] = 0.25 * (1.0 + _XI[a] * xi) * (1.0 + _ETA[a] * eta)
        dx = 0.25 * _XI[a] * (1.0 + _ETA[a] * eta)
        dy = 0.25 * _ETA[a] * (1.0 + _XI[a] * xi)
        dN[a, 0] = dx
        dN[a, 1] = dy
        j11 += dx * x[e, a, 0]
        j12 += dx * x[e, a, 1]
        j21 += dy * x[e, a, 0]
        j22 += dy * x[e, a, 1]
        r += N[a] * x[e, a, 0]
    det = j11 * j22 - j12 * j21
    for a in range(4):
        dx, dy = dN[a, 0], dN[a, 1]
        dN[a, 0] = (j22 * dx - j12 * dy) / det
        dN[a, 1] = (-j21 * dx + j11 * dy) / det
    return det, r if axisymmetric else 1.0


@njit(cache=True)
def _gradient_of(e, du, N, dN, r, axisymmetric):  # type: ignore[no-untyped-def]
    """Components 11, 12, 21, 22, 33 of the displacement gradient of element e at a point."""
    h11 = h12 = h21 = h22 = h33 = 0.0
    for a in range(4):
        ux, uy = du[e, a, 0], du[e, a, 1]
        h11 += ux * dN[a, 0]
        h12 += ux * dN[a, 1]
        h21 += uy * dN[a, 0]
        h22 += uy * dN[a, 1]
        if axisymmetric:
            h33 += ux * N[a] / r
    return h11, h12, h21, h22, h33


@njit(cache=True)
def kinematics(x, du, axisymmetric, finite, bar, scale, h, w, alpha, failed):  # type: ignore[no-untyped-def]
    """X (e, 4, 2) committed positions, du (e, 4, 2) increments → h (e, 4, 5), w (e, 4) volumes, alpha (e, 4), failed (e,).

    ``scale`` multiplies the volumes (thickness, or 2π in axisymmetry). With ``bar``, h is that of f̄ and alpha − 1 is
    what F-bar added. failed marks elements with det f ≤ 0 (or an inverted committed shape) at a point.
    """
    N = np.empty(4)
    dN = np.empty((4, 2))
    m = 3.0 if axisymmetric else 2.0
    for e in range(x.shape[0]):
        ln0 = 0.0
        if bar:
            det, r = _gradients(x, e, 0.0, 0.0, axisymmetric, N, dN)
            h11, h12, h21, h22, h33 = _gradient_of(e, du, N, dN, r, axisymmetric)
            if finite:
                jm = det_minus_one(h11, h12, h21, h22, h33)
                if not jm > -1.0:
                    failed[e] = True
                    jm = 0.0
                ln0 = math.log1p(jm)
            else:
                ln0 = h11 + h22 + h33
        for q in range(4):
            det, r = _gradients(x, e, _XI[q] * _G, _ETA[q] * _G, axisymmetric, N, dN)
            w[e, q] = scale * det * r
            if not w[e, q] > 0.0:
                failed[e] = True
            h11, h12, h21, h22, h33 = _gradient_of(e, du, N, dN, r, axisymmetric)
            a1 = 0.0
            if finite:
                jm = det_minus_one(h11, h12, h21, h22, h33)
                if not (jm > -1.0 and h33 > -1.0):
                    failed[e] = True
                    jm = 0.0
                if bar:
                    a1 = math.expm1((ln0 - math.log1p(jm)) / m)
                    h11, h12, h21, h22 = (
                        h11 + a1 * (1.0 + h11),
                        h12 * (1.0 + a1),
                        h21 * (1.0 + a1),
                        h22 + a1 * (1.0 + h22),
                    )
                    if axisymmetric:
                        h33 += a1 * (1.0 + h33)
            elif bar:
                a1 = (ln0 - (h11 + h22 + h33)) / m
                h11 += a1
                h22 += a1
                if axisymmetric:
                    h33 += a1
            h[e, q, 0], h[e, q, 1], h[e, q, 2], h[e, q, 3], h[e, q, 4] = h11, h12, h21, h22, h33
            alpha[e, q] = 1.0 + a1


@njit(cache=True)
def _divergence(h11, h12, h21, h22, h33, N, dN, r, axisymmetric, finite, g):  # type: ignore[no-untyped-def]
    """G (8,) = f⁻ᵀ : ∂f/∂u, the derivative of ln det f with respect to the nodal increments (its trace in small strain)."""
    if finite:
        det = (1.0 + h11) * (1.0 + h22) - h12 * h21
        i11, i12, i21, i22 = (1.0 + h22) / det, -h12 / det, -h21 / det, (1.0 + h11) / det
    else:
        i11, i12, i21, i22 = 1.0, 0.0, 0.0, 1.0
    for a in range(4):
        g[2 * a] = i11 * dN[a, 0] + i21 * dN[a, 1]
        g[2 * a + 1] = i12 * dN[a, 0] + i22 * dN[a, 1]
        if axisymmetric:
            g[2 * a] += N[a] / r / (1.0 + h33 if finite else 1.0)


@njit(cache=True)
def integrate(x, du, axisymmetric, finite, bar, w, alpha, P, A, forces, stiffness, r_out, K_out):  # type: ignore[no-untyped-def]
    """P (e, 4, 5), A (e, 4, 5, 5) → r_out (e, 8) internal forces, and with ``stiffness`` K_out (e, 8, 8), exact.

    forces (e,) receives Σ |r| before the points cancel each other: the scale against which a residual is small.
    """
    N = np.empty(4)
    dN = np.empty((4, 2))
    g0 = np.zeros(8)
    g = np.zeros(8)
    G = np.zeros((5, 8))
    Gb = np.zeros((5, 8))
    AG = np.zeros((5, 8))
    m = 3.0 if axisymmetric else 2.0
    last = 5 if axisymmetric else 4
    for e in range(x.shape[0]):
        for i in range(8):
            r_out[e, i] = 0.0
            if stiffness:
                for j in range(8):
                    K_out[e, i, j] = 0.0
        if bar:
            _, r = _gradients(x, e, 0.0, 0.0, axisymmetric, N, dN)
            h11, h12, h21, h22, h33 = _gradient_of(e, du, N, dN, r, axisymmetric)
            _divergence(h11, h12, h21, h22, h33, N, dN, r, axisymmetric, finite, g0)
        total = 0.0
        for q in range(4):
            _, r = _gradients(x, e, _XI[q] * _G, _ETA[q] * _G, axisymmetric, N, dN)
            for a in range(4):
                G[0, 2 * a] = dN[a, 0]
                G[1, 2 * a] = dN[a, 1]
                G[2, 2 * a + 1] = dN[a, 0]
                G[3, 2 * a + 1] = dN[a, 1]
                if axisymmetric:
                    G[4, 2 * a] = N[a] / r
            al = alpha[e, q]
            c = 1.0
            wq = w[e, q]
            if bar:
                h11, h12, h21, h22, h33 = _gradient_of(e, du, N, dN, r, axisymmetric)
                _divergence(h11, h12, h21, h22, h33, N, dN, r, axisymmetric, finite, g)
                for i in range(8):
                    g[i] = (g0[i] - g[i]) / m
                if finite:
                    c = al ** (1.0 - m)
                    f11, f22, f33 = 1.0 + h11, 1.0 + h22, 1.0 + h33
                else:
                    f11, h12, h21, f22, f33 = 1.0, 0.0, 0.0, 1.0, 1.0
                    al = 1.0
                for i in range(8):
                    Gb[0, i] = al * (G[0, i] + f11 * g[i])
                    Gb[1, i] = al * (G[1, i] + h12 * g[i])
                    Gb[2, i] = al * (G[2, i] + h21 * g[i])
                    Gb[3, i] = al * (G[3, i] + f22 * g[i])
                    Gb[4, i] = al * (G[4, i] + f33 * g[i]) if axisymmetric else 0.0
            else:
                for k in range(5):
                    for i in range(8):
                        Gb[k, i] = G[k, i]
            # virtual gradients: B-bar is variational (Gb), F-bar integrates the true virtual work (G)
            V = Gb if bar and not finite else G
            wc = wq * c
            for i in range(8):
                s = 0.0
                for k in range(last):
                    s += V[k, i] * P[e, q, k]
                r_out[e, i] += wc * s
                total += abs(wc * s)
            if not stiffness:
                continue
            for k in range(last):
                pk = (1.0 - m) * P[e, q, k] if bar and finite else 0.0
                for i in range(8):
                    s = pk * g[i]
                    for n in range(last):
                        s += A[e, q, k, n] * Gb[n, i]
                    AG[k, i] = wc * s
            for i in range(8):
                for j in range(8):
                    s = 0.0
                    for k in range(last):
                        s += V[k, i] * AG[k, j]
                    K_out[e, i, j] += s
        forces[e] = total


@njit(cache=True)
def point_positions(x, out):  # type: ignore[no-untyped-def]
    """X (e, 4, 2) → out (e, 4, 2), positions of the integration points."""
    for e in range(x.shape[0]):
        for q in range(4):
            sx = sy = 0.0
            for a in range(4):
                n = 0.25 * (1.0 + _XI[a] * _XI[q] * _G) * (1.0 + _ETA[a] * _ETA[q] * _G)
                sx += n * x[e, a, 0]
                sy += n * x[e, a, 1]
            out[e, q, 0] = sx
            out[e, q, 1] = sy
