"""Sparsity pattern, slots, and the sweep kinematics → material → integrate → scatter over chunks of elements."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.elements.element import Chunk, Element, Failure, Mode, Work, workspace
from prensa.kernels.compiled import njit
from prensa.kernels.dilatation import volumetric_part
from prensa.kernels.search import entry
from prensa.layout import DofMap, of_corners
from prensa.materials.laws import At, Material
from prensa.materials.protocol import Flowing
from prensa.mesh.bricks import SOLID_CORNERS
from prensa.mesh.mesh import corner_cells
from prensa.types import Array, Flags, Index, Ints, Single

Slots = NDArray[np.uint8] | Ints
CHUNK = 1024  # elements that are evaluated together, whose arrays are reused by the next


class Part(NamedTuple):
    """The rows of a pattern by those of a part of it, which somebody holds anyway.

    ``indices`` (k,) rows of the part's entries, numbered among its ``numbers`` (f,); ``inside`` (nnz,): which entries of the
    whole are in the part; ``beyond``: rows of those that are not.
    """

    indices: Ints
    numbers: Index
    inside: Flags
    beyond: Ints

    def whole(self) -> Ints:
        """Rows (nnz,) of the whole pattern."""
        out = np.empty(len(self.inside), dtype=np.int32)
        out[self.inside] = self.numbers.astype(np.int32)[self.indices]
        out[~self.inside] = self.beyond
        return out


class Pattern:
    """Compressed sparse columns of the whole system, prescribed degrees of freedom included; structurally symmetric, sorted.

    ``n`` degrees of freedom, ``indptr`` (n + 1,), and how many ``entries`` there are.
    """

    def __init__(self, n: int, indptr: Ints, indices: Ints) -> None:
        self.n, self.indptr, self.entries = n, indptr, int(indptr[-1])
        self._rows: Ints | Part = indices

    @property
    def indices(self) -> Ints:
        """Rows (nnz,) of the entries; of a pattern that keeps a `Part` alone they are put together each time."""
        rows = self._rows
        return rows.whole() if isinstance(rows, Part) else rows

    def keep(self, indices: Ints, numbers: Index, inside: Flags, rows: Ints) -> None:
        """Keep the rows (nnz,) by those of a `Part` alone: two of them would be an eighth of what a large run holds."""
        self._rows = Part(indices, numbers, inside, rows[~inside])


@njit(cache=True)
def slots(indptr, indices, dofs, out):
    """Dofs (e, m) → out (e, m, m): position of entry (row i, column j) in the matrix values."""
    for e in range(dofs.shape[0]):
        for j in range(dofs.shape[1]):
            for i in range(dofs.shape[1]):
                out[e, i, j] = entry(indptr, indices, dofs[e, j], dofs[e, i])


@njit(cache=True)
def scatter_matrix(K, slot, data):
    """data[slot] += K for K, slot (e, m, m)."""
    for e in range(K.shape[0]):
        for i in range(K.shape[1]):
            for j in range(K.shape[2]):
                data[slot[e, i, j]] += K[e, i, j]


@njit(cache=True)
def block_slots(indptr, indices, cells, out, d=2):
    """Cells (e, a) → out (e, a, a): place of the first unknown of node i among the entries of the column of that of node j.

    d: degrees of freedom of a node.
    """
    for e in range(cells.shape[0]):
        for j in range(cells.shape[1]):
            for i in range(cells.shape[1]):
                out[e, i, j] = entry(indptr, indices, d * cells[e, j], d * cells[e, i]) - indptr[d * cells[e, j]]


def slots_of(cells: Index, pattern: Pattern, d: int) -> Slots:
    """`block_slots` of cells (e, a), in a byte each where columns are short: places among all values would take four."""
    longest = int(np.diff(pattern.indptr)[d * cells].max(initial=0))
    slot = np.empty((*cells.shape, cells.shape[1]), dtype=np.uint8 if longest <= 256 else np.int32)
    block_slots(pattern.indptr, pattern.indices, cells, slot, d)
    return slot


def scatter_stiffness(K: Array, cells: Index, slot: Slots, indptr: Ints, data: Array) -> None:
    """Add K (e, d a, d a) to the matrix values; slot (e, a, a) of `block_slots`, d degrees of freedom a node.

    The degrees of freedom of a node are coupled with the same ones: its columns all have the same rows.
    """
    if K.shape[1] == 2 * cells.shape[1]:
        _scatter_stiffness(K, cells, slot, indptr, data)
    else:
        _scatter_stiffness_in_space(K, cells, slot, indptr, data)


@njit(cache=True)
def _scatter_stiffness_in_space(K, cells, slot, indptr, data):
    """`scatter_stiffness` for any number of degrees of freedom a node: most runs need not have it compiled."""
    d = K.shape[1] // cells.shape[1]
    for e in range(K.shape[0]):
        for j in range(cells.shape[1]):
            column = d * cells[e, j]
            length = indptr[column + 1] - indptr[column]
            for i in range(cells.shape[1]):
                k = indptr[column] + slot[e, i, j]
                for n in range(d):
                    for m in range(d):
                        data[k + n * length + m] += K[e, d * i + m, d * j + n]


@njit(cache=True)
def _scatter_stiffness(K, cells, slot, indptr, data):
    """`scatter_stiffness` for two degrees of freedom a node.

    Places have no sign: those with one are asked each time whether they are counted from the end.
    """
    one = np.uint64(1)
    for e in range(K.shape[0]):
        for j in range(cells.shape[1]):
            column = np.uint64(2 * cells[e, j])
            begin = np.uint64(indptr[column])
            length = np.uint64(indptr[column + one]) - begin
            for i in range(cells.shape[1]):
                k = begin + np.uint64(slot[e, i, j])
                data[k] += K[e, 2 * i, 2 * j]
                data[k + one] += K[e, 2 * i + 1, 2 * j]
                data[k + length] += K[e, 2 * i, 2 * j + 1]
                data[k + length + one] += K[e, 2 * i + 1, 2 * j + 1]


def gather(values: Array, cells: Index, out: Array) -> None:
    """out[e, a] = values[cells[e, a]] for values (n, d), cells (m, a)."""
    values.take(cells, axis=0, out=out, mode="clip")  # "raise" would copy out


@njit(cache=True)
def scatter_vector(r, dofs, out):
    """out[dofs] += r for r, dofs (e, m)."""
    for e in range(r.shape[0]):
        for i in range(r.shape[1]):
            out[dofs[e, i]] += r[e, i]


def scatter_forces(r: Array, cells: Index, out: Array) -> None:
    """Add the forces r (e, d a) on the nodes of cells (e, a), d degrees of freedom each, to those of all degrees of freedom."""
    if r.shape[1] == 2 * cells.shape[1]:
        _scatter_forces(r, cells, out)
    else:
        _scatter_forces_in_space(r, cells, out)


@njit(cache=True)
def _scatter_forces_in_space(r, cells, out):
    """`scatter_forces` for any number of degrees of freedom a node: most runs need not have it compiled."""
    d = r.shape[1] // cells.shape[1]
    for e in range(r.shape[0]):
        for a in range(cells.shape[1]):
            for i in range(d):
                out[d * cells[e, a] + i] += r[e, d * a + i]


@njit(cache=True)
def _scatter_forces(r, cells, out):
    """`scatter_forces` for two degrees of freedom a node."""
    for e in range(r.shape[0]):
        for a in range(cells.shape[1]):
            out[2 * cells[e, a]] += r[e, 2 * a]
            out[2 * cells[e, a] + 1] += r[e, 2 * a + 1]


@njit(cache=True)
def _blocks(indptr, indices, d, out_indptr, out_indices):
    """Pattern of nodes (compressed columns, sorted) → pattern of their d degrees of freedom each, sorted."""
    n = 0
    out_indptr[0] = 0
    for node in range(len(indptr) - 1):
        for i in range(d):
            for k in range(indptr[node], indptr[node + 1]):
                for m in range(d):
                    out_indices[n] = d * indices[k] + m
                    n += 1
            out_indptr[d * node + 1 + i] = n


def make_pattern(
    cells: list[Index], dofs: DofMap, tool_nodes: list[Index], coupled: list[Index] | None = None
) -> Pattern:
    """Pattern of the displacements of all cells, each tool's motions with all its candidate nodes, and with itself.

    ``coupled``: further sets of degrees of freedom (k, m) of any fields, each row coupled with itself.
    """
    from scipy.sparse import coo_matrix, csc_matrix, csr_matrix

    nodes = dofs.displacement.count
    # each node is an element of its own too: one that no cell has keeps its place on the diagonal
    members = np.concatenate([*(c.ravel() for c in cells), np.arange(nodes)]).astype(np.int32)
    sizes = np.concatenate([*(np.full(len(c), c.shape[1]) for c in cells), np.ones(nodes, dtype=np.int64)])
    ends = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)
    incidence = csr_matrix((np.ones(len(members), dtype=np.int32), members, ends), (len(sizes), nodes))
    graph = (incidence.T @ incidence).tocsc()
    graph.sort_indices()
    d = dofs.dimension
    indptr, indices = np.empty(d * nodes + 1, dtype=np.int32), np.empty(d * d * graph.nnz, dtype=np.int32)
    _blocks(graph.indptr, graph.indices, d, indptr, indices)
    first, n = dofs.displacement.size, dofs.size
    more_i: list[Index] = []
    more_j: list[Index] = []
    for t, near in enumerate(tool_nodes):
        own = dofs.tool.dofs(t)
        nodal = dofs.displacement.dofs(near).ravel()
        a, b = np.meshgrid(own, nodal, indexing="ij")
        s, q = np.meshgrid(own, own, indexing="ij")
        more_i += [a.ravel(), b.ravel(), s.ravel()]
        more_j += [b.ravel(), a.ravel(), q.ravel()]
    for group in coupled or []:
        more_i.append(np.repeat(group, group.shape[1], axis=1).ravel())
        more_j.append(np.tile(group, group.shape[1]).ravel())
    if more_i:
        i, j = np.concatenate(more_i), np.concatenate(more_j)
        beyond = coo_matrix((np.ones(len(i), dtype=np.int8), (i, j)), (n, n)).tocsc()
        beyond.data[:] = 1
        indptr = np.concatenate([indptr, np.full(n - first, indptr[-1], dtype=np.int32)])
        matrix = csc_matrix((np.ones(len(indices), dtype=np.int8), indices, indptr), (n, n)) + beyond
        matrix.sort_indices()
        indptr, indices = matrix.indptr, matrix.indices
    return Pattern(n, indptr.astype(np.int32, copy=False), indices.astype(np.int32, copy=False))


@dataclass(frozen=True)
class Block:
    """Elements of one body, a nodes and q points each: global ``cells`` (m, a), ``X`` (m, a, d), law, formulation.

    slots (m, a, a) of `block_slots`; ``volume`` (m, q): initial volumes of the points, thickness or 2πr inside. ``rooms``: where
    chunks have been answered for and others can be.

    Raises
    ------
    ValueError
        For a law whose tensors have other components than the element's.

    """

    body: str
    cells: Index
    X: Array
    law: Material
    element: Element
    mode: Mode
    slots: Slots
    volume: Array
    rooms: list[_Room] = field(default_factory=list, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.law.layout != self.element.layout:
            raise ValueError(
                f"the element has the tensors of layout {self.element.layout.name!r}, the law those of "
                f"{self.law.layout.name!r}; give material_of the space of the element"
            )

    def __len__(self) -> int:
        return len(self.cells)

    @cached_property
    def flows(self) -> bool:
        """Whether the law's flow follows the `TimeRule` of an increment, as J2's does: others have a rule of their own."""
        return self.law.plastic and isinstance(self.law, Flowing)

    @cached_property
    def corners(self) -> Index:
        """Corner nodes (m, 3|4) of the elements, (m, 4|8) in space."""
        solid = self.element.layout.dimension == 3
        return self.cells[:, : SOLID_CORNERS[self.cells.shape[1]]] if solid else corner_cells(self.cells)

    @cached_property
    def corner_fields(self) -> tuple[Array, Array]:
        """See `of_corners`: at the points and at the nodes of an element."""
        return of_corners(self.element.N)

    @property
    def undeformed(self) -> Array:
        """History (m, q, h) of the undeformed body."""
        history = np.zeros((*self.volume.shape, self.law.size + self.element.extra(self.mode)))
        for part in self.law.fields.values():
            if part.initial:  # zeros that nobody writes take no memory
                X = np.einsum("qa,mad->mqd", self.element.N, self.X).reshape(-1, self.X.shape[-1])
                at = part.start(X)
                history[..., part.columns] = at.reshape(*self.volume.shape, -1) if len(at.shape) == len(X.shape) else at
        return history

    def field(self, history: Array, name: str) -> Array:
        """Columns (m, q, k) of a history that a field of the law has."""
        return np.asarray(history[..., self.law.fields[name].columns])

    def at_law(self, history: Array) -> Array:
        """The law's columns (m, q, law.size) of a history, contiguous."""
        return np.ascontiguousarray(history[..., : self.law.size])

    def work(self, history: Array, elements: Index | slice = slice(None)) -> Array:
        """Energy (m,) that ``elements`` have stored and dissipated in plastic flow up to a history."""
        h = history[elements]
        work = self.law.energy(self.at_law(h))
        if self.law.plastic:
            work = work + self.field(h, "plastic_work").reshape(work.shape)
        return np.asarray((self.volume[elements] * work).sum(axis=1))

    def positions(self, x: Array) -> Array:
        """Places (m, q, d) of the integration points on node positions x (n, d) of the whole system."""
        return np.ascontiguousarray(np.einsum("qa,mad->mqd", self.element.N, x[self.cells]))


