"""Rigid sphere in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.model.units import Length
from prensa.tools.analytic import Analytic, Closest
from prensa.tools.swept import revolved_facets
from prensa.tools.tool import ToolShape
from prensa.types import Array, Index

__all__ = ["Sphere"]


class Sphere(ToolShape):
    """Rigid sphere in space of a ``radius``; the reference point is its centre."""

    radius: Annotated[Length, Field(gt=0)]
    type: Literal["sphere"] = "sphere"

    dimensions: ClassVar[tuple[int, ...]] = (3,)

    def shape(self, direction: Array, rounding: float) -> Ball:
        """Ball about the reference point."""
        return Ball(self.radius)

    def facets(self, direction: Array, depth: float) -> tuple[Array, Index]:
        """A half circle revolved."""
        a = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 49)
        return revolved_facets(self.radius * np.stack([np.cos(a), np.sin(a)], axis=1), np.eye(3)[1])

    def face(self) -> tuple[float, str]:
        """The radius."""
        return self.radius, "radius"


@dataclass(frozen=True)
class Ball(Analytic):
    """Ball of radius R about the reference point: g = |ξ| − R, n = ξ/|ξ|, ∂n/∂ξ = (I − n⊗n)/|ξ|."""

    radius: float

    @property
    def extent(self) -> float:  # type: ignore[override]
        """Radius."""
        return self.radius

    @property
    def centre(self) -> Array:
        """The reference point."""
        return np.zeros(3)

    def closest(self, xi: Array) -> Closest:
        """Points (k, 3) → `Closest`; the centre itself counts as below it."""
        r = np.linalg.norm(xi, axis=1)
        away = np.where(r > 0, r, self.radius)[:, None]
        n = np.where((r > 0)[:, None], xi / away, -np.eye(3)[[1]])
        return Closest(r - self.radius, n, (np.eye(3) - n[:, :, None] * n[:, None]) / away[:, :, None])
