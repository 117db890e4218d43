"""A test: a case, the table that was measured, and which measures of the case its columns are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise, product
from pathlib import Path

import numpy as np

from prensa.errors import ArgumentError, shown, take
from prensa.inverse.tables import DataError, Table, read_table
from prensa.measures import Measure, parse
from prensa.model.names import suggest
from prensa.model.problem import Case, Numerics, Problem
from prensa.model.units import factor, powers
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.sensitivity.parameters import with_values
from prensa.sensitivity.solve import solve
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step
from prensa.system.system import System
from prensa.types import Array, Index

MOTIONS = ("ux", "uy", "rz")
FALL_BACK = 0.02  # share of the stroke by which rows may fall back: the noise of a travel, no unloading
MOST_READINGS = 100  # rows of a fit, each an increment of every run; more of a machine's record are hardly independent readings
EACH = "of reading"
OFF = 100.0  # ratio of readings and case from which one of the units is wrong
CLOCKS = ("t", "time", "sec", "seconds", "zeit")  # names of columns that run along the time, in small letters


@dataclass(frozen=True)
class Observe:
    """What a column of a table is: the ``measure`` of the case, and its error.

    ``sigma``: standard error of a reading: a number in the unit of the column, a share of the largest reading as in '1 %', or a
    share of each reading as in '1 % of reading', which is how load cells are classed.
    ``scale``, ``shift``: a reading is scale × measure + shift, such as 2 for the force of a whole specimen of which half is
    modelled; the shift in the unit of the column.
    ``gain``: standard error of a factor common to all readings (a load cell), a share such as '1 %'; None: it is right.
    """

    measure: str
    sigma: float | str = "1 %"
    scale: float = 1.0
    gain: float | str | None = None
    shift: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no measure and no number."""
        take("Observe", "measure", self.measure, str, "name what is measured, such as 'die.force.y'")
        for name in ("scale", "shift"):
            number(f"Observe: {name}", getattr(self, name))
        if not self.scale:
            raise ArgumentError("Observe: scale is 0; it is the ratio of the readings to the measure, such as 2")


@dataclass(frozen=True)
class Test:
    """A test: its ``case``, its table ``data`` (a file), what it ``observe``s by column.

    ``along``: what the ``column`` (the first one if None) runs along: 'time', or a motion that the case prescribes, of a tool or
    of a support, as in 'die.uy', '-die.uy' or 'bar.top.uy'. ``scale``: the column over that motion, such as 2 where half the
    specimen is modelled. ``offset``: standard error of its zero, in the unit of the column.
    """

    case: Case | Problem
    data: str | Path | Table
    observe: Mapping[str, Observe | str]
    along: str = "time"
    column: str | None = None
    offset: float = 0.0
    name: str = ""
    scale: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what is no case, no measures and no number."""
        take("Test", "case", self.case, (Case, Problem), "give a Problem or a Case")
        take("Test", "data", self.data, (str, Path, Table), "give the path of a table (CSV) or a Table")
        take("Test", "observe", self.observe, Mapping, "give measures by column, as in {'force': 'die.force.y'}")
        take("Test", "along", self.along, str, "give 'time' or a motion such as '-die.uy'")
        if not self.observe:
            raise ArgumentError("Test: nothing is observed; give measures by column, as in {'force': 'die.force.y'}")
        for what in self.observe.values():
            take("Test", "an observation", what, (str, Observe), "give a measure such as 'die.force.y', or an Observe")
        for name in ("offset", "scale"):
            number(f"Test: {name}", getattr(self, name))
        if not self.scale:
            raise ArgumentError("Test: scale is 0; it is the ratio of the column to the motion, such as 2")


def number(what: str, value: object) -> float:
    """A finite number, else `ArgumentError`."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not np.isfinite(value):
        raise ArgumentError(f"{what} is {shown(value)}; a number is expected")
    return float(value)


@dataclass(frozen=True)
class Channel:
    """A column as the fit sees it: ``rows`` (m,) with ``readings`` (m,), ``sigma`` (m,) and ``shift`` in units of the case."""

    name: str
    measure: Measure
    scale: float
    rows: Index
    readings: Array
    sigma: Array
    gain: float
    shift: float = 0.0


