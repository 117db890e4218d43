"""Rigid half-space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from prensa.geometry.outline import block
from prensa.model.units import Number
from prensa.tools.analytic import Analytic, Closest
from prensa.tools.tool import ToolShape

Array = NDArray[np.float64]

__all__ = ["Plane"]


class Plane(ToolShape):
    """Rigid half-space. ``normal``: outward normal (towards the bodies)."""

    normal: tuple[Number, Number] | None = None
    type: Literal["plane"] = "plane"

    direction_key: ClassVar[str] = "normal"

    def shape(self, direction: Array, rounding: float = 0.0) -> HalfSpace:
        """Half-space behind the line across the direction."""
        return HalfSpace(*direction)

    def outline(self, depth: float) -> list[Array]:
        """Rectangle above y = 0."""
        return [block(-depth, depth, depth, 0.0)]

    def mirrored(self, on_axis: bool, direction: Array) -> bool:
        """Whether it looks along the axis."""
        return abs(direction[0]) < 1e-12


@dataclass(frozen=True)
class HalfSpace(Analytic):
    """Half-space below the line through the reference point with outward normal (nx, ny), unit length."""

    nx: float
    ny: float
    radius: float = np.inf
    half_space = True

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`."""
        n, (x, y) = np.empty((len(xi), 2)), xi.T
        n[:, 0], n[:, 1] = self.nx, self.ny
        g, s = x * self.nx + y * self.ny, y * self.nx - x * self.ny
        return Closest(g, n, np.zeros(len(xi)), s)
