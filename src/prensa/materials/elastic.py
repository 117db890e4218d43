"""Elastic laws: Hooke in small strain; neo-Hooke; Hencky and St. Venant-Kirchhoff in principal strains."""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.lanes import (
    EIGHTS_OF_25,
    WIDE,
    five_into_rows,
    five_out_of_rows,
    four_into_rows,
    four_out_of_rows,
    out_of_rows,
    to_be_read,
    to_be_written,
)
from prensa.kernels.series import GROUP, SMALL_LOG, half_log
from prensa.kernels.spatial import det_of, det_of_kept, inverse_of
from prensa.kernels.spatial import push_forward as push_forward_in_space
from prensa.kernels.tensor import det_minus_one, push_forward


@njit(cache=True, error_model="numpy")
def hooke(h, old, lam, mu, P, A, new):
    """H (n, 5), old (n, 4) strain 11, 22, 33, 12 → P = σ (n, 5), A (n, 5, 5) constant, new (n, 4) strain."""
    for i in range(h.shape[0]):
        e11, e22, e33 = old[i, 0] + h[i, 0], old[i, 1] + h[i, 3], old[i, 2] + h[i, 4]
        e12 = old[i, 3] + 0.5 * (h[i, 1] + h[i, 2])
        p = lam * (e11 + e22 + e33)
        P[i, 0] = p + 2.0 * mu * e11
        P[i, 1] = P[i, 2] = 2.0 * mu * e12
        P[i, 3] = p + 2.0 * mu * e22
        P[i, 4] = p + 2.0 * mu * e33
        new[i, 0], new[i, 1], new[i, 2], new[i, 3] = e11, e22, e33, e12
        for k in range(5):
            for m in range(5):
                A[i, k, m] = 0.0
        for k in (0, 3, 4):
            for m in (0, 3, 4):
                A[i, k, m] = lam
            A[i, k, k] += 2.0 * mu
        A[i, 1, 1] = A[i, 1, 2] = A[i, 2, 1] = A[i, 2, 2] = mu


@njit(cache=True, error_model="numpy")
def hooke_spatial(h, old, lam, mu, P, A, new):
    """H (n, 9), old (n, 6) strain 11, 22, 33, 12, 13, 23 → P = σ (n, 9), A (n, 9, 9) constant, new (n, 6) strain."""
    for i in range(h.shape[0]):
        e11, e22, e33 = old[i, 0] + h[i, 0], old[i, 1] + h[i, 4], old[i, 2] + h[i, 8]
        e12, e13 = old[i, 3] + 0.5 * (h[i, 1] + h[i, 3]), old[i, 4] + 0.5 * (h[i, 2] + h[i, 6])
        e23 = old[i, 5] + 0.5 * (h[i, 5] + h[i, 7])
        p = lam * (e11 + e22 + e33)
        P[i, 0], P[i, 4], P[i, 8] = p + 2.0 * mu * e11, p + 2.0 * mu * e22, p + 2.0 * mu * e33
        P[i, 1] = P[i, 3] = 2.0 * mu * e12
        P[i, 2] = P[i, 6] = 2.0 * mu * e13
        P[i, 5] = P[i, 7] = 2.0 * mu * e23
        new[i, 0], new[i, 1], new[i, 2], new[i, 3], new[i, 4], new[i, 5] = e11, e22, e33, e12, e13, e23
        for k in range(9):
            for m in range(9):
                A[i, k, m] = 0.0
        for k in (0, 4, 8):
            for m in (0, 4, 8):
                A[i, k, m] = lam
            A[i, k, k] += 2.0 * mu
        for k, m in ((1, 3), (2, 6), (5, 7)):
            A[i, k, k] = A[i, k, m] = A[i, m, k] = A[i, m, m] = mu


@njit(cache=True, error_model="numpy")
def hencky(eps, lam, mu, tau, dtau, eps_e):
    """Eps (n, 3) principal logarithmic strains → τ_i = λ tr ε + 2μ ε_i (Hencky 1928), dtau (n, 3, 3), eps_e = eps."""
    for i in range(eps.shape[0]):
        p = lam * (eps[i, 0] + eps[i, 1] + eps[i, 2])
        for k in range(3):
            tau[i, k] = p + 2.0 * mu * eps[i, k]
            eps_e[i, k] = eps[i, k]
            for m in range(3):
                dtau[i, k, m] = lam
            dtau[i, k, k] += 2.0 * mu