class Sweep(NamedTuple):
    """Result of a sweep: total Σ |element forces|, new history (m, q, h), and what failed; then history is the old one.

    ``volumetric``: see `volumetric_part`; None of elements that do not say what dilatation they have in common.
    """

    force_scale: float
    history: Array
    failed: Failure | None
    volumetric: Single | None = None


def sweep(
    block: Block, x_n: Array, du: Array, old: Array, at: At, r: Array, data: Array | None, pattern: Pattern, threads: int = 1,
    preconditioned: bool = True,
) -> Sweep:  # fmt: skip
    """Add internal forces to r (ndof,) and, unless data is None, the stiffness to data (nnz,) of the pattern.

    x_n (n, d): configuration that increments refer to; du (n, d): increments of the nodes; old (m, q, h) history; ``threads``
    that may answer for chunks of elements at once. ``preconditioned``: see `prensa.system.interaction.Context`.
    """
    points, new, total = old.shape[1], np.empty_like(old), 0.0
    common, volumetric = _volumetric(block) if preconditioned and data is not None else (None, None)

    def answer(first: int, room: _Room) -> Failure | None:
        """Forces, stiffness and history of the chunk that begins with element ``first``, in a room of its own."""
        rows = slice(first, first + CHUNK)
        cells = block.cells[rows]
        k = len(cells)
        gather(x_n, cells, room.x[:k])
        gather(du, cells, room.d[:k])
        chunk = Chunk(block.X[rows], room.x[:k], room.d[:k], old[rows], new[rows])
        here = at if at.flows is None and at.temperature is None else at.of(np.arange(first * points, (first + k) * points))
        return block.element.respond(chunk, block.law, here, block.mode, room.first(k), data is not None)

    for first, room, failure in _in_order(answer, block, threads):
        if failure:
            return Sweep(np.nan, old, Failure(first + failure.element, failure.why))
        rows = slice(first, first + CHUNK)
        cells = block.cells[rows]
        w = room.first(len(cells))
        total += float(w.size.sum())
        scatter_forces(w.r, cells, r)
        if data is not None:
            scatter_stiffness(w.K, cells, block.slots[rows], pattern.indptr, data)
            if common is not None and volumetric is not None:
                volumetric_part(w.K, room.x[: len(cells)] + room.d[: len(cells)], common, volumetric[rows])
    return Sweep(total, new, None, volumetric)


