"""Flat face with two edges, what stamps and rings press with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from prensa.precision import NEGLIGIBLE, ROUND_OFF, SMALLEST
from prensa.tools.analytic import Analytic, Closest
from prensa.types import Array


@dataclass(frozen=True)
class Flat(Analytic):
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
        tol = NEGLIGIBLE * (self.b - self.a)
        # A margin at the edges: a node exactly under an edge sees the face, and does not flip to the corner by round-off.
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
        c = np.where(arc & ~behind, 1.0 / np.maximum(length, ROUND_OFF * (self.b - self.a)), 0.0)
        # along e the angle of the arc runs from 0 (face) outwards; e·n turned: s grows with x on the face
        angle = np.arctan2(np.abs(dx), np.where(behind, SMALLEST, dy))
        s = np.where(arc, np.where(side > 0, hi, lo) + side * r * angle, x)
        s = np.where(behind, np.where(side > 0, hi, lo) + side * (0.5 * np.pi * r - (y + r)), s)
        return Closest(g, n, c, s)

    def along(self, xi: Array, direction: Array, limit: float) -> Array:
        """Distance (k,) along the unit direction to where the ray comes in: at the face, a fillet, or a flank from beside it.

        In closed form: inside, points beside a turned face have the face's distance, with which Newton's way from a flank ends
        anywhere.
        """
        n0, e0 = np.array([self.nx, self.ny]), np.array([-self.ny, self.nx])
        y, x, dy, dx = xi @ n0, xi @ e0, float(direction @ n0), float(direction @ e0)
        r, tol = self.fillet, NEGLIGIBLE * (self.b - self.a)
        h, inside = np.full(len(xi), np.inf), self.closest(xi).g < 0.0
        for out, end in ((1.0, self.b), (-1.0, self.a)):
            if out * dx < 0.0:
                flank = (end + 2.0 * out * tol - x) / dx  # less far out it would be under the face
                h = np.where((flank >= 0.0) & (y + flank * dy <= -r), flank, h)
            if r > 0.0:  # the first crossing of the fillet's circle, if that lies on its quarter
                ox, oy = out * x - (out * end - r), y + r
                b, off = ox * out * dx + oy * dy, ox * dy - oy * out * dx
                first = -b - np.sqrt(np.maximum(r * r - off * off, 0.0))
                on = (
                    (np.abs(off) <= r)
                    & ((first >= 0.0) | inside)
                    & (ox + first * out * dx >= 0.0)
                    & (oy + first * dy >= 0.0)
                )
                h = np.where(on, first, h)
        if dy < -NEGLIGIBLE:
            face = -y / dy
            at = x + face * dx
            on = (at >= self.a + r - tol) & (at <= self.b - r + tol) & ((face >= -tol) | inside)
            h = np.where(on, face, h)
        return np.where(h > limit, np.inf, h)
