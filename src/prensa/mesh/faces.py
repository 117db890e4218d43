"""Faces and elements in space by their shape functions: areas, volumes, where in them coordinates have given values.

Quadrilaterals and bricks are multilinear: N_a = Π (1 + s_a ξ)/2 over the directions, with corners s_a in the order of the
elements. Triangles of six nodes and tetrahedra of ten are quadratic in L = (1 − ξ − η [− ζ], ξ, η [, ζ]).
"""

from __future__ import annotations

from itertools import product

import numpy as np

from prensa.geometry.box_tree import box_tree
from prensa.precision import DRAWN, NEGLIGIBLE, SMALLEST
from prensa.types import Array, Index

_SQUARE_SIGNS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
_SIGNS = {
    4: _SQUARE_SIGNS,
    8: np.vstack([np.column_stack([_SQUARE_SIGNS, np.full(4, end)]) for end in (-1.0, 1.0)]),
}
_SIX_NODE_POINTS = np.array([(1.0, 1.0), (4.0, 1.0), (1.0, 4.0)]) / 6.0
"""Of degree two on a triangle, a third of its area each."""
_GAUSS_PAIRS = np.array(list(product(np.polynomial.legendre.leggauss(2)[0].tolist(), repeat=2)))
_SIMPLEX_SIDES = {6: np.array([(0, 1), (1, 2), (2, 0)]), 10: np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])}
"""Corners at the ends of the sides whose middles are nodes, by the number of nodes."""


def shapes(at: Array, nodes: int) -> tuple[Array, Array]:
    """N (k, nodes) and slopes (k, nodes, d) at places (k, d) of faces of 4 or 6 nodes, of elements of 8 or 10."""
    return _quadratic(at, nodes) if nodes in _SIMPLEX_SIDES else multilinear(at, nodes)


def _quadratic(at: Array, nodes: int) -> tuple[Array, Array]:
    """Of triangles and tetrahedra with nodes in the middle of their sides."""
    d, (a, b) = at.shape[1], _SIMPLEX_SIDES[nodes].T
    L, dL = np.column_stack([1.0 - at.sum(axis=1), at]), np.vstack([np.full(d, -1.0), np.eye(d)])
    N = np.concatenate([L * (2.0 * L - 1.0), 4.0 * L[:, a] * L[:, b]], axis=1)
    corners = (4.0 * L - 1.0)[..., None] * dL
    return N, np.concatenate([corners, 4.0 * (L[:, a, None] * dL[b] + L[:, b, None] * dL[a])], axis=1)


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
    N, area = _area_vectors_at(x, _SIX_NODE_POINTS if x.shape[1] == 6 else _GAUSS_PAIRS)
    return N, area / 6.0 if x.shape[1] == 6 else area


def _area_vectors_at(x: Array, at: Array) -> tuple[Array, Array]:
    """N (q, a) at places (q, 2) of faces x (m, a, 3), and the area vectors (q, m, 3) over those of the reference there."""
    N, dN = shapes(at, x.shape[1])
    along = np.einsum("qai,mad->qmid", dN, x)
    return N, np.cross(along[:, :, 0], along[:, :, 1])


def normals_at_sides(x: Array) -> Array:
    """Unit normals (m, s, 3) of faces x (m, 4 | 6, 3) at their sides: of six nodes at their middles, of four that of the face."""
    if x.shape[1] == 4:
        area = np.repeat(area_vectors(x)[1].sum(axis=0)[:, None], 4, axis=1)
    else:
        along = np.einsum("qai,mad->mqid", shapes(np.array([(0.5, 0.0), (0.5, 0.5), (0.0, 0.5)]), 6)[1], x)
        area = np.cross(along[:, :, 0], along[:, :, 1])
    return np.asarray(area / np.maximum(np.linalg.norm(area, axis=2, keepdims=True), SMALLEST))


def face_areas(x: Array, faces: Index) -> Array:
    """Areas (m,) of faces (m, 4 | 6) on nodes x (n, 3)."""
    return np.asarray(np.linalg.norm(area_vectors(x[faces])[1], axis=2).sum(axis=0))


def enclosed_volume(x: Array, faces: Index) -> float:
    """Volume inside of closed faces (m, 4 | 6), seen from outside counter-clockwise, by the divergence of the position."""
    at, weight = exact_points(faces.shape[1])
    N, area = _area_vectors_at(x[faces], at)
    return float((np.einsum("qa,mad->qmd", N, x[faces]) * weight[:, None, None] * area).sum() / 3.0)


