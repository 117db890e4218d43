"""Linear hardening."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.materials.flow_curve import PointCurve
from prensa.model.units import Pressure


class Linear(PointCurve):
    """Linear hardening, σ_y = s0 + H ε̄."""

    s0: Annotated[Pressure, Field(gt=0)]
    H: Pressure
    type: Literal["linear"] = "linear"

    smooth: ClassVar[bool] = True

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        return self.s0 + self.H * strain
