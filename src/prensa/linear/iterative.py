"""Linear systems of bodies in space: flexible GMRES on the tangent A; the preconditioner is made from a symmetric P beside it.

P is near (A + Aᵀ)/2 (`prensa.linear.symmetric_part`). LDLᵀ of P in single precision, or a multigrid hierarchy made from it, with
most of the bulk stiffness apart (`prensa.linear.pressure_apart`), preconditions. A itself stays as it is, and what counts is
its true residual: a solution that GMRES does not reach goes to the next way, from multigrid to LDLᵀ, from there to LU of A, for
the rest of the attempt, with a line in the log.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Sequence
from copy import copy
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from prensa.kernels.smoothers import block_places, mirrored
from prensa.linear.factorisations import (
    BACKENDS,
    SYMMETRIC,
    Factor,
    Factorisation,
    KeptFactors,
    SingularError,
    Solve,
    Structure,
    _backward_error,
    krylov,
    length,
)
from prensa.linear.multigrid import Multigrid, Nodes
from prensa.linear.pressure_apart import PressureApart
from prensa.linear.symmetric_part import SymmetricPart
from prensa.model import problem as model
from prensa.policy import DEFAULT, Policy
from prensa.system.planning import plan_step
from prensa.system.system import System
from prensa.types import Array, Flags, Index, Ints, Single

if TYPE_CHECKING:
    from scipy.sparse import bsr_matrix, csr_matrix

log = logging.getLogger("prensa")

LDLT, MULTIGRID = model.SPATIAL_SOLVERS
IN_WORDS = {LDLT: "LDLᵀ of the symmetric part", MULTIGRID: "multigrid"}
SINGLE_BYTES = np.dtype(np.float32).itemsize
SINGLE_EPS = float(np.finfo(np.float32).eps)


def ways_of(numerics: model.Numerics, unknowns: int, policy: Policy = DEFAULT) -> tuple[str, ...]:
    """Preconditioners of systems in space with so many free unknowns, in the order in which they are tried; none: LU of A."""
    import importlib.util

    known = importlib.util.find_spec("rslab") is not None
    if numerics.solver == "auto":
        if unknowns < policy.iterative_from or not known:
            return ()
        return (LDLT,) if unknowns < policy.multigrid_from else (MULTIGRID, LDLT)
    if numerics.solver == MULTIGRID:
        return (MULTIGRID, LDLT) if known else (MULTIGRID,)
    return (LDLT,) if numerics.solver == LDLT and known else ()


def solver_of(system: System, numerics: model.Numerics, policy: Policy = DEFAULT) -> str:
    """What solves the linear systems of the first step of a system in space: ``multigrid``, ``ldlt`` or ``lu``."""
    if system.exact:  # multipliers have no place in P
        return "lu"
    plan = plan_step(system, 0, system.initial().step_start)
    ways = ways_of(numerics, system.ndof - len(system.prescribed(plan.fixed)), policy)
    return ways[0] if ways else "lu"


def machine_memory() -> float | None:
    """Bytes of memory of the machine; None where it does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return None


def too_large(size: float) -> str:
    """What to say of factors of so many bytes that are more than the machine's memory; '' of those that are not."""
    memory = machine_memory()
    if memory is None or size < memory:
        return ""
    return f"factors of {size / 1e9:.3g} GB are more than the {memory / 1e9:.3g} GB of this machine"


class Geometry(NamedTuple):
    """Where the free unknowns (f,) are: ``at`` three times their node plus the axis, −1 of tools; the undeformed ``nodes``."""

    at: Ints
    nodes: Nodes


def geometry_of(system: System, free: Index) -> Geometry:
    """That of the free dofs (f,) of a system; nodes all of whose dofs are prescribed are left out."""
    field = system.dofs.displacement
    bodily = field.owns(free)
    node, axis = field.split(free[bodily])
    known = np.unique(node)
    number = np.full(system.nodes, -1)
    number[known] = np.arange(len(known))
    at = np.full(len(free), -1, dtype=np.int32)
    at[bodily] = 3 * number[node] + axis
    moves = np.zeros((len(known), 3), dtype=bool)
    moves[number[node], axis] = True
    cells = [number[b.cells] for b in system.blocks]
    return Geometry(at, Nodes(system.X[known], moves, cells))


