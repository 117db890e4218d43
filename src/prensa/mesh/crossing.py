"""Straight segments that meet: outlines that pass through themselves or through one another."""

from __future__ import annotations

import numpy as np

from prensa.geometry.plane import cross
from prensa.precision import NEGLIGIBLE, SMALLEST
from prensa.types import Array, Index

RIGHT_ANGLE, STRAIGHT_BACK = 0.5 * np.pi * (1.0 - NEGLIGIBLE), np.pi * (1.0 - NEGLIGIBLE)


def turns_back(x: Array) -> bool:
    """Whether somewhere a closed outline at x (m, 2), with the body on its left, turns to the right by a right angle or more.

    One that does not lies nowhere in itself, nor do two of its sides face each other across a void. With the way across, the part
    of it around a void makes a closed line that turns by −2π, of which the two corners at the ends of that way are less than
    π each; sides that face each other by more than a right angle leave −π/2 or less to the part. An outline that turns by 2π in
    all and crosses itself consists of a loop to the left and one to the right, which by itself turns by −π or less.
    """
    t = np.empty_like(x)
    np.subtract(x[1:], x[:-1], out=t[:-1])
    np.subtract(x[0], x[-1], out=t[-1])
    on = np.concatenate([t[1:], t[:1]])
    sine, cosine = cross(t, on), t[:, 0] * on[:, 0] + t[:, 1] * on[:, 1]
    turn = np.arctan2(sine, cosine)
    if turn.max() >= STRAIGHT_BACK or (not cosine.all() and not (sine.astype(bool) | cosine.astype(bool)).all()):
        return True  # back along itself, or a piece without a length
    so_far = np.concatenate([[0.0], np.cumsum(np.concatenate([turn, turn]))])
    if np.rint(so_far[len(x)] / (2.0 * np.pi)) != 1.0:
        return True
    return bool((np.maximum.accumulate(so_far) - so_far).max() >= RIGHT_ANGLE)


def near(a: Array, b: Array) -> tuple[Index, Index]:
    """Pairs of segments from a (k, 2) to b whose boxes overlap, each once; found along x."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    order = np.argsort(low[:, 0])
    # one after those that begin before this one ends
    last = np.searchsorted(low[order, 0], high[order, 0], side="right")
    count = last - np.arange(len(order)) - 1
    i = np.repeat(np.arange(len(order)), count)
    j = np.arange(len(i)) - np.repeat(np.cumsum(count) - count, count) + i + 1
    i, j = order[i], order[j]
    meet = (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
    return i[meet], j[meet]


def apart(ends: Index, first: Index, second: Index) -> tuple[Index, Index]:
    """Of pairs of segments between nodes ends (k, 2), those without a common node."""
    keep = (ends[first][:, :, None] != ends[second][:, None, :]).all(axis=(1, 2))
    return first[keep], second[keep]


def left(a: Array, b: Array, x: Array) -> Array:
    """Distance of places x (2, n, 2) from the lines from a (n, 2) to b, positive on the left → (2, n)."""
    t, r = b - a, x - a
    return np.asarray(cross(t, r) / np.maximum(np.hypot(t[:, 0], t[:, 1]), SMALLEST))


def meeting(points: Array, ends: Index) -> tuple[float, float] | None:
    """A place where two segments between nodes ends (k, 2) of points (n, 2) cross or touch; None if no two do.

    Segments with a common node do not count.
    """
    a, b = points[ends[:, 0]], points[ends[:, 1]]
    first, second = apart(ends, *near(a, b))
    of_second = left(a[first], b[first], np.stack([a[second], b[second]]))
    of_first = left(a[second], b[second], np.stack([a[first], b[first]]))
    met = np.flatnonzero((of_second[0] * of_second[1] <= 0) & (of_first[0] * of_first[1] <= 0))
    if not len(met):
        return None
    k = met[0]
    share = np.abs(of_second[:, k])
    way = share[0] / share.sum() if share.sum() > 0 else 0.5
    x, y = a[second[k]] + way * (b[second[k]] - a[second[k]])
    return float(x), float(y)
