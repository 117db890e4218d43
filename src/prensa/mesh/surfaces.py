"""Surfaces of bodies by the edges of their sections: areas, and how much surface has grown since the beginning.

Edges have 2 or 3 nodes (their ends, then the one between); of a body of revolution x is the radius.
"""

from __future__ import annotations

import numpy as np

from prensa.mesh.faces import face_areas
from prensa.precision import NEGLIGIBLE
from prensa.types import Array, Flags, Index

GAUSS = np.polynomial.legendre.leggauss(5)


def slopes_at(s: float, nodes: int) -> tuple[Array, Array]:
    """Shape functions (nodes,) of an edge at s ∈ [−1, 1], and their slopes."""
    if nodes == 2:
        return np.array([1.0 - s, 1.0 + s]) / 2, np.array([-0.5, 0.5])
    return np.array([0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s]), np.array([s - 0.5, s + 0.5, -2.0 * s])


def edge_areas(x: Array, edges: Index, revolved: bool) -> Array:
    """Areas (k,) of edges on nodes x (n, 2): lengths, of bodies of revolution 2π ∫ r ds."""
    out = np.zeros(len(edges))
    for s, weight in zip(*GAUSS):
        N, dN = slopes_at(float(s), edges.shape[1])
        way = np.einsum("a,kai->ki", dN, x[edges])
        around = 2.0 * np.pi * (x[edges][..., 0] @ N) if revolved else 1.0
        out += weight * around * np.hypot(way[:, 0], way[:, 1])
    return out


def surface_areas(x: Array, edges: Index, revolved: bool) -> Array:
    """`edge_areas`, and in space the areas (k,) of faces (k, 4) on nodes x (n, 3)."""
    return face_areas(x, edges) if x.shape[1] == 3 else edge_areas(x, edges, revolved)


def section_volume(x: Array, edges: Index, revolved: bool) -> float:
    """Area within a closed outline of edges (k, 2|3) on nodes x (n, 2), body on the left; volume of a body of revolution."""
    total = 0.0
    for s, weight in zip(*GAUSS):
        N, dN = slopes_at(float(s), edges.shape[1])
        r, up = x[edges][..., 0] @ N, x[edges][..., 1] @ dN
        total += float(weight * ((np.pi * r if revolved else 1.0) * r * up).sum())
    return total


def on_axis(X: Array, edges: Index) -> Flags:
    """Edges (k,) that lie on the axis of revolution, where there is no surface."""
    return np.asarray((np.abs(X[edges][..., 0]) <= NEGLIGIBLE * np.abs(X[:, 0]).max(initial=0.0)).all(axis=1))


def surface_expansion(X: Array, x: Array, edges: Index, revolved: bool) -> Array:
    """Surface at nodes now over that at the beginning (n,), from positions X (n, 2) then and x now; nan off the surface.

    The ratio of lengths along the section, in bodies of revolution times that of radii (on the axis, of their slopes): means of
    the edges that meet in a node, by their initial lengths.
    """
    edges = edges[~on_axis(X, edges)] if revolved else edges
    least = NEGLIGIBLE * float(np.abs(X).max(initial=0.0))
    weight, total = np.zeros(len(X)), np.zeros(len(X))
    length = edge_areas(X, edges, False)
    for k, s in enumerate((-1.0, 1.0, 0.0)[: edges.shape[1]]):
        dN = slopes_at(s, edges.shape[1])[1]
        then, now = (np.einsum("a,kai->ki", dN, p[edges]) for p in (X, x))
        ratio = np.hypot(now[:, 0], now[:, 1]) / np.hypot(then[:, 0], then[:, 1])
        node = edges[:, k]
        if revolved:
            R, at_axis = X[node, 0], X[node, 0] <= least
            slope = np.where(np.abs(then[:, 0]) > least, then[:, 0], 1.0)
            ratio *= np.where(at_axis, np.abs(now[:, 0] / slope), x[node, 0] / np.where(at_axis, 1.0, R))
        np.add.at(total, node, length * ratio)
        np.add.at(weight, node, length)
    return np.divide(total, weight, out=np.full(len(X), np.nan), where=weight > 0.0)
