"""Rigid cylinder or sphere, and the round cavity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from prensa.geometry.outline import around
from prensa.model.units import Length
from prensa.tools.analytic import AT_CENTRE, Analytic, Closest, Tool
from prensa.tools.tool import ToolShape
from prensa.types import Array

__all__ = ["Circle"]


class Circle(ToolShape):
    """Rigid cylinder (plane problems) or sphere (axisymmetric); the reference point is its centre.

    ``concave``: a round cavity instead, with the tool outside the radius and the bodies inside.
    """

    radius: Annotated[Length, Field(gt=0)]
    concave: bool = False
    type: Literal["circle"] = "circle"

    def shape(self, direction: Array, rounding: float) -> Tool:
        """Disc, or what is around it."""
        return Hollow(self.radius) if self.concave else Disc(self.radius)

    def face(self) -> tuple[float, str]:
        """The radius, of a cavity nothing."""
        return (np.inf, "") if self.concave else (self.radius, "radius")

    def details(self, shape: Tool, direction: Array) -> str:
        """Whether it is a cavity."""
        return ", concave" if self.concave else ""

    def outline(self, depth: float) -> list[Array]:
        """Polygon of half degrees; of a cavity, what is around it."""
        angle = np.linspace(0.0, 2 * np.pi, 721)[:-1]
        circle = self.radius * np.column_stack([np.cos(angle), np.sin(angle)])
        return [around(circle, depth)] if self.concave else [circle]

    def mirrored(self, on_axis: bool, direction: Array) -> bool:
        """Whether its centre is on the axis."""
        return on_axis


@dataclass(frozen=True)
class Disc(Analytic):
    """Disc of radius R about the reference point; s = R φ, measured from the lowest point of the circle."""

    radius: float

    @property
    def extent(self) -> float:  # type: ignore[override]
        """Radius."""
        return self.radius

    @property
    def cylinder(self) -> float:  # type: ignore[override]
        """Radius."""
        return self.radius

    @property
    def period(self) -> float:  # type: ignore[override]
        """Circumference."""
        return 2 * np.pi * self.radius

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`; the centre itself counts as below it."""
        r, n, phi = _polar(xi)
        return Closest(r - self.radius, n, 1.0 / np.maximum(r, AT_CENTRE * self.radius), self.radius * phi)


def _polar(xi: Array) -> tuple[Array, Array, Array]:
    """Distances (k,) of points (k, 2) from the centre, unit vectors (k, 2) out of it (at it: down), and angles (k,).

    The angle is 0 at the bottom and grows along +90° of the vector.
    """
    r = np.hypot(xi[:, 0], xi[:, 1])
    safe = np.where(r > 0, r, 1.0)
    out = np.where((r > 0)[:, None], xi / safe[:, None], np.array([0.0, -1.0]))
    return r, out, np.arctan2(out[:, 0], -out[:, 1])


@dataclass(frozen=True)
class Hollow(Analytic):
    """Everything outside a circle of radius R about the reference point; s = −R φ from its lowest point."""

    R: float
    radius: float = np.inf
    cavity = True

    @property
    def extent(self) -> float:  # type: ignore[override]
        """Radius."""
        return self.R

    @property
    def period(self) -> float:  # type: ignore[override]
        """Circumference."""
        return 2 * np.pi * self.R

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`; the centre itself counts as below it."""
        r, out, phi = _polar(xi)
        return Closest(self.R - r, -out, -1.0 / np.maximum(r, AT_CENTRE * self.R), -self.R * phi)

    def along(self, xi: Array, direction: Array, limit: float) -> Array:
        """To the far side of the circle, the only one that a ray from a body can meet from within."""
        b, off = xi @ direction, xi[:, 0] * direction[1] - xi[:, 1] * direction[0]
        off = off / self.R  # the square of R may be beyond the largest number
        rest = (1.0 - off) * (1.0 + off)
        h = self.R * np.sqrt(np.maximum(rest, 0.0)) - b
        return np.where((rest < 0) | (h > limit), np.inf, h)
