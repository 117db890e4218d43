"""Johnson and Cook's rate-dependent curve, at constant temperature.

Johnson & Cook (1983), Proc. 7th Int. Symp. on Ballistics, 541-547.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from prensa.kernels.record import TINY
from prensa.materials.flow_curve import FlowCurve, FlowParameters
from prensa.model.units import Number, Pressure, Rate
from prensa.types import Array

MOST_SENSITIVE = 0.5  # to the rate, from which on C is likely in per cent


class JohnsonCook(FlowCurve):
    """Johnson & Cook (1983) at constant temperature, σ_y = (A + B ε̄ⁿ)(1 + C ln⟨ε̄̇/rate0⟩₊₁) with the exponent ``n``.

    Below ``rate0`` the rate has no effect.
    """

    A: Annotated[Pressure, Field(gt=0)]
    B: Annotated[Pressure, Field(ge=0)]
    n: Annotated[Number, Field(gt=0)]
    C: Annotated[Number, Field(ge=0)] = 0.0
    rate0: Annotated[Rate, Field(gt=0)] = 1.0
    type: Literal["johnson_cook"] = "johnson_cook"

    def doubts(self) -> Iterator[tuple[str, str]]:
        """An exponent or a sensitivity to the rate that looks like per cent."""
        yield from super().doubts()
        if self.C > MOST_SENSITIVE:
            yield "C", f"the flow stress rises by {100 * self.C:g} % for every e-fold of the rate; did you mean {self.C / 100:g}?"

    def stress(self, strain: Array, rate: Array) -> tuple[Array, ...]:
        """σ_y and its derivatives by the plastic strain and its rate, each (k,)."""
        a = np.maximum(strain, TINY)
        power, chord = self.B * a**self.n, self.B * a ** (self.n - 1.0)
        quasi = self.A + np.where(strain < TINY, chord * strain, power)
        fast = rate > self.rate0
        factor = 1.0 + self.C * np.log(np.where(fast, rate / self.rate0, 1.0))
        slope = np.where(strain < TINY, chord, self.n * chord) * factor
        return quasi * factor, slope, np.where(fast, self.C * quasi / np.where(fast, rate, 1.0), 0.0)

    def kernel(self) -> FlowParameters:
        """Parameters of the compiled curve."""
        from prensa.materials.hardening import JOHNSON_COOK, parameters

        return parameters(JOHNSON_COOK, self.A, self.B, self.n, self.C, self.rate0)
