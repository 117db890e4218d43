"""Newton on r(u) = 0 with the exact tangent, as `init`, `step`, `terminate` on an explicit state; failure is a value."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from prensa.solver.contact_lcp import affordable, contact_step, edge_step
from prensa.solver.equilibrium import Equilibrium, Signature, reversed_slip, signature
from prensa.solver.finish import finish
from prensa.solver.predictor import Guess
from prensa.solver.projection import contact_corrected
from prensa.system.failure import Diverged, Failure, NotConverged, Stagnated, Unevaluable
from prensa.system.outcome import NewtonResult
from prensa.system.system import Evaluation
from prensa.types import Array, Flags


@dataclass(frozen=True)
class Best:
    """The iterate with the least residual ``norm`` so far: dofs u (ndof,), Newton's step from there, its contacts ``e``.

    The line search goes back to it, and not to the iterate at hand: the first step may raise the residual, and so may steps that
    are accepted for the one that follows.
    """

    norm: float
    u: Array
    step: Array
    e: Evaluation


@dataclass
class NewtonState:
    """Where an iteration stands: dofs u (ndof,), multipliers lam (points, 2), and what is known of them.

    evaluation: that at u, the only holder of its matrix; None before it is made. ``status``: signature at u, ``reversed``
    (points,) those that slip against their last direction, ``changed``: how many points have another status than at the last
    iterate (at the first: have opened or closed since the increment began), ``settled``: none of them has opened or closed.
    ``best``: the iterate to which the line search goes back.
    ``least``: least residual up to each iteration. ``secant``: whether the matrix of the evaluation is the one for iterates where
    flow turns (see `Equilibrium.flow_direction_unreliable`).
    """

    u: Array
    lam: Array
    evaluation: Evaluation | None
    assumed: Flags | None
    closed: Flags
    iteration: int = 0
    norm: float = np.inf
    relative: float = np.inf
    status: Signature | None = None
    reversed: Flags = field(default_factory=lambda: np.zeros(0, dtype=bool))
    changed: int = 0
    settled: bool = False
    by_contact: bool = False
    best: Best | None = None
    least: list[float] = field(default_factory=list)
    secant: bool = False

    @property
    def promised(self) -> float:
        """Residual over the present one that quadratic convergence promises after a step: the square of the last such ratio.

        A linear system need not be solved to more digits than that (choice 2 of Eisenstat & Walker 1996); 0 before a step.
        """
        return (self.least[-1] / self.least[-2]) ** 2 if len(self.least) > 1 and self.least[-2] > 0 else 0.0


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
    """The state before the first iteration; the guess hands its evaluation over."""
    return NewtonState(guess.u, lam, guess.take(), guess.assumed, eq.context.state.contact.closed)


def observe(eq: Equilibrium, state: NewtonState, result: NewtonResult) -> None:
    """Evaluate the iterate unless that is done, and note its residual and what changed in contact."""
    if state.evaluation is None:
        state.evaluation = eq.evaluate(state.u, state.lam)
    e, before = state.evaluation, state.status
    if e.failed:
        return
    now = state.status = signature(e)
    state.norm = eq.norm(e)
    state.relative = state.norm / e.scale if e.scale > 0 else 0.0
    state.reversed = reversed_slip(before, now)
    was = state.closed if before is None else before > 0
    flipped = (now > 0) != was if len(now) == len(was) else was  # tools that are taken away leave no points
    state.settled = not flipped.any()
    state.changed = int(np.count_nonzero(flipped if before is None else now != before))
    result.u = state.u
    key = now.tobytes()
    result.active_sets.pop(key, None)
    result.active_sets[key] = tuple(f.active_sets for f in e.contacts)
    if not state.iteration:
        result.affordable = affordable(eq, e)
    result.residuals.append(state.relative)
    result.changes.append(state.changed if before is not None else len(now))
    eq.report.iteration(result, e)


def terminate(eq: Equilibrium, state: NewtonState, result: NewtonResult) -> Evaluation | Failure | None:
    """The converged evaluation, a reason to give up, or None: go on."""
    e, policy = state.evaluation, eq.policy
    assert e is not None
    if e.failed:
        return Unevaluable(e.failed)
    if runaway := eq.runaway(state.u - eq.context.state.u):
        return runaway
    if _near(eq, state, e):
        followed = _followed(eq, state, e)
        del e
        done, converged = finish(eq, state.u, _handed_over(eq, state), state.lam, followed)
        result.iterations += done.factorisations
        if converged:
            result.u, result.residual = done.u, done.residual
            return done.evaluation
    if not np.isfinite(state.norm):
        return Diverged()
    least = state.least
    least.append(min(state.norm, least[-1]) if least else state.norm)
    if eq.globalised and len(least) > policy.max_nonimproving and least[-1] == least[0]:
        return Stagnated(state.relative)
    if len(least) > policy.stagnation_iterations + 2 and least[-1] > policy.stagnation_ratio * least[-1 -
        policy.stagnation_iterations]:
        return Stagnated(state.relative)
    return None


def _near(eq: Equilibrium, state: NewtonState, e: Evaluation) -> bool:
    """Whether the iterate has converged, or is so near that the factors at hand may finish the work.

    They seldom do where contact points have another status than in their matrix: in large problems, where trying costs a quarter
    of a step, that is left out.
    """
    first = state.iteration == 0
    opened = first and state.assumed is not None and (state.assumed & ~e.resting).any()
    may = eq.numerics.reuse_factors and not first
    may = may and not (state.changed and len(eq.reduced.free) >= eq.policy.reuse_max_unknowns)
    limit = max(eq.numerics.tolerance, eq.policy.finish_from_residual if may else 0.0)
    return bool((state.relative <= limit or state.norm <= e.floor) and not opened)


def _follows(eq: Equilibrium) -> bool:
    """Whether substitutions that finish the work had better go by the matrix at the iterate than by that of the last step.

    Not where multipliers have equations, which are others where a point changes, nor where the matrix is wanted afterwards.
    """
    return eq.reduced.factorisation.follows and not (eq.keeps_matrix or eq.reduced.equations)


def _followed(eq: Equilibrium, state: NewtonState, e: Evaluation) -> float | None:
    """What a step with the matrix at the iterate promises to leave, if corrections go by that from here on; else None.

    With the matrix of the last step they would take an evaluation for each digit and a half, and as many substitutions each.
    """
    factors = eq.reduced.factorisation
    may = _follows(eq) and factors.holds_matrix and e.data is not None
    if not may or state.reversed.any() or state.secant != _turns(eq, state):
        return None
    factors.follow(eq.reduced.matrix(e, -e.r, spent=True), state.changed)
    before = state.least[-1] if state.least else 0.0
    return (state.norm / before) ** 2 if before > 0 else 1.0


def _handed_over(eq: Equilibrium, state: NewtonState) -> Evaluation:
    """The evaluation at the iterate; of a large system Newton keeps neither its matrix nor its history meanwhile.

    The matrix of the last step is held too, and as much as a fifth of all memory would be taken for the case that Newton goes
    on from here, which then evaluates once more.
    """
    e = state.evaluation
    assert e is not None
    if eq.keeps_matrix or not eq.reduced.factorisation.holds_matrix:
        return e
    state.evaluation = e._replace(data=None, history=())
    return e._replace(data=None)


def step(eq: Equilibrium, state: NewtonState, result: NewtonResult, by_contact: bool = False) -> Failure | None:
    """Move the state by a full Newton step, or by a part of the step from the best iterate so far (line search).

    A full step is accepted if it leaves less than the least residual so far, if it is the first of the increment, or if the step
    after it with the same factors is much shorter (natural monotonicity).
    """
    # what a contact step has settled needs none: Newton's leave factors, with which substitutions finish the work
    state.by_contact = state.by_contact and state.changed > 0 and state.relative > eq.policy.close_residual
    e, delta, decided = _direction(eq, state, by_contact or state.by_contact)
    result.iterations += 1
    if runaway := eq.runaway(delta):
        return runaway
    here = Best(state.norm, state.u, delta, _places(e))
    best = state.best = here if state.best is None or here.norm < state.best.norm else state.best
    moved = contact_corrected(eq.system, eq.context, e, state.u, delta, state.lam)
    wanted = not (state.relative <= eq.policy.close_residual and state.settled and not (state.iteration and state.changed))
    wanted = wanted or _follows(eq)
    secant = _secant(eq, state)
    full = eq.evaluate(moved, state.lam, wanted, secant=secant)
    size = eq.norm(full)
    if not decided and size > state.norm and (better := _decided(eq, state, e, full, result)) is not None:
        moved, full, by_contact_step = better
        size = eq.norm(full)
        if best is here:
            best = state.best = replace(here, step=by_contact_step)
    if (not full.failed and _accepted(eq, state, size, best.norm)) or _shrinks(eq, full, delta):
        state.secant = _turns(eq, state)
        state.u, state.evaluation = moved, full
        return None
    start = here if full.failed else best
    state.u = _shortened(eq, start.u, start.step, start.e, state.lam)
    state.evaluation = state.status = state.best = None
    state.secant = False
    return None


def _turns(eq: Equilibrium, state: NewtonState) -> bool:
    """Whether the matrix at an iterate had better not be the tangent (see `Equilibrium.flow_direction_unreliable`)."""
    return eq.flow_direction_unreliable(state.relative, state.iteration == 0)


def _secant(eq: Equilibrium, state: NewtonState) -> float:
    """How far the matrix at an iterate goes from the tangent to the secant moduli."""
    return eq.secant if _turns(eq, state) else 0.0


def _direction(eq: Equilibrium, state: NewtonState, by_contact: bool) -> tuple[Evaluation, Array, bool]:
    """A step (ndof,) from the state's iterate, the evaluation that it is from, without its matrix and history, and its kind.

    The contact conditions are inequalities in it ``by_contact``, or where points reverse their slip and it can find out which
    of them stick; the flag says whether all of contact was decided so. Else it is Newton's.
    """
    if by_contact or state.reversed.any():
        e = state.evaluation
        assert e is not None
        found = contact_step(eq, state.u, state.lam, e, state.reversed, for_friction=not by_contact)
        if found is not None:
            state.evaluation = None
            return e._replace(data=None, history=()), *found
    return *_newton_direction(eq, state), False


def _newton_direction(eq: Equilibrium, state: NewtonState) -> tuple[Evaluation, Array]:
    """As `_direction`, by Newton's matrix, with the points at the edges of contacts decided."""
    e, state.evaluation = state.evaluation, None
    turns, secant = _turns(eq, state), _secant(eq, state)
    if e is None or e.data is None or state.secant != turns:
        e = eq.evaluate(state.u, state.lam, secant=secant)
    if state.reversed.any():
        # where no step decides it, a point that slipped one way and now slips the other would flip for ever: it sticks here
        stuck = eq.evaluate(state.u, state.lam, stick=state.reversed, secant=secant)
        if not stuck.failed:
            e = stuck
        del stuck
    # a multiplier's equation is another one where its point has another status, and the digits of its force count
    same = not (state.changed and eq.reduced.equations)
    alike = same and not turns and not state.reversed.any() and state.relative <= eq.policy.same_matrix_residual
    changed = state.changed if alike and eq.numerics.reuse_factors else None
    with eq.report.timed("factorisation and solve"):
        matrix, e = eq.reduced.matrix(e, -e.r, spent=True), e._replace(data=None, history=())
        delta = eq.reduced.step(matrix, -e.r, max(state.relative, state.promised), changed)
    return e, edge_step(eq, e, state.lam, delta) if state.relative <= eq.policy.edge_from_residual else delta


