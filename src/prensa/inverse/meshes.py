"""The next mesh of a case: what a fit is repeated on, to see what it owes to the mesh."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from prensa.model.problem import Problem

FINER = 1.5  # elements along every side


def finer(problem: Problem) -> Problem | None:
    """The problem with more elements along every side; None if a mesh comes from a file and cannot be refined."""
    bodies = {}
    for name, body in problem.bodies.items():
        mesh: Any = body.mesh
        if not isinstance(getattr(mesh, "n", None), tuple):
            return None
        bodies[name] = replace(body, mesh=replace(mesh, n=tuple(round(FINER * n) for n in mesh.n)))
    return replace(problem, bodies=bodies).with_mirrored(problem.mirrored)
