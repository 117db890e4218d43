"""Open surfaces that present their side to what they are moved towards."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from prensa.checks.before.pushed_tools import forces_of
from prensa.checks.thresholds import SLIGHT
from prensa.errors import Finding, along
from prensa.system.moments import moments
from prensa.system.system import System
from prensa.types import Array


def tool_faces(system: System) -> Iterator[Finding]:
    """Tools of open surfaces, from STL files, whose ways and forces are all at a right angle to where these look."""
    if system.dofs.dimension == 2:
        return
    for number, tool in enumerate(system.tools):
        looks = tool.description.presented(tool.shape)
        if looks is None or not len(ways := _ways(system, number, tool.name)):
            continue
        if (np.abs(ways @ looks) < SLIGHT * np.linalg.norm(ways, axis=1)).all():
            way = ways[np.argmax(np.linalg.norm(ways, axis=1))]
            yield Finding(
                f"tools.{tool.name}",
                f"the surface faces {along(looks)}, but the tool moves along {along(way)}, so that its side meets what "
                f"it presses; turn it, as with {_turn(looks, way)}",
            )


def _ways(system: System, number: int, name: str) -> Array:
    """Ways (k, 3) that a tool is moved in the steps, and directions in which it is pushed."""
    own = system.dofs.tool.dofs(number)[: system.dofs.dimension]
    u = np.array([system.initial().u[own], *(m.u[own] for m in moments(system))])
    pushes = [step.push[name] for step in system.problem.steps if name in step.push]
    ways = np.concatenate([np.diff(u, axis=0), *(forces_of(push, system.dofs.dimension) for push in pushes)])
    return np.asarray(ways[(ways != 0.0).any(axis=1)])


def _turn(looks: Array, way: Array) -> str:
    """The key that turns a surface that is not turned, by the smallest angle, to look along a way."""
    axis = np.cross(looks, way / np.linalg.norm(way))
    angle = math.degrees(math.atan2(float(np.linalg.norm(axis)), float(looks @ way)))
    parts = [f"{v:.4g} deg" if round(v, 3) else "0" for v in angle * axis / np.linalg.norm(axis)]
    return f"'turn: [{', '.join(parts)}]'"
