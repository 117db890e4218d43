"""Plane cuts through bodies in space: the lines in which a plane meets a side, or the outside of a body.

A line runs from edge to edge of the faces, straight in each; as in the plane it is walked with the body on the left, in the
coordinates of the cut: (x, y) of one at z, (z, y) at x, (x, z) at y. The plane of a material coordinate (X, Y, Z) moves with the
material: what is measured then is the line as it is seen along the axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from prensa.measures.bodies import Outline, Place
from prensa.measures.measure import MeasureError
from prensa.measures.outline import circle_curvature
from prensa.mesh.bricks import around_faces
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.types import Array, Flags, Index

if TYPE_CHECKING:
    from prensa.result.increment import Shape

CUT_AXES = {"x": (2, 1), "y": (0, 2), "z": (0, 1)}
"""First and second coordinate in the plane of a cut across an axis."""


class Line(NamedTuple):
    """k places on edges of faces: ``nodes`` (k, 2) and their shares ``N`` (k, 2); ``closed`` lines repeat the first."""

    nodes: Index
    N: Array
    closed: bool

    def of(self, values: Array) -> Array:
        """Values (k, …) there of nodal values (n, …)."""
        return np.asarray(np.einsum("ka,ka...->k...", self.N, values[self.nodes]))


@dataclass(frozen=True)
class Cut:
    """The plane where a coordinate ``axis`` (x, y, z of the deformed, X, Y, Z of the undeformed body) has a ``level``."""

    outline: Outline
    axis: str
    level: float
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.outline} at {self.axis}={self.level:g}"

    @property
    def plane(self) -> tuple[int, int]:
        """Numbers of the coordinates in the plane."""
        return CUT_AXES[self.axis.lower()]

    def lines(self, shape: Shape, x: Array) -> list[Line]:
        """All lines of the cut, of a body with nodes at x (n, 3).

        Raises
        ------
        MeasureError
            If the plane does not meet the side.

        """
        faces, k = around_faces(self.outline.edges(shape)), "xyz".index(self.axis.lower())
        values = (shape.X if self.axis.isupper() else x)[:, k]
        some = values[faces]
        low, high = float(some.min()), float(some.max())
        close = NEGLIGIBLE * max(high - low, abs(self.level))
        # nodes on the plane count as below it; where nothing is above, as on a plane of symmetry that ends the body, as above
        for above in (values > self.level + close, values >= self.level - close):
            if found := _walked(faces, values - self.level, above, self.axis.lower() == "z"):
                return found
        where = f"it lies at {self.axis} = {low:.6g} … {high:.6g} {self.unit}".rstrip()
        raise MeasureError(f"{self.outline} does not reach {self.axis} = {self.level:g}, or lies in that plane: {where}")

    def line(self, shape: Shape, x: Array) -> Array:
        """Coordinates (k, 2) in the plane of the one line of the cut, of points that differ.

        Raises
        ------
        MeasureError
            If there are none or several.

        """
        found = self.lines(shape, x)
        if len(found) > 1:
            raise MeasureError(f"{self} is {len(found)} lines; name a side on which the plane makes one")
        points = found[0].of(x)[:, self.plane]
        apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > DRAWN * np.ptp(points, axis=0).max()
        return np.asarray(points[np.concatenate([[True], apart])])


def _walked(faces: Index, heights: Array, above: Flags, body_left: bool) -> list[Line]:
    """Lines where nodes of faces (m, 4 | 6) change from below to above: walked into faces, seen from outside, where they rise."""
    after = np.roll(faces, -1, axis=1)
    rises, falls = ~above[faces] & above[after], above[faces] & ~above[after]
    following: dict[tuple[int, int], tuple[int, int]] = {}
    for f in np.flatnonzero(rises.any(axis=1)):
        turn = np.flatnonzero(rises[f] | falls[f])
        turn = np.roll(turn, -int(np.flatnonzero(rises[f, turn])[0]))
        for up, down in turn.reshape(-1, 2):
            ends = [(int(min(p)), int(max(p))) for p in ((faces[f, i], after[f, i]) for i in (up, down))]
            begin, end = ends[::-1] if body_left else ends
            following[begin] = end
    lines, inner = [], set(following.values())
    for start in [*(e for e in following if e not in inner), *following]:
        if start not in following:
            continue
        way = [start]
        while way[-1] in following:
            way.append(following.pop(way[-1]))
        nodes = np.array(way, dtype=np.int64)
        first, last = np.abs(heights[nodes]).T
        share = np.divide(first, first + last, out=np.full(len(nodes), 0.5), where=first + last > 0.0)
        lines.append(Line(nodes, np.stack([1.0 - share, share], axis=1), way[0] == way[-1]))
    return lines


Plain = Callable[["Shape", Array], float]


def barrel(cut: Cut) -> Plain:
    """Largest distance of a cut from the chord between its ends, positive outwards."""

    def value(shape: Shape, x: Array) -> float:
        points = cut.line(shape, x)
        way = points[-1] - points[0]
        chord = float(np.hypot(*way))
        if not chord > NEGLIGIBLE * float(np.ptp(points, axis=0).max()):
            raise MeasureError(f"{cut} is closed and has no chord; name a side with two ends")
        return float(((points - points[0]) @ np.array([way[1], -way[0]])).max() / chord)

    return value


def curvature(cut: Cut, a: Place, b: Place) -> Plain:
    """Curvature of the circle fitted to a cut between two places on it, positive where the body is convex."""

    def value(shape: Shape, x: Array) -> float:
        points = cut.line(shape, x)
        ends = sorted(_along(points, p.spot(shape, x).of(x)[list(cut.plane)]) for p in (a, b))
        places = [ends[0], *range(math.floor(ends[0]) + 1, math.ceil(ends[1])), ends[1]]
        at = np.array(places) if len(places) > 3 else np.linspace(ends[0], ends[1], 5)
        number = np.arange(len(points))
        return circle_curvature(np.stack([np.interp(at, number, c) for c in points.T], axis=1))

    return value


def angle(cut: Cut, a: Place, b: Place) -> Plain:
    """Direction of the way from a to b in the plane of a cut, in degrees from its first axis, −180 … 180."""

    def value(shape: Shape, x: Array) -> float:
        first, second = (b.spot(shape, x).of(x) - a.spot(shape, x).of(x))[list(cut.plane)]
        if first == second == 0.0:
            raise MeasureError(f"{a} and {b} are the same place")
        return math.degrees(math.atan2(second, first))

    return value


def _along(points: Array, p: Array) -> float:
    """Number of the segment of a line (k, 2) nearest to p (2,), and how far along it."""
    way = np.diff(points, axis=0)
    t = np.clip(((p - points[:-1]) * way).sum(axis=1) / (way**2).sum(axis=1), 0.0, 1.0)
    k = int(np.argmin(np.hypot(*(points[:-1] + t[:, None] * way - p).T)))
    return k + float(t[k])
