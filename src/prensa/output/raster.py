"""Triangles in front of one another, pixel by pixel, for pictures of bodies in space.

Matplotlib sorts the polygons of a picture by their middles, which is wrong where long ones cross or a tool lies on a body.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from prensa.geometry.plane import cross
from prensa.types import Array, Flags, Index

MOST_PIXELS = 2_000_000  # pairs of triangles and pixels that are looked at together: some hundred megabytes


class Seen(NamedTuple):
    """What is in front: ``pixel`` (p,) in rows from below, ``triangle`` (p,), ``weights`` (p, 3) of its corners, ``depth``."""

    pixel: Index
    triangle: Index
    weights: Array
    depth: Array

    def of(self, corners: Array) -> Array:
        """Values (t, 3, …) at the corners of the triangles, at the pixels (p, …)."""
        w = self.weights.reshape(*self.weights.shape, *[1] * (corners.ndim - 2))
        return np.asarray((w * corners[self.triangle]).sum(axis=1))


def seen(xy: Array, depth: Array, wide: int, high: int, off: Array | None = None) -> Seen:
    """The nearest of triangles at each pixel that any covers.

    Parameters
    ----------
    xy
        (t, 3, 2) corners in pixels.
    depth
        (t, 3) distances towards the eye.
    wide, high
        Size of the picture in pixels.
    off
        (t, 3) values at the corners, linear between them; what is positive is cut away.

    """
    nearest = np.full(wide * high, -np.inf)
    triangle, first, second = np.zeros(wide * high, dtype=np.int64), np.zeros(wide * high), np.zeros(wide * high)
    planes = _planes(xy)
    which, row, start, count = _spans(xy, planes, wide, high)
    for some in _pieces(count):
        t = np.repeat(which[some], count[some])
        x = np.arange(len(t)) - np.repeat(np.cumsum(count[some]) - count[some], count[some]) + np.repeat(start[some], count[some])
        y = np.repeat(row[some], count[some])
        (a0, b0, c0), (a1, b1, c1) = planes[t, 0].T, planes[t, 1].T
        w0, w1 = a0 * (x + 0.5) + b0 * (y + 0.5) + c0, a1 * (x + 0.5) + b1 * (y + 0.5) + c1
        z, flat = _linear(depth, t, w0, w1), x + wide * y
        if off is not None:
            z[_linear(off, t, w0, w1) > 0.0] = -np.inf
        np.maximum.at(nearest, flat, z)
        best = (z >= nearest[flat]) & (z > -np.inf)
        at = flat[best]
        triangle[at], first[at], second[at] = t[best], w0[best], w1[best]
    pixel = np.flatnonzero(nearest > -np.inf)
    weights = np.stack([first[pixel], second[pixel], 1.0 - first[pixel] - second[pixel]], axis=1)
    return Seen(pixel, triangle[pixel], weights, nearest[pixel])


def on_sides(found: Seen, xy: Array, drawn: Flags, width: float) -> Array:
    """Share (p,) of a line of a width in pixels along sides of triangles that covers a pixel.

    ``drawn`` (t, 3): whether the side across from a corner is one of a face.
    """
    corner = xy[found.triangle]
    sides = np.linalg.norm(np.roll(corner, -1, axis=1) - np.roll(corner, -2, axis=1), axis=2)
    area = np.abs(_areas(corner))
    away = found.weights * area[:, None] / np.maximum(sides, np.finfo(float).tiny)
    nearest = np.where(drawn[found.triangle], away, np.inf).min(axis=1)
    return np.asarray(np.clip(0.5 * width + 0.5 - nearest, 0.0, 1.0))


# ------------------------------------------------------------------------------------------------------------- details
def _areas(xy: Array) -> Array:
    """Twice the areas (t,) of triangles (t, 3, 2), negative where their corners go round clockwise."""
    a, b = xy[:, 1] - xy[:, 0], xy[:, 2] - xy[:, 0]
    return cross(a, b)


def _planes(xy: Array) -> Array:
    """(t, 3, 3) numbers a, b, c of the weights a x + b y + c of the corners; not finite where a triangle is seen edge on."""
    after, before = np.roll(xy, -1, axis=1), np.roll(xy, -2, axis=1)
    a, b = after[..., 1] - before[..., 1], before[..., 0] - after[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.stack([a, b, -a * after[..., 0] - b * after[..., 1]], axis=-1) / _areas(xy)[:, None, None])


def _spans(xy: Array, planes: Array, wide: int, high: int) -> tuple[Index, Index, Index, Index]:
    """Rows of pixels in triangles: triangle (r,), row (r,), the first pixel (r,) there and how many (r,)."""
    low = np.clip(np.ceil(xy[..., 1].min(axis=1) - 0.5), 0, high).astype(np.int64)
    rows = np.clip(np.floor(xy[..., 1].max(axis=1) - 0.5) + 1, 0, high).astype(np.int64) - low
    rows = np.where((rows > 0) & np.isfinite(planes).all(axis=(1, 2)), rows, 0)
    which = np.repeat(np.arange(len(xy)), rows)
    row = low[which] + np.arange(len(which)) - np.repeat(np.cumsum(rows) - rows, rows)
    a, rest = planes[which, :, 0], planes[which, :, 1] * (row[:, None] + 0.5) + planes[which, :, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -rest / a
    left = np.where(a > 0.0, crossing, np.where((a == 0.0) & (rest < 0.0), np.inf, -np.inf)).max(axis=1)
    right = np.where(a < 0.0, crossing, np.inf).min(axis=1)
    start = np.clip(np.ceil(left - 0.5), 0, wide)
    count = np.clip(np.floor(right - 0.5) + 1, 0, wide) - start
    some = count > 0
    return which[some], row[some], start[some].astype(np.int64), count[some].astype(np.int64)


def _pieces(pairs: Index) -> list[slice]:
    """Slices of rows with about `MOST_PIXELS` pixels together."""
    number = np.cumsum(pairs) // MOST_PIXELS
    ends = np.flatnonzero(np.diff(number, prepend=-1, append=-1))
    return [slice(a, b) for a, b in pairwise(ends.tolist())]


def _linear(corners: Array, t: Index, w0: Array, w1: Array) -> Array:
    """Values (k,) between those (t, 3) at the corners of triangles."""
    c0, c1, c2 = corners[t].T
    return np.asarray(c2 + w0 * (c0 - c2) + w1 * (c1 - c2))
