"""Dry friction of Wang and Osakada: Coulomb at low pressure, then a shear factor that follows from μ and the tool's angle.

Wang & Osakada, friction law for metal forming (dry contact, slip-line fields of wedge-shaped asperities): fitted
m = √3 μ (a μ + b), a = −0.48 θ² + 2.48 θ − 3.82, b = −1.19 θ + 3.0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from prensa.friction.law import At, StrengthLaw
from prensa.kernels.record import where
from prensa.model.units import Angle, Number, Pressure


class WangOsakada(StrengthLaw):
    """Wang and Osakada's dry friction, |t_T| ≤ min(μ p, m k) with m = √3 μ (a μ + b), the inclination ``theta``.

    ``mu`` is μ; a = −0.48 θ² + 2.48 θ − 3.82, b = −1.19 θ + 3.0. The branches meet at p = m k/μ, which keeps the bound
    continuous; at θ = 0 it is the source's ``critical_pressure`` within 1 % (μ ≤ 0.2) or 4 % (μ ≤ 0.3), where the fitted law
    has a jump. ``k``: shear yield stress of the body; without it, σ_y/√3 of the plastic material behind the surface, taken at
    the start of each increment.
    """

    mu: Annotated[Number, Field(ge=0)]
    theta: Annotated[Angle, Field(ge=0, lt=math.pi / 2)] = 0.0
    k: Annotated[Pressure, Field(gt=0)] | None = None
    type: Literal["wang_osakada"] = "wang_osakada"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({"mu": 0.3}, {"mu": 0.1, "theta": 0.2, "k": 10.0})

    @model_validator(mode="after")
    def _check(self) -> WangOsakada:
        a, b = self._fit()
        most = -0.5 * b / a  # where the fitted m stops rising
        if a * most * most + b * most > 1.0 / math.sqrt(3.0):  # it is 1 before that
            most = (-b + math.sqrt(b * b + 4.0 * a / math.sqrt(3.0))) / (2.0 * a)
        if self.mu > most:
            raise ValueError(f"mu = {self.mu:g} is beyond the fit of m, which ends at mu = {most:.3g} at this angle")
        return self

    def _fit(self) -> tuple[float, float]:
        return -0.48 * self.theta * self.theta + 2.48 * self.theta - 3.82, -1.19 * self.theta + 3.0

    @property
    def m(self) -> float:
        """Shear factor at high pressure."""
        a, b = self._fit()
        return math.sqrt(3.0) * self.mu * (a * self.mu + b)

    @property
    def critical_pressure(self) -> float:
        """Pressure over σ_y from which on the source's shear factor holds.

        (2/√3) [(1 + sin 2φ)/2 + π/4 + φ − θ] with φ = arccos(m)/2: the pressure of the slip-line field below an asperity.
        """
        phi = 0.5 * math.acos(self.m)
        return 2.0 / math.sqrt(3.0) * (0.5 * (1.0 + math.sin(2.0 * phi)) + 0.25 * math.pi + phi - self.theta)

    @property
    def frictionless(self) -> bool:
        """Whether μ is 0."""
        return self.mu == 0

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound min(μ p, m k)."""
        free, cap = self.mu * p, self.m * self.strength(at)
        return where(free < cap, free, cap)
