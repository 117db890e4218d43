"""Voce's saturating exponential.

Voce (1948), J. Inst. Metals 74, 537-562.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.kernels.record import exp
from prensa.materials.flow_curve import PointCurve
from prensa.model.units import Number, Pressure


class Voce(PointCurve):
    """Voce (1948), σ_y = s0 + Q (1 − e^(−b ε̄)) + H ε̄ (H = 0: saturating)."""

    s0: Annotated[Pressure, Field(gt=0)]
    Q: Pressure
    b: Annotated[Number, Field(ge=0)]
    H: Pressure = 0.0
    type: Literal["voce"] = "voce"

    smooth: ClassVar[bool] = True

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        return self.s0 + self.Q * (1.0 - exp(-(self.b * strain))) + self.H * strain
