"""A system of bricks under a rigid plane, from arrays: three dimensions on the way of all the others, a first slice.

There is one body, one contact, one plane that moves along x, y, z and does not turn, and supports that hold nodes. Not yet: case
files, other tools, exact enforcement, laws of friction that are not proportional to the pressure, loads, the checks before
a solve, condensation, recovered stresses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from prensa.contact.faces import FacePoints, face_measures
from prensa.contact.integration import SPREAD
from prensa.contact.surface import Surface
from prensa.elements.element import Mode, element_of
from prensa.errors import PrensaError
from prensa.layout import DofMap
from prensa.materials.material import material_of
from prensa.model import problem as model
from prensa.system.assembly import Block, make_pattern, slots_of
from prensa.system.schedule import Prescribed, StepPlan, amplitude
from prensa.system.system import System
from prensa.tools.place import PlacedTool
from prensa.tools.shapes.plane import HalfSpace
from prensa.types import Array, Index

# corners of the six faces of a brick, seen from outside counter-clockwise
_FACES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])


@dataclass(frozen=True)
class PlaneStep:
    """A step of unit time: displacements ``move`` of the plane at its end by axis ('x', 'y', 'z'), others held."""

    name: str
    move: Mapping[str, float]
    increments: int | None = None
    fixed: Mapping[str, Any] = field(default_factory=dict)
    stabilise: float | str | None = None
    until: None = None
    duration: None = None
    crank: Mapping[str, Any] = field(default_factory=dict)
    feed: Mapping[str, Any] = field(default_factory=dict)
    control: Mapping[str, Any] = field(default_factory=dict)
    remove_tools: bool = False


@dataclass(frozen=True)
class BricksUnderPlane:
    """Nodes ``X`` (n, 3), ``cells`` (m, 8), faces ``surface`` (k, 4) of any orientation, plane through ``at`` with a ``normal``.

    ``supports``: by name the nodes and the axes ('xyz') that are held.
    """

    X: Array
    cells: Index
    material: Any
    surface: Index
    at: tuple[float, float, float]
    normal: tuple[float, float, float]
    supports: Mapping[str, tuple[Index, str]]
    steps: tuple[PlaneStep, ...]
    friction: Any = None
    enforcement: Any = None
    element: str = "h8_fbar"
    kinematics: str = "finite"
    name: str = "bricks"
    stabilise: float | str = "off"
    remesh: str = "off"

    space = "3d"
    contact_geometry = "current"
    thickness = 1.0
    ties = ()

    @property
    def bodies(self) -> dict[str, Any]:
        """The body."""
        return {"body": self}

    @property
    def tools(self) -> dict[str, Any]:
        """The tool."""
        return {"plane": self}

    def driven(self, step: PlaneStep) -> Mapping[str, Any]:
        """None: steps move the tool alone."""
        return {}

    @property
    def fixed(self) -> Mapping[str, Any]:
        """What is held."""
        return self.supports

    @property
    def contacts(self) -> tuple[model.Contact, ...]:
        """The contact."""
        given = {} if self.enforcement is None else {"enforcement": self.enforcement}
        return (model.Contact(("body.surface",), "plane", friction=self.friction, **given),)


def discretise_bricks(problem: BricksUnderPlane) -> System:
    """Arrays of bricks under a plane.

    Raises
    ------
    PrensaError
        For what this slice does not have, and for faces that are no side of exactly one brick.

    """
    X, cells = np.ascontiguousarray(problem.X, dtype=np.float64), np.ascontiguousarray(problem.cells, dtype=np.int64)
    (contact,) = problem.contacts
    if contact.enforcement.has_multipliers:
        raise PrensaError("in space the enforcement is 'penalty' or 'augmented'")
    if problem.friction is not None and not problem.friction.proportional:
        raise PrensaError("in space friction is proportional to the pressure")
    if odd := {axis for s in problem.steps for axis in s.move} - set("xyz"):
        raise PrensaError(f"the plane moves along x, y and z, not {', '.join(sorted(odd))}")
    dofs = DofMap(3, len(X), 1)
    faces, behind = _outward(problem.surface, cells)
    nodes = np.unique(faces)
    pattern = make_pattern([cells], dofs, [nodes])
    slot = slots_of(cells, pattern, 3)
    element, mode = element_of(problem.element), Mode(False, problem.kinematics == "finite", 1.0)
    volume, folded = element.volumes(X[cells], mode)
    if folded.any():
        raise PrensaError(f"element {int(np.argmax(folded))} is folded (negative Jacobian at an integration point)")
    law = material_of(problem.material, problem.kinematics, "3d")
    block = Block("body", cells, X[cells], law, element, mode, slot, volume)
    points: Any = FacePoints(nodes, faces, *_depths(X, faces, volume[behind].sum(axis=1), nodes))
    normal = points.normals(X)
    surface = Surface(
        contact.name, contact, "body", points, 0, X[nodes], dofs.stencils(points.support, dofs.tool.dofs(0)), normal, normal,
        law.modulus(), behind,
    )  # fmt: skip
    out = np.array(problem.normal, dtype=np.float64) / np.linalg.norm(problem.normal)
    shape, description = HalfSpace(tuple(out.tolist())), cast(Any, problem)
    tool = PlacedTool("plane", shape, np.array(problem.at, dtype=np.float64), out, description)
    given: Any = problem
    return System(given, {}, {"body": 0}, X, [block], [tool], [surface], pattern, dofs, plan_of=_plan)


def _depths(X: Array, faces: Index, volume: Array, nodes: Index) -> tuple[Array, Array]:
    """Means at the nodes (k,) of the size of elements into the body, volume (m,) over area, and of what of it a point presses in.

    That is no more than `SPREAD` times the width of the face, its area over its longest side.
    """
    area, x, ends = face_measures(X[faces]).sum(axis=1), X[faces], faces.ravel()
    longest = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).max(axis=1)
    into = volume / area
    sums = [np.bincount(ends, np.repeat(h, 4)) for h in (into, np.minimum(into, SPREAD * area / longest))]
    depth, pressed = (total[nodes] / np.bincount(ends)[nodes] for total in sums)
    return depth, pressed


def _outward(surface: Index, cells: Index) -> tuple[Index, Index]:
    """The faces (k, 4) turned so that they are seen from outside counter-clockwise, and the elements (k,) behind them."""
    sides = cells[:, _FACES].reshape(-1, 4)
    owner: dict[tuple[int, ...], list[int]] = {}
    for i, side in enumerate(np.sort(sides, axis=1).tolist()):
        owner.setdefault(tuple(side), []).append(i)
    found = [owner.get(tuple(face), []) for face in np.sort(surface, axis=1).tolist()]
    if wrong := [i for i, f in enumerate(found) if len(f) != 1]:
        raise PrensaError(
            f"face {wrong[0]} of the contact surface is a side of {len(found[wrong[0]])} bricks, not of one"
        )
    places = np.array([f[0] for f in found], dtype=np.int64)
    return sides[places], places // len(_FACES)


def _plan(system: System, number: int, step_start: Array) -> StepPlan:
    """Plan of step *number* (from 0): supports are held where they were, the plane moves or is held."""
    problem: Any = system.problem
    step: PlaneStep = problem.steps[number]
    t0, t1 = float(number), float(number + 1)
    groups: list[Prescribed] = []
    taken = np.zeros(system.ndof, dtype=bool)
    for name, (nodes, axes) in problem.supports.items():
        for axis in axes:
            dofs = system.dofs.displacement.dof(np.unique(nodes), axis)
            dofs = dofs[~taken[dofs]]
            taken[dofs] = True
            groups.append(Prescribed(dofs, step_start[dofs].copy(), None, (name, axis)))
    for dof, axis in zip(system.dofs.tool.dofs(0), system.dofs.tool.components):
        start, to = step_start[[dof]].copy(), step.move.get(axis)
        groups.append(Prescribed(np.array([dof]), start, None if to is None else amplitude(to, float(start[0]), t0, t1)))
    return StepPlan(step.name, number, t0, t1, groups, {}, {}, {}, [problem.friction], step.increments)
