"""Measured flow stresses, interpolated by a monotone cubic (Fritsch & Carlson 1980, SIAM J. Numer. Anal. 17, 238-246)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, ValidationInfo, model_validator

from prensa.kernels.table import Table
from prensa.materials.flow_curve import PointCurve
from prensa.model.fields import LARGEST
from prensa.model.tables import read_columns
from prensa.model.units import PRESSURE, STRAIN, Pressure, Strain

MOST_SECOND, MOST_LAST = (
    2.0,
    10.0,
)  # strains of the second and of the last pair from which on they are likely in per cent


def _measured(value: Any, info: ValidationInfo) -> Any:
    """The points of a file, where one is named in their place."""
    columns = (("plastic strain", STRAIN), ("flow stress", PRESSURE))
    return tuple(read_columns(value, info.context, "flow curve", columns)) if isinstance(value, str) else value


class FlowTable(PointCurve):
    """Flow stress from ``points`` (ε̄, σ_y), interpolated by a monotone C¹ cubic, constant slope zero beyond the last.

    Instead of points, give the name of a CSV file of plastic strains and flow stresses, whose first line may state units as in
    ``strain (%), stress (MPa)``.
    """

    points: Annotated[tuple[tuple[Strain, Pressure], ...], BeforeValidator(_measured)]
    type: Literal["table"] = "table"

    derived: ClassVar[tuple[str, ...]] = ("cubic",)

    @model_validator(mode="after")
    def _check(self) -> FlowTable:
        e = [p[0] for p in self.points]
        if len(e) < 2 or e[0] != 0.0 or any(b <= a for a, b in pairwise(e)):
            raise ValueError("points must start at plastic strain 0 and increase strictly (at least two pairs)")
        if any(p[1] <= 0 for p in self.points):
            raise ValueError("flow stresses must be positive")
        if max(e) > LARGEST or max(p[1] for p in self.points) > LARGEST:
            raise ValueError(f"no metal has strains or flow stresses above {LARGEST:g}, and no curve leads through them")
        if any(abs(t / 1e150 - s / 1e150) > b - a for (a, s), (b, t) in pairwise(self.points)):
            raise ValueError("points lie so close together that the slope between them is not a number that can be used")
        return self

    @cached_property
    def cubic(self) -> Table:
        """The monotone cubic through the points."""
        from scipy.interpolate import PchipInterpolator

        strains, stresses = np.array(self.points).T
        coefficients = np.ascontiguousarray(PchipInterpolator(strains, stresses).c.T)
        # Without a first knot: strains begin there, and a limit would be a kink that takes the slope at zero away.
        return Table(np.ascontiguousarray(strains), coefficients, None, self.points[-1][0])

    def known_to(self) -> float:
        """Strain of the last pair."""
        return float(self.points[-1][0])

    def doubts(self) -> Iterator[tuple[str, str]]:
        """Strains that look like per cent."""
        if self.points[1][0] >= MOST_SECOND or self.points[-1][0] > MOST_LAST:
            last = self.points[-1][0]
            yield (
                "points",
                f"the strains go up to {last:g}, {100 * last:g} %: they are plain numbers; did you mean '{last:g} %', "
                f"{last / 100:g}?",
            )

    def first(self) -> float:
        """Flow stress of the first pair."""
        return float(self.points[0][1])

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y of a point, or of arrays."""
        return self.cubic(strain)
