"""Friction that depends on the speed of slip: static, kinetic and viscous (Stribeck's curve).

Stribeck (1902), Z. VDI 46, 1341-1348; the exponential with a free exponent is that of Bo & Pavelescu (1982), Wear 82,
277-289; see Armstrong-Hélouvry, Dupont & Canudas de Wit (1994), Automatica 30, 1083-1138.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.friction.law import At, FrictionLaw
from prensa.kernels.record import exp, log, where
from prensa.model.units import Number, PerSpeed, Speed


class Stribeck(FrictionLaw):
    """Friction by the speed v of slip, |t_T| ≤ μ(v) p, μ(v) = mu_kinetic + (mu_static − mu_kinetic) exp(−(v/speed)ⁿ) + viscous v.

    v: speed of slip of the increment before, 0 where a point has not slid. ``exponent`` n: 1 (Bo & Pavelescu) or 2
    (Gaussian). ``viscous``, per speed, lets friction rise again. A step lasts a second unless it gives its
    ``duration``.
    """

    mu_static: Annotated[Number, Field(ge=0)]
    mu_kinetic: Annotated[Number, Field(ge=0)]
    speed: Annotated[Speed, Field(gt=0)]
    exponent: Annotated[Number, Field(ge=1, le=10)] = 2.0
    viscous: Annotated[PerSpeed, Field(ge=0)] = 0.0
    type: Literal["stribeck"] = "stribeck"

    proportional: ClassVar[bool] = True
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"mu_static": 0.3, "mu_kinetic": 0.1, "speed": 2.0},
        {"mu_static": 0.3, "mu_kinetic": 0.1, "speed": 2.0, "exponent": 1, "viscous": 0.01},
        {"mu_static": 0.1, "mu_kinetic": 0.2, "speed": 0.5, "exponent": 1.5},
    )

    @property
    def hardens(self) -> bool:
        """False: the bound does not depend on the slip."""
        return False

    @property
    def frictionless(self) -> bool:
        """Whether μ is 0 at every speed."""
        return self.mu_static == self.mu_kinetic == self.viscous == 0

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound μ(v) p."""
        # Not the speed of this increment: a bound that falls with it softens at the rate μ′ p/Δt, which exceeds any stiffness
        # in short increments. From 0.3 to 0.1 the first increment failed with every enforcement.
        v: Any = at.speed
        slides = v > 0.0
        # Generated code computes and differentiates both branches of `where`: the inner one keeps log(0) out of the branch not
        # taken.
        power = where(slides, exp(self.exponent * log(where(slides, v / self.speed, 1.0))), 0.0)
        return (self.mu_kinetic + (self.mu_static - self.mu_kinetic) * exp(-power) + self.viscous * v) * p
