"""Surfaces of tools in space as triangles, for pictures: where the distance to a tool is zero, near the bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prensa.measures.tool_outlines import motion
from prensa.mesh.level_set import level_set
from prensa.output.mirrors import Image
from prensa.precision import DRAWN
from prensa.result.increment import ToolState
from prensa.types import Array, Index

TRACED = 40  # bricks along the longest side of the part of a tool that is traced
_CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


class Surface(NamedTuple):
    """``points`` (n, 3) in the tool's frame, ``normals`` (n, 3) out of the tool there, ``triangles`` (k, 3) of points."""

    points: Array
    normals: Array
    triangles: Index

    def at(self, state: ToolState) -> Array:
        """The points where a tool is."""
        turn, move = motion(state)
        return np.asarray(self.points @ turn.T + move)


def surface(tool: object, state: ToolState, low: Array, high: Array, beyond: float = 0.5) -> Surface:
    """The part of a tool's surface between two corners (3,) of a box in the tool's frame.

    Of a tool that has an end, all of it that is no farther outside of the box than a share ``beyond`` of the box's longest side.
    Any shape that has a distance is drawn: points of a grid are taken to the surface along its normals.
    """
    shape = tool.shape(np.array(state.direction), 0.0)  # type: ignore[attr-defined]
    if 0.0 < shape.extent < np.inf and not shape.cavity:
        more = beyond * float((high - low).max())
        low = np.minimum(low, np.maximum(low - more, -1.02 * shape.extent))
        high = np.maximum(high, np.minimum(high + more, 1.02 * shape.extent))
    points, cells = _grid(low, high)
    gap = shape.closest(points).g
    size = float((high - low).max()) / TRACED
    near = cells[(np.abs(gap[cells]) < 2.0 * size).any(axis=1)]
    found = level_set(near, gap)
    on = found.of(points)
    if not len(on):
        return Surface(on, on, found.triangles)
    foot = shape.closest(on)
    return Surface(on - foot.g[:, None] * foot.n, foot.n, found.triangles)


def _grid(low: Array, high: Array) -> tuple[Array, Index]:
    """Points (n, 3) and bricks (m, 8) of nearly equal sides that fill a box."""
    side = float((high - low).max()) / TRACED
    n = np.maximum(np.ceil((high - low) / side - 1e-9).astype(int), 1)
    lines = [np.linspace(a, b, k + 1) for a, b, k in zip(low, high, n)]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(n + 1)
    a, b, c = n
    return points, np.stack([number[i : a + i, j : b + j, k : c + k] for i, j, k in _CUBE], axis=-1).reshape(-1, 8)


def own_images(tool: object, states: Sequence[ToolState], made: Surface, images: Sequence[Image]) -> list[int]:
    """Which images of what was modelled leave a tool in all its states where it is: it is one with its images in these.

    Seen by distances from it, of points on its surface and before it, which are the same there.
    """
    if not len(made.points):
        return [0]
    shape = tool.shape(np.array(states[0].direction), 0.0)  # type: ignore[attr-defined]
    size, own = float(np.ptp(made.points, axis=0).max()), []
    x = np.concatenate([made.points, made.points + size * made.normals])
    gap = shape.closest(x).g
    for k, image in enumerate(images):
        turns, shifts = zip(*(_in_frame(image, state) for state in states))
        there = np.concatenate([np.reshape(turns, (-1, 9)), np.array(shifts) / size], axis=1)
        _, first = np.unique(np.round(there / DRAWN), axis=0, return_index=True)
        if all(np.abs(shape.closest(x @ turns[i].T + shifts[i]).g - gap).max() <= DRAWN * size for i in first):
            own.append(k)
    return own


def _in_frame(image: Image, state: ToolState) -> tuple[Array, Array]:
    """An image as a map of places in the frame of a tool: its matrix (3, 3) and shift (3,)."""
    if image.turn is None or image.shift is None:
        return np.eye(3), np.zeros(3)
    turn, move = motion(state)
    return turn.T @ image.turn @ turn, turn.T @ (image.turn @ move + image.shift - move)


def drawn_once(images: Sequence[Image], own: Sequence[int], size: float) -> list[int]:
    """The images in which a tool is drawn that is one with its images ``own``: one of those that show it at the same place."""
    kept: list[int] = []
    for k, image in enumerate(images):
        if not any(_same(images[r], images[h], image, size) for r in kept for h in own):
            kept.append(k)
    return kept


def _same(first: Image, then: Image, image: Image, size: float) -> bool:
    """Whether an image is another one of what a third shows."""
    x = size * np.concatenate([np.zeros((1, 3)), np.eye(3)])
    return bool(np.abs(first.of(then.of(x)) - image.of(x)).max() <= DRAWN * size)


def frame_box(boxes: Array, states: list[ToolState], margin: float) -> tuple[Array, Array]:
    """Corners of what boxes (t, 2, 3) of the bodies cover in the frame of a tool whose states are those of t moments."""
    ends = []
    for box, state in zip(boxes, states):
        turn, move = motion(state)
        corners = np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
        ends.append((corners - move) @ turn)
    inside = np.concatenate(ends)
    return inside.min(axis=0) - margin, inside.max(axis=0) + margin
