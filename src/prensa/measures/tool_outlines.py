"""Outlines of tools as polygons, for pictures: the description gives the shape, the increment the place."""

from __future__ import annotations

import numpy as np

from prensa.geometry.plane import rotated
from prensa.result.increment import ToolState
from prensa.tools.tool import ToolShape, rotation_of
from prensa.types import Array, Index


def outlines(tool: ToolShape, state: ToolState, depth: float, axisymmetric: bool = False) -> list[Array]:
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
    polygons = [rotated(p, _angle(tool, state)) + place for p in tool.outline(depth)]
    on_axis = bool(abs(state.at[0] + state.place.x) < 1e-12 * (1.0 + float(np.abs(state.at).max())))
    if axisymmetric and not tool.mirrored(on_axis, np.array(state.direction)):
        polygons += [p * (-1.0, 1.0) for p in polygons]
    return polygons


def surface(tool: ToolShape, state: ToolState, depth: float) -> tuple[Array, Index]:
    """Triangles of *tool* in space at its current place: points (n, 3), and three of them for each (m, 3).

    ``depth``: extent (length) to draw of what has none.
    """
    points, triangles = tool.facets(np.array(state.direction), depth)
    turn, place = motion(state)
    return np.asarray(points @ turn.T + place, dtype=np.float64), triangles


def motion(state: ToolState) -> tuple[Array, Array]:
    """Rotation (3, 3) and place (3,) of a tool's frame in space."""
    turn = state.orientation or state.place[3:]
    return rotation_of(turn), np.asarray(state.at + np.array(state.place[:3]))


def _angle(tool: ToolShape, state: ToolState) -> float:
    """Angle from −y to the direction of the face."""
    if not tool.direction_key:
        return state.place.rz
    x, y = state.direction
    return float(np.arctan2(x, -y)) + state.place.rz
