"""Is an equilibrium stable (buckling, snap-through), and what follows if not: cut, another one beside it, a jump, a limit point.

Every attempt is `judged`. Which modes are soft or negative says `softest_modes`; where else there are
equilibria, `other_equilibria`.
"""

from __future__ import annotations

import numpy as np

from prensa.checks.run import RunChecks
from prensa.policy import Policy
from prensa.solver.branches import eigenvalue_across_sets
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.other_equilibria import beside, distance, is_path_independent, jump
from prensa.solver.softest_modes import STABLE, Modes, modes_after, modes_at
from prensa.solver.stabilisation import Stabilisation
from prensa.system.failure import Diverged, Jumped, LimitPoint, NotConverged, Singular, Stagnated, ToolRunaway, Unstable
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.state import Stability, State, may_rest
from prensa.types import Array

JUMPED = "the bodies jump to another equilibrium"
"""What is said of it, by which other messages of a run know that it did."""


def judged(
    eq: Equilibrium, result: NewtonResult, checks: RunChecks, stabilisation: Stabilisation, cutbacks: int, may_cut: bool
) -> NewtonResult:  # fmt: skip
    """The outcome of an attempt with its stability: rejected, replaced by a nearby stable solution, reported, or a limit point.

    An unstable equilibrium is refused as long as shorter increments may find the stable one, which an imperfection leads
    to. Then a stable one is looked for beside it: perfect structures have no other way to leave theirs. Where there is none
    the unstable one is kept, and from there on no more is asked. At a limit point a jump of at most 3 % of the size is accepted
    and reported. A farther one is accepted only if the answer does not depend on the path; otherwise the run ends.
    """
    found = _judged(eq, result, checks, cutbacks, may_cut)
    ends = isinstance(found.reason, LimitPoint) and (at_limit(eq.context, eq.policy) or not may_cut)
    if ends and not found.converged and is_path_independent(eq) and (other := jump(eq, checks)) is not None:
        other.iterations += found.iterations
        found = other
    if may_cut and found.converged and stabilisation.jumped_over(eq.context, found):
        found.converged, found.reason = False, Jumped()
    return found


def _judged(eq: Equilibrium, result: NewtonResult, checks: RunChecks, cutbacks: int, may_cut: bool) -> NewtonResult:
    """As `judged`, but a limit point is always returned as a failure; no `jump` is tried."""
    if not result.converged:
        return _failed(eq, result, cutbacks >= eq.policy.retry_after_cuts, not may_cut)
    positive = eq.reduced.factorisation.positive
    if not positive and rests(eq, result):
        result.rested = True
        return result
    modes = STABLE if positive else modes_after(eq, result)
    if modes is None:
        result.negative = eq.context.state.stability.negative
        return result
    result.softest = modes.stiffness
    if modes.negative and not eq.context.state.stability.negative:
        # The factors are of the iterate before: nothing is refused before the matrix at the solution itself is asked.
        modes = modes_at(eq, result.u, result.lam) or modes
    result.negative = modes.negative
    if not modes.negative and jumped(eq, result):
        limit = at_limit(eq.context, eq.policy)
        if limit and distance(eq, result.u, eq.context.state.u) > eq.policy.branch_distances[-1]:
            result.converged, result.reason = False, LimitPoint(Jumped())
        elif may_cut and not limit:
            result.converged, result.reason = False, Jumped()
        result.jumped = result.converged
    if not modes.negative or eq.context.state.stability.negative:
        return result
    viscous = eq.context.state.stability.viscosity > 0  # short increments are stable then
    c, policy = eq.context, eq.policy
    # First shorter increments: an imperfection leads bodies onto the stable branch, which needs no search.
    cut = may_cut and (viscous or cutbacks < policy.cuts_before_branching)
    short = c.dt < policy.branch_from_share * (c.plan.t1 - c.plan.t0)
    if not viscous and (short or not cut) and (other := beside(eq, result, modes, checks)):
        return other
    if at_limit(c, policy):
        result.converged, result.reason = False, _freed(eq, modes) or LimitPoint(Unstable(modes.negative), modes.least)
    elif cut:
        result.converged, result.reason = False, Unstable(modes.negative)
    return result


