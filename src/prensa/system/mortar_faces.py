"""Dual mortar conditions between two sides of faces that lie on each other with different meshes (Puso 2004).

Each slave face is cut along the edges of the master faces that lie over it, in its middle plane; the pieces are convex polygons,
over the triangles of which all integrals are summed by one quadrature, so that biorthogonality holds for the sums themselves.

Shape functions of the corners of faces of six nodes have no area, and so no dual ones: of such a slave side the nodes in the
middle of the sides have the conditions, and its corners lie where the master side takes them. An even stress passes all the same.
"""

from __future__ import annotations

import numpy as np

from prensa.geometry.plane import cross
from prensa.mesh.faces import area_vectors, shapes
from prensa.mesh.mesh import MeshError
from prensa.precision import DRAWN, NEGLIGIBLE, ROUND_OFF
from prensa.system.mortar import APART, Integrals, Side
from prensa.types import Array, Flags, Index

_THREE_POINTS = np.polynomial.legendre.leggauss(3)


def face_integrals(X: Array, slave: Side, master: Side, apart: float = APART) -> Integrals:
    """Integrals between two sides of faces of nodes X (n, 3), as `prensa.system.mortar.integrals` has them of edges.

    ``apart``: distance, over the size of a slave face, up to which they lie on each other.

    Raises
    ------
    MeshError
        If the slave side does not lie on the master side all over.

    """
    x, y = X[slave.edges], X[master.edges]
    a, b = x.shape[1], y.shape[1]
    own, others = _corners(a), _corners(b)
    middle = x[:, :own].mean(axis=1)
    face, other = _overlapping(x[:, :own], y[:, :others], apart)
    frames = _frames(x)
    flat = _in_plane(x, middle, frames)
    over, nodes = _in_plane(y[other], middle[face], frames[face]), master.edges[other]
    away = _area(over[:, :others]) < 0.0  # the other side looks the other way
    back = [2, 1, 0, 4, 3, 5] if b == 6 else [3, 2, 1, 0]
    over, nodes = np.where(away[:, None, None], over[:, back], over), np.where(away[:, None], nodes[:, back], nodes)
    points, weights, pair = _quadrature(*_clipped(flat[face, :own], over[:, :others]))
    N = shapes(_inverse(flat[face[pair]], points), a)[0]
    Nm = shapes(_inverse(over[pair], points), b)[0]
    between = np.einsum("pa,pad->pd", N, x[face[pair]]) - np.einsum("pa,pad->pd", Nm, X[nodes[pair]])
    gap = np.abs(np.einsum("pd,pd->p", between, frames[face[pair], 2]))
    areas = _area(flat[:, :own])
    weights = np.where(gap <= apart * np.sqrt(areas)[face[pair]], weights, 0.0)
    owner = face[pair]
    single, mass = np.zeros((len(x), a)), np.zeros((len(x), a, a))
    np.add.at(single, owner, weights[:, None] * N)
    np.add.at(mass, owner, np.einsum("p,pa,pb->pab", weights, N, N))
    _refuse_uncovered(slave, master, x, single.sum(axis=1) / areas)
    values = np.einsum("p,pa,pb->pba", weights, N, Nm).reshape(-1, a)
    return Integrals(slave.edges, single, mass, np.repeat(owner, b), nodes[pair].ravel(), values)


def on_faces(X: Array, nodes: Index, master: Side) -> tuple[Index, Array]:
    """Nodes (k, b) of the faces of a side on which ``nodes`` (k,) of X (n, 3) lie, and their shape functions there (k, b)."""
    from scipy.spatial import cKDTree

    y = X[master.edges]
    b, corners = y.shape[1], y[:, : _corners(y.shape[1])]
    middle, frames = corners.mean(axis=1), _frames(y)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max()
    found = cKDTree(middle).query_ball_point(X[nodes], (1.0 + APART) * radius)
    node = np.repeat(np.arange(len(nodes)), [len(f) for f in found])
    face = np.fromiter((j for f in found for j in f), dtype=np.int64, count=len(node))
    points = _in_plane(X[nodes[node]][:, None], middle[face], frames[face])[:, 0]
    at = _inverse(_in_plane(y[face], middle[face], frames[face]), points)
    outside = np.maximum(-at.min(axis=1), at.sum(axis=1) - 1.0) if b == 6 else np.abs(at).max(axis=1) - 1.0
    order = np.lexsort((np.where(np.isfinite(outside), outside, np.inf), node))
    first = order[np.unique(node[order], return_index=True)[1]]
    return master.edges[face[first]], shapes(at[first], b)[0]


def _corners(nodes: int) -> int:
    """How many of the nodes of a face are its corners: they come first."""
    return 3 if nodes == 6 else 4


def _refuse_uncovered(slave: Side, master: Side, x: Array, covered: Array) -> None:
    """Raise for slave faces x (k, a, 3) that lie on the master side in part only: shares ``covered`` (k,)."""
    worst = int(np.argmin(covered))
    if covered[worst] < 1.0 - DRAWN:
        here = ", ".join(f"{c:.6g}" for c in x[worst].mean(axis=0))
        part = f"{100 * covered[worst]:.3g} % of the face lies on the other side"
        what = "nothing lies opposite" if covered[worst] <= 0.0 else part
        raise MeshError(
            f"tie of {slave.name} to {master.name}: at ({here}) {what}; the slave side must lie on the master side all over: "
            "swap them, name the boundary that does, or use the same nodes on both"
        )


