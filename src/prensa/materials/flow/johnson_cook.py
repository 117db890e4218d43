"""Johnson and Cook's rate-dependent curve, at constant temperature.

Johnson & Cook (1983), Proc. 7th Int. Symp. on Ballistics, 541-547.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from prensa.kernels.record import log, power, where
from prensa.materials.flow_curve import PointCurve
from prensa.model.units import Number, Pressure, Rate

MOST_SENSITIVE = 0.5  # to the rate, from which on C is likely in per cent


class JohnsonCook(PointCurve):
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

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        over = rate / self.rate0
        fast = over > 1.0  # a kink: not `smooth`
        return (self.A + self.B * power(strain, self.n)) * (1.0 + self.C * log(where(fast, over, 1.0)))
