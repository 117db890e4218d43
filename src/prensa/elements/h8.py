"""8-node brick, 2 × 2 × 2 Gauss points, with or without F-bar, small and finite strain.

Like `prensa.elements.q4`, two batch kernels bracket the material, and everything refers to the last committed configuration
x_n (updated Lagrangian); in small strain that is X. Tensors in the order 11, 12, 13, 21, 22, 23, 31, 32, 33.

F-bar (de Souza Neto, Perić, Dutko & Owen 1996): f̄ = α f with α = (J₀/J)^(1/3), J₀ at the centroid. Forces
r_a = ∫ c P̄ ∇N_a dV with c = α⁻², which is ∫ σ(f̄) ∇N_a dv. In small strain it is B-bar (Hughes 1980), symmetric, with the
volume average of the dilatation.
"""

from __future__ import annotations

import math

import numpy as np

from prensa.elements.shapes import cube, h8, table
from prensa.kernels.compiled import njit
from prensa.kernels.spatial import det_minus_one

BRICK_NODES, BRICK_POINTS = 8, 8
_BRICK_CENTRE = 8
BRICK = table(BRICK_NODES, cube(2))
# slopes of the shape functions at the points and, number 8, at the centre: (9, 8, 3)
_BRICK_DN = np.concatenate([BRICK.dN, h8(0.0, 0.0, 0.0)[1][None]])


@njit(cache=True, error_model="numpy", forceinline=True)
def _gradients(x, e, q, G):
    """∂N/∂x of element e at point q → G[q] (8, 3); Jacobian determinant."""
    j11 = j12 = j13 = j21 = j22 = j23 = j31 = j32 = j33 = 0.0  # j_IJ = ∂x_J/∂ξ_I
    for a in range(8):
        d1, d2, d3 = _BRICK_DN[q, a, 0], _BRICK_DN[q, a, 1], _BRICK_DN[q, a, 2]
        xa, ya, za = x[e, a, 0], x[e, a, 1], x[e, a, 2]
        j11 += d1 * xa
        j12 += d1 * ya
        j13 += d1 * za
        j21 += d2 * xa
        j22 += d2 * ya
        j23 += d2 * za
        j31 += d3 * xa
        j32 += d3 * ya
        j33 += d3 * za
    c11, c12, c13 = j22 * j33 - j23 * j32, j13 * j32 - j12 * j33, j12 * j23 - j13 * j22
    c21, c22, c23 = j23 * j31 - j21 * j33, j11 * j33 - j13 * j31, j13 * j21 - j11 * j23
    c31, c32, c33 = j21 * j32 - j22 * j31, j12 * j31 - j11 * j32, j11 * j22 - j12 * j21
    det = j11 * c11 + j12 * c21 + j13 * c31
    inverse = 1.0 / det
    for a in range(8):
        d1, d2, d3 = inverse * _BRICK_DN[q, a, 0], inverse * _BRICK_DN[q, a, 1], inverse * _BRICK_DN[q, a, 2]
        G[q, a, 0] = c11 * d1 + c12 * d2 + c13 * d3
        G[q, a, 1] = c21 * d1 + c22 * d2 + c23 * d3
        G[q, a, 2] = c31 * d1 + c32 * d2 + c33 * d3
    return det


@njit(cache=True, error_model="numpy", forceinline=True)
def _gradient_of(e, du, q, G):
    """Components of the displacement gradient of element e at point q."""
    h11 = h12 = h13 = h21 = h22 = h23 = h31 = h32 = h33 = 0.0
    for a in range(8):
        g1, g2, g3 = G[q, a, 0], G[q, a, 1], G[q, a, 2]
        u, v, w = du[e, a, 0], du[e, a, 1], du[e, a, 2]
        h11 += u * g1
        h12 += u * g2
        h13 += u * g3
        h21 += v * g1
        h22 += v * g2
        h23 += v * g3
        h31 += w * g1
        h32 += w * g2
        h33 += w * g3
    return h11, h12, h13, h21, h22, h23, h31, h32, h33


