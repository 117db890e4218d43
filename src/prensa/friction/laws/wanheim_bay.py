"""General friction law of Wanheim and Bay: τ_y = f α k, α the real area of contact over the apparent one.

Wanheim, Bay & Petersen (1974), Wear 28, 251-258 (slip-line fields of asperities that are flattened and interact); the
closed form is that of Bay (1987), J. Mech. Working Technol. 14, 203-223.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.friction.law import At, StrengthLaw
from prensa.model.units import Number, Pressure
from prensa.types import Array


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

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({"f": 0.6}, {"f": 1.0, "k": 40.0}, {"f": 0.05, "k": 20.0})

    @property
    def frictionless(self) -> bool:
        """Whether the factor is 0."""
        return self.f == 0

    def bound(self, p: Array, kappa: Array, at: At) -> tuple[Array, Array, Array]:
        """The bound f α k and its partial derivatives by p and κ, each (k,)."""
        k = self.strength(p, at)
        f, root = self.f, math.sqrt(1.0 - self.f)
        limit = k * (1.0 + 0.5 * math.pi + math.acos(f) + math.sqrt(1.0 - f * f)) / (1.0 + root)  # p′
        reached, slope = f / (1.0 + root) * k, f / (1.0 + root) * k / limit  # τ′, without a difference; τ′/p′
        rest = f * k - reached
        beyond = np.maximum(p - limit, 0.0)
        decay = np.exp(-beyond * slope / rest) if 0.0 < f < 1.0 else np.where(beyond > 0.0, 0.0, 1.0)
        return slope * np.minimum(p, limit) + rest * (1.0 - decay), slope * decay, np.zeros_like(p)
