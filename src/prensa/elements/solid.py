"""Isoparametric elements T3, T6, Q4 and Q8 by one pair of kernels that read shape tables; no cure for locking in them.

Like `prensa.elements.q4`, two batch kernels bracket the material, and everything refers to the last committed configuration
x_n (updated Lagrangian); in small strain that is X.
"""

from __future__ import annotations

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.tensor import det_minus_one


@njit(cache=True, error_model="numpy")
def gradients(x, e, N, dN, axisymmetric, out):
    """N (a,), dN (a, 2) at a point of element e of x (e, a, 2) → out (a, 2) gradients in x; Jacobian determinant, radius."""
    j11 = j12 = j21 = j22 = r = 0.0
    for a in range(N.shape[0]):
        j11 += dN[a, 0] * x[e, a, 0]
        j12 += dN[a, 0] * x[e, a, 1]
        j21 += dN[a, 1] * x[e, a, 0]
        j22 += dN[a, 1] * x[e, a, 1]
        r += N[a] * x[e, a, 0]
    det = j11 * j22 - j12 * j21
    for a in range(N.shape[0]):
        out[a, 0] = (j22 * dN[a, 0] - j12 * dN[a, 1]) / det
        out[a, 1] = (-j21 * dN[a, 0] + j11 * dN[a, 1]) / det
    return det, r if axisymmetric else 1.0


@njit(cache=True, error_model="numpy")
def kinematics(x, du, N, dN, weight, axisymmetric, finite, scale, h, w, failed):
    """X (e, a, 2) committed positions, du (e, a, 2) increments → h (e, q, 5) = f − I, w (e, q) volumes, failed (e,).

    N (q, a), dN (q, a, 2), weight (q,) of `shapes.table`; ``scale``: thickness, or 2π in axisymmetry. failed marks
    elements with det f ≤ 0 (or an inverted committed shape) at a point.
    """
    G = np.empty((N.shape[1], 2))
    for e in range(x.shape[0]):
        for q in range(N.shape[0]):
            det, r = gradients(x, e, N[q], dN[q], axisymmetric, G)
            w[e, q] = scale * weight[q] * det * r
            if not (det > 0.0 and r > 0.0):
                failed[e] = True
            h11 = h12 = h21 = h22 = h33 = 0.0
            for a in range(N.shape[1]):
                ux, uy = du[e, a, 0], du[e, a, 1]
                h11 += ux * G[a, 0]
                h12 += ux * G[a, 1]
                h21 += uy * G[a, 0]
                h22 += uy * G[a, 1]
                if axisymmetric:
                    h33 += ux * N[q, a] / r
            if finite and not (det_minus_one(h11, h12, h21, h22, h33) > -1.0 and h33 > -1.0):
                failed[e] = True
            h[e, q, 0], h[e, q, 1], h[e, q, 2], h[e, q, 3], h[e, q, 4] = h11, h12, h21, h22, h33


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def integrate(x, N, dN, axisymmetric, w, P, A, forces, stiffness, r_out, K_out):
    """P (e, q, 5), A (e, q, 5, 5) → r_out (e, 2a) internal forces, and with ``stiffness`` K_out (e, 2a, 2a).

    forces (e,) receives Σ |r| before the points cancel each other: the scale against which a residual is small.
    """
    n = N.shape[1]
    G = np.empty((n, 2))
    H = np.zeros(n)
    AG = np.empty((5, 2 * n))
    for e in range(x.shape[0]):
        r_out[e, :] = 0.0
        if stiffness:
            K_out[e, :, :] = 0.0
        total = 0.0
        for q in range(N.shape[0]):
            _, r = gradients(x, e, N[q], dN[q], axisymmetric, G)
            if axisymmetric:
                for a in range(n):
                    H[a] = N[q, a] / r
            wq = w[e, q]
            p0, p1, p2, p3, p4 = P[e, q, 0], P[e, q, 1], P[e, q, 2], P[e, q, 3], P[e, q, 4]
            for a in range(n):
                rx = wq * (G[a, 0] * p0 + G[a, 1] * p1 + H[a] * p4)
                ry = wq * (G[a, 0] * p2 + G[a, 1] * p3)
                r_out[e, 2 * a] += rx
                r_out[e, 2 * a + 1] += ry
                total += abs(rx) + abs(ry)
            if not stiffness:
                continue
            for k in range(5):
                a0, a1, a2, a3, a4 = A[e, q, k, 0], A[e, q, k, 1], A[e, q, k, 2], A[e, q, k, 3], A[e, q, k, 4]
                for a in range(n):
                    AG[k, 2 * a] = wq * (a0 * G[a, 0] + a1 * G[a, 1] + a4 * H[a])
                    AG[k, 2 * a + 1] = wq * (a2 * G[a, 0] + a3 * G[a, 1])
            for a in range(n):
                dx, dy, ha = G[a, 0], G[a, 1], H[a]
                for j in range(2 * n):
                    K_out[e, 2 * a, j] += dx * AG[0, j] + dy * AG[1, j] + ha * AG[4, j]
                    K_out[e, 2 * a + 1, j] += dx * AG[2, j] + dy * AG[3, j]
        forces[e] = total
