"""How presses are used: how many images of what is modelled the whole part has, along the way of a tool and across it."""

from __future__ import annotations

from prensa.model.press import Use, driven_along
from prensa.model.problem import Problem
from prensa.system.mirrored_sides import images_of_sides


def use_of(problem: Problem, tool: str) -> Use | None:
    """How the press of a tool is used; None of a tool without one.

    Images across the planes along which the tool goes press beside it, those across the others against it.
    """
    press = problem.tools[tool].press
    if press is None:
        return None
    axis, sides = driven_along(problem, tool), press.mirror or ()
    beside, both = images_of_sides(problem, sides, axis), images_of_sides(problem, sides)
    return Use(press, tool, tuple(problem.steps), axis, beside, both // beside, both)
