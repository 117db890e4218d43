"""J2 plasticity with isotropic hardening: backward-Euler return map in principal strains with its exact tangent.

The map is that of small strain; fed with logarithmic strains of b_e it is the finite-strain law, plastic flow exactly
isochoric (Simo 1992; de Souza Neto, Perić & Owen 2008, Box 14.3).
"""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit
from prensa.materials.hardening import JOHNSON_COOK, TINY, flow_stress

UNHELD = np.zeros(0, dtype=np.bool_)  # the trial stress says which points flow
ROOT_STEPS = 200  # of the search for a plastic strain; few take more than five
ON_SURFACE = 1e-11  # of the trial stress: beyond the yield surface by less is on it


@njit(cache=True, error_model="numpy", forceinline=True)
def _steps(f, slope, curvature):
    """Newton's and Halley's step, right to second and third order, to the root of f − slope s − curvature s²/2."""
    square = slope * slope
    bent = square + 0.5 * curvature * f
    inverse = f / (slope * bent)  # one division for both
    return inverse * bent, inverse * square


@njit(cache=True, error_model="numpy", forceinline=True)
def _start(f, elastic, slope, curvature):
    """Where the search for a root begins, from f, 3G and J σ_y′, J σ_y″ at a₀; not above 0 where f is not."""
    half, whole = 0.5 * f / elastic, elastic + slope
    newton, x = _steps(f, whole, curvature)
    start = x if (3.0 * whole < 13.0 * elastic) & (x > 0.0) & (x < 2.0 * half) else half
    return start if f > 0.0 else min(newton, 0.0)


@njit(cache=True, error_model="numpy", forceinline=True)
def _converged(x, newton, step, q, slope, curvature, smooth):
    """Whether Halley's ``step`` from x leads to the root; slope, curvature: J σ_y′, J σ_y″ at x; ``smooth``: see `_return`."""
    neglected = max(abs(slope), abs(curvature) * x) * abs(step * step * step)
    near = smooth & (abs(newton) <= 0.01 * abs(x)) & (neglected <= 1e-14 * q * x * x)
    return near | (abs(newton) <= 1e-8 * abs(x))


@njit(cache=True, error_model="numpy", forceinline=True)
def _return(todo, left, q, jac, G, kind, p, knots, coefs, begin, dt, delta, y, dy):
    """Roots Δ of f = q − 3GΔ − J σ_y(a₀ + Δ) = 0 in (0, q/3G) by safeguarded steps of Halley (1694), with σ_y and its slope.

    todo: numbers of the points, the first ``left`` of it, overwritten; q, jac, begin (n,), a₀; delta, y, dy (n,): starts,
    replaced by the roots (NaN if one does not come), and the curve there. The last step is taken with the curve's Taylor
    polynomial of second degree at hand: on curves without kinks when what it neglects, some σ_y′/x² of the step's third power,
    is round-off; on others below a relative 1e-8.

    A start Δ ≤ 0 is one of a point made to flow below the surface: its root is sought in (−q/3G, 0).

    Iterations go over all points, not the other way round: those of one point wait for each other, those of many overlap.
    """
    lo, hi, smooth = np.empty(len(q)), np.empty(len(q)), kind < JOHNSON_COOK
    for k in range(left):
        i = todo[k]
        far = q[i] / (3.0 * G)
        lo[i], hi[i] = (-far, 0.0) if delta[i] <= 0.0 else (0.0, far)
    for _ in range(ROOT_STEPS):
        if left == 0:
            return
        number, left = left, 0
        for k in range(number):
            i = todo[k]
            x = delta[i]
            s, ds, dds = flow_stress(kind, p, knots, coefs, begin[i] + x, x, dt)
            f = q[i] - 3.0 * G * x - jac[i] * s
            newton, step = _steps(f, 3.0 * G + jac[i] * ds, jac[i] * dds)
            if _converged(x, newton, step, q[i], jac[i] * ds, jac[i] * dds, smooth & (begin[i] > TINY)):
                delta[i], y[i], dy[i] = x + step, s + (ds + 0.5 * dds * step) * step, ds + dds * step
                continue
            if f > 0.0:
                lo[i] = x
            else:
                hi[i] = x
            if abs(f) <= 2e-14 * q[i] or hi[i] - lo[i] <= 4e-16 * max(hi[i], -lo[i]):
                y[i], dy[i] = s, ds
                continue
            delta[i] = x + step if lo[i] < x + step < hi[i] else 0.5 * (lo[i] + hi[i])
            todo[left] = i
            left += 1
    for k in range(left):
        delta[todo[k]] = math.nan


