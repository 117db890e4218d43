"""Folds of an outline before they close: parts of the surface of one body that come together across a void.

The *opening* of two places of an outline, a node and a place on a piece of it, says how far they are from a fold: 2 on a straight
side, 1 where a fold begins, 0 where it has closed. It is continuous, so that the moment can be located, and the greatest of

- twice the gap over the way along the outline between the two, over what that was at the beginning. Gap over way is 1 on a
  straight side, 2/π at the ends of a half circle and tan(φ/2) beside a corner that is open by an angle φ: at 1 half of it has
  gone, and as much motion again closes the gap;
- the gap over the size of the sides of elements there: below 1 no mesh shows what is in it;
- 1 + c/o, with the greater of these two, o, and the cosine c between the outward normals, or between a normal and the way from
  the other place: below 1 the sides face each other by more than a right angle, and by how much counts less and less;
- 1 − 2 g/gap, with the gap g of the nearest tool from the middle between the two: a void that a tool fills does not close.

Places that have not come closer in the step have none. A fold is a place where the opening is below 1, the least one of all pairs
between whose flanks it lies; an outline that has passed through itself (`prensa.mesh.overlap`) is closed there.

Across a line of symmetry a void lies between the outline and its mirror image, and both are looked at together
(`prensa.result.whole_outline`): a half model has the openings of the whole. Where the outline has reached such a line a fold has
closed. A place and its image are one fold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from prensa.mesh.crossing import turns_back
from prensa.mesh.overlap import Overlap, overlaps
from prensa.precision import NEGLIGIBLE, SMALLEST
from prensa.result.whole_outline import WholeOutline, whole_outline
from prensa.system.symmetry_planes import Mirror
from prensa.system.system import System
from prensa.types import Array, Flags, Index

STRAIGHT_ANGLE = float(np.degrees(np.pi))
UNFOLDED = 2.0
"""The opening of a straight side."""
CLOSING = 1.0
"""The opening at which a fold begins."""


class Fold(NamedTuple):
    """A place (x, y) where two parts of an outline, ``nodes`` (k,) of the body, close over a ``gap`` (length).

    ``arc`` (n,): nodes of the outline between the two; ``opening``: see above, 0 with a gap of 0 where they have met. ``across``:
    the line of symmetry between them, if one of the two is the mirror image of a part of the body.
    """

    nodes: Index
    arc: Index
    x: float
    y: float
    gap: float
    opening: float
    across: Mirror | None = None


class Folding(NamedTuple):
    """The smallest ``angle`` (degrees) by which a re-entrant corner of an outline is open, 180 without one, and its folds.

    ``forming``: places whose opening was asked for and is 1 or more, the nearest to a fold first, as ``folds`` are.
    """

    angle: float
    folds: tuple[Fold, ...]
    forming: tuple[Fold, ...] = ()

    @property
    def opening(self) -> float:
        """The least opening, 2 without a fold."""
        return min((f.opening for f in (*self.folds, *self.forming)), default=UNFOLDED)

    def counted(self, n: int) -> float:
        """A count that grows continuously from n − 1 folds to n, where the n-th of them begins, and on as that one closes."""
        openings = [f.opening for f in (*self.folds, *self.forming)]
        return n - 1 + UNFOLDED - (openings[n - 1] if n <= len(openings) else UNFOLDED)


@dataclass(frozen=True)
class _Loop:
    """A closed part of a ``whole`` outline: its ``nodes`` (m,) in walking order.

    ``places``: of the nodes of the body (n, 2) now, at the start of the step and at first; those of the loop are put together
    when they are asked for, most of them in few increments.
    """

    whole: WholeOutline
    nodes: Index
    places: tuple[Array, Array, Array]

    @cached_property
    def now(self) -> Array:
        """Where its nodes (m, 2) are."""
        return self.whole.placed(self.nodes, self.places[0])

    @cached_property
    def then(self) -> Array:
        """Where they (m, 2) were at the start of the step."""
        return self.whole.placed(self.nodes, self.places[1])

    @cached_property
    def first(self) -> Array:
        """Where they (m, 2) were at first."""
        return self.whole.placed(self.nodes, self.places[2])

    @cached_property
    def own(self) -> Index:
        """Nodes (m,) of the body, of which those of the loop are images."""
        return self.nodes % self.whole.n

    @cached_property
    def modelled(self) -> Flags:
        """Which (m,) are nodes of the body themselves."""
        return self.nodes < self.whole.n

    def between(self, a: int, b: int) -> Index:
        """Nodes on the shorter way from one to another, both included, as the loop counts them."""
        m = len(self.nodes)
        inner = np.arange(a, a + (b - a) % m + 1) % m
        return inner if 2 * len(inner) <= m else np.setdiff1d(np.arange(m), inner[1:-1])


class _Pairs(NamedTuple):
    """Nodes ``a`` (k,) of a loop and places on the pieces of it after nodes ``b``, at a ``share`` of them."""

    a: Index
    b: Index
    share: Array

    def across(self, x: Array) -> Array:
        """Ways (k, 2) from the nodes to the places, the loop being at x (m, 2)."""
        c = (self.b + 1) % len(x)
        return np.asarray((1.0 - self.share)[:, None] * x[self.b] + self.share[:, None] * x[c] - x[self.a])

    def of(self, keep: Flags) -> _Pairs:
        """Some of them."""
        return _Pairs(self.a[keep], self.b[keep], self.share[keep])


def folding(system: System, u: Array, start: Array, below: float = UNFOLDED) -> dict[str, Folding]:
    """Re-entrant corners and folds of the bodies at degrees of freedom u (ndof,), of what has moved since ``start`` (ndof,).

    ``below``: of places with an opening below this; with `CLOSING` of folds alone, without corners.
    """
    return Outlined(system, u, start).folding(below)


@dataclass(frozen=True)
class Outlined:
    """The outlines of the bodies of a system at degrees of freedom u (ndof,), for all who ask how they fold.

    ``start`` (ndof,): folds are those of what has moved since. What is asked for is found once.
    """

    system: System
    u: Array
    start: Array

    @cached_property
    def x(self) -> Array:
        """Node positions (n, 2)."""
        return self.system.positions(self.u)

    @cached_property
    def overlaps(self) -> dict[str, list[Overlap]]:
        """By body in the plane: where its outline lies in itself, numbers of segments as `prensa.mesh.mesh.segments` has them."""
        if self.system.dofs.dimension != 2:
            return {}
        return {body: self._overlaps(body, ends) for body, ends in self.system.outlines.items()}

    def _overlaps(self, body: str, ends: Index) -> list[Overlap]:
        """Where an outline of such pieces (k, 2) lies in itself: nowhere if it is one line that turns back nowhere."""
        x, loops = self.x[self.system.span(body)], whole_outline(self.system, body).own
        return overlaps(x, ends) if len(loops) > 1 or turns_back(x[loops[0]]) else []

    @cached_property
    def folds(self) -> dict[str, Folding]:
        """Folds by body."""
        return self.folding(CLOSING)

    def folding(self, below: float) -> dict[str, Folding]:
        """See `prensa.result.folding.folding`."""
        return {body: self._of_body(body, met, below) for body, met in self.overlaps.items()}

    def _of_body(self, body: str, overlapping: Sequence[Overlap], below: float) -> Folding:
        """Folds of a body, those that have closed being where it lies in itself."""
        system, own = self.system, self.system.span(body)
        ends, whole = system.outlines[body], whole_outline(system, body)
        places = self.x[own], system.positions(self.start)[own], system.X[own]
        met = [(ends[o.segments[whole.modelled[o.segments]]], o) for o in overlapping]
        angle, found = STRAIGHT_ANGLE, list[Fold]()
        for nodes in whole.loops:
            loop = _Loop(whole, nodes, places)
            if below > CLOSING:
                angle = min(angle, _least_angle(system, self.u, loop))
            folds = [_closed(nodes, rim, o) for rim, o in met if np.isin(rim[:1], nodes).any()]
            folds += _at_lines(loop, NEGLIGIBLE * system.length, [f.arc for f in folds])
            folds += _of_loop(system, self.u, loop, below, [f.arc for f in folds])
            found += [f._replace(nodes=loop.own[f.nodes], arc=np.unique(loop.own[f.arc])) for f in folds]
        found.sort(key=lambda f: f.opening)
        closing = sum(f.opening < CLOSING for f in found)
        return Folding(angle, tuple(found[:closing]), tuple(found[closing:]))


def _closed(nodes: Index, rim: Index, overlap: Overlap) -> Fold:
    """A fold that has closed, by segments ``rim`` (k, 2) of a loop of ``nodes``; its nodes as the loop counts them."""
    at = np.flatnonzero(np.isin(nodes, rim))
    # from behind the longest part of the loop that has none of them
    k = int(np.argmax(np.diff(at, append=at[0] + len(nodes))))
    first, last = int(at[(k + 1) % len(at)]), int(at[k])
    arc = (first + np.arange((last - first) % len(nodes) + 1)) % len(nodes)
    return Fold(at, arc, overlap.x, overlap.y, 0.0, 0.0)


def _at_lines(loop: _Loop, near: float, met: list[Index]) -> list[Fold]:
    """Folds that have closed: where an outline is within ``near`` (length) of a line of symmetry, and was not at first.

    Not on arcs that have ``met``.
    """
    taken, out = np.zeros(loop.whole.n, dtype=bool), list[Fold]()
    for arc in met:
        taken[loop.own[arc]] = True
    for line in loop.whole.lines:
        come = loop.modelled & (line.distance(loop.now) <= near) & (line.distance(loop.first) > near)
        # of an outline that ends on no line, as of a bore around the axis, the image is another one
        images = [(a, loop.whole.image_of(loop.nodes[a], line)) for a in np.flatnonzero(come).tolist()]
        pairs = [(a, np.flatnonzero(loop.nodes == image)) for a, image in images]
        arcs = [(a, loop.between(a, int(b[0]))) for a, b in pairs if len(b)]
        for a, arc in sorted(arcs, key=lambda found: -len(found[1])):
            if not taken[loop.own[arc]].any():
                out.append(Fold(np.array([a]), arc, float(loop.now[a, 0]), float(loop.now[a, 1]), 0.0, 0.0, line))
            taken[loop.own[arc]] = True
    return out


def _nearest_tool(system: System, u: Array, x: Array) -> Array:
    """Gaps (k,) of the nearest tools from places x (k, 2), negative inside, infinite without any.

    Planes that stand for lines of symmetry fill no void: in the whole there are none.
    """
    gap = np.full(len(x), np.inf)
    tools = list(system.tool_masters.values())[: len(system.tools) - system.mirrors]
    for master in tools if len(x) else ():
        gap = np.fmin(gap, master.seen(x, u).g)
    return gap


def _least_angle(system: System, u: Array, loop: _Loop) -> float:
    """The smallest opening (degrees) of the corners of a loop that no tool fills."""
    x = loop.now
    back, on = np.roll(x, 1, axis=0) - x, np.roll(x, -1, axis=0) - x
    # with the body on the left of the way on, what is outside lies from there clockwise to the way back
    turn = np.arctan2(on[:, 1] * back[:, 0] - on[:, 0] * back[:, 1], (on * back).sum(axis=1))
    opening = np.degrees(turn) % (2.0 * STRAIGHT_ANGLE)
    sharp = np.flatnonzero(opening < STRAIGHT_ANGLE)
    sharp = sharp[_nearest_tool(system, u, loop.whole.modelled_side((x + 0.25 * (back + on))[sharp])) > 0.0]
    return float(opening[sharp].min(initial=STRAIGHT_ANGLE))


def _of_loop(system: System, u: Array, loop: _Loop, below: float, met: list[Index]) -> list[Fold]:
    """Folds of a loop with an opening ``below`` a number, the nearest to closing of each place; not on arcs that have ``met``."""
    if below <= CLOSING and not turns_back(loop.now):
        return []
    pairs, opening = _openings(system, u, loop, below)
    if not len(opening):
        return []
    across, taken, out = pairs.across(loop.now), np.zeros(loop.whole.n, dtype=bool), list[Fold]()
    places = loop.whole.modelled_side(loop.now[pairs.a] + 0.5 * across)
    for arc in met:
        taken[loop.own[arc]] = True
    for e in np.argsort(opening, kind="stable"):
        a, b = int(pairs.a[e]), int(pairs.b[e])
        after = (b + 1) % len(loop.nodes)
        inner = loop.between(a, after)
        if not taken[loop.own[inner]].any():
            nodes, gap = np.array([a, b, after]), float(np.hypot(*across[e]))
            line = loop.whole.across(loop.nodes[nodes])
            x, y = places[e].tolist()
            out.append(Fold(nodes, inner, x, y, gap, float(opening[e]), line))
        taken[loop.own[inner]] = True
    return out


def _openings(system: System, u: Array, loop: _Loop, below: float) -> tuple[_Pairs, Array]:
    """Pairs of a loop whose opening is ``below`` a number, and their openings.

    What is as far apart as its sides are long is no such pair: first, since in most increments none is left.
    """
    pairs, wide = _candidates(loop, below)
    if not len(wide):
        return pairs, wide
    gap = np.hypot(*pairs.across(loop.now).T)
    ratio, before = (np.hypot(*pairs.across(x).T) / _along(x, pairs) for x in (loop.now, loop.first))
    # of what was closed at the beginning nothing can go
    opening = np.full(len(gap), np.inf)
    np.divide(UNFOLDED * ratio, before, out=opening, where=before > 0.0)
    opening = np.maximum(opening, wide)
    keep = (opening < below) & (gap < np.hypot(*pairs.across(loop.then).T))
    pairs, opening = pairs.of(keep), np.maximum(opening[keep], SMALLEST)
    if not len(opening):
        return pairs, opening
    opening = np.maximum(opening, 1.0 + _facing(loop.now, pairs) / opening)
    keep = opening < below
    pairs, opening, across = pairs.of(keep), opening[keep], pairs.of(keep).across(loop.now)
    gap = np.maximum(np.hypot(*across.T), SMALLEST)
    tool = _nearest_tool(system, u, loop.whole.modelled_side(loop.now[pairs.a] + 0.5 * across))
    opening = np.maximum(opening, 1.0 - 2.0 * np.clip(tool, -gap, gap) / gap)
    return pairs.of(opening < below), opening[opening < below]


def _candidates(loop: _Loop, below: float) -> tuple[_Pairs, Array]:
    """Nodes of a loop and the nearest places on pieces, not those beside them, less than ``below`` of a size away; that share.

    The size is that of the sides of elements there; of each pair and its images one is enough.
    """
    from scipy.spatial import cKDTree

    x, m = loop.now, len(loop.nodes)
    length = np.hypot(*(np.roll(x, -1, axis=0) - x).T)
    size = 0.5 * (length + np.roll(length, 1))
    # a place is at most half of a piece away from one of the piece's nodes
    reach = float(np.hypot(0.5 * below * (size.max() + length.max()), 0.5 * length.max()))
    i, j = cKDTree(x).query_pairs(reach, output_type="ndarray").T if m > 3 else np.zeros((2, 0), dtype=np.int64)
    apart = np.minimum(j - i, m - (j - i)) > 1
    i, j = i[apart], j[apart]
    a = np.concatenate([i, i, j, j])  # a node, and the pieces before and after the other
    b = np.concatenate([(j - 1) % m, j, (i - 1) % m, i])
    keep = ((b - a) % m > 0) & ((a - b) % m > 1) & loop.modelled[a]
    a, b = a[keep], b[keep]
    way = x[(b + 1) % m] - x[b]
    share = ((x[a] - x[b]) * way).sum(axis=1) / np.maximum((way**2).sum(axis=1), SMALLEST)
    pairs = _Pairs(a, b, np.clip(share, 0.0, 1.0))
    wide = np.hypot(*pairs.across(x).T) / (0.5 * (size[a] + length[b]))
    return pairs.of(wide < below), wide[wide < below]


def _along(x: Array, pairs: _Pairs) -> Array:
    """The shorter way (k,) along a loop at x (m, 2) from the nodes of pairs to their places."""
    length = np.hypot(*(np.roll(x, -1, axis=0) - x).T)
    at = np.concatenate([[0.0], np.cumsum(length)])
    way = np.abs(at[pairs.b] + pairs.share * length[pairs.b] - at[pairs.a])
    return np.asarray(np.minimum(way, at[-1] - way))


def _facing(x: Array, pairs: _Pairs) -> Array:
    """Cosines (k,) by which the two of pairs of a loop at x (m, 2) look past each other, negative where they face each other.

    The greatest of three: of their outward normals, and of each one and the way from the other to it. Of the two normals at a
    node, that which faces more.
    """
    t = np.roll(x, -1, axis=0) - x
    normal = np.stack([t[:, 1], -t[:, 0]], axis=1) / np.maximum(np.hypot(*t.T), SMALLEST)[:, None]  # the body being on the left
    across = pairs.across(x)
    across /= np.maximum(np.hypot(*across.T), SMALLEST)[:, None]
    other = normal[pairs.b]
    ways = [
        np.maximum((own * other).sum(axis=1), -(across * own).sum(axis=1)) for own in (normal[pairs.a], normal[pairs.a - 1])
    ]
    return np.asarray(np.maximum(np.minimum(*ways), (across * other).sum(axis=1)))
