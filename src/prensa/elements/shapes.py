"""Shape functions and quadrature (Gauss points) of the isoparametric elements, as tables that the kernels read.

Nodes: corners counter-clockwise, then mid-side nodes in the order of the sides. Triangles in area coordinates
L = (1 − ξ − η, ξ, η), quadrilaterals on [−1, 1]² (Zienkiewicz & Taylor 2000, The Finite Element Method, vol. 1, ch. 8, 9);
bricks on [−1, 1]³, the face ζ = −1 before ζ = 1, each in the order of the quadrilateral. Tetrahedra in volume coordinates
L = (1 − ξ − η − ζ, ξ, η, ζ): four corners, the fourth above the triangle of the others, then the middles of `TETRAHEDRON_EDGES`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from prensa.layout import TETRAHEDRON_EDGES
from prensa.types import Array

_XI = np.array([-1.0, 1.0, 1.0, -1.0, 0.0, 1.0, 0.0, -1.0])
_ETA = np.array([-1.0, -1.0, 1.0, 1.0, -1.0, 0.0, 1.0, 0.0])


class Table(NamedTuple):
    """N (q, a), slopes dN (q, a, d) in ξ, η[, ζ] and weights (q,) at the integration points ``at`` (q, d).

    ``rows`` (q, (1 + d) a + 1): of each point N, the slopes in ξ, in η[, in ζ] and the weight, one after the other.
    """

    N: Array
    dN: Array
    weight: Array
    at: Array
    rows: Array


def t3(xi: float, eta: float) -> tuple[Array, Array]:
    """N (3,), dN (3, 2) of the linear triangle."""
    return np.array([1.0 - xi - eta, xi, eta]), np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])


def t6(xi: float, eta: float) -> tuple[Array, Array]:
    """N (6,), dN (6, 2) of the quadratic triangle."""
    L, dL = t3(xi, eta)
    a, b = [0, 1, 2], [1, 2, 0]
    N = np.concatenate([L * (2.0 * L - 1.0), 4.0 * L[a] * L[b]])
    dN = np.concatenate([(4.0 * L - 1.0)[:, None] * dL, 4.0 * (dL[a] * L[b][:, None] + L[a][:, None] * dL[b])])
    return N, dN


def q4(xi: float, eta: float) -> tuple[Array, Array]:
    """N (4,), dN (4, 2) of the bilinear quadrilateral."""
    s, t = _XI[:4], _ETA[:4]
    N = 0.25 * (1.0 + s * xi) * (1.0 + t * eta)
    return N, 0.25 * np.stack([s * (1.0 + t * eta), t * (1.0 + s * xi)], axis=1)


def q8(xi: float, eta: float) -> tuple[Array, Array]:
    """N (8,), dN (8, 2) of the serendipity quadrilateral."""
    s, t = _XI[:4], _ETA[:4]
    corner = 0.25 * (1.0 + s * xi) * (1.0 + t * eta) * (s * xi + t * eta - 1.0)
    dcorner = 0.25 * np.stack(
        [s * (1.0 + t * eta) * (2.0 * s * xi + t * eta), t * (1.0 + s * xi) * (2.0 * t * eta + s * xi)], axis=1
    )
    N, dN = np.empty(8), np.empty((8, 2))
    N[:4], dN[:4] = corner, dcorner
    for a in (4, 6):
        N[a] = 0.5 * (1.0 - xi * xi) * (1.0 + _ETA[a] * eta)
        dN[a] = -xi * (1.0 + _ETA[a] * eta), 0.5 * _ETA[a] * (1.0 - xi * xi)
    for a in (5, 7):
        N[a] = 0.5 * (1.0 + _XI[a] * xi) * (1.0 - eta * eta)
        dN[a] = 0.5 * _XI[a] * (1.0 - eta * eta), -eta * (1.0 + _XI[a] * xi)
    return N, dN


def h8(xi: float, eta: float, zeta: float) -> tuple[Array, Array]:
    """N (8,), dN (8, 3) of the trilinear brick: a quadrilateral on ζ = −1, counter-clockwise seen from +ζ, and one on ζ = 1."""
    (N, dN), sign = q4(xi, eta), np.repeat([-1.0, 1.0], 4)
    across = 0.5 * (1.0 + sign * zeta)
    slopes = np.column_stack([np.tile(dN, (2, 1)) * across[:, None], 0.5 * sign * np.tile(N, 2)])
    return np.tile(N, 2) * across, slopes


def t10(xi: float, eta: float, zeta: float) -> tuple[Array, Array]:
    """N (10,), dN (10, 3) of the quadratic tetrahedron."""
    L, dL = np.array([1.0 - xi - eta - zeta, xi, eta, zeta]), np.vstack([np.full(3, -1.0), np.eye(3)])
    a, b = np.array(TETRAHEDRON_EDGES).T
    N = np.concatenate([L * (2.0 * L - 1.0), 4.0 * L[a] * L[b]])
    return N, np.concatenate([(4.0 * L - 1.0)[:, None] * dL, 4.0 * (dL[a] * L[b][:, None] + L[a][:, None] * dL[b])])


_SHAPES: dict[tuple[int, int], Callable[..., tuple[Array, Array]]] = {
    (3, 2): t3, (6, 2): t6, (4, 2): q4, (8, 2): q8, (8, 3): h8, (10, 3): t10,
}  # fmt: skip
"""By nodes and dimension."""


def rectangle(along: int, across: int) -> tuple[Array, Array]:
    """Gauss points (along · across, 2) of the square, different in number in ξ and η, in rows along ξ; and their weights."""
    x, y = np.polynomial.legendre.leggauss(along), np.polynomial.legendre.leggauss(across)
    xi, eta = np.meshgrid(x[0], y[0])
    return np.stack([xi.ravel(), eta.ravel()], axis=1), np.outer(y[1], x[1]).ravel()


def square(n: int) -> tuple[Array, Array]:
    """N × n Gauss points (n², 2) of the square and their weights; 2 × 2 counter-clockwise from (−, −) like the corners."""
    at, weight = rectangle(n, n)
    order = [0, 1, 3, 2] if n == 2 else list(range(n * n))
    return at[order], weight[order]


def cube(n: int) -> tuple[Array, Array]:
    """N × n × n Gauss points (n³, 3) of the cube and their weights: the layers of `square` from ζ = −1 on."""
    (at, weight), (z, w) = square(n), np.polynomial.legendre.leggauss(n)
    return np.column_stack([np.tile(at, (n, 1)), np.repeat(z, n * n)]), np.outer(w, weight).ravel()


def triangle(points: int) -> tuple[Array, Array]:
    """1 point (degree 1) or 3 inside (degree 2) of the triangle, and their weights (sum ½)."""
    if points == 1:
        return np.full((1, 2), 1.0 / 3.0), np.array([0.5])
    a, b = 1.0 / 6.0, 2.0 / 3.0
    return np.array([[a, a], [b, a], [a, b]]), np.full(3, 1.0 / 6.0)


def tetrahedron() -> tuple[Array, Array]:
    """4 points inside (degree 2; Hammer & Stroud 1956) of the tetrahedron, the nearest of each corner, and weights (sum 1/6)."""
    a = (5.0 - np.sqrt(5.0)) / 20.0
    L = a + (1.0 - 4.0 * a) * np.eye(4)
    return L[:, 1:], np.full(4, 1.0 / 24.0)


def table(nodes: int, rule: tuple[Array, Array]) -> Table:
    """Table of the element with that many nodes at the points of a rule."""
    at, weight = rule
    shape = _SHAPES[nodes, at.shape[1]]
    values = [shape(*(float(c) for c in p)) for p in at]
    N, dN = np.array([v[0] for v in values]), np.array([v[1] for v in values])
    rows = np.concatenate([N, dN.transpose(0, 2, 1).reshape(len(at), -1), weight[:, None]], axis=1)
    return Table(N, dN, weight, at, rows)


def centre(nodes: int, dimension: int) -> Array:
    """Shape functions at ξ = η[= ζ] = 0 and their slopes in ξ, in η[, in ζ], ((1 + d) a,)."""
    N, dN = _SHAPES[nodes, dimension](*[0.0] * dimension)
    return np.concatenate([N, dN.T.ravel()])
