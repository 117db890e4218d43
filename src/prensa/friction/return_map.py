"""One return map for every friction law: stick or slip, the slip increment, the traction and its exact tangent.

Elastic-plastic analogy (paper eqs. 9-23), integrated by backward Euler in the tool frame; see docs/theory/contact.md.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ON_BOUND = 1e-12  # a point that slid and has not moved yet is on the bound: it sticks, whatever the round-off says


class Friction(Protocol):
    """A law states its bound; it is pure."""

    @property
    def hardens(self) -> bool:
        """Whether the bound depends on the slip."""

    @property
    def per_current_area(self) -> bool:
        """Whether the bound is a traction per current area, which follows the stretch of the surface in the increment."""

    def bound(self, p: Array, kappa: Array) -> tuple[Array, Array, Array]:
        """Pressures (k,), accumulated slips (k,) → bound τ_y ≥ 0, ∂τ_y/∂p, ∂τ_y/∂κ."""

    def steepest(self, kappa: Array) -> Array:
        """Largest softening −∂²τ_y/∂κ∂p (k,) at or ahead of each slip."""


class Tangential(NamedTuple):
    """t (k, d) traction, dt_dg (k, d, d), dt_dp (k, d), kappa (k,) new accumulated slip, slip (k,) flags."""

    t: Array
    dt_dg: Array
    dt_dp: Array
    kappa: Array
    slip: NDArray[np.bool_]


def return_map(
    law: Friction, lam: Array, dg: Array, p: Array, touching: NDArray[np.bool_], kappa: Array, k_t: Array,
    hold: NDArray[np.bool_] | None = None,
) -> Tangential:  # fmt: skip
    """Traction t_T(Δg_T, p) from the committed traction (or multiplier).

    lam (k, d): traction at the start of the increment or multiplier, in d tangential axes of the tool; dg (k, d):
    tangential displacement relative to the tool during the increment; p (k,) pressure; touching (k,) flags, which
    include the points of p = 0 that are just in touch; kappa (k,) committed slip; k_t (k,) tangential stiffness.
    Where a point does not touch everything is zero, and the slip is kept. ``hold`` (k,): points that stick whatever
    the bound says, an override with which the solver breaks cycles.

    The trial is t_tr = λ − k_T Δg; slip iff |t_tr| > τ_y(p, κ_n); then |t_tr| − k_T Δλ = τ_y(p, κ_n + Δλ).
    A softening law needs k_T > |∂τ_y/∂κ| for the root to be unique; where it may not be, the tangent is NaN, which the
    solver takes as a failed evaluation.
    """
    d = dg.shape[1]
    trial = np.where(touching[:, None], lam - k_t[:, None] * dg, 0.0)
    size = np.sqrt((trial**2).sum(axis=1))
    tau, dtau_p, dtau_k = law.bound(p, kappa)
    slip = touching & (size > (1.0 + ON_BOUND) * tau)
    if hold is not None:
        slip &= ~hold
    T = np.divide(trial, size[:, None], out=np.zeros_like(trial), where=(size > 0)[:, None])
    delta = np.where(slip & (p > 0), (size - tau) / k_t, 0.0)
    if law.hardens and (slip & (p > 0)).any():
        delta, tau, dtau_p, dtau_k = _hardening_root(law, size, tau, p, kappa, k_t, slip & (p > 0))
    D = k_t + dtau_k
    if law.hardens:
        D = np.where(slip & (law.steepest(kappa) * p >= k_t), np.nan, D)
    safe = np.where(size > 0, size, 1.0)
    theta = np.where(slip, tau / safe, 1.0)
    t = trial * theta[:, None]
    eye = np.eye(d)
    TT = T[:, :, None] * T[:, None, :]
    stick_block = -k_t[:, None, None] * eye
    slip_block = -((k_t * theta)[:, None, None] * (eye - TT) + (k_t * (1.0 - k_t / D))[:, None, None] * TT)
    dt_dg = np.where(slip[:, None, None], slip_block, np.where(touching[:, None, None], stick_block, 0.0))
    dt_dp = np.where(slip[:, None], (k_t * dtau_p / D)[:, None] * T, 0.0)
    return Tangential(t, dt_dg, dt_dp, kappa + delta, slip)


def _hardening_root(
    law: Friction, size: Array, tau0: Array, p: Array, kappa: Array, k_t: Array, slip: NDArray[np.bool_]
) -> tuple[Array, Array, Array, Array]:
    """Safeguarded Newton for Δλ of all points at once; the bracket is (0, |t_tr|/k_T)."""
    lo, hi = np.zeros_like(size), size / k_t
    x = np.where(slip, np.clip((size - tau0) / k_t, 0.0, hi), 0.0)
    for _ in range(100):
        tau, dtau_p, dtau_k = law.bound(p, kappa + x)
        f = size - k_t * x - tau
        lo, hi = np.where(f > 0, x, lo), np.where(f > 0, hi, x)
        if (~slip | (np.abs(f) <= 2e-16 * size) | (hi - lo <= 2e-16 * hi)).all():
            break
        D = k_t + dtau_k
        newton = x + f / np.where(D > 0, D, np.inf)
        inside = (newton > lo) & (newton < hi)
        x = np.where(slip & (np.abs(f) > 0), np.where(inside, newton, 0.5 * (lo + hi)), x)
    tau, dtau_p, dtau_k = law.bound(p, kappa + x)
    return x, tau, dtau_p, dtau_k
