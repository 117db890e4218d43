"""Hockett and Sherby's stretched exponential.

Hockett & Sherby (1975), J. Mech. Phys. Solids 23, 87-98.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from prensa.kernels.record import TINY
from prensa.materials.flow_curve import FlowCurve, FlowParameters
from prensa.model.units import Number, Pressure
from prensa.types import Array


class HockettSherby(FlowCurve):
    """Hockett & Sherby (1975), σ_y = s_inf − (s_inf − s0) exp(−b ε̄ⁿ), with the exponent ``n``."""

    s0: Annotated[Pressure, Field(gt=0)]
    s_inf: Annotated[Pressure, Field(gt=0)]
    b: Annotated[Number, Field(ge=0)]
    n: Annotated[Number, Field(gt=0)]
    type: Literal["hockett_sherby"] = "hockett_sherby"

    def stress(self, strain: Array, rate: Array) -> tuple[Array, ...]:
        """σ_y and its derivative by the plastic strain, each (k,)."""
        a = np.maximum(strain, TINY)
        x, rise = self.b * a**self.n, self.s_inf - self.s0
        chord = -rise * np.expm1(-x) / a
        full, slope = self.s_inf - rise * np.exp(-x), rise * np.exp(-x) * self.n * x / a
        return np.where(strain < TINY, self.s0 + chord * strain, full), np.where(strain < TINY, chord, slope)

    def kernel(self) -> FlowParameters:
        """Parameters of the compiled curve."""
        from prensa.materials.hardening import HOCKETT_SHERBY, parameters

        return parameters(HOCKETT_SHERBY, self.s0, self.s_inf, self.b, self.n)
