"""Linear elastic bodies on the supports of a step: free responses, and the columns of the inverse at contact candidates."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, identity

from prensa.errors import SolveError
from prensa.linear.factorisations import Factorisation, SingularError
from prensa.linear.threads import threads_of
from prensa.model import problem as model
from prensa.policy import Policy
from prensa.system.interaction import Context
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array

Blocks = frozenset[int]


class FreeResponse(NamedTuple):
    """To loads and supports, without contact: displacements y (a,) and loads (a,) near contact, forces (p,) on held dofs."""

    near: Array
    loads: Array
    held: Array


class Bodies:
    """The bodies on the supports of a step: K factored once, columns of its inverse computed as they are asked for.

    Displacement dofs are ``free`` (f,) or ``held`` (p,), those of tied slaves neither. ``near`` (a,) are the free ones
    that contact candidates depend on, in order along the surfaces; ``block`` (a,) the block of each.
    """

    def __init__(self, system: System, plan: StepPlan, numerics: model.Numerics, policy: Policy) -> None:
        self.system, self.policy, n = system, policy, system.dofs.displacement.size
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
            threads_of(numerics, system.ndof, policy),
            symmetric=True,
            definite=True,
            policy=policy,
        )
        # Any right-hand side makes the factors; that of a known solution tests them on the way, before columns are believed.
        self.factorisation.solve(self.K.data, self.K @ np.ones(len(self.free)))
        number = np.full(n, -1, dtype=np.int64)
        number[self.free] = np.arange(len(self.free))
        dofs = [(2 * s.points.nodes[:, None] + np.arange(2)).ravel() for s in system.surfaces]
        self.candidates = np.concatenate([np.zeros(0, dtype=np.int64), *dofs])
        masters = self.follow[self.candidates].indices
        masters = masters[number[masters] >= 0]
        # In order of first appearance along the surfaces, not of their numbers: a block of columns is then a stretch of
        # neighbours, and a contact reaches few blocks.
        self.near = masters[np.sort(np.unique(masters, return_index=True)[1])].astype(np.int64)
        self.places = number[self.near]
        a, width = len(self.near), max(1, min(policy.columns_at_once, policy.column_room // max(len(self.free), 1)))
        self.block = np.arange(a) // width
        self.known: set[int] = set()
        self.C, self.P = np.zeros((a, a), order="F"), np.zeros((len(self.held), a), order="F")
        self._responses: dict[tuple[Any, ...], FreeResponse] = {}

    def _stiffness(self, plan: StepPlan) -> csc_matrix:
        """Stiffness (n, n) of the bodies in the displacements, what belongs to tied nodes handed over to their masters."""
        system, n, zero = self.system, self.system.dofs.displacement.size, np.zeros(self.system.ndof)
        pattern, data = system.pattern, np.zeros(system.pattern.entries)
        c = system.context(system.initial(), plan, plan.t1)
        if failed := system.bulk(c, zero, zero.copy(), data).failed:
            raise SingularError(str(failed))
        K = csc_matrix((data, pattern.indices, pattern.indptr), (pattern.n, pattern.n))[:, :n][:n]
        return K if system.ties is None else csc_matrix(self.follow.T @ K @ self.follow)

    def solved(self, b: Array) -> Array:
        """K⁻¹ b of b (f,) or (f, k), its residual checked and refined; of several columns that of their sum.

        Raises
        ------
        SolveError
            If the factors do not give an acceptable residual.

        """
        x = self.factorisation.solve_with_factors(b) if len(b) else b
        for _ in range(self.policy.max_refinements):
            # One product with K for a whole block of columns: what is wrong with any of them is in their sum.
            given, found = (b, x) if b.ndim == 1 else (b.sum(axis=1), x.sum(axis=1))
            missing = np.abs(given - self.K @ found).max(initial=0.0)
            error = missing / (self.size * np.abs(found).max(initial=0.0) + np.abs(given).max(initial=0.0) + 1e-300)
            if not error > self.policy.refine_backward_error:
                break
            x = x + self.factorisation.solve_with_factors(b - self.K @ x)
        if not error <= self.policy.max_backward_error:
            raise SolveError(
                f"the bodies could not be condensed (backward error {error:.1e}); what to try: numerics: {{condense: false}}"
            )
        return x

    def compute_columns(self, blocks: Blocks) -> None:
        """Compute the columns of blocks: each as a whole, so that its numbers do not depend on when that is."""
        for block in sorted(blocks - self.known):
            columns = np.flatnonzero(self.block == block)
            b = np.zeros((len(self.free), len(columns)), order="F")
            b[self.places[columns], np.arange(len(columns))] = 1.0
            x = self.solved(b)
            self.C[:, columns] = x[self.places]
            self.P[:, columns] = self.K_pf @ x
            self.known.add(block)

    def free_response(self, c: Context, held: Array) -> FreeResponse:
        """The bodies without contact under the loads of an increment's end, with the held dofs at ``held`` (p,)."""
        # Newton, line search and predictor ask for the same times again and again; each answer costs a substitution of the
        # whole bodies.
        key = c.plan.number, c.time, held.tobytes()
        if key not in self._responses:
            while len(self._responses) >= self.policy.kept_responses:
                del self._responses[next(iter(self._responses))]
            self._responses[key] = self.unloaded(held, self._loads(c))
        return self._responses[key]

    def unloaded(self, held: Array, loads: Array | None = None) -> FreeResponse:
        """As `free_response`, with loads (n,) on the displacements or with none."""
        if loads is None and not held.any():
            return FreeResponse(np.zeros(len(self.near)), np.zeros(len(self.near)), np.zeros(len(self.held)))
        f = np.zeros(self.system.dofs.displacement.size) if loads is None else loads
        y = self.solved(f[self.free] - self.K_pf.T @ held)
        return FreeResponse(y[self.places], f[self.near], self.K_pf @ y + self.K_pp @ held)

    def loaded(self, c: Context) -> bool:
        """Whether loads may act on the bodies."""
        return bool(c.plan.loads or c.plan.body_force or c.state.release is not None)

    def _loads(self, c: Context) -> Array | None:
        if not self.loaded(c):
            return None
        f = self.system.external(c, np.zeros(self.system.ndof))
        return self.system.to_masters(f)[: self.system.dofs.displacement.size]
