"""Swift's power law of a prestrained metal.

Swift (1952), J. Mech. Phys. Solids 1, 1-18.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.kernels.record import exp, log
from prensa.materials.flow_curve import PointCurve, prestrain_doubts
from prensa.model.units import Number, Pressure, Strain


class Swift(PointCurve):
    """Swift (1952), σ_y = K (e0 + ε̄)ⁿ with the exponent ``n``."""

    K: Annotated[Pressure, Field(gt=0)]
    e0: Annotated[Strain, Field(gt=0)]
    n: Annotated[Number, Field(ge=0)]
    type: Literal["swift"] = "swift"

    smooth: ClassVar[bool] = True

    def doubts(self) -> Iterator[tuple[str, str]]:
        """A prestrain or an exponent that looks like per cent."""
        yield from super().doubts()
        yield from prestrain_doubts(self.e0)

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        # Never zero: no chord is needed, as `power` has.
        return self.K * exp(self.n * log(self.e0 + strain))
