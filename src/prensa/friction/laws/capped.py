"""Coulomb friction capped by the shear strength of the surface layer, τ_y = min(μ p, m k).

Orowan (1943), Proc. Inst. Mech. Eng. 150, 140-167, for rolling, with m = 1: friction cannot exceed what shears the metal.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from prensa.friction.law import At, FrictionLaw
from prensa.model.units import Number, Pressure

Array = NDArray[np.float64]


class Capped(FrictionLaw):
    """Coulomb friction that does not exceed the shear factor's, |t_T| ≤ min(μ p, m k).

    ``k``: shear yield stress of the body; without it, σ_y/√3 of the plastic material behind the surface, taken at the
    start of each increment. μ p is a share of the normal force whatever the area, m k a traction per current area.
    """

    mu: Annotated[Number, Field(ge=0)]
    m: Annotated[Number, Field(ge=0, le=1)] = 1.0
    k: Annotated[Pressure, Field(gt=0)] | None = None
    type: Literal["capped"] = "capped"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({"mu": 0.5, "m": 0.6}, {"mu": 0.5, "m": 0.6, "k": 50.0})

    @property
    def hardens(self) -> bool:
        """False: the bound does not depend on the slip."""
        return False

    @property
    def frictionless(self) -> bool:
        """Whether μ or m is 0."""
        return self.mu == 0 or self.m == 0

    @property
    def asks_for_k(self) -> bool:
        """Whether the body has to give the shear yield stress."""
        return self.k is None

    def bound(self, p: Array, kappa: Array, at: At) -> tuple[Array, Array, Array]:
        """min(μ p, m k) and its partial derivatives by p and κ, each (k,)."""
        k = at.k if self.k is None else np.full_like(p, self.k)
        assert k is not None
        cap = self.m * k
        below = self.mu * p < cap
        return np.where(below, self.mu * p, cap), np.where(below, self.mu, 0.0), np.zeros_like(p)
