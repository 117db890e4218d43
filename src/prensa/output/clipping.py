"""Triangles of tools for pictures in space: cut off at a box, and small enough to be sorted by their distance from the viewer."""

from __future__ import annotations

import numpy as np

from prensa.types import Array, Flags


def within(triangles: Array, low: Array, high: Array, longest: float) -> Array:
    """What of triangles (m, 3, 3) lies in a box from low to high (3,), with no side longer than that: (k, 3, 3)."""
    for axis in range(3):
        triangles = _cut(triangles, triangles[:, :, axis] - low[axis])
        triangles = _cut(triangles, high[axis] - triangles[:, :, axis])
    return _divided(triangles, longest)


def _cut(t: Array, height: Array) -> Array:
    """What of triangles (m, 3, 3) has positive heights, (m, 3) at their corners."""
    up = height > 0.0
    count = up.sum(axis=1)
    one, a = _alone_first(t, height, up, count == 1)
    two, b = _alone_first(t, height, ~up, count == 2)
    corner, left, right = one[:, 0], _between(one, a, 1), _between(one, a, 2)
    from_left, from_right = _between(two, b, 1), _between(two, b, 2)
    return np.concatenate([
        t[count == 3], np.stack([corner, left, right], axis=1),
        np.stack([from_left, two[:, 1], two[:, 2]], axis=1), np.stack([from_left, two[:, 2], from_right], axis=1),
    ])  # fmt: skip


def _alone_first(t: Array, height: Array, alone: Flags, rows: Flags) -> tuple[Array, Array]:
    """Corners and heights of some triangles, the one corner first that is alone on its side."""
    turn = (np.argmax(alone[rows], axis=1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(t[rows], turn[:, :, None], axis=1), np.take_along_axis(height[rows], turn, axis=1)


def _between(t: Array, height: Array, k: int) -> Array:
    """Places (m, 3) of height 0 on the sides from the first corner to another."""
    share = height[:, 0] / (height[:, 0] - height[:, k])
    return np.asarray(t[:, 0] + share[:, None] * (t[:, k] - t[:, 0]))


def _divided(t: Array, longest: float) -> Array:
    """Triangles halved at their longest sides until none is longer."""
    done: list[Array] = []
    while len(t):
        side = np.linalg.norm(np.roll(t, -1, axis=1) - t, axis=2)
        long = side.max(axis=1) > longest
        done.append(t[~long])
        t, first = t[long], np.argmax(side[long], axis=1)
        t = np.take_along_axis(t, ((first[:, None] + np.arange(3)) % 3)[:, :, None], axis=1)
        middle = 0.5 * (t[:, 0] + t[:, 1])
        t = np.concatenate([np.stack([t[:, 0], middle, t[:, 2]], axis=1), np.stack([middle, t[:, 1], t[:, 2]], axis=1)])
    return np.concatenate([*done, np.zeros((0, 3, 3))])