@dataclass(frozen=True)
class Prediction:
    """A run at some values: by channel, values (m,), derivatives (m, k) by the parameters, and ``rates`` (m,) over the stroke."""

    values: list[Array]
    slopes: list[Array]
    rates: list[Array]


@dataclass(frozen=True)
class Experiment:
    """A test made ready: its problem, the ``times`` (rows,) of its rows and their ``pace``, time over stroke, its channels."""

    name: str
    problem: Problem
    stroke: Array
    times: Array
    pace: Array
    channels: list[Channel]
    offset: float
    along: str = "time"
    notes: list[str] = field(default_factory=list)
    numerics: Numerics = field(default_factory=Numerics)

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
        times, ways, found = [], [], {}
        for increment in solve(problem, self.numerics, stops=wanted.tolist(), derivatives=paths):
            times.append(increment.time)
            ways.append([c.measure.value(increment) for c in self.channels])
            # Runs choose increments of their own between the rows: only those that end at a row are read.
            k = int(np.argmin(np.abs(wanted - increment.time)))
            if abs(wanted[k] - increment.time) <= NEGLIGIBLE:
                slopes = [increment.derivative(c.measure) if paths else {} for c in self.channels]
                found[float(wanted[k])] = len(ways) - 1, [[by[p] for p in paths] for by in slopes]
            if increment.time >= wanted[-1] - NEGLIGIBLE:
                break
        course = np.array(ways)
        rates = over_stroke(course, np.array(times))
        y, J, v = [], [], []
        for j, c in enumerate(self.channels):
            rows = [found[float(t)] for t in self.times[c.rows]]
            at = [r[0] for r in rows]
            y.append(c.scale * course[at, j] + c.shift)
            J.append(c.scale * np.array([r[1][j] for r in rows]).reshape(len(rows), len(paths)))
            v.append(c.scale * rates[at, j] * self.pace[c.rows])
        return Prediction(y, J, v)


def over_stroke(values: Array, stroke: Array) -> Array:
    """Change of values (m, k) over a stroke (m,) that may stand still."""
    # Differences are divided by those of the places, which are zero where the motion stands still.
    places, first, back = np.unique(stroke, return_index=True, return_inverse=True)
    if len(places) < 2:
        return np.zeros_like(values)
    return np.asarray(np.gradient(values[first], places, axis=0)[back])


def ready(test: Test, which: int) -> Experiment:
    """Read and check a test.

    Raises
    ------
    PrensaError
        Saying what is wrong with the table, in a line.

    """
    problem = test.case.problem if isinstance(test.case, Case) else test.case
    table = test.data if isinstance(test.data, Table) else read_table(test.data)
    column = test.column or next(iter(table.columns))
    given, notes = table.column(column), list(table.notes)
    if not np.isfinite(given).all():
        row = int(np.flatnonzero(~np.isfinite(given))[0])
        raise DataError(f"{table.place(row)}: column {column!r} has empty cells; every row needs it")
    _refuse_a_clock(test, table, column)
    sign, along = (-1.0, test.along[1:]) if test.along.startswith("-") else (1.0, test.along)
    stroke, by = given / test.scale, 1.0
    if along != "time":
        by = _factor(table, column, _motion(problem, along), problem, _others(test, table, column))
        stroke = sign * stroke * by
    seen = {name: table.column(name) for name in test.observe}
    times, pace = _times(problem, table, column, along, stroke, notes)
    if (times <= NEGLIGIBLE).any():
        notes.append(f"{table.path}: rows at the beginning, where nothing has happened yet, are left out")
    used = _rows_used(table, times, list(seen.values()), notes)
    channels = [_channel(problem, table, name, what, used) for name, what in test.observe.items()]
    offset = abs(test.offset * by / test.scale)
    name = test.name or Path(table.path).stem or f"test {which}"
    numerics = test.case.numerics if isinstance(test.case, Case) else Numerics()
    return Experiment(name, problem, stroke, times, pace, channels, offset, test.along, notes, numerics)


