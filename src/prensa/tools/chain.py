"""A tool bounded by a chain of lines and arcs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from math import isfinite

import numpy as np

from prensa.geometry.chain import Piece, corner, signed_area
from prensa.geometry.outline import width
from prensa.precision import DRAWN, NEGLIGIBLE, ROUND_OFF, SMALLEST
from prensa.tools import projection
from prensa.tools.analytic import Closest
from prensa.types import Array


class Chain:
    """A rigid tool on the left of a chain of `Piece`s (tool frame), endless where its first and last pieces are.

    ``radius``: smallest radius of curvature of a convex part, 0 with sharp convex corners; ``period``: length of a
    closed chain, inf of an open one; ``cavity``: whether it is closed with the tool outside; ``size``: a length;
    ``edges`` (k, 4): sharp convex corners and unit vectors across their mean normals; ``centre`` (2,) of a closed one.
    """

    half_space = False
    cylinder = np.inf

    def __init__(self, pieces: Sequence[Piece], closed: bool) -> None:
        self.pieces, self.closed = tuple(pieces), closed
        ends = np.array([p.at(t) for p in pieces for t in (p.lo, p.hi) if isfinite(t)] or [pieces[0].origin])
        self.size = float(max(np.abs(ends).max(), SMALLEST))
        self.centre = 0.5 * (ends.min(axis=0) + ends.max(axis=0))
        self.period = sum(p.length for p in pieces) if closed else np.inf
        self.cavity = closed and signed_area(pieces) < 0
        self._table = self._rows()
        self._lengths()

    def _rows(self) -> Array:
        """Rows of `projection`, of which `_lengths` fills in where their coordinates begin."""
        pieces, rows = self.pieces, []
        joints = [_joint(pieces[i - 1], p) for i, p in enumerate(pieces)]
        for i, p in enumerate(pieces):
            row = [0.0] * projection.COLUMNS
            row[projection.X], row[projection.Y] = p.origin
            row[projection.LO], row[projection.HI] = p.lo, p.hi
            row[projection.DX], row[projection.DY] = p.direction
            if p.radius:
                middle = p.angle + p.side * 0.5 * (p.lo + p.hi) / p.radius
                half = 0.5 * p.length
                row[projection.DX], row[projection.DY] = float(np.cos(middle)), float(np.sin(middle))
                row[projection.COS] = float(np.cos(half / p.radius))
                row[projection.R], row[projection.SIDE], row[projection.HALF] = p.radius, p.side, half
            if isfinite(p.lo):
                row[projection.AX], row[projection.AY] = p.at(p.lo)
                row[projection.NAX], row[projection.NAY], row[projection.SA] = joints[i]
            if isfinite(p.hi):
                row[projection.BX], row[projection.BY] = p.at(p.hi)
                row[projection.NBX], row[projection.NBY], row[projection.SB] = joints[(i + 1) % len(pieces)]
            rows.append(row)
        return np.array(rows)

    def _lengths(self) -> None:
        s = 0.0
        for p, row in zip(self.pieces, self._table):
            if not isfinite(p.lo):
                s = p.hi if isfinite(p.hi) else 0.0
                row[projection.S] = 0.0
                continue
            row[projection.S] = s + row[projection.HALF] if p.radius else s - p.lo
            s += p.length

    @cached_property
    def _boxes(self) -> Array:
        """Heap of boxes (least x, largest x, least y, largest y); leaves are the pieces, the empty ones never near."""
        # A full binary tree, so that children are found by arithmetic; a linear search over 2000 pieces would dominate an
        # evaluation.
        leaves = 1 << max(len(self.pieces) - 1, 0).bit_length()
        boxes = np.tile([np.inf, -np.inf, np.inf, -np.inf], (2 * leaves, 1))
        slack = ROUND_OFF * self.size
        for i, p in enumerate(self.pieces):
            x0, x1, y0, y1 = p.box
            boxes[leaves + i] = x0 - slack, x1 + slack, y0 - slack, y1 + slack
        for i in range(leaves - 1, 0, -1):
            a, b = boxes[2 * i], boxes[2 * i + 1]
            boxes[i] = min(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3])
        return boxes

    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`."""
        k = len(xi)
        out = Closest(np.empty(k), np.empty((k, 2)), np.empty(k), np.empty(k))
        projection.closest(self._table, self._boxes, self.size, np.ascontiguousarray(xi), *out)
        return out

    def along(self, xi: Array, direction: Array, limit: float) -> Array:
        """Distance (k,) along the unit direction to the surface, negative from inside; inf where a ray misses it."""
        h = np.empty(len(xi))
        inside = self.closest(xi).g < 0.0
        slack = ROUND_OFF * (self.size + limit)
        projection.ray(self._table, self._boxes, slack, np.ascontiguousarray(xi), inside, direction[0], direction[1], h)
        return np.where(h > limit, np.inf, h)

    def across(self, direction: Array, depth: float) -> tuple[float, float]:
        """Width of what lies within ``depth`` of the end in a unit direction, and of the whole.

        Ends of open chains are cut; what holds all that lies behind a line has none.
        """
        frame = np.array([direction, [-direction[1], direction[0]]]).T
        ends = [(max(p.lo, -4 * self.size), min(p.hi, 4 * self.size)) for p in self.pieces]
        count = [129 if p.radius else 2 for p in self.pieces]
        lines = [
            np.array([p.at(float(t)) for t in np.linspace(*end, n)]) @ frame
            for p, end, n in zip(self.pieces, ends, count)
        ]
        near, whole = width(lines, depth)
        return near, np.inf if self._holds_half_plane else whole

    @cached_property
    def _holds_half_plane(self) -> bool:
        """Whether an open chain bounds at least all that lies behind a line: its ends do not turn towards each other."""
        bends = sum(p.side * p.length / p.radius for p in self.pieces if p.radius)
        return not self.closed and bends + sum(corner(p, q) for p, q in pairwise(self.pieces)) <= NEGLIGIBLE

    @property
    def extent(self) -> float:
        """Twice the farthest corner from the reference point."""
        return 2.0 * self.size

    @cached_property
    def radius(self) -> float:
        """Smallest radius of curvature of a convex part."""
        return min([p.radius for p in self.pieces if p.side > 0] + [0.0] * bool(len(self.edges)), default=np.inf)

    @cached_property
    def edges(self) -> Array:
        """Sharp convex corners (k, 4): place, and the unit vector along the walk across the mean normal."""
        out = []
        around = (*self.pieces, self.pieces[0]) if self.closed else self.pieces
        for p, q in pairwise(around):
            if corner(p, q) > DRAWN:
                mean = np.array(p.tangent(p.hi)) + np.array(q.tangent(q.lo))
                out.append([*q.at(q.lo), *(mean / np.hypot(*mean))])
        return np.array(out).reshape(-1, 4)


def _joint(p: Piece, q: Piece) -> tuple[float, float, float]:
    """Mean unit normal at the end of p, where q begins, and 1 where it is smooth; 0, 0, 0 where both are endless there."""
    if not (isfinite(p.hi) or isfinite(q.lo)):
        return 0.0, 0.0, 0.0
    (ax, ay), (bx, by) = p.tangent(p.hi), q.tangent(q.lo)
    x, y = ax + bx, ay + by
    length = float(np.hypot(x, y))
    return y / length, -x / length, float(abs(corner(p, q)) <= DRAWN)