# where the rows of the scratch of `neo_hooke` begin: gradients and what was committed, J² − 1, J_n² − 1, λ ln J, stresses, new
# history, tangent
_F_IN, _B_IN, _JJ, _JJ_IN, _LN_J = (GROUP * k for k in (0, 5, 9, 10, 11))
_P_OUT, _B_OUT, _A_OUT, _ROWS_OUT = (GROUP * k for k in (12, 17, 21, 46))


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _row_of_tangent(w, i, k, direct, c0, c1, g0, g1, x00, x01, x10, x11, g):
    """Row k of A, of the component g_ab of g = f⁻ᵀ, and the entry k of its last row.

    direct, c0, c1: λ g_ab and (μ − λ ln J) times g_a0, g_a1, over J_n; g0, g1: g_0b, g_1b; x: μ δ_ac b_n,be/J_n; g: all of it.
    """
    g00, g01, g10, g11, g33 = g
    to = _A_OUT + 5 * k * GROUP + i
    w[to], w[to + GROUP] = direct * g00 + c0 * g0 + x00, direct * g01 + c1 * g0 + x01
    w[to + 2 * GROUP], w[to + 3 * GROUP] = direct * g10 + c0 * g1 + x10, direct * g11 + c1 * g1 + x11
    w[to + 4 * GROUP] = direct * g33
    w[_A_OUT + (20 + k) * GROUP + i] = direct * g33


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def neo_hooke(h, old, lam, mu, P, A, new, failed, tangent):
    """ψ = μ/2 (I₁ − 3) − μ ln J + λ/2 (ln J)², without principal axes, which it does not need.

    h (n, 5) = f − I, old (n, 4) b_n − I as 11, 22, 33, 12 → P (n, 5) per committed volume, new (n, 4), failed (n,), and if
    ``tangent`` A (n, 25): P = [μ (b − I) + λ ln J I] f⁻ᵀ/J_n = [μ f b_n − (μ − λ ln J) f⁻ᵀ]/J_n, whence
    A_iJkL = [μ δ_ik b_n,JL + λ g_iJ g_kL + (μ − λ ln J) g_iL g_kJ]/J_n with g = f⁻ᵀ.

    Loops over a group of points have no branches: a compiler makes them into instructions for several points at once.
    """
    w = np.zeros(_ROWS_OUT)
    o = w.shape[0] - w.shape[0]  # 0: a function is compiled once for each constant that it is called with
    for first in range(0, h.shape[0], GROUP):
        m = min(GROUP, h.shape[0] - first)
        for i in range(0, m, WIDE):
            n, last = first + i, m - 1 - i
            to_be_read(old, (n + GROUP) * old.shape[1], old.shape[1])
            to_be_written(new, (n + GROUP) * new.shape[1], new.shape[1])
            to_be_written(P, 5 * (n + GROUP), 5)
            five_into_rows(h, 5 * n, 5, last, w, _F_IN + i, GROUP)
            four_into_rows(old, n * old.shape[1], old.shape[1], last, w, _B_IN + i, GROUP)
        bad = far = 0
        for i in range(GROUP):
            h11, h12, h21, h22, h33 = w[i], w[GROUP + i], w[2 * GROUP + i], w[3 * GROUP + i], w[4 * GROUP + i]
            o11, o22, o33, o12 = w[_B_IN + i], w[_B_IN + GROUP + i], w[_B_IN + 2 * GROUP + i], w[_B_IN + 3 * GROUP + i]
            jac, before = det_minus_one(h11, h12, h21, h22, h33), det_minus_one(o11, o12, o12, o22, o33)
            good = (jac > -1.0) & (1.0 + h33 > 0.0) & (before > -1.0)
            # J² − 1 = (1 + before)(1 + jac)² − 1 without cancellation
            x = before + jac * (2.0 + jac) * (1.0 + before)
            x = x if good else 0.0
            w[_JJ + i], w[_JJ_IN + i], w[_LN_J + i] = x, before if good else math.nan, lam * half_log(x)
            bad += 1 if (i < m) & (not good) else 0
            far += 1 if (i < m) & (abs(x) > SMALL_LOG) else 0
        if far:
            for i in range(m):
                w[_LN_J + i] = 0.5 * lam * math.log1p(w[_JJ + i])
        if bad:
            for i in range(m):
                if math.isnan(w[_JJ_IN + i]):
                    failed[first + i] = True
        for i in range(GROUP):
            h11, h12, h21, h22, h33 = w[i], w[GROUP + i], w[2 * GROUP + i], w[3 * GROUP + i], w[4 * GROUP + i]
            o11, o22, o33, o12 = w[_B_IN + i], w[_B_IN + GROUP + i], w[_B_IN + 2 * GROUP + i], w[_B_IN + 3 * GROUP + i]
            b11, b22, b33, b12 = push_forward(h11, h12, h21, h22, h33, o11, o22, o33, o12)
            p, jn, f11, f22 = w[_LN_J + i], 1.0 / math.sqrt(1.0 + w[_JJ_IN + i]), 1.0 + h11, 1.0 + h22
            inverse, g33 = 1.0 / (f11 * f22 - h12 * h21), 1.0 / (1.0 + h33)
            g00, g01, g10, g11 = f22 * inverse, -h21 * inverse, -h12 * inverse, f11 * inverse
            t11, t12, t22 = jn * (mu * b11 + p), jn * mu * b12, jn * (mu * b22 + p)
            w[_P_OUT + i], w[_P_OUT + GROUP + i] = t11 * g00 + t12 * g10, t11 * g01 + t12 * g11
            w[_P_OUT + 2 * GROUP + i], w[_P_OUT + 3 * GROUP + i] = t12 * g00 + t22 * g10, t12 * g01 + t22 * g11
            w[_P_OUT + 4 * GROUP + i] = jn * (mu * b33 + p) * g33
            w[_B_OUT + i], w[_B_OUT + GROUP + i], w[_B_OUT + 2 * GROUP + i], w[_B_OUT + 3 * GROUP + i] = b11, b22, b33, b12
            if tangent:
                d, s = jn * lam, jn * (mu - p)
                x00, x01, x11 = jn * mu * (1.0 + o11), jn * mu * o12, jn * mu * (1.0 + o22)
                g = (g00, g01, g10, g11, g33)
                _row_of_tangent(w, i, o, d * g00, s * g00, s * g01, g00, g10, x00, x01, 0.0, 0.0, g)
                _row_of_tangent(w, i, o + 1, d * g01, s * g00, s * g01, g01, g11, x01, x11, 0.0, 0.0, g)
                _row_of_tangent(w, i, o + 2, d * g10, s * g10, s * g11, g00, g10, 0.0, 0.0, x00, x01, g)
                _row_of_tangent(w, i, o + 3, d * g11, s * g10, s * g11, g01, g11, 0.0, 0.0, x01, x11, g)
                w[_A_OUT + 24 * GROUP + i] = jn * mu * (1.0 + o33) + (d + s) * g33 * g33
        for i in range(0, m, WIDE):
            n, last = first + i, m - 1 - i
            four_out_of_rows(new, n * new.shape[1], new.shape[1], last, w, _B_OUT + i, GROUP)
            five_out_of_rows(P, 5 * n, 5, last, w, _P_OUT + i, GROUP)
            if tangent:
                for k in EIGHTS_OF_25:
                    out_of_rows(A, 25 * n + k, 25, last, w, _A_OUT + k * GROUP + i, GROUP)


