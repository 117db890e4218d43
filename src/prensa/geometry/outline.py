"""Polygons of sections, for pictures, and how wide they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from prensa.geometry.chain import Piece, drawn, signed_area
from prensa.geometry.plane import cross
from prensa.precision import SMALLEST
from prensa.types import Array


def of_chain(pieces: Sequence[Piece], closed: bool, depth: float) -> Array:
    """Outline of a chain; the ends of an open one are closed far inside the tool."""
    line = np.array(drawn(pieces, depth))
    if closed:
        return around(line, depth) if signed_area(pieces) < 0 else line
    # back to the start around the tool, which is on the left: push both ends there
    way = line[-1] - line[0]
    left = depth * np.array([-way[1], way[0]]) / max(float(np.hypot(*way)), SMALLEST)
    if pieces[0].direction[0] * pieces[-1].direction[0] + pieces[0].direction[1] * pieces[-1].direction[1] < -0.5:
        return line  # flanks that lie side by side
    return np.vstack([line, line[-1] + left, line[0] + left])


def around(hole: Array, depth: float) -> Array:
    """Polygon of what surrounds a hole: out along a seam, around a square, back in."""
    lo, hi = hole.min(axis=0) - 0.5 * depth, hole.max(axis=0) + 0.5 * depth
    square = np.array([(lo[0], lo[1]), (hi[0], lo[1]), (hi[0], hi[1]), (lo[0], hi[1])])
    hole = np.roll(hole, -int(np.argmin(((hole - square[0]) ** 2).sum(axis=1))), axis=0)
    after = np.roll(hole, -1, axis=0)
    if cross(hole, after).sum() > 0:
        square = square[[0, 3, 2, 1]]
    return np.vstack([hole, hole[:1], square, square[:1]])


def nearest_to_box(polygon: Array, low: Array, high: Array) -> Array:
    """The place (2,) on the sides of a polygon (n, 2) that is nearest to a box.

    It is an end of a side, where that crosses a line of the box, or the foot of a corner of the box on it.
    """
    way = np.roll(polygon, -1, axis=0) - polygon
    crossings = [(end - polygon)[:, k] / np.where(way[:, k] == 0.0, np.inf, way[:, k]) for end in (low, high) for k in (0, 1)]
    length = np.maximum((way**2).sum(axis=1), SMALLEST)
    feet = [(((x, y) - polygon) * way).sum(axis=1) / length for x in (low[0], high[0]) for y in (low[1], high[1])]
    share = np.clip([np.zeros(len(polygon)), *crossings, *feet], 0.0, 1.0)[:, :, None]
    points = (polygon + share * way).reshape(-1, 2)
    away = points - np.clip(points, low, high)
    return np.asarray(points[np.argmin(np.hypot(*away.T))])


def block(left: float, right: float, depth: float, fillet: float) -> Array:
    """Rectangle above y = 0 whose two lower corners are rounded."""
    angle = np.linspace(0.0, np.pi / 2, 25 if fillet else 1)
    quarter = fillet * np.column_stack([1 - np.cos(angle), 1 - np.sin(angle)])
    lower_left = quarter + np.array([left, 0.0])
    lower_right = quarter[::-1] * (-1.0, 1.0) + np.array([right, 0.0])
    return np.vstack([[(left, depth)], lower_left, lower_right, [(right, depth)]])


def width(lines: Sequence[Array], depth: float) -> tuple[float, float]:
    """Width along the second coordinate of what of polylines, each (n, 2), lies within ``depth`` of the end of the first.

    And the width of the whole.
    """
    whole = np.concatenate(lines)
    level = whole[:, 0].max() - depth
    near = [whole[whole[:, 0] >= level, 1]]
    for line in lines:  # where a part passes the level
        (a, p), (b, q) = line[:-1].T, line[1:].T
        passes = (a - level) * (b - level) < 0
        near.append((p + (q - p) * (a - level) / np.where(passes, a - b, 1.0))[passes])
    return float(np.ptp(np.concatenate(near))), float(np.ptp(whole[:, 1]))
