"""Rigid half-space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from prensa.geometry.outline import block
from prensa.geometry.sections import section_axes
from prensa.model.fields import Direction
from prensa.precision import NEGLIGIBLE
from prensa.tools.analytic import Analytic, Closest
from prensa.tools.tool import ToolShape
from prensa.types import Array, Index

__all__ = ["Plane"]


class Plane(ToolShape):
    """Rigid half-space. ``normal``: outward normal (towards the bodies)."""

    normal: Direction | None = None
    type: Literal["plane"] = "plane"

    direction_key: ClassVar[str] = "normal"
    dimensions: ClassVar[tuple[int, ...]] = (2, 3)

    def shape(self, direction: Array, rounding: float) -> HalfSpace:
        """Half-space behind the line, in space the plane, across the direction."""
        return HalfSpace(tuple(direction.tolist()))

    def hint(self, way: Array | None = None) -> str:
        """Which way the plane looks."""
        return "; or its 'normal' looks away from there: reverse it" if self.normal is not None else ""

    def outline(self, depth: float) -> list[Array]:
        """Rectangle above y = 0."""
        return [block(-depth, depth, depth, 0.0)]

    def facets(self, direction: Array, depth: float) -> tuple[Array, Index]:
        """Square about the reference point."""
        axes = section_axes(direction)
        corners = depth * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) @ axes.T
        return corners, np.array([[0, 1, 2], [0, 2, 3]])

    def mirrored(self, on_axis: bool, direction: Array) -> bool:
        """Whether it looks along the axis."""
        return abs(direction[0]) < NEGLIGIBLE


@dataclass(frozen=True)
class HalfSpace(Analytic):
    """What lies behind the line, in space the plane, through the reference point; ``normal`` (d,) out of it, of unit length."""

    normal: tuple[float, ...]
    radius: float = np.inf
    half_space = True

    def closest(self, xi: Array) -> Closest:
        """Points (k, d) → `Closest`."""
        k, d = xi.shape
        n = np.empty((k, d))
        n[:] = self.normal
        if d == 3:
            return Closest(xi @ np.asarray(self.normal), n, np.zeros((k, 3, 3)), None)
        (x, y), (nx, ny) = xi.T, self.normal
        return Closest(x * nx + y * ny, n, np.zeros(k), y * nx - x * ny)
