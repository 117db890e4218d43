"""Voce's saturating exponential.

Voce (1948), J. Inst. Metals 74, 537-562.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from prensa.materials.flow_curve import FlowCurve, FlowParameters
from prensa.model.units import Number, Pressure
from prensa.types import Array


class Voce(FlowCurve):
    """Voce (1948), σ_y = s0 + Q (1 − e^(−b ε̄)) + H ε̄ (H = 0: saturating)."""

    s0: Annotated[Pressure, Field(gt=0)]
    Q: Pressure
    b: Annotated[Number, Field(ge=0)]
    H: Pressure = 0.0
    type: Literal["voce"] = "voce"

    def stress(self, strain: Array, rate: Array) -> tuple[Array, ...]:
        """σ_y and its derivative by the plastic strain, each (k,)."""
        decay = self.Q * np.exp(-self.b * strain)
        return self.s0 + self.Q - decay + self.H * strain, self.b * decay + self.H

    def kernel(self) -> FlowParameters:
        """Parameters of the compiled curve."""
        from prensa.materials.hardening import VOCE, parameters

        return parameters(VOCE, self.s0, self.Q, self.b, self.H)
