"""Dual mortar conditions between two sides that lie on each other with different meshes, for all edges at once.

∫ψ_i (u_s − u_m) dΓ = 0 with ψ_i biorthogonal to the shape functions of the slave side on each edge (Wohlmuth 2000; Puso 2004
for solids).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix

from prensa.mesh.mesh import MeshError
from prensa.precision import NEGLIGIBLE
from prensa.types import Array, Flags, Index

APART = 0.05  # distance of the two sides, in edge lengths of the slave, above which they do not lie on each other
MORTAR_RULE = np.polynomial.legendre.leggauss(4)
BEYOND = 1e-6  # ξ that a foot may lie beyond the end of a master edge
PROJECTIONS = 20  # most steps for the foot of a point on an edge


@dataclass(frozen=True)
class Side:
    """One side of a tie: edges (k, 2|3), in space faces (k, 4|6), in global node numbers."""

    name: str
    edges: Index

    @property
    def nodes(self) -> Index:
        """Its nodes (n,)."""
        return np.unique(self.edges)


@dataclass(frozen=True)
class Integrals:
    """Integrals over the edges (k, a) of a slave side: ``single`` (k, a) ∫N, ``mass`` (k, a, a) ∫N Nᵀ, and products with masters.

    ``values`` (q, a): ∫N N_m with the shape function of master node ``nodes`` (q,), of a piece of edge ``owner`` (q,).
    """

    edges: Index
    single: Array
    mass: Array
    owner: Index
    nodes: Index
    values: Array


def integrals(X: Array, slave: Side, master: Side, axisymmetric: bool, apart: float = APART) -> Integrals:
    """Integrals between two sides of nodes X (n, 2).

    ``apart``: distance, over the length of a slave edge, up to which they lie on each other.
    All with one quadrature over the pieces between projected nodes, so that biorthogonality holds for the sums themselves.

    Raises
    ------
    MeshError
        If the slave side does not lie on the master side all along.

    """
    k, a = slave.edges.shape
    owner, low, high = _pieces(X, slave.edges, master.edges)
    rule, weights = MORTAR_RULE
    half = 0.5 * (high - low)
    xi = (0.5 * (low + high)[:, None] + half[:, None] * rule).ravel()
    owner = np.repeat(owner, len(rule))
    N, dN = shapes(xi, a)
    y = X[slave.edges[owner]]
    x, t = np.einsum("pa,pad->pd", N, y), np.einsum("pa,pad->pd", dN, y)
    weight = (half[:, None] * weights).ravel() * np.hypot(*t.T) * (x[:, 0] if axisymmetric else 1.0)
    edge, Nm = opposite(X, x, apart * np.hypot(*(y[:, 1] - y[:, 0]).T), slave, master)
    single, mass = np.zeros((k, a)), np.zeros((k, a, a))
    np.add.at(single, owner, weight[:, None] * N)
    np.add.at(mass, owner, np.einsum("p,pa,pb->pab", weight, N, N))
    b = master.edges.shape[1]
    values = np.einsum("p,pa,pb->pba", weight, N, Nm).reshape(-1, a)
    return Integrals(slave.edges, single, mass, np.repeat(owner, b), master.edges[edge].ravel(), values)


def combinations(of: Integrals, free: Flags) -> tuple[Index, Index, Array]:
    """Rows (slave), columns (nodes) and weights of u_i = Σ w u; slave nodes that are not free (n,) keep their own.

    A slave node that a support holds is left to the support: its neighbours take over its condition (Ñ = E N).
    """
    n, a = len(free), of.edges.shape[1]
    sums, rows, cols, values = np.zeros(n), [], [], []
    pattern = free[of.edges] @ (1 << np.arange(a))
    for p in np.unique(pattern[pattern > 0]).tolist():
        kept = np.flatnonzero((p >> np.arange(a)) & 1)
        held = np.setdiff1d(np.arange(a), kept)
        at = np.flatnonzero(pattern == p)
        here = np.full(len(of.edges), -1)
        here[at] = np.arange(len(at))
        E = _extended(a, kept)
        diagonal, whole = of.single[at][:, kept], np.broadcast_to(E, (len(at), *E.shape))
        dual = diagonal[:, :, None] * np.linalg.solve(E @ of.mass[at][:, :, kept], whole)  # ψ = dual N, ∫ψ_i N_k = δ_ik ∫N_i
        slaves = of.edges[at][:, kept]
        np.add.at(sums, slaves, diagonal)
        q = np.flatnonzero(here[of.owner] >= 0)
        own = here[of.owner[q]]
        with_master = np.einsum("qia,qa->qi", dual[own], of.values[q])
        with_slave = (dual @ of.mass[at])[:, :, held]
        for where, nodes, weights in (
            (slaves[own], of.nodes[q][:, None], with_master),
            (slaves[:, :, None], of.edges[at][:, None, held], -with_slave),
        ):
            where, nodes, weights = np.broadcast_arrays(where, nodes, weights)
            rows.append(where.ravel())
            cols.append(nodes.ravel())
            values.append(weights.ravel())
    if not rows:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)
    matrix = coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), (n, n)).tocsr().tocoo()
    rows_, cols_, weights = matrix.row.astype(np.int64), matrix.col.astype(np.int64), matrix.data
    counts = np.abs(weights) > 1e-13 * sums[rows_]
    return rows_[counts], cols_[counts], weights[counts] / sums[rows_[counts]]


def _extended(nodes: int, kept: Index) -> Array:
    """E (kept, nodes): shape functions Ñ = E N of the kept nodes that still add up to one, and to a linear field if two are."""
    E = np.eye(nodes)[kept]
    if nodes == 4:
        return _extended_over_face(E, kept)
    if nodes == 6:
        return _extended_over_triangle(E, kept)
    for lost in set(range(nodes)) - set(kept.tolist()):
        if len(kept) == 1:
            E[0, lost] = 1.0
        elif lost == 2:
            E[:, lost] = 0.5
        else:  # the value at one end goes on from the other end and the middle
            E[:, lost] = [-1.0, 2.0]
    return E


def _extended_over_face(E: Array, kept: Index) -> Array:
    """The same of a face: the value at a lost corner goes on from the others, from the next one where two are lost."""
    lost = sorted(set(range(4)) - set(kept.tolist()))
    row = {int(k): i for i, k in enumerate(kept)}
    for k in lost:
        beside = [row[n] for n in ((k + 1) % 4, (k + 3) % 4) if n in row]
        if len(lost) == 1:
            E[beside, k], E[row[(k + 2) % 4], k] = 1.0, -1.0
        elif beside:
            E[beside, k] = 1.0 / len(beside)
        else:
            E[0, k] = 1.0
    return E


def _extended_over_triangle(E: Array, kept: Index) -> Array:
    """The same of a triangle of six nodes, of which only those in the middle of the sides are kept."""
    row = {int(k): i for i, k in enumerate(kept)}
    for k in sorted(set(range(6)) - set(kept.tolist())):
        beside = [row[n] for n in ((3 + k, 3 + (k + 2) % 3) if k < 3 else (3, 4, 5)) if n in row]
        across = row.get(3 + (k + 1) % 3)
        if k < 3 and len(kept) == 3:
            E[beside, k], E[across, k] = 1.0, -1.0
        elif beside:
            E[beside, k] = 1.0 / len(beside)
        else:
            E[0, k] = 1.0
    return E


def shapes(xi: Array, nodes: int) -> tuple[Array, Array]:
    """Shape functions (k, nodes) of edges (ends, then the middle) and their derivatives at ξ (k,) in −1 … 1."""
    if nodes == 2:
        return 0.5 * np.stack([1 - xi, 1 + xi], axis=1), np.broadcast_to([-0.5, 0.5], (len(xi), 2))
    return (
        np.stack([0.5 * xi * (xi - 1), 0.5 * xi * (xi + 1), 1 - xi * xi], axis=1),
        np.stack([xi - 0.5, xi + 0.5, -2 * xi], axis=1),
    )


def _foot(x: Array, y: Array) -> Array:
    """Parameters ξ (k,) of the points of edges y (k, 2|3, 2) nearest to points x (k, 2) (Newton; one step on straight edges)."""
    xi, moving = np.zeros(len(x)), np.arange(len(x))
    for _ in range(PROJECTIONS):
        N, dN = shapes(xi[moving], y.shape[1])
        here = y[moving]
        t, apart = np.einsum("ka,kad->kd", dN, here), x[moving] - np.einsum("ka,kad->kd", N, here)
        step = (t * apart).sum(axis=1) / (t * t).sum(axis=1)
        xi[moving] += step
        moving = moving[np.abs(step) >= 1e-14]
        if not len(moving):
            break
    return xi


def _circles(X: Array, edges: Index) -> tuple[Array, Array]:
    """Middles (k, 2) of the chords of edges and radii (k,) round them within which the edges lie."""
    ends = X[edges[:, :2]]
    middle, radius = ends.mean(axis=1), 0.5 * np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    if edges.shape[1] == 3:  # within the triangle of the ends and the point where the tangents at them meet
        radius = np.maximum(radius, 2 * np.hypot(*(X[edges[:, 2]] - middle).T))
    return middle, radius


def _around(x: Array, radius: Array, middle: Array) -> tuple[Index, Index]:
    """Pairs (k,) of a point x (n, 2) and a middle (m, 2) that lies within its radius (n,), by point."""
    from scipy.spatial import cKDTree

    found = cKDTree(middle).query_ball_point(x, radius)
    point = np.repeat(np.arange(len(x)), [len(f) for f in found])
    return point, np.fromiter((j for f in found for j in f), dtype=np.int64, count=len(point))


def _pieces(X: Array, edges: Index, others: Index) -> tuple[Index, Array, Array]:
    """Slave edge (p,) and both ends ξ (p,) of each piece between ends of slave edges and projected ends of master edges."""
    middle, half = _circles(X, others)
    ends = X[edges[:, :2]]
    at, length = ends.mean(axis=1), np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    edge, other = _around(at, 1.5 * (half.max() + 0.5 * length), middle)
    near = np.hypot(*(middle[other] - at[edge]).T) <= 1.5 * (half[other] + 0.5 * length[edge])
    edge, other = np.repeat(edge[near], 2), others[other[near], :2].ravel()
    cut = _foot(X[other], X[edges[edge]])
    inside = (cut > -1 + NEGLIGIBLE) & (cut < 1 - NEGLIGIBLE)
    all_ = np.arange(len(edges))
    owner = np.concatenate([edge[inside], all_, all_])
    xi = np.concatenate([cut[inside], np.full(len(edges), -1.0), np.ones(len(edges))])
    order = np.lexsort((xi, owner))
    owner, xi = owner[order], xi[order]
    piece = np.flatnonzero((owner[1:] == owner[:-1]) & (xi[1:] > xi[:-1]))
    return owner[piece], xi[piece], xi[piece + 1]


def opposite(X: Array, x: Array, h: Array, slave: Side, master: Side) -> tuple[Index, Array]:
    """Number (p,) of the master edge opposite to each point x (p, 2) of slave edges within h (p,) of it, and its shapes there.

    No master edge further away than the nearest master node can be it, nor one that is too far to be tied to.
    """
    from scipy.spatial import cKDTree

    middle, half = _circles(X, master.edges)
    reach = np.minimum(cKDTree(X[master.nodes]).query(x)[0] * (1 + 1e-9) + 1e-9 * h, h)
    point, edge = _around(x, reach + half.max(), middle)
    near = np.hypot(*(middle[edge] - x[point]).T) - half[edge] <= reach[point]
    point, edge = point[near], edge[near]
    distance, N = _distances(x[point], X[master.edges[edge]])
    order = np.lexsort((distance, point))
    nearest = order[np.flatnonzero(np.diff(point[order], prepend=-1))]  # of each point that has any
    best, where = np.full(len(x), np.inf), np.zeros(len(x), dtype=np.int64)
    best[point[nearest]], where[point[nearest]] = distance[nearest], nearest
    far = np.flatnonzero(~(best <= h))
    if len(far):
        here = x[far[0]]
        away = float(_distances(np.broadcast_to(here, middle.shape), X[master.edges])[0].min())
        gap = "nothing lies opposite" if away == np.inf else f"the other side is {away:.3g} away"
        raise MeshError(
            f"tie of {slave.name} to {master.name}: at ({here[0]:.6g}, {here[1]:.6g}) {gap}; the slave side must lie on the "
            "master side all along: swap them, name the boundary that does, or use the same nodes on both"
        )
    return edge[where], N[where]


def _distances(x: Array, y: Array) -> tuple[Array, Array]:
    """Distances (k,) of points x (k, 2) from edges y (k, 2|3, 2), infinite where these end before, and shape functions there.

    Sides that lie off each other on a curve end beside each other: a foot may lie beyond an end by less than the sides are off.
    """
    xi = _foot(x, y)
    N, _ = shapes(np.clip(xi, -1.0, 1.0), y.shape[1])
    distance = np.hypot(*(x - np.einsum("ka,kad->kd", N, y)).T)
    beyond = 0.5 * np.hypot(*(y[:, 1] - y[:, 0]).T) * np.maximum(np.abs(xi) - 1.0, 0.0)
    return np.where((np.abs(xi) <= 1 + BEYOND) | (2.0 * beyond**2 <= distance**2), distance, np.inf), N
