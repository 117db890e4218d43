"""Swift's power law of a prestrained metal.

Swift (1952), J. Mech. Phys. Solids 1, 1-18.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from prensa.materials.flow_curve import FlowCurve, FlowParameters, prestrain_doubts
from prensa.model.units import Number, Pressure, Strain
from prensa.types import Array


class Swift(FlowCurve):
    """Swift (1952), σ_y = K (e0 + ε̄)ⁿ with the exponent ``n``."""

    K: Annotated[Pressure, Field(gt=0)]
    e0: Annotated[Strain, Field(gt=0)]
    n: Annotated[Number, Field(ge=0)]
    type: Literal["swift"] = "swift"

    def doubts(self) -> Iterator[tuple[str, str]]:
        """A prestrain or an exponent that looks like per cent."""
        yield from super().doubts()
        yield from prestrain_doubts(self.e0)

    def stress(self, strain: Array, rate: Array) -> tuple[Array, ...]:
        """σ_y and its derivative by the plastic strain, each (k,)."""
        stress = self.K * (self.e0 + strain) ** self.n
        return stress, self.n * stress / (self.e0 + strain)

    def kernel(self) -> FlowParameters:
        """Parameters of the compiled curve."""
        from prensa.materials.hardening import SWIFT, parameters

        return parameters(SWIFT, self.K, self.e0, self.n)
