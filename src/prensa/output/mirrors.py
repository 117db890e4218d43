"""Mirror images of what was modelled, for pictures of the whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.result.increment import Increment
from prensa.types import Array


class Image(NamedTuple):
    """A copy of a section, mirrored about lines (axis that changes sign, coordinate of the line)."""

    lines: tuple[tuple[int, float], ...] = ()

    def of(self, points: Array) -> Array:
        """Points (n, d) of the copy."""
        out = np.array(points, dtype=float)
        for axis, at in self.lines:
            out[:, axis] = 2.0 * at - out[:, axis]
        return out

    def part(self, box: tuple[float, ...], lines: Sequence[tuple[int, float]], middle: Array) -> tuple[float, ...]:
        """The part of a box (x from, to, y from, to) that lies on the copy's side of all ``lines`` of symmetry.

        ``middle`` (d,): a place on the side of the section itself. Outlines of tools that have no end go on beyond a line, where
        the mirror image stands.
        """
        out = list(box)
        for axis, at in lines:
            above = bool(middle[axis] > at) != ((axis, at) in self.lines)
            out[2 * axis + (0 if above else 1)] = at
        return tuple(out)

    def sign(self, field: str, problem: Problem) -> float:
        """What a field's values are multiplied by; a radial component has no sign to lose."""
        axes = [axis for axis, _ in self.lines if not (axis == 0 and problem.space == "axisymmetric")]
        kind, _, component = field.partition(".")
        if kind == "stress" and component[0] != component[1]:
            axes = [axis for axis, _ in self.lines]
        elif kind != "displacement" or not component:
            return 1.0
        return -1.0 if sum("xyz"[axis] in component for axis in axes) % 2 else 1.0


def images(lines: Sequence[tuple[int, float]]) -> list[Image]:
    """The section itself and its copies about lines of symmetry; about two lines there are three."""
    found: list[tuple[tuple[int, float], ...]] = [()]
    for line in lines:
        found += [(*done, line) for done in found]
    return [Image(done) for done in found]


def mirror_lines(increment: Increment, problem: Problem, sides: Sequence[str]) -> list[tuple[int, float]]:
    """Lines, in space planes, of symmetry: axis that changes sign, coordinate. In axisymmetry the axis is one by itself.

    Raises
    ------
    PrensaError
        If a side is none, or two sides have the same direction.

    """
    X = np.vstack([b.X for b in increment.bodies.values()])
    pairs = (("left", "right"), ("bottom", "top"), ("back", "front"))[: X.shape[1]]
    ends = {name: (k, at) for k, p in enumerate(pairs) for name, at in zip(p, (X[:, k].min(), X[:, k].max()))}
    lines = [(0, 0.0)] if problem.space == "axisymmetric" else []
    for side in sides:
        if side not in ends:
            raise PrensaError(f"'mirror' has no side {side!r}{suggest(str(side), ends)}")
        axis, at = ends[side]
        if axis in [a for a, _ in lines]:
            already = "the axis does that" if problem.space == "axisymmetric" and axis == 0 else "another side does that"
            raise PrensaError(f"'mirror' cannot mirror about the {side} side too: {already}; name one side of a direction")
        lines.append((axis, float(at)))
    return lines
