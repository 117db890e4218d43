"""Elliptic cylinder or ellipsoid of revolution.

Closest point: Eberly, "Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid" (Geometric Tools, 2013), whose
equation F(t) = 0 is convex and falls: Newton from its left cannot fail. Arc length: incomplete elliptic integral of the
second kind, DLMF 19.2.5 and 19.30.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.model.units import Length
from prensa.precision import EPS, SMALLEST
from prensa.tools.analytic import AT_CENTRE, Analytic, Closest, Tool
from prensa.tools.tool import ToolShape
from prensa.types import Array

__all__ = ["Ellipse"]

Semi = Annotated[Length, Field(gt=0)]
NEWTON = 100  # iterations, of which about ten are needed; more only for points all but on the longer axis


class Ellipse(ToolShape):
    """Rigid elliptic cylinder (plane problems) or ellipsoid of revolution (axisymmetric); the reference point is its centre.

    ``semi``: half its size along x and along y, before any turn.
    """

    semi: tuple[Semi, Semi]
    type: Literal["ellipse"] = "ellipse"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({"semi": (3.0, 1.0)}, {"semi": (0.002, 0.003)})

    def shape(self, direction: Array, rounding: float) -> Oval:
        """Ellipse about the reference point."""
        return Oval(*self.semi)

    def tip(self) -> str:
        """Its ends may be sharp."""
        return "semi"

    def details(self, shape: Tool, direction: Array) -> str:
        """How sharp it is."""
        return f", radii from {shape.radius:.4g} up"

    def outline(self, depth: float) -> list[Array]:
        """Polygon of half degrees."""
        angle = np.linspace(0.0, 2 * np.pi, 721)[:-1]
        return [np.array(self.semi) * np.column_stack([np.cos(angle), np.sin(angle)])]

    def mirrored(self, on_axis: bool, direction: Array) -> bool:
        """Whether its centre is on the axis."""
        return on_axis


@dataclass(frozen=True)
class Oval(Analytic):
    """Ellipse x = a sin φ, y = −b cos φ about the reference point; s from its lowest point, φ = 0, counter-clockwise."""

    a: float
    b: float

    @property
    def radius(self) -> float:
        """Radius of curvature at the ends of the longer axis."""
        return min(self.a, self.b) ** 2 / max(self.a, self.b)

    @property
    def extent(self) -> float:  # type: ignore[override]
        """Half the longer axis."""
        return max(self.a, self.b)

    @cached_property
    def period(self) -> float:  # type: ignore[override]
        """Circumference, 4 a E(1 − b²/a²)."""
        from scipy.special import ellipe

        return float(4 * self.a * ellipe(1 - (self.b / self.a) ** 2))

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`; of two feet of a point on an axis, the lower or the left one."""
        from scipy.special import ellipeinc

        a, b = self.a, self.b
        x, y = self._foot(np.abs(xi[:, 0]), np.abs(xi[:, 1]))  # on the unit circle
        phi = np.arctan2(np.where(xi[:, 0] > 0, x, -x), np.where(xi[:, 1] > 0, -y, y))
        sin, cos = np.sin(phi), np.cos(phi)
        speed = np.hypot(a * cos, b * sin)
        n = np.stack([b * sin, -a * cos], axis=1) / speed[:, None]
        g = ((xi - np.stack([a * sin, -b * cos], axis=1)) * n).sum(axis=1)
        curvature = 1.0 / np.maximum(speed**3 / (a * b) + g, AT_CENTRE * self.radius)
        return Closest(g, n, curvature, a * ellipeinc(phi, 1 - (b / a) ** 2))

    def _foot(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Foot on the ellipse of points of the first quadrant, as a point (sin φ, |cos φ|) of the unit circle."""
        if self.b > self.a:
            v, u = _foot(self.b, self.a, y, x)
            return u, v
        return _foot(self.a, self.b, x, y)

    def across(self, direction: Array, depth: float) -> tuple[float, float]:
        """Width of a slice across a unit direction, ``depth`` behind its end, and of the whole."""
        dx, dy = direction
        reach = np.hypot(self.a * dx, self.b * dy)  # of the end from the centre
        level = min(max(1 - depth / reach, 0.0), 1.0)
        chord = (
            2 * self.a * self.b / reach * np.sqrt(1 - level**2)
        )  # what lies before the level leans: its chord is its width
        whole = 2 * float(np.hypot(self.a * dy, self.b * dx))
        return min(float(chord), whole), whole


def _foot(a: float, b: float, x: Array, y: Array) -> tuple[Array, Array]:
    """Foot (u, v) on the unit circle, x = a u, y = b v, of points x, y ≥ 0 with a ≥ b.

    F(t) = (a x/(t + a²))² + (b y/(t + b²))² − 1 = 0 at t > −b²; in z = 1 + t/b², scaled by b.
    """
    r, px, py = (a / b) ** 2, x * a / b**2, y / b
    # F is convex and falls: begun where F ≥ 0, Newton goes up to the root and never beyond.
    z = np.maximum(np.maximum(py, px - (r - 1.0)), SMALLEST)  # F ≥ 0: at the left of the root
    for _ in range(NEWTON):
        u, v = px / (z + (r - 1.0)), py / z
        slope = 2 * (u * u / (z + (r - 1.0)) + v * v / z)
        step = (u * u + v * v - 1.0) / np.where(slope > 0, slope, 1.0)
        z = z + np.maximum(step, 0.0)
        if (step <= 4 * EPS * z).all():
            break
    u = np.minimum(px / (z + (r - 1.0)), 1.0)
    v = np.sqrt((1.0 - u) * (1.0 + u))
    # the better conditioned of the two coordinates stands, the other follows from it
    steep = u > v
    v = np.where(steep & (py > 0), np.minimum(py / z, 1.0), v)
    return np.where(steep & (py > 0), np.sqrt((1.0 - v) * (1.0 + v)), u), v
