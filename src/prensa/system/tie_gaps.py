"""How far the two sides of a tie overlap as they are drawn, apart from what straight edges miss of curved sides.

Edges of a mesh are chords: a node of another mesh on the same curve lies outside them by up to h θ/8, θ being the angle by which
the side turns from edge to edge. Overlaps are measured against the curve through the nodes of the master side.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from prensa.geometry.plane import angle
from prensa.mesh.faces import area_vectors, normals_at_sides
from prensa.system.mortar import Side, opposite, shapes
from prensa.system.mortar_faces import on_faces
from prensa.types import Array, Index


class Overlaps(NamedTuple):
    """Of the slave ``nodes`` (n,): ``depth`` (n,) in the master, negative for gaps; how far that is ``unsure`` (n,)."""

    nodes: Index
    depth: Array
    unsure: Array


def overlaps(X: Array, slave: Side, master: Side, apart: float) -> Overlaps:
    """Overlaps of two sides of nodes X (n, 2), which lie on each other up to ``apart`` slave edges.

    Raises
    ------
    MeshError
        If a slave node lies on no master edge.

    """
    nodes, length = slave.nodes, np.zeros(len(X))
    np.maximum.at(length, slave.edges[:, :2], np.hypot(*(X[slave.edges[:, 1]] - X[slave.edges[:, 0]]).T)[:, None])
    length[slave.edges[:, 2:]] = length[slave.edges[:, :1]]
    edge, N = opposite(X, X[nodes], apart * length[nodes], slave, master)
    ends, xi = X[master.edges[edge]], N[:, 1] - N[:, 0]
    _, dN = shapes(xi, ends.shape[1])
    t = np.einsum("ka,kad->kd", dN, ends)
    out = np.stack([t[:, 1], -t[:, 0]], axis=1) / np.hypot(*t.T)[:, None]
    beside = ((X[nodes] - np.einsum("ka,kad->kd", N, ends)) * out).sum(axis=1)
    rises = _rises(X, master.edges)
    # Over a chord the curve is a parabola; over a parabola, which has its middle on the curve, what is left is of fourth order.
    form = (1.0 - xi**2) * (1.0 if master.edges.shape[1] == 2 else xi**2)
    least, most = form * rises.least[edge], form * rises.most[edge]
    unsure = np.abs(most - least) + np.abs(least) * rises.sweep[edge] ** 2
    return Overlaps(nodes, least - beside, unsure)


def face_overlaps(X: Array, slave: Side, master: Side) -> Overlaps:
    """Overlaps of two sides of faces of nodes X (n, 3), of which the slave lies on the master side all over.

    Faces are chords of what is curved, off an arc over them by half their length times the tangent of a quarter of its angle,
    that between the normals of the faces which meet there. So much is unsure; at a corner of a side it is no small part.
    """
    nodes = slave.nodes
    own, N = on_faces(X, nodes, master)
    faces = X[own]
    out = area_vectors(faces)[1].sum(axis=0)
    out /= np.linalg.norm(out, axis=1)[:, None]
    beside = ((X[nodes] - np.einsum("ka,kad->kd", N, faces)) * out).sum(axis=1)
    return Overlaps(nodes, -beside, _off_chords(faces, _spread(X, master)[own]))


def _off_chords(x: Array, spread: Array) -> Array:
    """How far (k,) arcs are off faces x (k, a, 3) at most, along whose axes normals ``spread`` (k, a, 3) so far at the nodes."""
    out = np.zeros(len(x))
    for i, j in combinations(range(4 if x.shape[1] == 4 else 3), 2):
        chord = x[:, j] - x[:, i]
        length = np.linalg.norm(chord, axis=1)
        turn = (np.abs(chord)[:, None] * spread[:, [i, j]]).sum(axis=2).max(axis=1) / length
        np.maximum(out, 0.5 * length * np.tan(0.5 * np.arcsin(np.minimum(0.5 * turn, 1.0))), out=out)
    return out


def _spread(X: Array, side: Side) -> Array:
    """How far the components (n, 3) of normals of the faces of a side that meet at a node differ, or those within one."""
    at_sides = normals_at_sides(X[side.edges])
    low, high = np.full((len(X), 3), np.inf), np.full((len(X), 3), -np.inf)
    for k in range(at_sides.shape[1]):
        for node in side.edges.T:
            np.minimum.at(low, node, at_sides[:, k])
            np.maximum.at(high, node, at_sides[:, k])
    return np.where(high >= low, high - low, 0.0)


def normals(X: Array, side: Side) -> Array:
    """Outward unit normals (n, 2) at the nodes of a side, means of its edges' there by length; zero at other nodes."""
    a = side.edges.shape[1]
    _, dN = shapes(np.array([-1.0, 1.0, 0.0])[:a], a)
    t = np.einsum("qa,kad->kqd", dN, X[side.edges])
    out = np.zeros(X.shape)
    np.add.at(out, side.edges, np.stack([t[..., 1], -t[..., 0]], axis=-1))
    size = np.hypot(*out.T)[:, None]
    return np.divide(out, size, out=np.zeros_like(out), where=size > 0.0)


class _Rises(NamedTuple):
    """Size (k,) of what each edge misses of the curve, by the lesser and the larger turn at its ends; angle that it ``sweep``s.

    Where a side turns one way and the other, or at one end alone, it has a corner: the lesser is none. What is left out of the
    series is of second order in the sweep.
    """

    least: Array
    most: Array
    sweep: Array


def _rises(X: Array, edges: Index) -> _Rises:
    a = edges.shape[1]
    _, dN = shapes(np.array([-1.0, 1.0]), a)
    begins, ends = (np.einsum("a,kad->kd", dN[q], X[edges]) for q in (0, 1))
    after = {int(first): k for k, first in enumerate(edges[:, 0])}
    next_ = np.array([after.get(int(last), -1) for last in edges[:, 1]])
    here = np.flatnonzero(next_ >= 0)
    turn = angle(ends[here], begins[next_[here]])
    at_end, at_start = np.full(len(edges), np.nan), np.full(len(edges), np.nan)
    at_end[here], at_start[next_[here]] = turn, turn
    # The first and the last edge of an open side turn at one end; the other is taken to be alike.
    first, last = (np.where(np.isnan(p), q, p) for p, q in ((at_start, at_end), (at_end, at_start)))
    both = np.nan_to_num(np.stack([first, last]))
    most = np.take_along_axis(both, np.abs(both).argmax(axis=0)[None], axis=0)[0]
    least = np.where(both[0] * both[1] > 0.0, np.sign(both[0]) * np.abs(both).min(axis=0), 0.0)
    half = 0.5 * np.hypot(*(X[edges[:, 1]] - X[edges[:, 0]]).T)
    return _Rises(half * np.tan(0.25 * least), half * np.tan(0.25 * most), np.abs(angle(begins, ends)) + np.abs(most))
