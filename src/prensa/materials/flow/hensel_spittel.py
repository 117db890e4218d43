"""Hensel and Spittel's hot flow curve, at constant temperature.

Hensel & Spittel (1978), Kraft- und Arbeitsbedarf bildsamer Formgebungsverfahren, Leipzig; in the form of Spittel & Spittel
(2009), Landolt-Börnstein Group VIII, Springer, ISBN 978-3-540-44758-0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.kernels.record import exp, log
from prensa.materials.flow_curve import PointCurve
from prensa.model.units import Number, Pressure, Rate, Strain


class HenselSpittel(PointCurve):
    """Hensel & Spittel (1978), σ_y = A e^(m1 T) T^m9 ε^m2 e^(m4/ε) (1 + ε)^(m5 T + m6) e^(m7 ε) ε̇^(m3 + m8 T), hot metal.

    The temperature ``T``, in °C, is constant; ε is the plastic strain and a base strain ``e0``, ε̇ its rate and a base rate
    ``rate0``, without which nothing would resist at first and at rest: constants belong to their bases. Hot metal softens
    as it is strained further where ``m5`` or ``m7`` is negative.
    """

    A: Annotated[Pressure, Field(gt=0)]
    T: Annotated[Number, Field(gt=0)]
    e0: Annotated[Strain, Field(gt=0)]
    rate0: Annotated[Rate, Field(gt=0)]
    m1: Number = 0.0
    m2: Number = 0.0
    m3: Number = 0.0
    m4: Number = 0.0
    m5: Number = 0.0
    m6: Number = 0.0
    m7: Number = 0.0
    m8: Number = 0.0
    m9: Number = 0.0
    type: Literal["hensel_spittel"] = "hensel_spittel"

    smooth: ClassVar[bool] = True
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"A": 900.0, "T": 300.0, "e0": 0.05, "rate0": 0.1, "m1": -1e-3, "m2": 0.2, "m3": 0.01, "m4": -1e-3, "m8": 1e-5},
    )

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        e, T = strain + self.e0, self.T
        heat = self.m1 * T + self.m9 * log(T) + (self.m3 + self.m8 * T) * log(rate + self.rate0)
        form = self.m2 * log(e) + self.m4 / e + (self.m5 * T + self.m6) * log(1.0 + e) + self.m7 * e
        return self.A * exp(heat + form)
