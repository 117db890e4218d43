"""Rigid tools in their own frame: signed distance, normal, curvature and surface coordinate of the closest point.

For points ξ (k, d) in the tool frame (origin at the reference point, axes turned with the tool), in the plane and in space:

* g (k,): signed distance, negative inside the tool;
* n (k, d): outward unit normal at the closest point, ∇g;
* c: curvature of the distance. In the plane (k,), ∂n/∂ξ = c e⊗e with the tangent e = n turned by +90°; 1/(R + g) on an arc.
  In space (k, 3, 3), ∂n/∂ξ itself;
* s (k,): surface coordinate along e in the plane; ds = (1 − g c) e·dξ. A surface in space has none.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from prensa.precision import EPS, NEGLIGIBLE, ROUND_OFF
from prensa.types import Array


class Closest(NamedTuple):
    """Closest-point data of k points: g (k,), n (k, d), c (k,) or (k, 3, 3), s (k,); see above."""

    g: Array
    n: Array
    c: Array
    s: Any = None


class Tool(Protocol):
    """A rigid tool's shape."""

    @property
    def radius(self) -> float:
        """Smallest radius of curvature of a convex part (inf for flats, 0 for sharp edges)."""

    @property
    def period(self) -> float:
        """Length of a closed surface, across which s jumps; inf of others."""

    @property
    def extent(self) -> float:
        """Size of a shape that has an end, 0 of others: how far outside to begin when it is moved to a boundary."""

    @property
    def half_space(self) -> bool:
        """Whether its surface is one straight line."""

    @property
    def cylinder(self) -> float:
        """Radius of a cylinder or sphere about the reference point, infinite of other shapes."""

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

    def across(self, direction: Array, depth: float) -> tuple[float, float]:
        """Width of what lies within ``depth`` of the end in a unit direction, and of the whole; for ends that may be sharp."""


AT_CENTRE = 1e-3  # distance to a centre of curvature over the radius below which curvature grows no more: no normal is left there


def newton_along(shape: Tool, xi: Array, direction: Array, limit: float) -> Array:
    """`Tool.along` of a convex shape: Newton on the signed distance along the ray.

    Exact in one step on flats, monotone and quadratic on convex arcs.
    """
    h = np.zeros(len(xi))
    miss = np.zeros(len(xi), dtype=bool)
    for _ in range(60):
        close = shape.closest(xi + h[:, None] * direction)
        slope = close.n @ direction
        step = np.where(slope < -NEGLIGIBLE, close.g / np.where(slope < -NEGLIGIBLE, -slope, 1.0), 0.0)
        # A ray that goes along a convex surface, or away from it, does not meet it any more.
        miss |= (slope >= -NEGLIGIBLE) & (np.abs(close.g) > ROUND_OFF * limit)
        h = np.where(miss, h, h + step)
        miss |= h > limit
        if (miss | (np.abs(step) <= 4 * EPS * limit)).all():
            break
    return np.where(miss, np.inf, h)


def marched_along(
    distance: Callable[[Array], Array], normal: Callable[[Array], Array], unit: float,
    xi: Array, direction: Array, limit: float,
) -> Array:  # fmt: skip
    """`Tool.along` of any shape whose ``distance`` (k,) grows no faster than the way; ``unit``: a length of the shape.

    Steps of |g| cannot pass a surface but by round-off; then Newton.
    """
    by = 1e-4 * unit + ROUND_OFF * limit  # a shape without corners, as a cone of one line, has no length of its own
    inside = distance(xi) < 0.0
    way = np.where(inside, -1.0, 1.0)
    h = np.zeros(len(xi))
    going = np.arange(len(xi))
    for _ in range(400):
        x = xi[going] + (way[going] * h[going])[:, None] * direction
        close = np.abs(distance(x))
        near = np.flatnonzero(close <= by)
        arrived = np.zeros(len(going), dtype=bool)  # and not on the way out
        arrived[near] = np.where(inside[going[near]], 1.0, -1.0) * way[going[near]] * (normal(x[near]) @ direction) > 0.0
        # on the surface itself, as at a tip, steps lead nowhere
        alive = ~arrived & (h[going] <= limit) & (close > EPS * unit)
        if not alive.any():
            break
        going = going[alive]
        h[going] += close[alive]
    h = way * h
    for _ in range(30):
        x = xi + h[:, None] * direction
        g, slope = distance(x), normal(x) @ direction
        step = np.where(np.abs(slope) > NEGLIGIBLE, g / np.where(np.abs(slope) > NEGLIGIBLE, -slope, 1.0), 0.0)
        # The surface is that near by now: a much longer step comes of a ray that all but grazes it.
        step = np.clip(step, -10.0 * by, 10.0 * by)
        h = h + step
        if (np.abs(step) <= 4 * EPS * limit).all():
            break
    missed = np.abs(distance(xi + h[:, None] * direction)) > NEGLIGIBLE * (unit + limit)
    return np.where(missed | (h > limit), np.inf, h)


class Analytic:
    """What convex shapes have in common, and answers that hold for a shape without an end."""

    cavity = False
    period = np.inf
    extent = 0.0
    half_space = False
    cylinder = np.inf

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

    def across(self, direction: Array, depth: float) -> tuple[float, float]:
        """Without an end that may be sharp."""
        return np.inf, np.inf
