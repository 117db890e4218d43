"""Outlines of bodies as curves, exactly as the elements draw them, and new nodes along them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from prensa.geometry.plane import angle
from prensa.mesh.mesh import Mesh, boundary_edges, keys
from prensa.precision import SMALLEST
from prensa.types import Array, Flags, Index

SizeOf = Callable[[Array], Array]

CORNER = np.radians(35.0)  # turn of an outline from which on it has a corner there
GROWTH = 0.25  # of element sizes over the way: neighbours differ by a quarter
GRADING = 0.3  # growth of sizes along an outline over the way
NEARNESS = 0.3  # of an element size: hard points nearer to another one than this are left out
BULGE = 0.1  # of a side's middle off its chord's, over the chord, at most: it turns by 45 degrees
PIECES = 16  # straight pieces of an edge by which its length is measured


@dataclass(frozen=True)
class Chain:
    """A stretch of an outline between two hard points: edges (k, 2|3), their nodes' places, names of all of them."""

    edges: Index
    points: Array
    names: frozenset[str]

    def _at(self, parameter: Array) -> Array:
        """Places (n, 2) of parameters: number of the edge + coordinate 0 … 1 on it."""
        e = np.clip(parameter.astype(np.int64), 0, len(self.edges) - 1)
        t = (parameter - e)[:, None]
        a, b = self.points[self.edges[e, 0]], self.points[self.edges[e, 1]]
        m = self.points[self.edges[e, 2]] if self.edges.shape[1] == 3 else 0.5 * (a + b)
        return a * (1 - t) * (1 - 2 * t) + m * 4 * t * (1 - t) + b * t * (2 * t - 1)

    @cached_property
    def _table(self) -> tuple[Array, Array]:
        """Arc lengths (n,) of many parameters (n,)."""
        parameter = np.arange(PIECES * len(self.edges) + 1) / PIECES
        x = self._at(parameter)
        return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(x, axis=0).T))]), parameter

    @property
    def length(self) -> float:
        """Arc length."""
        return float(self._table[0][-1])

    def __call__(self, s: Array) -> Array:
        """Places (n, 2) at arc lengths (n,)."""
        return self._at(np.interp(s, *self._table))

    @cached_property
    def nodes(self) -> tuple[Array, Index]:
        """Arc lengths (n,) and numbers (n,) of the nodes, in walking order."""
        s, parameter = self._table
        step = 2 if self.edges.shape[1] == 2 else 1
        at = np.arange(0, 2 * len(self.edges) + 1, step) / 2.0
        order = self.edges[:, [0, 2]].ravel() if step == 1 else self.edges[:, 0]
        return np.interp(at, parameter, s), np.append(order, self.edges[-1, 1])


def loops(cells: Index) -> list[Index]:
    """Outlines of cells, each as edges (k, 2|3) in walking order, body on the left."""
    edges = boundary_edges(cells)
    leaving: dict[int, list[int]] = {}
    for number, node in enumerate(edges[:, 0].tolist()):
        leaving.setdefault(node, []).append(number)
    out = []
    while leaving:
        walk = [leaving[next(iter(leaving))].pop()]
        first = int(edges[walk[0], 0])
        while (node := int(edges[walk[-1], 1])) != first:
            walk.append(leaving[node].pop())
        leaving = {node: left for node, left in leaving.items() if left}
        out.append(edges[walk])
    return out


def chains(mesh: Mesh, points: Array) -> list[list[Chain]]:
    """The outlines of a mesh with its nodes at points (n, 2), cut at corners, at named points and where names of edges change."""
    n = len(mesh.points)
    of_edge: dict[int, set[str]] = {}
    for name, edges in mesh.edges.items():
        for key in keys(edges[:, :2], n).tolist():
            of_edge.setdefault(key, set()).add(name)
    named = set(mesh.corners.values())
    return [
        _cut(edges, points, [frozenset(of_edge.get(k, ())) for k in keys(edges[:, :2], n).tolist()], named)
        for edges in loops(mesh.cells)
    ]


def stretches(cells: Index, points: Array) -> list[Index]:
    """The outlines of cells with nodes at points (n, 2) cut at their corners: edges (k, 2|3) of each stretch in walking order."""
    whole = [(edges, [frozenset[str]()] * len(edges)) for edges in loops(cells)]
    return [chain.edges for edges, names in whole for chain in _cut(edges, points, names, set())]