def rests(eq: Equilibrium, result: NewtonResult) -> bool:
    """Whether the stability check may be skipped: modes were far from turning, the increment was easy, contact is as it was."""
    e = result.evaluation
    if e is None or not may_rest(eq.context.state):
        return False
    same = all(np.array_equal(f.p > 0, old.closed) for f, old in zip(e.contacts, eq.context.committed))
    return same and result.iterations <= eq.policy.smooth_iterations


def rest(state: State, softest: Array, policy: Policy) -> int:
    """How many increments may skip the stability check if the softest stiffnesses (modes,) go on changing as since the last.

    None of them may lose more than a part of its stiffness then: that of a mode which turns falls linearly with what drives it,
    and next to a limit point as the root of the distance, so that checks become frequent in time. At most twice as many as last
    time.
    """
    known, before = state.stability, state.softest
    if not state.dt_last > 0 or len(before) != len(softest) or not (softest > 0).all():
        return 0
    passed = known.since + 1
    fall = (before - softest) / (passed * softest)
    least = policy.stiffness_loss_share / max(float(fall.max(initial=0.0)), policy.stiffness_loss_share /
        policy.max_unwatched) if len(fall) else 0.0
    return min(int(least), 2 * passed)


def looked(stability: Stability, state: State, result: NewtonResult, policy: Policy) -> tuple[Stability, Array]:
    """Stability data of the next state, after an increment with that ``result``, and the softest stiffnesses (modes,)."""
    if result.rested:
        return stability._replace(since=state.stability.since + 1, rest=state.stability.rest), state.softest
    if result.softest is None:
        return stability._replace(since=0, rest=0), np.zeros(0)
    return stability._replace(since=0, rest=rest(state, result.softest, policy)), result.softest


def stability_warnings(c: Context, result: NewtonResult) -> list[str]:
    """What there is to say of the stability of a converged increment."""
    place = f"step {c.plan.name!r}, time {c.time:.6g}"
    if result.beside:
        return [
            f"{place}: the bodies buckle. The equilibrium that they were in is unstable from here on and the run follows a "
            "stable one nearby; a small imperfection of the shape or the load decides which one a real body takes"
        ]
    has_viscous_forces = c.state.stability.viscosity > 0
    if result.jumped:
        follows = "" if has_viscous_forces else ": 'stabilise: auto' does, and reports what the jump dissipates"
        return [
            f"{place}: {JUMPED} within one increment; shorter ones could not follow the way there{follows}"
        ]
    if result.negative and not c.state.stability.negative:
        ways = "one mode" if result.negative == 1 else f"{result.negative} modes"
        means = " or more 'increments'" if has_viscous_forces else ", more 'increments' or 'stabilise: auto'"
        return [
            f"{place}: the equilibrium is unstable from here on (in {ways}) and no stable one was found beside it: real bodies "
            f"jump away from it; allow that by an imperfection of the shape{means}"
        ]
    return []


def jumped(eq: Equilibrium, result: NewtonResult) -> bool:
    """Whether an increment leads past unstable states, so that its end is on another branch than its start.

    Only asked where the iteration was long, or a contact opens as a whole, and the end is not where the last increments led, or
    at the beginning of a step the linearised system: it makes matrices.
    """
    state, policy, system = eq.context.state, eq.policy, eq.system
    comes_off = _comes_off(eq, result)
    if result.iterations <= policy.easy_iterations and not comes_off:
        return False
    du = result.u - state.u
    ahead = state.extrapolated(eq.context.extrapolated_for) if state.dt_last > 0 else result.linear
    if ahead is not None:
        predicted = system.displacement(ahead)
        if np.abs(system.displacement(du) - predicted).max() <= policy.max_prediction_error * np.abs(predicted).max():
            return False
    # Between two stable states there are unstable ones: the way from one to the other shows them.
    for share in policy.jump_samples:
        modes = modes_at(eq, system.with_slaves(state.u + share * du), result.lam, mode=False)
        if modes is None:
            return False
        if modes.negative:
            return True
    # a tool that comes off leaves the straight way to its end free of contact, while just ahead of the start it begins to slide
    return comes_off and state.dt_last > 0 and _extrapolated_modes(eq) is not None


