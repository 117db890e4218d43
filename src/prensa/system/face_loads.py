"""Loads on faces of bodies in space: dead tractions and follower pressure with its exact tangent.

A face has four nodes or six, seen from outside counter-clockwise; forces are f_a = ∫ N_a t dΓ, with x(ξ, η) bilinear or
quadratic. The area vector is x_ξ × x_η dξ dη, so that the points integrate a pressure and its tangent exactly on any face,
warped ones included.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.mesh.faces import exact_points, shapes
from prensa.types import Array, Index


def face_force(x: Array, faces: Index, pressure: float = 0.0, traction: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Array:
    """Forces (k, 3 a) on the nodes of faces (k, a) of the configuration x (n, 3), stresses per area of x: −p n + t."""
    f, t = np.zeros((*faces.shape, 3)), np.array(traction)
    for weight, N, dN in _points(faces):
        along = np.einsum("ai,kad->kid", dN, x[faces])
        area = weight * np.cross(along[:, 0], along[:, 1])
        per_point = np.linalg.norm(area, axis=1)[:, None] * t - pressure * area
        f += N[:, None] * per_point[:, None, :]
    return f.reshape(len(faces), -1)


def pressure_stiffness(x: Array, faces: Index, pressure: float) -> Array:
    """K (k, 3 a, 3 a) = −∂f/∂x of a follower pressure (`face_force`): of the area vector x_ξ × x_η alone."""
    a = faces.shape[1]
    K = np.zeros((len(faces), a, 3, a, 3))
    for weight, N, dN in _points(faces):
        along = np.einsum("ai,kad->kid", dN, x[faces])
        # d(x_ξ × x_η) = [x_ξ]× dx_η − [x_η]× dx_ξ
        for skew, slopes in ((_skew(along[:, 0]), dN[:, 1]), (-_skew(along[:, 1]), dN[:, 0])):
            K += weight * pressure * np.einsum("a,b,kij->kaibj", N, slopes, skew)
    return K.reshape(len(faces), 3 * a, 3 * a)


def _points(faces: Index) -> Iterator[tuple[float, Array, Array]]:
    """Weight, shape functions (a,) and slopes (a, 2) at each point."""
    at, weight = exact_points(faces.shape[1])
    return zip(weight.tolist(), *shapes(at, faces.shape[1]))


def _skew(v: Array) -> Array:
    """[v]× (k, 3, 3) with [v]× w = v × w, of vectors v (k, 3)."""
    return np.cross(v[:, None, :], np.eye(3)).transpose(0, 2, 1)
