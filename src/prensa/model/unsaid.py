"""What a case file leaves out though its words ask for it: a body of revolution in a file that does not say its space."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from prensa.model.problem import Problem

SOLID = frozenset(["billet", "slug", "rod", "wire", "bolt", "rivet", "shaft", "disc", "disk", "cylinder", "cup", "can"])
HOLLOW = frozenset(["ring", "tube", "pipe", "sleeve", "bush", "bushing", "washer"])


def space_left_out(problem: Problem) -> list[str]:
    """A sentence for each body that reads like half the section of a round one, for a file that does not say its 'space'.

    Its name is that of a round part, its section begins at x = 0, where it is held along x, or, of a hollow part, beside it.
    """
    if problem.space != "plane strain":
        return []
    said = []
    for name, body in problem.bodies.items():
        words = set(re.split(r"[\W\d_]+", name.lower()))
        left = _least_x(body.mesh)
        if left is None or not words & (SOLID | HOLLOW):
            continue
        held = [side for side in _held_along_x(problem) if side.partition(".")[0] == name]
        axis = next((side for side in held if side.endswith(".left")), "") if left == 0 else ""
        if axis or (left > 0 and words & HOLLOW):
            where = f"whose {axis!r} at x = 0 is held along x" if axis else f"from x = {left:g} on"
            said.append(
                f"bodies.{name}: 'space' is left out, which is plane strain, and {name!r}, {where}, reads like half the section "
                "of a round body; write 'space: axisymmetric', or 'space: plane strain' if that is meant"
            )
    return said


def _held_along_x(problem: Problem) -> list[str]:
    return [name for name, support in problem.fixed.items() if support.x is not None]


def _least_x(mesh: Any) -> float | None:
    """Where a section that is drawn as a rectangle, a patch or an outline begins; None of other meshes."""
    if mesh.type == "rectangle":
        return float(mesh.origin[0])
    points = {"patch": "corners", "outline": "points"}.get(mesh.type)
    return None if points is None else min(float(p[0]) for p in getattr(mesh, points))
