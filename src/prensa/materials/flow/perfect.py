"""Perfect plasticity."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.materials.flow_curve import PointCurve
from prensa.model.units import Pressure


class Perfect(PointCurve):
    """Perfect plasticity, σ_y = s0."""

    s0: Annotated[Pressure, Field(gt=0)]
    type: Literal["perfect"] = "perfect"

    smooth: ClassVar[bool] = True

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        return self.s0