@njit(cache=True, error_model="numpy", forceinline=True)
def _divergence(h, q, G, g):
    """f⁻ᵀ : ∂f/∂u → g[q] (24,), the derivative of ln det f with respect to the nodal increments (of the trace at h = 0)."""
    h11, h12, h13, h21, h22, h23, h31, h32, h33 = h
    f11, f22, f33 = 1.0 + h11, 1.0 + h22, 1.0 + h33
    c11, c12, c13 = f22 * f33 - h23 * h32, h13 * h32 - h12 * f33, h12 * h23 - h13 * f22
    c21, c22, c23 = h23 * h31 - h21 * f33, f11 * f33 - h13 * h31, h13 * h21 - f11 * h23
    c31, c32, c33 = h21 * h32 - f22 * h31, h12 * h31 - f11 * h32, f11 * f22 - h12 * h21
    inverse = 1.0 / (f11 * c11 + h12 * c21 + h13 * c31)
    for a in range(8):
        g1, g2, g3 = inverse * G[q, a, 0], inverse * G[q, a, 1], inverse * G[q, a, 2]
        g[q, 3 * a] = c11 * g1 + c21 * g2 + c31 * g3
        g[q, 3 * a + 1] = c12 * g1 + c22 * g2 + c32 * g3
        g[q, 3 * a + 2] = c13 * g1 + c23 * g2 + c33 * g3


@njit(cache=True, error_model="numpy", forceinline=True)
def _mean_divergence(x, e, G, g):
    """Volume average of the virtual divergence of small strain → g[8] (24,), of the points → g[:8]; G (9, 8, 3) of the points."""
    for i in range(24):
        g[_BRICK_CENTRE, i] = 0.0
    total = 0.0
    for q in range(8):
        volume = _gradients(x, e, q, G)
        total += volume
        for a in range(8):
            for i in range(3):
                g[q, 3 * a + i] = G[q, a, i]
                g[_BRICK_CENTRE, 3 * a + i] += volume * G[q, a, i]
    for i in range(24):
        g[_BRICK_CENTRE, i] /= total


