"""General friction law of Wanheim and Bay: τ_y = f α k, α the real area of contact over the apparent one.

Wanheim, Bay & Petersen (1974), Wear 28, 251-258 (slip-line fields of asperities that are flattened and interact); the
closed form is that of Bay (1987), J. Mech. Working Technol. 14, 203-223.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.friction.law import At, StrengthLaw
from prensa.kernels.record import exp, where
from prensa.model.units import Number, Pressure


class WanheimBay(StrengthLaw):
    """Wanheim and Bay's general friction law, |t_T| ≤ f α(p/k, f) k with α the share of the area that really touches.

    Up to the limit p′ = k (1 + π/2 + arccos f + √(1 − f²))/(1 + √(1 − f)) the bound is proportional to the pressure and
    reaches τ′ = k (1 − √(1 − f)); above it is τ′ + (f k − τ′)[1 − exp((1 − p/p′) τ′/(f k − τ′))], which goes to f k.
    ``f``: friction factor in the real area of contact. ``k``: shear yield stress of the body; without it, σ_y/√3 of the
    plastic material behind the surface, taken at the start of each increment.
    """

    f: Annotated[Number, Field(ge=0, le=1)]
    k: Annotated[Pressure, Field(gt=0)] | None = None
    type: Literal["wanheim_bay"] = "wanheim_bay"

    derived: ClassVar[tuple[str, ...]] = ("limit", "reached")

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({"f": 0.6}, {"f": 1.0, "k": 40.0}, {"f": 0.05, "k": 20.0})

    @property
    def frictionless(self) -> bool:
        """Whether the factor is 0."""
        return self.f == 0

    @cached_property
    def limit(self) -> float:
        """p′ over k."""
        f = self.f
        return (1.0 + 0.5 * math.pi + math.acos(f) + math.sqrt(1.0 - f * f)) / (1.0 + math.sqrt(1.0 - f))

    @cached_property
    def reached(self) -> float:
        """τ′ over k, without a difference."""
        return self.f / (1.0 + math.sqrt(1.0 - self.f))

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound f α k."""
        k = self.strength(at)
        limit, slope, rest = k * self.limit, self.reached / self.limit, k * (self.f - self.reached)
        above = p > limit
        # f = 1 reaches k at the limit itself: nothing is left to approach. Below the limit the exponent, which is computed all
        # the same, would be positive and might overflow.
        curved = above & (rest > 0.0)
        decay = exp(-(where(curved, p - limit, 0.0) * slope / where(curved, rest, 1.0)))
        return where(above, slope * limit + rest * (1.0 - decay), slope * p)
