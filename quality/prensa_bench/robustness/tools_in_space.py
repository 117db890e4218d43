"""Surfaces of rigid tools in space by formulas of their own, and what is drawn of a tool there.

As `prensa_bench.robustness.outlines`: points are in the frame of the tool, a distance is positive outside of it.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import prensa as pr
from prensa.types import Array, Index
from prensa.verify.stl import extruded, faceted, icosphere, write
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


Points = tuple[tuple[float, float], ...]
FACET = np.radians(10.0)  # of fillets in files of triangles
FINER_THAN_FACETS = 10.0  # times: how much nearer to the surface that triangles stand for their curved patches are


def ribbed(at: Place, points: Points, fillet: float, axis: str) -> Placed:
    """A profile of several edges that looks down, all rounded: endless along x or z, or revolved about y."""
    section, outline = pr.Profile(points=points, fillet=fillet), Corners(points, fillet)
    if axis == "y":
        return Placed(pr.Revolved(section=section, at=at), Rotational(outline), at)
    way = (1.0, 0.0, 0.0) if axis == "x" else (0.0, 0.0, 1.0)
    return Placed(pr.Extruded(section=section, axis=way, at=at), Prismatic(outline, axis), at)


def ball_of_triangles(at: Place, radius: float, level: int) -> Placed:
    """The ball as an STL file: an icosahedron divided ``level`` times; checked as the ball, as nearly as its triangles allow."""
    points, triangles = icosphere(radius, level)
    edge = float(np.linalg.norm(points[triangles[:, 0]] - points[triangles[:, 1]], axis=1).max()) / radius
    above = _off(0.5 * edge, radius)  # what stands for the ball may reach beyond it by so much
    return _of_triangles((at[0], at[1] + above, at[2]), points, triangles, Ball(radius), 0.5 * edge, radius)


def ribs_of_triangles(at: Place, profile: Points, fillet: float, width: float) -> Placed:
    """A profile along z as CAD writes it: flats in long triangles, fillets in facets; it goes on straight beyond its borders."""
    points, triangles = extruded(faceted(profile, fillet, FACET), width)
    return _of_triangles(at, points, triangles, Prismatic(Corners(profile, fillet), "z"), 0.5 * FACET, fillet)


def _of_triangles(at: Place, points: Array, triangles: Index, outline: Outline, half: float, radius: float) -> Placed:
    """A tool of triangles that see arcs of a ``radius`` under twice the angle ``half``; its file is made where there is none."""
    digest = hashlib.sha256(points.tobytes() + triangles.tobytes()).hexdigest()[:20]
    path = Path(tempfile.gettempdir()) / "prensa-robustness" / f"{digest}.stl"
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists():
        made = path.with_suffix(f".{os.getpid()}")
        write(made, points, triangles)
        made.replace(path)
    return Placed(pr.Stl(str(path), at=at), outline, at, _off(half, radius), half / FINER_THAN_FACETS)


def _off(half: float, radius: float) -> float:
    """By how much patches over arcs of a radius, seen under twice an angle, may be off them: a share of the height of a chord."""
    return float(radius * (1.0 - np.cos(half)) / FINER_THAN_FACETS)
