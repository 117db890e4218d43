"""Bodies tied along boundaries by multi-point constraints u = T u_f: slave displacements are eliminated exactly.

Nodes that coincide are made one. Elsewhere the slave nodes follow by the dual mortar conditions of `system/mortar.py`:
constant stress passes between any two meshes, and each slave displacement is a weighted mean of master displacements.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import block_diag, coo_matrix, csr_matrix, identity

from prensa.layout import DofMap, Field
from prensa.mesh.mesh import Mesh, MeshError
from prensa.model import problem as model
from prensa.model.interference import Interference, interference_of
from prensa.precision import DRAWN
from prensa.system.inclined import Inclined, held_along_normals, inclined_of
from prensa.system.mortar import APART, Integrals, Side, combinations, integrals
from prensa.system.mortar_faces import face_integrals, on_faces
from prensa.system.tie_gaps import normals, overlaps
from prensa.types import Array, Flags, Index


@dataclass(frozen=True)
class Ties:
    """``matrix`` (n, n) over the displacement dofs, which are the first n: u = matrix u, rows of slaves combine masters.

    ``owner`` (n,): the unknown that stands for each one where nodes are made one (itself elsewhere).
    ``jump`` (n, k): what slaves are moved by besides, by the k unknowns ``shares`` of overlaps that are meant; None: by nothing.
    """

    matrix: csr_matrix
    owner: Index
    jump: csr_matrix | None = None
    shares: slice = field(default_factory=lambda: slice(0))
    inclined: Inclined | None = None
    """Sides that are held along their normals, whose conditions are in the matrix too."""
    joints: csr_matrix | None = None
    """The matrix without these; None where there are none."""

    @property
    def slaves(self) -> Index:
        """Unknowns that are eliminated."""
        return np.flatnonzero(self.matrix.diagonal() == 0)

    def with_slaves(self, u: Array) -> Array:
        """Unknowns (ndof,) with those of slaves put where their masters' take them."""
        n = len(self.owner)
        moved = self.matrix @ u[:n]
        return np.concatenate([moved if self.jump is None else moved + self.jump @ u[self.shares], u[n:]])

    def to_masters(self, r: Array) -> Array:
        """Forces (ndof,) with those on slaves handed over to their masters."""
        n = len(self.owner)
        out = np.concatenate([self.matrix.T @ r[:n], r[n:]])
        if self.jump is not None:
            out[self.shares] += self.jump.T @ r[:n]
        return out

    def support_forces(self, r: Array) -> Array:
        """Forces (q, 3) of the sides that are held along their normals, for what is out of balance r (ndof,)."""
        assert self.inclined is not None and self.joints is not None
        return self.inclined.forces(self.joints.T @ r[: len(self.owner)])

    def kept(self, ndof: int, fixed: Index) -> Index:
        """Unknowns that are neither prescribed nor slaves."""
        keep = np.concatenate([self.matrix.diagonal() != 0, np.ones(ndof - len(self.owner), dtype=bool)])
        keep[fixed] = False
        return np.flatnonzero(keep)

    def prescribed(self, fixed: Index) -> Index:
        """The ``fixed`` unknowns, and those of slaves that follow nothing but such."""
        n = len(self.owner)
        free = np.ones(n)
        free[fixed[fixed < n]] = 0.0
        return np.union1d(fixed, np.flatnonzero(abs(self.matrix) @ free == 0.0))

    def free(self, ndof: int, fixed: Index) -> csr_matrix:
        """T (ndof, free): all degrees of freedom from those that are `kept`, prescribed ones zero."""
        whole = csr_matrix(block_diag([self.matrix, identity(ndof - len(self.owner))], format="csr"))
        return csr_matrix(whole[:, self.kept(ndof, fixed)])


