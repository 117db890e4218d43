"""Multigrid preconditioner in space: smoothed aggregation (Vaněk, Mandel & Brezina 1996) with lines along short edges of bricks.

It is made from the symmetric P (see `prensa.linear.iterative`), in single precision, for flexible GMRES. Chains of nodes
along the short edges of flattened bricks are relaxed together, as block tridiagonals, and cut into segments as long as the
middle edge; aggregates join segments, so that they are cubes in space, and leave out the long edges of drawn-out bricks. What
aggregation leaves out the smoothing of prolongators leaves out too: along long edges nothing is interpolated, and functions that
reach over them would only fill the coarse matrix. On cubes there are no chains, and it is block Jacobi under Chebyshev's
polynomial. Aggregation is pyamg's, coarse matrices are Galerkin's.

Book, chapter 9, has the figures and what was tried besides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix, issparse

from prensa.kernels.smoothers import factor_lines, relax_lines, residual, walk
from prensa.policy import DEFAULT, Policy
from prensa.types import Array, Flags, Index, Ints, Single

BRICK_EDGES = np.array(
    [[[0, 1], [3, 2], [4, 5], [7, 6]], [[0, 3], [1, 2], [4, 7], [5, 6]], [[0, 4], [1, 5], [2, 6], [3, 7]]]
)


class Nodes(NamedTuple):
    """The nodes of a matrix: places X (n, 3), which of their displacements are ``free`` (n, 3), ``cells`` (m, a) by kind.

    Cells with eight nodes are bricks, whose edges have directions; nodes of cells that are not in the matrix are −1.
    """

    X: Array
    free: Flags
    cells: Sequence[Index]


class Edges(NamedTuple):
    """Of the bricks around each node (n,): mean ``short`` and ``middle`` length; ``flat`` bricks' short edges (k, 2) of nodes.

    drawn: whether most bricks are drawn out: their longest length is much longer than the middle one.
    """

    short: Array
    middle: Array
    flat: Index
    drawn: bool


def lengths_of(x: Array) -> tuple[Array, Index]:
    """Principal lengths (m, 3) of bricks x (m, 8, 3), ascending, and the direction (m,) of `BRICK_EDGES` of their short edges.

    They are those of the edges where these are at right angles. Of sheared bricks the edges are longer than what they span: the
    nodes across a drawn-out brick whose layers rise steeply are neighbours of its diagonal.
    """
    e = np.stack([(x[:, E[:, 1]] - x[:, E[:, 0]]).mean(axis=1) for E in BRICK_EDGES], axis=1)
    squares = np.linalg.eigvalsh(e @ e.transpose(0, 2, 1))
    return np.sqrt(np.maximum(squares, 0.0)), np.linalg.norm(e, axis=2).argmin(axis=1)


def edges_of(nodes: Nodes, ratio: float) -> Edges:
    """Lengths of the cells around nodes; cells other than bricks have one length, the mean distance from their middle."""
    n = len(nodes.X)
    sums, flat, long = np.zeros((3, n)), [np.zeros((0, 2), dtype=np.int64)], [np.zeros(0)]
    for cells in nodes.cells:
        known = cells[(cells >= 0).all(axis=1)]
        x = nodes.X[known]
        if known.shape[1] != 8:
            size = np.linalg.norm(x - x.mean(axis=1, keepdims=True), axis=2).mean(axis=1)
            short = middle = size
        else:
            lengths, along = lengths_of(x)
            short, middle, longest = lengths.T
            thin = middle > ratio * short
            pairs = BRICK_EDGES[along[thin]].reshape(-1, 8)
            flat.append(np.take_along_axis(known[thin], pairs, axis=1).reshape(-1, 2))
            long.append(longest / middle)
        for row, values in zip(sums, (np.ones(len(known)), short, middle)):
            row += np.bincount(known.ravel(), np.repeat(values, known.shape[1]), n)
    count = np.maximum(sums[0], 1.0)
    # a node of no whole cell is like the others
    alone = sums[0] == 0
    short, middle = (np.where(alone, s.sum() / count.sum(), s / count) for s in sums[1:])
    ratios = np.concatenate(long)
    return Edges(short, middle, np.concatenate(flat), bool(len(ratios) and np.median(ratios) > ratio))


def chains_of(n: int, edges: Edges) -> tuple[Index, Index]:
    """Starts (c + 1,) and nodes (n,) of the chains along short edges; every node is in one, perhaps alone."""
    if not len(edges.flat):
        return np.arange(n + 1), np.arange(n)
    i, j = edges.flat.T
    graph = coo_matrix((np.ones(len(i)), (i, j)), (n, n)).tocsr()
    graph = (graph + graph.T).tocsr()
    start, nodes = walk(graph.indptr, graph.indices, np.argsort(np.diff(graph.indptr), kind="stable"))
    return start, nodes


def near_edges(A: bsr_matrix, X: Array, edges: Edges, reach: float) -> Flags:
    """Which blocks (k,) of A are of nodes no more than ``reach`` middle edges apart."""
    rows = np.repeat(np.arange(len(X)), np.diff(A.indptr))
    middle = np.maximum(edges.middle[rows], edges.middle[A.indices])
    return np.asarray(np.linalg.norm(X[rows] - X[A.indices], axis=1) <= reach * middle)


def near_places(A: bsr_matrix, X: Array, reach: float) -> Flags:
    """Which blocks (k,) of a coarse A are of nodes no more than ``reach`` times the distance of the nearest neighbour apart."""
    rows = np.repeat(np.arange(len(X)), np.diff(A.indptr))
    d = np.linalg.norm(X[rows] - X[A.indices], axis=1)
    nearest = np.full(len(X), np.inf)
    np.minimum.at(nearest, rows[d > 0], d[d > 0])
    return np.asarray(d <= reach * np.minimum(nearest[rows], nearest[A.indices]))


def pattern_where(A: bsr_matrix, kept: Flags) -> tuple[Ints, Ints]:
    """Columns and row pointers of the blocks of A that are ``kept`` (k,)."""
    return A.indices[kept], np.concatenate([[0], np.cumsum(kept)])[A.indptr].astype(A.indptr.dtype)


def blocks_where(A: bsr_matrix, kept: Flags) -> bsr_matrix:
    """The blocks of A that are ``kept`` (k,); A itself where all are."""
    return A if kept.all() else bsr_matrix((A.data[kept], *pattern_where(A, kept)), A.shape)


def graph_of(A: bsr_matrix, near: Flags) -> csr_matrix:
    """The graph (n, n) of the blocks of A that are ``near`` (k,)."""
    indices, ptr = pattern_where(A, near)
    return csr_matrix((np.ones(len(indices)), indices, ptr), (len(ptr) - 1, len(ptr) - 1))


def aggregates(graph: csr_matrix, edges: Edges, start: Index, nodes: Index) -> csr_matrix:
    """Which aggregate (n, c) each node belongs to: chains cut into segments as long as the middle edge, segments joined.

    graph: of neighbours. Drawn-out bricks are joined five by five in their plane.
    """
    from pyamg.aggregation.aggregate import standard_aggregation

    n, size = graph.shape[0], np.diff(start)
    per = np.maximum(1, np.rint(np.add.reduceat(edges.middle[nodes] / edges.short[nodes], start[:-1]) / size))
    parts = np.where(size > 1, np.maximum(1, np.rint(size / per)), 1).astype(np.int64)
    chain = np.repeat(np.arange(len(size)), size)
    segment = np.empty(n, dtype=np.int64)
    segment[nodes] = (np.cumsum(parts) - parts)[chain] + (np.arange(n) - start[:-1][chain]) * parts[chain] // size[chain]
    of = csr_matrix((np.ones(n), (np.arange(n), segment)), (n, int(parts.sum())))
    graph = (of.T @ graph @ of).tocsr()
    if edges.drawn:
        graph = (graph @ graph).tocsr()
    graph.data[:] = 1.0
    return (of @ csr_matrix(standard_aggregation(graph)[0])).tocsr()


def soft_motions(nodes: Nodes) -> Array:
    """Near-null space (3 n, 12), zero on what is held: affine motions, of which plastic bodies resist some hardly more than
    rigid ones.
    """
    n, x = len(nodes.X), nodes.X - nodes.X.mean(axis=0)
    out = np.zeros((n, 3, 12))
    for i in range(3):
        out[:, i, i] = 1.0
        out[:, i, 3 + 3 * i : 6 + 3 * i] = x
    return (out * nodes.free[:, :, None]).reshape(3 * n, -1)


def blockwise(D: Array, M: bsr_matrix) -> bsr_matrix:
    """Block diagonal D (n, r, r) times M."""
    rows = np.repeat(np.arange(len(D)), np.diff(M.indptr))
    return bsr_matrix((D[rows] @ M.data, M.indices, M.indptr), M.shape)


class Candidates(NamedTuple):
    """Soft motions B (r n, k) of a level as T Bc: T (r n, k c) orthonormal in each aggregate, Bc (k c, k) what they are in it."""

    T: bsr_matrix
    B: Array
    Bc: Array

    def extended(self, forces: Array) -> bsr_matrix:
        """Forces (n, r, k) of the soft motions as a matrix of T's pattern: of those of each node's aggregate, extended.

        Motions that are not independent in an aggregate, as those along its normal where it is plane, count as none.
        """
        k = self.B.shape[1]
        R = self.Bc.reshape(-1, k, k).copy()
        own = np.einsum("cii->ci", R)
        none = own == 0.0
        own[none] = 1.0
        inside = np.diff(self.T.indptr) > 0
        out = forces[inside] @ np.linalg.inv(R)[self.T.indices]
        out.transpose(0, 2, 1)[none[self.T.indices]] = 0.0
        return bsr_matrix((out, self.T.indices, self.T.indptr), self.T.shape)


def prolongator(A: bsr_matrix, near: Flags, inverse: Array, top: float, made: Candidates) -> bsr_matrix:
    """T smoothed by one step of damped Jacobi with 4/3 of the largest eigenvalue's inverse (Vaněk et al. 1996).

    The matrix of that step has the blocks of A that are ``near`` (k,). In the others the soft motions of a node's own aggregate
    stand for those of its neighbours', so that forces of soft motions are those of A.
    """
    AT = (blocks_where(A, near) @ made.T).tobsr(made.T.blocksize)
    if not near.all():
        far = blocks_where(A, ~near) @ made.B
        AT = AT + made.extended(far.reshape(len(inverse), -1, made.B.shape[1]))
    return (made.T - 4 / 3 / top * blockwise(inverse, AT.tobsr(made.T.blocksize))).tobsr(made.T.blocksize)


def largest(A: bsr_matrix, M: Callable[[Array], Array], steps: int) -> float:
    """The largest eigenvalue of M A, by a few steps of Arnoldi's iteration; raises `ArithmeticError` if that is not positive."""
    found = _largest(A, M, steps)
    if not (np.isfinite(found) and found > 0.0):
        raise ArithmeticError("multigrid: no estimate of the largest eigenvalue")
    return found


