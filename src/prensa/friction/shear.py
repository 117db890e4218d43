"""Constant shear factor, τ_y = m k: the surface layer of the workpiece yields before it slides.

Prandtl (1923), von Mises (1925); see Avitzur (1968), Metal Forming, chapter 5. The bound is a traction per current area.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RAMP = 0.1  # pressure over k below which the bound falls linearly to zero: a jump at p = 0 would have no derivative


@dataclass(frozen=True)
class Shear:
    """The bound m k and its partial derivatives; ``k`` (points,) shear yield stresses of the points, held in an increment."""

    m: float
    k: Array
    hardens: bool = False
    per_current_area: bool = True

    def steepest(self, kappa: Array) -> Array:
        """No softening with slip: zeros (k,)."""
        return np.zeros_like(kappa)

    def bound(self, p: Array, kappa: Array) -> tuple[Array, Array, Array]:
        """Pressures (k,) and accumulated slips (k,) → τ_y, ∂τ_y/∂p, ∂τ_y/∂κ, each (k,)."""
        full = RAMP * self.k
        return self.m * self.k * np.minimum(p / full, 1.0), np.where(p < full, self.m / RAMP, 0.0), np.zeros_like(p)
