"""Bodies tied along boundaries by multi-point constraints u = T u_f: slave displacements are eliminated exactly.

Nodes that coincide are made one. Elsewhere the slave nodes follow by the dual mortar conditions ∫ψ_i (u_s − u_m) dΓ = 0
(Wohlmuth 2000; Puso 2004 for solids), with ψ_i biorthogonal to the shape functions of the slave side on each edge:
constant stress passes between any two meshes, and each slave displacement is a weighted mean of master displacements.
A slave node that a support holds is left to the support: its neighbours take over its condition (Ñ = E N below).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, coo_matrix, csr_matrix, identity

from prensa.layout import DofMap
from prensa.mesh.mesh import COINCIDENT, Mesh, MeshError, ordered_nodes
from prensa.model import problem as model

Array = NDArray[np.float64]
Index = NDArray[np.int64]

APART = 0.05  # distance of the two sides, in edge lengths of the slave, above which they do not lie on each other
MORTAR_RULE = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Ties:
    """``matrix`` (n, n) over the displacement dofs, which are the first n: u = matrix u, rows of slaves combine masters.

    ``owner`` (n,): the unknown that stands for each one where nodes are made one (itself elsewhere).
    """

    matrix: csr_matrix
    owner: Index

    @property
    def slaves(self) -> Index:
        """Unknowns that are eliminated."""
        return np.flatnonzero(self.matrix.diagonal() == 0)

    def with_slaves(self, u: Array) -> Array:
        """Unknowns (ndof,) with those of slaves put where their masters' take them."""
        n = len(self.owner)
        return np.concatenate([self.matrix @ u[:n], u[n:]])

    def to_masters(self, r: Array) -> Array:
        """Forces (ndof,) with those on slaves handed over to their masters."""
        n = len(self.owner)
        return np.concatenate([self.matrix.T @ r[:n], r[n:]])

    def kept(self, ndof: int, fixed: Index) -> Index:
        """Unknowns that are neither prescribed nor slaves."""
        keep = np.concatenate([self.matrix.diagonal() != 0, np.ones(ndof - len(self.owner), dtype=bool)])
        keep[fixed] = False
        return np.flatnonzero(keep)

    def free(self, ndof: int, fixed: Index) -> csr_matrix:
        """T (ndof, free): all degrees of freedom from those that are `kept`, prescribed ones zero."""
        whole = csr_matrix(block_diag([self.matrix, identity(ndof - len(self.owner))], format="csr"))
        return csr_matrix(whole[:, self.kept(ndof, fixed)])


@dataclass(frozen=True)
class _Side:
    """One side of a tie: edges (k, 2|3) in global node numbers."""

    name: str
    edges: Index

    @property
    def nodes(self) -> Index:
        return np.unique(self.edges)


def make_ties(
    problem: model.Problem, meshes: dict[str, Mesh], offsets: dict[str, int], X: Array, held: NDArray[np.bool_]
) -> tuple[Ties | None, Array]:
    """The ties of a problem and node positions (n, 2), those of slaves put exactly on the master side.

    held (n, 2): components that supports prescribe at some time.

    Raises
    ------
    MeshError
        If the two sides of a tie do not lie on each other, or a tie has nothing left to join.

    """
    if not problem.ties:
        return None, X
    X = X.copy()
    sides = [tuple(_side(name, meshes, offsets) for name in (t.slave, t.master)) for t in problem.ties]
    owner = _merged([s for s in sides if _matching(X, *s)], X)
    X = X[owner]
    field = DofMap(X.shape[1], len(X)).displacement
    rows, cols, values = [], [], []
    taken = np.repeat((owner != np.arange(len(X)))[:, None], field.width, axis=1)
    for slave, master in sides:
        if _matching(X, slave, master):
            continue
        s, m = _Side(slave.name, owner[slave.edges]), _Side(master.name, owner[master.edges])
        integrals = list(_integrals(X, s, m, problem.space == "axisymmetric"))
        for axis, component in enumerate(field.components):
            free = ~held[:, axis] & ~taken[:, axis]
            free[m.nodes] = False  # a corner that another tie has made one with the master side
            r, c, v = _combinations(integrals, free)
            if not len(r):
                raise MeshError(
                    f"tie of {s.name} to {m.name}: supports or other ties hold all of its slave side; swap them"
                )
            rows.append(field.dof(r, component))
            cols.append(field.dof(c, component))
            values.append(v)
            taken[np.unique(r), axis] = True
    own = field.dofs(owner).ravel()
    merged = np.flatnonzero(own != np.arange(field.size))
    rows.append(merged)
    cols.append(own[merged])
    values.append(np.ones(len(merged)))
    matrix = _closed(field.size, np.concatenate(rows), np.concatenate(cols), np.concatenate(values))
    return Ties(matrix, own), np.asarray((matrix @ X.ravel()).reshape(X.shape))


