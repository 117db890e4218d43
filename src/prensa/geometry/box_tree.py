"""Trees of boxes, in which searches leave out what is far."""

from __future__ import annotations

import numpy as np

from prensa.types import Array, Index


def box_tree(low: Array, high: Array, middle: Array) -> tuple[Array, Index]:
    """Binary heap of boxes (2 l, 6), lowest corner and highest, and the numbers (l,) of the things in its leaves, −1: none.

    Things lie in boxes from ``low`` to ``high`` (m, 3) and are divided by their ``middle`` (m, 3). Node 1 is the root, i has the
    children 2 i and 2 i + 1, and the l leaves come last.
    """
    m = len(middle)
    leaves = 1 << max(m - 1, 0).bit_length()
    order = np.full(leaves, -1)
    order[:m] = np.arange(m)
    centre = np.full((leaves + 1, 3), np.inf)  # the last row is that of nothing
    centre[:m] = middle
    blocks = 1
    while blocks < leaves:
        rows = order.reshape(blocks, -1)
        at = centre[rows]
        known = np.isfinite(at)
        width = np.where(known, at, -np.inf).max(axis=1) - np.where(known, at, np.inf).min(axis=1)
        key = np.take_along_axis(at, np.argmax(width, axis=1)[:, None, None], axis=2)[:, :, 0]
        order = np.take_along_axis(rows, np.argsort(key, axis=1, kind="stable"), axis=1).ravel()
        blocks *= 2
    boxes = np.tile([np.inf] * 3 + [-np.inf] * 3, (2 * leaves, 1))
    there = order >= 0
    boxes[leaves:][there] = np.concatenate([low, high], axis=1)[order[there]]
    first = leaves
    while first > 1:
        pairs = boxes[first : 2 * first].reshape(-1, 2, 6)
        first //= 2
        boxes[first : 2 * first, :3] = pairs[:, :, :3].min(axis=1)
        boxes[first : 2 * first, 3:] = pairs[:, :, 3:].max(axis=1)
    return boxes, order
