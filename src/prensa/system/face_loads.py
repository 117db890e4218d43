"""Loads on faces of bodies in space: dead tractions and follower pressure with its exact tangent.

A face has four nodes, seen from outside counter-clockwise; forces are f_a = ∫ N_a t dΓ, with x(ξ, η) bilinear. The area vector
is x_ξ × x_η dξ dη, so that 2 × 2 Gauss points integrate a pressure and its tangent exactly on any face, warped ones included.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from prensa.elements.shapes import q4
from prensa.types import Array, Index

_AT_GAUSS = [q4(xi, eta) for xi, eta in product(np.polynomial.legendre.leggauss(2)[0].tolist(), repeat=2)]
"""Shape functions (4,) and slopes (4, 2) at the Gauss points, whose weights are 1."""


def face_force(x: Array, faces: Index, pressure: float = 0.0, traction: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Array:
    """Forces (k, 12) on the nodes of faces (k, 4) of the configuration x (n, 3), stresses per area of x: −p n + t."""
    f, t = np.zeros((*faces.shape, 3)), np.array(traction)
    for N, dN in _AT_GAUSS:
        along = np.einsum("ai,kad->kid", dN, x[faces])
        area = np.cross(along[:, 0], along[:, 1])
        per_point = np.linalg.norm(area, axis=1)[:, None] * t - pressure * area
        f += N[:, None] * per_point[:, None, :]
    return f.reshape(len(faces), -1)


def pressure_stiffness(x: Array, faces: Index, pressure: float) -> Array:
    """K (k, 12, 12) = −∂f/∂x of a follower pressure (`face_force`): of the area vector x_ξ × x_η alone."""
    K = np.zeros((len(faces), 4, 3, 4, 3))
    for N, dN in _AT_GAUSS:
        along = np.einsum("ai,kad->kid", dN, x[faces])
        # d(x_ξ × x_η) = [x_ξ]× dx_η − [x_η]× dx_ξ
        for skew, slopes in ((_skew(along[:, 0]), dN[:, 1]), (-_skew(along[:, 1]), dN[:, 0])):
            K += pressure * np.einsum("a,b,kij->kaibj", N, slopes, skew)
    return K.reshape(len(faces), 12, 12)


def _skew(v: Array) -> Array:
    """[v]× (k, 3, 3) with [v]× w = v × w, of vectors v (k, 3)."""
    return np.cross(v[:, None, :], np.eye(3)).transpose(0, 2, 1)
