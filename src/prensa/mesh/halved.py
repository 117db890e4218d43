"""Meshes of elements half as long: every side is halved, a triangle makes four, a quadrilateral four about its centre."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.mesh.mesh import boundary_edges, keys, sides
from prensa.types import Array, Flags, Index


class Halved(NamedTuple):
    """``values`` (n, k) at the nodes, the old ones first, ``cells`` (4 m, 3|4), and what of the nodes is ``marked`` (n, j)."""

    values: Array
    cells: Index
    marked: Flags


def halved(values: Array, cells: Index, marked: Flags) -> Halved:
    """Linear cells (m, 3|4) in halves, with values (n, k) at the nodes, of which the first two are places, interpolated.

    Of the new nodes those on the outline are ``marked`` (n, j) where both ends of their edge are. Sides that turn go on as arcs
    through their nodes.
    """
    n = len(values)
    pairs = sides(cells)
    of_pairs = keys(pairs, n)
    edges = np.unique(of_pairs)
    ends = np.stack([edges // n, edges % n], axis=1)
    middle = n + np.searchsorted(edges, of_pairs)
    outer = np.isin(edges, keys(boundary_edges(cells), n))
    between = values[ends].mean(axis=1)
    outline = boundary_edges(cells)
    between[np.searchsorted(edges, keys(outline, n)), :2] += _rises(values[:, :2], outline)
    new = [values, between]
    marks = [marked, marked[ends].all(axis=1) & outer[:, None]]
    corners = cells.shape[1]
    before = np.roll(middle, 1, axis=1)
    if corners == 4:
        centre = n + len(edges) + np.arange(len(cells))
        new.append(values[cells].mean(axis=1))
        marks.append(np.zeros((len(cells), marked.shape[1]), dtype=bool))
        quarters = [np.stack([cells[:, i], middle[:, i], centre, before[:, i]], axis=1) for i in range(4)]
    else:
        quarters = [np.stack([cells[:, i], middle[:, i], before[:, i]], axis=1) for i in range(3)] + [middle]
    return Halved(np.concatenate(new), np.concatenate(quarters), np.concatenate(marks))


def _rises(x: Array, outline: Index) -> Array:
    """Ways (k, 2) from the middles of the edges (k, 2) of an outline, body on the left, of nodes x (n, 2), to the arcs over them.

    An arc that turns by θ over an edge of length L rises by L/2 tan θ/4. A side is straight up to a node where an arc begins, and
    what turns by more than 30° is a corner.
    """
    a, b = outline.T
    t = x[b] - x[a]
    length = np.hypot(*t.T)
    t = t / length[:, None]
    into = np.full((len(x), 2), np.nan)  # directions of the edges that end at a node; nodes of which several do are corners
    into[b] = t
    into[np.bincount(b, minlength=len(x)) > 1] = np.nan
    turn = into[a, 0] * t[:, 1] - into[a, 1] * t[:, 0]
    at = np.full(len(x), np.nan)
    at[a] = np.where((np.abs(turn) < 0.5) & ((into[a] * t).sum(axis=1) > 0.0), turn, np.nan)
    first, last = at[a], at[b]
    first, last = np.where(np.isnan(first), last, first), np.where(np.isnan(last), first, last)
    least = np.where(first * last > 0.0, np.sign(first) * np.minimum(np.abs(first), np.abs(last)), 0.0)
    rise = 0.5 * length * np.tan(0.25 * np.arcsin(least))
    return np.asarray(rise[:, None] * np.stack([t[:, 1], -t[:, 0]], axis=1))
