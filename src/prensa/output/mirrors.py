"""Planes of symmetry that a case names, and the images of what was modelled between them, for pictures of the whole."""

from __future__ import annotations

import weakref
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.geometry.reflections import Plane, chamber, distinct, group
from prensa.mesh.mesh import Mesh
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.precision import DRAWN
from prensa.result.increment import BodyState, Increment
from prensa.types import Array

ENDS: Mapping[str, tuple[int, float]] = {
    "left": (0, 1.0), "right": (0, -1.0), "bottom": (1, 1.0), "top": (1, -1.0), "back": (2, 1.0), "front": (2, -1.0),
}  # fmt: skip
"""Axis across each end of the bodies, and which way along it they lie."""


class Image(NamedTuple):
    """A copy of what was modelled, at ``turn`` x + ``shift``: that itself where both are None."""

    turn: Array | None = None
    shift: Array | None = None

    def of(self, points: Array) -> Array:
        """Points (n, d) of the copy."""
        x = np.array(points, dtype=float)
        return x if self.turn is None or self.shift is None else x @ self.turn.T + self.shift

    def flips(self, axis: int) -> bool:
        """Whether an axis changes its sign, of a copy about planes across axes."""
        return self.turn is not None and bool(self.turn[axis, axis] < 0.0)

    def part(self, box: tuple[float, ...], lines: Sequence[tuple[int, float]], middle: Array) -> tuple[float, ...]:
        """The part of a box (x from, to, y from, to) that lies on the copy's side of all ``lines`` of symmetry.

        ``middle`` (d,): a place on the side of the section itself. Outlines of tools that have no end go on beyond a line, where
        the mirror image stands.
        """
        out = list(box)
        for axis, at in lines:
            above = bool(middle[axis] > at) != self.flips(axis)
            out[2 * axis + (0 if above else 1)] = at
        return tuple(out)

    def sign(self, field: str, problem: Problem) -> float:
        """What a field's values are multiplied by, in the plane; a radial component has no sign to lose."""
        flipped = [axis for axis in (0, 1) if self.flips(axis)]
        axes = [axis for axis in flipped if not (axis == 0 and problem.space == "axisymmetric")]
        kind, _, component = field.partition(".")
        if kind == "stress" and component[0] != component[1]:
            axes = flipped
        elif kind != "displacement" or not component:
            return 1.0
        return -1.0 if sum("xyz"[axis] in component for axis in axes) % 2 else 1.0

    def values(self, field: str, body: BodyState, values: Array) -> Array:
        """Values (n,) in space of a field whose values (n,) what was modelled has: components are those of the turned ones."""
        kind, _, component = field.partition(".")
        if self.turn is None or not component or kind not in ("displacement", "stress"):
            return values
        R = self.turn
        if kind == "displacement":
            return np.asarray(body.displacement @ R["xyz".index(component)])
        xx, yy, zz, xy, yz, xz = body.stress.T
        s = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        a, b = ("xyz".index(c) for c in component)
        return np.asarray(np.einsum("i,ijn,j->n", R[a], s, R[b]))


class Whole(NamedTuple):
    """Images of what was modelled, itself first, about ``planes`` of symmetry."""

    planes: Sequence[Plane] = ()
    images: Sequence[Image] = (Image(),)


def whole_of(increment: Increment, problem: Problem, sides: Sequence[str]) -> Whole:
    """What pictures of the whole show of an increment, mirrored at some sides; see `mirror_lines` and `images`."""
    planes = mirror_lines(increment, problem, sides)
    return Whole(planes, images(planes))


def images(planes: Sequence[Plane]) -> list[Image]:
    """What was modelled and its copies about planes of symmetry, as many as close to the whole.

    Raises
    ------
    NoWhole
        If they never do; see `prensa.geometry.reflections.chamber`.

    """
    if not planes:
        return [Image()]
    normals = chamber(planes)
    place = np.linalg.lstsq(normals, np.array([p.place for p in planes]), rcond=None)[0]
    made = [Image(turn, place - turn @ place) for turn in group(normals)]
    return [Image(), *made[1:]]


def mirror_lines(increment: Increment, problem: Problem, sides: Sequence[str]) -> list[Plane]:
    """Planes, in the plane lines, of symmetry of sides by name, each once. In axisymmetry the axis is one by itself.

    Raises
    ------
    PrensaError
        If a side is none, is not flat, or two ends have the same direction.

    """
    X = np.vstack([b.X for b in increment.bodies.values()])
    ends = [name for name, (axis, _) in ENDS.items() if axis < X.shape[1]]
    planes = [Plane((1.0, 0.0), 0.0, "the axis")] if problem.space == "axisymmetric" else []
    taken = [p.axis for p in planes]
    for side in sides:
        if side in ends:
            axis = ENDS[side][0]
            if axis in taken:
                already = "the axis does that" if problem.space == "axisymmetric" and axis == 0 else "another side does that"
                raise PrensaError(f"'mirror' cannot mirror about the {side} side too: {already}; name one side of a direction")
            taken.append(axis)
        elif "." not in side:
            raise PrensaError(f"'mirror' has no side {side!r}{suggest(str(side), ends)}")
        planes.append(plane_of(problem, side, X))
    return distinct(planes, DRAWN * float(np.ptp(X, axis=0).max()))


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
    from prensa.system.discretise import meshes_of

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
