"""The columns of ``history.csv``: names that follow from the description alone, and what stands in them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from prensa.measures import damage
from prensa.measures.measure import MeasureError
from prensa.measures.units import area_unit, energy_unit, force_unit, length_unit, moment_unit
from prensa.model.fields import motions_in
from prensa.model.press import Use, works
from prensa.model.problem import Problem, ever_stabilised, support_names
from prensa.model.remeshing import remeshing_of
from prensa.model.seconds import any_stated
from prensa.result.presses import use_of

if TYPE_CHECKING:
    from prensa.result.increment import Increment

ENERGIES = ("external", "elastic", "plastic", "friction", "contact", "imbalance")
IN_PLANE, IN_SPACE = ("ux", "uy", "rz"), ("ux", "uy", "uz", "rx", "ry", "rz")


def place_columns(problem: Problem) -> tuple[str, ...]:
    """Columns of a tool's displacement and rotation."""
    return IN_SPACE if problem.space == "solid" else IN_PLANE


def orientation_columns(problem: Problem) -> tuple[str, ...]:
    """Columns of a tool's rotation vector in space, which is not the sum of its rotations about several axes."""
    return ("ox", "oy", "oz") if problem.space == "solid" else ()


def force_columns(problem: Problem) -> tuple[str, ...]:
    """Columns of a tool's force and moment, in the order of `place_columns`."""
    return tuple(("f" if name[0] == "u" else "m") + name[1] for name in place_columns(problem))


def directions(problem: Problem) -> int:
    """How many of these columns are displacements and forces: they come first."""
    return 3 if problem.space == "solid" else 2


class Column(NamedTuple):
    """``unit`` and value of a column of the history."""

    unit: str
    value: Callable[[Increment], Any]


def energies_of(problem: Problem) -> list[str]:
    """Names of the energies that a run writes: with what viscous forces dissipate where some step is stabilised."""
    return [*ENERGIES, *(["viscous"] if ever_stabilised(problem) else [])]


def columns(problem: Problem) -> dict[str, Column]:
    """Columns of ``history.csv`` by name, in order."""
    d, turns = directions(problem), len(place_columns(problem)) - directions(problem)
    forces = (force_unit(problem),) * d + (moment_unit(problem),) * turns
    places = (length_unit(problem),) * d + ("rad",) * turns
    out = {"step": Column("", lambda i: i.step), "increment": Column("", lambda i: i.number)}
    out["time"] = Column("", lambda i: i.time)
    if any_stated(problem):
        out["seconds"] = Column("s", lambda i: i.seconds)
    for tool in problem.tools:
        out |= {f"{tool}.{c}": _place(tool, k, places[k]) for k, c in enumerate(place_columns(problem))}
        out |= {f"{tool}.{c}": _force(tool, k, forces[k]) for k, c in enumerate(force_columns(problem))}
        out |= {f"{tool}.{c}": _orientation(tool, k) for k, c in enumerate(orientation_columns(problem))}
    for contact in problem.all_contacts:
        out[f"{contact.name}.area"] = _area(contact.name, area_unit(problem))
    for body in problem.bodies if problem.space == "plane stress" else ():
        out[f"{body}.thickness.min"] = _thickness(body, "min", length_unit(problem))
        out[f"{body}.thickness.max"] = _thickness(body, "max", length_unit(problem))
    for body, law in damage.laws(problem):
        units = (damage.unit_of(problem, law), *(length_unit(problem),) * d)
        for key, c, unit in zip(("", ".x", ".y", ".z"), damage.Largest._fields, units):
            out[f"{body}.damage.{law.name}{key}"] = _damage(body, law.name, c, unit)
    for name in energies_of(problem):
        out[f"energy.{name}"] = _energy(name, energy_unit(problem))
    out["iterations"] = Column("", lambda i: i.statistics.iterations)
    out["cutbacks"] = Column("", lambda i: i.statistics.cutbacks)
    if problem.space == "solid":
        out["krylov"] = Column("", lambda i: i.statistics.krylov)
    if remeshing_of(problem) is not None:
        out["remeshings"] = Column("", lambda i: i.remeshings)
    for name in support_names(problem):
        out |= {f"fixed.{name}.{c}": _support(name, k, forces[k]) for k, c in enumerate(force_columns(problem)[:d])}
        if problem.space == "solid":
            out |= {f"fixed.{name}.{c}": _turning(name, c, moment_unit(problem)) for c in force_columns(problem)[d:]}
    working = works(problem)
    for tool, description in problem.tools.items():
        for k, (key, c) in enumerate(zip(motions_in(problem.space), force_columns(problem))):
            if description.spring is not None and getattr(description.spring, key) is not None:
                out[f"{tool}.spring.{c}"] = _spring(tool, k, forces[k])
        if tool in working:
            out[f"{tool}.work"] = _work(tool, energy_unit(problem))
        if (use := use_of(problem, tool)) is not None:
            out[f"{tool}.press_utilisation"] = _utilisation(use)
    return out


def _place(tool: str, k: int, unit: str) -> Column:
    return Column(unit, lambda i: i.tools[tool].place[k])


def _orientation(tool: str, k: int) -> Column:
    def value(increment: Increment) -> float:
        state = increment.tools[tool]
        return (state.orientation or state.place[3:])[k]

    return Column("rad", value)


def _force(tool: str, k: int, unit: str) -> Column:
    return Column(unit, lambda i: i.tools[tool].force[k])


def _spring(tool: str, k: int, unit: str) -> Column:
    return Column(unit, lambda i: (i.tools[tool].spring or (0.0,) * 6)[k])


def _work(tool: str, unit: str) -> Column:
    return Column(unit, lambda i: i.tools[tool].work)


def _utilisation(use: Use) -> Column:
    def value(increment: Increment) -> float:
        tool = increment.tools[use.tool]
        d = len(tool.at)
        force, place = tool.force[:d], tool.place[:d]
        return use.utilisation(force, place, tool.work, increment.time, increment.step_number - 1)

    return Column("", value)


def _area(contact: str, unit: str) -> Column:
    return Column(unit, lambda i: i.contacts[contact].area)


def _damage(body: str, law: str, of: str, unit: str) -> Column:
    return Column(unit, lambda i: getattr(damage.largest(i, body, law), of))


def _energy(name: str, unit: str) -> Column:
    return Column(unit, lambda i: i.energy.get(name, 0.0))


def _support(name: str, k: int, unit: str) -> Column:
    return Column(unit, lambda i: i.supports[name][k])


def _turning(name: str, c: str, unit: str) -> Column:
    return Column(unit, lambda i: getattr(i.support_moments[name], c))


def _thickness(body: str, which: str, unit: str) -> Column:
    def value(increment: Increment) -> Any:
        t = increment.bodies[body].thickness
        if t is None:
            raise MeasureError(f"{body!r} has no thickness of its own")
        return t.min() if which == "min" else t.max()

    return Column(unit, value)
