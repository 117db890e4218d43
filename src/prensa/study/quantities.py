"""Quantities of a study: a measure at the end of each run, its largest value, or its value at a moment.

=========================  ==================================================================
``punch.fy``               the value at the end of the run
``max(punch.fy)``          the largest of all increments; ``min(…)`` the smallest
``end(punch.fy, press)``   the value at the end of the step called ``press``
``at(punch.fy, 0.5)``      the value at time 0.5, linear between increments
=========================  ==================================================================

The measures are those of `prensa.measures`: ``punch.force.y``, ``billet.right.x at y=0``, columns of the history, and the names
that the case itself gives.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError, shown, take
from prensa.measures import OVER_RUN, parse
from prensa.measures.columns import columns
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.output.history import read_history
from prensa.output.measured import MEASURES, read_measures

_OF_THE_HISTORY = re.compile(r"(max|min|end|at)\s*\((.*)\)", re.DOTALL)
_FORMS = {"max": "max(measure)", "min": "min(measure)", "end": "end(measure, step)", "at": "at(measure, time)"}
_WITH_ARGUMENT = ("end", "at")


@dataclass(frozen=True)
class Quantity:
    """A number of a case: ``text`` as it was asked for, the measure ``name`` and its ``unit``, and how it is taken."""

    text: str
    name: str
    unit: str
    how: str = "last"
    argument: str = ""

    def of(self, series: Mapping[str, Any]) -> float:
        """Value from the columns ``step``, ``time`` and the measure's; not a number where the measure has none."""
        v, t = np.asarray(series[self.name], dtype=float), np.asarray(series["time"], dtype=float)
        if self.how == "end":
            v = v[np.asarray(series["step"]) == self.argument]
        if self.how == "at":
            moment = float(self.argument)
            v, t = (
                (v, t) if len(t) and t[0] <= moment else (np.append(0.0, v), np.append(0.0, t))
            )  # nothing acts at first
            return float(np.interp(moment, t, v)) if moment <= t[-1] else math.nan
        if not np.isfinite(v).any():
            return math.nan
        return float({"max": np.nanmax, "min": np.nanmin}.get(self.how, lambda v: v[-1])(v))


def quantities(asked: str | Iterable[str], problem: Problem) -> tuple[Quantity, ...]:
    """What is asked for, each once.

    Raises
    ------
    PrensaError
        If nothing is, or a measure does not exist.

    """
    take("measures", "measure", asked, Iterable, "give the name of a measure, such as 'punch.force.y', or a list of them")
    texts = [asked] if isinstance(asked, str) else list(asked)
    if not texts:
        tool = next(iter(problem.tools), "")
        such = f", such as {tool}.force.y or max({tool}.force.y)" if tool else ""
        raise PrensaError(f"no measure; say what to take from every case with --measure{such}")
    for text in texts:
        take("measures", "measure", text, str, "give names of measures, such as 'punch.force.y'")
    return tuple(dict.fromkeys(_quantity(text, problem) for text in texts))


def with_measures(problem: Problem, wanted: Iterable[Quantity]) -> Problem:
    """The problem with the measures that are wanted and that its history does not hold, which a run then writes."""
    more = dict(problem.measures)
    for name in dict.fromkeys(q.name for q in wanted):
        if name not in columns(problem) and name not in more.values():
            number = next(k for k in range(1, len(more) + 2) if f"measure_{k}" not in more)
            more[f"measure_{number}"] = name
    return replace(problem, measures=more).with_mirrored(problem.mirrored)


def series_of(folder: Path, names: Mapping[str, str]) -> dict[str, NDArray[Any]]:
    """Columns of the history and, by what they measure, of the table of measures; *names*: its columns, and what they are."""
    found = read_history(folder)
    if (folder / MEASURES).is_file():
        table = read_measures(folder)
        found |= {measure: table[name] for name, measure in names.items() if name in table}
    return found


def values_of(wanted: Iterable[Quantity], series: Mapping[str, Any]) -> dict[str, float | None]:
    """Values by text of what the tables hold; None where a measure has none."""
    found = {q.text: q.of(series) for q in wanted if q.name in series}
    return {text: None if math.isnan(v) else v for text, v in found.items()}


# --------------------------------------------------------------------------------------------------------------- details
def _quantity(text: Any, problem: Problem) -> Quantity:
    if not isinstance(text, str):
        raise PrensaError(f"a measure is {shown(text)}; give its name, such as 'punch.force.y'")
    text = " ".join(text.split())
    # A name of the case for an extreme over the run is that extreme.
    if OVER_RUN.fullmatch(own := " ".join(problem.measures.get(text, "").split())):
        return replace(_quantity(own, problem), text=text)
    match = _OF_THE_HISTORY.fullmatch(text)
    if match is None:
        return _of_measure(text, text, problem)
    how, inside = match[1], match[2].strip()
    name, comma, argument = (p.strip() for p in inside.rpartition(",")) if how in _WITH_ARGUMENT else (inside, ",", "")
    if not name or not comma or (how in _WITH_ARGUMENT and not argument):
        raise PrensaError(f"measure {text!r}: write {_FORMS[how]}")
    steps = [s.name for s in problem.steps]
    if how == "end" and argument not in steps:
        raise PrensaError(f"measure {text!r}: unknown step {argument!r}{suggest(argument, steps)}")
    if how == "at":
        _check_time(text, argument, len(steps))
    return replace(_of_measure(text, name, problem), how=how, argument=argument)


def _of_measure(text: str, name: str, problem: Problem) -> Quantity:
    """The measure under the name that says what it is, whatever the case calls it."""
    try:
        measure = parse(name, problem)
    except PrensaError as error:
        raise PrensaError(f"measure {text!r}: {error}") from None
    return Quantity(text, " ".join(problem.measures.get(name, name).split()), measure.unit)


def _check_time(text: str, argument: str, end: int) -> None:
    try:
        inside = 0.0 <= float(argument) <= end
    except ValueError:
        inside = False
    if not inside:
        raise PrensaError(f"measure {text!r}: {argument!r} is not a time between 0 and {end}, the end of the last step")
