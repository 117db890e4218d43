"""Static condensation (Schur complement): linear elastic bodies in small strain are factored once, Newton iterates on contact.

The free displacements are u = y + Σ X_j q_j: y is the free response to loads and supports, X_j = K⁻¹ e_j that to a unit force
on contact dof j, q are the forces of the contacts. Of X_j only the rows of contact candidates (C) and the forces on supports
(P) are kept. Columns are computed when contact first reaches them, in blocks of neighbours, by substitutions with many
right-hand sides (no solver here gives a partial factorisation). With A the active set of dofs, those reached so far,

    q = S (u_A − y_A),  S = C_AA⁻¹,

is the stiffness of the bodies as seen from A, their Schur complement, everything else following. Newton, the contact laws and
time stepping are those of any other problem: they see a `Reduced` whose assembly has contact alone, the bodies' forces being
S's, and whose matrix is small and dense.

An attempt starts with the blocks of the points that are closed where it starts; one that touches a point beyond starts
again with its blocks too. So its outcome depends on the committed state alone, bit for bit, not on the way that led there.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import cache, cached_property
from typing import Unpack

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix

from prensa.contact.point import TOUCH
from prensa.errors import PrensaError
from prensa.linear.condensed_bodies import Blocks, Bodies, FreeResponse
from prensa.linear.factorisations import DenseFactors, SingularError
from prensa.linear.reduction import Reduced, equations_of, in_lengths, weights_of
from prensa.linear.rigid_modes import free_to_move
from prensa.model import problem as model
from prensa.model.body_contacts import CONDENSED
from prensa.model.not_in_space import words_of
from prensa.policy import DEFAULT, Policy
from prensa.precision import EPS
from prensa.system.assembly import Pattern
from prensa.system.interaction import Context, Overrides
from prensa.system.matrix_symmetry import is_linear
from prensa.system.outcome import NewtonResult
from prensa.system.planning import plan_step
from prensa.system.schedule import StepPlan
from prensa.system.state import Recovered
from prensa.system.system import Bulk, Evaluation, System
from prensa.types import Array, Flags, Index

log = logging.getLogger("prensa")


# ---------------------------------------------------------------------------------------------------------- whether at all
def refusal(system: System) -> str:
    """Why the bodies cannot be condensed; '' if they can."""
    if model.ever_stabilised(system.problem):
        return "viscous forces ('stabilise') act on all nodes"
    if system.dofs.dimension != 2:
        return words_of("condense")
    if system.problem.body_contacts:
        return CONDENSED
    if system.more:
        return "extensions act on nodes that would be condensed"
    if system.interferes:
        return "overlaps that are meant (interference) move nodes that would be condensed"
    if system.problem.kinematics != "small":
        return "only bodies in small strain ('kinematics: small') are linear"
    for block in system.blocks:
        if not is_linear(block):
            return f"body {block.body!r} is not linear elastic"
    if any(step.control for step in system.problem.steps):
        return "displacement control ('control') is of the whole system"
    start = system.initial()
    for number in range(len(system.problem.steps)):
        plan = plan_step(system, number, start.step_start)
        c = system.context(start, plan, plan.t1)
        for body in system.problem.bodies:
            if words := free_to_move(system, body, c, contacts=False):
                return f"the supports alone leave body {body!r} free to {words} in step {plan.name!r}"
    return ""


def pays(system: System, policy: Policy) -> bool:
    """Whether factorisations and the columns that contact reaches cost less than the factorisations of all iterations."""
    steps = system.problem.steps
    increments = sum(step.increments or policy.usual_increments for step in steps)
    # In columns: what factorisations of all iterations would cost, less one for each step, over what a column costs.
    afford = (policy.factorisations_per_increment * increments - len(steps)) / policy.column_cost_ratio
    if system.ndof < policy.condense_from_dofs or afford < 0:
        return False
    candidates = 2 * sum(len(s.points.nodes) for s in system.surfaces)
    if afford >= candidates:  # which are counted at once
        return True
    # Columns come in whole blocks; one more, because a contact need not begin where a block does.
    blocks = -(-2 * reached(system, policy) // policy.columns_at_once) + 1
    return afford >= min(blocks * policy.columns_at_once, candidates)


def reached(system: System, policy: Policy) -> int:
    """Candidates that contact reaches as far as motions say: under tools that move through the bodies as they are.

    Where something else moves or pushes, all. Bodies give way under a tool, so that contact reaches less far than that.
    """
    start, nodes = system.initial(), 0
    close = [np.zeros(len(s.points.nodes), dtype=bool) for s in system.surfaces]
    for number in range(len(system.problem.steps)):
        plan = plan_step(system, number, start.step_start)
        tools = np.isin(np.arange(system.ndof), plan.fixed)
        for t in np.linspace(plan.t0, plan.t1, policy.reach_samples):
            u = start.u.copy()
            u[plan.fixed] = plan.values(float(t))
            moved = system.displacement(u - start.u).any()
            for s, near in zip(system.surfaces, close):
                driven = tools[system.masters[s.against].dofs].all() and not moved
                near |= s.points.any_at_nodes(system.stencils(s, u).g < 0.0) if driven else True
    for near in close:
        nodes += int(near.sum())
    return nodes


def to_be_condensed(system: System, numerics: model.Numerics, policy: Policy = DEFAULT) -> bool:
    """What ``numerics.condense`` comes to for a system: known from the description alone.

    Raises
    ------
    PrensaError
        If it is asked for and cannot be done.

    """
    if numerics.condense is False or (numerics.condense == "auto" and not pays(system, policy)):
        return False
    reason = refusal(system)
    if reason and numerics.condense is True:
        raise PrensaError(f"numerics.condense: {reason}; leave it out and the whole system is solved")
    return not reason


# --------------------------------------------------------------------------------------------------- what Newton iterates on
class ActiveSetGrew(Exception):
    """Contact at points that the columns at hand do not reach; ``blocks``: all that are needed."""

    def __init__(self, blocks: Blocks) -> None:
        super().__init__()
        self.blocks = blocks


class CondensedMatrix:
    """The free dofs of reached displacements, tools and multipliers, and their dense matrix.

    It is the `Assembly`, the `Restriction` and the `BodyForces` of a condensed system.
    ``A``: places of the ``reached`` displacements among those near contact; ``S`` the bodies' stiffness there. ``beyond``
    (points,): contact points that are not reached, ``idle`` the multipliers of those. Only tools, multipliers, supports and
    reached displacements count in u; the other displacements follow from them.
    """

    def __init__(self, base: Condensation, blocks: Blocks) -> None:
        system, bodies = base.contact, base.bodies
        bodies.compute_columns(blocks)
        self.base, self.bodies, self.blocks = base, bodies, blocks
        self.contact = replace(system, bodies=self)
        self.A = np.flatnonzero(np.isin(bodies.block, sorted(blocks)))
        self.reached, self.C, self.P = bodies.near[self.A], bodies.C[:, self.A], bodies.P[:, self.A]
        C = self.C[self.A]
        # C is symmetric but for the round-off of its substitutions, which the stiffness must not inherit.
        self.S = np.linalg.inv(0.5 * (C + C.T))
        self.columns = np.abs(self.S).sum(axis=0)
        missing: Flags = ~np.isin(np.arange(base.needs.shape[1]), sorted(blocks))
        self.beyond: Flags = np.asarray(base.needs[:, missing].any(axis=1))
        exact = [(np.arange(s.unknowns.start, s.unknowns.stop), s.rows) for s in system.surfaces if s.exact]
        # Multipliers of points that are not reached have no equation here: they are zero, and the attempt is repeated if one
        # touches.
        self.idle = np.concatenate(
            [np.zeros(0, dtype=np.int64), *(k[np.repeat(self.beyond[rows], 2)] for k, rows in exact)]
        )
        others = np.setdiff1d(
            np.arange(system.dofs.displacement.size, system.ndof), np.concatenate([base.fixed, self.idle])
        )
        self.free = self.rows = np.concatenate([self.reached, others])
        # touched dofs from the free ones
        k, a = len(base.touched), len(self.A)
        part = base.by_near[:, self.A].tocoo()
        rows = np.concatenate([part.row, np.searchsorted(base.touched, others)])
        cols = np.concatenate([part.col, a + np.arange(len(others))])
        self.G = csc_matrix((np.concatenate([part.data, np.ones(len(others))]), (rows, cols)), (k, a + len(others)))

    def reduced(self) -> Reduced:
        """The equations that Newton iterates on."""
        base = self.base
        return Reduced(
            base.fixed,
            False,
            self,
            self,
            DenseFactors(base.policy, in_lengths(base.weight[self.free])),
            base.weight[self.free],
            base.equations,
            base.policy,
        )

    # -------------------------------------------------------------------------------------------------------- assembly
    def evaluate(
        self, c: Context, u: Array, lam: Array, stiffness: bool = True, **overrides: Unpack[Overrides]
    ) -> Evaluation:  # fmt: skip
        """As `System.evaluate`; its matrix holds contact alone.

        Raises
        ------
        ActiveSetGrew
            If a point touches that the columns at hand do not reach.

        """
        e = self.contact.evaluate(c, self.recovered(c, u), lam, stiffness, **overrides)
        if not e.failed and (e.touching & self.beyond).any():
            raise ActiveSetGrew(self.blocks | self.base.blocks_of(e.touching))
        return e

    def bulk(self, c: Context, u: Array, r: Array, data: Array | None) -> Bulk:
        """Internal forces on reached and held dofs; all other displacements are in equilibrium. Nothing goes to data."""
        free, q = self.forces(c, u)
        inner, held = q + free.loads[self.A], free.held + self.P @ q
        r[self.reached] += inner
        r[self.bodies.held] += held
        scale = float(np.abs(inner).sum() + np.abs(held).sum())
        # Round-off of S u: what the residual of the small system cannot fall below.
        return Bulk(scale, EPS * float(self.columns @ np.abs(u[self.reached])), ())

    def forces(self, c: Context, u: Array) -> tuple[FreeResponse, Array]:
        """The free response, and the forces q (A,) that put the reached dofs where u has them."""
        free = self.bodies.free_response(c, u[self.bodies.held])
        return free, self.S @ (u[self.reached] - free.near[self.A])

    def recovered(self, c: Context, u: Array) -> Array:
        """Dofs u (ndof,) with all contact candidates where the reached ones take them, and no force on the others."""
        free, q = self.forces(c, u)
        near = free.near + self.C @ q
        near[self.A] = u[self.reached]
        u = u.copy()
        u[self.idle] = 0.0
        u[self.base.nodal] = self.base.by_near @ near + self.base.by_held @ u[self.bodies.held]
        return u

    # ----------------------------------------------------------------------------------------------------- restriction
    def part(self, r: Array) -> Array:
        """Residuals of the free dofs, those of tied nodes with their masters'."""
        return np.asarray(self.G.T @ r[self.base.touched])

    def whole(self, x: Array, n: int) -> Array:
        """Change of all dofs (n,) or (n, k) from that of the free ones; displacements away from contact are left out."""
        out, a = np.zeros((n, *x.shape[1:])), len(self.A)
        near = self.C @ (self.S @ x[:a])
        near[self.A] = x[:a]
        out[self.base.nodal] = self.base.by_near @ near
        out[self.free[a:]] = x[a:]
        return out

    def _contact(self, data: Array) -> csc_matrix:
        return csc_matrix((data, *self.base.entries), (len(self.base.touched),) * 2)

    def apply(self, data: Array, delta: Array) -> Array:
        """K δ on reached, held and touched dofs."""
        out, touched = np.zeros(len(delta)), self.base.touched
        out[touched] = self._contact(data) @ delta[touched]
        free = self.bodies.unloaded(delta[self.bodies.held])
        q = self.S @ (delta[self.reached] - free.near[self.A])
        out[self.reached] += q
        out[self.bodies.held] += free.held + self.P @ q
        return out

    def values(self, data: Array, spent: bool = False) -> Array:
        """K_ff, dense."""
        M = (self.G.T @ self._contact(data) @ self.G).toarray()
        a = len(self.A)
        M[:a, :a] += self.S
        return np.asarray(M)

    def sparse(self, values: Array) -> csc_matrix:
        """See `Restriction`."""
        return csc_matrix(values)