def _comes_off(eq: Equilibrium, result: NewtonResult) -> bool:
    """Whether all points of a contact are open at the end that were not at the start."""
    e = result.evaluation
    pairs = zip(eq.context.committed, e.contacts) if e is not None else ()
    return any(bool(before.closed.any() and not (f.p > 0).any()) for before, f in pairs)


def _failed(eq: Equilibrium, result: NewtonResult, short: bool, last: bool) -> NewtonResult:
    """A failure is a limit point where short increments too end at matrices with a negative mode, or the last just beside one."""
    reason = result.reason
    if isinstance(reason, Stagnated | NotConverged | Diverged | Unstable):
        limit = at_limit(eq.context, eq.policy)
        if (short or last or limit) and (modes := _turning(eq, result, last and limit)):
            result.reason = _freed(eq, modes) or LimitPoint(reason, modes.least)
        elif (last or limit) and (eigenvalue := eigenvalue_across_sets(eq, result)) is not None:
            result.reason = LimitPoint(reason, eigenvalue, across=True)
    elif isinstance(reason, Singular):
        # a singular matrix may be an iterate that jumped, or a body losing its last support; only the former has a negative
        # mode just ahead
        brief = eq.context.dt < eq.policy.min_share * (eq.context.plan.t1 - eq.context.plan.t0)
        if brief and (modes := _extrapolated_modes(eq)) is not None and _freed(eq, modes) is None:
            result.reason = LimitPoint(reason, modes.least)
    return result


def _freed(eq: Equilibrium, modes: Modes) -> ToolRunaway | None:
    """The tool that a mode moves much more than any body: it spins or slides on against friction that has no more to give."""
    system = eq.system
    for number, tool in enumerate(system.tools):
        way = np.abs(system.place_of(number, modes.mode))
        way[system.dofs.dimension :] *= system.length
        # A mode that moves the tool alone is no limit point of the bodies: it is the tool that comes free.
        if way.max() > eq.policy.tool_mode_ratio:
            return ToolRunaway(tool.name, system.dofs.tool.components[int(np.argmax(way))])
    return None


def _turning(eq: Equilibrium, result: NewtonResult, beside: bool) -> Modes | None:
    """The modes of the last iterate if one is negative or, ``beside``, its softest leads to a state with one at once.

    The modes are recomputed from the matrix at the last iterate, since the factors in memory may be of a contact step. Past a
    limit point iterates wander to and fro across it, so that the last one is as often before it as behind. Where the last point
    that sticks is about to slide, no mode is soft before it does: then the states are checked to which the last increment leads.
    """
    modes = modes_at(eq, result.u, result.lam)
    if modes is None or modes.negative or not beside:
        return modes if modes is not None and modes.negative else None
    step = eq.policy.branch_distances[0] * eq.system.length * modes.mode
    there = (modes_at(eq, eq.system.with_slaves(result.u + sign * step), result.lam) for sign in (1.0, -1.0))
    return next((at for at in there if at is not None and at.negative), None) or _extrapolated_modes(eq)


def _extrapolated_modes(eq: Equilibrium) -> Modes | None:
    """The modes of the first state that the last increment leads on to and that has a negative one."""
    state = eq.context.state
    way = float(np.abs(eq.system.displacement(state.du)).max())
    shares = [far * eq.system.length / way for far in eq.policy.extrapolation_ratios] if way > 0.0 else []
    lam = eq.system.initial_multipliers(state)
    led = (modes_at(eq, eq.system.with_slaves(state.u + share * state.du), lam) for share in shares)
    return next((at for at in led if at is not None and at.negative), None)


def at_limit(c: Context, policy: Policy) -> bool:
    """Whether an increment is so short that a limit point cannot be approached any further in a way that matters."""
    return not c.state.stability.viscosity > 0 and c.dt < policy.limit_point_share * (c.plan.t1 - c.plan.t0)


