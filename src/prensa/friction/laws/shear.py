"""Constant shear factor, τ_y = m k: the surface layer of the workpiece yields before it slides.

Prandtl (1923), von Mises (1925); see Avitzur (1968), Metal Forming, chapter 5. The bound is a traction per current area.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from prensa.friction.law import At, StrengthLaw
from prensa.kernels.record import where
from prensa.model.units import Number, Pressure

RAMP = 0.1  # pressure over k below which the bound falls linearly to zero: a jump at p = 0 would have no derivative


class Shear(StrengthLaw):
    """Constant shear factor, |t_T| ≤ m k per current area (Prandtl's and von Mises' friction of metal forming).

    ``k``: shear yield stress of the body; without it, σ_y/√3 of the plastic material behind the surface, taken at the
    start of each increment. Below the pressure k/10 the bound falls to zero with the pressure: what does not press does not
    rub.
    """

    m: Annotated[Number, Field(ge=0, le=1)]
    k: Annotated[Pressure, Field(gt=0)] | None = None
    type: Literal["shear"] = "shear"

    @property
    def frictionless(self) -> bool:
        """Whether the factor is 0."""
        return self.m == 0

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound m k, on the ramp m p k/(k/10)."""
        k = self.strength(at)
        return where(p < RAMP * k, self.m / RAMP * p, self.m * k)
