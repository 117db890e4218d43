"""Measured friction: tables over pressure, slip and speed, interpolated by monotone cubics.

Fritsch & Carlson (1980), SIAM J. Numer. Anal. 17, 238-246: between two points no value is beyond theirs, and the slope has no
jumps.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from prensa.friction.law import At, FrictionLaw
from prensa.kernels.table import Table
from prensa.model.fields import LARGEST, as_table
from prensa.model.units import Length, Number, Pressure, Speed
from prensa.types import Array

__all__ = ["FrictionTable"]

Value = Annotated[Number, Field(ge=0)]
OverPressure = Annotated[tuple[tuple[Pressure, Value], ...], BeforeValidator(as_table)]
OverSlip = Annotated[tuple[tuple[Length, Value], ...], BeforeValidator(as_table)]
OverSpeed = Annotated[tuple[tuple[Speed, Value], ...], BeforeValidator(as_table)]


class FrictionTable(FrictionLaw):
    """Measured friction, |t_T| ≤ μ p with μ from a table over ``pressure``, ``slip`` or ``speed``, or from several.

    Each is a list of pairs, its argument rising; where several are given μ is the product of ``mu`` and of what each says: one
    of them may give μ and others factors, or all of them factors of ``mu``. Between the points a monotone cubic, before the
    first and beyond the last their values; a run that goes beyond the last says so. The pressure is per current area; the
    speed of slip is that of the increment before, over its duration: a step lasts a second unless it gives its ``duration``.
    """

    pressure: OverPressure | None = None
    slip: OverSlip | None = None
    speed: OverSpeed | None = None
    mu: Annotated[Number, Field(ge=0)] = 1.0
    type: Literal["table"] = "table"

    derived: ClassVar[tuple[str, ...]] = ("over_pressure", "over_slip", "over_speed")
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"pressure": ((10.0, 0.2), (50.0, 0.12), (90.0, 0.1))},
        {"slip": ((0.0, 0.1), (1.0, 0.2), (4.0, 0.15))},
        {"speed": ((0.0, 0.3), (0.5, 0.15), (2.0, 0.2))},
        {
            "mu": 0.2, "pressure": ((0.0, 1.2), (80.0, 0.9)), "slip": ((0.0, 1.0), (3.0, 1.5)),
            "speed": ((0.0, 1.0), (1.0, 0.8)),
        },
    )  # fmt: skip

    @model_validator(mode="after")
    def _check(self) -> FrictionTable:
        given = {name: table for name in ("pressure", "slip", "speed") if (table := getattr(self, name)) is not None}
        if not given:
            raise ValueError("give a table over 'pressure', 'slip' or 'speed', as a list of pairs")
        for name, table in given.items():
            first = [x for x, _ in table]
            if len(first) < 2 or first[0] < 0.0 or any(b <= a for a, b in pairwise(first)):
                raise ValueError(f"the {name} must increase strictly from 0 or above (at least two pairs)")
            if max(map(max, table)) > LARGEST:
                raise ValueError(
                    f"no number in the table over {name} may be above {LARGEST:g}: no curve leads through it"
                )
        return self

    @property
    def hardens(self) -> bool:
        """Whether μ depends on the slip."""
        return self.slip is not None

    @property
    def frictionless(self) -> bool:
        """Whether μ is 0 everywhere."""
        return self.mu == 0 or any(
            t is not None and not any(v for _, v in t) for t in (self.pressure, self.slip, self.speed)
        )

    def known_to(self) -> Mapping[str, float]:
        """Last arguments of the tables."""
        tables = {"pressure": self.pressure, "slip": self.slip, "speed": self.speed}
        return {name: table[-1][0] for name, table in tables.items() if table is not None}

    @cached_property
    def over_pressure(self) -> Table | None:
        """What the table over the pressure says; None where there is none."""
        return _table(self.pressure)

    @cached_property
    def over_slip(self) -> Table | None:
        """What the table over the slip says; None where there is none."""
        return _table(self.slip)

    @cached_property
    def over_speed(self) -> Table | None:
        """What the table over the speed says; None where there is none."""
        return _table(self.speed)

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound μ p."""
        mu = self.mu
        for table, x in ((self.over_pressure, p), (self.over_slip, kappa), (self.over_speed, at.speed)):
            mu = mu if table is None else mu * table(x)
        return mu * p

    def softening(self, p: Array, kappa: Array, at: At) -> Array:
        """Largest −∂τ_y/∂κ (k,): the steepest fall of the table over the slip, with the largest factor of the speed."""
        if self.slip is None:
            return np.zeros_like(p)
        most = 1.0 if self.speed is None else max(factor for _, factor in self.speed)
        by_pressure = 1.0 if self.over_pressure is None else self.over_pressure(p)
        return np.asarray(self.mu * most * by_pressure * _steepest(self.slip) * p)


def _table(table: tuple[tuple[float, float], ...] | None) -> Table | None:
    """A table of a case, as its cubics."""
    if table is None:
        return None
    coefficients = np.ascontiguousarray(_cubic(table)[0].c.T)
    return Table(np.array([x for x, _ in table]), coefficients, table[0][0], table[-1][0])


@lru_cache(maxsize=64)
def _cubic(table: tuple[tuple[float, float], ...]) -> tuple[Any, Any]:
    """The interpolant of a table and its derivative."""
    from scipy.interpolate import PchipInterpolator

    cubic = PchipInterpolator([x for x, _ in table], [y for _, y in table])
    return cubic, cubic.derivative()


@lru_cache(maxsize=64)
def _steepest(table: tuple[tuple[float, float], ...]) -> float:
    """Steepest fall ≥ 0 of a table; its slope is a parabola between points, steepest at their ends or at its vertex."""
    x = np.array([x for x, _ in table])
    slope = _cubic(table)[1]
    a, b = slope.c[:2]
    # A piece with no cubic term has no vertex; its division only has to stay finite.
    vertex = x[:-1] - 0.5 * b / np.where(a == 0.0, 1.0, a)
    inside = vertex[(a != 0.0) & (vertex > x[:-1]) & (vertex < x[1:])]
    return max(-float(slope(np.concatenate([x, inside])).min()), 0.0)
