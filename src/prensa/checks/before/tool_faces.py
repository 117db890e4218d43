"""Open surfaces that present their side to what they are moved towards."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from prensa.checks.before.pushed_tools import forces_of
from prensa.checks.thresholds import NO_DIFFERENCE, TOWARDS
from prensa.contact.pairing import rotation
from prensa.errors import Finding, along
from prensa.geometry.plane import ONE_NORMAL
from prensa.geometry.sections import section_axes
from prensa.system.moments import moments
from prensa.system.system import System
from prensa.types import Array


def tool_faces(system: System) -> Iterator[Finding]:
    """Tools of open surfaces, from STL files, that are pressed into a side at a right angle to where these look.

    Half of a ball that ends in a plane of symmetry looks along its normal and is pressed across it. It is a warning, since a
    plane of symmetry may be inclined, and a surface of no one direction.
    """
    if system.dofs.dimension == 2:
        return
    for number, tool in enumerate(system.tools):
        looks = tool.description.presented(tool.shape)
        if looks is None or not len(ways := _pressing(system, tool.name, _ways(system, number, tool.name))):
            continue
        # a border that is cut askew turns where a surface looks by as much as a boundary that has one normal
        aside = (np.abs(ways @ looks) < math.sqrt(1.0 - ONE_NORMAL**2) * np.linalg.norm(ways, axis=1)).all()
        turned = np.array(getattr(tool.description, "turn", np.zeros(3)))
        if aside and not _cut(system, number):
            yield Finding(
                f"tools.{tool.name}",
                f"the surface faces {along(_axis_near(looks))}, but the tool moves along {along(ways[0])}, so that its side "
                f"meets what it presses; turn it, as with {_turn(turned, looks, ways[0])}",
            )


def _ways(system: System, number: int, name: str) -> Array:
    """Ways (k, 3) that a tool is moved in the steps, and directions in which it is pushed."""
    own = system.dofs.tool.dofs(number)[: system.dofs.dimension]
    u = np.array([system.initial().u[own], *(m.u[own] for m in moments(system))])
    pushes = [step.push[name] for step in system.problem.steps if name in step.push]
    ways = np.concatenate([np.diff(u, axis=0), *(forces_of(push, system.dofs.dimension) for push in pushes)])
    return np.asarray(ways[(ways != 0.0).any(axis=1)])


def _pressing(system: System, name: str, ways: Array) -> Array:
    """Of ways (k, 3) those that go into a side which the tool is to press, not along it."""
    normals = [s.node_normal.sum(axis=0) for s in system.tool_contacts if s.against == name]
    into = np.zeros(len(ways), dtype=bool)
    for n in normals:
        into |= -(ways @ n) > TOWARDS * np.linalg.norm(ways, axis=1) * np.linalg.norm(n)
    return np.asarray(ways[into])


def _axis_near(v: Array) -> Array:
    """The axis (3,) next to a unit vector v (3,), which a border cut askew turns a little; v itself where none is near."""
    axis = np.where(np.abs(v) > ONE_NORMAL, np.sign(v), 0.0)
    return axis if axis.any() else v


def _cut(system: System, number: int) -> bool:
    """Whether the borders of a surface lie in planes across the axes in which a body that it meets ends: of symmetry, likely."""
    tool = system.tools[number]
    points, triangles = tool.description.facets(tool.direction, 0.0)
    edges, often = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0, return_counts=True)
    border = (tool.at + points)[edges[often == 1]]  # (k, 2, 3)
    for body in {s.body for s in system.tool_contacts if s.against == tool.name}:
        x = system.meshes[body].points
        ends = np.array([x.min(axis=0), x.max(axis=0)])[:, None, None]
        if (np.abs(border - ends) < NO_DIFFERENCE * system.length).all(axis=2).any(axis=(0, 2)).all():
            return True
    return False


def _turn(turned: Array, looks: Array, way: Array) -> str:
    """The key that turns a surface, ``turned`` (3,), from how its file has it to look along a way, by the least angle."""
    way, drawn = way / np.linalg.norm(way), _axis_near(rotation(turned).T @ looks)
    turn = np.cross(drawn, way)
    sine, cosine = float(np.linalg.norm(turn)), float(drawn @ way)
    axis = turn / sine if sine > NO_DIFFERENCE else section_axes(way)[:, 0]  # it may look the other way
    parts = [f"{v:.4g} deg" if round(v, 3) else "0" for v in math.degrees(math.atan2(sine, cosine)) * axis]
    return f"'turn: [{', '.join(parts)}]'"
