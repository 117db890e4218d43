"""Surfaces in space that a section of the plane makes: extruded along an axis, revolved about one, swept around a plan.

In the section's coordinates of a point, (ρ, ζ), the section gives gap g, normal (n_ρ, n_ζ) and curvature c of the distance along
its tangent t, which is κ/(1 + κ g) already. In space

* extruded: n is that of the section, ∂n/∂ξ = c t⊗t;
* revolved: n = n_ρ e_ρ + n_ζ k, ∂n/∂ξ = c t⊗t + (n_ρ/ρ) e_φ⊗e_φ, ρ that of the point;
* swept: ρ is the distance from the plan, ν = ∇ρ its normal and c_p the curvature of that distance along its tangent τ:
  n = n_ρ ν + n_ζ k, ∂n/∂ξ = c t⊗t + n_ρ c_p τ⊗τ. A revolution is a plan of no size, with c_p = 1/ρ. The distance is exact where
  the parallels of the plan are smooth, as a point and its foot lie in one plane across the plan (a moulding surface, Monge 1809).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from prensa.geometry.plane import turned
from prensa.geometry.sections import section_axes
from prensa.precision import NEGLIGIBLE
from prensa.tools.analytic import Analytic, Closest, Tool, marched_along
from prensa.types import Array, Flags, Index


def thinned(line: Array) -> Array:
    """Points (n, 2) of a line without those between which it turns by less than six degrees."""
    way = np.diff(line, axis=0)
    angle = np.abs(np.angle(np.exp(1j * np.diff(np.arctan2(way[:, 1], way[:, 0])))))
    turns = np.floor(np.cumsum(angle) / np.radians(6.0))
    kept = np.diff(turns, prepend=-1.0) > 0.0
    return line[np.concatenate([[True], kept, [True]])]


def extruded_facets(polygon: Array, axis: Array, depth: float) -> tuple[Array, Index]:
    """Points (2 n, 3) and triangles (2 n, 3) of a closed polygon (n, 2) of the section, a length to either side along an axis."""
    polygon = thinned(polygon)
    n, flat = len(polygon), polygon @ section_axes(axis).T
    return np.concatenate([flat - depth * axis, flat + depth * axis]), _strips(np.arange(n), n + np.arange(n), True)


def revolved_facets(line: Array, axis: Array, steps: int = 96) -> tuple[Array, Index]:
    """Points and triangles of an open line (n, 2) of radii and heights, revolved about an axis."""
    line = thinned(line)
    e = section_axes(axis)[:, 0]
    a = 2.0 * np.pi * np.arange(steps) / steps
    about = np.cos(a)[:, None] * e + np.sin(a)[:, None] * np.cross(axis, e)
    points = line[:, None, :1] * about + line[:, None, 1:] * axis
    number = np.arange(len(line) * steps).reshape(len(line), steps)
    return points.reshape(-1, 3), np.concatenate([_strips(number[i], number[i + 1], True) for i in range(len(line) - 1)])


def swept_facets(line: Array, plan: Array, normals: Array, axis: Array) -> tuple[Array, Index]:
    """Points and triangles of an open line (n, 2) of distances and heights, around a closed plan (m, 2) with its normals (m, 2).

    Where the line begins or ends at its smallest distance, the flat within is closed.
    """
    line, axes = thinned(line), section_axes(axis)
    m = len(plan)
    flat = plan + line[:, None, :1] * normals
    points = (flat @ axes.T + line[:, None, 1:] * axis).reshape(-1, 3)
    number = np.arange(len(line) * m).reshape(len(line), m)
    strips = [_strips(number[i], number[i + 1], True) for i in range(len(line) - 1)]
    for end, way in ((0, 1), (-1, -1)):
        if line[end, 0] <= line[:, 0].min() * (1.0 - NEGLIGIBLE):
            row = number[end]
            fan = np.stack([np.full(m, len(points)), row, np.roll(row, -1)], axis=1)
            points = np.vstack([points, points[row].mean(axis=0)])
            strips.append(fan[:, ::way])
    return points, np.concatenate(strips)


def half(polygon: Array) -> list[Array]:
    """The lines (n, 2) of a closed polygon at positive x, from where it crosses x = 0 to where it does again."""
    inside = polygon[:, 0] >= 0.0
    if inside.all() or not inside.any():
        return [np.vstack([polygon, polygon[:1]])] if inside.all() else []
    begin = int(np.flatnonzero(~inside)[0])
    p = np.roll(polygon, -begin, axis=0)
    p = np.vstack([p, p[:1]])
    out: list[Array] = []
    line: list[Array] = []
    for a, b in pairwise(p):
        if (a[0] < 0.0) != (b[0] < 0.0):
            line.append(a + a[0] / (a[0] - b[0]) * (b - a))
        if b[0] >= 0.0:
            line.append(b)
        elif line:
            out, line = [*out, np.array(line)], []
    return [*out, np.array(line)] if line else out


def joined(parts: list[tuple[Array, Index]]) -> tuple[Array, Index]:
    """Points and triangles of several surfaces together."""
    first = np.cumsum([0, *(len(x) for x, _ in parts)])
    return np.concatenate([x for x, _ in parts]), np.concatenate([t + k for (_, t), k in zip(parts, first)])


def _strips(a: Index, b: Index, closed: bool) -> Index:
    """Triangles (2 n, 3) between two rows of points (n,)."""
    c, d = np.roll(a, -1), np.roll(b, -1)
    both = np.stack([np.stack([a, b, c], axis=1), np.stack([c, b, d], axis=1)], axis=1)
    return both.reshape(-1, 3) if closed else both[:-1].reshape(-1, 3)


@dataclass(frozen=True)
class _Swept(Analytic):
    """``section`` with its reference point at ``at`` (2,) of the section plane; ``axis`` (3,) of unit length."""

    section: Tool
    at: tuple[float, ...]
    axis: tuple[float, ...]

    @property
    def radius(self) -> float:
        """That of the section."""
        return self.section.radius

    @property
    def extent(self) -> float:  # type: ignore[override]
        """Of the section, and how far it is from the reference point."""
        return self.section.extent and self.section.extent + math.hypot(*self.at)

    @property
    def cavity(self) -> bool:  # type: ignore[override]
        """Whether the section is one."""
        return self.section.cavity

    @property
    def centre(self) -> Array:
        """The reference point."""
        return np.zeros(3)

    @cached_property
    def _axis(self) -> Array:
        return np.array(self.axis)

    @cached_property
    def _across(self) -> Array:
        """The axes (3, 2) of the section plane."""
        return section_axes(self._axis)

    def _of_section(self, x: Array) -> Closest:
        return self.section.closest(x - np.array(self.at))

    def closest(self, xi: Array) -> Closest:
        """Points (k, 3) → `Closest`."""
        raise NotImplementedError

    def along(self, xi: Array, direction: Array, limit: float) -> Array:
        """Distance (k,) from points (k, 3) along a unit vector (3,) to the surface."""
        known = [length for length in (self.extent, self.radius) if 0.0 < length < np.inf]
        unit = known[0] if known else limit
        return marched_along(lambda x: self.closest(x).g, lambda x: self.closest(x).n, unit, xi, direction, limit)

    def across(self, direction: Array, depth: float) -> tuple[float, float]:
        """Widths of the section in a unit direction (2,) of its plane; see `Tool.across`."""
        return self.section.across(direction, depth)


@dataclass(frozen=True)
class Prism(_Swept):
    """A section extruded endlessly along an axis; see the module."""

    @property
    def half_space(self) -> bool:  # type: ignore[override]
        """Whether the section is one straight line."""
        return self.section.half_space

    def closest(self, xi: Array) -> Closest:
        """Points (k, 3) → `Closest`."""
        axes = self._across
        found = self._of_section(xi @ axes)
        t = turned(found.n) @ axes.T
        return Closest(found.g, found.n @ axes.T, found.c[:, None, None] * t[:, :, None] * t[:, None])


@dataclass(frozen=True)
class Revolution(_Swept):
    """A section revolved about an axis through the reference point, of which the half with ρ ≥ 0 counts; see the module.

    Where that half ends on the axis at a slant the surface has a tip there: points see it as a vertex, with normals all around.
    """

    def closest(self, xi: Array) -> Closest:
        """Points (k, 3) → `Closest`; points on the axis under a tip have the axis as their normal and no curvature."""
        k = self._axis
        zeta = xi @ k
        away = xi - zeta[:, None] * k
        rho = np.linalg.norm(away, axis=1)
        scale = np.abs(xi).max(initial=0.0) + self.extent
        on_axis = rho <= NEGLIGIBLE * scale
        some = self._across[:, 0]
        e = np.where(on_axis[:, None], some, away / np.where(on_axis, 1.0, rho)[:, None])
        found = self._of_section(np.stack([rho, zeta], axis=1))
        (n_rho, n_zeta), c = found.n.T, found.c
        n = n_rho[:, None] * e + n_zeta[:, None] * k
        t = -n_zeta[:, None] * e + n_rho[:, None] * k
        # The second principal curvature tends to the first where a surface crosses its axis smoothly.
        around = np.where(on_axis, c, n_rho / np.where(on_axis, 1.0, rho))
        hoop = np.cross(k, e)
        H = c[:, None, None] * t[:, :, None] * t[:, None] + around[:, None, None] * hoop[:, :, None] * hoop[:, None]
        g = found.g.copy()
        beyond = rho - g * n_rho < -NEGLIGIBLE * scale  # its foot lies on the half that does not count
        # On the axis within a tip the closest points are a circle, and no direction of them is better than the axis.
        middle = on_axis & ~beyond & (np.abs(n_rho) > NEGLIGIBLE)
        rows = np.flatnonzero(beyond | middle)
        if len(rows):
            tip = self._at_tip(xi[rows], zeta[rows], g[rows] < 0.0)
            there = np.isfinite(tip[0])  # the surface of a ring does not meet its axis: the distance is that to a circle
            for values, found_there in zip((g, n, H), tip):
                values[rows[there]] = found_there[there]
            n[rows[~there]] = np.where(n_zeta[rows[~there]] < 0.0, -1.0, 1.0)[:, None] * k
            H[middle] = 0.0
        return Closest(g, n, H)

    def _at_tip(self, xi: Array, zeta: Array, inside: Flags) -> tuple[Array, Array, Array]:
        """Gaps (k,), normals (k, 3) and their derivatives of points whose closest point is where the surface meets its axis.

        Gaps are infinite where it does not.
        """
        k, start = self._axis, np.stack([np.zeros_like(zeta), zeta], axis=1) - np.array(self.at)
        limit = 10.0 * (np.abs(xi).max(initial=0.0) + self.extent) + math.hypot(*self.at)
        up, down = (self.section.along(start, np.array([0.0, way]), limit) * way for way in (1.0, -1.0))
        way = np.where(np.abs(up) <= np.abs(down), up, down)
        none = ~np.isfinite(way)
        way = np.where(none, 0.0, way)
        d = xi - (zeta + way)[:, None] * k
        r = np.linalg.norm(d, axis=1)
        sign = np.where(inside, -1.0, 1.0)
        safe = np.where(r > 0.0, r, 1.0)
        n = np.where((r > 0.0)[:, None], sign[:, None] * d / safe[:, None], -np.sign(way)[:, None] * k)
        H = sign[:, None, None] * (np.eye(3) - n[:, :, None] * n[:, None]) / safe[:, None, None]
        return np.where(none, np.inf, sign * r), n, np.where((r > NEGLIGIBLE * limit)[:, None, None], H, 0.0)


@dataclass(frozen=True)
class Moulding(_Swept):
    """A section swept around a closed ``plan`` with its reference point at ``plan_at`` (2,) across the axis; see the module."""

    plan: Tool
    plan_at: tuple[float, ...]

    @property
    def radius(self) -> float:
        """The smaller one of section and plan."""
        return min(self.section.radius, self.plan.radius)

    @property
    def extent(self) -> float:  # type: ignore[override]
        """Of section and plan together."""
        return super().extent + self.plan.extent + math.hypot(*self.plan_at)

    def closest(self, xi: Array) -> Closest:
        """Points (k, 3) → `Closest`."""
        axes, k = self._across, self._axis
        plan = self.plan.closest(xi @ axes - np.array(self.plan_at))
        found = self._of_section(np.stack([plan.g, xi @ k], axis=1))
        out = plan.n @ axes.T
        (n_rho, n_zeta), tau = found.n.T, np.cross(k, out)
        n = n_rho[:, None] * out + n_zeta[:, None] * k
        t = -n_zeta[:, None] * out + n_rho[:, None] * k
        around = n_rho * plan.c
        H = found.c[:, None, None] * t[:, :, None] * t[:, None] + around[:, None, None] * tau[:, :, None] * tau[:, None]
        return Closest(found.g, n, H)
