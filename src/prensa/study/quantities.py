"""What is taken from each case of a study: a measure at the end of the run, its largest value, or its value at a moment.

=========================  ==================================================================
``punch.fy``               the value at the end of the run
``max(punch.fy)``          the largest of all increments; ``min(…)`` the smallest
``end(punch.fy, press)``   the value at the end of the step called ``press``
``at(punch.fy, 0.5)``      the value at time 0.5, linear between increments
=========================  ==================================================================

A measure is a column of ``history.csv``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from prensa.errors import PrensaError, shown
from prensa.model.checks import suggest
from prensa.model.problem import Problem
from prensa.output import style
from prensa.output.history import history_columns, read_history

_CALL = re.compile(r"(\w+)\s*\((.*)\)", re.DOTALL)
_TAKES = {"max": 1, "min": 1, "end": 2, "at": 2}


@dataclass(frozen=True)
class Quantity:
    """A number of a case: ``text`` as it was asked for, the measure ``name`` and its ``unit``, and how it is taken."""

    text: str
    name: str
    unit: str
    how: str = "last"
    argument: str = ""

    def of(self, series: Mapping[str, Any]) -> float:
        """Value from the columns of a history, or of a table of measures beside it; NaN without increments."""
        v, t = np.asarray(series[self.name], dtype=float), np.asarray(series["time"], dtype=float)
        if not len(v):
            return math.nan
        if self.how == "end":
            rows = np.flatnonzero(np.asarray(series["step"]) == self.argument)
            return float(v[rows[-1]]) if len(rows) else math.nan
        if self.how == "at":
            moment = float(self.argument)
            return float(np.interp(moment, np.append(0.0, t), np.append(0.0, v))) if moment <= t[-1] else math.nan
        return float({"max": v.max, "min": v.min}.get(self.how, lambda: v[-1])())


def quantities(asked: Iterable[str], problem: Problem) -> tuple[Quantity, ...]:
    """What is asked for, each once.

    Raises
    ------
    PrensaError
        If nothing is, or a name is unknown.

    """
    texts = [asked] if isinstance(asked, str) else list(asked)
    if not texts:
        known = ", ".join(_known(problem)[:6])
        raise PrensaError(f"no measure; say what to take from every case with --measure, such as {known}, max(…)")
    return tuple(dict.fromkeys(_quantity(text, problem) for text in texts))


def of_folder(wanted: Iterable[Quantity], folder: Path) -> dict[str, float]:
    """Values by text from the tables that a run has left."""
    series = read_history(folder)
    return {q.text: q.of(series) for q in wanted}


def in_table(wanted: Iterable[Quantity]) -> tuple[str, ...]:
    """Measures that the history does not hold, which are written beside it as the case is computed."""
    return ()


# --------------------------------------------------------------------------------------------------------------- details
def _known(problem: Problem) -> list[str]:
    return [c for c in history_columns(problem) if c not in ("step", "increment", "time")]


def _quantity(text: Any, problem: Problem) -> Quantity:
    if not isinstance(text, str):
        raise PrensaError(f"a measure is {shown(text)}; give its name, such as 'punch.fy'")
    text = text.strip()
    match = _CALL.fullmatch(text)
    if match is None:
        return Quantity(text, text, _unit(text, problem, text))
    how, arguments = (
        match[1],
        [a.strip() for a in match[2].rsplit(",", 1)] if match[1] in ("end", "at") else [match[2].strip()],
    )
    if how not in _TAKES:
        raise PrensaError(f"measure {text!r}: unknown {how!r}{suggest(how, _TAKES)}")
    if len(arguments) != _TAKES[how] or not all(arguments):
        forms = {"end": "end(measure, step)", "at": "at(measure, time)"}
        raise PrensaError(f"measure {text!r}: write {forms.get(how, f'{how}(measure)')}")
    name, argument = arguments[0], "".join(arguments[1:])
    steps = [s.name for s in problem.steps]
    if how == "end" and argument not in steps:
        raise PrensaError(f"measure {text!r}: unknown step {argument!r}{suggest(argument, steps)}")
    if how == "at":
        _check_time(text, argument, len(steps))
    return Quantity(text, name, _unit(name, problem, text), how, argument)


def _check_time(text: str, argument: str, end: int) -> None:
    try:
        inside = 0.0 <= float(argument) <= end
    except ValueError:
        inside = False
    if not inside:
        raise PrensaError(f"measure {text!r}: {argument!r} is no time between 0 and {end}, the end of the last step")


def _unit(name: str, problem: Problem, text: str) -> str:
    known = _known(problem)
    if name not in known:
        raise PrensaError(f"unknown measure {text!r}{suggest(name, known)}")
    last = name.rpartition(".")[2]
    if name.startswith("energy."):
        return style.energy_unit(problem)
    units = {
        "ux": style.length_unit, "uy": style.length_unit, "fx": style.force_unit, "fy": style.force_unit,
        "mz": style.moment_unit, "area": style.area_unit, "min": style.length_unit, "max": style.length_unit,
    }  # fmt: skip
    return units[last](problem) if last in units else "rad" if last == "rz" else ""
