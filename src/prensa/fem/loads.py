"""Loads on boundaries and bodies: dead tractions, follower pressure and shear with exact tangents, forces per volume."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_GAUSS = (0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0))


def edge_weights(x: Array, edges: Index, axisymmetric: bool, thickness: float) -> tuple[Array, Array]:
    """∫ N_a dΓ (k, 2) of linear edges (2πr or thickness inside) and unit tangents (k, 2) along them."""
    a, b = x[edges[:, 0]], x[edges[:, 1]]
    d = b - a
    length = np.hypot(d[:, 0], d[:, 1])
    if axisymmetric:
        ra, rb = a[:, 0], b[:, 0]
        w = 2 * np.pi * length[:, None] * np.stack([2 * ra + rb, ra + 2 * rb], axis=1) / 6
    else:
        w = np.repeat(0.5 * thickness * length[:, None], 2, axis=1)
    return w, d / length[:, None]


def dead_force(x: Array, edges: Index, traction: Array, axisymmetric: bool, thickness: float, n: int) -> Array:
    """Nodal forces (n, 2) of a traction (2,) or (k, 2) per area of the configuration x."""
    w, _ = edge_weights(x, edges, axisymmetric, thickness)
    t = np.broadcast_to(traction, (len(edges), 2))
    out = np.zeros((n, 2))
    np.add.at(out, edges[:, 0], w[:, :1] * t)
    np.add.at(out, edges[:, 1], w[:, 1:] * t)
    return out


def follower(
    x: Array, edges: Index, pressure: float, shear: float, axisymmetric: bool, thickness: float
) -> tuple[Array, Array]:
    """Forces f (k, 4) on the two nodes of each edge of the current configuration x and K = −∂f/∂x (k, 4, 4).

    Traction t = −p n + q τ with τ along the edge and n outward: t ds = (−p n̂ + q τ̂) with n̂ = (d_y, −d_x), τ̂ = d = b − a,
    so that f_a = ∫ N_a t ds is bilinear in the node positions.
    """
    a, b = x[edges[:, 0]], x[edges[:, 1]]
    d = b - a
    # t ds = M d dξ, M = q I + p J with J d = (−d_y, d_x)
    M = np.array([[shear, -pressure], [pressure, shear]])
    t = d @ M.T
    f = np.zeros((len(edges), 4))
    K = np.zeros((len(edges), 4, 4))
    for xi in _GAUSS:
        N = np.array([1.0 - xi, xi])
        for i in range(2):
            rho = 2 * np.pi * (N[0] * a[:, 0] + N[1] * b[:, 0]) if axisymmetric else np.full(len(edges), thickness)
            c = 0.5 * N[i]
            f[:, 2 * i : 2 * i + 2] += (c * rho)[:, None] * t
            for j, sign in ((0, -1.0), (1, 1.0)):
                K[:, 2 * i : 2 * i + 2, 2 * j : 2 * j + 2] -= (c * rho * sign)[:, None, None] * M
                if axisymmetric:
                    K[:, 2 * i : 2 * i + 2, 2 * j] -= c * 2 * np.pi * N[j] * t
    return f, K