def _refuse_a_clock(test: Test, table: Table, column: str) -> None:
    """Refuse a first column of times that nobody named where the table runs along a motion; raises `DataError`."""
    if test.column is None and test.along != "time" and column.lower() in CLOCKS:
        raise DataError(
            f"{table.path}: its first column is {column!r}, and it is to run along "
            f"{test.along!r}{_others(test, table, column)}, or write 'along: time'"
        )


def _others(test: Test, table: Table, column: str) -> str:
    """The remedy where a first column that nobody named is not what a table runs along; '' if there is no other."""
    left = [name for name in table.columns if name != column and name not in test.observe]
    if test.column is not None or not left:
        return ""
    return f"; give 'column', which is the first one where it is left out: {' or '.join(f'column: {n}' for n in left[:3])}"


def _rows_used(table: Table, times: Array, columns: list[Array], notes: list[str]) -> Index:
    """Rows that are fitted: after the beginning, none twice, and not more than a run can stop at."""
    rows = np.flatnonzero(times > NEGLIGIBLE)
    cells = np.column_stack([times, *columns])
    same = np.array([k for k in rows[1:] if _equal(cells[k], cells[k - 1])], dtype=np.int64)
    if len(same):
        more = f" and {len(same) - 1} more" if len(same) > 1 else ""
        notes.append(f"{table.place(int(same[0]))}{more}: repeats the row above; it is counted once")
        rows = np.setdiff1d(rows, same)
    if len(rows) <= MOST_READINGS:
        return rows
    # of dense columns rows spread evenly over the test; readings that were taken now and then are all kept
    rare = [k for c in columns if 0 < np.isfinite(c[rows]).sum() <= MOST_READINGS for k in rows[np.isfinite(c[rows])]]
    wanted = np.linspace(times[rows[0]], times[rows[-1]], MOST_READINGS)
    near = rows[np.abs(times[rows][None, :] - wanted[:, None]).argmin(axis=1)]
    notes.append(
        f"{table.path}: of {len(rows)} rows {MOST_READINGS} are fitted, spread evenly over the test: each is an increment, "
        "and neighbouring rows of a machine's record are hardly independent"
    )
    return np.union1d(near, np.array(rare, dtype=np.int64))


def _equal(a: Array, b: Array) -> bool:
    return bool(((a == b) | (np.isnan(a) & np.isnan(b))).all())


