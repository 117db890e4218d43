"""One return map for every friction law: stick or slip, the slip increment, the traction and its exact tangent.

Elastic-plastic analogy (paper eqs. 9-23), integrated by backward Euler in the tool frame; see docs/theory/contact.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from prensa.friction.law import At, FrictionLaw, bounded
from prensa.kernels.compiled import njit
from prensa.types import Array, Bytes, Flags

OPEN, STUCK, SLIDING, DECIDE = 0, 1, 2, 3
"""Branches of contact and friction that a point may be made to take; `DECIDE`: its pressure and trial traction say which."""
BRANCH = 3  # the bits that tell these apart
HOLD = 4  # a flag besides: where it touches, the point sticks
ON_BOUND = 1e-12  # a point that slid and has not moved yet is on the bound: it sticks, whatever the round-off says


class Tangential(NamedTuple):
    """t (k, d) traction, dt_dg (k, d, d), dt_dp (k, d), kappa (k,) new accumulated slip, slip (k,) flags.

    bound (k, 2): the bound and its derivative by the pressure, whether a point slips or not.
    """

    t: Array
    dt_dg: Array
    dt_dp: Array
    kappa: Array
    slip: Flags
    bound: Array


def return_map(
    law: FrictionLaw, at: At, lam: Array, dg: Array, p: Array, touching: Flags, kappa: Array, k_t: Array,
    want: Bytes | None = None,
) -> Tangential:  # fmt: skip
    """Traction t_T(Δg_T, p) from the committed traction (or multiplier).

    lam (k, d): traction at the start of the increment or multiplier, in d tangential axes of the tool; dg (k, d):
    tangential displacement relative to the tool during the increment; p (k,) pressure; touching (k,) flags, which
    include the points of p = 0 that are just in touch; kappa (k,) committed slip; k_t (k,) tangential stiffness.
    Where a point does not touch everything is zero, and the slip is kept. ``want`` (k,): branches that points take: with
    `SLIDING` they slip, also where that takes back some of the slip, with `STUCK` or the flag `HOLD`, by which the solver breaks
    cycles, they stick whatever the bound says; None: the trial tractions decide.

    The trial is t_tr = λ − k_T Δg; slip iff |t_tr| > τ_y(p, κ_n); then |t_tr| − k_T Δλ = τ_y(p, κ_n + Δλ).
    A softening law needs k_T > |∂τ_y/∂κ| for the root to be unique; where it may not be, the tangent is NaN, which the
    solver takes as a failed evaluation.
    """
    k, d = dg.shape
    t, dt_dp, dt_dg, bound = np.empty((k, d)), np.empty((k, d)), np.empty((k, d, d)), np.empty((k, 2))
    size, delta, slip, moves = np.empty(k), np.empty(k), np.empty(k, dtype=bool), np.empty(k, dtype=bool)
    tau, dtau_p, dtau_k = bounded(law, p, kappa, at)
    want = np.full(k, DECIDE, dtype=np.int8) if want is None else want
    results = size, moves, delta, slip, t, dt_dp, dt_dg, bound
    _tractions(lam, dg, p, k_t, touching, want, tau, dtau_p, k_t + dtau_k, *results)
    if law.hardens:
        if moves.any():
            held = (want & BRANCH) == SLIDING
            far, tau, dtau_p, dtau_k = _hardening_root(law, at, size, tau, p, kappa, k_t, moves, held)
        else:
            far = delta.copy()
        D = np.where(slip & (law.softening(p, kappa, at) >= k_t), np.nan, k_t + dtau_k)
        as_found = np.where(slip, SLIDING, STUCK).astype(np.int8)
        _tractions(lam, dg, p, k_t, touching, as_found, tau, dtau_p, D, *results)
        delta = far
    return Tangential(t, dt_dg, dt_dp, kappa + delta, slip, bound)


@njit(cache=True, error_model="numpy")
def _tractions(
    lam, dg, p, k_t, touching, want, tau, dtau_p, D, size, moves, delta, slip, t, dt_dp, dt_dg, bound
):  # fmt: skip
    """Trial tractions → which points slip, and tractions on the bound tau (k,) or below it with their derivatives.

    ``want`` as of `return_map`. ``size`` (k,) of the trial tractions; ``moves``: which points slip by more than nothing, and by
    how much, delta, if the bound stays.
    """
    d = dg.shape[1]
    for k in range(len(touching)):
        bound[k, 0], bound[k, 1] = tau[k], dtau_p[k]
        square = 0.0
        for i in range(d):
            t[k, i] = lam[k, i] - k_t[k] * dg[k, i] if touching[k] else 0.0
            square += t[k, i] * t[k, i]
        size[k] = abs(t[k, 0]) if d == 1 else math.sqrt(square)
        branch = want[k] & BRANCH
        if branch == SLIDING:
            slip[k] = touching[k]
            moves[k] = slip[k] and size[k] > 0.0
        else:
            sticks = branch == STUCK or (want[k] & HOLD) != 0
            slip[k] = touching[k] and size[k] > (1.0 + ON_BOUND) * tau[k] and not sticks
            moves[k] = slip[k] and p[k] > 0.0
        delta[k] = (size[k] - tau[k]) / k_t[k] if moves[k] else 0.0
        stick = -k_t[k] if touching[k] else 0.0
        theta = tau[k] / size[k] if slip[k] else 1.0
        for i in range(d):
            Ti = t[k, i] / size[k]
            dt_dp[k, i] = k_t[k] * dtau_p[k] / D[k] * Ti if slip[k] else 0.0
            for j in range(d):
                eye = 1.0 if i == j else 0.0
                TT = Ti * t[k, j] / size[k]
                slide = -k_t[k] * (theta * (eye - TT) + (1.0 - k_t[k] / D[k]) * TT)
                dt_dg[k, i, j] = slide if slip[k] else eye * stick
        for i in range(d):
            t[k, i] = theta * t[k, i]


def _hardening_root(
    law: FrictionLaw, at: At, size: Array, tau0: Array, p: Array, kappa: Array, k_t: Array, slip: Flags,
    held: Flags,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Safeguarded Newton for Δλ of all points at once; the bracket is (0, |t_tr|/k_T).

    Where slip is ``held`` bounds may be above |t_tr|, and below zero at a pressure below zero: the bracket reaches as far to
    both sides of |t_tr|/k_T.
    """
    hi = size / k_t
    lo = np.zeros_like(hi)
    reach = 2.0 * np.maximum(size, np.abs(tau0)) / k_t
    lo, hi = np.where(held, hi - reach, lo), np.where(held, hi + reach, hi)
    x = np.where(slip, np.clip((size - tau0) / k_t, lo, hi), 0.0)
    for _ in range(100):
        tau, dtau_p, dtau_k = bounded(law, p, kappa + x, at)
        f = size - k_t * x - tau
        lo, hi = np.where(f > 0, x, lo), np.where(f > 0, hi, x)
        if (~slip | (np.abs(f) <= 2e-16 * size) | (hi - lo <= 2e-16 * hi)).all():
            break
        D = k_t + dtau_k
        newton = x + f / np.where(D > 0, D, np.inf)
        inside = (newton > lo) & (newton < hi)
        x = np.where(slip & (np.abs(f) > 0), np.where(inside, newton, 0.5 * (lo + hi)), x)
    tau, dtau_p, dtau_k = bounded(law, p, kappa + x, at)
    return x, tau, dtau_p, dtau_k
