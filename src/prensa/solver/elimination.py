"""Equilibrium of a few nodes that alone miss it, with all others held (nonlinear elimination).

Where flow begins or turns in a few elements, the tangent of an iterate leads far beyond there and Newton's method takes as many
iterations as those elements need, each with a factorisation of everything. Equations of their own nodes, which are few, are
solved first (Lanzkron, Rose and Wilkes 1996; Cai and Li 2011); the next step has the rest to do. The iterate is another one, the
equations and what counts as converged are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from prensa.fem.system import Evaluation
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.reduced import Selected, Whole

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Evaluate = Callable[[Array, Array], Evaluation]


def eliminated(eq: Equilibrium, u: Array, lam: Array, e: Evaluation) -> tuple[Array, Evaluation] | None:
    """Dofs (ndof,) and evaluation after the few nodes that miss equilibrium in e have found theirs.

    None where the residual is small or not that of few nodes, where nothing flows, and where no less is left in all.
    """
    whole, policy = eq.norm(e), eq.policy
    if not applies(eq) or not policy.local_from * e.scale < whole < np.inf:
        return None
    worst = _worst(eq, e)
    if len(worst) > _most(eq):
        return None
    if e.data is None:
        e = eq.evaluate(u, lam)
    matrix = _matrix(eq, e)
    own = _with_those_beside(eq, matrix, worst)
    if not 0 < len(own) <= _most(eq):
        return None
    first = least = _left(eq, e, own)
    evaluate, begun = _evaluating(eq, own), u
    for _ in range(policy.local_steps):
        moved = _nearer(eq, evaluate, u, lam, e, matrix, own, least)
        if moved is None:
            break
        (u, e, least), matrix = moved, None
        if least < policy.local_enough * first:
            break
    if u is begun:
        return None
    e = eq.evaluate(u, lam)
    return (u, e) if eq.norm(e) < whole else None


def applies(eq: Equilibrium) -> bool:
    """Whether bodies flow in the plane, and the equations are those of the nodes: no multipliers, ties, control, condensation.

    Enhanced elements iterate inside, so that evaluations are what they cost: they are left out. So is an iteration that was asked
    for without what helps it.
    """
    system, reduced = eq.system, eq.reduced
    if not eq.numerics.line_search or eq.numerics.iteration == "paper":
        return False
    plain = isinstance(reduced.assembly, Whole) and type(reduced.restriction) is Selected and not reduced.equations
    flows = system.dofs.dimension == 2 and any(b.law.plastic for b in system.blocks)
    return plain and flows and not any(b.element.extra(b.mode) for b in system.blocks)


def _matrix(eq: Equilibrium, e: Evaluation) -> csc_matrix:
    """K_ff of an evaluation."""
    assert e.data is not None and isinstance(eq.reduced.restriction, Selected)
    restriction = eq.reduced.restriction
    n = len(restriction.free)
    return csc_matrix((restriction.values(e.data), restriction.indices, restriction.indptr), (n, n))


def _most(eq: Equilibrium) -> float:
    """How many degrees of freedom are few."""
    policy, n = eq.policy, len(eq.reduced.free)
    return min((policy.local_most if n >= policy.local_small else policy.local_little) * n, policy.local_dofs)


def _worst(eq: Equilibrium, e: Evaluation) -> Index:
    """Places among the free dofs of those that make most of the residual."""
    r = np.abs(eq.reduced.weight * eq.reduced.restriction.part(e.r))
    order = np.argsort(-r)
    return order[: int(np.searchsorted(np.cumsum(r[order]), eq.policy.local_share * r.sum())) + 1]


def _with_those_beside(eq: Equilibrium, matrix: csc_matrix, worst: Index) -> Index:
    """Places among the free dofs of some and of all displacements that are coupled with them."""
    free, nodal = eq.reduced.free, eq.system.dofs.displacement.slice
    beside = np.unique(matrix[:, worst].indices)
    return np.asarray(beside[(free[beside] >= nodal.start) & (free[beside] < nodal.stop)])


def _left(eq: Equilibrium, e: Evaluation, own: Index) -> float:
    """Sum of the residuals of some free dofs; infinite where it could not be evaluated."""
    return np.inf if e.failed else float(np.abs(eq.reduced.restriction.part(e.r)[own]).sum())


def _evaluating(eq: Equilibrium, own: Index) -> Evaluate:
    """What evaluates dofs (ndof,) and multipliers so that residuals and matrix of some free dofs are right.

    By the elements alone that have them: all others would take nearly all of the time.
    """
    system, c = eq.system, eq.context
    near = np.zeros(system.nodes, dtype=bool)
    near[system.dofs.displacement.split(eq.reduced.free[own])[0]] = True
    kept = [np.flatnonzero(near[b.cells].any(axis=1)) for b in system.blocks]
    rows = [(b, h, k) for b, h, k in zip(system.blocks, c.history, kept) if len(k)]
    blocks = [replace(b, cells=b.cells[k], X=b.X[k], slots=b.slots[k], volume=b.volume[k]) for b, _, k in rows]
    some, there = replace(system, blocks=blocks), replace(c, history=[h[k] for _, h, k in rows])
    if system.bodies is not None or some.has_memory != system.has_memory:
        return eq.evaluate

    def evaluate(u: Array, lam: Array) -> Evaluation:
        with eq.report.timed("assembly"):
            return some.evaluate(there, u, lam)

    return evaluate


def _nearer(
    eq: Equilibrium, evaluate: Evaluate, u: Array, lam: Array, e: Evaluation, matrix: csc_matrix | None, own: Index, least: float
) -> tuple[Array, Evaluation, float] | None:  # fmt: skip
    """Dofs, evaluation and residual after a step of some dofs alone that lowers their residual below ``least``."""
    matrix = _matrix(eq, e) if matrix is None else matrix
    try:
        step = np.linalg.solve(matrix[:, own][own].toarray(), -eq.reduced.restriction.part(e.r)[own])
    except np.linalg.LinAlgError:
        return None
    x = np.zeros(len(eq.reduced.free))
    x[own] = step
    delta = eq.reduced.restriction.whole(x, len(u))
    for share in (1.0, *eq.policy.local_search):
        moved = u + share * delta
        there = evaluate(moved, lam)
        if (left := _left(eq, there, own)) < least:
            return moved, there, left
    return None
