"""Where the ellipse of the linearised problem is bad: how bent the problem is, and profile likelihood intervals.

At both ends of a linear interval the case is run: if χ², made least over the other parameters, has grown there by what the
linearised problem foretells, the interval is right. Where it has not, the end is sought at which it has (Bates and Watts 1988,
chapter 6; Venzon and Moolgavkar 1988).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prensa.inverse.objective import Objective, Residuals

Array = NDArray[np.float64]

BENT_BY = 0.1  # share by which the root of Δχ² may miss what the linearised problem foretells before the profile is followed
CLOSE = 0.03  # share to which the end of a profile is found
NEAR = 0.3  # share of the Δχ² at the end that the last step over the other parameters may be foretold to gain, not run
LONGEST_STEP = 0.7  # of what is varied, mostly logarithms: beyond, the linearised problem foretells nothing
FARTHEST = 4.0  # half widths of the linear interval within which the end is sought
MOST_PLACES = 6  # places that are tried at each side


@dataclass(frozen=True)
class Profile:
    """The profile of a parameter: ``low`` and ``high``, ends of the interval in half widths of the linear one (inf: none found).

    ``bent``: by how much the root of Δχ² at the ends of the linear interval differs from what the linearised problem foretells,
    a share; ``followed``: whether the ends are those of the profile; ``points`` (m, 2): way from the least χ² in half widths,
    and the root of Δχ² with the sign of the way, over its value at the end of a 95 % interval. ``least``: least χ² of a run.
    """

    low: float
    high: float
    bent: float
    followed: bool
    points: Array
    least: float


def profile(objective: Objective, x: Array, at: Residuals, number: int, half: Array, limits: tuple[float, float]) -> Profile:
    """Profile of parameter *number* around unknowns x (n,) of least χ²; ``half`` (n,): way to the ends by the linear problem."""
    sides = [_Side(objective, x, at, number, half, sign, limits) for sign in (-1.0, 1.0)]
    bent = max(side.bent for side in sides)
    points = [(0.0, 0.0)]
    for side in sides:
        if side.bent > BENT_BY:
            side.follow()
        points += [(side.sign * d, side.sign * root) for d, root in side.points]
    return Profile(
        low=sides[0].end, high=sides[1].end, bent=bent, followed=bent > BENT_BY, points=np.array(sorted(points)),
        least=min(side.least for side in sides),
    )  # fmt: skip


class _Side:
    """One side of a profile; ways in half widths of the linear interval, roots of Δχ² over that at its end."""

    def __init__(
        self, objective: Objective, x: Array, at: Residuals, number: int, half: Array, sign: float,
        limits: tuple[float, float],
    ) -> None:  # fmt: skip
        self.objective, self.x, self.at, self.number, self.sign = objective, x, at, number, sign
        self.others = np.delete(np.arange(len(x)), number)
        covariance = np.linalg.pinv(at.J.T @ at.J, rcond=1e-14)
        # along the valley of the linearised problem the others follow
        self.valley = half[number] * covariance[:, number] / covariance[number, number]
        self.target = half[number] / np.sqrt(covariance[number, number])
        room = (limits[1] - x[number]) if sign > 0 else (x[number] - limits[0])
        self.room = float(room / half[number])
        self.least = at.square
        self.end, self.bent = min(1.0, self.room), 0.0
        self.points: list[tuple[float, float]] = []
        if self.room > 1.0:
            root = self._first()
            self.points.append((1.0, root))
            self.bent = abs(root - 1.0)

    def _first(self) -> float:
        """Root at the linear end: the run there, the others improved as the linearised problem has it."""
        found = self.objective.residuals(self.x + self.sign * self.valley)
        if found is None:
            return np.inf
        self.least = min(self.least, float(found @ found))
        basis, _ = np.linalg.qr(self.at.J[:, self.others])
        return self._root(float(found @ found) - float(np.linalg.norm(basis.T @ found) ** 2))

    def _root(self, square: float) -> float:
        return float(np.sqrt(max(square - self.at.square, 0.0)) / self.target)

    def follow(self) -> None:
        """Find the end of the profile."""
        self.points = []
        d, inside, outside, start = 1.0, (0.0, 0.0), (np.inf, np.inf), self.valley * 0.0
        for _ in range(MOST_PLACES):
            if d > min(FARTHEST, self.room):
                d = min(FARTHEST, self.room)
            shift = start + self.valley * (d - inside[0])
            square, shift = self._lowest(d, shift)
            root = self._root(square)
            if np.isfinite(root):
                self.points.append((d, root))
            if abs(root - 1.0) < CLOSE:
                self.end = d
                return
            if root < 1.0:
                inside, start = (d, root), shift
                if d >= min(FARTHEST, self.room):
                    self.end = self.room if self.room <= FARTHEST else np.inf
                    return
            else:
                outside = (d, root)
            d = self._next(inside, outside)
        self.end = d

    @staticmethod
    def _next(inside: tuple[float, float], outside: tuple[float, float]) -> float:
        """Where the root is about 1: between both by interpolation, else beyond by its slope."""
        (a, low), (b, high) = inside, outside
        if not np.isfinite(b):
            return float(min(3.0 * a, a / max(low, 1e-3)))
        if not np.isfinite(high):
            return 0.5 * (a + b)
        return a + (b - a) * float(np.clip((1.0 - low) / (high - low), 0.05, 0.95))

    def _lowest(self, d: float, shift: Array) -> tuple[float, Array]:
        """Least χ² with the parameter held at *d*, by Gauss and Newton from a shift (n,) of all; inf where there is no answer."""
        held = self.sign * d * self.valley[self.number]
        y = self.x + self.sign * shift
        y[self.number] = self.x[self.number] + held
        square = np.inf
        for _ in range(3):
            got = self.objective.at(y)
            if got is None:
                break
            self.least = min(self.least, got.square)
            step, *_ = np.linalg.lstsq(got.J[:, self.others], -got.r, rcond=1e-12)
            step *= min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-300))
            gain = got.square - float(np.linalg.norm(got.r + got.J[:, self.others] @ step) ** 2)
            if got.square - gain > square:
                break
            square, best = got.square - gain, y.copy()
            best[self.others] += step
            if gain < NEAR * self.target**2:
                break
            y = best
        if not np.isfinite(square):
            return np.inf, shift
        return square, self.sign * (best - self.x)
