"""Coulomb friction with slip hardening: τ_y = μ(κ) p, κ the accumulated slip (paper eqs. 11-21, corrected)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.model import problem as model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coulomb:
    """The bound μ(κ) p and its partial derivatives; ``mu`` is a number or one of the μ(κ) descriptions."""

    mu: Any
    per_current_area: bool = False  # a share of the pressure: force over force, whatever the area

    @property
    def hardens(self) -> bool:
        """Whether μ depends on the slip."""
        return not isinstance(self.mu, float | int)

    def steepest(self, kappa: Array) -> Array:
        """Largest rate of softening −dμ/dκ (k,) (≥ 0, per length) that lies at or ahead of each slip (k,)."""
        m = self.mu
        match m:
            case model.MuLinear():
                ahead = np.ones_like(kappa) if m.limit is None else (m.mu0 + m.slope * kappa > m.limit).astype(float)
                return ahead * max(0.0, -m.slope)
            case model.MuExponential():
                return np.maximum(0.0, (m.mu0 - m.mu_inf) / m.u0 * np.exp(-kappa / m.u0))
            case model.MuTable():
                x = np.asarray(m.kappa)
                fall = np.append(np.maximum(0.0, -np.diff(m.mu) / np.diff(x)), 0.0)
                worst = np.maximum.accumulate(fall[::-1])[::-1]
                return worst[np.clip(np.searchsorted(x, kappa, side="right") - 1, 0, len(x) - 1)]
        return np.zeros_like(kappa)

    def coefficient(self, kappa: Array) -> tuple[Array, Array]:
        """μ and dμ/dκ at accumulated slips (k,)."""
        m = self.mu
        match m:
            case model.MuLinear():
                mu, slope = m.mu0 + m.slope * kappa, np.full_like(kappa, m.slope)
                if m.limit is not None:
                    held = (mu - m.limit) * np.sign(m.slope) >= 0
                    mu, slope = np.where(held, m.limit, mu), np.where(held, 0.0, slope)
                return mu, slope
            case model.MuExponential():
                decay = (m.mu_inf - m.mu0) * np.exp(-kappa / m.u0)
                return m.mu_inf - decay, decay / m.u0
            case model.MuTable():
                x, y = np.asarray(m.kappa), np.asarray(m.mu)
                slopes = np.append(np.diff(y) / np.diff(x), 0.0)
                return np.interp(kappa, x, y), slopes[
                    np.clip(np.searchsorted(x, kappa, side="right") - 1, 0, len(x) - 1)
                ]
        return np.full_like(kappa, float(m)), np.zeros_like(kappa)

    def bound(self, p: Array, kappa: Array) -> tuple[Array, Array, Array]:
        """Pressures (k,) and accumulated slips (k,) → τ_y, ∂τ_y/∂p, ∂τ_y/∂κ, each (k,)."""
        mu, slope = self.coefficient(kappa)
        return mu * p, mu, slope * p
