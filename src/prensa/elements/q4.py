"""4-node quadrilateral, 2 × 2 Gauss points, with F-bar, in plane strain and axisymmetry, small and finite strain.

Two batch kernels bracket the material: `kinematics` turns nodal increments into h = f − I at the points, `integrate`
turns stresses P and tangents A = ∂P/∂f into nodal forces and stiffnesses. Everything refers to the last committed
configuration x_n (updated Lagrangian); in small strain that is X.

F-bar (de Souza Neto, Perić, Dutko & Owen 1996): f̄ = α f with α = (J₀/J)^(1/m), J₀ at the centroid; m = 3 in
axisymmetry (hoop component included), m = 2 in plane strain (in-plane block). Forces r_a = ∫ c P̄ ∇N_a dV with
c = α^(1−m), which is ∫ σ(f̄) ∇N_a dv. In small strain it is B-bar
(Hughes 1980), symmetric, with the volume average of the dilatation: that of the centroid, the same in plane strain, would fail
the patch test in axisymmetry.
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
# shape functions and their derivatives by ξ and η at the points and, number 4, at the centre: (5, 4) each
_CENTRE = 4
_AT = np.append(np.array([_XI, _ETA]) * _G, [[0.0], [0.0]], axis=1)
_N = 0.25 * (1.0 + _XI * _AT[0][:, None]) * (1.0 + _ETA * _AT[1][:, None])
_DX = 0.25 * _XI * (1.0 + _ETA * _AT[1][:, None])
_DY = 0.25 * _ETA * (1.0 + _XI * _AT[0][:, None])


@njit(cache=True, error_model="numpy", forceinline=True)
def _gradients(x, e, q, axisymmetric, N, dN):
    """Shape functions N (4,), gradients dN (4, 2) in x at point q of element e → Jacobian determinant and radius."""
    j11 = j12 = j21 = j22 = r = 0.0
    for a in range(4):
        N[a] = _N[q, a]
        dx, dy = _DX[q, a], _DY[q, a]
        j11 += dx * x[e, a, 0]
        j12 += dx * x[e, a, 1]
        j21 += dy * x[e, a, 0]
        j22 += dy * x[e, a, 1]
        r += N[a] * x[e, a, 0]
    det = j11 * j22 - j12 * j21
    j11, j12, j21, j22 = j11 / det, j12 / det, j21 / det, j22 / det
    for a in range(4):
        dx, dy = _DX[q, a], _DY[q, a]
        dN[a, 0] = j22 * dx - j12 * dy
        dN[a, 1] = j11 * dy - j21 * dx
    return det, r if axisymmetric else 1.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _gradient_of(e, du, N, dN, r, axisymmetric):
    """Components 11, 12, 21, 22, 33 of the displacement gradient of element e at a point."""
    h11 = h12 = h21 = h22 = h33 = 0.0
    for a in range(4):
        ux, uy = du[e, a, 0], du[e, a, 1]
        h11 += ux * dN[a, 0]
        h12 += ux * dN[a, 1]
        h21 += uy * dN[a, 0]
        h22 += uy * dN[a, 1]
        if axisymmetric:
            h33 += ux * N[a]
    h33 /= r
    return h11, h12, h21, h22, h33


@njit(cache=True, error_model="numpy", forceinline=True)
def _divergence(h11, h12, h21, h22, h33, N, dN, r, axisymmetric, finite, g):
    """G (8,) = f⁻ᵀ : ∂f/∂u, the derivative of ln det f with respect to the nodal increments (its trace in small strain)."""
    if finite:
        det = (1.0 + h11) * (1.0 + h22) - h12 * h21
        i11, i12, i21, i22 = (1.0 + h22) / det, -h12 / det, -h21 / det, (1.0 + h11) / det
    else:
        i11, i12, i21, i22 = 1.0, 0.0, 0.0, 1.0
    i33 = 1.0 / (r * (1.0 + h33 if finite else 1.0))
    for a in range(4):
        g[2 * a] = i11 * dN[a, 0] + i21 * dN[a, 1]
        g[2 * a + 1] = i12 * dN[a, 0] + i22 * dN[a, 1]
        if axisymmetric:
            g[2 * a] += N[a] * i33


@njit(cache=True, error_model="numpy")
def _mean_divergence(x, e, axisymmetric, N, dN, g, mean):
    """Mean (8,) = volume average of the virtual divergence of small strain; g (8,) scratch."""
    mean[:] = 0.0
    total = 0.0
    for q in range(4):
        det, r = _gradients(x, e, q, axisymmetric, N, dN)
        _divergence(0.0, 0.0, 0.0, 0.0, 0.0, N, dN, r, axisymmetric, False, g)
        total += det * r
        for i in range(8):
            mean[i] += det * r * g[i]
    for i in range(8):
        mean[i] /= total


@njit(cache=True, error_model="numpy")
def kinematics(x, du, axisymmetric, finite, scale, h, w, alpha, failed):
    """X (e, 4, 2) committed positions, du (e, 4, 2) increments → h (e, 4, 5), w (e, 4) volumes, alpha (e, 4), failed (e,).

    ``scale`` multiplies the volumes (thickness, or 2π in axisymmetry). h is that of f̄ and alpha − 1 is what F-bar
    added. failed marks elements with det f ≤ 0 (or an inverted committed shape) at a point.
    """
    N = np.empty(4)
    dN = np.empty((4, 2))
    g, g0 = np.empty(8), np.empty(8)
    m = 3.0 if axisymmetric else 2.0
    for e in range(x.shape[0]):
        ln0 = 0.0
        if finite:
            det, r = _gradients(x, e, _CENTRE, axisymmetric, N, dN)
            h11, h12, h21, h22, h33 = _gradient_of(e, du, N, dN, r, axisymmetric)
            jm = det_minus_one(h11, h12, h21, h22, h33)
            if not jm > -1.0:
                failed[e] = True
                jm = 0.0
            ln0 = math.log1p(jm)
        else:
            _mean_divergence(x, e, axisymmetric, N, dN, g, g0)
            for a in range(4):
                ln0 += g0[2 * a] * du[e, a, 0] + g0[2 * a + 1] * du[e, a, 1]
        for q in range(4):
            det, r = _gradients(x, e, q, axisymmetric, N, dN)
            w[e, q] = scale * det * r
            if not w[e, q] > 0.0:
                failed[e] = True
            h11, h12, h21, h22, h33 = _gradient_of(e, du, N, dN, r, axisymmetric)
            if finite:
                jm = det_minus_one(h11, h12, h21, h22, h33)
                if not (jm > -1.0 and h33 > -1.0):
                    failed[e] = True
                    jm = 0.0
                a1 = math.expm1((ln0 - math.log1p(jm)) / m)
                h11, h12, h21, h22 = (
                    h11 + a1 * (1.0 + h11),
                    h12 * (1.0 + a1),
                    h21 * (1.0 + a1),
                    h22 + a1 * (1.0 + h22),
                )
                if axisymmetric:
                    h33 += a1 * (1.0 + h33)
            else:
                a1 = (ln0 - (h11 + h22 + h33)) / m
                h11 += a1
                h22 += a1
                if axisymmetric:
                    h33 += a1
            h[e, q, 0], h[e, q, 1], h[e, q, 2], h[e, q, 3], h[e, q, 4] = h11, h12, h21, h22, h33
            alpha[e, q] = 1.0 + a1


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def integrate(x, du, axisymmetric, finite, w, alpha, P, A, forces, stiffness, r_out, K_out):
    """P (e, 4, 5), A (e, 4, 5, 5) → r_out (e, 8) internal forces, and with ``stiffness`` K_out (e, 8, 8), exact.

    forces (e,) receives Σ |r| before the points cancel each other: the scale against which a residual is small.

    With f̄ = α f, ∂f̄/∂u = α (G + f ⊗ g) and ∂c/∂u = c (1 − m) g, g = ∂ ln α/∂u (8,); rows of the virtual gradients G are
    sparse (node a: 11, 12, 33 with u_x and 21, 22 with u_y), which the products use.
    """
    N = np.empty(4)
    dN = np.empty((4, 2))
    H = np.zeros(4)
    g0 = np.zeros(8)
    g = np.zeros(8)
    f = np.zeros(5)
    Af = np.zeros(5)
    AG = np.zeros((5, 8))
    m = 3.0 if axisymmetric else 2.0
    for e in range(x.shape[0]):
        r_out[e, :] = 0.0
        if stiffness:
            K_out[e, :, :] = 0.0
        if finite and stiffness:
            _, r = _gradients(x, e, _CENTRE, axisymmetric, N, dN)
            h11, h12, h21, h22, h33 = _gradient_of(e, du, N, dN, r, axisymmetric)
            _divergence(h11, h12, h21, h22, h33, N, dN, r, axisymmetric, finite, g0)
        elif not finite:
            _mean_divergence(x, e, axisymmetric, N, dN, g, g0)
        total = 0.0
        for q in range(4):
            _, r = _gradients(x, e, q, axisymmetric, N, dN)
            if axisymmetric:
                ir = 1.0 / r
                for a in range(4):
                    H[a] = N[a] * ir
            al = 1.0
            wc = w[e, q]
            h11 = h12 = h21 = h22 = h33 = 0.0
            if stiffness or not finite:
                h11, h12, h21, h22, h33 = _gradient_of(e, du, N, dN, r, axisymmetric)
                _divergence(h11, h12, h21, h22, h33, N, dN, r, axisymmetric, finite, g)
                for i in range(8):
                    g[i] = (g0[i] - g[i]) / m
            if finite:
                al = alpha[e, q]
                wc /= al * al if axisymmetric else al
                f[0], f[1], f[2], f[3] = 1.0 + h11, h12, h21, 1.0 + h22
                f[4] = 1.0 + h33 if axisymmetric else 0.0
            else:
                f[0], f[1], f[2], f[3], f[4] = 1.0, 0.0, 0.0, 1.0, 1.0 if axisymmetric else 0.0
            p0, p1, p2, p3, p4 = P[e, q, 0], P[e, q, 1], P[e, q, 2], P[e, q, 3], P[e, q, 4]
            # B-bar is variational: its virtual gradients carry g too; F-bar integrates the true virtual work
            trace = 0.0 if finite else p0 + p3 + (p4 if axisymmetric else 0.0)
            for a in range(4):
                rx = dN[a, 0] * p0 + dN[a, 1] * p1 + H[a] * p4 + g[2 * a] * trace
                ry = dN[a, 0] * p2 + dN[a, 1] * p3 + g[2 * a + 1] * trace
                r_out[e, 2 * a] += wc * rx
                r_out[e, 2 * a + 1] += wc * ry
                total += wc * (abs(rx) + abs(ry))
            if not stiffness:
                continue
            for k in range(5):
                s = 0.0
                for n in range(5):
                    s += A[e, q, k, n] * f[n]
                s *= al
                if finite:
                    s += (1.0 - m) * P[e, q, k]
                Af[k] = wc * s
            wa = wc * al
            for k in range(5):
                a0, a1, a2, a3, a4 = A[e, q, k, 0], A[e, q, k, 1], A[e, q, k, 2], A[e, q, k, 3], A[e, q, k, 4]
                for a in range(4):
                    AG[k, 2 * a] = wa * (a0 * dN[a, 0] + a1 * dN[a, 1] + a4 * H[a]) + Af[k] * g[2 * a]
                    AG[k, 2 * a + 1] = wa * (a2 * dN[a, 0] + a3 * dN[a, 1]) + Af[k] * g[2 * a + 1]
            for a in range(4):
                dx, dy, ha = dN[a, 0], dN[a, 1], H[a]
                for j in range(8):
                    K_out[e, 2 * a, j] += dx * AG[0, j] + dy * AG[1, j] + ha * AG[4, j]
                    K_out[e, 2 * a + 1, j] += dx * AG[2, j] + dy * AG[3, j]
            if not finite:
                for j in range(8):
                    t = AG[0, j] + AG[3, j] + (AG[4, j] if axisymmetric else 0.0)
                    for i in range(8):
                        K_out[e, i, j] += g[i] * t
        forces[e] = total
