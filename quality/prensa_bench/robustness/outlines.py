"""Outlines of rigid tools by formulas of their own: distances that share nothing with those of the solver.

Points are in the frame of the tool. A distance is positive outside the tool.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from prensa.types import Array

FAR = 1e4  # an open chain goes on straight for so many times its size


class Outline(Protocol):
    """Signed distance (k,) of points (k, d), and the outward unit normals (k, d) of the nearest places."""

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Distance and normal."""


@dataclass(frozen=True)
class Straight:
    """Half-plane with an outward normal."""

    normal: tuple[float, float]

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Height above the line."""
        n = np.asarray(self.normal) / np.hypot(*self.normal)
        return x @ n, np.tile(n, (len(x), 1))


@dataclass(frozen=True)
class Round:
    """Circle about the reference point, or all but its inside."""

    radius: float
    hollow: bool = False

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Distance from the centre less the radius."""
        r = np.hypot(x[:, 0], x[:, 1])
        n = x / np.maximum(r, 1e-300)[:, None]
        return (self.radius - r, -n) if self.hollow else (r - self.radius, n)


@dataclass(frozen=True)
class Corners:
    """Straight lines between corners, all rounded with one radius; walk along them with the tool on the left.

    Open chains go on straight beyond both ends. Every corner has its fillet: the nearest piece then has a normal.
    """

    points: tuple[tuple[float, float], ...]
    fillet: float
    closed: bool = False

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """The nearest of all lines and arcs decides."""
        best, gap, normal = np.full(len(x), np.inf), np.full(len(x), np.inf), np.zeros_like(x)
        for g, n, far in self._pieces(x):
            nearer = far < best
            best[nearer], gap[nearer], normal[nearer] = far[nearer], g[nearer], n[nearer]
        return gap, normal

    def _pieces(self, x: Array) -> list[tuple[Array, Array, Array]]:
        p = np.asarray(self.points)
        if not self.closed:
            size = FAR * float(np.ptp(p, axis=0).max())
            first, last = p[0] - p[1], p[-1] - p[-2]
            p = np.vstack([p[:1] + size * first / np.hypot(*first), p[1:-1], p[-1:] + size * last / np.hypot(*last)])
        ends = np.roll(p, -1, axis=0) if self.closed else p[1:]
        starts = p[: len(ends)]
        d = (ends - starts) / np.hypot(*(ends - starts).T)[:, None]
        start, end = starts.copy(), ends.copy()
        out = []
        for i in range(len(d)):
            j = (i + 1) % len(d)
            if j == 0 and not self.closed:
                continue
            turn = float(np.arctan2(d[i, 0] * d[j, 1] - d[i, 1] * d[j, 0], d[i] @ d[j]))
            cut = self.fillet * np.tan(abs(turn) / 2)
            end[i] -= cut * d[i]
            start[j] += cut * d[j]
            out.append(self._arc(x, end[i], d[i], d[j], turn))
        return [*out, *(self._line(x, a, b, t) for a, b, t in zip(start, end, d))]

    def _arc(self, x: Array, a: Array, d0: Array, d1: Array, turn: float) -> tuple[Array, Array, Array]:
        """The rounding that begins at a, between directions d0 and d1."""
        side = np.sign(turn)  # left turns are convex: the centre lies in the tool
        centre = a + side * self.fillet * np.array([-d0[1], d0[0]])
        v = x - centre
        r = np.hypot(v[:, 0], v[:, 1])
        within = (v @ d0 >= 0) & (v @ d1 <= 0)
        gap = side * (r - self.fillet)
        return gap, side * v / np.maximum(r, 1e-300)[:, None], np.where(within, np.abs(gap), np.inf)

    @staticmethod
    def _line(x: Array, a: Array, b: Array, d: Array) -> tuple[Array, Array, Array]:
        n = np.array([d[1], -d[0]])
        v = x - a
        beyond = np.maximum(np.maximum(-(v @ d), v @ d - np.hypot(*(b - a))), 0.0)
        gap = v @ n
        return gap, np.tile(n, (len(x), 1)), np.hypot(gap, beyond)
