"""Quadrilateral faces and bricks by their shape functions: areas, volumes, where in them coordinates have given values.

Both are multilinear: N_a = Π (1 + s_a ξ)/2 over the directions, with corners s_a in the order of the elements.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from prensa.precision import DRAWN, NEGLIGIBLE, SMALLEST
from prensa.types import Array, Index

_SQUARE_SIGNS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
_SIGNS = {
    4: _SQUARE_SIGNS,
    8: np.vstack([np.column_stack([_SQUARE_SIGNS, np.full(4, end)]) for end in (-1.0, 1.0)]),
}
_GAUSS_PAIRS = np.array(list(product(np.polynomial.legendre.leggauss(2)[0].tolist(), repeat=2)))


def multilinear(at: Array, nodes: int) -> tuple[Array, Array]:
    """N (k, nodes) and slopes (k, nodes, d) at places (k, d) in [−1, 1]^d of faces (4 nodes) or bricks (8)."""
    signs = _SIGNS[nodes]
    factors = 0.5 * (1.0 + signs * at[:, None, :])
    slopes = np.empty_like(factors)
    for d in range(signs.shape[1]):
        others = np.delete(factors, d, axis=2).prod(axis=2)
        slopes[..., d] = 0.5 * signs[:, d] * others
    return factors.prod(axis=2), slopes


def area_vectors(x: Array) -> tuple[Array, Array]:
    """N (q, a) at the Gauss points of faces x (m, 4 | 6, 3), four of bilinear ones, three of triangles of six nodes, and the area
    vectors (q, m, 3) there, whose sum is that of the face.
    """
    N, dN = _six_nodes() if x.shape[1] == 6 else multilinear(_GAUSS_PAIRS, 4)
    along = np.einsum("qai,mad->qmid", dN, x)
    area = np.cross(along[:, :, 0], along[:, :, 1])
    return N, area / 6.0 if x.shape[1] == 6 else area


def _six_nodes() -> tuple[Array, Array]:
    """N (3, 6) and slopes (3, 6, 2) of a triangle with nodes in the middle of its sides, at its three points of degree two."""
    L = np.full((3, 3), 1.0 / 6.0) + 0.5 * np.eye(3)
    dL = np.array([(-1.0, -1.0), (1.0, 0.0), (0.0, 1.0)])
    ends = [(0, 1), (1, 2), (2, 0)]
    N = np.column_stack([L * (2.0 * L - 1.0), *(4.0 * L[:, a] * L[:, b] for a, b in ends)])
    corners = (4.0 * L - 1.0)[..., None] * dL
    middles = np.stack([4.0 * (L[:, a, None] * dL[b] + L[:, b, None] * dL[a]) for a, b in ends], axis=1)
    return N, np.concatenate([corners, middles], axis=1)


def face_areas(x: Array, faces: Index) -> Array:
    """Areas (m,) of faces (m, 4 | 6) on nodes x (n, 3)."""
    return np.asarray(np.linalg.norm(area_vectors(x[faces])[1], axis=2).sum(axis=0))


def enclosed_volume(x: Array, faces: Index) -> float:
    """Volume inside of closed faces (m, 4 | 6), seen from outside counter-clockwise, by the divergence of the position."""
    N, area = area_vectors(x[faces])
    return float((np.einsum("qa,mad->qmd", N, x[faces]) * area).sum() / 3.0)


def face_expansion(X: Array, x: Array, faces: Index) -> Array:
    """Area around nodes now over that at first (n,), on faces (m, 4 | 6) of nodes at X (n, 3) then, x now; nan elsewhere."""
    now, then = (np.bincount(faces.ravel(), _shares(p[faces]).ravel(), len(X)) for p in (x, X))
    return np.divide(now, then, out=np.full(len(X), np.nan), where=then > 0.0)


def _shares(x: Array) -> Array:
    """∫ N_A dΓ (m, 4) of faces x (m, 4, 3); of six nodes, whose corners have none, the sixth part of the area at each (m, 6)."""
    N, area = area_vectors(x)
    if x.shape[1] == 6:
        return np.repeat(np.linalg.norm(area, axis=2).sum(axis=0)[:, None] / 6.0, 6, axis=1)
    return np.einsum("qa,qm->ma", N, np.linalg.norm(area, axis=2))


def located(values: Array, level: Array) -> tuple[Index, Array]:
    """Elements (k,) in which nodal values (m, a, d) take the ``level`` (d,), and where in them, (k, d); Newton's method.

    On their common sides more than one element is found. d is the dimension of the elements: two for faces, three for bricks.
    """
    size = np.ptp(values.reshape(-1, values.shape[2]), axis=0).max(initial=SMALLEST)
    slack = NEGLIGIBLE * size
    inside = ((values.min(axis=1) <= level + slack) & (values.max(axis=1) >= level - slack)).all(axis=1)
    # where a coordinate is the same all over an element, it names no place in it
    inside &= (np.ptp(values, axis=1) > slack).all(axis=1)
    found = np.flatnonzero(inside)
    at, own = np.zeros((len(found), values.shape[2])), values[found]
    for _ in range(20):  # a handful where the element is not folded
        N, dN = multilinear(at, values.shape[1])
        missing = level - np.einsum("ka,kad->kd", N, own)
        if np.abs(missing).max(initial=0.0) <= slack:
            break
        slopes = np.einsum("kai,kad->kdi", dN, own)
        flat = np.abs(np.linalg.det(slopes)) <= slack**values.shape[2]
        slopes[flat] = np.eye(values.shape[2])
        step = np.linalg.solve(slopes, missing[..., None])[..., 0]
        at = np.clip(at + step, -2.0, 2.0)  # an element that has not the level leads nowhere
    reached = np.abs(missing).max(axis=1) <= slack if len(found) else np.zeros(0, dtype=bool)
    within = reached & (np.abs(at) <= 1.0 + DRAWN).all(axis=1)
    return found[within], np.clip(at[within], -1.0, 1.0)


def nearest_on_faces(points: Array, x: Array, faces: Index) -> Array:
    """Distances (k,) of points (k, 3) from faces (m, 4 | 6) on nodes x (n, 3), bilinear ones or triangles between corners."""
    corners = x[faces[:, [0, 1, 2, 2]] if faces.shape[1] == 6 else faces]
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    out = np.empty(len(points))
    for k, p in enumerate(points):
        far = np.linalg.norm(middle - p, axis=1)
        some = np.flatnonzero(far - radius <= (far + radius).min())
        out[k] = _distance_to(p, corners[some])
    return out


def _distance_to(p: Array, x: Array) -> float:
    """Least distance of a point (3,) from faces x (m, 4, 3): Gauss and Newton's method within the square of each face."""
    at = np.zeros((len(x), 2))
    for _ in range(20):
        N, dN = multilinear(at, 4)
        r = np.einsum("ma,mad->md", N, x) - p
        along = np.einsum("mai,mad->mid", dN, x)
        slope = np.einsum("mid,md->mi", along, r)
        metric = np.einsum("mid,mjd->mij", along, along)
        # on the border a coordinate that would leave the square stays there
        stays = (np.abs(at) >= 1.0) & (slope * at < 0.0)
        for i in range(2):
            metric[stays[:, i], i, :] = metric[stays[:, i], :, i] = 0.0
            metric[stays[:, i], i, i] = 1.0
        step = -np.linalg.solve(metric, np.where(stays, 0.0, slope)[..., None])[..., 0]
        moved = np.clip(at + step, -1.0, 1.0)
        if np.abs(moved - at).max() <= NEGLIGIBLE:
            break
        at = moved
    return float(np.linalg.norm(np.einsum("ma,mad->md", multilinear(at, 4)[0], x) - p, axis=1).min())