@njit(cache=True, error_model="numpy")
def neo_hooke_spatial(h, old, lam, mu, P, A, new, failed, tangent):
    """`neo_hooke` in three dimensions: h (n, 9), old, new (n, 6) b − I as 11, 22, 33, 12, 13, 23, P (n, 9), A (n, 9, 9)."""
    g, t, b_n = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))  # g = f⁻¹
    for i in range(h.shape[0]):
        b11, b22, b33, b12, b13, b23 = push_forward_in_space(h, old, i)
        jac, before = det_of(h, i), det_of_kept(old, i)
        if not (jac > -1.0 and before > -1.0):
            failed[i] = True
            jac = before = 0.0
        jn = 1.0 / math.sqrt(1.0 + before)
        p = 0.5 * lam * math.log1p(before + jac * (2.0 + jac) * (1.0 + before))
        inverse_of(h, i, g)
        t[0, 0], t[1, 1], t[2, 2] = jn * (mu * b11 + p), jn * (mu * b22 + p), jn * (mu * b33 + p)
        t[0, 1] = t[1, 0] = jn * mu * b12
        t[0, 2] = t[2, 0] = jn * mu * b13
        t[1, 2] = t[2, 1] = jn * mu * b23
        for a in range(3):
            for b in range(3):
                P[i, 3 * a + b] = t[a, 0] * g[b, 0] + t[a, 1] * g[b, 1] + t[a, 2] * g[b, 2]
        new[i, 0], new[i, 1], new[i, 2], new[i, 3], new[i, 4], new[i, 5] = b11, b22, b33, b12, b13, b23
        if not tangent:
            continue
        m, n, s = jn * mu, jn * lam, jn * (mu - p)
        b_n[0, 0], b_n[1, 1], b_n[2, 2] = m * (1.0 + old[i, 0]), m * (1.0 + old[i, 1]), m * (1.0 + old[i, 2])
        b_n[0, 1] = b_n[1, 0] = m * old[i, 3]
        b_n[0, 2] = b_n[2, 0] = m * old[i, 4]
        b_n[1, 2] = b_n[2, 1] = m * old[i, 5]
        for a in range(3):
            for b in range(3):
                for c in range(3):
                    for e in range(3):
                        value = n * g[b, a] * g[e, c] + s * g[e, a] * g[b, c]
                        A[i, 3 * a + b, 3 * c + e] = value + b_n[b, e] if a == c else value