# --------------------------------------------------------------------------------------------------------- for time stepping
class Condensation:
    """A system condensed on the supports of a step.

    ``touched`` (k,): dofs that contact couples, in increasing order: candidates and what they depend on, tools,
    multipliers; the first of them are displacements ``nodal``, which follow from those near contact and from held ones.
    ``needs`` (points, blocks): blocks of columns that a point must have to be in contact.
    """

    def __init__(
        self, system: System, plan: StepPlan, numerics: model.Numerics, policy: Policy = DEFAULT
    ) -> None:  # fmt: skip
        self.policy = policy
        self.fixed, self.bodies = plan.fixed, Bodies(system, plan, numerics, policy)
        bodies, n = self.bodies, system.dofs.displacement.size
        self.nodal = np.union1d(bodies.candidates, bodies.near).astype(np.int64)
        self.touched = np.concatenate([self.nodal, np.arange(n, system.ndof)])
        rows = bodies.follow[self.nodal]
        self.by_near, self.by_held = csc_matrix(rows[:, bodies.near]), csr_matrix(rows[:, bodies.held])
        pattern = self._contact_pattern(system)
        self.contact = replace(
            system, pattern=pattern, _places={}, _volumes={}
        )  # its bodies are put in by `CondensedMatrix`
        self.needs = self._needs(system)
        self.equations, self.weight = equations_of(self.contact, plan.fixed), weights_of(system)
        self._recent: dict[Blocks, CondensedMatrix] = {}
        self.reduced = self.on(frozenset()).reduced()
        log.info(
            "bodies condensed: %d displacements factored once, %d of them near contact",
            len(bodies.free),
            len(bodies.near),
        )

    def _contact_pattern(self, system: System) -> Pattern:
        """The pattern of the matrix without all that contact does not touch; ``entries``: the same among touched dofs."""
        count = np.zeros(system.ndof, dtype=np.int64)
        places, ends, indptr, rows = [], [0], system.pattern.indptr, system.pattern.indices
        for dof in self.touched:
            column = rows[indptr[dof] : indptr[dof + 1]]
            at = np.searchsorted(self.touched, column)
            at = at[self.touched.take(at, mode="clip") == column]
            places.append(at)
            count[dof] = len(at)
            ends.append(ends[-1] + len(at))
        at = np.concatenate([np.zeros(0, dtype=np.int64), *places])
        self.entries = at.astype(np.int32), np.array(ends, dtype=np.int32)
        indptr = np.concatenate([[0], np.cumsum(count)]).astype(np.int32)
        return Pattern(system.ndof, indptr, self.touched[at].astype(np.int32))

    def _needs(self, system: System) -> Flags:
        """Blocks of columns (points, blocks) that contact points depend on."""
        bodies = self.bodies
        blocks = int(bodies.block.max(initial=-1)) + 1
        of = np.zeros((len(self.nodal), blocks), dtype=bool)
        link = self.by_near.tocoo()
        of[link.row, bodies.block[link.col]] = True
        needs: Flags = np.zeros((sum(len(s.points) for s in system.surfaces), blocks), dtype=bool)
        for s in system.surfaces:
            for node, N in zip(s.points.support.T, s.points.N.T):
                for axis in range(2):
                    # A cut at a sharp corner gives weight to neighbours whose N is zero until then.
                    needs[s.rows] |= of[np.searchsorted(self.nodal, 2 * node + axis)] & ((N != 0) | s.sharp)[:, None]
        return needs

    def blocks_of(self, points: Flags) -> Blocks:
        """Blocks that the given contact points (all,) need."""
        return frozenset(np.flatnonzero(self.needs[points].any(axis=0)).tolist())

    def on(self, blocks: Blocks) -> CondensedMatrix:
        """The condensed system on some blocks of columns."""
        if blocks not in self._recent:
            small = CondensedMatrix(self, blocks)
            # Two dense inverses at most: that of the blocks that an attempt begins with, and the larger one that it may end
            # with.
            self._recent = dict(list(self._recent.items())[-1:]) | {blocks: small}
        return self._recent[blocks]

    @cached_property
    def _beside(self) -> tuple[Index, Index]:
        """Dofs (k,) of outlines that are not known within a step, and those of the nearest nodes of the same body that are."""
        from scipy.spatial import cKDTree

        system, known = self.bodies.system, np.union1d(self.nodal, self.bodies.held)
        dofs, nearest = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        for body, mesh in system.meshes.items():
            nodes = system.nodes_of(body)
            for axis in range(2):
                own = np.flatnonzero(np.isin(2 * nodes + axis, known))
                left = np.setdiff1d(mesh.boundary, own)
                if len(own) and len(left):
                    near = own[cKDTree(mesh.points[own]).query(mesh.points[left])[1]]
                    dofs.append(2 * nodes[left] + axis)
                    nearest.append(2 * nodes[near] + axis)
        return np.concatenate(dofs), np.concatenate(nearest)

    def outlined(self, u: Array) -> Array:
        """Degrees of freedom (ndof,) that are good enough to look whether a tool comes near an outline.

        u are those of an increment whose displacements are known where contact needs them alone: other nodes of the outline
        are taken to have gone with the nearest of these, not to stand where they stood when the step began.
        """
        dofs, nearest = self._beside
        out = u.copy()
        out[dofs] = u[nearest]
        return out

    def attempt(
        self, solve: Callable[[Reduced], NewtonResult], c: Context, start: Array,
        timed: Callable[[str], AbstractContextManager[None]],
    ) -> NewtonResult:  # fmt: skip
        """Outcome of an attempt from degrees of freedom ``start`` (ndof,): ``solve`` on the condensed system.

        ``timed``: context manager of a section of the run, for its seconds.
        """
        touching: Flags = c.state.contact.closed.copy()
        for s, scale in zip(self.contact.surfaces, c.scales):  # a pushed tool has been brought to rest on some points
            touching[s.rows] |= self.contact.stencils(s, start).g <= TOUCH * scale.h
        blocks = self.blocks_of(touching)
        while True:
            with timed("condensation"):
                small = self.on(blocks)
                self.reduced = small.reduced()
            try:
                result = solve(self.reduced)
            except ActiveSetGrew as grown:
                # It ends: blocks are only added, and there are finitely many.
                blocks = grown.blocks
                continue
            if result.converged:
                self._complete(small, c, result)
            return result

    def _complete(self, small: CondensedMatrix, c: Context, result: NewtonResult) -> None:
        """Put what the next increment needs where the contact forces take it, and leave the rest to those who ask for it.

        The rest stays where the last increment had it. Where loads act on the bodies, or supports have just been released, it is
        put in its place at once: the work of those forces is needed.
        """
        assert result.evaluation is not None
        e, bodies, system = result.evaluation, self.bodies, self.bodies.system
        near, held = small.recovered(c, result.u), result.u[bodies.held]
        f = e.f_ext.copy()
        for s, forces in zip(system.surfaces, e.contacts):
            np.add.at(f, s.dofs, forces.F)
        f = system.to_masters(f)

        @cache
        def whole() -> Array:
            u = near.copy()
            u[bodies.free] = bodies.solved(f[bodies.free] - bodies.K_pf.T @ held)
            u[bodies.near] = near[bodies.near]
            return system.with_slaves(u)

        def histories() -> Sequence[Array]:
            return system.bulk(c, whole(), np.zeros(system.ndof), None).history

        if bodies.loaded(c) or c.state.work[bodies.free].any():
            result.u = whole()
        else:
            result.u, result.recover = c.state.u.copy(), whole
            kept = np.concatenate([self.touched, bodies.held])
            result.u[kept] = near[kept]
        free, q = small.forces(c, near)
        # Clapeyron: linear bodies hold half of what the forces at their end would do, so no element is visited for their
        # energy.
        energy = 0.5 * float(result.u[bodies.free] @ f[bodies.free] + held @ (free.held + small.P @ q))
        result.evaluation = e._replace(history=Recovered(histories, energy))


def condensed(
    system: System, plan: StepPlan, numerics: model.Numerics, before: Condensation | None, policy: Policy
) -> Condensation | None:
    """The condensation for a step, that of the step before where the supports are the same; None if K is singular."""
    if before is not None and np.array_equal(before.fixed, plan.fixed):
        return before
    try:
        return Condensation(system, plan, numerics, policy)
    except SingularError as error:
        log.info("the bodies are not condensed: %s", error)
        return None
