"""Sides that a case names as planes of symmetry, ends of all bodies or flat sides of one: their planes, and what lies there."""

from __future__ import annotations

import weakref
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.geometry.reflections import NoWhole, Plane, chamber, distinct, group
from prensa.mesh.mesh import Mesh
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.precision import DRAWN
from prensa.system.discretise import meshes_of
from prensa.system.held import held_along
from prensa.system.once import once
from prensa.system.system import System
from prensa.types import Array, Index

ENDS: Mapping[str, tuple[int, float]] = {
    "left": (0, 1.0), "right": (0, -1.0), "bottom": (1, 1.0), "top": (1, -1.0), "back": (2, 1.0), "front": (2, -1.0),
}  # fmt: skip
"""Axis across each end of the bodies, and which way along it they lie."""


def plane_of(problem: Problem, side: str, X: Array | None = None, meshes: Mapping[str, Mesh] | None = None) -> Plane:
    """The plane of an end of all bodies (``left`` …), or of a flat side of one (``ring.cap``), its normal into the bodies.

    ``X`` (n, d): initial places of the bodies, without which the place of an end is not known; ``meshes``: those of the
    problem, which are made if not given.

    Raises
    ------
    PrensaError
        If there is no such side, or it is not flat.

    """
    if side in ENDS:
        axis, sign = ENDS[side]
        normal = tuple(sign if k == axis else 0.0 for k in range(3 if problem.space == "solid" else 2))
        return Plane(normal, float("nan") if X is None else float((sign * X[:, axis]).min()), side)
    name, _, edge = side.partition(".")
    if name not in problem.bodies:
        raise PrensaError(f"'mirror' names {side!r}, and there is no body {name!r}{suggest(name, problem.bodies)}")
    if meshes is None:
        return _stated(problem, side)
    mesh = meshes[name]
    nodes = mesh.nodes(edge, side)
    if edge not in mesh.edges:
        raise PrensaError(f"'mirror' names {side!r}, which is a point; name a flat side")
    return flat_plane(mesh.points[nodes], mesh.points, side)


_FLAT_SIDES: dict[int, dict[str, Plane]] = {}  # planes of flat sides by name, of problems that there are


def _stated(problem: Problem, side: str) -> Plane:
    """The plane of a flat side in the mesh that a problem describes, which is made once."""
    key = id(problem)
    if key not in _FLAT_SIDES:
        weakref.finalize(problem, _FLAT_SIDES.pop, key, None)
        _FLAT_SIDES[key] = {}
    if side not in _FLAT_SIDES[key]:
        _FLAT_SIDES[key][side] = plane_of(problem, side, None, meshes_of(problem, {}))
    return _FLAT_SIDES[key][side]


def flat_plane(x: Array, X: Array, side: str) -> Plane:
    """The plane of places x (n, d) of a side of a body with nodes at X, its normal into the body; raises PrensaError of none."""
    middle = x.mean(axis=0)
    n = np.linalg.svd(x - middle, full_matrices=True)[2][-1]
    n = np.where(np.abs(n) < DRAWN, 0.0, n)
    n /= np.linalg.norm(n) * (1.0 if ((X - middle) @ n).mean() >= 0.0 else -1.0)
    off = float(np.abs((x - middle) @ n).max())
    if off > DRAWN * float(np.ptp(x, axis=0).max()):
        raise PrensaError(f"'mirror' names {side!r}, which is not flat (off by {off:.3g}): no plane of symmetry; leave it out")
    if len(n) == 2 and np.abs(n).max() < 1.0:
        raise PrensaError(f"'mirror' names {side!r}: in the plane a line of symmetry lies along x or y; turn the model")
    return Plane(tuple(n.tolist()), float(middle @ n), side)


class Side(NamedTuple):
    """Faces (k, a) of a body's outline that lie in a plane."""

    body: str
    mesh: Mesh
    faces: Index


def sides_in(meshes: Mapping[str, Mesh], plane: Plane) -> list[Side]:
    """What lies in a plane: all of the outlines, but of the body whose side it is named after that side alone."""
    size = max(float(np.ptp(mesh.points, axis=0).max()) for mesh in meshes.values())
    body, _, side = plane.name.partition(".")
    found = []
    for name, mesh in meshes.items():
        faces = mesh.edges[side] if side and name == body else mesh.boundary
        on = np.abs(plane.distance(mesh.points)) <= DRAWN * size
        found.append(Side(name, mesh, faces[on[faces].all(axis=1)]))
    return [s for s in found if len(s.faces)]


def named_sides(problem: Problem) -> list[str]:
    """Planes of symmetry that a problem's case names, in its output and in presses."""
    presses = [tool.press for tool in problem.tools.values() if tool.press is not None]
    return list(dict.fromkeys([*problem.mirrored, *(side for press in presses for side in press.mirror or ())]))


def images_of_sides(problem: Problem, sides: Sequence[str], along: str | None = None) -> int:
    """How many parts the whole has whose planes of symmetry sides name, all or those that an axis lies along; 1 of no whole."""
    planes = []
    for side in sides:
        try:
            planes.append(plane_of(problem, side))
        except PrensaError:  # of what is none a run says so before it begins
            continue
    if along is not None:
        planes = [p for p in planes if len(along) == 1 and abs(p.normal["xyz".index(along)]) < DRAWN]
    try:
        return len(group(chamber(distinct(planes, np.inf)))) if planes else 1
    except NoWhole:  # a run says so before it begins
        return 1


@once
def named_planes(system: System) -> tuple[Plane, ...]:
    """Planes of symmetry that the case names, all sides in which supports hold along the normal in all steps."""
    out = []
    for side in named_sides(system.problem):
        try:
            plane = plane_of(system.problem, side, system.X, system.meshes)
        except PrensaError:  # of what is none a run says so before it begins
            continue
        n, sides = np.asarray(plane.normal), sides_in(system.meshes, plane)
        if sides and all(held_along(system, s.body, n)[s.faces].all() for s in sides):
            out.append(plane)
    return tuple(out)
