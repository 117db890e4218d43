"""A test: a case, the table that was measured, and which measures of the case its columns are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prensa.fem.discretise import discretise
from prensa.fem.planning import plan_step
from prensa.fem.system import System
from prensa.inverse.tables import DataError, Table, read_table
from prensa.measures import Measure, parse
from prensa.model.problem import Case, Problem
from prensa.model.units import factor, powers
from prensa.sensitivity.parameters import with_values
from prensa.sensitivity.solve import solve

Array = NDArray[np.float64]

MOTIONS = ("ux", "uy", "rz")
STEADY = 1e-9  # time, of steps of length 1, below which nothing has happened


@dataclass(frozen=True)
class Observe:
    """What a column of a table is: the ``measure`` of the case, and its error.

    ``sigma``: standard error of a reading, a number in the unit of the column or a share of the largest reading as in '1 %'.
    ``scale``: readings over the measure, such as 2 for the force of a whole specimen of which half is modelled.
    ``gain``: standard error of a factor common to all readings (a load cell), a share such as '1 %'; None: it is right.
    """

    measure: str
    sigma: float | str = "1 %"
    scale: float = 1.0
    gain: float | str | None = None


@dataclass(frozen=True)
class Test:
    """A test: its ``case``, its table ``data`` (a file), what it ``observe``s by column.

    ``along``: what the ``column`` (the first one if None) runs along: 'time', or a motion of a tool that the case prescribes, as
    in 'die.uy' or '-die.uy'. ``offset``: standard error of its zero, in the unit of the column.
    """

    case: Case | Problem
    data: str | Path | Table
    observe: Mapping[str, Observe | str]
    along: str = "time"
    column: str | None = None
    offset: float = 0.0
    name: str = ""


@dataclass(frozen=True)
class Channel:
    """A column as the fit sees it: ``rows`` (m,) with a reading, ``readings`` and ``sigma`` in units of the case."""

    name: str
    measure: Measure
    scale: float
    rows: NDArray[np.int64]
    readings: Array
    sigma: float
    gain: float


@dataclass(frozen=True)
class Prediction:
    """A run at some values: by channel, values (m,) and their derivatives (m, k) by the parameters."""

    values: list[Array]
    slopes: list[Array]


@dataclass(frozen=True)
class Experiment:
    """A test made ready: its problem, the ``times`` (rows,) of its rows, its channels."""

    name: str
    problem: Problem
    stroke: Array
    times: Array
    channels: list[Channel]
    offset: float
    along: str = "time"
    notes: list[str] = field(default_factory=list)

    @property
    def count(self) -> int:
        """Readings."""
        return sum(len(c.rows) for c in self.channels)

    def on(self, problem: Problem) -> Experiment:
        """The same on another mesh of the case."""
        return replace(self, problem=problem)

    def predict(self, values: Mapping[str, float], paths: Sequence[str]) -> Prediction:
        """What the case says at values of the parameters, with the derivatives by some of them.

        Raises
        ------
        PrensaError
            If the run fails, or something that was measured does not exist in it.

        """
        problem = with_values(self.problem, values)
        wanted = np.unique(np.concatenate([self.times[c.rows] for c in self.channels]))
        found: dict[float, tuple[list[float], list[list[float]]]] = {}
        for increment in solve(problem, stops=wanted.tolist(), derivatives=paths):
            k = int(np.argmin(np.abs(wanted - increment.time)))
            if abs(wanted[k] - increment.time) <= STEADY:
                slopes = [increment.derivative(c.measure) if paths else {} for c in self.channels]
                found[float(wanted[k])] = (
                    [c.measure.value(increment) for c in self.channels],
                    [[by[p] for p in paths] for by in slopes],
                )
            if increment.time >= wanted[-1] - STEADY:
                break
        y, J = [], []
        for k, c in enumerate(self.channels):
            rows = [found[float(t)] for t in self.times[c.rows]]
            y.append(c.scale * np.array([r[0][k] for r in rows]))
            J.append(c.scale * np.array([r[1][k] for r in rows]).reshape(len(rows), len(paths)))
        return Prediction(y, J)


def ready(test: Test, number: int) -> Experiment:
    """Read and check a test.

    Raises
    ------
    PrensaError
        Saying what is wrong with the table, in a line.

    """
    problem = test.case.problem if isinstance(test.case, Case) else test.case
    table = test.data if isinstance(test.data, Table) else read_table(test.data)
    column = test.column or next(iter(table.columns))
    given = table.column(column)
    if not np.isfinite(given).all():
        raise DataError(f"{table.path}: column {column!r} has empty cells; every row needs it")
    sign, along = (-1.0, test.along[1:]) if test.along.startswith("-") else (1.0, test.along)
    stroke, unit = given, ""
    if along != "time":
        _refuse_no_motion(problem, along)
        unit = parse(along, problem).unit
        stroke = sign * given * _factor(table, column, unit, problem)
    times = _times(problem, table, column, along, stroke)
    notes = []
    if (times <= STEADY).any():
        notes.append(f"{table.path}: rows at the beginning, where nothing has happened yet, are left out")
    channels = [_channel(problem, table, name, what, times) for name, what in test.observe.items()]
    offset = abs(test.offset) * (_factor(table, column, unit, problem) if along != "time" else 1.0)
    return Experiment(
        test.name or Path(table.path).stem or f"test {number}",
        problem,
        stroke,
        times,
        channels,
        offset,
        test.along,
        notes,
    )


def _factor(table: Table, column: str, unit: str, problem: Problem) -> float:
    """Readings of a column in units of the case over those of the table."""
    given = table.units[column]
    if not given:
        return 1.0
    try:
        return float(factor(f"1 {given}", problem.units.length, problem.units.force, powers(unit)))
    except ValueError as error:
        raise DataError(
            f"{table.path}: column {column!r} is in {given!r}, but {unit or 'a plain number'} is measured ({error})"
        ) from None


def share(value: float | str, of: float, what: str) -> float:
    """A standard error: a number, or a share of something as in '1 %'."""
    if isinstance(value, str):
        text = value.strip()
        try:
            out = float(text[:-1]) / 100.0 * of if text.endswith("%") else float(text)
        except ValueError:
            raise DataError(f"{what} is {value!r}; write a number or a share such as '1 %'") from None
    else:
        out = float(value)
    if not (np.isfinite(out) and out > 0.0):
        raise DataError(f"{what} is {value!r}; it has to be greater than 0")
    return out


def _channel(problem: Problem, table: Table, name: str, what: Observe | str, times: Array) -> Channel:
    of = what if isinstance(what, Observe) else Observe(what)
    given = table.column(name)
    measure = parse(of.measure, problem)
    rows = np.flatnonzero(np.isfinite(given) & (times > STEADY))
    if not len(rows):
        raise DataError(f"{table.path}: column {name!r} has no readings after the beginning")
    by = _factor(table, name, measure.unit, problem)
    largest = float(np.abs(given[rows]).max())
    sigma = by * share(of.sigma, largest, f"the error of {name!r}")
    gain = 0.0 if of.gain is None else share(of.gain, 1.0, f"the gain of {name!r}")
    return Channel(name, measure, of.scale, rows, by * given[rows], sigma, gain)


def _times(problem: Problem, table: Table, column: str, along: str, stroke: Array) -> Array:
    """Times (rows,) at which a prescribed motion reaches the strokes for the first time."""
    end = float(len(problem.steps))
    if along == "time":
        outside = np.flatnonzero((stroke < 0.0) | (stroke > end))
        if len(outside):
            raise DataError(
                f"{table.path}: {column} is {stroke[outside[0]]:g}, but the steps of the case take the time from 0 to {end:g}"
            )
        return stroke
    t, way = _course(discretise(problem), along)
    out = []
    for s in stroke:
        between = np.flatnonzero((way[:-1] - s) * (way[1:] - s) <= 0.0)
        if not len(between):
            raise DataError(
                f"{table.path}: {column} reaches {s:g} in units of the case, {along} goes from {way.min():g} to {way.max():g}; "
                "let the case press further, mind the sign (along='-…'), or leave these rows out"
            )
        k = between[0]
        rise = way[k + 1] - way[k]
        out.append(t[k] + (t[k + 1] - t[k]) * ((s - way[k]) / rise if rise else 0.0))
    return np.array(out)


def _refuse_no_motion(problem: Problem, along: str) -> None:
    tool, _, key = along.rpartition(".")
    if tool not in problem.tools or key not in MOTIONS:
        raise DataError(
            f"tables run along the time or a motion of a tool, as in 'die.uy' or '-die.uy'; {along!r} is none"
        )


def _course(system: System, along: str) -> tuple[Array, Array]:
    """Times and values of a motion that all steps prescribe, such as ``die.uy``."""
    tool, _, key = along.rpartition(".")
    names = [t.name for t in system.tools]
    dof = system.tool_dof(names.index(tool)) + MOTIONS.index(key)
    u, times, way = np.zeros(system.ndof), [], []
    for number in range(len(system.problem.steps)):
        plan = plan_step(system, number, u)
        at = np.flatnonzero(plan.fixed == dof)
        if not len(at):
            raise DataError(f"step {plan.name!r} does not prescribe {along!r}; let the table run along the time")
        t = np.unique(np.concatenate([np.linspace(plan.t0, plan.t1, 257), plan.corners()]))
        times.append(t)
        way.append(np.array([plan.values(x)[at[0]] for x in t]))
        u = u.copy()
        u[plan.fixed] = plan.values(plan.t1)
    return np.concatenate(times), np.concatenate(way)
