"""Planes of symmetry that a case names, and the images of what was modelled between them, for pictures of the whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.geometry.reflections import Plane, chamber, distinct, group
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.precision import DRAWN
from prensa.result.increment import BodyState, Increment
from prensa.system.mirrored_sides import ENDS, plane_of
from prensa.types import Array


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