class NodalMatrix:
    """P as blocks of 3 × 3 of the nodes, and a cycle of multigrid on it with the few unknowns of tools eliminated.

    indptr, indices: pattern of the free unknowns, structurally symmetric, sorted.
    """

    def __init__(self, indptr: Ints, indices: Ints, where: Geometry, policy: Policy) -> None:
        from scipy.sparse import csr_matrix

        at, self.nodes, self.policy = where.at, where.nodes, policy
        self.bodily, self.rest = np.flatnonzero(at >= 0), np.flatnonzero(at < 0)
        self.to, n = at[self.bodily], len(where.nodes.X)
        f = len(at)
        of = csr_matrix((np.ones(len(self.to), dtype=np.int32), (self.bodily, self.to // 3)), (f, n))
        pattern = csr_matrix((np.ones(len(indices), dtype=np.int32), indices, indptr), (f, f))
        graph = (of.T @ pattern @ of).tocsr()
        graph.sort_indices()
        self.ptr, self.ind = graph.indptr, graph.indices
        self.slots = np.empty(len(indices), dtype=np.int64)
        block_places(indptr, indices, at, self.ptr, self.ind, self.slots)
        self.held = np.flatnonzero(~where.nodes.free.ravel())
        self.indptr, self.indices = indptr, indices

    def matrix(self, values: Array) -> bsr_matrix:
        """P (3 n, 3 n) for its values (nnz,), with a usual diagonal for what is held."""
        from scipy.sparse import bsr_matrix

        data = np.zeros(9 * len(self.ind))
        inside = self.slots >= 0
        data[self.slots[inside]] = values[inside]
        rows = np.repeat(np.arange(len(self.ptr) - 1), np.diff(self.ptr))
        diagonal = 9 * np.flatnonzero(rows == self.ind)[:, None] + 4 * np.arange(3)
        usual = float(np.abs(data[diagonal]).sum() / max(len(self.bodily), 1))
        data[diagonal.ravel()[self.held]] = usual
        return bsr_matrix((data.reshape(-1, 3, 3), self.ind, self.ptr), (3 * (len(self.ptr) - 1),) * 2)

    def cycle(self, values: Array) -> Solve:
        """A preconditioner for the values (nnz,) of P; raises `ArithmeticError` where there is none."""
        from scipy.sparse import csr_matrix

        grid = Multigrid(self.matrix(values), self.nodes, self.policy)
        size = 3 * len(self.nodes.X)

        def bodies(b: Array) -> Array:
            r = np.zeros(size)
            r[self.to] = b
            return grid(r)[self.to]

        if not len(self.rest):
            return bodies
        # The few unknowns of tools are eliminated with what the cycle makes of their columns.
        P = csr_matrix((values, self.indices, self.indptr), (len(self.to) + len(self.rest),) * 2)
        own = P[self.rest]
        B, D = own[:, self.bodily].toarray(), own[:, self.rest].toarray()
        Z = np.column_stack([bodies(row) for row in B])
        S = np.linalg.pinv(D - B @ Z)

        def both(b: Array) -> Array:
            out = np.empty_like(b)
            y = bodies(b[self.bodily])
            out[self.rest] = t = S @ (b[self.rest] - B @ y)
            out[self.bodily] = y - Z @ t
            return out

        return both


class Iterative:
    """Solver for systems in space: `Factors` of values (nnz + k,) of A, followed by numbers for P (see `SymmetricPart`).

    direct: LU of A, to which all goes where no preconditioner leads to a solution; ``ways``: those to try; ``part``: what
    makes P of such numbers; ``system``, ``free`` (f,): where the unknowns are, for multigrid.
    ``krylov_iterations``: of the attempt so far; ``fell_back``: what went wrong in it, in words.
    """

    made_from: Single | None = None

    def __init__(
        self, direct: Factorisation, ways: Sequence[str], part: SymmetricPart, system: System, free: Index,
        policy: Policy = DEFAULT,
    ) -> None:  # fmt: skip
        self.direct, self.ways, self.part, self.policy = direct, tuple(ways), part, policy
        self._system, self._free = system, free
        self._mirror: Ints | None = None
        self._inside: Flags | None = None
        self._ldlt: Factor | None = None
        self._nodal: NodalMatrix | None = None
        self.begin()

    def begin(self, made_from: Single | None = None) -> None:
        """Forget factors and fallbacks of earlier attempts: an attempt depends on its arguments alone."""
        self.direct.begin()
        self.order, self.fell_back, self.krylov_iterations = list(self.ways), list[str](), 0
        self._A: csr_matrix | None = None
        self._solve: Solve | None = None
        self._more = np.zeros(0)
        self._own = True  # whether the preconditioner is made from the last matrix
        self._symmetric = False  # whether P is the symmetric part of A: nothing of contact is left out

    # ------------------------------------------------------------------------------------------------------ matrices
    @property
    def _entries(self) -> int:
        return len(self.direct.structure.indices)

    @property
    def mirror(self) -> Ints:
        """Places (nnz,) of the mirrored entries."""
        if self._mirror is None:
            self._mirror = mirrored(self.direct.structure.indptr, self.direct.structure.indices)
        return self._mirror

    def _tangent(self, values: Array) -> csr_matrix:
        """A, scaled, by rows."""
        from scipy.sparse import csr_matrix

        n, indptr, indices = self.direct.structure[:3]
        own = self.direct.scaled(values[: self._entries])
        return csr_matrix((own[self.mirror], indices, indptr), (n, n))

    def _columns_of(self, A: csr_matrix) -> Array:
        """Values (nnz,) of A by columns, in its own units."""
        values, scale, structure = A.data[self.mirror], self.direct.scale, self.direct.structure
        if scale is None:
            return values
        return values / (scale[structure.indices] * np.repeat(scale, np.diff(structure.indptr)))

    def _symmetric_values(self, A: csr_matrix, more: Array, apart: bool = False) -> Array:
        """P (nnz,), scaled; more (k,): see `SymmetricPart`; ``apart``: without the pressures that are unknowns by themselves."""
        out = 0.5 * (A.data + A.data[self.mirror])
        if apart or self._slides(more):
            out += self.direct.scaled(self.part.of_elements(more, apart))
        places, scale, structure = self.part.places, self.direct.scale, self.direct.structure
        contact = more[: len(places)]
        if scale is not None:
            column = np.searchsorted(structure.indptr, places, side="right") - 1
            contact = contact * scale[structure.indices[places]] * scale[column]
        out[places] += contact
        return out

    def _slides(self, more: Array) -> bool:
        """Whether contact makes another P than (A + Aᵀ)/2; only then may elements too: its pivots depend on A elsewhere."""
        return bool(more[: len(self.part.places)].any())

    def _preconditioner(self, way: str, A: csr_matrix, more: Array) -> Solve:
        """LDLᵀ or multigrid of P; raises `ArithmeticError` or `RuntimeError` where there is none."""
        if way == MULTIGRID:
            return self._multigrid(A, more)
        values = self._symmetric_values(A, more)
        if self._ldlt is None or self._inside is None:
            self.analyse_ldlt()
        assert self._ldlt is not None and self._inside is not None
        if words := too_large(SINGLE_BYTES * int(getattr(self._ldlt, "entries", 0))):
            raise ArithmeticError(words)
        with np.errstate(over="ignore"):
            single = values[self._inside].astype(np.float32)
        if not np.isfinite(single).all():
            raise ArithmeticError("values beyond the range of single precision")
        return self._ldlt(single)

    def _multigrid(self, A: csr_matrix, more: Array) -> Solve:
        """Multigrid of P, with pressures apart where elements have any."""
        cycle = self.nodal.cycle(self._symmetric_values(A, more, apart=bool(self.part.blocks)))
        if not self.part.blocks:
            return cycle
        B, G, share = self.part.pressures(more)
        if not share.any():
            return cycle
        if self.direct.scale is not None:
            B, G = (X.multiply(self.direct.scale[:, None]).tocsr() for X in (B, G))
        return PressureApart(B, G, share, cycle)

    def analyse_ldlt(self) -> None:
        """Analyse the lower triangle of P."""
        indptr, indices, self._inside = self.direct.structure.lower()
        part: Structure = self.direct.structure._replace(kind=SYMMETRIC, indptr=indptr, indices=indices)
        self._ldlt = BACKENDS["rslab"](part)

    def analyse(self) -> None:
        """Make ready what depends on the pattern alone."""
        _ = self.mirror
        if self.ways[0] == LDLT:
            self.analyse_ldlt()
        else:
            _ = self.nodal

    @property
    def nodal(self) -> NodalMatrix:
        """P by the blocks of nodes, for multigrid."""
        if self._nodal is None:
            structure = self.direct.structure
            where = geometry_of(self._system, self._free)
            self._nodal = NodalMatrix(structure.indptr, structure.indices, where, self.policy)
        return self._nodal

    @property
    def size(self) -> int:
        """Bytes of the factors of P in single precision, or about those of a hierarchy: its finest level and interpolation."""
        if self.ways[0] == LDLT:
            if self._ldlt is None:
                self.analyse_ldlt()
            return SINGLE_BYTES * int(getattr(self._ldlt, "entries", 0))
        return 2 * SINGLE_BYTES * self._entries

    # ------------------------------------------------------------------------------------------------------ solutions
    @property
    def by_lu(self) -> bool:
        """Whether LU of A has taken over for the rest of the attempt."""
        return not self.order

    @property
    def name(self) -> str:
        """The preconditioner in use, ``lu`` where there is none."""
        return self.order[0] if self.order else "lu"

    def _krylov(self, A: csr_matrix, solve: Solve, b: Array, share: float, precisely: bool = False) -> Array | None:
        """Solution (f,) of A x = b but for a share, by GMRES; ``precisely``: refined to the last digits, or None."""
        done, most = [0], self.policy.krylov_max_iterations if self._own else self.policy.ldlt_max_iterations

        def counted(r: Array) -> Array:
            done[0] += 1
            return solve(r)

        def by_gmres(r: Array, share: float) -> Array | None:
            # the first iterations, in which few eigenvalues are seen, say nothing of the rate
            if not isinstance(solve, PressureApart):
                return krylov(A, counted, r, most, share, least=most // 2)
            x, rest, goal = np.zeros_like(r), r, share * length(r)
            for _ in range(1 + self.policy.max_refinements):
                # again where what is left of the pressures of neighbours adds up to larger forces
                if length(rest) <= 2.0 * goal:
                    return x
                more = krylov(solve.of(A), counted, solve.extended(rest), most, goal / length(rest), least=most // 2)
                if more is None:
                    break
                x += more[: len(r)]
                rest = r - A @ x
            return None

        x = by_gmres(b, SINGLE_EPS if precisely else share)
        if precisely and x is not None:
            x = self._refined(A, b, x, by_gmres)
        self.krylov_iterations += done[0]
        return x

    def _refined(self, A: csr_matrix, b: Array, x: Array, by_gmres: _Gmres) -> Array | None:
        """A solution (f,) of A x = b improved until its backward error is that of a direct solution; None if it stays larger."""
        policy, largest = self.policy, max(float(A.data.max(initial=0.0)), -float(A.data.min(initial=0.0)))
        for _ in range(policy.max_refinements):
            r = b - A @ x
            error = _backward_error(A, x, b, r, largest, policy.refine_backward_error)
            if not error > policy.refine_backward_error:
                return x
            more = by_gmres(r, SINGLE_EPS)
            if more is None:
                break
            x = x + more
        error = _backward_error(A, x, b, b - A @ x, largest, policy.refine_backward_error)
        return x if error <= policy.max_backward_error else None

    def _scaled(self, b: Array) -> Array:
        scale = self.direct.scale
        return b if scale is None else scale * b

    def _solution(self, values: Array, b: Array, share: float, precisely: bool, kept: bool) -> Array | None:
        """Solution (f,) by the way in turn and those after it; None where LU has to take over."""
        if len(values) != self._entries + self.part.size:  # of a transpose, say: what P has beside it is not known
            self.order = []
            return None
        largest = float(np.abs(values[: self._entries]).max(initial=0.0))
        if not np.isfinite(largest):
            raise SingularError("the matrix has entries that are not numbers")
        A, self._more = self._tangent(values), values[self._entries :].copy()
        scaled = self._scaled(b)
        before, self._A, self._symmetric = self._solve, A, not self._more.any()
        if kept and before is not None:
            self._own = False
            x = self._krylov(A, before, scaled, share, precisely)
            if x is not None:
                return self._scaled(x)
        del before
        x = self._by_new(lambda solve: self._krylov(A, solve, scaled, share, precisely))
        if x is None:
            self._A = self._solve = None
            return None
        return self._scaled(x)

    def _by_new(self, solution: Callable[[Solve], Array | None]) -> Array | None:
        """A solution by a preconditioner of the last matrix itself, in the order of the ways; None where LU has to take over."""
        assert self._A is not None
        while self.order:
            self._solve = None  # the old factors go before the new ones come
            reason = f"does not lead to a solution in {self.policy.krylov_max_iterations} iterations"
            try:
                self._solve, self._own = self._preconditioner(self.order[0], self._A, self._more), True
                x = solution(self._solve)
            except (ArithmeticError, RuntimeError, ValueError, np.linalg.LinAlgError) as error:
                x, reason = None, f"fails ({error})"
            if x is not None:
                return x
            self._give_up(reason)
        return None

    def _give_up(self, reason: str) -> None:
        """Go on to the next way, and say so: each time in the log, once as a warning."""
        way = self.order.pop(0)
        after = IN_WORDS[self.order[0]] if self.order else "LU of the tangent"
        self.fell_back.append(f"{IN_WORDS[way]} {reason}; {after} takes over")
        log.info("linear solver: %s", self.fell_back[-1])
        log.warning("linear solver: %s did not solve all systems; %s took over where it did not", IN_WORDS[way], after)

    def step(self, values: Array, b: Array, share: float, changed: int | None = None) -> Array:
        """See `Factors`."""
        if not self.by_lu:
            # a hierarchy is made in about the time that it saves
            alike = changed is not None and changed <= self.policy.same_matrix_points and self.order[0] == LDLT
            x = self._solution(values, b, share, False, alike)
            if x is not None:
                return x
            changed = None
        self._refuse_lu()
        return self.direct.step(values[: self._entries], b, share, changed)

    def solve(self, values: Array, b: Array) -> Array:
        """See `Factors`."""
        if not self.by_lu and len(b):
            x = self._solution(values, b, SINGLE_EPS, True, False)
            if x is not None:
                return x
        self._refuse_lu()
        return self.direct.solve(values[: self._entries], b)

    def _refuse_lu(self) -> None:
        """Raise `SingularError` where factors of A have no room: the increment fails in words, and not the process."""
        if words := too_large(self.direct.size):
            raise SingularError(f"{self.fell_back[-1] if self.fell_back else 'LU of the tangent'}; {words}")

    def _columns(self, b: Array, share: float) -> Array | None:
        """Solutions (f,) or (f, k) of the last matrix but for a share; None if GMRES does not lead there."""
        if self._A is None or self._solve is None:
            return None
        out = np.empty((len(b), 1 if b.ndim == 1 else b.shape[1]))
        for k, column in enumerate(out.T):
            x = self._krylov(self._A, self._solve, self._scaled(b if b.ndim == 1 else b[:, k]), share)
            if x is None:
                return None
            column[:] = self._scaled(x)
        return out[:, 0] if b.ndim == 1 else out

    def solve_with_factors(self, b: Array) -> Array:
        """See `Factors`: by GMRES to single precision, with factors of the matrix itself or LU of it where that fails."""
        if not self.by_lu and (x := self._columns(b, SINGLE_EPS)) is not None:
            return x
        if not self.by_lu:
            assert self._A is not None
            if self._own:
                self._give_up("does not solve for another load")
            if (x := self._by_new(lambda _: self._columns(b, SINGLE_EPS))) is not None:
                return x
            values = self._columns_of(self._A)
            self._A = self._solve = None
            self._refuse_lu()
            self.direct.solve(values, b if b.ndim == 1 else b[:, 0])
        return self.direct.solve_with_factors(b)

    def correction(self, b: Array, share: float | None = None) -> Array:
        """See `Factors`."""
        if self.by_lu:
            return self.direct.correction(b, share)
        usual = self.policy.expected_rate
        x = self._columns(b, usual if share is None else min(share, usual))
        return self.solve_with_factors(b) if x is None else x

    def exactly(self, b: Array, share: float) -> Array | None:
        """See `Factors`."""
        return self.direct.exactly(b, share) if self.by_lu else self._columns(b, share)

    # --------------------------------------------------------------------------------------------- what factors show
    @property
    def iterates(self) -> bool:
        """See `Factors`."""
        return not self.by_lu

    @property
    def factored(self) -> bool:
        """See `Factors`."""
        return self.direct.factored if self.by_lu else self._solve is not None

    @property
    def positive(self) -> bool:
        """Whether all eigenvalues have positive real parts: where P is the symmetric part of A and all its pivots are positive.

        Where points slide P leaves out what makes A unsymmetric, and its pivots say nothing of A.
        """
        if self.by_lu:
            return self.direct.positive
        if not (self._symmetric and self._A is not None and getattr(self._solve, "positive", False)):
            return False
        assert self._solve is not None
        # The pivots are believed where the symmetric part itself confirms the softest mode of its factors.
        part = self._A._with_data(0.5 * (self._A.data + self._A.data[self.mirror]), copy=False)
        return self.direct.believed(part, self._solve)

    @property
    def may_resolve_soft_modes(self) -> bool:
        """See `Factors`: P does not resolve the softest modes of A; those are found with A itself (`exactly`)."""
        return self.by_lu and self.direct.may_resolve_soft_modes

    def resolves_soft_modes(self, b: Array, x: Array) -> bool:
        """See `Factors`: what `solve_with_factors` answers is of A itself."""
        return self.direct.resolves_soft_modes(b, x) if self.by_lu else True

    @property
    def holds_matrix(self) -> bool:
        """See `Factors`."""
        return self.direct.holds_matrix if self.by_lu else self._A is not None

    @property
    def follows(self) -> bool:
        """See `Factors`."""
        return self.direct.follows if self.by_lu else True

    def follow(self, values: Array, changed: int) -> None:
        """See `Factors`."""
        if self.by_lu:
            self.direct.follow(values[: self._entries], changed)
        else:
            self._A, self._more, self._own = self._tangent(values), values[self._entries :].copy(), False
            self._symmetric = not self._slides(self._more)

    def coarse(self, values: Array) -> bool:
        """False: factors of P are no factors of A."""
        return False

    def kept(self) -> KeptFactors | None:
        """See `Factors`: of LU alone."""
        return self.direct.kept() if self.by_lu else None

    def detach(self) -> Iterative:
        """See `Factors`."""
        out = copy(self)
        out.direct, out.order, out.fell_back = self.direct.detach(), list(self.order), list(self.fell_back)
        return out


class _Gmres(Protocol):
    """GMRES for a right-hand side (f,) but for a share of it."""

    def __call__(self, r: Array, share: float) -> Array | None:
        """Solution (f,), None where there is none."""
