"""Hockett and Sherby's stretched exponential.

Hockett & Sherby (1975), J. Mech. Phys. Solids 23, 87-98.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.kernels.record import TINY, exp, log, where
from prensa.materials.flow_curve import PointCurve
from prensa.model.units import Number, Pressure


class HockettSherby(PointCurve):
    """Hockett & Sherby (1975), σ_y = s_inf − (s_inf − s0) exp(−b ε̄ⁿ), with the exponent ``n``."""

    s0: Annotated[Pressure, Field(gt=0)]
    s_inf: Annotated[Pressure, Field(gt=0)]
    b: Annotated[Number, Field(ge=0)]
    n: Annotated[Number, Field(gt=0)]
    type: Literal["hockett_sherby"] = "hockett_sherby"

    smooth: ClassVar[bool] = True

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        below = strain < TINY
        x = where(below, TINY, strain)
        risen = (self.s_inf - self.s0) * (1.0 - exp(-(self.b * exp(self.n * log(x)))))
        return self.s0 + where(below, risen * (strain / x), risen)
