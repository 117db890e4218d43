"""J2 plasticity with isotropic hardening: backward-Euler return map in principal strains with its exact tangent.

The map is that of small strain; fed with logarithmic strains of b_e it is the finite-strain law, plastic flow exactly
isochoric (Simo 1992; de Souza Neto, Perić & Owen 2008, Box 14.3).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from prensa.materials.hardening import flow_stress


@njit(cache=True)
def _plastic_increment(q, G, jac, kind, p, knots, coefs, a0, y0, dy0, dt):
    """Root Δ of q − 3GΔ − J σ_y(a₀ + Δ) = 0 in (0, q/3G) by safeguarded Newton, with σ_y and its slope there.

    y0, dy0: flow stress and slope at a₀. Δ is NaN if the root does not come.
    """
    lo, hi = 0.0, q / (3.0 * G)
    x = (q - jac * y0) / (3.0 * G + max(0.0, jac * dy0)) if dy0 < 10.0 * G else 0.5 * (q - jac * y0) / (3.0 * G)
    y, dy = y0, dy0
    for _ in range(200):
        y, dy = flow_stress(kind, p, knots, coefs, a0 + x, x, dt)
        f = q - 3.0 * G * x - jac * y
        if f > 0.0:
            lo = x
        else:
            hi = x
        if abs(f) <= 2e-14 * q or hi - lo <= 4e-16 * hi:
            return x, y, dy
        x_new = x + f / (3.0 * G + jac * dy)
        x = x_new if lo < x_new < hi else 0.5 * (lo + hi)
    return math.nan, y, dy


@njit(cache=True)
def j2(eps, jn, old, K, G, cauchy, kind, p, knots, coefs, dt, tau, dtau, eps_e, new, failed):
    """Eps (n, 3) trial elastic strains → tau (n, 3), dtau (n, 3, 3) = ∂τ/∂ε, eps_e (n, 3); new and old (n, 6).

    History columns 4 and 5: equivalent plastic strain, plastic work per initial volume (trapezoid in time).
    ``cauchy``: the flow curve limits the Cauchy stress, q(τ) = J σ_y with J = exp(tr ε) (plastic flow is isochoric); else
    q(τ) = σ_y. jn (n,) is J at the last commit. failed (n,) is set where the return map finds no root.
    """
    for i in range(eps.shape[0]):
        tr = eps[i, 0] + eps[i, 1] + eps[i, 2]
        s0 = 2.0 * G * (eps[i, 0] - tr / 3.0)
        s1 = 2.0 * G * (eps[i, 1] - tr / 3.0)
        s2 = 2.0 * G * (eps[i, 2] - tr / 3.0)
        q = math.sqrt(1.5 * (s0 * s0 + s1 * s1 + s2 * s2))
        jac = math.exp(tr) if cauchy else 1.0
        a0 = old[i, 4]
        y0, dy0 = flow_stress(kind, p, knots, coefs, a0, 0.0, dt)
        delta, y1, dy1 = 0.0, y0, dy0
        if q > jac * y0:
            delta, y1, dy1 = _plastic_increment(q, G, jac, kind, p, knots, coefs, a0, y0, dy0, dt)
            if not delta >= 0.0:
                failed[i] = True
                delta = 0.0
        theta = 1.0 - 3.0 * G * delta / q if delta > 0.0 else 1.0
        new[i, 4] = a0 + delta
        new[i, 5] = old[i, 5] + 0.5 * ((jn[i] if cauchy else 1.0) * y0 + jac * y1) * delta
        n = (1.5 * s0 / q, 1.5 * s1 / q, 1.5 * s2 / q) if delta > 0.0 else (0.0, 0.0, 0.0)
        for k in range(3):
            s = s0 if k == 0 else (s1 if k == 1 else s2)
            tau[i, k] = K * tr + theta * s
            eps_e[i, k] = eps[i, k] - delta * n[k]
            for m in range(3):
                dtau[i, k, m] = K - 2.0 * G * theta / 3.0
            dtau[i, k, k] += 2.0 * G * theta
        if delta > 0.0:
            # ds = θ ds_tr − 3G (dΔ/q − Δ dq/q²) s_tr,  dq = 2G n·dε,  dΔ = (dq − J σ_y tr dε)/(3G + J σ_y′)
            denominator = 3.0 * G + jac * dy1
            volume = jac * y1 if cauchy else 0.0
            for k in range(3):
                for m in range(3):
                    dq = 2.0 * G * n[m]
                    dd = (dq - volume) / denominator
                    dtau[i, k, m] -= 2.0 * G * n[k] * (dd - delta * dq / q)


def plastic_strain(history: np.ndarray) -> np.ndarray:
    """Equivalent plastic strain from the history (..., 6) → (...)."""
    return history[..., 4]
