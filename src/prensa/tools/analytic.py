"""Rigid tools in their own frame: signed distance, normal, curvature and surface coordinate of the closest point.

For points ξ (k, 2) in the tool frame (origin at the reference point, axes turned with the tool):

* g (k,): signed distance, negative inside the tool;
* n (k, 2): outward unit normal at the closest point, ∇g;
* c (k,): curvature of the distance, ∂n/∂ξ = c e⊗e with the tangent e = n turned by +90°; 1/(R + g) on an arc;
* s (k,): surface coordinate along e; ds = (1 − g c) e·dξ.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_EDGE = 1e-9  # a point this close to the edge of a flat, relative to its width, counts as under it


class Closest(NamedTuple):
    """Closest-point data of k points: g (k,), n (k, 2), c (k,), s (k,)."""

    g: Array
    n: Array
    c: Array
    s: Array


class Tool(Protocol):
    """A rigid tool's shape."""

    @property
    def radius(self) -> float:
        """Smallest radius of curvature of a convex part (inf for flats, 0 for sharp edges)."""

    @property
    def period(self) -> float:
        """Length of a closed surface, across which s jumps; inf of others."""

    @property
    def edges(self) -> Array:
        """Sharp convex edges (k, 4): place, and the unit vector along e across the mean normal."""

    @property
    def cavity(self) -> bool:
        """Whether the tool is all around and the body inside."""

    @property
    def centre(self) -> Array:
        """Middle (2,) of a closed surface, the reference point of others."""

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) in the tool frame → closest-point data."""

    def along(self, xi: Array, direction: Array, limit: float) -> Array:
        """Distance (k,) from points (k, 2) along a unit vector to the surface, negative from inside.

        Infinite where the ray misses it, or beyond ``limit``.
        """


def turned(n: Array) -> Array:
    """Vectors (k, 2) turned by +90°."""
    return np.stack([-n[:, 1], n[:, 0]], axis=1)


def newton_along(shape: Tool, xi: Array, direction: Array, limit: float) -> Array:
    """`Tool.along` of a convex shape: Newton on the signed distance along the ray.

    Exact in one step on flats, monotone and quadratic on convex arcs.
    """
    h = np.zeros(len(xi))
    miss = np.zeros(len(xi), dtype=bool)
    for _ in range(60):
        close = shape.closest(xi + h[:, None] * direction)
        slope = close.n @ direction
        step = np.where(slope < -1e-9, close.g / np.where(slope < -1e-9, -slope, 1.0), 0.0)
        miss |= (slope >= -1e-9) & (np.abs(close.g) > 1e-12 * limit)
        h = np.where(miss, h, h + step)
        miss |= h > limit
        if (miss | (np.abs(step) <= 1e-15 * limit)).all():
            break
    return np.where(miss, np.inf, h)


class _Analytic:
    """What the shapes without a chain have in common."""

    cavity = False
    period = np.inf

    @property
    def edges(self) -> Array:
        """None."""
        return np.zeros((0, 4))

    @property
    def centre(self) -> Array:
        """The reference point."""
        return np.zeros(2)

    def along(self: Any, xi: Array, direction: Array, limit: float) -> Array:
        """By Newton."""
        return newton_along(self, xi, direction, limit)


@dataclass(frozen=True)
class Plane(_Analytic):
    """Half-space below the line through the reference point with outward normal (nx, ny), unit length."""

    nx: float
    ny: float
    radius: float = np.inf

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`."""
        n = np.full((len(xi), 2), (self.nx, self.ny))
        g, s = xi[:, 0] * self.nx + xi[:, 1] * self.ny, xi[:, 1] * self.nx - xi[:, 0] * self.ny
        return Closest(g, n, np.zeros(len(xi)), s)