def held_components(
    problem: model.Problem, meshes: dict[str, Mesh], offsets: dict[str, int], X: Array
) -> NDArray[np.bool_]:
    """Components (n, 2) that a support or the axis of revolution prescribes at some time."""
    held = np.zeros((len(X), 2), dtype=bool)
    for source in (problem.fixed, *(source for s in problem.steps for source in (s.fixed, problem.driven(s)))):
        for name, support in source.items():
            body, _, edge = name.partition(".")
            nodes = meshes[body].nodes(edge, name) + offsets[body]
            held[nodes] |= [support.x is not None, support.y is not None]
    if problem.space == "axisymmetric":
        held[:, 0] |= X[:, 0] <= 1e-12 * float(np.ptp(X, axis=0).max())
    return held


def _side(name: str, meshes: dict[str, Mesh], offsets: dict[str, int]) -> _Side:
    body, _, edge = name.partition(".")
    meshes[body].nodes(edge, name)
    if edge not in meshes[body].edges:
        raise MeshError(f"ties: {name!r} is a point; a tie joins boundaries")
    return _Side(name, meshes[body].edges[edge] + offsets[body])


def _closed(n: int, rows: Index, cols: Index, values: Array) -> csr_matrix:
    """Matrix of the combinations, with masters that are slaves themselves replaced by their own masters."""
    keep = np.ones(n)
    keep[rows] = 0.0
    matrix = csr_matrix((values, (rows, cols)), (n, n)) + csr_matrix(
        (np.ones(int(keep.sum())), (np.flatnonzero(keep), np.flatnonzero(keep))), (n, n)
    )
    slave = keep == 0.0
    for _ in range(16):
        if not slave[matrix.indices].any():
            return csr_matrix(matrix)
        matrix = matrix @ matrix
        matrix.eliminate_zeros()
    raise MeshError("ties: boundaries are tied to each other in a circle; make one of them the master of all")


# ------------------------------------------------------------------------------------------------------ matching meshes
def _pairs(X: Array, slave: _Side, master: _Side) -> tuple[Index, NDArray[np.bool_]]:
    """Nearest master node (k,) of each slave node, and whether it is at the same place (k,)."""
    size = COINCIDENT * 10 * float(np.ptp(X, axis=0).max())
    from scipy.spatial import cKDTree

    distance, near = cKDTree(X[master.nodes]).query(X[slave.nodes])
    return master.nodes[near], distance <= size


def _matching(X: Array, slave: _Side, master: _Side) -> bool:
    """Whether every edge of the slave side is an edge of the master side."""
    partner, same = _pairs(X, slave, master)
    if not same.all():
        return False
    to = dict(zip(slave.nodes.tolist(), partner.tolist()))
    known = {frozenset(e) for e in master.edges.tolist()}
    return all(frozenset(to[k] for k in e) in known for e in slave.edges.tolist())


def _merged(sides: list[Any], X: Array) -> Index:
    """Owner (n,) of every node: itself, or the one master that all nodes tied at one place share."""
    from scipy.sparse.csgraph import connected_components

    n = len(X)
    links = [(int(a), int(b)) for s, m in sides for a, b in zip(s.nodes, _pairs(X, s, m)[0], strict=True)]
    if not links:
        return np.arange(n)
    slave, master = np.array(links, dtype=np.int64).T
    _, group = connected_components(coo_matrix((np.ones(len(links)), (slave, master)), (n, n)), directed=False)
    # a node that is master only owns its group; where there is none, the first
    rank = np.isin(np.arange(n), slave).astype(np.int64)
    order = np.lexsort((np.arange(n), rank, group))
    first = order[np.concatenate([[True], np.diff(group[order]) > 0])]
    return np.asarray(first[group])


# -------------------------------------------------------------------------------------------------------- mortar conditions
def _shapes(xi: float, nodes: int) -> tuple[Array, Array]:
    """Shape functions of an edge (ends, then the middle) and their derivatives at ξ in −1 … 1."""
    if nodes == 2:
        return np.array([0.5 * (1 - xi), 0.5 * (1 + xi)]), np.array([-0.5, 0.5])
    return (
        np.array([0.5 * xi * (xi - 1), 0.5 * xi * (xi + 1), 1 - xi * xi]),
        np.array([xi - 0.5, xi + 0.5, -2 * xi]),
    )


def _foot(x: Array, y: Array, xi: float = 0.0) -> float:
    """Parameter ξ of the point of an edge with nodes y (2|3, 2) that is nearest to x (Newton; one step on straight edges)."""
    for _ in range(20):
        N, dN = _shapes(xi, len(y))
        t = dN @ y
        step = float(t @ (x - N @ y) / (t @ t))
        xi += step
        if abs(step) < 1e-14:
            break
    return xi