def _largest(A: bsr_matrix, M: Callable[[Array], Array], steps: int) -> float:
    v = np.random.default_rng(0).standard_normal(A.shape[0])
    V, H = [v / np.linalg.norm(v)], np.zeros((steps + 1, steps))
    for j in range(steps):
        w = M(A @ V[j])
        for i in range(j + 1):
            H[i, j] = np.einsum("i,i->", w, V[i])
            w = w - H[i, j] * V[i]
        H[j + 1, j] = np.sqrt(np.einsum("i,i->", w, w))
        if not H[j + 1, j] > 0.0:
            return float(np.abs(np.linalg.eigvals(H[: j + 1, : j + 1])).max())
        V.append(w / H[j + 1, j])
    return float(np.abs(np.linalg.eigvals(H[:steps])).max())


class Smoother(NamedTuple):
    """Chebyshev's polynomial of a matrix over a preconditioner with the largest eigenvalue ``top`` (Adams et al. 2003)."""

    sweeps: int
    top: float

    def coefficients(self) -> list[tuple[float, float]]:
        """Of each sweep (a, c): d = a d + c M r, x += d."""
        high, low = 1.1 * self.top, 0.1 * self.top
        middle, half = (high + low) / 2, (high - low) / 2
        rho, out = half / middle, [(0.0, 1 / middle)]
        for _ in range(self.sweeps - 1):
            new = 1 / (2 * middle / half - rho)
            out.append((new * rho, 2 * new / half))
            rho = new
        return out


