"""Newton on r(u) = 0 with line search; the matrix is the tangent, or nearer the secant where the direction of flow turns.

`init`, `step`, `terminate` work on an explicit state; failure is a value.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from prensa.solver.contact_lcp import affordable, contact_step, edge_step, few, held_by_friction
from prensa.solver.equilibrium import Equilibrium, reversed_slip, signature
from prensa.solver.finish import Finish, finish
from prensa.solver.newton_state import Best, ContactChange, Iterate, NewtonState
from prensa.solver.nonlinear_elimination import applies, eliminated
from prensa.solver.predictor import Guess
from prensa.solver.projection import contact_corrected
from prensa.system.failure import Diverged, Failure, NotConverged, Stagnated, Unevaluable
from prensa.system.outcome import NewtonResult
from prensa.system.system import Evaluation
from prensa.types import Array, Flags


def newton(
    eq: Equilibrium, guess: Guess, lam: Array, result: NewtonResult, by_contact: bool = False
) -> Evaluation | Failure:  # fmt: skip
    """The evaluation of the converged iterate, or why there is none; ``result`` keeps the iterates and the cost.

    ``by_contact``: with steps that find out themselves which contact points are closed (see `contact_step`).
    """
    state = init(eq, guess, lam)
    for _ in range(eq.numerics.max_iterations):
        observe(eq, state, result)
        end = terminate(eq, state, result)
        if end is None:
            end = step(eq, state, result, by_contact)
        if end is not None:
            return end
        state.iteration += 1
    return NotConverged(eq.numerics.max_iterations, result.residuals[-1])


def init(eq: Equilibrium, guess: Guess, lam: Array) -> NewtonState:
    """The state before the first iteration; the guess hands its evaluation over.

    Where metal flows, contact goes on to be decided as in the guess: with the flow the points change that stick and are closed.
    """
    return NewtonState(Iterate(guess.u, guess.take(), assumed=guess.assumed), lam, by_contact=guess.flows, flows=guess.flows)


def observe(eq: Equilibrium, state: NewtonState, result: NewtonResult) -> None:
    """Evaluate the iterate unless that is done, and note its residual and what changed in contact."""
    here, before = state.iterate, None if state.contact is None else state.contact.now
    if here.evaluation is None:
        here.evaluation = eq.evaluate(here.u, state.lam)
    e = here.evaluation
    if e.failed:
        return
    here.norm, here.scale = eq.norm(e), e.scale
    result.krylov = eq.reduced.factorisation.krylov_iterations
    contact = state.contact = ContactChange(signature(e), before, eq.context.state.contact.closed)
    result.u = here.u
    key = contact.now.tobytes()
    result.active_sets.pop(key, None)
    result.active_sets[key] = tuple(f.active_sets for f in e.contacts)
    if not state.iteration:
        result.affordable = affordable(eq, e)
    result.residuals.append(here.relative)
    result.changes.append(contact.changed if before is not None else len(contact.now))
    eq.report.iteration(result, e)


def terminate(eq: Equilibrium, state: NewtonState, result: NewtonResult) -> Evaluation | Failure | None:
    """The converged evaluation, a reason to give up, or None: go on."""
    here = state.iterate
    e = here.evaluation
    assert e is not None
    if e.failed:
        return Unevaluable(e.failed)
    if runaway := eq.runaway(here.u - eq.context.state.u):
        return runaway
    if _near(eq, state, e):
        followed = _followed(eq, state, e)
        del e
        done, converged = finish(eq, Finish(here.u, _handed_over(eq, state), here.norm), state.lam, followed)
        result.iterations += done.factorisations
        if converged:
            result.u, result.residual = done.u, done.residual
            return done.evaluation
    if not np.isfinite(here.norm):
        return Diverged()
    least = state.least
    least.append(min(here.norm, least[-1]) if least else here.norm)
    return None


def _near(eq: Equilibrium, state: NewtonState, e: Evaluation) -> bool:
    """Whether the iterate has converged, or is so near that the factors at hand may finish the work.

    Old factors seldom converge once a contact point changed status; in large systems they are then not tried.
    """
    here, first = state.iterate, state.iteration == 0
    opened = here.assumed is not None and (here.assumed & ~e.resting).any()
    may = eq.numerics.reuse_factors and not first
    may = may and not (state.changed and len(eq.reduced.free) >= eq.policy.reuse_max_unknowns)
    limit = max(eq.numerics.tolerance, eq.policy.finish_from_residual if may else 0.0)
    return bool((here.relative <= limit or here.norm <= e.floor) and not opened)


def _follows(eq: Equilibrium) -> bool:
    """Whether to use GMRES with the matrix at the iterate, preconditioned by the last factors, to finish the work.

    Not where multipliers have equations, which are others where a point changes, nor where the matrix is wanted afterwards.
    """
    return eq.reduced.factorisation.follows and not (eq.keeps_matrix or eq.reduced.equations)


def _followed(eq: Equilibrium, state: NewtonState, e: Evaluation) -> float | None:
    """What a step with the matrix at the iterate promises to leave; None where the matrix of the last step is kept.

    Corrections use GMRES with the matrix at the iterate, preconditioned by the last factors. With the matrix of the last step
    they would take an evaluation for each digit and a half, and as many substitutions each.
    """
    factors = eq.reduced.factorisation
    may = _follows(eq) and factors.holds_matrix and e.data is not None
    if not may or state.reversed is not None or state.iterate.secant != _turns(eq, state):
        return None
    factors.follow(eq.reduced.matrix(e, -e.r, spent=True), state.changed)
    before = state.least[-1] if state.least else 0.0
    return (state.iterate.norm / before) ** 2 if before > 0 else 1.0


def _handed_over(eq: Equilibrium, state: NewtonState) -> Evaluation:
    """The evaluation at the iterate; of a large system Newton keeps neither its matrix nor its history meanwhile.

    The matrix of the last step is held too, and as much as a fifth of all memory would be taken for the case that Newton goes
    on from here, which then evaluates once more.
    """
    e = state.iterate.evaluation
    assert e is not None
    if eq.keeps_matrix or not eq.reduced.factorisation.holds_matrix:
        return e
    state.iterate.evaluation = e._replace(data=None, history=())
    return e._replace(data=None)


def step(eq: Equilibrium, state: NewtonState, result: NewtonResult, by_contact: bool = False) -> Failure | None:
    """Move the state by a full Newton step, or by a part of the step from the best iterate so far (line search).

    A full step is accepted if it leaves less than the least residual so far, or if it is the first of the attempt (in second
    order only if the residual does not more than double).
    """
    # once contact is settled go back to Newton's steps, whose factors the finish can reuse
    here = state.iterate
    state.by_contact = state.by_contact and state.changed > 0 and here.relative > eq.policy.close_residual
    e, delta, decided = _direction(eq, state, by_contact or state.by_contact)
    result.iterations += 1
    if runaway := eq.runaway(delta):
        return runaway
    mine = Best(here.norm, here.u, delta, _places(e))
    best = state.best = mine if state.best is None or mine.norm < state.best.norm else state.best
    moved = contact_corrected(eq.system, eq.context, e, here.u, delta, state.lam)
    settled = state.contact is not None and state.contact.settled and not (state.iteration and state.contact.changed)
    wanted = not (here.relative <= eq.policy.close_residual and settled)
    wanted = wanted or _follows(eq)
    secant = _secant(eq, state)
    # where flow turns, few nodes are nearly always put right first: then the next step begins with another matrix
    full = eq.evaluate(moved, state.lam, wanted and not (secant and applies(eq)), secant=secant)
    size = eq.norm(full)
    if state.flows and not decided and size > eq.policy.local_slow_ratio * here.norm:
        moved, full = _volume_put_right(eq, moved, state.lam, full, secant)
        size = eq.norm(full)
    # A step that raised the residual has most likely assumed the wrong points closed or sticking: let the step decide them.
    if not decided and size > here.norm and (better := _contact_step_instead(eq, state, e, full, result)) is not None:
        moved, full, by_contact_step = better
        size = eq.norm(full)
        if best is mine:
            best = state.best = replace(mine, step=by_contact_step)
    alone = eliminated(eq, moved, state.lam, full, secant) if size > eq.policy.local_slow_ratio * here.norm else None
    if alone is not None:
        moved, full = alone
        size = eq.norm(full)
    if not full.failed and _accepted(eq, state, size, best.norm):
        state.iterate = Iterate(moved, full, alone is None and _turns(eq, state))
        return None
    # A step that left the domain has to be shortened itself; of the others the least residual says where to go on.
    return _search_line(eq, state, result, mine if full.failed else best)


def _search_line(eq: Equilibrium, state: NewtonState, result: NewtonResult, start: Best) -> Failure | None:
    """Move the state by the best part of the step from ``start``; a failure where the iteration goes round in a circle.

    Where no part of a step lowers the residual there is a kink beside the iterate, and the best part leads across it, often to
    where steps succeed again. If that happens twice in the same active set of contact, the iteration is back where it was.
    """
    u, size = _shortened(eq, start.u, start.step, start.e, state.lam)
    state.iterate = Iterate(u)
    state.contact = state.best = None
    if start.norm <= size < np.inf:
        contact = signature(start.e).tobytes()
        if contact in state.stuck:
            observe(eq, state, result)  # what is closed and slips across the kink: the path may end between the two
            return Stagnated(start.norm / state.iterate.scale)
        state.stuck.add(contact)
    return None


def _volume_put_right(
    eq: Equilibrium, u: Array, lam: Array, full: Evaluation, secant: float
) -> tuple[Array, Evaluation]:  # fmt: skip
    """Dofs and evaluation after corrections of a step's end u (ndof,) with its own factors, as long as each lowers the residual.

    A long step where metal flows leaves an error of volume, of second order in the step times a large bulk modulus, which hides
    how near it has come otherwise. The factors at hand know the bulk modulus: with them substitutions put it right, fewer than
    cost a factorisation (second-order correction of a constraint: Fletcher 1982).
    """
    for _ in range(eq.policy.substitutions_per_factorisation - 1):
        if full.failed or not eq.reduced.factorisation.factored:
            break
        with eq.report.timed("factorisation and solve"):
            more = eq.reduced.correction(-full.r)
        if eq.runaway(more) is not None:
            break
        moved = contact_corrected(eq.system, eq.context, full, u, more, lam)
        better = eq.evaluate(moved, lam, full.data is not None, secant=secant)
        if not eq.norm(better) < eq.norm(full):
            break
        u, full = moved, better
    return u, full


def _turns(eq: Equilibrium, state: NewtonState) -> bool:
    """Whether the matrix at an iterate had better not be the tangent (see `Equilibrium.flow_direction_unreliable`)."""
    return eq.flow_direction_unreliable(state.iterate.relative, state.iteration == 0)


def _secant(eq: Equilibrium, state: NewtonState) -> float:
    """How far the matrix at an iterate goes from the tangent to the secant moduli."""
    return eq.secant if _turns(eq, state) else 0.0


def _direction(eq: Equilibrium, state: NewtonState, by_contact: bool) -> tuple[Evaluation, Array, bool]:
    """A step (ndof,) from the state's iterate, the evaluation that it is from, without its matrix and history, and its kind.

    The contact conditions are inequalities in it ``by_contact``, or where points reverse their slip and it can find out which
    of them stick; the flag says whether all of contact was decided so. Else it is Newton's.
    """
    here, stick = state.iterate, state.reversed
    if by_contact or stick is not None:
        e = here.evaluation
        assert e is not None
        found = contact_step(eq, here.u, state.lam, e, stick, for_friction=not by_contact)
        if found is not None:
            here.evaluation = None
            return e._replace(data=None, history=()), found.step, found.decided
    e, delta = _newton_direction(eq, state, stick)
    if eq.runaway(delta) is not None and held_by_friction(eq, e):
        # a tool that friction alone holds is free where all of its points slip: which of them stick may be decided
        found = contact_step(eq, here.u, state.lam, e, for_friction=True)
        if found is not None:
            return e, found.step, found.decided
    return e, delta, False


def _newton_direction(eq: Equilibrium, state: NewtonState, stick: Flags | None) -> tuple[Evaluation, Array]:
    """As `_direction`, by Newton's matrix, with the points at the edges of contacts decided.

    ``stick`` (points,): forced to do so. A point that slipped one way and now slips the other would flip for ever where no step
    decides it.
    """
    here = state.iterate
    e, here.evaluation = here.evaluation, None
    turns, secant = _turns(eq, state), _secant(eq, state)
    if e is None or e.data is None or here.secant != turns:
        e = eq.evaluate(here.u, state.lam, secant=secant)
    if stick is not None:
        stuck = eq.evaluate(here.u, state.lam, stick=stick, secant=secant)
        if not stuck.failed:
            e = stuck
        del stuck
    # a multiplier's equation is another one where its point has another status, and the digits of its force count
    same = not (state.changed and eq.reduced.equations)
    # Factors of another iterate are near this matrix only if no other mechanism has changed it.
    alike = same and not turns and stick is None and here.relative <= eq.policy.same_matrix_residual
    changed = state.changed if alike and eq.numerics.reuse_factors else None
    with eq.report.timed("factorisation and solve"):
        matrix, e = eq.reduced.matrix(e, -e.r, spent=True), e._replace(data=None, history=())
        delta = eq.reduced.step(matrix, -e.r, max(here.relative, state.promised), changed)
    return e, edge_step(eq, e, state.lam, delta) if here.relative <= eq.policy.edge_from_residual else delta


def _contact_step_instead(
    eq: Equilibrium, state: NewtonState, e: Evaluation, full: Evaluation, result: NewtonResult
) -> tuple[Array, Evaluation, Array] | None:  # fmt: skip
    """Dofs and evaluation after a contact step from the iterate of e, and that step; None if ``full`` is as good.

    It is tried where the assumptions of Newton's step were wrong: points slip the other way at its end, or open or close
    once more. Points that do the latter keep alternating between open and closed: steps by contact go on from there.
    """
    before, after = signature(e), signature(full)
    turns = not full.failed and bool(reversed_slip(before, after).any())
    changes = full.failed or (state.iteration > 0 and not np.array_equal(before > 0, after > 0))
    if not (turns or changes):
        return None
    found = contact_step(eq, state.iterate.u, state.lam, e, most=few(eq), for_friction=turns)
    if found is None:
        return None
    result.iterations += 1
    if eq.runaway(found.step) is not None:
        return None
    moved = contact_corrected(eq.system, eq.context, e, state.iterate.u, found.step, state.lam)
    better = eq.evaluate(moved, state.lam, secant=_secant(eq, state))
    if not eq.norm(better) < eq.norm(full):
        return None
    state.by_contact = not turns
    return moved, better, found.step


def _accepted(eq: Equilibrium, state: NewtonState, size: float, least: float) -> bool:
    """Whether a full step is accepted for the residual ``size`` after it: less than the ``least`` so far, or the first step."""
    if size < least or not eq.numerics.line_search:
        return True
    return state.iteration == 0 and (not eq.context.rule.share or size < eq.policy.first_step_growth * least)


def _places(e: Evaluation) -> Evaluation:
    """An evaluation without what is as long as the dofs: only its contacts are asked for."""
    nothing = np.zeros(0)
    return e._replace(r=nothing, f_ext=nothing, data=None, history=())


def _shortened(eq: Equilibrium, u: Array, delta: Array, e: Evaluation, lam: Array) -> tuple[Array, float]:
    """Dofs (ndof,) after the fraction of a step from the iterate u of e with the least residual, and this; infinite if none has.

    Closed contact nodes are put at the gap of the linear model, as after a whole step: what a straight one along a curved tool
    leaves is the force of gaps that it changes by the way, so that the shortest looks best.
    """
    best, found = np.inf, u
    for f in eq.policy.line_search_factors:
        moved = contact_corrected(eq.system, eq.context, e, u, f * delta, lam)
        size = eq.norm(eq.evaluate(moved, lam, stiffness=False, section="line search"))
        if size < best:
            best, found = size, moved
    return found if np.isfinite(best) else u + eq.policy.line_search_factors[-1] * delta, best
