"""Levanov's friction of bulk forming, τ_y = m k (1 − exp(−1.25 p/σ_y)).

Levanov, Kolmogorov, Burkin, Kartak, Ashpur & Spasskiy (1976), Contact Friction in Metal Forming, Metallurgiya, Moscow (in
Russian), as given in reviews of friction in bulk forming.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.friction.law import At, StrengthLaw
from prensa.kernels.functions import expm1
from prensa.model.units import Number, Pressure

LEVANOV = 1.25 / math.sqrt(3.0)  # of p/k: the source's 1.25 is of p/σ_y


class Levanov(StrengthLaw):
    """Levanov's law, |t_T| ≤ m k (1 − exp(−1.25 p/σ_y)) with σ_y = √3 k: Coulomb at low, the shear factor at high pressure.

    ``m``: shear factor at high pressure. ``k``: shear yield stress of the body; without it, σ_y/√3 of the plastic material
    behind the surface, taken at the start of each increment.
    """

    m: Annotated[Number, Field(ge=0, le=1)]
    k: Annotated[Pressure, Field(gt=0)] | None = None
    type: Literal["levanov"] = "levanov"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({"m": 0.6}, {"m": 0.3, "k": 40.0})

    @property
    def frictionless(self) -> bool:
        """Whether the factor is 0."""
        return self.m == 0

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound m k (1 − exp(−1.25 p/(√3 k)))."""
        k = self.strength(at)
        # 1 − exp loses its digits at small pressures, where the bound is m 1.25 p/√3.
        return -(self.m * k * expm1(-(LEVANOV * p / k)))
