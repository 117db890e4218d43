"""The outline of a tool as a line with its own coordinate: the arc length s that contact uses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from prensa.geometry.plane import ONE_NORMAL, rotated, turned
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.result.increment import ToolState
from prensa.tools.analytic import Closest
from prensa.tools.place import PlacedTool
from prensa.types import Array, Index


@dataclass(frozen=True)
class Outline:
    """A tool's outline in its own frame: ``s`` (n,) increasing, ``x`` (n, 2), walked with the tool on the left."""

    tool: PlacedTool
    s: Array
    x: Array

    def at(self, s: Array) -> Array:
        """Places (k, 2) in the tool's frame at coordinates s (k,), on chords of the sampled outline."""
        period = self.tool.shape.period
        wrapped = None if np.isinf(period) else period
        return np.column_stack([np.interp(s, self.s, self.x[:, k], period=wrapped) for k in range(2)])

    def corners(self) -> Array:
        """Coordinates (k,) of the sharp corners."""
        closed = np.isfinite(self.tool.shape.period)
        x = np.vstack([self.x[-1:], self.x, self.x[:1]]) if closed else self.x
        d = np.diff(x, axis=0)
        angle = np.unwrap(np.arctan2(d[:, 1], d[:, 0]))
        sharp = np.cos(np.diff(angle)) < ONE_NORMAL
        return np.asarray((self.s if closed else self.s[1:-1])[sharp])


def outline_of(tool: PlacedTool, size: float) -> Outline:
    """The outline of a placed tool; ``size`` (length): how far to follow one that has no end."""
    x = np.concatenate(tool.description.outline(size))
    if tool.description.direction_key:
        x = rotated(x, float(np.arctan2(tool.direction[0], -tool.direction[1])))
    close = tool.shape.closest(x)
    on = np.abs(close.g) <= DRAWN * size  # what closes an endless tool lies inside
    x, s = x[on] - close.g[on, None] * close.n[on], np.asarray(close.s)[on]
    order = np.argsort(s, kind="stable")
    s, x = s[order], x[order]
    keep = np.concatenate([[True], np.diff(s) > NEGLIGIBLE * size])
    return Outline(tool, s[keep], x[keep])


def in_frame(x: Array, state: ToolState) -> Array:
    """Places (k, 2) in the frame of a tool in a state."""
    moved = x - (state.at + np.array(state.place[:2]))
    return moved if state.place[2] == 0.0 else rotated(moved, -state.place[2])


def in_space(xi: Array, state: ToolState) -> Array:
    """Places (k, 2) of points of the tool's frame."""
    there = xi if state.place[2] == 0.0 else rotated(xi, state.place[2])
    return np.asarray(there + (state.at + np.array(state.place[:2])))


def feet(tool: PlacedTool, state: ToolState, x: Array) -> tuple[Closest, Array, Array]:
    """Closest points of places x (k, 2) on a tool in a state: in its frame, and unit normal and tangent (k, 2) in space."""
    close = tool.shape.closest(in_frame(x, state))
    n = close.n if state.place[2] == 0.0 else rotated(close.n, state.place[2])
    return close, n, turned(n)


def joined(x: Array, weight: Array, depth: Array) -> Index:
    """Positions (j,) of nodes x (k, 2) of a contact that are joined to the next one.

    Two nodes are the ends of an edge if their tributary areas (k,) reach at least half of the way between them; a surface of
    several sides may leap from the end of one to the next. ``depth`` (k,): thickness, or 2πr.
    """
    way = np.hypot(*np.diff(x, axis=0).T) * 0.5 * (depth[1:] + depth[:-1])
    return np.flatnonzero(weight[1:] + weight[:-1] >= 0.5 * way)
