"""Equilibrium of a few nodes that alone miss it, with all others held (nonlinear elimination).

Where flow begins or turns in a few elements, the tangent of an iterate leads far beyond there and Newton's method takes as many
iterations as those elements need, each with a factorisation of everything. Equations of their own nodes, which are few, are
solved first (Lanzkron, Rose and Wilkes 1996; Cai and Li 2011); the next step has the rest to do. The iterate is another one, the
equations and what counts as converged are the same.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from prensa.linear.reduction import Selected
from prensa.solver.equilibrium import Equilibrium
from prensa.system.assembly import Pattern
from prensa.system.system import Evaluation, System
from prensa.types import Array, Index


class Evaluate(Protocol):
    """What evaluates dofs (ndof,) and multipliers, with a matrix that goes as far as ``secant`` to the secant moduli."""

    def __call__(self, u: Array, lam: Array, *, secant: float) -> Evaluation:
        """Residual and matrix."""


def eliminated(
    eq: Equilibrium, u: Array, lam: Array, e: Evaluation, secant: float
) -> tuple[Array, Evaluation] | None:  # fmt: skip
    """Dofs (ndof,) and evaluation after the few nodes that miss equilibrium in e have found theirs.

    ``secant``: how far the matrix of their first step goes to the secant moduli, where e has none.

    None where the residual is small or not that of few nodes, where nothing flows, and where no less is left in all.
    """
    whole, policy = eq.norm(e), eq.policy
    if not applies(eq) or not policy.local_from_residual * e.scale < whole < np.inf:
        return None
    worst = _worst(eq, e)
    if len(worst) > _most(eq):
        return None
    own = _with_those_beside(eq.system, eq.reduced.free, worst)
    # Their matrix is dense: of more of them it would cost as much as the step of all that it is to save.
    if not 0 < len(own) <= _most(eq):
        return None
    first = least = _left(e, own)
    evaluate, coupled, begun = _evaluating(eq, own), Coupled.of(eq.system.pattern, own), u
    for _ in range(policy.local_max_steps):
        e = evaluate(u, lam, secant=secant) if e.data is None else e
        moved = _nearer(eq, evaluate, u, lam, e, coupled, least)
        if moved is None:
            break
        u, e, least = moved
        if least < policy.local_residual_ratio * first:
            break
    if u is begun:
        return None
    e = eq.evaluate(u, lam)
    # Nodes beside may miss more than these have gained: it counts if less is left in all.
    return (u, e) if eq.norm(e) < whole else None


def applies(eq: Equilibrium) -> bool:
    """Whether bodies flow, and the equations are those of the nodes: no multipliers, ties, control, condensation.

    An iteration that was asked for without what helps it is left out.
    """
    system, reduced = eq.system, eq.reduced
    if not eq.globalised:
        return False
    plain = isinstance(reduced.assembly, System) and type(reduced.restriction) is Selected and not reduced.equations
    flows = any(b.law.plastic for b in system.blocks)
    return plain and flows


class Coupled(NamedTuple):
    """Where the stiffness of m degrees of freedom ``own`` is in the values of the whole matrix, which need not be looked through.

    ``at`` (k,) places in these, ``row`` and ``column`` (k,) those of the entries among the m.
    """

    own: Index
    at: Index
    row: Index
    column: Index

    @classmethod
    def of(cls, pattern: Pattern, own: Index) -> Coupled:
        """Of degrees of freedom (m,) in ascending order."""
        at, column = _columns(pattern, own)
        rows = pattern.indices[at]
        row = np.minimum(np.searchsorted(own, rows), len(own) - 1)
        inside = own[row] == rows
        return cls(own, at[inside], row[inside], column[inside])

    def block(self, data: Array) -> Array:
        """The stiffness (m, m) of an evaluation with matrix values ``data`` (nnz,)."""
        out = np.zeros((len(self.own), len(self.own)))
        out[self.row, self.column] = data[self.at]
        return out


def _columns(pattern: Pattern, of: Index) -> tuple[Index, Index]:
    """Places of the entries in columns ``of`` (m,) of the matrix, and the number of the column of each."""
    first, many = pattern.indptr[of].astype(np.int64), np.diff(pattern.indptr)[of]
    column = np.repeat(np.arange(len(of)), many)
    return np.arange(len(column)) + (first - np.cumsum(many) + many)[column], column


def _most(eq: Equilibrium) -> float:
    """How many degrees of freedom are few."""
    policy, n = eq.policy, len(eq.reduced.free)
    return min((policy.local_max_share if n >= policy.local_small_dofs else policy.local_max_share_small) * n,
        policy.local_max_dofs)


def _worst(eq: Equilibrium, e: Evaluation) -> Index:
    """The free degrees of freedom that make most of the residual; if they are not few, more than `_most` of them."""
    r = np.abs(eq.reduced.weight * eq.reduced.restriction.part(e.r))
    largest = len(r) - min(int(_most(eq)) + 2, len(r))
    order = np.argpartition(r, largest)[largest:]  # sorting all takes as long as an evaluation of some elements
    order = order[np.argsort(-r[order])]
    return eq.reduced.free[order[: int(np.searchsorted(np.cumsum(r[order]), eq.policy.local_residual_share * r.sum())) + 1]]


def _with_those_beside(system: System, free: Index, worst: Index) -> Index:
    """The ``free`` ones of some degrees of freedom and of all displacements that are coupled with them, in ascending order."""
    nodal = system.dofs.displacement.slice
    own = np.zeros(system.ndof, dtype=bool)
    own[system.pattern.indices[_columns(system.pattern, worst)[0]]] = True
    own[: nodal.start] = own[nodal.stop :] = False
    return free[own[free]]


def _left(e: Evaluation, own: Index) -> float:
    """Sum of the residuals of some degrees of freedom; infinite where it could not be evaluated."""
    return np.inf if e.failed else float(np.abs(e.r[own]).sum())


def _evaluating(eq: Equilibrium, own: Index) -> Evaluate:
    """What evaluates dofs (ndof,) and multipliers so that residuals and matrix of the degrees of freedom ``own`` are right.

    By the elements alone that have them: all others would take nearly all of the time.
    """
    system, c = eq.system, eq.context
    near = np.zeros(system.nodes, dtype=bool)
    near[system.dofs.displacement.split(own)[0]] = True
    kept = [np.flatnonzero(near[b.cells].any(axis=1)) for b in system.blocks]
    rows = [(b, h, k) for b, h, k in zip(system.blocks, c.history, kept) if len(k)]
    blocks = [replace(b, cells=b.cells[k], X=b.X[k], slots=b.slots[k], volume=b.volume[k]) for b, _, k in rows]
    some, there = system.of_elements(blocks), replace(c, history=[h[k] for _, h, k in rows])
    if system.bodies is not None or some.has_memory != system.has_memory:
        return eq.evaluate

    def evaluate(u: Array, lam: Array, *, secant: float) -> Evaluation:
        with eq.report.timed("assembly"):
            return some.evaluate(there, u, lam, secant=secant)

    return evaluate


def _nearer(
    eq: Equilibrium, evaluate: Evaluate, u: Array, lam: Array, e: Evaluation, coupled: Coupled, least: float
) -> tuple[Array, Evaluation, float] | None:  # fmt: skip
    """Dofs, evaluation and residual after a step of some dofs alone that lowers their residual below ``least``."""
    assert e.data is not None
    own, delta = coupled.own, np.zeros(len(u))
    try:
        delta[own] = np.linalg.solve(coupled.block(e.data), -e.r[own])
    except np.linalg.LinAlgError:
        return None
    for share in (1.0, *eq.policy.local_search_factors):
        moved = u + share * delta
        # The secant only leads the first step away from a wrong direction of flow; steps that converge are Newton's.
        there = evaluate(moved, lam, secant=0.0)
        if (left := _left(there, own)) < least:
            return moved, there, left
    return None