def exact_points(nodes: int) -> tuple[Array, Array]:
    """Places (q, 2) and weights (q,) on faces of 4 or 6 nodes that integrate a shape function times the area vector exactly.

    That is of degree two along each direction, or of degree four on a triangle: Gauss points of the square, collapsed onto it
    (Stroud 1971).
    """
    if nodes == 4:
        return _GAUSS_PAIRS, np.ones(len(_GAUSS_PAIRS))
    g, w = np.polynomial.legendre.leggauss(3)
    s, t = (a.ravel() for a in np.meshgrid(0.5 + 0.5 * g, 0.5 + 0.5 * g, indexing="ij"))
    return np.column_stack([s * (1.0 - t), s * t]), 0.25 * s * np.outer(w, w).ravel()


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

    On their common sides more than one element is found. d is the dimension of the elements: two for faces, three for bricks and
    tetrahedra.
    """
    nodes = values.shape[1]
    size = np.ptp(values.reshape(-1, values.shape[2]), axis=0).max(initial=SMALLEST)
    slack = NEGLIGIBLE * size
    bounds = values
    if nodes in _SIMPLEX_SIDES:  # a quadratic field lies between its Bernstein coefficients, and may exceed its nodal values
        corners = nodes - len(_SIMPLEX_SIDES[nodes])
        ends = values[:, _SIMPLEX_SIDES[nodes]].sum(axis=2)
        bounds = np.concatenate([values[:, :corners], 2.0 * values[:, corners:] - 0.5 * ends], axis=1)
    inside = ((bounds.min(axis=1) <= level + slack) & (bounds.max(axis=1) >= level - slack)).all(axis=1)
    # where a coordinate is the same all over an element, it names no place in it
    inside &= (np.ptp(values, axis=1) > slack).all(axis=1)
    found = np.flatnonzero(inside)
    at, own = np.full((len(found), values.shape[2]), _middle(nodes)), values[found]
    for _ in range(20):  # a handful where the element is not folded
        N, dN = shapes(at, nodes)
        missing = level - np.einsum("ka,kad->kd", N, own)
        if np.abs(missing).max(initial=0.0) <= slack:
            break
        slopes = np.einsum("kai,kad->kdi", dN, own)
        flat = np.abs(np.linalg.det(slopes)) <= slack**values.shape[2]
        slopes[flat] = np.eye(values.shape[2])
        step = np.linalg.solve(slopes, missing[..., None])[..., 0]
        at = np.clip(at + step, -2.0, 2.0)  # an element that has not the level leads nowhere
    reached = np.abs(missing).max(axis=1) <= slack if len(found) else np.zeros(0, dtype=bool)
    if nodes not in _SIMPLEX_SIDES:
        within = reached & (np.abs(at) <= 1.0 + DRAWN).all(axis=1)
        return found[within], np.clip(at[within], -1.0, 1.0)
    L = np.column_stack([1.0 - at.sum(axis=1), at])
    within = reached & (L >= -DRAWN).all(axis=1)
    L = np.maximum(L[within], 0.0)
    return found[within], L[:, 1:] / L.sum(axis=1, keepdims=True)


def _middle(nodes: int) -> float:
    """Coordinate of the middle of a face or an element."""
    return 1.0 / (nodes - len(_SIMPLEX_SIDES[nodes])) if nodes in _SIMPLEX_SIDES else 0.0


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
        # where the corner of a triangle stands for two of a face, one direction leads nowhere
        metric += (NEGLIGIBLE * np.trace(metric, axis1=1, axis2=2) + SMALLEST)[:, None, None] * np.eye(2)
        step = -np.linalg.solve(metric, np.where(stays, 0.0, slope)[..., None])[..., 0]
        moved = np.clip(at + step, -1.0, 1.0)
        if np.abs(moved - at).max() <= NEGLIGIBLE:
            break
        at = moved
    return float(np.linalg.norm(np.einsum("ma,mad->md", multilinear(at, 4)[0], x) - p, axis=1).min())


def first_met(start: Array, way: Array, x: Array) -> tuple[Index, Array]:
    """The first of triangles x (k, 3, 3) that rays from ``start`` (r, 3) along ``way`` (r, 3) meet, -1 for none; how far off.

    T. Möller, B. Trumbore, Fast, minimum storage ray/triangle intersection (1997). Those in which a ray begins do not count.
    """
    from prensa.kernels import rays  # compiled: most meshes need none

    met, far = np.full(len(start), -1), np.full(len(start), np.inf)
    if not len(x):
        return met, far
    least = NEGLIGIBLE * float(np.ptp(x.reshape(-1, 3), axis=0).max())
    slack = 4.0 * least  # beyond a side of a triangle, a part of its own size, which is less
    boxes, order = box_tree(x.min(axis=1) - slack, x.max(axis=1) + slack, x.mean(axis=1))
    x, start, way = (np.ascontiguousarray(v, dtype=np.float64) for v in (x, start, way))
    rays.first_met(boxes, order, x, least, start, way, met, far)
    return met, far


def area_normals(points: Array, sides: Index) -> Array:
    """Outward normals (k, d), as long as the side is large, of edges (k, 2), body on the left, or faces (k, 4)."""
    if points.shape[1] == 3:
        a = points[sides]
        return np.asarray(0.5 * np.cross(a[:, 2] - a[:, 0], a[:, 3] - a[:, 1]))
    t = points[sides[:, 1]] - points[sides[:, 0]]
    return np.stack([t[:, 1], -t[:, 0]], axis=1)


def facing(points: Array, sides: Index, normal: Array) -> float:
    """Cosine between the mean outward normal of edges (k, 2|3) or faces (k, 4|6) and a unit vector (d,); all around 0."""
    own = area_normals(points, sides[:, : 2 * (points.shape[1] - 1)])
    mean = own.sum(axis=0)
    length = float(np.linalg.norm(mean))
    return 0.0 if length <= NEGLIGIBLE * float(np.linalg.norm(own, axis=1).sum()) else float(mean @ normal) / length
