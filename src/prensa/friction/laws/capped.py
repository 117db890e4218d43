"""Coulomb friction capped by the shear strength of the surface layer, τ_y = min(μ p, m k), or rounded off towards it.

Orowan (1943), Proc. Inst. Mech. Eng. 150, 140-167, for rolling, with m = 1: friction cannot exceed what shears the metal.
The smooth transition is Shirakashi & Usui's (1973), J. Jpn. Soc. Precis. Eng. 39, 966-972, with the exponent of Childs,
Maekawa, Obikawa & Yamane (2000), Metal Machining, section 2.4.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.friction.law import At, StrengthLaw
from prensa.kernels.functions import expm1
from prensa.kernels.record import exp, log, where
from prensa.model.units import Number, Pressure
from prensa.precision import EPS


class Capped(StrengthLaw):
    """Coulomb friction that does not exceed the shear factor's, |t_T| ≤ min(μ p, m k).

    ``mu``: Coulomb's coefficient, ``m``: shear factor, ``k``: shear yield stress of the body; without it, σ_y/√3 of the
    plastic material behind the surface, taken at the start of each increment. μ p is a share of the normal force whatever the
    area, m k a traction per current area. ``sharpness`` n rounds the corner off, |t_T| ≤ m k [1 − exp(−(μ p/(m k))ⁿ)]^(1/n)
    (Shirakashi & Usui with n = 1; Childs et al.); without it the corner is sharp.
    """

    mu: Annotated[Number, Field(ge=0)]
    m: Annotated[Number, Field(ge=0, le=1)] = 1.0
    k: Annotated[Pressure, Field(gt=0)] | None = None
    sharpness: Annotated[Number, Field(ge=1, le=20)] | None = None
    type: Literal["capped"] = "capped"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"mu": 0.5, "m": 0.6}, {"mu": 0.5, "m": 0.6, "k": 50.0}, {"mu": 0.5, "m": 0.6, "sharpness": 1},
        {"mu": 0.5, "m": 0.6, "sharpness": 3.5},
    )  # fmt: skip

    @property
    def frictionless(self) -> bool:
        """Whether μ or m is 0."""
        return self.mu == 0 or self.m == 0

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound min(μ p, m k) or its smooth form."""
        cap, free, n = self.m * self.strength(at), self.mu * p, self.sharpness
        if n is None:
            return where(free < cap, free, cap)
        # with y = (μp/cap)ⁿ and q = (1 − e⁻ʸ)/y the bound is μp q^(1/n): no power of a number near zero is left
        some = (free > 0.0) & (cap > 0.0)
        y = where(some, exp(n * log(where(some, free / where(some, cap, 1.0), 1.0))), 0.0)
        # below, q is 1 to round-off, and y² in its derivative may be no number
        q = where(y > EPS, -expm1(-y) / where(y > EPS, y, 1.0), 1.0)
        return where(cap > 0.0, free * exp(log(q) / n), 0.0)