@njit(cache=True, error_model="numpy", forceinline=True)
def _roots(q, jac, begin, G, kind, p, knots, coefs, dt, todo, delta, y0, y, dy, held, first):
    """Plastic strain of each point from q, J and a₀ (n,) → delta (0 where nothing flows), σ_y(a₀), σ_y there and its slope (n,).

    held (m,): whether points flow, that of ``first`` the first one here; of no length: the trial stress decides.
    """
    flowing = 0
    for i in range(len(q)):
        y0[i], slope, curvature = flow_stress(kind, p, knots, coefs, begin[i], 0.0, dt)
        delta[i], y[i], dy[i] = 0.0, y0[i], slope
        f = q[i] - jac[i] * y0[i]
        # a committed state that flowed is on the yield surface but for round-off, which is not to say whether it flows on
        flows = held[first + i] if len(held) else f > ON_SURFACE * q[i]
        if flows:
            delta[i] = _start(f, 3.0 * G, jac[i] * slope, jac[i] * curvature)
            todo[flowing] = i
            flowing += 1
    _return(todo, flowing, q, jac, G, kind, p, knots, coefs, begin, dt, delta, y, dy)


@njit(cache=True, error_model="numpy")
def j2(
    eps, jn, old, column, K, G, cauchy, kind, p, knots, coefs, dt, tau, dtau, eps_e, new, failed, tangent, held=UNHELD, secant=0.0
):  # fmt: skip
    """Trial elastic strains eps (n, 3) → tau (n, 3), dtau (n, 3, 3) = ∂τ/∂ε if ``tangent``, eps_e (n, 3); new, old (n, h).

    ``secant``: share of the way from the tangent to the secant moduli, with which the direction of flow stays (Kačanov 1959).
    History ``column`` and the next: equivalent plastic strain, plastic work per initial volume (trapezoid in time).
    ``cauchy``: the flow curve limits the Cauchy stress, q(τ) = J σ_y with J = exp(tr ε) (plastic flow is isochoric); else
    q(τ) = σ_y. jn (n,) is J at the last commit. failed (n,) is set where the return map finds no root. held (n,): whether
    points flow, whatever the trial stress says; `UNHELD`: that decides.
    """
    size = eps.shape[0]
    curve = (p[0], p[1], p[2], p[3], p[4])
    qs, jacs, deltas, begin = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    y0s, ys, dys = np.empty(size), np.empty(size), np.empty(size)
    todo = np.empty(size, dtype=np.int64)
    for i in range(size):
        tr = eps[i, 0] + eps[i, 1] + eps[i, 2]
        e0, e1, e2 = eps[i, 0] - tr / 3.0, eps[i, 1] - tr / 3.0, eps[i, 2] - tr / 3.0
        q = 2.0 * G * math.sqrt(1.5 * (e0 * e0 + e1 * e1 + e2 * e2))
        jac = math.exp(tr) if cauchy else 1.0
        qs[i], jacs[i], begin[i] = q, jac, old[i, column]
    _roots(qs, jacs, begin, G, kind, curve, knots, coefs, dt, todo, deltas, y0s, ys, dys, held, 0)
    for i in range(size):
        tr = eps[i, 0] + eps[i, 1] + eps[i, 2]
        s = (2.0 * G * (eps[i, 0] - tr / 3.0), 2.0 * G * (eps[i, 1] - tr / 3.0), 2.0 * G * (eps[i, 2] - tr / 3.0))
        delta, q, jac, y1 = deltas[i], qs[i], jacs[i], ys[i]
        if math.isnan(delta):
            failed[i] = True
            delta = 0.0
        theta = 1.0 - 3.0 * G * delta / q if delta != 0.0 else 1.0
        new[i, column] = old[i, column] + delta
        new[i, column + 1] = old[i, column + 1] + 0.5 * ((jn[i] if cauchy else 1.0) * y0s[i] + jac * y1) * delta
        unit = 1.5 / q if delta != 0.0 else 0.0
        n = (unit * s[0], unit * s[1], unit * s[2])
        for k in range(3):
            tau[i, k] = K * tr + theta * s[k]
            eps_e[i, k] = eps[i, k] - delta * n[k]
        if not tangent:
            continue
        for k in range(3):
            for m in range(3):
                dtau[i, k, m] = K - 2.0 * G * theta / 3.0
            dtau[i, k, k] += 2.0 * G * theta
        if delta != 0.0:
            # ds = θ ds_tr − 3G (dΔ/q − Δ dq/q²) s_tr,  dq = 2G n·dε,  dΔ = (dq − J σ_y tr dε)/(3G + J σ_y′)
            soft = 1.0 / (3.0 * G + jac * dys[i])
            volume = jac * y1 if cauchy else 0.0
            for m in range(3):
                dq = 2.0 * G * n[m]
                change = (1.0 - secant) * 2.0 * G * ((dq - volume) * soft - delta / q * dq)
                for k in range(3):
                    dtau[i, k, m] -= n[k] * change
