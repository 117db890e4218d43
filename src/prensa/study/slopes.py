"""Derivatives of what a study measures, by numbers that it varies, from one more solution of a case."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.measures import parse
from prensa.measures.measure import Measure, MeasureError
from prensa.model.problem import Case, Problem
from prensa.output.runlog import silenced
from prensa.result.increment import Increment
from prensa.sensitivity.parameters import value_of
from prensa.study.quantities import Quantity

Slopes = dict[str, dict[str, float]]
"""Derivatives by the text of a quantity and the path of a parameter, per unit of it in the units of the case."""


class Noted(NamedTuple):
    """A measure in an increment, and its derivatives by path."""

    step: str
    time: float
    value: float
    slopes: Mapping[str, float]


def varied_numbers(problem: Problem, paths: Iterable[str]) -> tuple[list[str], str]:
    """Those of the paths that lead to numbers with derivatives, and why the first of the others does not."""
    found, reason = [], ""
    for path in paths:
        try:
            value_of(problem, path)
        except PrensaError as error:
            reason = reason or str(error).removeprefix("derivatives: ")
        else:
            found.append(path)
    return found, reason


def slopes_of(case: Case, wanted: Sequence[Quantity], paths: Sequence[str]) -> tuple[Slopes, dict[str, str]]:
    """Derivatives of quantities by parameters, and why those of others are not known, by their texts.

    Those of a largest value are those of the increment that has it: at a maximum it makes no difference when that is.

    Raises
    ------
    PrensaError
        If the case has no derivatives: see `prensa.sensitivity.solve.refuse`.

    """
    from prensa.sensitivity.solve import solve

    slopes: Slopes = {}
    reasons: dict[str, str] = {}
    measures = {q.text: parse(q.name, case.problem) for q in wanted}
    series: dict[str, list[Noted]] = {q.text: [] for q in wanted}
    with silenced():  # the run has reported what they warn of
        for increment in solve(case.problem, case.numerics, derivatives=list(paths)):
            _note(increment, wanted, measures, series, reasons)
    for q in wanted:
        if series[q.text] and q.text not in reasons:
            slopes[q.text] = {path: _slope(q, series[q.text], path) for path in paths}
    return slopes, reasons


def _note(
    increment: Increment, wanted: Sequence[Quantity], measures: Mapping[str, Measure], series: Mapping[str, list[Noted]],
    reasons: dict[str, str],
) -> None:  # fmt: skip
    """Put values and derivatives of an increment into the series, and into the reasons why there are none."""
    for q in wanted:
        ends = increment.end_of_step or q.how in ("max", "min", "at")  # the others have no part in it
        if q.text in reasons or not ends:
            continue
        try:
            value, slope = measures[q.text].value(increment), increment.derivative(measures[q.text])
        except MeasureError:  # no value in this increment
            continue
        except PrensaError as error:
            reasons[q.text] = str(error)
        else:
            series[q.text].append(Noted(increment.step, increment.time, value, slope))


def _slope(q: Quantity, series: Sequence[Noted], path: str) -> float:
    """The derivative of a quantity by a parameter."""
    values, slopes = np.array([n.value for n in series]), np.array([n.slopes[path] for n in series])
    if q.how in ("max", "min"):
        return float(slopes[{"max": np.argmax, "min": np.argmin}[q.how](values)])
    if q.how == "at":
        times = np.array([n.time for n in series])
        return float(np.interp(float(q.argument), np.append(0.0, times), np.append(0.0, slopes)))
    kept = [s for n, s in zip(series, slopes) if q.how != "end" or n.step == q.argument]
    return float(kept[-1]) if kept else math.nan
