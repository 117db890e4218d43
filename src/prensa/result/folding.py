"""Folds of an outline before they close: parts of the surface of one body that come together across a void.

The measure is the gap of two places of an outline over the way along the outline between them, which is 1 on a straight side,
2/π at the ends of a half circle and tan(φ/2) beside a corner that is open by an angle φ. A fold begins where more than half of
what it was at the beginning has gone, so that as much motion again closes the gap; where the sides face each other by more than
a right angle; and where what is left of the gap is less than the sides of elements there, so that no mesh shows what is in it.
A void that a tool fills does not close.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.mesh.mesh import segments
from prensa.precision import SMALLEST
from prensa.system.system import System
from prensa.types import Array, Flags, Index

STRAIGHT_ANGLE = float(np.degrees(np.pi))


class Fold(NamedTuple):
    """A place (x, y) where two parts of an outline, nodes (3,) of the body, are about to close over a ``gap`` (length)."""

    nodes: Index
    x: float
    y: float
    gap: float


class Folding(NamedTuple):
    """The smallest ``angle`` (degrees) by which a re-entrant corner of an outline is open, 180 without one, and its folds."""

    angle: float
    folds: tuple[Fold, ...]


def folding(system: System, u: Array, start: Array) -> dict[str, Folding]:
    """Re-entrant corners and folds of the bodies at degrees of freedom u (ndof,), of what has moved since ``start`` (ndof,)."""
    if system.dofs.dimension != 2:
        return {}
    now, then = system.positions(u), system.positions(start)
    out = {}
    for body, mesh in system.meshes.items():
        first = system.offsets[body]
        angle, folds = STRAIGHT_ANGLE, list[Fold]()
        for loop in _loops(segments(mesh.boundary)):
            places = [p[loop + first] for p in (now, then, system.X)]
            angle = min(angle, _least_angle(system, u, places[0]))
            folds += [f._replace(nodes=loop[f.nodes]) for f in _of_loop(system, u, *places)]
        out[body] = Folding(angle, tuple(folds))
    return out


def _loops(ends: Index) -> list[Index]:
    """Nodes of closed outlines in walking order, from straight pieces (k, 2)."""
    after, out = dict(ends.tolist()), []
    while after:
        at, loop = next(iter(after)), []
        while at in after:
            loop.append(at)
            at = after.pop(at)
        out.append(np.array(loop))
    return out


def _in_void(system: System, u: Array, x: Array) -> Flags:
    """Whether places x (k, 2) lie in no tool."""
    free = np.ones(len(x), dtype=bool)
    for master in system.tool_masters.values() if len(x) else ():
        free &= ~(master.seen(x, u).g <= 0.0)
    return free


def _least_angle(system: System, u: Array, x: Array) -> float:
    """The smallest opening (degrees) of the corners of a loop of nodes at x (m, 2) that no tool fills."""
    back, on = np.roll(x, 1, axis=0) - x, np.roll(x, -1, axis=0) - x
    # with the body on the left of the way on, what is outside lies from there clockwise to the way back
    turn = np.arctan2(on[:, 1] * back[:, 0] - on[:, 0] * back[:, 1], (on * back).sum(axis=1))
    opening = np.degrees(turn) % (2.0 * STRAIGHT_ANGLE)
    sharp = np.flatnonzero(opening < STRAIGHT_ANGLE)
    sharp = sharp[_in_void(system, u, (x + 0.25 * (back + on))[sharp])]
    return float(opening[sharp].min(initial=STRAIGHT_ANGLE))


def _of_loop(system: System, u: Array, now: Array, then: Array, first: Array) -> list[Fold]:
    """Folds of a loop of nodes (m, 2) now, at the start of the step and at first; the nearest to closing of each place."""
    from scipy.spatial import cKDTree

    m = len(now)
    length = np.hypot(*(np.roll(now, -1, axis=0) - now).T)
    size = 0.5 * (length + np.roll(length, 1))
    i, j = cKDTree(now).query_pairs(float(size.max()), output_type="ndarray").T if m > 3 else np.zeros((2, 0), dtype=np.int64)
    apart = np.minimum(j - i, m - (j - i)) > 1
    i, j = i[apart], j[apart]
    a = np.concatenate([i, i, j, j])  # a node, and the pieces before and after the other
    b = np.concatenate([(j - 1) % m, j, (i - 1) % m, i])
    keep = ((b - a) % m > 0) & ((a - b) % m > 1)
    a, b = a[keep], b[keep]
    c = (b + 1) % m
    way = now[c] - now[b]
    share = np.clip(((now[a] - now[b]) * way).sum(axis=1) / np.maximum((way**2).sum(axis=1), SMALLEST), 0.0, 1.0)

    def across(x: Array) -> Array:
        return (1.0 - share)[:, None] * x[b] + share[:, None] * x[c] - x[a]

    gap = np.hypot(*across(now).T)
    ratio, before = (np.hypot(*across(x).T) / _along(x, a, b, share) for x in (now, first))
    near = (gap < 0.5 * (size[a] + length[b])) & (2.0 * ratio < before) & (gap < np.hypot(*across(then).T))
    k = np.flatnonzero(near)
    k = k[_facing(now, a[k], b[k], across(now)[k])]
    k = k[_in_void(system, u, now[a[k]] + 0.5 * across(now)[k])]
    out: list[Fold] = []
    taken = np.zeros(m, dtype=bool)
    for e in k[np.argsort(ratio[k])]:
        inner = np.arange(a[e], a[e] + (c[e] - a[e]) % m + 1) % m
        inner = inner if 2 * len(inner) <= m else np.setdiff1d(np.arange(m), inner[1:-1])
        if not taken[inner].any():
            place = now[a[e]] + 0.5 * across(now)[e]
            out.append(Fold(np.array([a[e], b[e], c[e]]), float(place[0]), float(place[1]), float(gap[e])))
        taken[inner] = True
    return out


def _along(x: Array, a: Index, b: Index, share: Array) -> Array:
    """The shorter way (k,) along a loop at x (m, 2) from nodes a to places on the pieces after nodes b."""
    length = np.hypot(*(np.roll(x, -1, axis=0) - x).T)
    at = np.concatenate([[0.0], np.cumsum(length)])
    way = np.abs(at[b] + share * length[b] - at[a])
    return np.asarray(np.minimum(way, at[-1] - way))


def _facing(x: Array, a: Index, b: Index, across: Array) -> Flags:
    """Whether nodes a and the pieces after nodes b look at each other, by more than a right angle, over ways (k, 2) between."""
    t = np.roll(x, -1, axis=0) - x
    normal = np.stack([t[:, 1], -t[:, 0]], axis=1)  # outward, the body being on the left
    other = normal[b]
    own = [normal[a], normal[a - 1]]
    looks = [((n * other).sum(axis=1) < 0.0) & ((across * n).sum(axis=1) > 0.0) for n in own]
    return np.asarray((looks[0] | looks[1]) & ((across * other).sum(axis=1) < 0.0))