@dataclass(frozen=True)
class Circle(_Analytic):
    """Disc of radius R about the reference point; s = R φ, measured from the lowest point of the circle."""

    radius: float

    @property
    def period(self) -> float:  # type: ignore[override]
        """Circumference."""
        return 2 * np.pi * self.radius

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`; the centre itself counts as below it."""
        r = np.hypot(xi[:, 0], xi[:, 1])
        safe = np.where(r > 0, r, 1.0)
        n = np.where((r > 0)[:, None], xi / safe[:, None], np.array([0.0, -1.0]))
        phi = np.arctan2(n[:, 0], -n[:, 1])  # 0 at the bottom, growing along +90° of the normal
        return Closest(r - self.radius, n, 1.0 / np.maximum(r, 1e-3 * self.radius), self.radius * phi)


@dataclass(frozen=True)
class Hollow(_Analytic):
    """Everything outside a circle of radius R about the reference point; s = −R φ from its lowest point."""

    R: float
    radius: float = np.inf
    cavity = True

    @property
    def period(self) -> float:  # type: ignore[override]
        """Circumference."""
        return 2 * np.pi * self.R

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`; the centre itself counts as below it."""
        r = np.hypot(xi[:, 0], xi[:, 1])
        safe = np.where(r > 0, r, 1.0)
        out = np.where((r > 0)[:, None], xi / safe[:, None], np.array([0.0, -1.0]))
        phi = np.arctan2(out[:, 0], -out[:, 1])
        return Closest(self.R - r, -out, -1.0 / np.maximum(r, 1e-3 * self.R), -self.R * phi)

    def along(self, xi: Array, direction: Array, limit: float) -> Array:
        """To the far side of the circle, the only one that a ray from a body can meet from within."""
        b, off = xi @ direction, xi[:, 0] * direction[1] - xi[:, 1] * direction[0]
        rest = self.R**2 - off**2
        h = np.sqrt(np.maximum(rest, 0.0)) - b
        return np.where((rest < 0) | (h > limit), np.inf, h)


@dataclass(frozen=True)
class Flat(_Analytic):
    """Flat face between ``a`` and ``b`` along e, looking along n (unit), edges rounded with ``fillet``; endless behind.

    The reference point lies on the face line; ``a`` and ``b`` are coordinates along e = n turned by +90°.
    Points under the face see the face, never the sides: penetration there is always along n.
    """

    nx: float
    ny: float
    a: float
    b: float
    fillet: float

    @property
    def radius(self) -> float:
        """Fillet radius."""
        return self.fillet

    @property
    def edges(self) -> Array:
        """Both edges if they are sharp."""
        e = np.array([-self.ny, self.nx])
        return np.array([[*(x * e), *e] for x in (self.a, self.b) if self.fillet == 0.0]).reshape(-1, 4)

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`."""
        n0, e0 = np.array([self.nx, self.ny]), np.array([-self.ny, self.nx])
        y, x = xi @ n0, xi @ e0
        r = self.fillet
        lo, hi = self.a + r, self.b - r
        tol = _EDGE * (self.b - self.a)
        side = np.where(x > hi + tol, 1.0, np.where(x < lo - tol, -1.0, 0.0))
        dx = np.where(side > 0, x - hi, np.where(side < 0, x - lo, 0.0))
        behind = (side != 0) & (y < -r)  # beside the flank
        dy = np.where(behind, 0.0, y + r)
        length = np.hypot(dx, dy)
        arc = side != 0
        safe = np.where(length > 0, length, 1.0)
        g = np.where(arc, length - r, y)
        nt, nn = np.where(arc, dx / safe, 0.0), np.where(arc, dy / safe, 1.0)
        zero = arc & (length == 0)
        nn = np.where(zero, 1.0, nn)
        n = nn[:, None] * n0 + nt[:, None] * e0
        c = np.where(arc & ~behind, 1.0 / np.maximum(length, 1e-12 * (self.b - self.a)), 0.0)
        # along e the angle of the arc runs from 0 (face) outwards; e·n turned: s grows with x on the face
        angle = np.arctan2(np.abs(dx), np.where(behind, 1e-300, dy))
        s = np.where(arc, np.where(side > 0, hi, lo) + side * r * angle, x)
        s = np.where(behind, np.where(side > 0, hi, lo) + side * (0.5 * np.pi * r - (y + r)), s)
        return Closest(g, n, c, s)
