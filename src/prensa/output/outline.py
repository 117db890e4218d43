"""Outlines of tools as polygons, for pictures: the description gives the shape, the increment the place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prensa.model.problem import Circle, Plane, Ring, Stamp, Tool
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
        return [tool.radius * np.column_stack([np.cos(angle), np.sin(angle)])]
    if isinstance(tool, Plane):
        return [_block(-depth, depth, depth, 0.0)]
    if isinstance(tool, Stamp):
        return [_block(-tool.width / 2, tool.width / 2, depth, tool.fillet)]
    assert isinstance(tool, Ring)
    return [_block(tool.inner, tool.outer, depth, tool.fillet)]


def _block(left: float, right: float, depth: float, fillet: float) -> Array:
    """Rectangle above y = 0 whose two lower corners are rounded."""
    angle = np.linspace(0.0, np.pi / 2, 25 if fillet else 1)
    quarter = fillet * np.column_stack([1 - np.cos(angle), 1 - np.sin(angle)])
    lower_left = quarter + np.array([left, 0.0])
    lower_right = quarter[::-1] * (-1.0, 1.0) + np.array([right, 0.0])
    return np.vstack([[(left, depth)], lower_left, lower_right, [(right, depth)]])


def _angle(tool: Tool, state: ToolState) -> float:
    """Angle from −y to the direction of the face."""
    if isinstance(tool, Circle):
        return state.place.rz
    x, y = state.direction
    return float(np.arctan2(x, -y)) + state.place.rz


def _turn(points: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def _centred(tool: Tool, state: ToolState) -> bool:
    """Whether the section of the tool is its own mirror image about the axis."""
    if isinstance(tool, Ring):
        return False
    on_axis = bool(abs(state.at[0] + state.place.x) < 1e-12 * (1.0 + float(np.abs(state.at).max())))
    return on_axis if isinstance(tool, Circle) else abs(state.direction[0]) < 1e-12