def _factor(table: Table, column: str, unit: str, problem: Problem, remedy: str = "") -> float:
    """Readings of a column in units of the case over those of the table; ``remedy`` ends the message if there is no such."""
    given = table.units[column]
    if not given:
        return 1.0
    try:
        return float(factor(f"1 {given}", problem.units.length, problem.units.force, powers(unit)))
    except ValueError as error:
        raise DataError(
            f"{table.path}: column {column!r} is in {given!r}, but {unit or 'a plain number'} is measured ({error}){remedy}"
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


def errors(sigma: float | str, readings: Array, what: str) -> Array:
    """Standard errors (m,) of readings (m,); raises `DataError`."""
    each = sigma.strip().removesuffix(EACH).rstrip() if isinstance(sigma, str) and sigma.strip().endswith(EACH) else None
    if each is None:
        return np.full(len(readings), share(sigma, float(np.abs(readings).max()), what))
    out = np.abs(readings) * share(each, 1.0, what)
    if not (out > 0.0).all():
        raise DataError(f"{what} is {sigma!r}, but a reading is 0, which would be exact; give a number or a share of the largest")
    return out


def _channel(problem: Problem, table: Table, name: str, what: Observe | str, used: Index) -> Channel:
    of = what if isinstance(what, Observe) else Observe(what)
    given = table.column(name)
    measure = parse(of.measure, problem)
    rows = used[np.isfinite(given[used])]
    if not len(rows):
        raise DataError(f"{table.path}: column {name!r} has no readings after the beginning")
    by = _factor(table, name, measure.unit, problem)
    sigma = by * errors(of.sigma, given[rows], f"the error of {name!r}")
    gain = 0.0 if of.gain is None else share(of.gain, 1.0, f"the gain of {name!r}")
    return Channel(name, measure, of.scale, rows, by * given[rows], sigma, gain, by * of.shift)


def refuse_vague(e: Experiment) -> None:
    """Refuse readings that are not known better than nothing at all; raises `DataError`."""
    for c in e.channels:
        least, most = float(c.sigma.min()), float(np.abs(c.readings).max())
        if least >= most:
            raise DataError(
                f"{e.name}: the error of {c.name!r} is {least:g} in units of the case, not less than its largest reading, "
                f"{most:g}: such readings are uninformative; write it in the unit of the column, or as a share such as '1 %'"
            )


def refuse_twice(experiments: Sequence[Experiment]) -> None:
    """Refuse tests that have the same readings, which would count twice and narrow every interval; raises `DataError`."""
    for (i, a), (j, b) in combinations(enumerate(experiments, 1), 2):
        for c, d in product(a.channels, b.channels):
            alike = c.name == d.name and len(c.rows) > 1 and np.array_equal(c.readings, d.readings)
            if alike and np.array_equal(a.stroke[c.rows], b.stroke[d.rows]):
                raise DataError(
                    f"tests {i} ({a.name}) and {j} ({b.name}) have the same readings of {c.name!r}, which would count twice: "
                    "give each its own 'data', or leave one out"
                )


def refuse_strange(e: Experiment, models: Sequence[Array]) -> None:
    """Refuse readings that a case with its first values misses by orders of magnitude or by their sign.

    Raises
    ------
    DataError
        Because a unit or a sign is wrong, and no parameter should be bent to it.

    """
    for c, model in zip(e.channels, models):
        read, says = (float(np.abs(v).max()) for v in (c.readings, model))
        # Readings within their noise have neither size nor sign that could be wrong.
        if not (read > 3.0 * float(c.sigma.max()) and says > 0.0):
            continue
        if not 1.0 / OFF <= read / says <= OFF:
            raise DataError(
                f"{e.name}: {c.name!r} is up to {read:.3g} in units of the case, which says {says:.3g} at the start; give "
                f"the unit in the first row of the table, as in '{c.name} [kN]', or start nearer"
            )
        alike = float(c.readings @ model) / float(np.linalg.norm(c.readings) * np.linalg.norm(model))
        if alike < -0.9:
            raise DataError(
                f"{e.name}: {c.name!r} has the opposite sign in the case; observe it with 'scale: -1'"
            )


def _times(
    problem: Problem, table: Table, column: str, along: str, stroke: Array, notes: list[str]
) -> tuple[Array, Array]:  # fmt: skip
    """Times (rows,) of the rows, where a prescribed motion reaches their strokes, one after the other; time over stroke there."""
    end = float(len(problem.steps))
    if along == "time":
        outside = np.flatnonzero((stroke < 0.0) | (stroke > end))
        if len(outside):
            raise DataError(
                f"{table.place(outside[0])}: {column} is {stroke[outside[0]]:g}, but the steps of the case take the time from "
                f"0 to {end:g}"
            )
        return _together(stroke), np.ones(len(stroke))
    t, way = _course(discretise(problem), along)
    reach = float(np.ptp(way)) or 1.0
    most = float(np.abs(stroke).max())
    if not table.units[column] and 0.0 < most < np.abs(way).max() / OFF:
        raise DataError(
            f"{table.path}: {column!r} has no unit and goes to {most:g} {problem.units.length} at most, {along} to "
            f"{np.abs(way).max():g}: give its unit in the first row, as in '{column} [m]' or '{column} "
            f"[{problem.units.length}]'"
        )
    out, now, back = np.zeros(len(stroke)), 0.0, 0.0
    for k, s in enumerate(stroke):
        found = _reached(t, way, s)
        if not len(found):
            raise DataError(
                f"{table.place(k)}: {column} reaches {s:g} in units of the case, {along} goes from {way.min():g} to "
                f"{way.max():g}; let the case press further, mind the sign (along: '-…') and the unit, or leave these rows out"
            )
        # A motion may pass a place several times: the row belongs to the first passage that is not before the last row.
        later = found[found >= now - DRAWN]
        if not len(later):
            # a little back is noise: the last time before now at which the motion was there
            behind = abs(float(np.interp(now, t, way)) - s)
            if behind > FALL_BACK * reach:
                raise DataError(
                    f"{table.place(k)}: {column} goes back by {behind:g} in units of the case, and {along} does not; "
                    "leave out the unloading and sort the rows, or let the case unload as well"
                )
            back = max(back, behind)
        out[k] = later[0] if len(later) else found[-1]
        now = max(now, out[k])
    if back > DRAWN * reach:
        notes.append(
            f"{table.path}: {column} goes back by up to {back:.2g} in places; rows are compared where the case has their "
            f"{column}"
        )
    rate = np.interp(out, 0.5 * (t[:-1] + t[1:]), np.diff(way) / np.where(np.diff(t) > 0.0, np.diff(t), np.inf))
    return _together(out), np.divide(1.0, rate, out=np.zeros(len(out)), where=rate != 0.0)


def _reached(t: Array, way: Array, s: float) -> Array:
    """Times at which a motion passes a place, in order."""
    between = np.flatnonzero((way[:-1] - s) * (way[1:] - s) <= 0.0)
    rise = way[between + 1] - way[between]
    share = np.divide(s - way[between], rise, out=np.zeros(len(between)), where=rise != 0.0)
    return np.unique(t[between] + (t[between + 1] - t[between]) * share)


def _together(times: Array) -> Array:
    """Times of which those that are all but the same, or all but the end of a step, are the same."""
    # Rows next to each other, or next to the end of a step, would ask for increments of next to nothing.
    order = np.argsort(times, kind="stable")
    ends = np.round(times)
    out = np.where(np.abs(times - ends) <= DRAWN, ends, times)
    for a, b in pairwise(order):
        if out[b] - out[a] <= DRAWN:
            out[b] = out[a]
    return out


def _motion(problem: Problem, along: str) -> str:
    """Unit of a motion that tables may run along; refuses what is none."""
    name, _, key = along.rpartition(".")
    boundaries = set(problem.fixed).union(*(step.fixed for step in problem.steps))
    if key not in MOTIONS or not (name in problem.tools or (name in boundaries and key != "rz")):
        known = [f"{t}.{m}" for t in problem.tools for m in MOTIONS]
        known += [f"{b}.{m}" for b in sorted(boundaries) for m in MOTIONS[:2]]
        raise DataError(
            f"tables run along the time or a motion of a tool or a support, as in 'die.uy' or '-die.uy'; {shown(along)} is none"
            f"{suggest(along, known)}"
        )
    return parse(along, problem).unit if name in problem.tools else problem.units.length


def _course(system: System, along: str) -> tuple[Array, Array]:
    """Times and values of a motion that all steps prescribe, such as ``die.uy``."""
    name, _, key = along.rpartition(".")
    names = [t.name for t in system.tools]
    if name in names:
        dof = system.tool_dof(names.index(name)) + MOTIONS.index(key)
    else:
        dofs = system.dofs.displacement.dof(system.boundary_nodes(name), key[1])
        dof = int(system.master_dofs(dofs)[-1])
    u, times, way = np.zeros(system.ndof), [], []
    for step in range(len(system.problem.steps)):
        plan = plan_step(system, step, u)
        at = np.flatnonzero(plan.fixed == dof)
        if not len(at):
            raise DataError(f"step {plan.name!r} does not prescribe {along!r}; let the table run along the time")
        t = np.unique(np.concatenate([np.linspace(plan.t0, plan.t1, 257), plan.corners()]))
        times.append(t)
        way.append(np.array([plan.values(x)[at[0]] for x in t]))
        u = u.copy()
        u[plan.fixed] = plan.values(plan.t1)
    return np.concatenate(times), np.concatenate(way)
