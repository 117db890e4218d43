"""Effects of the quantities that are varied on a measure: the content of a tornado chart."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from prensa.study.plan import Plan
from prensa.study.results import Row
from prensa.study.values import Factor, Scatter, Values, value_of
from prensa.types import Array

SHARES = (0.05, 0.95)  # of a scattered quantity, between which its effect is given


class Effect(NamedTuple):
    """Means of a measure with the quantity *path* at one end of its values and at the other (as texts), over all the rest."""

    path: str
    low: str
    high: str
    at_low: float
    at_high: float

    @property
    def swing(self) -> float:
        """Change of the measure from the low end to the high one, without its sign."""
        return abs(self.at_high - self.at_low)


def effects(plan: Plan, rows: list[Row], measure: str) -> list[Effect]:
    """Effects on a measure of everything that takes more than one value, the largest first.

    Of given values: the means over all cases at the smallest and at the largest (of words: at those with the smallest and the
    largest mean). Of what scatters: the slopes of a linear regression (least squares), from the 5 % to the 95 % quantile.
    """
    done = [row for row in rows if not math.isnan(row.value(measure))]
    y = np.array([row.value(measure) for row in done], dtype=float)
    found = [e for f in plan.varied if (e := _of_values(f, done, y)) is not None]
    if plan.scattered and len(done) > len(plan.scattered) + 1:
        found += _of_scatter(plan.scattered, done, y)
    return sorted(found, key=lambda e: -e.swing)


def numbers(rows: list[Row], factor: Factor) -> Array | None:
    """Values of a factor in each row; None where they are not all numbers, or all the same."""
    found = [value_of(factor, row.point.values[factor.path]) for row in rows]
    if any(isinstance(v, str) for v in found) or len(set(found)) < 2:
        return None
    return np.array(found, dtype=float)


def _of_values(factor: Values, rows: list[Row], y: Array) -> Effect | None:
    given = np.array([row.point.values[factor.path] for row in rows])
    means = {text: float(y[given == text].mean()) for text in dict.fromkeys(given.tolist())}
    if len(means) < 2:
        return None
    x = numbers(rows, factor)
    if x is not None:
        low, high = str(given[x.argmin()]), str(given[x.argmax()])
    else:
        low, high = min(means, key=lambda t: means[t]), max(means, key=lambda t: means[t])
    return Effect(factor.path, low, high, means[low], means[high])


def _of_scatter(laws: list[Scatter], rows: list[Row], y: Array) -> list[Effect]:
    columns = [(law, x) for law in laws if (x := numbers(rows, law)) is not None]
    if not columns:
        return []
    # All scattered quantities vary at once, so that their effects are slopes of one linear regression, not differences of
    # cases.
    matrix = np.column_stack([np.ones(len(y)), *(x - x.mean() for _, x in columns)])
    slopes = np.linalg.lstsq(matrix, y, rcond=None)[0][1:]
    found = []
    for (law, x), slope in zip(columns, slopes):
        low, high = law.at(np.array(SHARES))
        ends = [float(value_of(law, t)) for t in (low, high)]
        values = [float(y.mean() + slope * (end - x.mean())) for end in ends]
        found.append(Effect(law.path, low, high, *values))
    return found
