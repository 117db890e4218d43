"""Recovered stresses: least-squares patches over the integration points, or extrapolated and averaged at the nodes.

Zienkiewicz & Zhu (1992): around each interior node the stress of the integration points is fitted by a polynomial, which
is evaluated at the nodes of the patch; a node on the boundary averages the patches that contain it. Nodes that no
interior patch reaches fit the elements at hand. `smoothed` is the older route, the one that the paper took.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True)
def _fit(members, X, values, centre, size, coefs):
    """Least squares of [1, ξ, η, ξη] over the points of the member elements → coefs (4, values); False if singular."""
    M = np.zeros((4, 4))
    B = np.zeros((4, values.shape[2]))
    basis = np.empty(4)
    basis[0] = 1.0
    for e in members:
        for q in range(X.shape[1]):
            basis[1] = (X[e, q, 0] - centre[0]) / size
            basis[2] = (X[e, q, 1] - centre[1]) / size
            basis[3] = basis[1] * basis[2]
            for i in range(4):
                for j in range(4):
                    M[i, j] += basis[i] * basis[j]
                for c in range(values.shape[2]):
                    B[i, c] += basis[i] * values[e, q, c]
    if abs(np.linalg.det(M)) < 1e-14:
        return False
    coefs[:, :] = np.linalg.solve(M, B)
    return True


@njit(cache=True)
def _patches(first, members, interior, cells, x, X, values, out, count):
    n = x.shape[0]
    coefs = np.zeros((4, values.shape[2]))
    for stage in range(2):
        for v in range(n):
            if (stage == 0 and not interior[v]) or (stage == 1 and count[v] > 0):
                continue
            patch = members[first[v] : first[v + 1]]
            size = 0.0
            for e in patch:
                for a in range(cells.shape[1]):
                    size = max(size, abs(x[cells[e, a], 0] - x[v, 0]), abs(x[cells[e, a], 1] - x[v, 1]))
            if size == 0.0 or not _fit(patch, X, values, x[v], size, coefs):
                continue
            for e in patch:
                for a in range(cells.shape[1]):
                    w = cells[e, a]
                    # an interior node trusts its own patch alone; a boundary node collects what reaches it
                    if w != v and (interior[w] or stage == 1):
                        continue
                    seen = False
                    for f in patch:  # count each outside node once
                        if f == e:
                            break
                        for b in range(cells.shape[1]):
                            if cells[f, b] == w:
                                seen = True
                    if seen:
                        continue
                    s = (x[w, 0] - x[v, 0]) / size
                    t = (x[w, 1] - x[v, 1]) / size
                    for c in range(values.shape[2]):
                        val = coefs[0, c] + coefs[1, c] * s + coefs[2, c] * t + coefs[3, c] * s * t
                        out[w, c] += val
                    count[w] += 1


def recover(x: Array, cells: NDArray[np.int64], X: Array, values: Array) -> Array:
    """Nodal values (n, v) from point values (e, q, v) at positions X (e, q, 2); x (n, 2) nodes, cells (e, a)."""
    n, a = len(x), cells.shape[1]
    order = np.argsort(cells.ravel(), kind="stable")
    members = (order // a).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(np.bincount(cells.ravel(), minlength=n))]).astype(np.int64)
    edges = np.sort(np.concatenate([cells[:, [i, (i + 1) % a]] for i in range(a)]), axis=1)
    key, times = np.unique(edges[:, 0] * np.int64(n) + edges[:, 1], return_counts=True)
    interior = np.ones(n, dtype=np.bool_)
    outer = key[times == 1]
    interior[outer // n] = False
    interior[outer % n] = False
    interior &= np.diff(first) > 0
    out, count = np.zeros((n, values.shape[2])), np.zeros(n, dtype=np.int64)
    _patches(first, members, interior, cells, x, np.ascontiguousarray(X), np.ascontiguousarray(values), out, count)
    return out / np.maximum(count, 1)[:, None]


def smoothed(x: Array, cells: NDArray[np.int64], X: Array, values: Array) -> Array:
    """Nodal values as in `recover`, but extrapolated from the points of each element to its corners and averaged there.

    "Los puntos de integración del elemento … llevados a los nodos de contacto mediante interpolación y posterior
    suavización" (the paper); Hinton and Campbell (1974). The field of an element is the least-squares bilinear one
    of its points, which for 2 × 2 points goes through them.
    """
    corners = x[cells]
    centre = corners.mean(axis=1, keepdims=True)
    size = np.abs(corners - centre).max(axis=(1, 2))[:, None, None]

    def basis(p: Array) -> Array:
        s, t = np.moveaxis((p - centre) / size, -1, 0)
        return np.stack([np.ones_like(s), s, t, s * t], axis=-1)

    at_corners = basis(corners) @ (np.linalg.pinv(basis(X)) @ values)
    out = np.zeros((len(x), values.shape[2]))
    np.add.at(out, cells, at_corners)
    return out / np.maximum(np.bincount(cells.ravel(), minlength=len(x)), 1)[:, None]