def make_ties(
    problem: model.Problem, meshes: dict[str, Mesh], offsets: dict[str, int], X: Array, held: Flags
) -> tuple[Ties | None, Array]:
    """The ties of a problem and node positions (n, 2), those of slaves put exactly on the master side, or as far in it as meant.

    held (n, 2): components that supports prescribe at some time.

    Raises
    ------
    MeshError
        If the two sides of a tie do not lie on each other, or a tie has nothing left to join.

    """
    if not (problem.ties or held_along_normals(problem)):
        return None, X
    X = X.copy()
    sides = [(_side(t.slave, meshes, offsets), _side(t.master, meshes, offsets)) for t in problem.ties]
    meant = [interference_of(tie) for tie in problem.ties]
    # Nodes that are made one cannot be moved against each other.
    matching = [given is None and _matching(X, *s) for given, s in zip(meant, sides)]
    # Coinciding nodes first: what is one node cannot also follow by a mortar condition.
    owner = _merged([s for s, one in zip(sides, matching) if one], X)
    X = X[owner]
    field = DofMap(X.shape[1], len(X)).displacement
    taken = np.repeat((owner != np.arange(len(X)))[:, None], field.width, axis=1)
    inclined = inclined_of(problem, meshes, offsets, owner, field, held | taken)
    if inclined is not None:  # as held by supports
        held = held.copy()
        held[inclined.nodes, inclined.slaves % field.width] = True
    left = [
        (Side(slave.name, owner[slave.edges]), Side(master.name, owner[master.edges]), given)
        for (slave, master), one, given in zip(sides, matching, meant) if not one
    ]  # fmt: skip
    triplets, into = _following(X, field, left, held, taken, problem.space == "axisymmetric")
    own = field.dofs(owner).ravel()
    merged = np.flatnonzero(own != np.arange(field.size))
    one = merged, own[merged], np.ones(len(merged))
    rows, cols, values = (np.concatenate(parts) for parts in zip(triplets, one))
    matrix = _closed(field.size, rows, cols, values)
    placed = np.asarray((matrix @ X.ravel()).reshape(X.shape))
    if inclined is not None:
        rows, cols, values = (np.concatenate(parts) for parts in zip((rows, cols, values), inclined.follow))
        return Ties(_closed(field.size, rows, cols, values, inclined.slaves), own, inclined=inclined, joints=matrix), placed
    if not into:
        return Ties(matrix, own), placed
    jump = _carried(-np.stack([way.ravel() for way in into], axis=1), rows, cols, values)
    return Ties(matrix, own, csr_matrix(jump)), placed - jump.sum(axis=1).reshape(X.shape)


def _following(
    X: Array, field: Field, pairs: list[tuple[Side, Side, Interference | None]], held: Flags, taken: Flags, revolved: bool
) -> tuple[tuple[Index, Index, Array], list[Array]]:  # fmt: skip
    """What slaves of ``pairs`` of sides that do not match follow, as triplets; ways (n, d) by which they are meant to overlap.

    ``held`` and ``taken`` (n, d): components that supports and other ties prescribe; those of slaves are taken from here on.
    """
    rows, cols, values = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
    into: list[Array] = []
    for s, m, given in pairs:
        between, joined = _between(X, s, m, given, revolved), 0
        corners = np.unique(s.edges[:, :3]) if s.edges.shape[1] == 6 else np.zeros(0, dtype=np.int64)
        on = on_faces(X, corners, m) if len(corners) else (np.zeros((0, 1), dtype=np.int64), np.zeros((0, 1)))
        if given is not None:
            into.append(np.zeros(X.shape))
        for axis, component in enumerate(field.components):
            free = ~held[:, axis] & ~taken[:, axis]
            free[m.nodes] = False  # a corner that another tie has made one with the master side
            placed = free[corners]
            free[corners] = False
            r, c, v = combinations(between, free)
            if placed.any():
                r = np.concatenate([r, np.repeat(corners[placed], on[0].shape[1])])
                c, v = np.concatenate([c, on[0][placed].ravel()]), np.concatenate([v, on[1][placed].ravel()])
            joined += len(r)
            # a body in space of one layer may be held across it at all of its nodes: one direction is enough there
            if (axis == 2 and not joined) if field.width == 3 else not len(r):
                raise MeshError(f"tie of {s.name} to {m.name}: supports or other ties hold all of its slave side; swap them")
            rows.append(field.dof(r, component))
            cols.append(field.dof(c, component))
            values.append(v)
            taken[np.unique(r), axis] = True
            if given is not None:
                into[-1][np.unique(r), axis] = _meant(X, s, m, given)[np.unique(r), axis]
    return (np.concatenate(rows), np.concatenate(cols), np.concatenate(values)), into