def _volumetric(block: Block) -> tuple[Array | None, Single | None]:
    """Where elements have their dilatation in common (see `Element.common_dilatation`) and room for their `volumetric_part`.

    In space alone, where preconditioners are made of it.
    """
    slopes = block.element.common_dilatation(block.mode) if block.element.layout.dimension == 3 else None
    return slopes, None if slopes is None else np.empty((len(block), 3 * slopes.size + 1), dtype=np.float32)


class _Room(NamedTuple):
    """Where a chunk is answered for: positions and increments of its nodes, scratch and results."""

    x: Array
    d: Array
    work: Work

    @classmethod
    def of(cls, block: Block) -> _Room:
        """Room for any chunk of a block: one that is free, since fresh memory costs as much as a kernel, or a new one."""
        k = min(CHUNK, len(block))
        with suppress(IndexError):  # there is none; another thread may just have taken the last one
            while True:
                room = block.rooms.pop()
                if len(room.x) == k:
                    return room
        x, d = np.empty((2, k, block.cells.shape[1], block.element.layout.dimension))
        return cls(x, d, workspace(block.element, k))

    def first(self, k: int) -> Work:
        """The work of the first k elements."""
        return self.work if k == len(self.x) else self.work.first(k)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, "elements")


def _in_order(
    answer: Callable[[int, _Room], Failure | None], block: Block, threads: int
) -> Iterator[tuple[int, _Room, Failure | None]]:
    """The chunks of a block in their order, each answered for: first element, its room until the next is asked for, failure.

    With threads chunks ahead are answered for meanwhile. They are the same with any number, and so is the order of what is
    added up: results do not depend on it.
    """
    chunks = range(0, len(block), CHUNK)
    if threads == 1 or len(chunks) == 1:
        room = _Room.of(block)
        for first in chunks:
            yield first, room, answer(first, room)
        block.rooms.append(room)
        return
    ahead: deque[tuple[int, _Room, Future[Failure | None]]] = deque()
    to_do, pool = iter(chunks), _pool(threads)
    rooms = [_Room.of(block) for _ in range(min(threads + 1, len(chunks)))]
    try:
        for room, first in zip(rooms, to_do):
            ahead.append((first, room, pool.submit(answer, first, room)))
        while ahead:
            first, room, answered = ahead.popleft()
            yield first, room, answered.result()
            if (then := next(to_do, None)) is not None:
                ahead.append((then, room, pool.submit(answer, then, room)))
    finally:
        # what is left after a failure still writes into arrays of this sweep
        wait([answered for *_, answered in ahead])
        block.rooms.extend(rooms)
