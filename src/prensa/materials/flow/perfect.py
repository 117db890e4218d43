"""Perfect plasticity."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from prensa.materials.flow_curve import FlowCurve, FlowParameters
from prensa.model.units import Pressure
from prensa.types import Array


class Perfect(FlowCurve):
    """Perfect plasticity, σ_y = s0."""

    s0: Annotated[Pressure, Field(gt=0)]
    type: Literal["perfect"] = "perfect"

    def stress(self, strain: Array, rate: Array) -> tuple[Array, ...]:
        """σ_y and its derivative by the plastic strain, each (k,)."""
        return np.full_like(strain, self.s0), np.zeros_like(strain)

    def kernel(self) -> FlowParameters:
        """Parameters of the compiled curve."""
        from prensa.materials.hardening import PERFECT, parameters

        return parameters(PERFECT, self.s0)