@njit(cache=True)
def st_venant_kirchhoff(eps, lam, mu, tau, dtau, eps_e):
    """ψ = λ/2 (tr E)² + μ E:E in Green's strain E_i = (b_i − 1)/2, b_i = e^{2ε_i}: τ_i = b_i (λ tr E + 2μ E_i); as `hencky`."""
    for i in range(eps.shape[0]):
        trace = 0.0
        for k in range(3):
            trace += 0.5 * math.expm1(2.0 * eps[i, k])
        for k in range(3):
            b = math.exp(2.0 * eps[i, k])
            tau[i, k] = b * (lam * trace + mu * math.expm1(2.0 * eps[i, k]))
            eps_e[i, k] = eps[i, k]
            for m in range(3):
                dtau[i, k, m] = lam * b * math.exp(2.0 * eps[i, m])
            dtau[i, k, k] += 2.0 * tau[i, k] + 2.0 * mu * b * b


def quadratic_energy(eps: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """ψ = λ/2 (tr ε)² + μ ε:ε per initial volume; eps (..., 3) principal elastic strains → (...)."""
    a, b, c = eps[..., 0], eps[..., 1], eps[..., 2]
    return np.asarray(0.5 * lam * (a + b + c) ** 2 + mu * (a * a + b * b + c * c))


def neo_hooke_energy(eps: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """ψ of `neo_hooke` per initial volume; eps (..., 3) → (...)."""
    ln_j = eps @ np.ones(3)
    return np.asarray(0.5 * mu * np.expm1(2.0 * eps) @ np.ones(3) - mu * ln_j + 0.5 * lam * ln_j**2)


def hencky_at_rest(b: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """Cauchy stresses (n, 4) xx, yy, zz, xy of Hencky's law for b_e − I (n, 4) as 11, 22, 33, 12."""
    b11, b22, b33, b12 = b.T
    half = 0.5 * (b11 - b22)
    r = np.hypot(half, b12)
    low = 0.5 * (b11 + b22) - r
    # logarithmic strains ½ ln b: that of the lower principal value, what the upper one has more, and that out of the plane
    e, more, e3 = 0.5 * np.log1p(low), 0.5 * np.log1p(2.0 * r / (1.0 + low)), 0.5 * np.log1p(b33)
    trace = 2.0 * e + more + e3
    J = np.exp(trace)
    mean, apart = (lam * trace + mu * (2.0 * e + more)) / J, mu * more / J
    over = np.where(r > 0.0, apart / np.where(r > 0.0, r, 1.0), 0.0)
    return np.stack([mean + over * half, mean - over * half, (lam * trace + 2.0 * mu * e3) / J, over * b12], axis=1)
