"""Profile likelihood: how nonlinear the problem is, and intervals where the ellipse of the linearised problem is bad.

At both ends of a linear interval the case is run: if χ², made least over the other parameters, has grown there by what the
linearised problem predicts, the interval is right. Where it has not, the end is sought at which it has (Bates and Watts 1988,
chapter 6; Venzon and Moolgavkar 1988).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, lsq_linear

from prensa.inverse.bends import Curve, LinearisedResiduals
from prensa.inverse.objective import TRUSTED, Objective, Residuals
from prensa.precision import NEGLIGIBLE, ROUND_OFF, SMALLEST
from prensa.types import Array

BENT_BY = 0.1  # share of Δχ² or its root at the end of an interval that predictions by linearised problems may miss
CLOSE = 0.03  # share to which the end of a profile is found
FARTHEST = 8.0  # half widths of the linear interval within which the end is sought
TOO_FAR = 2.0  # root beyond which a place says little of where it is 1
MOST_PLACES = 8  # places at a side at which an end is looked for or predicted
MOST_STEPS = 5  # over the other parameters, at a place
LONGEST_WAY = 4.0  # of what is varied, mostly logarithms, along a profile that is predicted


@dataclass(frozen=True)
class Profile:
    """The profile of a parameter: ``low`` and ``high``, ends of the interval in half widths of the linear one (inf: none found).

    ``bent``: by how much the root of Δχ² at the ends of the linear interval differs from what the linearised problem predicts,
    a share; ``followed``: whether the ends are those of the profile; ``points`` (m, 2): way from the least χ² in half widths,
    and the root of Δχ² with the sign of the way, over its value at the end of a 95 % interval. ``least``: least χ² of a run.
    """

    low: float
    high: float
    bent: float
    followed: bool
    points: Array
    least: float


def profile(
    objective: Objective, x: Array, at: Residuals, number: int, half: Array, limits: tuple[float, float],
    curves: Sequence[Curve] = (),
) -> Profile:  # fmt: skip
    """Profile of parameter *number* around unknowns x (n,) of least χ²; ``half`` (n,): way to the ends by the linear problem.

    ``curves``: flow curves along whose stresses the problem is predicted (`LinearisedResiduals`), where its ends are
    looked for first.
    """
    # Chains of samples (MCMC) would take hundreds of runs, measures of curvature by second derivatives as many runs for less.
    sides = [_Side(objective, x, at, number, half, sign, limits) for sign in (-1.0, 1.0)]
    bent = max(side.bent for side in sides)
    points = [(0.0, 0.0)]
    for side in sides:
        if side.bent > BENT_BY and not (curves and side.end_predicted(curves)):
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
        covariance = np.linalg.pinv(at.J.T @ at.J)
        # along the valley of the linearised problem the others follow
        self.valley = half[number] * covariance[:, number] / covariance[number, number]
        self.target = half[number] / np.sqrt(covariance[number, number])
        room = (limits[1] - x[number]) if sign > 0 else (x[number] - limits[0])
        self.room = float(room / half[number])
        self.least = at.square
        self.end, self.bent = min(1.0, self.room), 0.0
        self.points: list[tuple[float, float]] = []
        self.first = 1.0
        if self.room > 1.0:
            self.first = self._first()
            self.points.append((1.0, self.first))
            self.bent = abs(self.first - 1.0)

    def end_predicted(self, curves: Sequence[Curve]) -> bool:
        """Whether the end is where the stresses of flow curves predict it, as a run there shows; if so it is taken.

        Where the run shows something else, it is predicted again from there.
        """
        near, start = LinearisedResiduals(curves, self.x, self.at.r, self.at.J), self.x
        for _ in range(MOST_PLACES):
            end, y, steep = self._end_of(near, start)
            if not end > 0.0:  # what is predicted has the least elsewhere
                return False
            found = self.objective.at(y)
            if found is None:
                return False
            self.least = min(self.least, found.square)
            # the others improved, but by no more than a step: what has come to nothing moves nothing
            others = lsq_linear(found.J[:, self.others], -found.r, (-TRUSTED, TRUSTED))
            root = self._root(2.0 * float(others.cost))
            self.points.append((end, root))
            if not steep and root < 1.0:
                self.end = self.room if self.room <= FARTHEST else np.inf
                return True
            if steep and abs(root - 1.0) <= BENT_BY:  # what is left is made up for as the root grows there
                self.end = float(np.clip(end + (1.0 - root) / steep, 0.7 * end, min(1.3 * end, self.room)))
                return True
            near, start = LinearisedResiduals(curves, y, found.r, found.J), y
        return False

    def _end_of(self, near: LinearisedResiduals, start: Array) -> tuple[float, Array, float]:
        """Way to where the root is predicted to be 1, unknowns (n,) there, and its slope; where none is, the farthest, and 0."""
        reach = min(FARTHEST, self.room)
        places = {0.0: (start, 0.0)}

        def above(d: float) -> float:
            """Root at a way d, less the one sought."""
            if d not in places:
                nearest = places[min(places, key=lambda other: abs(other - d))][0]
                places[d] = self._along_curves(near, d, nearest)
            return places[d][1] - 1.0

        inside, end = 0.0, min(1.0, reach)
        while above(end) < 0.0:
            if end >= reach:
                return end, places[end][0], 0.0
            inside, end = end, min(2.0 * end, reach)
        end = float(brentq(above, inside, end))
        above(end)
        if not end > 0.0:
            return end, start, 0.0
        y, expected = places[end]
        return end, y, max(expected - self._along_curves(near, (1.0 - BENT_BY) * end, y)[1], NEGLIGIBLE) / (BENT_BY * end)

    def _along_curves(self, near: LinearisedResiduals, d: float, start: Array) -> tuple[Array, float]:
        """Unknowns of least χ² with the parameter held at a way *d*, and the root there, as flow curves predict it."""
        y = start.copy()
        y[self.number] = self.x[self.number] + self.sign * d * self.valley[self.number]
        y = near.least(y, y - LONGEST_WAY, y + LONGEST_WAY, self.number)
        return y, self._root(near.square(y))

    def _first(self) -> float:
        """Root at the linear end: the run there, the others improved as the linearised problem has it."""
        found = self.objective.residuals(self.x + self.sign * self.valley)
        if found is None:
            return np.inf
        self.least = min(self.least, float(found @ found))
        # What the others could still gain is taken off by projection: one run without derivatives shows how nonlinear the
        # problem is.
        basis, _ = np.linalg.qr(self.at.J[:, self.others])
        return self._root(float(found @ found) - float(np.linalg.norm(basis.T @ found) ** 2))

    def _root(self, square: float) -> float:
        return float(np.sqrt(max(square - self.at.square, 0.0)) / self.target)

    def follow(self) -> None:
        """Find the end of the profile: Newton's way to where the root is 1, along the valley as it bends (`_Place`)."""
        self.points = []
        reach = min(FARTHEST, self.room)
        inside, outside, d = _Place(0.0, 0.0, 1.0, np.zeros_like(self.x), self.valley), np.inf, self._first_way()
        here = inside
        for _ in range(MOST_PLACES):
            d = min(d, reach)
            found = self._lowest(d, here)
            if found is None:
                outside, d = d, 0.5 * (inside.d + d)
                continue
            self.points.append((d, found.root))
            if found.root > 1.0:
                outside = d
            else:
                inside = found
            # Far beyond the end derivatives say little of where it is.
            here = found if found.root < TOO_FAR else inside
            self.end = float(np.clip(found.onward, inside.d, min(outside, reach)))
            if abs(found.root - 1.0) < CLOSE:
                return
            if inside.d >= reach:
                self.end = self.room if self.room <= FARTHEST else np.inf
                return
            margin = CLOSE * (outside - inside.d) if np.isfinite(outside) else 0.0
            most = outside if np.isfinite(outside) else max(2.0 * inside.d, inside.d + 1.0)
            known = here is found or inside.d < found.onward < outside
            d = float(np.clip(found.onward if known else 0.5 * (inside.d + most), inside.d + margin, most - margin))

    def _first_way(self) -> float:
        """Where the root is about 1 if it grows as it does up to the end of the linear interval."""
        root = self.first
        return float(np.clip(1.0 / root, 0.3, 2.0)) if np.isfinite(root) and root > 0.0 else 0.5 if root > 0.0 else 2.0

    def _lowest(self, d: float, near: _Place) -> _Place | None:
        """Least χ² with the parameter held at *d*, by Gauss and Newton from a place near; None where there is no answer."""
        ahead = near.along * (d - near.d)
        ahead[self.others] = np.clip(ahead[self.others], -TRUSTED, TRUSTED)
        y = self.x + self.sign * (near.shift + ahead)
        best: tuple[Array, Residuals, Array, float] | None = None
        for _ in range(MOST_STEPS):
            got = self.objective.at(y)
            if got is None:
                break
            self.least = min(self.least, got.square)
            if best is not None and got.square > best[1].square:  # too far
                y = 0.5 * (y + best[0])
                continue
            step, *_ = np.linalg.lstsq(got.J[:, self.others], -got.r, rcond=ROUND_OFF)
            step *= min(1.0, TRUSTED / max(float(np.abs(step).max(initial=0.0)), SMALLEST))
            rest = got.r + got.J[:, self.others] @ step
            best = y, got, rest, got.square - float(rest @ rest)
            y = y.copy()
            y[self.others] += step
            if best[3] < BENT_BY * self.target**2:
                break
        return None if best is None else self._place(d, y, best[1], best[2])

    def _place(self, d: float, y: Array, at: Residuals, rest: Array) -> _Place:
        """The place of unknowns y (n,) with residuals ``rest`` (r,), with derivatives as at a place next to it."""
        root, by = self._root(float(rest @ rest)), at.J[:, self.number]
        along = np.empty_like(y)
        along[self.number] = self.valley[self.number]
        others, *_ = np.linalg.lstsq(at.J[:, self.others], -by, rcond=ROUND_OFF)
        along[self.others] = along[self.number] * others
        # χ² that is least over the others changes as with the others held
        slope = self.sign * along[self.number] * float(rest @ by) / (max(root, NEGLIGIBLE) * self.target**2)
        return _Place(d, root, slope, self.sign * (y - self.x), along)


@dataclass(frozen=True)
class _Place:
    """On a side of a profile: the way ``d``, the root there and its ``slope`` by d, unknowns' ``shift`` (n,) and its slope."""

    d: float
    root: float
    slope: float
    shift: Array
    along: Array

    @property
    def onward(self) -> float:
        """Where the root is 1 by Newton; inf where it falls."""
        return self.d + (1.0 - self.root) / self.slope if self.slope > 0.0 else np.inf
