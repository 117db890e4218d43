"""Swift's power law and Voce's saturation, weighted: the standard for sheet metal beyond uniform elongation.

Sung, Kim & Wagoner (2010), Int. J. Plasticity 26, 1746-1771. It has no compiled kernel: it is all that a curve of one's own
needs. A J2 update costs two to five times that of a compiled curve (docs/developer/book/02).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.materials.flow_curve import FlowCurve, prestrain_doubts
from prensa.model.units import Number, Pressure, Strain
from prensa.types import Array


class SwiftVoce(FlowCurve):
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

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"K": 565.0, "e0": 0.007, "n": 0.26, "s0": 150.0, "Q": 200.0, "b": 12.0, "w": 0.6},
    )

    def doubts(self) -> Iterator[tuple[str, str]]:
        """A prestrain or an exponent that looks like per cent."""
        yield from super().doubts()
        yield from prestrain_doubts(self.e0)

    def stress(self, strain: Array, rate: Array) -> tuple[Array, Array]:
        """σ_y and its derivative by the plastic strain, each (k,)."""
        swift = self.w * self.K * (self.e0 + strain) ** self.n
        decay = (1.0 - self.w) * self.Q * np.exp(-self.b * strain)
        stress = swift + (1.0 - self.w) * (self.s0 + self.Q) - decay
        return stress, self.n * swift / (self.e0 + strain) + self.b * decay