def _decided(
    eq: Equilibrium, state: NewtonState, e: Evaluation, full: Evaluation, result: NewtonResult
) -> tuple[Array, Evaluation, Array] | None:  # fmt: skip
    """Dofs and evaluation after a contact step from the iterate of e, and that step; None if ``full`` is as good.

    It is tried where the assumptions of Newton's step were wrong: points slip the other way at its end, or open or close
    once more. Points that do the latter have found an end neither open nor closed: steps by contact go on from there.
    """
    before, after = signature(e), signature(full)
    turns = not full.failed and bool(reversed_slip(before, after).any())
    changes = full.failed or (state.iteration > 0 and not np.array_equal(before > 0, after > 0))
    if not (turns or changes):
        return None
    found = contact_step(eq, state.u, state.lam, e, most=eq.policy.few_candidates, for_friction=turns)
    if found is None:
        return None
    result.iterations += 1
    if eq.runaway(found.step) is not None:
        return None
    moved = contact_corrected(eq.system, eq.context, e, state.u, found.step, state.lam)
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


def _shrinks(eq: Equilibrium, full: Evaluation, delta: Array) -> bool:
    """Whether the step that follows on a step delta (ndof,), with the same factors, is much shorter: it leads nearer then.

    Where a strip bends, a step along its tangent stretches it by the square of its turns. That is stiff, so the residual grows,
    and the next step takes all of it back (the natural monotonicity test of Deuflhard 2004, 3.3.2). Elastic bodies, and tools
    that are pushed or hang on springs, may have other equilibria nearby, and are led to none of these.
    """
    led = eq.system.has_memory and eq.context.driven_by_ways
    may = eq.numerics.line_search and led and not eq.reduced.equations
    if not may or full.failed or not eq.reduced.factorisation.factored:
        return False
    lengths = eq.reduced.lengths(len(delta))
    unit = 1.0 if lengths is None else lengths
    with eq.report.timed("factorisation and solve"):
        then = eq.reduced.correction(-full.r)
    return bool(np.linalg.norm(unit * then) < eq.policy.monotonicity_ratio * np.linalg.norm(unit * delta))


def _places(e: Evaluation) -> Evaluation:
    """An evaluation without what is as long as the dofs: only its contacts are asked for."""
    nothing = np.zeros(0)
    return e._replace(r=nothing, f_ext=nothing, data=None, history=())


def _shortened(eq: Equilibrium, u: Array, delta: Array, e: Evaluation, lam: Array) -> Array:
    """Dofs (ndof,) after the fraction of a step from the iterate u of e with the least residual; a failed evaluation is none.

    Closed contact nodes are put at the gap of the linear model, as after a whole step: what a straight one along a curved tool
    leaves is the force of gaps that it changes by the way, so that the shortest looks best.
    """
    best, found = np.inf, u
    for f in eq.policy.line_search_factors:
        moved = contact_corrected(eq.system, eq.context, e, u, f * delta, lam)
        size = eq.norm(eq.evaluate(moved, lam, stiffness=False, section="line search"))
        if size < best:
            best, found = size, moved
    return found if np.isfinite(best) else u + eq.policy.line_search_factors[-1] * delta
