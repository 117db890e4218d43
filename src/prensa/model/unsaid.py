"""Omissions of a description that its words call for: a body of revolution where nothing says its space."""

from __future__ import annotations

import re
from typing import Any

from prensa.model.problem import Problem

SOLID = frozenset(["billet", "slug", "rod", "wire", "bolt", "rivet", "shaft", "disc", "disk", "cylinder", "cup", "can"])
HOLLOW = frozenset(["ring", "tube", "pipe", "sleeve", "bush", "bushing", "washer"])

ROUND_CASES = frozenset(
    ["axisymmetric", "axisymmetrical", "round", "billet", "slug", "rod", "wire", "bolt", "rivet", "tube", "pipe"]
)
"""Words of a case's name that no name of a plane one has."""


def space_left_out(problem: Problem) -> list[str]:
    """A sentence for each body that reads like half the section of a round one, of a problem that does not say its 'space'.

    Its name is that of a round part, or that of the whole case says so; its section begins at x = 0, where it is held along
    x, or, of a hollow part, beside it.
    """
    if problem.space != "plane strain" or "space" in problem.stated:
        return []
    said = []
    for name, body in problem.bodies.items():
        words = _words(name) | (_words(problem.name) & ROUND_CASES)
        left = _least_x(body.mesh)
        if left is None or not words & (SOLID | HOLLOW | ROUND_CASES):
            continue
        held = [side for side in _held_along_x(problem) if side.partition(".")[0] == name]
        axis = next((side for side in held if side.endswith(".left")), "") if left == 0 else ""
        # A name alone is no proof: a wall at the axis that is held, or a hollow body away from it, has to speak for it too.
        if axis or (left > 0 and words & HOLLOW):
            where = f"whose {axis!r} at x = 0 is held along x" if axis else f"from x = {left:g} on"
            said.append(
                f"bodies.{name}: 'space' is missing, which means plane strain, but {name!r}, {where}, looks like half the "
                "section of a round body; write 'space: axisymmetric', or 'space: plane strain' if that is meant"
            )
    return said


def _words(name: str) -> set[str]:
    return set(re.split(r"[\W\d_]+", name.lower()))


def _held_along_x(problem: Problem) -> list[str]:
    """Boundaries that supports of the problem, or of its first step, hold along x."""
    first = problem.steps[0].fixed if problem.steps else {}
    return [name for name, support in {**problem.fixed, **first}.items() if support.x is not None]


def _least_x(mesh: Any) -> float | None:
    """Where a section that is drawn as a rectangle, a patch or an outline begins; None of other meshes."""
    if mesh.type == "rectangle":
        return float(mesh.origin[0])
    points = {"patch": "corners", "outline": "points"}.get(mesh.type)
    return None if points is None else min(float(p[0]) for p in getattr(mesh, points))
