"""Measures that end a step: which, and the numbers that they are to reach."""

from __future__ import annotations

import re
from collections.abc import Iterator

from prensa.errors import PrensaError
from prensa.materials.damage_law import DamageLaw
from prensa.measures.damage import unit_of
from prensa.measures.grammar import parse
from prensa.measures.measure import Measure, MeasureError
from prensa.model.problem import Problem
from prensa.model.units import factor, powers
from prensa.model.until import LIMIT, not_positive

_OVER_INCREMENTS = re.compile(r"(mean|ripple)\s*\(|.*\.(passages|elements)$|iterations$|cutbacks$")


def targets(problem: Problem, number: int) -> dict[str, tuple[Measure, float]]:
    """Measures that may end step *number* (from 0) of a problem, as they are written, with their targets in its units.

    Raises
    ------
    MeasureError
        With all that are wrong, one a line, each with its path: ``steps.0.until.measure.bore: …``.

    """
    found, wrong = {}, []
    until = problem.steps[number].until
    for text, value in until.measure.items() if until is not None else ():
        try:
            measure = parse(text, problem)
            if _OVER_INCREMENTS.match(problem.measures.get(text, text).strip()):
                raise MeasureError(
                    f"{text!r} is known of whole increments, not at a moment; wait for a force or a place"
                )
            found[text] = measure, _number(measure, value, problem)
        except PrensaError as error:
            wrong.append(f"steps.{number}.until.measure.{text}: {error}")
    if wrong:
        raise MeasureError("\n".join(wrong))
    return found


def damage_targets(problem: Problem, number: int) -> list[tuple[str, DamageLaw, float]]:
    """Body, law and target of each damage that may end step *number* (from 0) of a problem.

    Raises
    ------
    MeasureError
        For a text that is neither ``limit`` nor a value of the law's unit, and for what is not greater than zero.

    """
    found = []
    until = problem.steps[number].until
    for body, value in until.damage.items() if until is not None else ():
        laws = problem.bodies[body].damage
        if value == LIMIT:
            found += [(body, law, law.limit) for law in laws if law.limit is not None]
            continue
        try:
            target = _in_units(value, unit_of(problem, laws[0]), problem)
        except MeasureError as error:
            raise MeasureError(f"steps.{number}.until.damage.{body}: {error}; or write {LIMIT!r}") from None
        if not target > 0.0:
            raise MeasureError(f"steps.{number}.until.damage.{body}: {not_positive(body, value)}")
        found.append((body, laws[0], target))
    return found


def refuse_targets(problem: Problem) -> None:
    """Raise `MeasureError` for what is wrong with the measures that are to end the steps of a problem, all at once."""
    wrong = list(_wrong(problem))
    if wrong:
        raise MeasureError("\n".join(wrong))


def _wrong(problem: Problem) -> Iterator[str]:
    for number in range(len(problem.steps)):
        try:
            targets(problem, number)
            damage_targets(problem, number)
        except MeasureError as error:
            yield str(error)


def _number(measure: Measure, value: float | str, problem: Problem) -> float:
    return _in_units(value, measure.unit, problem)


def _in_units(value: float | str, unit: str, problem: Problem) -> float:
    if not isinstance(value, str):
        return value
    try:
        return factor(value, problem.units.length, problem.units.force, powers(unit))
    except ValueError as error:
        raise MeasureError(f"{error}; it is in {unit or 'plain numbers'}") from None
