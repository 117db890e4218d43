"""Surfaces of rigid tools in space by formulas of their own, and what is drawn of a tool there.

As `prensa_bench.robustness.outlines`: points are in the frame of the tool, a distance is positive outside of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import prensa as pr
from prensa.types import Array
from prensa_bench.robustness.drawn import Placed
from prensa_bench.robustness.outlines import Corners, Outline, Round

Place = tuple[float, float, float]
ACROSS = {"x": [2, 1], "z": [0, 1]}  # axes of the plane across a horizontal axis


@dataclass(frozen=True)
class Half:
    """Half-space with an outward normal."""

    normal: Place

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Height above the plane."""
        n = np.asarray(self.normal) / np.linalg.norm(self.normal)
        return x @ n, np.tile(n, (len(x), 1))


@dataclass(frozen=True)
class Ball:
    """Sphere about the reference point."""

    radius: float

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Distance from the centre less the radius."""
        r = np.linalg.norm(x, axis=1)
        return r - self.radius, x / np.maximum(r, 1e-300)[:, None]


@dataclass(frozen=True)
class Prismatic:
    """An outline of the plane, endless along the axis x or z."""

    section: Outline
    axis: str

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """That of the section."""
        across = ACROSS[self.axis]
        gap, flat = self.section(x[:, across])
        n = np.zeros_like(x)
        n[:, across] = flat
        return gap, n


@dataclass(frozen=True)
class Rotational:
    """An outline of the plane (radius, height) about the upright axis."""

    section: Outline

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """That of the section through the point."""
        r = np.hypot(x[:, 0], x[:, 2])
        gap, flat = self.section(np.stack([r, x[:, 1]], axis=1))
        out = x[:, [0, 2]] / np.maximum(r, 1e-300)[:, None]
        return gap, np.stack([flat[:, 0] * out[:, 0], flat[:, 1], flat[:, 0] * out[:, 1]], axis=1)


def plate(at: Place, normal: Place) -> Placed:
    """Half-space that looks along ``normal``."""
    return Placed(pr.Plane(normal=normal, at=at), Half(normal), at)


def ball(at: Place, radius: float) -> Placed:
    """Ball about ``at``."""
    return Placed(pr.Sphere(radius=radius, at=at), Ball(radius), at)


def roll(at: Place, radius: float, axis: str) -> Placed:
    """Cylinder along x or z about ``at``."""
    tool = pr.Extruded(section=pr.Circle(radius=radius), axis=(1.0, 0.0, 0.0) if axis == "x" else (0.0, 0.0, 1.0), at=at)
    return Placed(tool, Prismatic(Round(radius), axis), at)


def punch(at: Place, width: float, fillet: float, axis: str) -> Placed:
    """Flat punch that looks down: a bar along x or z, or round, ``axis`` y."""
    w, far = 0.5 * width, 10 * width
    outline = Corners(((-w, far), (-w, 0.0), (w, 0.0), (w, far)), fillet)
    section = pr.Stamp(width=width, fillet=fillet, facing=(0.0, -1.0))
    if axis == "y":
        return Placed(pr.Revolved(section=section, at=at), Rotational(outline), at)
    way = (1.0, 0.0, 0.0) if axis == "x" else (0.0, 0.0, 1.0)
    return Placed(pr.Extruded(section=section, axis=way, at=at), Prismatic(outline, axis), at)


def cone(at: Place, slope: float, reach: float, nose: float) -> Placed:
    """Cone on its tip, which is rounded by a radius: its flank rises by ``slope`` over the radius, to ``reach`` at least.

    ``at``: where the flanks would meet.
    """
    corners = ((-reach, slope * reach), (0.0, 0.0), (reach, slope * reach))
    tool = pr.Revolved(section=pr.Profile(points=corners, fillet=nose), at=at)
    return Placed(tool, Rotational(Corners(corners, nose)), at)
