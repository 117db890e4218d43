"""One return map for every friction law: stick or slip, the slip increment, the traction and its exact tangent.

Elastic-plastic analogy (paper eqs. 9-23), integrated by backward Euler in the tool frame; see docs/theory/contact.md.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.friction.law import At, FrictionLaw, bounded
from prensa.kernels.compiled import njit

Array = NDArray[np.float64]

ON_BOUND = 1e-12  # a point that slid and has not moved yet is on the bound: it sticks, whatever the round-off says


class Tangential(NamedTuple):
    """t (k, d) traction, dt_dg (k, d, d), dt_dp (k, d), kappa (k,) new accumulated slip, slip (k,) flags.

    bound (k, 2): the bound and its derivative by the pressure, whether a point slips or not.
    """

    t: Array
    dt_dg: Array
    dt_dp: Array
    kappa: Array
    slip: NDArray[np.bool_]
    bound: Array


def return_map(
    law: FrictionLaw, at: At, lam: Array, dg: Array, p: Array, touching: NDArray[np.bool_], kappa: Array, k_t: Array,
    hold: NDArray[np.bool_] | None = None, slips: NDArray[np.bool_] | None = None,
) -> Tangential:  # fmt: skip
    """Traction t_T(Δg_T, p) from the committed traction (or multiplier).

    lam (k, d): traction at the start of the increment or multiplier, in d tangential axes of the tool; dg (k, d):
    tangential displacement relative to the tool during the increment; p (k,) pressure; touching (k,) flags, which
    include the points of p = 0 that are just in touch; kappa (k,) committed slip; k_t (k,) tangential stiffness.
    Where a point does not touch everything is zero, and the slip is kept. ``hold`` (k,): points that stick whatever
    the bound says, an override with which the solver breaks cycles. ``slips`` (k,): the points that slip, also where that
    takes back some of the slip; None: the trial traction decides.

    The trial is t_tr = λ − k_T Δg; slip iff |t_tr| > τ_y(p, κ_n); then |t_tr| − k_T Δλ = τ_y(p, κ_n + Δλ).
    A softening law needs k_T > |∂τ_y/∂κ| for the root to be unique; where it may not be, the tangent is NaN, which the
    solver takes as a failed evaluation.
    """
    trial = np.where(touching[:, None], lam - k_t[:, None] * dg, 0.0)
    size = np.abs(trial[:, 0]) if trial.shape[1] == 1 else np.sqrt((trial**2).sum(axis=1))
    tau, dtau_p, dtau_k = bounded(law, p, kappa, at)
    slip = touching & (size > (1.0 + ON_BOUND) * tau)
    if hold is not None:
        slip &= ~hold
    if slips is not None:
        slip = touching & slips
    moves = slip & ((p > 0) if slips is None else (size > 0))
    delta = np.where(moves, (size - tau) / k_t, 0.0)
    if law.hardens and moves.any():
        delta, tau, dtau_p, dtau_k = _hardening_root(law, at, size, tau, p, kappa, k_t, moves, slips is not None)
    D = k_t + dtau_k
    if law.hardens:
        D = np.where(slip & (law.softening(p, kappa, at) >= k_t), np.nan, D)
    k, d = dg.shape
    t, dt_dp, dt_dg = np.zeros((k, d)), np.zeros((k, d)), np.zeros((k, d, d))
    _tractions(trial, size, tau, dtau_p, D, k_t, touching, slip, t, dt_dp, dt_dg)
    bound = np.empty((k, 2))
    bound[:, 0], bound[:, 1] = tau, dtau_p
    return Tangential(t, dt_dg, dt_dp, kappa + delta, slip, bound)


@njit(cache=True, error_model="numpy")
def _tractions(trial, size, tau, dtau_p, D, k_t, touching, slip, t, dt_dp, dt_dg):
    """Trial tractions → tractions on the bound or below it and their derivatives, which are zero where nothing touches."""
    d = trial.shape[1]
    for k in range(len(touching)):
        if not touching[k]:
            continue
        theta = tau[k] / size[k] if slip[k] else 1.0
        for i in range(d):
            t[k, i] = theta * trial[k, i]
            dt_dg[k, i, i] = -k_t[k]
            if slip[k]:
                Ti = trial[k, i] / size[k]
                dt_dp[k, i] = k_t[k] * dtau_p[k] / D[k] * Ti
                for j in range(d):
                    TT = Ti * trial[k, j] / size[k]
                    eye = 1.0 if i == j else 0.0
                    dt_dg[k, i, j] = -k_t[k] * (theta * (eye - TT) + (1.0 - k_t[k] / D[k]) * TT)


def _hardening_root(
    law: FrictionLaw, at: At, size: Array, tau0: Array, p: Array, kappa: Array, k_t: Array, slip: NDArray[np.bool_],
    held: bool,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Safeguarded Newton for Δλ of all points at once; the bracket is (0, |t_tr|/k_T).

    Where slip is ``held`` bounds may be above |t_tr|, and below zero at a pressure below zero: the bracket reaches as far to
    both sides of |t_tr|/k_T.
    """
    hi = size / k_t
    lo = np.zeros_like(hi)
    if held:
        reach = 2.0 * np.maximum(size, np.abs(tau0)) / k_t
        lo, hi = hi - reach, hi + reach
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
