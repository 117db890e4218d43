"""Ludwik's power law with a yield stress.

Ludwik (1909), Elemente der Technologischen Mechanik, Springer.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.kernels.record import power
from prensa.materials.flow_curve import PointCurve
from prensa.model.units import Number, Pressure


class Ludwik(PointCurve):
    """Ludwik (1909), σ_y = s0 + K ε̄ⁿ with the exponent ``n``."""

    s0: Annotated[Pressure, Field(gt=0)]
    K: Annotated[Pressure, Field(ge=0)]
    n: Annotated[Number, Field(gt=0)]
    type: Literal["ludwik"] = "ludwik"

    smooth: ClassVar[bool] = True

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        return self.s0 + self.K * power(strain, self.n)
