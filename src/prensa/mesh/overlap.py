"""Where an outline has passed through itself, and how deep: regions that it covers twice, or from the wrong side.

With the body on the left of its outline, the winding number of the outline is 1 in the body and 0 outside. Where two parts of the
body lie in one place it is 2, and where an outline is inside out it is −1. The rim of such a region consists of the pieces of the
outline, cut where it crosses itself, that have 2 on their left, or −1 on their right.

Area A and perimeter P of a region follow from its rim alone, and 2A/P is its mean depth: of a strip of two flanks that lie in
each other the way by which they would have to be drawn apart, of a needle half of what its blunt end is wide. Where an outline
crosses itself does not matter, at nodes, beside nodes or far from them: a cut too many has the same winding number on both sides.

The rim of a wrinkle is one stretch of the outline, that of two flanks are two. Where there are more, a wall has come out on the
far side of another, and how thick they are says nothing of how deep that is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.geometry.plane import cross
from prensa.mesh.crossing import apart, left, near
from prensa.mesh.mesh import POINTS_AT_ONCE
from prensa.precision import NEGLIGIBLE, SMALLEST
from prensa.types import Array, Flags, Index


class Overlap(NamedTuple):
    """A region of winding number 2 or −1: its centre (x, y) and mean ``depth``, twice its area over its perimeter (length).

    ``segments`` (k,) of the outline on its rim, in so many ``stretches``, the mean ``size`` (length) of them; ``pair``: two that
    cross.
    """

    x: float
    y: float
    depth: float
    size: float
    stretches: int
    segments: Index
    pair: tuple[int, int]


class _Pieces(NamedTuple):
    """Pieces of segments ``of`` (n,) of an outline from ``a`` to ``b`` (n, 2), and numbers of their ``ends`` (n, 2).

    Pieces of no length, from a node to a crossing at it, only connect others.
    """

    of: Index
    a: Array
    b: Array
    ends: Index

    @property
    def length(self) -> Array:
        return np.hypot(*(self.b - self.a).T)

    def following(self, ends: Index) -> Index:
        """Numbers (n,) of the pieces that follow on each along the outline of segments between nodes ends (m, 2)."""
        first = np.searchsorted(self.of, np.arange(len(ends)))
        leaving = np.zeros(ends.max() + 1, dtype=np.int64)
        leaving[ends[:, 0]] = first
        after = np.arange(1, len(self.of) + 1)
        last = np.append(first[1:], len(self.of)) - 1
        after[last] = leaving[ends[:, 1]]
        return after


def overlaps(points: Array, ends: Index) -> list[Overlap]:
    """Regions in which an outline lies in itself: segments between nodes ends (k, 2) of points (n, 2), the body on their left.

    Parts that only touch each other do not overlap.
    """
    first, second, at_first, at_second = _crossings(points, ends)
    if not len(first):
        return []
    size = np.hypot(*(points[ends[:, 1]] - points[ends[:, 0]]).T)
    pieces = _cut(points, ends, first, second, at_first, at_second)
    connecting = pieces.length <= NEGLIGIBLE * size[pieces.of]
    winding = _on_the_left(pieces, points[ends[:, 0]], points[ends[:, 1]])
    rim = ~connecting & ((winding == 2) | (winding == 0))
    counted, after = rim | connecting, pieces.following(ends)
    stretch = _joined(np.stack([np.arange(len(rim)), after], axis=1), counted & counted[after])
    found = []
    for own in _connected(pieces.ends, counted):
        own = own[rim[own]]
        # round about the centre: what is not quite closed has little area
        length = pieces.length[own]
        centre = length @ (0.5 * (pieces.a + pieces.b)[own]) / max(length.sum(), SMALLEST)
        a, b = pieces.a[own] - centre, pieces.b[own] - centre
        area = 0.5 * float((np.where(winding[own] == 2, 1.0, -1.0) * cross(a, b)).sum())
        segments = np.unique(pieces.of[own])
        of_rim = np.isin(first, segments) & np.isin(second, segments)
        if not len(own) or not of_rim.any():
            continue
        depth, mean = 2.0 * area / max(float(length.sum()), SMALLEST), float(size[segments].mean())
        if depth > NEGLIGIBLE * mean:
            k = int(np.argmax(of_rim))
            pair, stretches = (int(first[k]), int(second[k])), len(np.unique(stretch[own]))
            found.append(Overlap(float(centre[0]), float(centre[1]), depth, mean, stretches, segments, pair))
    return found


def _crossings(points: Array, ends: Index) -> tuple[Index, Index, Array, Array]:
    """Pairs of segments that cross or touch, and where on each (0 … 1); parallel ones meet others where they begin and end."""
    a, b = points[ends[:, 0]], points[ends[:, 1]]
    first, second = apart(ends, *near(a, b))
    of_second = left(a[first], b[first], np.stack([a[second], b[second]]))
    of_first = left(a[second], b[second], np.stack([a[first], b[first]]))
    size = np.hypot(*(b - a).T)
    nothing = NEGLIGIBLE * np.minimum(size[first], size[second])
    meet = np.ones(len(first), dtype=bool)
    for d in (of_first, of_second):
        meet &= (d[0] * d[1] <= 0.0) | (np.abs(d).min(axis=0) <= nothing)
        meet &= np.abs(d[0] - d[1]) > nothing
    of_first, of_second = of_first[:, meet], of_second[:, meet]
    at_first, at_second = (np.clip(d[0] / (d[0] - d[1]), 0.0, 1.0) for d in (of_first, of_second))
    return first[meet], second[meet], at_first, at_second


def _cut(points: Array, ends: Index, first: Index, second: Index, at_first: Array, at_second: Array) -> _Pieces:
    """The segments of an outline, cut where they cross."""
    m, crossing = len(ends), len(points) + np.arange(len(first))
    of = np.concatenate([np.arange(m), first, second, np.arange(m)])
    at = np.concatenate([np.zeros(m), at_first, at_second, np.ones(m)])
    number = np.concatenate([ends[:, 0], crossing, crossing, ends[:, 1]])
    order = np.lexsort((at, of))
    of, at, number = of[order], at[order], number[order]
    a, b = points[ends[of, 0]], points[ends[of, 1]]
    x = a + at[:, None] * (b - a)
    same = of[1:] == of[:-1]
    return _Pieces(of[:-1][same], x[:-1][same], x[1:][same], np.stack([number[:-1], number[1:]], axis=1)[same])


def _on_the_left(pieces: _Pieces, a: Array, b: Array) -> Index:
    """Winding numbers (n,) of an outline from a (m, 2) to b on the left of pieces of it, at their middles.

    An outline turns by half a turn about a place on it, seen from its left. Another part of it through the same place has that on
    its right where the two go opposite ways: they touch. Where they go the same way, it has on the earlier of them.
    """
    middle, out = 0.5 * (pieces.a + pieces.b), np.empty(len(pieces.of), dtype=np.int64)
    many = POINTS_AT_ONCE // len(a) + 1
    for start in range(0, len(middle), many):
        of, p = pieces.of[start : start + many], middle[start : start + many, None]
        u, v = a - p, b - p
        sine, cosine = cross(u, v), (u * v).sum(axis=-1)
        angle = np.arctan2(sine, cosine)
        through = (cosine < 0.0) & (np.abs(sine) <= NEGLIGIBLE * -cosine)
        along = (b - a)[of] @ (b - a).T > 0.0
        angle[through] = np.where(along & (of[:, None] > np.arange(len(a))), np.pi, -np.pi)[through]
        angle[np.arange(len(of)), of] = np.pi
        out[start : start + many] = np.rint(angle.sum(axis=1) / (2.0 * np.pi)).astype(np.int64)
    return out


def _connected(ends: Index, among: Flags) -> Iterator[Index]:
    """Numbers of pieces between ``ends`` (n, 2) that hang together, ``among`` (n,) those that count."""
    own = np.flatnonzero(among)
    group = _joined(ends[own], np.ones(len(own), dtype=bool))[ends[own, 0]]
    for k in np.unique(group):
        yield own[group == k]


def _joined(pairs: Index, among: Flags) -> Index:
    """Groups of numbers that pairs (n, 2) of them join, by number; of the pairs ``among`` (n,) those that count."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = int(pairs.max(initial=0)) + 1
    a, b = pairs[among].T
    joined = coo_array((np.ones(len(a)), (a, b)), shape=(count, count))
    return np.asarray(connected_components(joined, directed=False)[1])