def _between(X: Array, slave: Side, master: Side, given: Interference | None, revolved: bool) -> Integrals:
    """Integrals between two sides of edges, in space of faces."""
    if X.shape[1] == 3:
        return face_integrals(X, slave, master)
    return integrals(X, slave, master, revolved, 1.0 if given is not None and given.by == "geometry" else APART)


def _meant(X: Array, slave: Side, master: Side, given: Interference) -> Array:
    """Ways (n, 2) into the master side by which the slave side overlaps it at its nodes."""
    depth = np.zeros(len(X))
    if given.by == "geometry":
        found = overlaps(X, slave, master, 1.0)
        depth[found.nodes] = found.depth
    else:
        depth[slave.nodes] = float(given.by)
    return depth[:, None] * normals(X, slave)


def _carried(jump: Array, rows: Index, cols: Index, values: Array) -> Array:
    """Jumps (n, k) of slaves with those of their masters, where these are slaves themselves."""
    one = csr_matrix((values, (rows, cols)), (len(jump), len(jump)))
    out = jump
    while not np.array_equal(more := jump + one @ out, out):  # as many times as slaves follow slaves, which `_closed` bounds
        out = more
    return out


def held_components(
    problem: model.Problem, meshes: dict[str, Mesh], offsets: dict[str, int], X: Array
) -> Flags:
    """Components (n, d) that a support or the axis of revolution prescribes at some time."""
    held = np.zeros(X.shape, dtype=bool)
    for source in (problem.fixed, *(source for s in problem.steps for source in (s.fixed, problem.driven(s)))):
        for name, support in source.items():
            body, _, edge = name.partition(".")
            nodes = meshes[body].nodes(edge, name) + offsets[body]
            held[nodes] |= [getattr(support, c, None) is not None for c in model.SPATIAL_AXES[: X.shape[1]]]
    if problem.space == "axisymmetric":
        held[:, 0] |= X[:, 0] <= 1e-12 * float(np.ptp(X, axis=0).max())
    return held


def _side(name: str, meshes: dict[str, Mesh], offsets: dict[str, int]) -> Side:
    body, _, edge = name.partition(".")
    meshes[body].nodes(edge, name)
    if edge not in meshes[body].edges:
        raise MeshError(f"ties: {name!r} is a point; a tie joins boundaries")
    return Side(name, meshes[body].edges[edge] + offsets[body])


def _closed(n: int, rows: Index, cols: Index, values: Array, held: Index | None = None) -> csr_matrix:
    """Matrix of the combinations, with masters that are slaves themselves replaced by their own masters.

    ``held``: slaves that may follow nothing.
    """
    keep = np.ones(n)
    keep[rows] = 0.0
    if held is not None:
        keep[held] = 0.0
    matrix = csr_matrix((values, (rows, cols)), (n, n)) + csr_matrix(
        (np.ones(int(keep.sum())), (np.flatnonzero(keep), np.flatnonzero(keep))), (n, n)
    )
    slave = keep == 0.0
    for _ in range(16):
        if not slave[matrix.indices].any():
            return csr_matrix(matrix)
        # Squaring follows chains of slaves in log₂ of their length; one that never ends is a circle of ties.
        matrix = matrix @ matrix
        matrix.eliminate_zeros()
    raise MeshError("ties: boundaries are tied to each other in a circle; make one of them the master of all")


# ------------------------------------------------------------------------------------------------------ matching meshes
def _pairs(X: Array, slave: Side, master: Side) -> tuple[Index, Flags]:
    """Nearest master node (k,) of each slave node, and whether it is at the same place (k,)."""
    size = DRAWN * float(np.ptp(X, axis=0).max())
    from scipy.spatial import cKDTree

    distance, near = cKDTree(X[master.nodes]).query(X[slave.nodes])
    return master.nodes[near], distance <= size


def _matching(X: Array, slave: Side, master: Side) -> bool:
    """Whether every edge of the slave side is an edge of the master side."""
    partner, same = _pairs(X, slave, master)
    if not same.all():
        return False
    to = dict(zip(slave.nodes.tolist(), partner.tolist()))
    known = {frozenset(e) for e in master.edges.tolist()}
    return all(frozenset(to[k] for k in e) in known for e in slave.edges.tolist())


def _merged(sides: list[tuple[Side, Side]], X: Array) -> Index:
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