def _integrals(X: Array, slave: _Side, master: _Side, axisymmetric: bool) -> Iterator[tuple[Any, ...]]:
    """Of every slave edge: its nodes, ∫N (a,), ∫N Nᵀ (a, a), the master nodes (b,) it meets and ∫N N_mᵀ (a, b).

    All with one quadrature over the pieces between projected nodes, so that biorthogonality holds for the sums themselves.
    """
    a = slave.edges.shape[1]
    chain = ordered_nodes(master.edges)
    middle, half = _circles(X, master.edges)
    for edge in slave.edges:
        y = X[edge]
        h = float(np.hypot(*(y[1] - y[0])))
        near = np.flatnonzero(np.hypot(*(middle - y[:2].mean(axis=0)).T) <= 1.5 * (half + 0.5 * h))
        candidates = master.edges[near]
        cuts = [_foot(X[n], y) for n in chain[np.isin(chain, candidates[:, :2])]]
        cuts = sorted({-1.0, 1.0, *(c for c in cuts if -1 + 1e-9 < c < 1 - 1e-9)})
        nodes = np.unique(candidates)
        number = {int(k): i for i, k in enumerate(nodes)}
        d, M, B = np.zeros(a), np.zeros((a, a)), np.zeros((a, len(nodes)))
        for lo, hi in pairwise(cuts):
            for g, w in zip(*MORTAR_RULE):
                N, dN = _shapes(0.5 * (lo + hi) + 0.5 * (hi - lo) * g, a)
                x = N @ y
                weight = 0.5 * (hi - lo) * w * float(np.hypot(*(dN @ y))) * (x[0] if axisymmetric else 1.0)
                at_least = np.hypot(*(middle[near] - x).T) - half[near]  # distances of the candidates
                opposite, Nm = _opposite(X, candidates, at_least, x, h, slave, master)
                d += weight * N
                M += weight * np.outer(N, N)
                B[:, [number[int(k)] for k in opposite]] += weight * np.outer(N, Nm)
        yield edge, d, M, nodes, B


def _circles(X: Array, edges: Index) -> tuple[Array, Array]:
    """Middles (k, 2) of the chords of edges and radii (k,) round them within which the edges lie."""
    ends = X[edges[:, :2]]
    middle, radius = ends.mean(axis=1), 0.5 * np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    if edges.shape[1] == 3:  # within the triangle of the ends and the point where the tangents at them meet
        radius = np.maximum(radius, 2 * np.hypot(*(X[edges[:, 2]] - middle).T))
    return middle, radius


def _opposite(
    X: Array, candidates: Index, at_least: Array, x: Array, h: float, slave: _Side, master: _Side
) -> tuple[Index, Array]:  # fmt: skip
    """The master edge opposite to a point x of the slave side and its shape functions there.

    at_least (k,): a distance that none of the candidates (k, 2|3) is nearer than.
    """
    best, where = np.inf, None
    for k in np.argsort(at_least, kind="stable").tolist():
        if at_least[k] > best:
            break
        e = candidates[k]
        xi = _foot(x, X[e])
        if abs(xi) > 1 + 1e-6:
            continue
        N, _ = _shapes(min(max(xi, -1.0), 1.0), len(e))
        distance = float(np.hypot(*(x - N @ X[e])))
        if distance < best:
            best, where = distance, (e, N)
    if where is None or best > APART * h:
        gap = "nothing lies opposite" if where is None else f"the other side is {best:.3g} away"
        raise MeshError(
            f"tie of {slave.name} to {master.name}: at ({x[0]:.6g}, {x[1]:.6g}) {gap}; the slave side must lie on the "
            "master side all along: swap them, name the boundary that does, or use the same nodes on both"
        )
    return where


def _combinations(integrals: list[tuple[Any, ...]], free: NDArray[np.bool_]) -> tuple[Index, Index, Array]:
    """Rows (slave), columns (nodes) and weights of u_i = Σ w u; the slave nodes that are not free keep their own."""
    sums: dict[int, float] = {}
    terms: dict[tuple[int, int], float] = {}
    for edge, d, M, nodes, B in integrals:
        kept = np.flatnonzero(free[edge])
        if not len(kept):
            continue
        E = _extended(len(edge), kept)
        dual = np.diag(d[kept]) @ np.linalg.solve(E @ M[:, kept], E)  # ψ = dual N, ∫ψ_i N_k = δ_ik ∫N_i
        with_master, with_slave = dual @ B, dual @ M
        for i, k in enumerate(kept):
            row = int(edge[k])
            sums[row] = sums.get(row, 0.0) + float(d[k])
            for j, node in enumerate(nodes):
                terms[row, int(node)] = terms.get((row, int(node)), 0.0) + float(with_master[i, j])
            for j in np.flatnonzero(~free[edge]).tolist():
                terms[row, int(edge[j])] = terms.get((row, int(edge[j])), 0.0) - float(with_slave[i, j])
    found = [(r, c, v / sums[r]) for (r, c), v in terms.items() if abs(v) > 1e-13 * sums[r]]
    if not found:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)
    r, c, v = zip(*found)
    return np.array(r, dtype=np.int64), np.array(c, dtype=np.int64), np.array(v)


def _extended(nodes: int, kept: Index) -> Array:
    """E (kept, nodes): shape functions Ñ = E N of the kept nodes that still add up to one, and to a linear field if two are."""
    E = np.eye(nodes)[kept]
    for lost in set(range(nodes)) - set(kept.tolist()):
        if len(kept) == 1:
            E[0, lost] = 1.0
        elif lost == 2:
            E[:, lost] = 0.5
        else:  # the value at one end goes on from the other end and the middle
            E[:, lost] = [-1.0, 2.0]
    return E
