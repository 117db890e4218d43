"""Is an equilibrium stable? The lowest modes of Newton's matrix, from the factors at hand.

An equilibrium is left for another one, without any change of what drives it, where the matrix has a negative eigenvalue. Of
the direct solvers only LDLᵀ counts those (Sylvester's law of inertia): where it finds none there is nothing to look for. LU has
no inertia, its determinant only the parity, and multipliers add negative ones that mean nothing. There the modes are looked at
themselves: a block of forces goes through the factors twice, which leaves the softest modes (subspace iteration; Bathe 1996,
11.6), and the eigenvalues of the map from forces on the free displacements and tools to their displacements, within that block,
say how these answer. Where the symmetric part of the matrix is positive definite none of them can be negative, whatever the
block; where multipliers hold points, what they hold does not move.

Modes that go soft with compression are the lowest ones long before they turn, so that a few columns find them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.checks.run import RunChecks
from prensa.linear.factorisations import SingularError
from prensa.linear.reduction import Reduced
from prensa.policy import Policy
from prensa.solver.attempt import attempt_from
from prensa.solver.branches import eigenvalue_across_sets
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.jump import is_path_independent, jump
from prensa.system.failure import Diverged, Jumped, LimitPoint, NotConverged, Singular, Stagnated, ToolRunaway, Unstable
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.state import Stability, State, may_rest
from prensa.system.system import System
from prensa.types import Array, Flags


class Modes(NamedTuple):
    """The softest modes of a matrix: how many of them are ``negative``, the ``least`` eigenvalue, its ``mode`` (ndof,).

    Eigenvalues are stiffnesses of modes of unit length, ``stiffness`` (modes,) all of them in order. The mode has a largest
    displacement of 1.
    """

    negative: int
    least: float
    mode: Array
    stiffness: Array


STABLE = Modes(0, np.inf, np.zeros(0), np.zeros(0))


def softest_modes(system: System, reduced: Reduced, policy: Policy, exactly: bool = False) -> Modes | None:
    """The softest modes of the matrix of the last factors; None if there are no factors, nothing is free, or they do not tell.

    exactly: of the last matrix itself, to which factors that do not tell them are only a help; None where that is too little.
    """
    factors, free = reduced.factorisation, reduced.free
    bodily = free < system.dofs.tool.slice.stop  # multipliers come last
    if not factors.factored or not bodily.any():
        return None
    columns = min(policy.watched_modes, int(bodily.sum()))
    forces = None
    for sweep in range(policy.max_mode_sweeps):
        basis = _begun(reduced, bodily, columns) if forces is None else np.linalg.qr(forces)[0]
        answer = factors.exactly(basis, policy.mode_residual_share) if exactly else factors.solve_with_factors(basis)
        if answer is None or not np.isfinite(answer).all():
            return None
        forces = np.where(bodily[:, None], answer, 0.0)
        compliance, vectors = np.linalg.eig(basis.T @ forces)
        negative = (compliance.real < 0) & (np.abs(compliance.imag) <= policy.max_mode_residual * np.abs(compliance))
        if not negative.any():
            if sweep > 0:
                break
            continue
        # a negative one counts when it is an eigenvalue, not only a Ritz value of a block that is not there yet
        error = np.linalg.norm(forces @ vectors - (basis @ vectors) * compliance, axis=0)
        sure = negative & (error <= policy.max_mode_residual * np.abs(compliance))
        if sweep > 0 and sure.any() and (sure == negative).all():
            break
        negative = sure
    softest = vectors[:, int(np.argmax(np.abs(compliance)))]
    if not exactly and not factors.resolves_soft_modes((basis @ softest).real, (answer @ softest).real):
        return None
    stiffness = 1.0 / np.where(compliance == 0, np.inf, compliance).real
    at = int(np.argmin(np.where(negative, compliance.real, np.inf)) if negative.any() else np.argmax(compliance.real))
    mode = reduced.restriction.whole((basis @ vectors[:, at]).real, system.ndof)
    mode /= max(float(np.abs(mode[system.dofs.displacement.slice]).max()), 1e-300)
    return Modes(int(negative.sum()), float(stiffness[at]), mode, np.sort(stiffness))


def _begun(reduced: Reduced, bodily: Flags, columns: int) -> Array:
    """Orthonormal forces (f, columns) on ``bodily`` degrees of freedom (f,) to begin with, the same ones each time."""
    kept = reduced.kept.get("forces")
    if kept is None:
        random = np.random.default_rng(0).standard_normal((len(bodily), columns))
        kept = np.linalg.qr(np.where(bodily[:, None], random, 0.0))[0]
        if len(bodily) < reduced.policy.reuse_max_unknowns:  # of large systems they take more room than making them takes time
            reduced.kept["forces"] = kept
    return kept


# ------------------------------------------------------------------------------------------------------ what follows from it
def judged(eq: Equilibrium, result: NewtonResult, checks: RunChecks, cutbacks: int, may_cut: bool) -> NewtonResult:
    """The outcome of an attempt with its stability: rejected, replaced by a nearby stable solution, reported, or a limit point.

    An unstable equilibrium is refused as long as shorter increments may find the stable one, which an imperfection leads
    to. Then a stable one is looked for beside it: perfect structures have no other way to leave theirs. Where there is none
    the unstable one is kept, and from there on no more is asked. A jump to a stable one as near as those beside is taken at a
    limit point and told; a farther one is, where the way there is no part of the answer, and ends the run elsewhere.
    """
    found = _judged(eq, result, checks, cutbacks, may_cut)
    ends = isinstance(found.reason, LimitPoint) and (at_limit(eq.context, eq.policy) or not may_cut)
    if found.converged or not ends or not is_path_independent(eq):
        return found
    return _jump(eq, found.iterations, checks) or found


def _jump(eq: Equilibrium, spent: int, checks: RunChecks) -> NewtonResult | None:
    """The stable equilibrium that bodies jump to by themselves (see `prensa.solver.jump`); None if it is not found."""
    c = eq.context
    u = c.state.u.copy()
    u[c.plan.fixed] = c.plan.values(c.time)
    modes = _at(eq, eq.system.with_slaves(u), eq.system.initial_multipliers(c.state))
    if modes is None:
        return None

    def stable(other: NewtonResult) -> bool:
        at = None if checks.refusal(c, other) else _of(eq, other)
        other.softest = at.stiffness if at is not None else None
        return at is not None and not at.negative

    other = jump(eq, modes.mode, float(np.abs(modes.stiffness).max()), stable)
    if other is not None:
        other.iterations += spent
    return other


def _judged(eq: Equilibrium, result: NewtonResult, checks: RunChecks, cutbacks: int, may_cut: bool) -> NewtonResult:
    """As `judged`, with every limit point told."""
    if not result.converged:
        return _failed(eq, result, cutbacks >= eq.policy.retry_after_cuts, not may_cut)
    positive = eq.reduced.factorisation.positive
    if not positive and rests(eq, result):
        result.rested = True
        return result
    modes = STABLE if positive else _of(eq, result)
    if modes is None:
        result.negative = eq.context.state.stability.negative
        return result
    result.softest = modes.stiffness
    if modes.negative and not eq.context.state.stability.negative:
        modes = _at(eq, result.u, result.lam) or modes
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
    cut = may_cut and (viscous or cutbacks < policy.cuts_before_branching)
    short = c.dt < policy.branch_from_share * (c.plan.t1 - c.plan.t0)
    if not viscous and (short or not cut) and (other := _beside(eq, result, modes, checks)):
        return other
    if at_limit(c, policy):
        result.converged, result.reason = False, _freed(eq, modes) or LimitPoint(Unstable(modes.negative), modes.least)
    elif cut:
        result.converged, result.reason = False, Unstable(modes.negative)
    return result


def rests(eq: Equilibrium, result: NewtonResult) -> bool:
    """Whether the modes need no look after an increment: they were far from turning, it was easy, and contact is as it was."""
    e = result.evaluation
    if e is None or not may_rest(eq.context.state):
        return False
    same = all(np.array_equal(f.p > 0, old.closed) for f, old in zip(e.contacts, eq.context.committed))
    return same and result.iterations <= eq.policy.smooth_iterations


def rest(state: State, softest: Array, policy: Policy) -> int:
    """Increments that may pass until modes (modes,) are looked at again, if they go on changing as since the last look.

    None of them may lose more than a part of its stiffness then: that of a mode which turns falls linearly with what drives it,
    and next to a limit point as the root of the distance, so that looks become frequent in time. The rest grows by doubling.
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
    """What the next increment knows of the modes after one with that ``result``: their stability and stiffnesses (modes,)."""
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
            f"{place}: the bodies jump to another equilibrium within one increment; shorter ones could not follow the way "
            f"there{follows}"
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

    Only asked where the iteration was long and the end is not where the last increments led, or at the beginning of a step the
    linearised system: matrices are made for it.
    """
    state, policy, system = eq.context.state, eq.policy, eq.system
    if result.iterations <= policy.easy_iterations:
        return False
    du = result.u - state.u
    ahead = state.extrapolated(eq.context.dt) if state.dt_last > 0 else result.linear
    if ahead is not None:
        foretold = system.displacement(ahead)
        if np.abs(system.displacement(du) - foretold).max() <= policy.max_prediction_error * np.abs(foretold).max():
            return False
    for share in policy.jump_samples:
        modes = _at(eq, system.with_slaves(state.u + share * du), result.lam, mode=False)
        if modes is None:
            return False
        if modes.negative:
            return True
    return False


def distance(eq: Equilibrium, u: Array, v: Array) -> float:
    """Largest displacement of a node between dofs u and v (ndof,), over the size of the bodies."""
    return float(np.abs(eq.system.displacement(u) - eq.system.displacement(v)).max()) / eq.system.length


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
        # an iterate that has jumped may hang on nothing; so does a body that comes free, but nothing turns before it does
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
        if way.max() > eq.policy.tool_mode_ratio:
            return ToolRunaway(tool.name, system.dofs.tool.components[int(np.argmax(way))])
    return None


def _turning(eq: Equilibrium, result: NewtonResult, beside: bool) -> Modes | None:
    """The modes of the last iterate if one is negative or, ``beside``, its softest leads to a state with one at once.

    The factors at hand are not asked: contact steps and other attempts came after the iterate. Past a limit point iterates
    wander to and fro across it, so that the last one is as often before it as behind. Where the last point that sticks is about
    to slide, no mode is soft before it does: then the states are asked to which the last increment leads on.
    """
    modes = _at(eq, result.u, result.lam)
    if modes is None or modes.negative or not beside:
        return modes if modes is not None and modes.negative else None
    step = eq.policy.branch_distances[0] * eq.system.length * modes.mode
    there = (_at(eq, eq.system.with_slaves(result.u + sign * step), result.lam) for sign in (1.0, -1.0))
    return next((at for at in there if at is not None and at.negative), None) or _extrapolated_modes(eq)


def _extrapolated_modes(eq: Equilibrium) -> Modes | None:
    """The modes of the first state that the last increment leads on to and that has a negative one."""
    state = eq.context.state
    way = float(np.abs(eq.system.displacement(state.du)).max())
    shares = [far * eq.system.length / way for far in eq.policy.extrapolation_ratios] if way > 0.0 else []
    lam = eq.system.initial_multipliers(state)
    led = (_at(eq, eq.system.with_slaves(state.u + share * state.du), lam) for share in shares)
    return next((at for at in led if at is not None and at.negative), None)


def at_limit(c: Context, policy: Policy) -> bool:
    """Whether an increment is so short that a limit point cannot be approached any further in a way that matters."""
    return not c.state.stability.viscosity > 0 and c.dt < policy.limit_point_share * (c.plan.t1 - c.plan.t0)


def _of(eq: Equilibrium, result: NewtonResult) -> Modes | None:
    """The modes of a converged attempt, from its last factors where there are any.

    A contact step may have left none, and those at hand may be of an increment before: then of the matrix at the end, whose
    factors, of double precision, take twice the room.
    """
    factors = eq.reduced.factorisation
    if factors.factored and factors.may_resolve_soft_modes and (modes := softest_modes(eq.system, eq.reduced,
        eq.policy)) is not None:
        return modes
    if factors.factored and (modes := softest_modes(eq.system, eq.reduced, eq.policy, exactly=True)) is not None:
        return modes
    return _at(eq, result.u, result.lam, mode=False)


def _at(eq: Equilibrium, u: Array, lam: Array, mode: bool = True) -> Modes | None:
    """The modes of the matrix at the dofs u (ndof,) themselves: the last factors are of the iterate before, or of another.

    ``mode``: whether the softest one is wanted where none is negative, too.
    """
    e = eq.evaluate(u, lam)
    if e.failed:
        return None
    try:
        eq.reduced.solve(eq.reduced.matrix(e, -e.r, spent=True), -e.r)
    except SingularError:
        return None
    if eq.reduced.factorisation.positive and not mode:
        return STABLE
    return softest_modes(eq.system, eq.reduced, eq.policy)


def _beside(eq: Equilibrium, result: NewtonResult, modes: Modes, checks: RunChecks) -> NewtonResult | None:
    """A stable equilibrium beside an unstable one, along its mode, the way that the bodies were going; None if not found."""
    spent, u = result.iterations, result.u
    nodal = eq.system.dofs.displacement.slice
    way = -1.0 if float((u - eq.context.state.u)[nodal] @ modes.mode[nodal]) < 0 else 1.0
    for share in eq.policy.branch_distances:
        found = []
        for sign in (way, -way):
            other = attempt_from(eq, u + sign * share * eq.system.length * modes.mode)
            spent += other.iterations
            if other.converged and not checks.refusal(eq.context, other):
                at = _of(eq, other)
                if at is not None and not at.negative:
                    found.append(other)
        if found:
            # the nearer one: the other may be beyond a jump
            other = min(found, key=lambda one: np.abs((one.u - eq.context.state.u)[nodal]).max().round(12))
            other.iterations = spent
            # beyond a bifurcation the deflection grows with the root of the load (Koiter 1945), so with that of the increment; a
            # jump is as far however short the increment is
            c = eq.context
            other.jumped = distance(eq, other.u, u) > eq.policy.buckling_max_ratio * (c.dt / (c.plan.t1 - c.plan.t0)) ** 0.5
            other.beside = not other.jumped
            return other
    return None
