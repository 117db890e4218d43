"""One attempt at an increment: initial guess, Newton, multiplier updates. It commits nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from prensa.linear.factorisations import SingularError
from prensa.linear.multipliers import BlockedError
from prensa.policy import Policy
from prensa.solver.approach import overlap_stages
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.newton import newton
from prensa.solver.predictor import Guess, initial_guess
from prensa.system.failure import Failure, Singular, Unsettled
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.state import may_rest
from prensa.system.system import Evaluation, System
from prensa.types import Array

Solve = Callable[[Array, NewtonResult], Failure | None]


def attempt(eq: Equilibrium, start: Array, was_cut: bool = True) -> NewtonResult:
    """Try to solve an increment from the dofs ``start`` (ndof,); the committed state is not touched.

    was_cut: whether the increment has been cut so often that a failure is followed by an attempt with contact steps alone,
    although Newton's iteration could take them.
    """
    result = attempt_by_newton(eq, start)
    if result.converged:
        return result
    spent = result.iterations
    for solve in _other_ways(eq, start, result, was_cut):
        again = _outcome(eq, start, solve)
        spent += again.iterations
        if again.converged:
            again.iterations, again.discarded = spent, spent - again.iterations
            return again
    result.iterations = spent
    return result


def _other_ways(eq: Equilibrium, start: Array, failed: NewtonResult, was_cut: bool) -> Iterator[Solve]:
    """What is tried after a failed attempt, in order; how that failed is what is reported if these fail too.

    Where Newton's iteration could take contact steps wherever it wanted, an attempt that takes nothing else goes the same way
    nine times of ten: a shorter increment is cheaper, unless it has been cut before.
    """
    if out := overlap_stages(eq.system, eq.context, eq.policy):
        yield partial(_by_stages, eq, out, start)
    # by GMRES each point of a contact step costs a solution, and there are none of many
    decides = failed.affordable or not eq.reduced.factorisation.iterates
    if decides and failed.contact_changed() and (was_cut or not failed.affordable):
        yield partial(_by_contact, eq, start)


def attempt_by_newton(eq: Equilibrium, start: Array) -> NewtonResult:
    """One attempt from the initial guess, with contact steps where Newton's iteration takes them."""
    return _outcome(eq, start, partial(_solve, eq, start, False))


def _by_contact(eq: Equilibrium, start: Array, lam: Array, result: NewtonResult) -> Failure | None:
    """Solve by contact steps (see `newton`); raises `SingularError` if the solution is one that nothing holds in place."""
    reason = _solve(eq, start, True, lam, result)
    if reason is None:
        # the foundation of contact steps hides a body that is free to move
        here = eq.evaluate(result.u, result.lam)
        with eq.report.timed("factorisation and solve"):
            eq.reduced.solve(eq.reduced.matrix(here, -here.r, spent=True), -here.r)
    return reason


def attempt_from(eq: Equilibrium, u: Array) -> NewtonResult:
    """One attempt from the iterate u (ndof,) itself, which nothing extrapolates."""
    return _outcome(eq, u, partial(_augment, eq, Guess(u), False))


def _outcome(eq: Equilibrium, start: Array, solve: Solve) -> NewtonResult:
    """What comes of an attempt that ``solve`` makes with multipliers (points, 1 + t), from the dofs ``start``."""
    # the stability check needs factors of this increment, so older ones are kept only if it may be skipped
    state = eq.context.state
    eq.reduced.factorisation.begin(state.made_from if may_rest(state) and eq.numerics.reuse_factors else None)
    lam = eq.system.initial_multipliers(eq.context.state)
    result = NewtonResult(False, None, start, None, lam, 0)
    try:
        result.reason = solve(lam, result)
    except BlockedError as error:
        result.reason = error.failure
    except SingularError as error:
        result.reason = Singular(str(error))
    result.converged = result.reason is None
    result.krylov = eq.reduced.factorisation.krylov_iterations
    return result


def _solve(eq: Equilibrium, start: Array, by_contact: bool, lam: Array, result: NewtonResult) -> Failure | None:
    """Solve the increment from its initial guess; None when that is done."""
    guess = initial_guess(eq, start, lam)
    result.iterations += guess.solved
    if guess.assumed is not None:
        result.linear = guess.u - start
    return _augment(eq, guess, by_contact, lam, result)


def _by_stages(eq: Equilibrium, path: list[Context], start: Array, lam: Array, result: NewtonResult) -> Failure | None:
    """Solve the stages in which tools that start inside bodies, drawn back, go in again (see `overlap_stages`), and then the
    increment.
    """
    # No stage is committed: it only has to lead near the next one.
    rough = replace(eq.numerics, tolerance=eq.policy.overlap_stage_residual)
    for stage in path:
        at = replace(eq, context=stage, numerics=rough)
        end = newton(at, initial_guess(at, start, lam), lam, result)
        if not isinstance(end, Evaluation):
            return end
        start = result.u
    return _augment(eq, initial_guess(eq, start, lam), False, lam, result)


def _augment(eq: Equilibrium, guess: Guess, by_contact: bool, lam: Array, result: NewtonResult) -> Failure | None:
    """Newton, and again with updated multipliers of augmented contacts until these are settled."""
    while True:
        end = newton(eq, guess, lam, result, by_contact)
        if not isinstance(end, Evaluation):
            return end
        update, change = updated_multipliers(eq.system, eq.context, end, lam, eq.policy)
        if change <= 1.0:
            result.evaluation, result.lam = end, lam
            return None
        result.augmentations += 1
        limit = most_updates(eq.system)
        if result.augmentations > limit:
            return Unsettled(limit)
        lam, guess = update, Guess(result.u)


def most_updates(system: System) -> int:
    """Updates of the multipliers that the contacts of a system allow."""
    return max(s.description.enforcement.max_updates for s in system.surfaces)


def updated_multipliers(system: System, c: Context, e: Evaluation, lam: Array, policy: Policy) -> tuple[Array, float]:
    """Updated multipliers and the largest change over its tolerance (≤ 1: settled; 0 without augmented contacts)."""
    update, worst = lam.copy(), 0.0
    for s, f, sc in zip(system.surfaces, e.contacts, c.scales):
        slip = f.kappa - c.state.contact.slip[s.rows]
        enforcement = s.description.enforcement
        update[s.rows], change = enforcement.update(f, lam[s.rows], sc, slip, policy.small_slip_ratio)
        worst = max(worst, change)
    return update, worst
