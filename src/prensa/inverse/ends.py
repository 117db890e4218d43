"""Parameters whose best value lies at an end of their range: a bound, or zero or infinity, to which a logarithm runs away.

There is no ellipse around such a place. The others are fitted, and their intervals found, with these held at their ends; each of
these has an interval at one side, to where χ², made least over the others, has grown by the quantile of one side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from prensa.errors import PrensaError
from prensa.inverse.flow_laws import CONFIDENCE
from prensa.inverse.objective import IDLE, IDLE_STEP, Objective, Parameter, Residuals
from prensa.inverse.profile import CLOSE, MOST_PLACES
from prensa.precision import SMALLEST
from prensa.sensitivity.parameters import with_values
from prensa.types import Array


@dataclass(frozen=True)
class End:
    """Parameter ``number`` held at ``value`` next to the ``end`` of its range (0 and infinite ends too); ``lower``: which one.

    ``start``: where the fit began. ``limit``: other end of its interval, infinite where there is none.
    """

    number: int
    parameter: Parameter
    value: float
    end: float
    lower: bool
    limit: float = np.inf

    @property
    def words(self) -> str:
        """What there is to say of it."""
        where = f"at the end of its range, {self.end:g}" if np.isfinite(self.end) else "beyond all bounds"
        known = np.isfinite(self.limit) and self.limit > 0.0 if self.parameter.log else np.isfinite(self.limit)
        side = "below" if self.lower else "above"
        seen = f"{side} {self.limit:.4g} at {100 * CONFIDENCE:.0f} %" if known else "any value fits the readings equally well"
        return f"{self.parameter.path}: its best value lies {where}; {seen}. Values and intervals of the others hold for it"

    def near(self, way: float) -> float:
        """The parameter at a way from its end, counted in itself, or in its inverse where the end is infinite."""
        if not np.isfinite(self.end):
            return 1.0 / way
        return self.end + way if self.lower else self.end - way

    def rate(self, J: Array) -> Array:
        """Derivatives (r,) of residuals by that way, from those by what is varied."""
        by = J / self.parameter.slope(self.value)
        return -by * self.value**2 if not np.isfinite(self.end) else by if self.lower else -by


def ends_of(objective: Objective, x: Array, at: Residuals, first: Residuals | None) -> list[End]:
    """Parameters that the fit x (n,) has at an end of their range, or on the way to one; ``first``: residuals at the start."""
    k = len(objective.parameters)
    limits = np.array([p.limits for p in objective.parameters] + [(-np.inf, np.inf)] * (len(x) - k))
    ahead = lsq_linear(at.J, -at.r, (np.minimum(limits[:, 0] - x, -SMALLEST), np.maximum(limits[:, 1] - x, SMALLEST)))
    out = []
    for i, p in enumerate(objective.parameters):
        if ahead.active_mask[i]:
            lower = bool(ahead.active_mask[i] < 0)
            bound = p.bounds[0 if lower else 1]
            out.append(End(i, p, bound, bound, lower))
        elif p.log and (end := _run_away(objective, x, at, i, first)) is not None:
            out.append(end)
    return out


def _run_away(objective: Objective, x: Array, at: Residuals, i: int, first: Residuals | None) -> End | None:
    """The end that a logarithm without bound runs to: it moves nothing there; None if it stays where it is."""
    p, moves = objective.parameters[i], float(np.abs(at.J[:, i]).max())
    if first is None or float(np.abs(first.J[:, i]).max()) < IDLE:
        return None  # it never moved anything: nobody knows where it goes
    lower = bool(x[i] < p.inner(p.start))
    if not np.isinf(p.limits[0 if lower else 1]):
        return None
    if moves >= IDLE:
        # What a positive number does becomes as small as itself: where it would be nothing, is the fit as good?
        error = float(np.sqrt(np.linalg.pinv(at.J.T @ at.J)[i, i]))
        if not lower or error < 1.0:
            return None
        there = End(i, p, p.value(x[i] + float(np.log(0.5 * IDLE / moves))), 0.0, True)
        found = _fit_at([there], objective, x)
        worse = found is None or found[1].square > at.square + IDLE_STEP * max(1.0, at.square / max(len(at.r) - len(x), 1))
        return None if worse else there
    return End(i, p, p.value(x[i]), 0.0 if lower else np.inf, lower)


def without(objective: Objective, ends: Sequence[End]) -> Objective:
    """The objective of the other parameters, with these held at their values."""
    held = {e.parameter.path: e.value for e in ends}
    kept = [p for p in objective.parameters if p.path not in held]
    experiments = [e.on(with_values(e.problem, held)) for e in objective.experiments]
    return replace(objective, experiments=experiments, parameters=kept, _last=None)


def _fit_at(ends: Sequence[End], objective: Objective, x: Array) -> tuple[Array, Residuals] | None:
    """Unknowns of the others of least χ² with parameters held, and the residuals; None where there is no answer."""
    fixed = without(objective, ends)
    try:
        found = fixed.minimise(np.delete(x, [e.number for e in ends]))
    except PrensaError:
        return None
    finally:
        objective.runs = fixed.runs
    return found


def bounded(objective: Objective, ends: Sequence[End], x: Array, least: float, freedom: int) -> list[End]:
    """The ends with their intervals: unknowns x (n,) of the fit, whose χ² with all of them at their ends is ``least``."""
    from scipy.stats import t

    # Readings that scatter more than was said widen intervals; those that scatter less narrow nothing.
    target = float(t.ppf(CONFIDENCE, freedom)) * float(np.sqrt(max(least / freedom, 1.0)))
    out = []
    for e in ends:
        others = [o for o in ends if o is not e]
        objective.report(f"how far {e.parameter.path} may be from the end of its range")
        limit = _limit(e, others, objective, x, least, target)
        out.append(replace(e, limit=limit))
    return out


def _limit(e: End, others: Sequence[End], objective: Objective, x: Array, least: float, target: float) -> float:
    """Where least χ² has grown by the square of ``target``; infinite (or zero, of an infinite end) where it nowhere has."""
    way, start = _first_way(e, objective, x, target), x
    places = [(0.0, -1.0)]  # ways, and roots of Δχ² over the target, less one
    none = np.inf if np.isfinite(e.end) else 0.0
    for _ in range(MOST_PLACES):
        if not np.isfinite(way) or not way > 0.0:
            return none
        room = abs(e.parameter.bounds[1 if e.lower else 0] - e.end) if np.isfinite(e.end) else np.inf
        way = min(way, room)
        here = replace(e, value=e.near(way))
        objective.report(f"with {e.parameter.path} = {here.value:.5g}")
        found = _fit_at([here, *others], objective, start)
        if found is None:
            places.append((way, np.inf))
        else:
            places.append((way, float(np.sqrt(max(found[1].square - least, 0.0))) / target - 1.0))
            start = np.insert(found[0], np.sort([o.number for o in (here, *others)]) - np.arange(1 + len(others)), 0.0)
            for o in (here, *others):
                start[o.number] = o.parameter.inner(o.value)
        if abs(places[-1][1]) < CLOSE:
            return here.value
        if way == room and places[-1][1] < 0.0:
            return here.value  # all of its range
        way = _next_way(places)
    return here.value if abs(places[-1][1]) < 1.0 else none


def _first_way(e: End, objective: Objective, x: Array, target: float) -> float:
    """Way at which the linearised problem has least χ² grown by the square of ``target``."""
    y = x.copy()
    y[e.number] = e.parameter.inner(e.value) if e.value > 0.0 or not e.parameter.log else x[e.number]
    at = objective.at(y)
    if at is None:
        return np.inf
    basis, _ = np.linalg.qr(np.delete(at.J, e.number, axis=1))
    by = e.rate(at.J[:, e.number])
    by = by - basis @ (basis.T @ by)
    square, slope = float(by @ by), max(float(by @ at.r), 0.0)
    # 2 (by·r) z + by² z² = target²
    return (float(np.sqrt(slope**2 + square * target**2)) - slope) / square if square > 0.0 else np.inf


def _next_way(places: Sequence[tuple[float, float]]) -> float:
    """The next way by regula falsi between the nearest places on both sides, or as far again as the roots have grown."""
    inside = max(((w, r) for w, r in places if r < 0.0), key=lambda p: p[0])
    outside = min(((w, r) for w, r in places if r >= 0.0), key=lambda p: p[0], default=None)
    if outside is None:
        last = inside[0]
        return last * min(max(1.0 / (1.0 + inside[1]), 1.1), 4.0) if inside[1] > -1.0 else 4.0 * last
    if not np.isfinite(outside[1]):
        return 0.5 * (inside[0] + outside[0])
    return inside[0] - inside[1] * (outside[0] - inside[0]) / (outside[1] - inside[1])
