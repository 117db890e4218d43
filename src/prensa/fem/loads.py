"""Loads on boundaries: dead tractions, follower pressure and shear with exact tangents, on linear and quadratic edges.

An edge has two nodes (start, end) or three (start, end, middle), body on the left; forces are f_a = ∫ N_a t dΓ with the
shape functions of the edge, by Gauss points that integrate every term exactly on straight edges.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_GAUSS = {2: np.polynomial.legendre.leggauss(2), 3: np.polynomial.legendre.leggauss(3)}


def edge_shapes(nodes: int, xi: float) -> tuple[Array, Array]:
    """Shape functions and their slopes (nodes,) of an edge of 2 or 3 nodes at ξ in [−1, 1]."""
    if nodes == 2:
        return np.array([0.5 - 0.5 * xi, 0.5 + 0.5 * xi]), np.array([-0.5, 0.5])
    return (
        np.array([0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi * xi]),
        np.array([xi - 0.5, xi + 0.5, -2.0 * xi]),
    )


def _points(x: Array, edges: Index, depth: Array | None) -> list[tuple[float, Array, Array, Array, Array]]:
    """Gauss points: weight, N (a,), N′ (a,), tangent dx/dξ (k, 2), 2πr or thickness (k,)."""
    m = edges.shape[1]
    out = []
    for xi, weight in zip(*_GAUSS[m]):
        N, dN = edge_shapes(m, float(xi))
        d = np.einsum("a,kad->kd", dN, x[edges])
        rho = 2 * np.pi * (x[edges][:, :, 0] @ N) if depth is None else depth[edges] @ N
        out.append((float(weight), N, dN, d, rho))
    return out


def boundary_force(
    x: Array, edges: Index, depth: Array | None, pressure: float = 0.0, shear: float = 0.0,
    traction: tuple[float, float] = (0.0, 0.0),
) -> Array:  # fmt: skip
    """Forces (k, 2a) on the nodes of edges (k, a) of the configuration x (n, 2), stresses per area of x.

    ``depth`` (n,): thickness at the nodes; None in axisymmetry (2πr). Traction −p n + q τ + t with τ along the edge.
    """
    f = np.zeros((*edges.shape, 2))
    M = np.array([[shear, -pressure], [pressure, shear]])
    t = np.array(traction)
    for weight, N, _, d, rho in _points(x, edges, depth):
        per_length = d @ M.T + np.hypot(d[:, 0], d[:, 1])[:, None] * t
        f += (weight * rho)[:, None, None] * N[:, None] * per_length[:, None, :]
    return f.reshape(len(edges), -1)


def follower_stiffness(x: Array, edges: Index, depth: Array | None, pressure: float, shear: float) -> Array:
    """K (k, 2a, 2a) = −∂f/∂x of follower pressure and shear (`boundary_force`): t dΓ = M x′ dξ, linear in the positions."""
    k, m = edges.shape
    K = np.zeros((k, m, 2, m, 2))
    M = np.array([[shear, -pressure], [pressure, shear]])
    for weight, N, dN, d, rho in _points(x, edges, depth):
        K -= (weight * rho)[:, None, None, None, None] * np.einsum("a,b,ij->aibj", N, dN, M)
        if depth is None:
            K[..., 0] -= 2 * np.pi * weight * np.einsum("a,b,ki->kaib", N, N, d @ M.T)
    return K.reshape(k, 2 * m, 2 * m)