def _cut(edges: Index, x: Array, names: list[frozenset[str]], named: set[int]) -> list[Chain]:
    a, b = x[edges[:, 0]], x[edges[:, 1]]
    m = x[edges[:, 2]] if edges.shape[1] == 3 else 0.5 * (a + b)
    # Tangents of the quadratic sides at their ends: chords would see the turn of a fillet as corners.
    start, end = 4 * m - 3 * a - b, np.roll(3 * b + a - 4 * m, 1, axis=0)
    turn = np.abs(angle(end, start))
    k = len(edges)
    # A round outline of one name has nothing to be cut at: it is one chain, from anywhere.
    cuts = [i for i in range(k) if turn[i] > CORNER or names[i] != names[i - 1] or int(edges[i, 0]) in named] or [0]
    ends = [*cuts[1:], cuts[0] + k]
    return [Chain(edges[np.arange(i, j) % k], x, names[i]) for i, j in zip(cuts, ends)]


@dataclass(frozen=True)
class NewOutline:
    """New nodes of an outline: ``ends`` (k, 2) of elements' sides in walking order, ``middles`` (k, 2), ``names`` of the sides.

    Side i goes from end i to end i + 1, the last one back to the first.
    """

    ends: Array
    middles: Array
    names: list[frozenset[str]]


def resampled(outline: list[Chain], size: SizeOf, touching: Flags | None = None) -> NewOutline:
    """New nodes along an outline at distances of about ``size``; ends of contact zones stay where they are.

    What bends farther than a side can follow, a crease smaller than an element say, is drawn flatter (see `_flat_enough`).

    touching (n,): nodes of the old mesh that are closed in some contact, None: none. Without the ends of their zones as nodes, a
    zone loses up to a side of an element at each remeshing.
    """
    ends, middles, names = [], [], []
    # A round outline has no corner: less than three sides would enclose nothing.
    least = 3 if len(outline) == 1 else 1
    for chain in outline:
        s = _stations(chain, size, touching, least)
        ends.append(chain(s[:-1]))
        middles.append(_flat_enough(chain(s[:-1]), chain(0.5 * (s[1:] + s[:-1])), chain(s[1:])))
        names += [chain.names] * (len(s) - 1)
    return NewOutline(np.concatenate(ends), np.concatenate(middles), names)


def _flat_enough(a: Array, middle: Array, b: Array) -> Array:
    """Middles (k, 2) of sides from a to b (k, 2), moved towards their chords where sides would bulge too far.

    Such a side folds its element, however good the triangle of its corners is. Shorter ones would follow a crease into ever
    smaller ones, for it sharpens as far as the mesh lets it.
    """
    flat = 0.5 * (a + b)
    off, most = np.hypot(*(middle - flat).T), BULGE * np.hypot(*(b - a).T)
    return flat + np.where(off > most, most / np.maximum(off, SMALLEST), 1.0)[:, None] * (middle - flat)


def _stations(chain: Chain, size: SizeOf, touching: Flags | None, least: int) -> Array:
    """Arc lengths of the ends of the sides along a chain."""
    at, nodes = chain.nodes
    flags = np.zeros(len(nodes), dtype=bool) if touching is None else touching[nodes]
    flips = np.flatnonzero(flags[1:] != flags[:-1])
    # The closed node of each pair is where the zone ends.
    zone = np.where(flags[flips], at[flips], at[flips + 1])
    h = NEARNESS * size(chain(zone)) if len(zone) else zone
    hard = [0.0]
    for s, near in zip(zone, h):
        if s - hard[-1] > near and chain.length - s > near:
            hard.append(float(s))
    hard.append(chain.length)
    parts = [_spaced(chain, size, a, b, least) for a, b in pairwise(hard)]
    return np.concatenate([[0.0], *(p[1:] for p in parts)])


def _spaced(chain: Chain, size: SizeOf, a: float, b: float, least: int) -> Array:
    """Arc lengths from a to b between which ∫ ds/h is one, h graded."""
    n = max(200, 8 * len(chain.edges))
    s = np.linspace(a, b, n)
    h = size(chain(s))
    way = GRADING * s
    # Sizes may not grow faster than `GRADING` along the way: held forwards, then backwards.
    h = np.minimum(np.minimum.accumulate(h - way) + way, np.minimum.accumulate((h + way)[::-1])[::-1] - way)
    count = np.concatenate([[0.0], np.cumsum(0.5 * (1 / h[1:] + 1 / h[:-1]) * np.diff(s))])
    k = max(round(count[-1]), least)
    out = np.interp(np.arange(k + 1) / k * count[-1], count, s)
    out[0], out[-1] = a, b
    return out