@dataclass
class Level:
    """A level: how residuals are found and relaxed on it, ``Q`` from the next coarser one and its transpose ``R``."""

    n: int
    turns: list[tuple[float, float]]
    Q: csr_matrix
    R: csr_matrix
    A: csr_matrix | None = None
    inverse_diagonal: Single | None = None

    def left(self, x: Single, b: Single) -> Single:
        """B − A x."""
        assert self.A is not None
        return np.asarray(b - self.A @ x)

    def smoothed(self, x: Single, b: Single, post: bool) -> None:
        """Relax x (n,) in its place; not ``post``: x is zero."""
        assert self.inverse_diagonal is not None
        d, k = np.zeros_like(x), self.inverse_diagonal.shape[1]
        for i, (a, c) in enumerate(self.turns):
            r = self.left(x, b) if i or post else b
            d = np.float32(a) * d + np.float32(c) * (self.inverse_diagonal @ r.reshape(-1, k, 1)).ravel()
            x += d


@dataclass
class LineLevel(Level):
    """The finest level: blocks of 3 × 3 by kernels, relaxed along chains."""

    ptr: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    ind: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    a: Single = field(default_factory=lambda: np.zeros(0, dtype=np.float32))
    start: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    nodes: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    D: Single = field(default_factory=lambda: np.zeros(0, dtype=np.float32))
    L: Single = field(default_factory=lambda: np.zeros(0, dtype=np.float32))

    def __post_init__(self) -> None:
        self.r, self.z, self.d, self.v = (np.zeros(k, dtype=np.float32) for k in (self.n, self.n, self.n, 3))

    def left(self, x: Single, b: Single) -> Single:
        """See `Level`."""
        residual(self.ptr, self.ind, self.a, x, b, self.r)
        return self.r

    def smoothed(self, x: Single, b: Single, post: bool) -> None:
        """See `Level`."""
        self.d[:] = 0.0
        for i, (a, c) in enumerate(self.turns):
            r = self.left(x, b) if i or post else b
            relax_lines(self.start, self.nodes, self.D, self.L, r, self.z, self.v, self.d, x, np.float32(a), np.float32(c))

    def relaxed(self, v: Array) -> Array:
        """M v (n,) for the inverse M of the block tridiagonals."""
        x, d = np.zeros((2, self.n), dtype=np.float32)
        one, zero = np.float32(1.0), np.float32(0.0)
        relax_lines(self.start, self.nodes, self.D, self.L, v.astype(np.float32), self.z, self.v, d, x, zero, one)
        return x.astype(np.float64)


