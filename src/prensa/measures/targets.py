"""Measures that end a step: which, and the numbers that they are to reach."""

from __future__ import annotations

import re
from collections.abc import Iterator

from prensa.errors import PrensaError
from prensa.measures.grammar import parse
from prensa.measures.measure import Measure, MeasureError
from prensa.model.problem import Problem
from prensa.model.units import factor, powers

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


def refuse_targets(problem: Problem) -> None:
    """Raise `MeasureError` for what is wrong with the measures that are to end the steps of a problem, all at once."""
    wrong = list(_wrong(problem))
    if wrong:
        raise MeasureError("\n".join(wrong))


def _wrong(problem: Problem) -> Iterator[str]:
    for number in range(len(problem.steps)):
        try:
            targets(problem, number)
        except MeasureError as error:
            yield str(error)


def _number(measure: Measure, value: float | str, problem: Problem) -> float:
    if not isinstance(value, str):
        return value
    try:
        return factor(value, problem.units.length, problem.units.force, powers(measure.unit))
    except ValueError as error:
        raise MeasureError(f"{error}; it is in {measure.unit or 'plain numbers'}") from None