def _overlapping(x: Array, y: Array, apart: float) -> tuple[Index, Index]:
    """Pairs (k,) of slave faces x (n, c, 3) and master faces y (m, d, 3), by their corners, whose spheres overlap."""
    from scipy.spatial import cKDTree

    at, middle = x.mean(axis=1), y.mean(axis=1)
    radius, others = (np.linalg.norm(f - f.mean(axis=1, keepdims=True), axis=2).max(axis=1) for f in (x, y))
    found = cKDTree(middle).query_ball_point(at, (1.0 + 2.0 * apart) * radius + others.max())
    face = np.repeat(np.arange(len(x)), [len(f) for f in found])
    other = np.fromiter((j for f in found for j in f), dtype=np.int64, count=len(face))
    return face, other


def _frames(x: Array) -> Array:
    """Two axes in the middle plane of each face x (k, a, 3), and its normal: rows of (k, 3, 3)."""
    normal = area_vectors(x)[1].sum(axis=0)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    along = x[:, 1] - x[:, 0]
    along -= (along * normal).sum(axis=1)[:, None] * normal
    along /= np.linalg.norm(along, axis=1)[:, None]
    return np.stack([along, np.cross(normal, along), normal], axis=1)


def _in_plane(points: Array, middle: Array, frames: Array) -> Array:
    """Coordinates (k, a, 2) of points (k, a, 3) in planes through ``middle`` (k, 3)."""
    return np.einsum("kad,kid->kai", points - middle[:, None], frames[:, :2])


def _area(polygon: Array) -> Array:
    """Signed areas (k,) of polygons (k, a, 2)."""
    following = np.roll(polygon, -1, axis=1)
    return np.asarray(0.5 * cross(polygon, following).sum(axis=1))


def _clipped(subject: Array, by: Array) -> tuple[Array, Flags]:
    """Convex polygons (k, c, 2) clipped by others (k, d, 2), all counter-clockwise: vertices (k, a, 2), and which there are.

    Sutherland and Hodgman 1974; of all pairs at once, edge after edge.
    """
    polygon, there = subject, np.ones(subject.shape[:2], dtype=bool)
    for edge in range(by.shape[1]):
        a, b = by[:, edge], by[:, (edge + 1) % by.shape[1]]
        inwards = np.stack([a[:, 1] - b[:, 1], b[:, 0] - a[:, 0]], axis=1)
        depth = np.einsum("kad,kd->ka", polygon - a[:, None], inwards)
        follower = _following(there)
        after, then = np.take_along_axis(depth, follower, 1), np.take_along_axis(polygon, follower[..., None], 1)
        crosses = there & ((depth > 0.0) != (after > 0.0))
        share = np.divide(depth, depth - after, out=np.zeros_like(depth), where=crosses)
        met = polygon + share[..., None] * (then - polygon)
        kept = np.stack([there & (depth > 0.0), crosses], axis=2).reshape(len(a), -1)
        both = np.stack([polygon, met], axis=2).reshape(len(a), -1, 2)
        most = max(int(kept.sum(axis=1).max(initial=0)), 1)
        order = np.argsort(~kept, axis=1, kind="stable")[:, :most]
        polygon, there = np.take_along_axis(both, order[..., None], 1), np.take_along_axis(kept, order, 1)
    return polygon, there


def _following(there: Flags) -> Index:
    """Number (k, a) of the vertex after each: those that are there stand in front."""
    count = np.maximum(there.sum(axis=1), 1)[:, None]
    return np.asarray((np.arange(there.shape[1])[None] + 1) % count)


def _quadrature(polygon: Array, there: Flags) -> tuple[Array, Array, Index]:
    """Points (p, 2), weights (p,) and numbers (p,) of polygons (k, a, 2): Gauss points of the triangles about their middles.

    The square of the points is collapsed onto each triangle, which integrates polynomials of degree 4 exactly (Stroud 1971).
    """
    count = np.maximum(there.sum(axis=1), 1)
    middle = np.where(there[..., None], polygon, 0.0).sum(axis=1) / count[:, None]
    u, v = polygon - middle[:, None], np.take_along_axis(polygon, _following(there)[..., None], 1) - middle[:, None]
    double = cross(u, v)
    size = np.abs(double).max(initial=0.0)
    pair, corner = np.nonzero(there & (double > NEGLIGIBLE**2 * size))
    u, v, double = u[pair, corner], v[pair, corner], double[pair, corner]
    at, weight = 0.5 * (_THREE_POINTS[0] + 1.0), 0.5 * _THREE_POINTS[1]
    s, t = (g.ravel() for g in np.meshgrid(at, at, indexing="ij"))
    w = np.outer(weight * at, weight).ravel()  # s from the middle outwards, t along the edge
    points = middle[pair][:, None] + s[:, None] * ((1.0 - t[:, None]) * u[:, None] + t[:, None] * v[:, None])
    return points.reshape(-1, 2), (double[:, None] * w).ravel(), np.repeat(pair, len(w))


def _inverse(nodes: Array, points: Array) -> Array:
    """Natural coordinates (p, 2) of points (p, 2) in faces of nodes (p, a, 2) in a plane; Newton's method from the middle."""
    a = nodes.shape[1]
    at = np.full_like(points, 1.0 / 3.0 if a == 6 else 0.0)
    for _ in range(20):
        N, dN = shapes(at, a)
        step = np.linalg.solve(
            np.einsum("pai,pad->pdi", dN, nodes), (points - np.einsum("pa,pad->pd", N, nodes))[..., None]
        )[..., 0]
        at = at + step
        if np.abs(step).max(initial=0.0) <= ROUND_OFF:
            break
    return at
