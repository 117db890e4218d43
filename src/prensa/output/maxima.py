"""The largest values of a run, with when and where: what a forming engineer looks for first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.measures.columns import directions, force_columns, place_columns
from prensa.measures.damage import unit_of
from prensa.model.problem import Problem
from prensa.output import style
from prensa.output.answer import size_of_force
from prensa.output.stored import Stored
from prensa.result.increment import BodyState, Increment
from prensa.types import Array

SLENDER = 5.0  # length over thickness from which a body is a sheet, whose thinning is of interest

SHOWN = 1e-4
"""Of the largest coordinate of a place: what pages show of it, in four digits."""


class Maximum(NamedTuple):
    """A largest value: ``value`` in ``unit`` of ``what`` in ``of``, at the current place (d,), or None, in an increment."""

    what: str
    of: str
    value: float
    unit: str
    place: tuple[float, ...] | None
    step: str
    increment: int
    time: float


def maxima(stored: Stored) -> list[Maximum]:
    """Largest forces and moments of tools, pressures of contacts, stresses, strains and thinning of bodies of a run.

    Of forces, moments and pressures over all increments; of fields over those that were written.
    """
    problem = stored.problem
    return [*_of_tools(stored, problem), *_of_contacts(stored, problem), *_of_bodies(stored, problem)]


def largest_force(stored: Stored, numbers: Iterable[int] | None = None) -> int | None:
    """Number of the increment (of *numbers*, all if None) with the largest force on a tool; None where no force acts.

    The tool is the one that does the most work: where several press, that is the one that forms.
    """
    tool = leading_tool(stored.history, stored.problem)
    if tool is None:
        return None
    history = stored.history
    round_ = stored.problem.space == "axisymmetric"
    force = np.abs(history[f"{tool}.fy"]) if round_ else size_of_force(history, tool, stored.problem)
    among = np.ones(len(force), dtype=bool) if numbers is None else np.isin(history["increment"], list(numbers))
    if not among.any() or not force[among].any():
        return None
    return int(history["increment"][np.argmax(np.where(among, force, -1.0))])


def leading_tool(history: Mapping[str, NDArray[Any]], problem: Problem) -> str | None:
    """The tool that does the most work, turning included; of those that do none the one with the largest force."""
    best: tuple[float, float, str] | None = None
    for tool in problem.tools:
        pairs = zip(place_columns(problem), force_columns(problem))
        work = sum(_work(history[f"{tool}.{u}"], history[f"{tool}.{f}"]) for u, f in pairs)
        force = float(size_of_force(history, tool, problem).max(initial=0.0))
        if best is None or (work, force) > best[:2]:
            best = (work, force, tool)
    return best[2] if best is not None and best[1] > 0 else None


def thinning(body: BodyState) -> tuple[Array, Array] | None:
    """1 − t/t₀ (k,) across a sheet and the middle of each section (k, 2) now; None for a body that is no sheet.

    A sheet is a body whose nodes were laid out as a grid and that was longer than five times its thickness. In plane
    stress the thickness is that out of the plane, at the nodes.
    """
    if body.X.shape[1] == 3:
        return None
    lines = [np.unique(np.round(body.X[:, k], 12)) for k in (0, 1)]
    if len(lines[0]) * len(lines[1]) != len(body.X):
        return None
    size = np.ptp(body.X, axis=0)
    long = int(size[1] > size[0])
    if size[long] < SLENDER * size[1 - long]:
        return None
    order = np.lexsort((body.X[:, 1 - long], np.round(body.X[:, long], 12)))
    grid = order.reshape(len(lines[long]), -1)
    low, high = grid[:, 0], grid[:, -1]
    now, before = (np.hypot(*(p[high] - p[low]).T) for p in (body.x, body.X))
    return 1.0 - now / before, 0.5 * (body.x[low] + body.x[high])


# ------------------------------------------------------------------------------------------------------------- details
def _work(u: Array, f: Array) -> float:
    u, f = np.concatenate([[0.0], u]), np.concatenate([[0.0], f])
    return float(np.abs(0.5 * (f[1:] + f[:-1]) * np.diff(u)).sum())


def _of_tools(stored: Stored, problem: Problem) -> Iterator[Maximum]:
    history, names = stored.history, style.axes_names(problem)
    round_ = problem.space == "axisymmetric"  # radial forces and moments of a whole ring balance
    kinds = force_columns(problem)[: directions(problem)]
    forces = [(t, c) for t in problem.tools for c in kinds if not (round_ and c == "fx")]
    largest = max((float(np.abs(history[f"{t}.{c}"]).max(initial=0.0)) for t, c in forces), default=0.0)
    for tool, c in forces:
        values = history[f"{tool}.{c}"]
        if values.size and np.abs(values).max() > 1e-6 * largest:
            k = int(np.argmax(np.abs(values)))
            what = f"force {names['xyz'.index(c[1])]}"
            yield Maximum(what, tool, float(values[k]), style.force_unit(problem), None, *_when(stored, k))
    turns = list(zip(place_columns(problem), force_columns(problem)))[directions(problem) :]
    for tool, (turn, c) in product(problem.tools, turns):
        moment = history[f"{tool}.{c}"]
        if not round_ and history[f"{tool}.{turn}"].any() and moment.any():
            k = int(np.argmax(np.abs(moment)))
            what = "moment" if len(turns) == 1 else f"moment {c[1]}"
            yield Maximum(what, tool, float(moment[k]), style.moment_unit(problem), None, *_when(stored, k))


def _of_contacts(stored: Stored, problem: Problem) -> Iterator[Maximum]:
    best: dict[str, tuple[float, tuple[float, ...], int]] = {}
    for k in range(len(stored)):
        if not any(stored.history[f"{c.name}.area"][k] for c in problem.all_contacts):
            continue
        for name, contact in stored[k].contacts.items():
            j = int(np.argmax(contact.pressure))
            if contact.pressure[j] > best.get(name, (0.0,))[0]:
                best[name] = (float(contact.pressure[j]), _place(contact.x[j]), k)
    for name, (value, place, k) in best.items():
        yield Maximum("pressure", name, value, style.pressure_unit(problem), place, *_when(stored, k))


def _of_bodies(stored: Stored, problem: Problem) -> Iterator[Maximum]:
    best: dict[tuple[str, str], tuple[float, str, tuple[float, ...], Increment]] = {}
    for increment in stored.fields():
        for name, body in increment.bodies.items():
            for what, unit, values, x in [*_quantities(body, problem), *_damage(name, body, problem)]:
                j = int(np.argmax(values))
                if values[j] > best.get((what, name), (1e-9,))[0]:
                    best[what, name] = (float(values[j]), unit, _place(x[j]), increment)
    for (what, name), (value, unit, place, found) in best.items():
        yield Maximum(what, name, value, unit, place, found.step, found.number, found.time)


def _quantities(body: BodyState, problem: Problem) -> Iterator[tuple[str, str, Array, Array]]:
    yield "von Mises stress", style.pressure_unit(problem), body.mises, body.x
    yield "plastic strain", "–", body.plastic_strain, body.x
    if body.thickness is not None:
        yield "thinning", "%", 100.0 * (1.0 - body.thickness / problem.thickness), body.x
    elif (sheet := thinning(body)) is not None:
        yield "thinning", "%", 100.0 * sheet[0], sheet[1]


def _damage(name: str, body: BodyState, problem: Problem) -> Iterator[tuple[str, str, Array, Array]]:
    for law in problem.bodies[name].damage:
        yield f"damage ({law.heading})", unit_of(problem, law) or "–", body.damage[law.name], body.x


def _place(x: Array) -> tuple[float, ...]:
    """A point x (d,); coordinates that four digits of the largest one do not show are zero, such as depths of a penalty."""
    return tuple(float(v) for v in np.where(np.abs(x) < SHOWN * np.abs(x).max(), 0.0, x))


def _when(stored: Stored, k: int) -> tuple[str, int, float]:
    history = stored.history
    return str(history["step"][k]), int(history["increment"][k]), float(history["time"][k])
