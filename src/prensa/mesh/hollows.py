"""Straight edges and bilinear faces between nodes, and how far a side that turns inwards lies behind them."""

from __future__ import annotations

import numpy as np

from prensa.precision import SMALLEST
from prensa.types import Array


def inside(dimension: int, s: Array) -> tuple[Array, Array]:
    """Shape values (p, 2|4) of an edge or a face, and s (1 − s) (p, 1|2), at places s along its sides."""
    if dimension == 2:
        return np.stack([1.0 - s, s], axis=1), (s * (1.0 - s))[:, None]
    a, b = (v.ravel() for v in np.meshgrid(s, s, indexing="ij"))
    N = np.stack([(1.0 - a) * (1.0 - b), a * (1.0 - b), a * b, (1.0 - a) * b], axis=1)
    return N, np.stack([a * (1.0 - a), b * (1.0 - b)], axis=1)


def sides(x: Array) -> Array:
    """Lengths (m, 1) of edges x (m, 2, 2), or mean lengths (m, 2) of the opposite sides of faces x (m, 4, 3)."""
    length = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2)
    return length[:, :1] if x.shape[1] == 2 else 0.5 * (length[:, :2] + length[:, 2:])


def outward(x: Array) -> Array:
    """Normals (m, d), as long as their longest side, of edges x (m, 2, 2) or faces x (m, 4, 3)."""
    if x.shape[1] == 2:
        t = x[:, 1] - x[:, 0]
        return np.stack([t[:, 1], -t[:, 0]], axis=1)
    n = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    return np.asarray(n * (sides(x).max(axis=1) / np.linalg.norm(n, axis=1))[:, None])


def hollow(ends: Array) -> Array:
    """Sines (m, 1|2) by which a side turns inwards along its edges (m, 2, 2), body on the left, or faces (m, 4, 3); else 0."""
    return _hollow_faces(ends) if ends.shape[1] == 4 else _hollow_edges(ends)[:, None]


def _hollow_faces(x: Array) -> Array:
    """Along the two pairs of sides of a face: changes of the normals at nodes, which are means of those of faces."""
    flat, place = np.unique(x.reshape(-1, 3), axis=0, return_inverse=True)
    place = place.reshape(x.shape[:2])
    n = np.zeros_like(flat)
    np.add.at(n, place, outward(x)[:, None])
    at = (n / np.linalg.norm(n, axis=1)[:, None])[place]
    t, change = (np.roll(v, -1, axis=1) - v for v in (x, at))
    # a triangle names a node twice, and between the two there is no way
    inwards = -(t * change).sum(axis=2) / np.maximum(np.linalg.norm(t, axis=2), SMALLEST)
    pairs = np.maximum(inwards, 0.0).reshape(-1, 2, 2).max(axis=1)
    # at its borders, where normals are those of the last face, the side goes on as beside them
    ends = np.sort(np.stack([place, np.roll(place, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    _, which, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    border = (count[which.reshape(x.shape[:2])] == 1).reshape(-1, 2, 2).any(axis=1)
    return np.asarray(pairs * np.where(border[:, ::-1], 2.0, 1.0))


def _hollow_edges(ends: Array) -> Array:
    t = ends[:, 1] - ends[:, 0]
    t = t / np.hypot(*t.T)[:, None]
    turn = t[:-1, 1] * t[1:, 0] - t[:-1, 0] * t[1:, 1]
    turn = np.where((ends[:-1, 1] == ends[1:, 0]).all(axis=1), turn, 0.0)
    # at its ends the side goes on as beside them
    return np.maximum(np.maximum(np.append(turn, 0.0), np.append(0.0, turn)), 0.0)
