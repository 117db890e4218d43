"""Linear elastic bodies in small strain: factored once, and the contact history iterates on the unknowns that it touches.

The free displacements are u = y + Σ X_j q_j: y answers to loads and supports, X_j = K⁻¹ e_j to a unit force on contact unknown
j, q are the forces of the contacts. Of X_j only the rows of contact candidates (C) and the forces on supports (P) are
kept. Columns are made when contact first reaches them, in blocks of neighbours, by substitutions with many right-hand
sides (no solver here gives a partial factorisation). With A the unknowns reached so far,

    q = S (u_A − y_A),  S = C_AA⁻¹,

is the stiffness of the bodies as seen from A, everything else following. Newton, the contact laws and the march are those
of any other problem: they see a `System` whose bodies answer by S, and a `Reduced` whose matrix is small and dense.

An attempt starts with the blocks of the points that are closed where it starts; one that touches a point beyond starts
again with its blocks too. So its outcome depends on the committed state alone, bit for bit, not on the way that led there.
"""

from __future__ import annotations

import copy
import logging
from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse import csc_matrix, csr_matrix, identity

from prensa.contact.forces import TOUCH
from prensa.errors import PrensaError, SolveError
from prensa.fem.assembly import Pattern
from prensa.fem.modes import free_to_move
from prensa.fem.schedule import StepPlan, plan_step
from prensa.fem.state import Recovered
from prensa.fem.symmetry import is_linear
from prensa.fem.system import EPS, Bulk, Circumstances, Evaluation, System
from prensa.model import problem as model
from prensa.solver.linear import BACKWARD_ERROR, REFINE, Factorisation, SingularError
from prensa.solver.multipliers import determined
from prensa.solver.newton import Reduced, Reporter, Trial, equations_of, weights_of

log = logging.getLogger("prensa")
Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]
Blocks = frozenset[int]

BLOCK = 64  # columns made at once …
ROOM = 2**25  # … at most so many numbers of them
KEPT = 4  # answers to loads and supports that are kept: an increment asks for two again and again
WORTH = 5000  # unknowns from which on factorisations cost enough to be saved
COLUMN = 0.012  # cost of a column, in factorisations
EACH = 2.5  # factorisations that an increment costs otherwise
SOME = 10  # increments of a step that chooses its own


# ---------------------------------------------------------------------------------------------------------- whether at all
def refusal(system: System) -> str:
    """Why the bodies cannot be condensed; '' if they can."""
    if system.problem.kinematics != "small":
        return "only bodies in small strain ('kinematics: small') are linear"
    for block in system.blocks:
        if not is_linear(block):
            return f"body {block.body!r} is not linear elastic"
    start = system.initial()
    for number in range(len(system.problem.steps)):
        plan = plan_step(system, number, start.anchor)
        c = system.circumstances(start, plan, plan.t1)
        for body in system.problem.bodies:
            if words := free_to_move(system, body, c, contacts=False):
                return f"the supports alone leave body {body!r} free to {words} in step {plan.name!r}"
    return ""


def pays(system: System) -> bool:
    """Whether factorisations and the columns of all candidates cost less than the factorisations of all iterations."""
    steps = system.problem.steps
    increments = sum(step.increments or SOME for step in steps)
    columns = sum(2 * len(s.points.nodes) for s in system.surfaces)
    return system.ndof >= WORTH and EACH * increments >= len(steps) + COLUMN * columns


def to_be_condensed(system: System, numerics: model.Numerics) -> bool:
    """What ``numerics.condense`` comes to for a system: known from the description alone.

    Raises
    ------
    PrensaError
        If it is asked for and cannot be done.

    """
    if numerics.condense is False or (numerics.condense == "auto" and not pays(system)):
        return False
    reason = refusal(system)
    if reason and numerics.condense is True:
        raise PrensaError(f"numerics.condense: {reason}; leave it out and the whole system is solved")
    return not reason


