"""Swift's power law and Voce's saturation, weighted: the standard for sheet metal beyond uniform elongation.

Sung, Kim & Wagoner (2010), Int. J. Plasticity 26, 1746-1771.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.kernels.record import exp, log
from prensa.materials.flow_curve import PointCurve, prestrain_doubts
from prensa.model.units import Number, Pressure, Strain


class SwiftVoce(PointCurve):
    """Swift and Voce weighted, σ_y = w K (e0 + ε̄)ⁿ + (1 − w)(s0 + Q (1 − e^(−b ε̄))), the standard for sheet metal.

    ``n`` is the exponent, ``w`` the weight of Swift.
    """

    K: Annotated[Pressure, Field(gt=0)]
    e0: Annotated[Strain, Field(gt=0)]
    n: Annotated[Number, Field(ge=0)]
    s0: Annotated[Pressure, Field(gt=0)]
    Q: Pressure
    b: Annotated[Number, Field(ge=0)]
    w: Annotated[Number, Field(ge=0, le=1)] = 0.5
    type: Literal["swift_voce"] = "swift_voce"

    smooth: ClassVar[bool] = True

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"K": 565.0, "e0": 0.007, "n": 0.26, "s0": 150.0, "Q": 200.0, "b": 12.0, "w": 0.6},
    )

    def doubts(self) -> Iterator[tuple[str, str]]:
        """A prestrain or an exponent that looks like per cent."""
        yield from super().doubts()
        yield from prestrain_doubts(self.e0)

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        swift, saturating = self.K * exp(self.n * log(self.e0 + strain)), self.s0 + self.Q * (1.0 - exp(-(self.b * strain)))
        return self.w * swift + (1.0 - self.w) * saturating
