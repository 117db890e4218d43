"""Ludwik's power law with a yield stress.

Ludwik (1909), Elemente der Technologischen Mechanik, Springer.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from prensa.kernels.record import TINY
from prensa.materials.flow_curve import FlowCurve, FlowParameters
from prensa.model.units import Number, Pressure
from prensa.types import Array


class Ludwik(FlowCurve):
    """Ludwik (1909), σ_y = s0 + K ε̄ⁿ with the exponent ``n``."""

    s0: Annotated[Pressure, Field(gt=0)]
    K: Annotated[Pressure, Field(ge=0)]
    n: Annotated[Number, Field(gt=0)]
    type: Literal["ludwik"] = "ludwik"

    def stress(self, strain: Array, rate: Array) -> tuple[Array, ...]:
        """σ_y and its derivative by the plastic strain, each (k,)."""
        a = np.maximum(strain, TINY)
        power, slope = self.K * a**self.n, self.n * self.K * a ** (self.n - 1.0)
        chord = power / a
        return self.s0 + np.where(strain < TINY, chord * strain, power), np.where(strain < TINY, chord, slope)

    def kernel(self) -> FlowParameters:
        """Parameters of the compiled curve."""
        from prensa.materials.hardening import LUDWIK, parameters

        return parameters(LUDWIK, self.s0, self.K, self.n)
