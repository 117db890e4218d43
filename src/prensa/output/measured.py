"""``measures.csv``: the measures that a case names, one row an increment, and their values at the ends of the steps."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.errors import take_path
from prensa.measures import MeasureError, parse_all
from prensa.model.problem import Problem
from prensa.output.history import Table, read_table
from prensa.result.increment import Increment

log = logging.getLogger("prensa")

MEASURES = "measures.csv"


class MeasureTable:
    """Writer of ``measures.csv`` in *directory*; *keep* as in `prensa.output.history.History`.

    A measure that has no value in an increment, because a place is not on the outline or a contact is open, is not a number
    there; at the end it is said of those that had none in any. Extremes over the run are those of all increments so far.

    Raises
    ------
    MeasureError
        For measures of the case that do not exist.

    """

    def __init__(self, directory: Path, problem: Problem, keep: int | None = None) -> None:
        self._measures = parse_all(problem)
        self._reasons: dict[str, str] = {}
        self._had: set[str] = set()
        path = directory / MEASURES
        keep = keep if path.is_file() else None
        self._extremes: dict[str, float] = {}
        if keep:
            before = read_table(path)
            over = [name for name, measure in self._measures.items() if measure.over_run]
            self._extremes = {name: float(before[name][keep - 1]) for name in over if math.isfinite(before[name][keep - 1])}
        self._table = Table(path, ["step", "increment", "time", *self._measures], keep) if self._measures else None

    def append(self, increment: Increment) -> None:
        """Write the row of *increment* and push it to the operating system."""
        if self._table is not None:
            values = [self._value(name, increment) for name in self._measures]
            self._table.append([increment.step, increment.number, increment.time, *values])

    def _value(self, name: str, increment: Increment) -> float:
        try:
            value = self._measures[name].value(increment)
        except MeasureError as error:
            self._reasons[name] = str(error)
            return self._extremes.get(name, math.nan)
        self._had.add(name)
        if how := self._measures[name].over_run:
            value = {"max": max, "min": min}[how](value, self._extremes.get(name, value))
            self._extremes[name] = value
        return value

    def close(self) -> None:
        """Close the file, and report measures that never had a value."""
        if self._table is not None:
            self._table.close()
        for name, reason in self._reasons.items():
            if name not in self._had:
                log.warning("measures.%s had no value in this run: %s", name, reason.removeprefix(f"{name}: "))


def read_measures(directory: str | Path) -> dict[str, NDArray[Any]]:
    """Columns of ``measures.csv`` by name; not a number where a measure has no value.

    Raises
    ------
    PrensaError
        If there is no such file in *directory*: the case names no measures.

    """
    return read_table(take_path("read_measures", directory) / MEASURES)


def measured(directory: Path, problem: Problem) -> dict[str, Any]:
    """By name: what was measured, its unit, its last value, and that at the end of each step (None where it has none)."""
    if not (directory / MEASURES).is_file():
        return {}
    table, known = read_measures(directory), parse_all(problem)
    ends = {str(s): int(np.flatnonzero(table["step"] == s)[-1]) for s in dict.fromkeys(table["step"].tolist())}
    return {
        name: {
            "measure": problem.measures[name],
            "unit": measure.unit,
            "last": _number(table[name][-1]) if len(table[name]) else None,
            "steps": {step: _number(table[name][k]) for step, k in ends.items()},
        }
        for name, measure in known.items()
    }


def _number(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None