@njit(cache=True, error_model="numpy", forceinline=True)
def _cube_root_minus_one(delta):
    """(1 + δ)^(1/3) − 1 with all the digits that a small δ has."""
    return math.expm1(math.log1p(delta) / 3.0)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def kinematics(x, du, bar, finite, h, w, alpha, failed):
    """X (e, 8, 3) committed positions, du (e, 8, 3) increments → h (e, 8, 9), w (e, 8) volumes, alpha (e, 8), failed (e,).

    With ``bar`` h is that of f̄ and alpha − 1 is what F-bar added. failed marks elements with det f ≤ 0 (or an inverted
    committed shape) at a point.
    """
    G = np.empty((9, 8, 3))
    g = np.empty((9, 24))
    for e in range(x.shape[0]):
        centre, bad = 0.0, False
        if bar and finite:
            _gradients(x, e, _BRICK_CENTRE, G)
            h11, h12, h13, h21, h22, h23, h31, h32, h33 = _gradient_of(e, du, _BRICK_CENTRE, G)
            centre = det_minus_one(h11, h12, h13, h21, h22, h23, h31, h32, h33)
            bad = not centre > -1.0
        elif bar:
            _mean_divergence(x, e, G, g)
            for a in range(8):
                for i in range(3):
                    centre += g[_BRICK_CENTRE, 3 * a + i] * du[e, a, i]
        for q in range(8):
            volume = _gradients(x, e, q, G)
            w[e, q] = volume
            bad |= not volume > 0.0
            h11, h12, h13, h21, h22, h23, h31, h32, h33 = _gradient_of(e, du, q, G)
            a1 = 0.0
            if finite:
                here = det_minus_one(h11, h12, h13, h21, h22, h23, h31, h32, h33)
                bad |= not here > -1.0
                if bar:
                    a1 = _cube_root_minus_one((centre - here) / (1.0 + here))
                    h11, h12, h13 = h11 + a1 * (1.0 + h11), h12 + a1 * h12, h13 + a1 * h13
                    h21, h22, h23 = h21 + a1 * h21, h22 + a1 * (1.0 + h22), h23 + a1 * h23
                    h31, h32, h33 = h31 + a1 * h31, h32 + a1 * h32, h33 + a1 * (1.0 + h33)
            elif bar:
                a1 = (centre - (h11 + h22 + h33)) / 3.0
                h11, h22, h33 = h11 + a1, h22 + a1, h33 + a1
            h[e, q, 0], h[e, q, 1], h[e, q, 2] = h11, h12, h13
            h[e, q, 3], h[e, q, 4], h[e, q, 5] = h21, h22, h23
            h[e, q, 6], h[e, q, 7], h[e, q, 8] = h31, h32, h33
            alpha[e, q] = 1.0 + a1
        if bad:
            failed[e] = True


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def integrate(x, du, bar, finite, w, alpha, P, A, forces, stiffness, r_out, K_out):
    """P (e, 8, 9), A (e, 8, 9, 9) → r_out (e, 24) internal forces, and with ``stiffness`` K_out (e, 24, 24), exact.

    forces (e,) receives Σ |r| before the points cancel each other: the scale against which a residual is small.

    With f̄ = α f, ∂f̄/∂u = α (G + f ⊗ g) and ∂c/∂u = −2 c g, g = ∂ ln α/∂u (24,), zero without ``bar``.
    """
    G = np.empty((9, 8, 3))
    g = np.zeros((9, 24))
    AG = np.empty((9, 24))
    f = np.empty(9)
    for e in range(x.shape[0]):
        if bar and not finite:
            _mean_divergence(x, e, G, g)
        elif bar and stiffness:
            _gradients(x, e, _BRICK_CENTRE, G)
            _divergence(_gradient_of(e, du, _BRICK_CENTRE, G), _BRICK_CENTRE, G, g)
        for i in range(24):
            r_out[e, i] = 0.0
        if stiffness:
            for i in range(24):
                for j in range(24):
                    K_out[e, i, j] = 0.0
        total = 0.0
        for q in range(8):
            al, wc = 1.0, w[e, q]
            for k in range(9):
                f[k] = 1.0 if k % 4 == 0 else 0.0
            if finite or not bar:
                _gradients(x, e, q, G)
            if finite and bar:
                al = alpha[e, q]
                wc /= al * al
                if stiffness:
                    h = _gradient_of(e, du, q, G)
                    _divergence(h, q, G, g)
                    for k in range(9):
                        f[k] += h[k]
            if bar and (stiffness or not finite):
                for i in range(24):
                    g[q, i] = (g[_BRICK_CENTRE, i] - g[q, i]) / 3.0
            # B-bar is variational: its virtual gradients carry g too; F-bar integrates the true virtual work
            variational = bar and not finite
            trace = wc * (P[e, q, 0] + P[e, q, 4] + P[e, q, 8]) if variational else 0.0
            for a in range(8):
                for i in range(3):
                    value = 0.0
                    for J in range(3):
                        value += G[q, a, J] * P[e, q, 3 * i + J]
                    value *= wc
                    if variational:
                        value += g[q, 3 * a + i] * trace
                    r_out[e, 3 * a + i] += value
                    total += abs(value)
            if not stiffness:
                continue
            wa = wc * al
            for k in range(9):
                s = 0.0
                if bar:
                    for m in range(9):
                        s += A[e, q, k, m] * f[m]
                    s *= wa
                    if finite:
                        s -= 2.0 * wc * P[e, q, k]
                for i in range(3):
                    a0, a1, a2 = wa * A[e, q, k, 3 * i], wa * A[e, q, k, 3 * i + 1], wa * A[e, q, k, 3 * i + 2]
                    for a in range(8):
                        AG[k, 3 * a + i] = a0 * G[q, a, 0] + a1 * G[q, a, 1] + a2 * G[q, a, 2] + s * g[q, 3 * a + i]
            for a in range(8):
                g0, g1, g2 = G[q, a, 0], G[q, a, 1], G[q, a, 2]
                for i in range(3):
                    for j in range(24):
                        K_out[e, 3 * a + i, j] += g0 * AG[3 * i, j] + g1 * AG[3 * i + 1, j] + g2 * AG[3 * i + 2, j]
            if variational:
                for i in range(24):
                    for j in range(24):
                        K_out[e, i, j] += g[q, i] * (AG[0, j] + AG[4, j] + AG[8, j])
        forces[e] = total
