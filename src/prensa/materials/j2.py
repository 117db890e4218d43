"""J2 plasticity with isotropic hardening: backward-Euler return map in principal strains with its exact tangent.

The map is that of small strain; fed with logarithmic strains of b_e it is the finite-strain law, plastic flow exactly
isochoric (Simo 1992; de Souza Neto, Perić & Owen 2008, Box 14.3).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from prensa.materials.hardening import flow_stress


@njit(cache=True, error_model="numpy", forceinline=True)
def _plastic_increment(q, G, jac, kind, p, knots, coefs, a0, y0, dy0, dt):
    """Root Δ of q − 3GΔ − J σ_y(a₀ + Δ) = 0 in (0, q/3G) by safeguarded Newton, with σ_y and its slope there.

    y0, dy0: flow stress and slope at a₀. Δ is NaN if the root does not come. The last step, a relative 1e-8 or less, is
    taken with the slope at hand: what it neglects is of second order, below round-off.
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
        step = f / (3.0 * G + jac * dy)
        if abs(step) <= 1e-8 * x:
            return x + step, y + dy * step, dy
        x = x + step if lo < x + step < hi else 0.5 * (lo + hi)
    return math.nan, y, dy


@njit(cache=True, error_model="numpy")
def j2(eps, jn, old, K, G, cauchy, kind, p, knots, coefs, dt, tau, dtau, eps_e, new, failed, tangent):
    """Trial elastic strains eps (n, 3) → tau (n, 3), dtau (n, 3, 3) = ∂τ/∂ε if ``tangent``, eps_e (n, 3); new, old (n, 6).

    History columns 4 and 5: equivalent plastic strain, plastic work per initial volume (trapezoid in time).
    ``cauchy``: the flow curve limits the Cauchy stress, q(τ) = J σ_y with J = exp(tr ε) (plastic flow is isochoric); else
    q(τ) = σ_y. jn (n,) is J at the last commit. failed (n,) is set where the return map finds no root.
    """
    curve = (p[0], p[1], p[2], p[3], p[4])
    for i in range(eps.shape[0]):
        tr = eps[i, 0] + eps[i, 1] + eps[i, 2]
        s0 = 2.0 * G * (eps[i, 0] - tr / 3.0)
        s1 = 2.0 * G * (eps[i, 1] - tr / 3.0)
        s2 = 2.0 * G * (eps[i, 2] - tr / 3.0)
        q = math.sqrt(1.5 * (s0 * s0 + s1 * s1 + s2 * s2))
        jac = math.exp(tr) if cauchy else 1.0
        a0 = old[i, 4]
        y0, dy0 = flow_stress(kind, curve, knots, coefs, a0, 0.0, dt)
        delta, y1, dy1 = 0.0, y0, dy0
        if q > jac * y0:
            delta, y1, dy1 = _plastic_increment(q, G, jac, kind, curve, knots, coefs, a0, y0, dy0, dt)
            if not delta >= 0.0:
                failed[i] = True
                delta = 0.0
        theta = 1.0 - 3.0 * G * delta / q if delta > 0.0 else 1.0
        new[i, 4] = a0 + delta
        new[i, 5] = old[i, 5] + 0.5 * ((jn[i] if cauchy else 1.0) * y0 + jac * y1) * delta
        unit = 1.5 / q if delta > 0.0 else 0.0
        n = (unit * s0, unit * s1, unit * s2)
        tau[i, 0], tau[i, 1], tau[i, 2] = K * tr + theta * s0, K * tr + theta * s1, K * tr + theta * s2
        for k in range(3):
            eps_e[i, k] = eps[i, k] - delta * n[k]
        if not tangent:
            continue
        for k in range(3):
            for m in range(3):
                dtau[i, k, m] = K - 2.0 * G * theta / 3.0
            dtau[i, k, k] += 2.0 * G * theta
        if delta > 0.0:
            # ds = θ ds_tr − 3G (dΔ/q − Δ dq/q²) s_tr,  dq = 2G n·dε,  dΔ = (dq − J σ_y tr dε)/(3G + J σ_y′)
            soft = 1.0 / (3.0 * G + jac * dy1)
            volume = jac * y1 if cauchy else 0.0
            for m in range(3):
                dq = 2.0 * G * n[m]
                change = 2.0 * G * ((dq - volume) * soft - delta / q * dq)
                for k in range(3):
                    dtau[i, k, m] -= n[k] * change


def plastic_strain(history: np.ndarray) -> np.ndarray:
    """Equivalent plastic strain from the history (..., 6) → (...)."""
    return history[..., 4]