# -------------------------------------------------------------------------------------------------------------- the bodies
class Answer(NamedTuple):
    """To loads and supports, without contact: displacements y (a,) and loads (a,) near contact, forces (p,) on held unknowns."""

    near: Array
    loads: Array
    held: Array


class Bodies:
    """The bodies on the supports of a step: K factored once, columns of its inverse as they are asked for.

    Displacement unknowns are ``free`` (f,) or ``held`` (p,), those of tied slaves neither. ``near`` (a,) are the free ones
    that contact candidates depend on, in order along the surfaces; ``block`` (a,) the block of each.
    """

    def __init__(self, system: System, plan: StepPlan, numerics: model.Numerics) -> None:
        self.system, n = system, 2 * system.nodes
        self.follow = csr_matrix(identity(n)) if system.ties is None else system.ties.matrix
        own = self.follow.diagonal() != 0
        self.held = plan.fixed[plan.fixed < n]
        own[self.held] = False
        self.free = np.flatnonzero(own)
        K = self._stiffness(plan)
        self.K = csc_matrix(K[:, self.free][self.free])
        self.K.sort_indices()
        rows = csr_matrix(K[self.held])
        self.K_pf, self.K_pp = csr_matrix(rows[:, self.free]), csr_matrix(rows[:, self.held])
        del K, rows
        self.size = float(abs(self.K).sum(axis=0).max()) if self.K.nnz else 0.0
        self.factorisation = Factorisation(
            len(self.free),
            self.K.indptr,
            self.K.indices,
            numerics.solver,
            numerics.threads,
            symmetric=True,
            definite=True,
        )
        self.factorisation.solve(self.K.data, self.K @ np.ones(len(self.free)))
        number = np.full(n, -1, dtype=np.int64)
        number[self.free] = np.arange(len(self.free))
        dofs = [(2 * s.points.nodes[:, None] + np.arange(2)).ravel() for s in system.surfaces]
        self.candidates = np.concatenate([np.zeros(0, dtype=np.int64), *dofs])
        masters = self.follow[self.candidates].indices
        masters = masters[number[masters] >= 0]
        self.near = masters[np.sort(np.unique(masters, return_index=True)[1])].astype(np.int64)
        self.places = number[self.near]
        a, width = len(self.near), max(1, min(BLOCK, ROOM // max(len(self.free), 1)))
        self.block = np.arange(a) // width
        self.known: set[int] = set()
        self.C, self.P = np.zeros((a, a), order="F"), np.zeros((len(self.held), a), order="F")
        self._answers: dict[tuple[Any, ...], Answer] = {}

    def _stiffness(self, plan: StepPlan) -> csc_matrix:
        """Stiffness (n, n) of the bodies in the displacements, what belongs to tied nodes handed over to their masters."""
        system, n, zero = self.system, 2 * self.system.nodes, np.zeros(self.system.ndof)
        pattern, data = system.pattern, np.zeros(len(system.pattern.indices))
        c = system.circumstances(system.initial(), plan, plan.t1)
        if failed := system.bulk(c, zero, zero.copy(), data).failed:
            raise SingularError(failed)
        K = csc_matrix((data, pattern.indices, pattern.indptr), (pattern.n, pattern.n))[:, :n][:n]
        return K if system.ties is None else csc_matrix(self.follow.T @ K @ self.follow)

    def solved(self, b: Array) -> Array:
        """K⁻¹ b of b (f,) or (f, k), its residual checked and refined; of several columns that of their sum.

        Raises
        ------
        SolveError
            If the factors do not give an acceptable residual.

        """
        x = self.factorisation.again(b) if len(b) else b
        for _ in range(3):
            given, found = (b, x) if b.ndim == 1 else (b.sum(axis=1), x.sum(axis=1))
            missing = np.abs(given - self.K @ found).max(initial=0.0)
            error = missing / (self.size * np.abs(found).max(initial=0.0) + np.abs(given).max(initial=0.0) + 1e-300)
            if not error > REFINE:
                break
            x = x + self.factorisation.again(b - self.K @ x)
        if not error <= BACKWARD_ERROR:
            raise SolveError(
                f"the bodies could not be condensed (backward error {error:.1e}); what to try: numerics: {{condense: false}}"
            )
        return x

    def learn(self, blocks: Blocks) -> None:
        """Make the columns of blocks: each as a whole, so that its numbers do not depend on when that is."""
        for block in sorted(blocks - self.known):
            columns = np.flatnonzero(self.block == block)
            b = np.zeros((len(self.free), len(columns)), order="F")
            b[self.places[columns], np.arange(len(columns))] = 1.0
            x = self.solved(b)
            self.C[:, columns] = x[self.places]
            self.P[:, columns] = self.K_pf @ x
            self.known.add(block)

    def answer(self, c: Circumstances, held: Array) -> Answer:
        """The bodies without contact under the loads of an increment's end, with the held unknowns at ``held`` (p,)."""
        key = c.plan.number, c.time, held.tobytes()
        if key not in self._answers:
            while len(self._answers) >= KEPT:
                del self._answers[next(iter(self._answers))]
            self._answers[key] = self.unloaded(held, self._loads(c))
        return self._answers[key]

    def unloaded(self, held: Array, loads: Array | None = None) -> Answer:
        """As `answer`, with loads (n,) on the displacements or with none."""
        if loads is None and not held.any():
            return Answer(np.zeros(len(self.near)), np.zeros(len(self.near)), np.zeros(len(self.held)))
        f = np.zeros(2 * self.system.nodes) if loads is None else loads
        y = self.solved(f[self.free] - self.K_pf.T @ held)
        return Answer(y[self.places], f[self.near], self.K_pf @ y + self.K_pp @ held)

    def loaded(self, c: Circumstances) -> bool:
        """Whether loads may act on the bodies."""
        return bool(c.plan.loads or c.plan.body_force or self.system.release is not None)

    def _loads(self, c: Circumstances) -> Array | None:
        if not self.loaded(c):
            return None
        f = self.system.external(c, np.zeros(self.system.ndof), None)
        return self.system.collected(f)[: 2 * self.system.nodes]


# --------------------------------------------------------------------------------------------------- what Newton iterates on
class Beyond(Exception):
    """Contact at points that the columns at hand do not reach; ``blocks``: all that are needed."""

    def __init__(self, blocks: Blocks) -> None:
        super().__init__()
        self.blocks = blocks


class CondensedSystem(System):
    """The system with bodies that answer by their stiffness at the unknowns that contact reaches.

    Its pattern holds contact alone. Of the unknowns only those of tools, multipliers, supports and reached displacements
    count; the other displacements follow from them.
    """

    small: Small

    def evaluate(self, c: Circumstances, u: Array, lam: Array, *args: Any, **more: Any) -> Evaluation:
        """As `System.evaluate`.

        Raises
        ------
        Beyond
            If a point touches that the columns at hand do not reach.

        """
        e = super().evaluate(c, self.small.placed(c, u), lam, *args, **more)
        if not e.failed:
            self.small.watch(e)
        return e

    def bulk(self, c: Circumstances, u: Array, r: Array, data: Array | None) -> Bulk:
        """Internal forces on reached and held unknowns; all other displacements are in equilibrium. Nothing goes to data."""
        small, bodies = self.small, self.small.bodies
        answer, q = small.forces(c, u)
        inner, held = q + answer.loads[small.A], answer.held + small.P @ q
        r[small.reached] += inner
        r[bodies.held] += held
        scale = float(np.abs(inner).sum() + np.abs(held).sum())
        return Bulk(scale, EPS * float(small.columns @ np.abs(u[small.reached])), ())


class Dense:
    """Factors of a dense matrix, with the interface that attempts use of `Factorisation`."""

    def __init__(self) -> None:
        self._factors: tuple[Array, Any] | None = None

    def begin(self) -> None:
        """Forget the factors of earlier attempts."""
        self._factors = None

    @property
    def factored(self) -> bool:
        """Whether there are factors to use `again`."""
        return self._factors is not None

    def again(self, b: Array) -> Array:
        """Solution with the factors of the last `solve`."""
        assert self._factors is not None
        return np.asarray(dgetrs(*self._factors, b)[0]) if len(b) else b

    def solve(self, M: Array, b: Array) -> Array:
        """Solution of M x = b, refined once; raises `SingularError`."""
        if not len(b):
            return b
        if not np.isfinite(M).all():
            raise SingularError("the matrix has entries that are not numbers")
        lu, pivots, info = dgetrf(M)
        if info > 0:
            raise SingularError("a pivot is zero")
        self._factors = lu, pivots
        x = self.again(b)
        x = x + self.again(b - M @ x)
        norm = np.abs(M).sum(axis=1).max()
        error = np.abs(b - M @ x).max() / (norm * np.abs(x).max() + np.abs(b).max() + 1e-300)
        if not error <= BACKWARD_ERROR:
            self._factors = None
            raise SingularError(f"backward error {error:.1e}")
        return x


class Small(Reduced):
    """The free unknowns of reached displacements, tools and multipliers, their dense matrix, and the system they belong to.

    ``A``: places of the ``reached`` displacements among those near contact; ``S`` the bodies' stiffness there. ``beyond``
    (points,): contact points that are not reached, ``idle`` the multipliers of those.
    """

    def __init__(self, base: Condensation, blocks: Blocks) -> None:
        system, bodies = base.system, base.bodies
        n = 2 * system.nodes
        bodies.learn(blocks)
        self.system = copy.copy(system)
        self.system.small = self
        self.base, self.bodies, self.blocks = base, bodies, blocks
        self.fixed, self.symmetric, self.tied = base.fixed, False, None
        self.A = np.flatnonzero(np.isin(bodies.block, sorted(blocks)))
        self.reached, self.C, self.P = bodies.near[self.A], bodies.C[:, self.A], bodies.P[:, self.A]
        C = self.C[self.A]
        self.S = np.linalg.inv(0.5 * (C + C.T))
        self.columns = np.abs(self.S).sum(axis=0)
        missing: Flags = ~np.isin(np.arange(base.needs.shape[1]), sorted(blocks))
        self.beyond: Flags = np.asarray(base.needs[:, missing].any(axis=1))
        exact = [(np.arange(s.unknowns.start, s.unknowns.stop), s.rows) for s in system.surfaces if s.exact]
        self.idle = np.concatenate(
            [np.zeros(0, dtype=np.int64), *(k[np.repeat(self.beyond[rows], 2)] for k, rows in exact)]
        )
        others = np.setdiff1d(np.arange(n, system.ndof), np.concatenate([self.fixed, self.idle]))
        self.free = np.concatenate([self.reached, others])
        # touched unknowns from the free ones
        k, a = len(base.touched), len(self.A)
        part = base.by_near[:, self.A].tocoo()
        rows = np.concatenate([part.row, np.searchsorted(base.touched, others)])
        cols = np.concatenate([part.col, a + np.arange(len(others))])
        self.G = csc_matrix((np.concatenate([part.data, np.ones(len(others))]), (rows, cols)), (k, a + len(others)))
        self.weight, self.equations = base.weight[self.free], base.equations
        self.factorisation: Any = Dense()

    def forces(self, c: Circumstances, u: Array) -> tuple[Answer, Array]:
        """The answer without contact, and the forces q (A,) that put the reached unknowns where u has them."""
        answer = self.bodies.answer(c, u[self.bodies.held])
        return answer, self.S @ (u[self.reached] - answer.near[self.A])

    def placed(self, c: Circumstances, u: Array) -> Array:
        """Unknowns u (ndof,) with all contact candidates where the reached ones take them, and no force on the others."""
        answer, q = self.forces(c, u)
        near = answer.near + self.C @ q
        near[self.A] = u[self.reached]
        u = u.copy()
        u[self.idle] = 0.0
        u[self.base.nodal] = self.base.by_near @ near + self.base.by_held @ u[self.bodies.held]
        return u

    def watch(self, e: Evaluation) -> None:
        """Raise `Beyond` if a point touches that the columns do not reach."""
        if (e.touching & self.beyond).any():
            raise Beyond(self.blocks | self.base.blocks_of(e.touching))

    # ------------------------------------------------------------------------------------------------ as of any `Reduced`
    def part(self, r: Array) -> Array:
        """Residuals of the free unknowns, those of tied nodes with their masters'."""
        return np.asarray(self.G.T @ r[self.base.touched])

    def whole(self, x: Array, n: int) -> Array:
        """Change of all unknowns (n,) from that of the free ones; displacements away from contact are left out."""
        out, a = np.zeros(n), len(self.A)
        near = self.C @ (self.S @ x[:a])
        near[self.A] = x[:a]
        out[self.base.nodal] = self.base.by_near @ near
        out[self.free[a:]] = x[a:]
        return out

    def _contact(self, data: Array) -> csc_matrix:
        return csc_matrix((data, *self.base.entries), (len(self.base.touched),) * 2)

    def apply(self, data: Array, delta: Array) -> Array:
        """K δ on reached, held and touched unknowns."""
        out, touched = np.zeros(len(delta)), self.base.touched
        out[touched] = self._contact(data) @ delta[touched]
        answer = self.bodies.unloaded(delta[self.bodies.held])
        q = self.S @ (delta[self.reached] - answer.near[self.A])
        out[self.reached] += q
        out[self.bodies.held] += answer.held + self.P @ q
        return out

    def matrix(self, e: Evaluation, b: Array) -> Array:
        """K_ff, dense."""
        assert e.data is not None
        data = determined(e, b, self.equations) if self.equations else e.data
        M = (self.G.T @ self._contact(data) @ self.G).toarray()
        a = len(self.A)
        M[:a, :a] += self.S
        return np.asarray(M)


# --------------------------------------------------------------------------------------------------------- for the march
class Condensation:
    """A system condensed on the supports of a step.

    ``touched`` (k,): unknowns that contact couples, in increasing order: candidates and what they depend on, tools,
    multipliers; the first of them are displacements ``nodal``, which follow from those near contact and from held ones.
    ``needs`` (points, blocks): blocks of columns that a point must have to be in contact.
    """

    def __init__(self, system: System, plan: StepPlan, numerics: model.Numerics) -> None:
        self.fixed, self.bodies = plan.fixed, Bodies(system, plan, numerics)
        bodies, n = self.bodies, 2 * system.nodes
        self.nodal = np.union1d(bodies.candidates, bodies.near).astype(np.int64)
        self.touched = np.concatenate([self.nodal, np.arange(n, system.ndof)])
        rows = bodies.follow[self.nodal]
        self.by_near, self.by_held = csc_matrix(rows[:, bodies.near]), csr_matrix(rows[:, bodies.held])
        # the places of contact in the matrix: the pattern without all the rest
        count = np.zeros(system.ndof, dtype=np.int64)
        places, ends = [], [0]
        for dof in self.touched:
            column = system.pattern.indices[system.pattern.indptr[dof] : system.pattern.indptr[dof + 1]]
            at = np.searchsorted(self.touched, column)
            at = at[self.touched.take(at, mode="clip") == column]
            places.append(at)
            count[dof] = len(at)
            ends.append(ends[-1] + len(at))
        at = np.concatenate([np.zeros(0, dtype=np.int64), *places])
        self.entries = at.astype(np.int32), np.array(ends, dtype=np.int32)
        indptr = np.concatenate([[0], np.cumsum(count)]).astype(np.int32)
        pattern = Pattern(system.ndof, indptr, self.touched[at].astype(np.int32))
        given = {f.name: getattr(system, f.name) for f in fields(system)}
        self.system = CondensedSystem(**given | {"pattern": pattern, "_edge_slots": {}})
        blocks = int(bodies.block.max(initial=-1)) + 1
        of = np.zeros((len(self.nodal), blocks), dtype=bool)
        link = self.by_near.tocoo()
        of[link.row, bodies.block[link.col]] = True
        self.needs = np.zeros((sum(len(s.points) for s in system.surfaces), blocks), dtype=bool)
        for s in system.surfaces:
            for node, N in zip(s.points.support.T, s.points.N.T):
                for axis in range(2):
                    self.needs[s.rows] |= of[np.searchsorted(self.nodal, 2 * node + axis)] & (N != 0)[:, None]
        self.equations, self.weight = equations_of(self.system, plan.fixed), weights_of(system)
        self._recent: dict[Blocks, Small] = {}
        self.last = self.on(frozenset())
        log.info(
            "bodies condensed: %d displacements factored once, %d of them near contact",
            len(bodies.free),
            len(bodies.near),
        )

    def blocks_of(self, points: Flags) -> Blocks:
        """Blocks that the given contact points (all,) need."""
        return frozenset(np.flatnonzero(self.needs[points].any(axis=0)).tolist())

    def on(self, blocks: Blocks) -> Small:
        """The condensed system on some blocks of columns."""
        if blocks not in self._recent:
            small = Small(self, blocks)
            self._recent = dict(list(self._recent.items())[-1:]) | {blocks: small}
        return self._recent[blocks]

    def attempt(
        self, solve: Callable[..., Trial], c: Circumstances, start: Array, numerics: model.Numerics, report: Reporter,
        soften: bool,
    ) -> Trial:  # fmt: skip
        """Outcome of an attempt ``solve`` on the condensed system."""
        touching: Flags = c.state.contact[:, 3] > 0
        for s, scale in zip(self.system.surfaces, c.scales):  # a pushed tool has been brought to rest on some points
            touching[s.rows] |= self.system.pairs(s, start).g <= TOUCH * scale.h
        blocks = self.blocks_of(touching)
        while True:
            with report.timed("condensation"):
                small = self.last = self.on(blocks)
            try:
                trial = solve(small.system, c, small, start, numerics, report, soften)
            except Beyond as beyond:
                blocks = beyond.blocks
                continue
            if trial.converged:
                self._complete(small, c, trial)
            return trial

    def _complete(self, small: Small, c: Circumstances, trial: Trial) -> None:
        """Put what the next increment needs where the contact forces take it, and leave the rest to those who ask for it.

        The rest stays where the last increment had it. Where loads act on the bodies, or supports have just let go, it is put
        in its place at once: the work of those forces is needed.
        """
        assert trial.evaluation is not None
        e, bodies, system = trial.evaluation, self.bodies, self.bodies.system
        near, held = small.placed(c, trial.u), trial.u[bodies.held]
        f = e.f_ext.copy()
        for s, forces in zip(system.surfaces, e.contacts):
            np.add.at(f, s.dofs, s.points.spread(forces.F, forces.K)[0])
        f = system.collected(f)

        @cache
        def whole() -> Array:
            u = near.copy()
            u[bodies.free] = bodies.solved(f[bodies.free] - bodies.K_pf.T @ held)
            u[bodies.near] = near[bodies.near]
            return system.followed(u)

        def histories() -> Any:
            return system.bulk(c, whole(), np.zeros(system.ndof), None).history

        if bodies.loaded(c) or c.state.work[bodies.free].any():
            trial.u = whole()
        else:
            trial.u, trial.recover = c.state.u.copy(), whole
            kept = np.concatenate([self.touched, bodies.held])
            trial.u[kept] = near[kept]
        answer, q = small.forces(c, near)
        energy = 0.5 * float(trial.u[bodies.free] @ f[bodies.free] + held @ (answer.held + small.P @ q))
        trial.evaluation = e._replace(history=Recovered(histories, energy))


def condensed(
    system: System, plan: StepPlan, numerics: model.Numerics, before: Condensation | None
) -> Condensation | None:
    """The condensation for a step, that of the step before where the supports are the same; None if K is singular."""
    if before is not None and np.array_equal(before.fixed, plan.fixed):
        return before
    try:
        return Condensation(system, plan, numerics)
    except SingularError as error:
        log.info("the bodies are not condensed: %s", error)
        return None
