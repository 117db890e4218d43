"""Outlines of tools as polygons, for pictures: the description gives the shape, the increment the place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prensa.model.chain import drawn, outline_of, signed_area
from prensa.model.problem import Circle, Plane, Polygon, Profile, Ring, Stamp, Tool
from prensa.solver.increment import ToolState

Array = NDArray[np.float64]


def outlines(tool: Tool, state: ToolState, depth: float, axisymmetric: bool = False) -> list[Array]:
    """Closed polygons, each (n, 2), of *tool* at its current place.

    Parameters
    ----------
    tool, state
        Description and place.
    depth
        Extent to draw of what has none: the body of a plane, stamp or ring behind its face, the width of a plane.
    axisymmetric
        Also return the other half of the section, x → −x, of what is not its own mirror image.

    """
    place = np.array(state.at, dtype=float) + state.place[:2]
    polygons = [_turn(p, _angle(tool, state)) + place for p in _local(tool, depth)]
    if axisymmetric and not _centred(tool, state):
        polygons += [p * (-1.0, 1.0) for p in polygons]
    return polygons


def _local(tool: Tool, depth: float) -> list[Array]:
    """Polygons about the reference point with the face looking along −y."""
    if isinstance(tool, Circle):
        angle = np.linspace(0.0, 2 * np.pi, 721)[:-1]
        circle = tool.radius * np.column_stack([np.cos(angle), np.sin(angle)])
        return [_around(circle, depth)] if tool.concave else [circle]
    if isinstance(tool, Profile | Polygon):
        return [_chain(tool, depth)]
    if isinstance(tool, Plane):
        return [_block(-depth, depth, depth, 0.0)]
    if isinstance(tool, Stamp):
        return [_block(-tool.width / 2, tool.width / 2, depth, tool.fillet)]
    assert isinstance(tool, Ring)
    return [_block(tool.inner, tool.outer, depth, tool.fillet)]


def _chain(tool: Profile | Polygon, depth: float) -> Array:
    """Outline of a chain; the ends of an open one are closed far inside the tool."""
    pieces, closed = outline_of(tool)
    line = np.array(drawn(pieces, depth))
    if closed:
        return _around(line, depth) if signed_area(pieces) < 0 else line
    # back to the start around the tool, which is on the left: push both ends there
    way = line[-1] - line[0]
    left = depth * np.array([-way[1], way[0]]) / max(float(np.hypot(*way)), 1e-300)
    if pieces[0].direction[0] * pieces[-1].direction[0] + pieces[0].direction[1] * pieces[-1].direction[1] < -0.5:
        return line  # flanks that lie side by side
    return np.vstack([line, line[-1] + left, line[0] + left])


def _around(hole: Array, depth: float) -> Array:
    """Polygon of what surrounds a hole: out along a seam, around a square, back in."""
    lo, hi = hole.min(axis=0) - 0.5 * depth, hole.max(axis=0) + 0.5 * depth
    square = np.array([(lo[0], lo[1]), (hi[0], lo[1]), (hi[0], hi[1]), (lo[0], hi[1])])
    hole = np.roll(hole, -int(np.argmin(((hole - square[0]) ** 2).sum(axis=1))), axis=0)
    after = np.roll(hole, -1, axis=0)
    if (hole[:, 0] * after[:, 1] - hole[:, 1] * after[:, 0]).sum() > 0:
        square = square[[0, 3, 2, 1]]
    return np.vstack([hole, hole[:1], square, square[:1]])


def _block(left: float, right: float, depth: float, fillet: float) -> Array:
    """Rectangle above y = 0 whose two lower corners are rounded."""
    angle = np.linspace(0.0, np.pi / 2, 25 if fillet else 1)
    quarter = fillet * np.column_stack([1 - np.cos(angle), 1 - np.sin(angle)])
    lower_left = quarter + np.array([left, 0.0])
    lower_right = quarter[::-1] * (-1.0, 1.0) + np.array([right, 0.0])
    return np.vstack([[(left, depth)], lower_left, lower_right, [(right, depth)]])


def _angle(tool: Tool, state: ToolState) -> float:
    """Angle from −y to the direction of the face."""
    if isinstance(tool, Circle | Profile | Polygon):
        return state.place.rz
    x, y = state.direction
    return float(np.arctan2(x, -y)) + state.place.rz


def _turn(points: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def _centred(tool: Tool, state: ToolState) -> bool:
    """Whether the section of the tool is its own mirror image about the axis."""
    if isinstance(tool, Ring | Profile | Polygon):
        return False
    on_axis = bool(abs(state.at[0] + state.place.x) < 1e-12 * (1.0 + float(np.abs(state.at).max())))
    return on_axis if isinstance(tool, Circle) else abs(state.direction[0]) < 1e-12
