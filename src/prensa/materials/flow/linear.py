"""Linear hardening."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from prensa.materials.flow_curve import FlowCurve, FlowParameters
from prensa.model.units import Pressure
from prensa.types import Array


class Linear(FlowCurve):
    """Linear hardening, σ_y = s0 + H ε̄."""

    s0: Annotated[Pressure, Field(gt=0)]
    H: Pressure
    type: Literal["linear"] = "linear"

    def stress(self, strain: Array, rate: Array) -> tuple[Array, ...]:
        """σ_y and its derivative by the plastic strain, each (k,)."""
        return self.s0 + self.H * strain, np.full_like(strain, self.H)

    def kernel(self) -> FlowParameters:
        """Parameters of the compiled curve."""
        from prensa.materials.hardening import LINEAR, parameters

        return parameters(LINEAR, self.s0, self.H)