class Multigrid:
    """A V-cycle of the hierarchy of a symmetric matrix P (blocks of 3 × 3, sorted): residual (3 n,) → correction (3 n,).

    Raises
    ------
    ArithmeticError
        If P has a diagonal block that cannot be inverted, or no finite eigenvalue estimate.

    """

    def __init__(self, P: bsr_matrix, nodes: Nodes, policy: Policy = DEFAULT) -> None:
        self.policy, self.levels = policy, list[Level]()
        edges = edges_of(nodes, policy.multigrid_flat_ratio)
        A, X, B, entries = P, nodes.X, soft_motions(nodes), 0
        try:
            while A.shape[0] > policy.multigrid_coarsest:
                entries += A.nnz
                of = None if self.levels else chains_of(len(X), edges)
                A, X, B, shrunk = self._coarser(A, X, B, edges, of)
                if not shrunk:
                    raise ArithmeticError("multigrid: aggregates of so few nodes that the next level is no smaller")
            w, V = np.linalg.eigh(A.toarray())
        except np.linalg.LinAlgError as error:
            raise ArithmeticError(f"multigrid: {error}") from None
        with np.errstate(divide="ignore"):
            self.inverse = ((V * np.where(w > 1e-12 * w[-1], 1.0 / w, 0.0)) @ V.T).astype(np.float32)
        self.complexity = (entries + A.nnz) / P.nnz

    def _coarser(
        self, A: bsr_matrix, X: Array, B: Array, edges: Edges, chains: tuple[Index, Index] | None
    ) -> tuple[bsr_matrix, Array, Array, bool]:  # fmt: skip
        """Add a level for the matrix A; that of the next, its places and soft motions, and whether it is smaller."""
        from pyamg.aggregation.aggregate import standard_aggregation
        from pyamg.aggregation.aggregation import fit_candidates

        r = A.blocksize[0]
        n = A.shape[0] // r
        D = np.zeros((n, r, r))
        rows = np.repeat(np.arange(n), np.diff(A.indptr))
        on = rows == A.indices
        D[rows[on]] = A.data[on]
        inverse = np.linalg.inv(D) if chains else np.linalg.pinv(D, 1e-12)
        steps = self.policy.multigrid_arnoldi_steps
        top = largest(A, lambda v: np.einsum("kij,kj->ki", inverse, v.reshape(-1, r)).ravel(), steps)
        reach = self.policy.multigrid_reach
        near = near_edges(A, X, edges, reach) if chains else near_places(A, X, reach)
        graph = graph_of(A, near)
        of = aggregates(graph, edges, *chains) if chains else csr_matrix(standard_aggregation(graph)[0])
        T, Bc = fit_candidates(of, B)
        Q = prolongator(A, near, inverse, top, Candidates(T, B, Bc))
        size = (B.shape[1],) * 2
        C = (Q.T.tobsr() @ (A @ Q)).tobsr(size)
        own = np.abs(C.diagonal())
        dead = np.flatnonzero(own <= 1e-14 * own.max())  # motions that vanish where nodes are held
        if len(dead):
            C = (C + csr_matrix((np.full(len(dead), own.mean()), (dead, dead)), C.shape)).tobsr(size)
        C.sort_indices()
        single = Q.tocsr().astype(np.float32)
        turns = Smoother(self.policy.multigrid_sweeps, top).coefficients()
        if chains:
            self.levels.append(self._finest(A, single, chains, turns))
        else:
            smoother = (A.tocsr().astype(np.float32), inverse.astype(np.float32))
            self.levels.append(Level(A.shape[0], turns, single, single.T.tocsr(), *smoother))
        count = np.bincount(T.indices)
        inside = np.diff(T.indptr) > 0
        X = np.stack([np.bincount(T.indices, x[inside]) for x in X.T], axis=1) / count[:, None]
        return C, X, Bc, C.shape[0] < A.shape[0]

    def _finest(
        self, A: bsr_matrix, Q: csr_matrix, chains: tuple[Index, Index], turns: list[tuple[float, float]]
    ) -> LineLevel:
        """The level of the matrix itself; with chains its interval is that of the lines."""
        start, nodes = chains
        D, L = np.empty((len(nodes), 3, 3)), np.zeros((len(nodes), 3, 3))
        factor_lines(start, nodes, A.indptr, A.indices, A.data, D, L)
        level = LineLevel(
            A.shape[0], turns, Q, Q.T.tocsr(), ptr=A.indptr, ind=A.indices, a=A.data.astype(np.float32), start=start,
            nodes=nodes, D=D.astype(np.float32), L=L.astype(np.float32),
        )  # fmt: skip
        if len(start) <= len(nodes):
            top = largest(A, level.relaxed, self.policy.multigrid_arnoldi_steps)
            level.turns = Smoother(self.policy.multigrid_sweeps, top).coefficients()
        return level

    def _cycle(self, k: int, b: Single) -> Single:
        if k == len(self.levels):
            return self.inverse @ b
        level = self.levels[k]
        x = np.zeros(level.n, dtype=np.float32)
        level.smoothed(x, b, post=False)
        x += level.Q @ self._cycle(k + 1, level.R @ level.left(x, b))
        level.smoothed(x, b, post=True)
        return x

    def __call__(self, r: Array) -> Array:
        """One V-cycle."""
        size = float(np.abs(r).max(initial=0.0))
        if not size > 0.0:
            return np.zeros_like(r)
        # residuals become smaller than the smallest number of single precision
        return size * self._cycle(0, (r / size).astype(np.float32)).astype(np.float64)

    @property
    def size(self) -> int:
        """Bytes of the hierarchy."""
        arrays = [self.inverse]
        for level in self.levels:
            for held in vars(level).values():
                if isinstance(held, np.ndarray):
                    arrays.append(held)
                elif issparse(held):
                    arrays += [held.data, held.indices, held.indptr]
        return sum(a.nbytes for a in arrays)
