"""Damage among the measures: its laws by body and name, units, the place of its largest value."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from prensa.materials.damage_law import DamageLaw as DamageLaw
from prensa.measures.measure import MeasureError
from prensa.measures.units import pressure_unit
from prensa.model.names import suggest
from prensa.model.problem import Problem

if TYPE_CHECKING:
    from prensa.result.increment import Increment


class Largest(NamedTuple):
    """The largest damage of a body at its nodes, and where that is now."""

    value: float
    x: float
    y: float
    z: float = 0.0


def laws(problem: Problem) -> Iterator[tuple[str, DamageLaw]]:
    """Bodies with each of their damage laws."""
    yield from ((name, law) for name, body in problem.bodies.items() for law in body.damage)


def law_of(problem: Problem, body: str, field: str) -> DamageLaw:
    """The law that the field ``damage`` of a body, the first one, or ``damage.<law>`` is of.

    Raises
    ------
    MeasureError
        If the body has no such law.

    """
    own: tuple[DamageLaw, ...] = problem.bodies[body].damage
    if not own:
        remedy = f"give it one, as in 'bodies: {{{body}: {{damage: {{type: cockcroft_latham}}}}}}'"
        raise MeasureError(f"body {body!r} has no damage law; {remedy}")
    name = field.removeprefix("damage").removeprefix(".")
    known = {law.name: law for law in own}
    if name and name not in known:
        raise MeasureError(f"body {body!r} has no damage law {name!r}{suggest(name, known)}")
    return known[name] if name else own[0]


def fields(problem: Problem) -> tuple[str, ...]:
    """Fields of damage that some body has: ``damage`` and ``damage.<law>``."""
    names = list(dict.fromkeys(law.name for _, law in laws(problem)))
    return ("damage", *(f"damage.{name}" for name in names)) if names else ()


def unit_of(problem: Problem, law: DamageLaw) -> str:
    """Unit of a damage; '' of plain numbers."""
    return pressure_unit(problem) if law.of_stress else ""


def largest(increment: Increment, body: str, law: str) -> Largest:
    """The largest damage of a body by a law in an increment."""
    state = increment.bodies[body]
    k = int(np.argmax(state.damage[law]))
    return Largest(float(state.damage[law][k]), *map(float, state.x[k]))
