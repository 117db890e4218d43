"""How presses are used: how many images of what is modelled the whole part has, along the way of a tool and across it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from prensa.errors import PrensaError
from prensa.geometry.reflections import NoWhole, Plane, chamber, distinct, group
from prensa.model.press import Use, driven_along
from prensa.model.problem import Problem
from prensa.precision import DRAWN
from prensa.system.mirrored_sides import plane_of


def use_of(problem: Problem, tool: str) -> Use | None:
    """How the press of a tool is used; None of a tool without one.

    Images across the planes along which the tool goes press beside it, those across the others against it.
    """
    press = problem.tools[tool].press
    if press is None:
        return None
    axis, planes = driven_along(problem, tool), list[Plane]()
    for side in press.mirror or ():
        try:
            planes.append(plane_of(problem, side))
        except PrensaError:  # of what is none a run says so before it begins
            continue
    along = [p for p in planes if len(axis) == 1 and abs(p.normal["xyz".index(axis)]) < DRAWN]
    beside, both = _images(along), _images(planes)
    return Use(press, tool, tuple(problem.steps), axis, beside, both // beside, both)


def _images(planes: Sequence[Plane]) -> int:
    """How many parts the whole has whose planes of symmetry, wherever they stand, these are."""
    try:
        return len(group(chamber(distinct(planes, np.inf)))) if planes else 1
    except NoWhole:  # of which a run says so before it begins
        return 1
