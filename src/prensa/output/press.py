"""The presses of a run, from its tables: whether they are enough, what blows gave and what became of it, and pictures of that."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.measures.columns import directions
from prensa.measures.units import force_unit
from prensa.model.press import Use, works
from prensa.model.problem import Problem
from prensa.output import style
from prensa.precision import NEGLIGIBLE
from prensa.result.presses import use_of
from prensa.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Table = Mapping[str, NDArray[Any]]
STORED = ("elastic", "contact")
DISSIPATED = ("plastic", "friction")
CURVE_POINTS = 400  # of a capacity curve that is drawn


class Verdict(NamedTuple):
    """The moment at which a press is used most: ``utilisation`` of its ``limit`` (whole part), of a force or of an ``energy``.

    ``stroke`` of the press there; ``passed``: the stroke at which it was beyond its limit first, None if it never was;
    ``short``: the stroke at which its capacity curve ends, where the run went on beyond it, else None; ``by_torque``: whether the
    force is that which the torque of a crank allows.
    """

    tool: str
    of: str
    utilisation: float
    limit: float
    stroke: float
    step: str
    increment: int
    time: float
    passed: float | None
    short: float | None
    by_torque: bool


class Blow(NamedTuple):
    """What a tool ``gave`` in a step (of the whole part), and of that what was ``plastic`` and ``friction`` work, and ``stored``.

    ``efficiency``: the share that was dissipated in forming; ``missing``: what does not add up.
    """

    step: str
    tool: str
    gave: float
    plastic: float
    friction: float
    stored: float
    efficiency: float
    missing: float


class Course(NamedTuple):
    """A press over the rows of a table: its strokes, forces (whole part), capacities, and shares of energy, all (rows,)."""

    stroke: Array
    force: Array
    capacity: Array
    of_energy: Array


def course(table: Table, problem: Problem, use: Use) -> Course:
    """What a press did; the rows are those of the table."""
    number = _numbers(table, problem)
    ways, forces = ([table[f"{use.tool}.{kind}{axis}"] for axis in "xyz"[: directions(problem)]] for kind in "uf")
    stroke = np.array([use.stroke(*way) for way in zip(*ways)])
    force = np.array([use.force(*f) for f in zip(*forces)])
    most = np.array([use.capacity(*at) for at in zip(stroke, table["time"], number)])
    work = table.get(f"{use.tool}.work", np.zeros(len(stroke)))
    given = np.array([use.energy(n) for n in number])
    return Course(stroke, force, most, use.energies * work / given if len(given) else given)


def strokes(table: Table, problem: Problem, tool: str) -> Array:
    """Strokes (rows,) of the press of a tool."""
    use = use_of(problem, tool)
    assert use is not None
    return course(table, problem, use).stroke


def verdicts(table: Table, problem: Problem, of_force: bool = False) -> Iterator[Verdict]:
    """How far each press of a problem is used, at the moment at which that is most; ``of_force``: of its force alone."""
    for tool in problem.tools:
        use = use_of(problem, tool)
        used = table.get(f"{tool}.press_utilisation", np.zeros(0))
        if use is None or not np.isfinite(used).any():
            continue
        made = course(table, problem, use)
        if of_force:
            used = made.force / made.capacity
        k = int(np.nanargmax(used))
        energy = not of_force and bool(made.of_energy[k] > made.force[k] / made.capacity[k])
        limit = use.energy(int(_numbers(table, problem)[k])) if energy else float(made.capacity[k])
        curve = use.press.capacity
        end = curve[-1][0] if isinstance(curve, tuple) else np.inf
        short = end if made.stroke.max() > end * (1.0 + NEGLIGIBLE) else None
        yield Verdict(
            tool, "energy" if energy else "force", float(used[k]), limit, float(made.stroke[k]), str(table["step"][k]),
            int(table["increment"][k]), float(table["time"][k]), _passed(used, made.stroke), short,
            not energy and limit < use.press.force(float(made.stroke[k])),
        )  # fmt: skip


def blows(table: Table, problem: Problem) -> Iterator[Blow]:
    """The steps in which a tool whose work counts gave some, and what became of it."""
    for step in problem.steps:
        rows = np.flatnonzero(table["step"] == step.name)
        for tool in works(problem) if len(rows) else ():
            use = use_of(problem, tool)
            times, last, before = 1 if use is None else use.energies, int(rows[-1]), int(rows[0]) - 1
            gave = times * float(table[f"{tool}.work"][last])

            def grown(name: str, last: int = last, before: int = before, times: int = times) -> float:
                column = table[f"energy.{name}"]
                return times * float(column[last] - (column[before] if before >= 0 else 0.0))

            if not (step.until is not None and tool in (*step.until.energy, *step.until.press)) and not gave > 0.0:
                continue  # it went back
            plastic, friction = (grown(name) for name in DISSIPATED)
            stored = sum(grown(name) for name in STORED)
            share = (plastic + friction) / gave if gave > 0.0 else 0.0
            yield Blow(step.name, tool, gave, plastic, friction, stored, share, gave - plastic - friction - stored)


def _numbers(table: Table, problem: Problem) -> NDArray[Any]:
    """The step (from 0) of each row of a table."""
    known = {step.name: number for number, step in enumerate(problem.steps)}
    return np.array([known[str(name)] for name in table["step"]], dtype=np.int64)


def _passed(used: Array, stroke: Array) -> float | None:
    """The stroke at which a press passes its limit first, linear between increments; None if it does not."""
    beyond = np.flatnonzero(used > 1.0 + NEGLIGIBLE)
    if not len(beyond):
        return None
    k = int(beyond[0])
    u, s = (used[k - 1], stroke[k - 1]) if k else (0.0, 0.0)
    return float(s + (stroke[k] - s) * (1.0 - u) / (used[k] - u))


# -------------------------------------------------------------------------------------------------------------- picture
def picture(table: Table, problem: Problem, tool: str) -> Figure:
    """The force of a press over its stroke beside its capacity, and below which share of its limits that is."""
    from matplotlib.figure import Figure

    use = use_of(problem, tool)
    assert use is not None
    made, used = course(table, problem, use), 100.0 * table[f"{tool}.press_utilisation"]
    with style.styled():
        figure = Figure(figsize=(4.5, 4.6), layout="constrained")
        axes, below = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [2, 1]})
        few = "o" if len(used) <= 60 else ""
        axes.plot(np.append(0.0, made.stroke), np.append(0.0, made.force), few + "-", color=style.BLUE, markersize=2.5,
                  label=f"force on {tool}" + (", whole part" if use.forces > 1 else ""))  # fmt: skip
        if use.press.capacity is not None or use.press.torque is not None:
            _capacity_into(axes, table, problem, use, made)
        axes.set_ylabel(f"force ({force_unit(problem)})")
        axes.set_ylim(bottom=0.0)
        axes.legend()
        below.plot(np.append(0.0, made.stroke), np.append(0.0, used), few + "-", color=style.BLACK, markersize=2.5)
        below.axhline(100.0, color=style.RED, linewidth=1.0)
        below.set(xlabel=f"stroke of the press ({style.length_unit(problem)})", ylabel="used (%)", ylim=(0.0, None))
    return figure


def capacity_beside(table: Table, problem: Problem, tool: str) -> Array | None:
    """Capacity (1 + rows,) of the press of a tool, of the modelled part, at its first place and then at the rows of a table.

    Of the sign of the force on the tool; not a number where nothing limits it or it is far above all forces; None of a tool
    without such a limit.
    """
    use = use_of(problem, tool)
    if use is None or (use.press.capacity is None and use.press.torque is None):
        return None
    made = course(table, problem, use)
    most = np.append(use.capacity(0.0, 0.0, 0), made.capacity)
    force = table[f"{tool}.fx" if use.axis == "x" else f"{tool}.fy"]
    sign = -1.0 if -force.min(initial=0.0) > force.max(initial=0.0) else 1.0
    return np.where(most <= _top(made.force, most), sign * most / use.forces, np.nan)


def _top(force: Array, most: Array) -> float:
    """How far up a capacity is drawn: as far as it can be compared with the forces."""
    return 1.6 * max(float(force.max(initial=0.0)), float(np.min(most, initial=np.inf)))


def _capacity_into(axes: Axes, table: Table, problem: Problem, use: Use, made: Course) -> None:
    """The capacity over the stroke: the whole curve of a table, and of a crank what it is on the way of the run."""
    if isinstance(use.press.capacity, tuple) and use.press.torque is None:
        stroke, most = (np.array(v) for v in zip(*use.press.capacity))
    else:
        time = np.append(0.0, table["time"])
        fine = np.linspace(0.0, time[-1], CURVE_POINTS)
        stroke = np.interp(fine, time, np.append(0.0, made.stroke))
        last = len(problem.steps) - 1
        most = np.array([use.capacity(s, t, min(int(t), last)) for s, t in zip(stroke, fine)])
    axes.plot(stroke, np.where(most <= _top(made.force, most), most, np.nan), "--", color=style.RED, label="capacity")
