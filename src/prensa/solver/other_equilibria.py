"""Other equilibria than the one that the last increments led to: beside an unstable one, or beyond a limit point.

Beside it is a stable one where perfect structures buckle: attempts begin along the unstable mode (`beside`). What is elastic
and smooth has a potential, and its equilibria depend on where the tools are alone. Where none of them follows on the last one,
the bodies go on by themselves (`jump`): at standing tools, against viscous forces, by implicit Euler steps as long as these
converge and move the bodies by little (pseudo-transient continuation: Kelley and Keyes 1998, SIAM J. Numer. Anal. 35, 508). None
of these places is committed, so that viscous forces have no part in the answer.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from prensa.checks.run import RunChecks
from prensa.solver.attempt import attempt_from
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.softest_modes import Modes, modes_after, modes_at
from prensa.solver.stabilisation import Drag, nodal_volumes
from prensa.system.outcome import NewtonResult
from prensa.system.system import Evaluation
from prensa.types import Array


def distance(eq: Equilibrium, u: Array, v: Array) -> float:
    """Largest displacement of a node between dofs u and v (ndof,), over the size of the bodies."""
    return float(np.abs(eq.system.displacement(u) - eq.system.displacement(v)).max()) / eq.system.length


def beside(eq: Equilibrium, result: NewtonResult, modes: Modes, checks: RunChecks) -> NewtonResult | None:
    """A stable equilibrium beside an unstable one, along its mode, the way that the bodies were going; None if not found."""
    spent, u = result.iterations, result.u
    nodal, way = eq.system.dofs.displacement.slice, _way(eq, u - eq.context.state.u, modes.mode)
    # From near to far: a stable equilibrium farther away may be beyond another jump.
    for share in eq.policy.branch_distances:
        found = []
        for sign in (way, -way):
            other = attempt_from(eq, u + sign * share * eq.system.length * modes.mode)
            spent += other.iterations
            if other.converged and not checks.refusal(eq.context, other):
                at = modes_after(eq, other)
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


def is_path_independent(eq: Equilibrium) -> bool:
    """Whether the equilibrium does not depend on the path: elastic bodies, smooth contacts, and all motions prescribed.

    Beyond a limit *force* a body goes as far as it takes to carry the force elsewhere: that is for the user to decide on.
    """
    c, system = eq.context, eq.system
    return (
        not system.has_memory
        and not c.state.stability.viscosity > 0
        and all(law is None for law in c.laws)
        and c.driven_by_ways
    )


def jump(eq: Equilibrium, checks: RunChecks) -> NewtonResult | None:
    """The stable equilibrium that bodies jump to by themselves from the last one; None if it is not found.

    They are pushed along its softest mode the way that they were going, the other way where that leads back, and farther where
    both do: a contact point that just opens holds them against the least push. A jump sets energy free.
    """
    c, policy = eq.context, eq.policy
    u = c.state.u.copy()
    u[c.plan.fixed] = c.plan.values(c.time)
    modes = modes_at(eq, eq.system.with_slaves(u), eq.system.initial_multipliers(c.state))
    if modes is None:
        return None
    way, stiff = _way(eq, c.state.du, modes.mode), float(np.abs(modes.stiffness).max())
    before, spent = _stored(eq, eq.evaluate(u, c.state.lam, stiffness=False)), 0
    for push in [sign * share for share in policy.branch_distances for sign in (way, -way)]:
        found = _at_rest(eq, eq.system.with_slaves(u + push * eq.system.length * modes.mode), stiff, checks)
        spent += found.iterations
        e = found.evaluation
        away = found.converged and distance(eq, found.u, u) > policy.branch_distances[0]
        if away and e is not None and _stored(eq, e) < before:
            found.iterations, found.jumped = spent, True
            return found
    return None


def _at_rest(eq: Equilibrium, u: Array, drag: float, checks: RunChecks) -> NewtonResult:
    """Where bodies come to rest from the dofs u (ndof,) on, in a stable equilibrium; the last attempt at one if nowhere."""
    system, policy, spent = eq.system, eq.policy, 0
    volumes = nodal_volumes(system)
    share = volumes / volumes.mean()
    found = NewtonResult(False, None, u, None, eq.context.state.lam, 0)
    for _ in range(policy.max_jump_steps):
        interactions = [*eq.context.interactions, Drag(system, drag * share, u)]
        dragged = attempt_from(replace(eq, context=replace(eq.context, interactions=interactions)), u)
        spent += dragged.iterations
        moved = distance(eq, dragged.u, u) if dragged.converged else np.inf
        if not moved <= policy.branch_distances[-1]:
            # No drag is left in the answer: it may be any size with which the next step converges and moves by little.
            drag *= policy.jump_drag_factor
            continue
        u = dragged.u
        if dragged.iterations <= policy.easy_iterations:
            drag /= policy.jump_drag_factor
        if moved > policy.branch_distances[0]:
            continue
        found = attempt_from(eq, u)
        spent += found.iterations
        if found.converged and distance(eq, found.u, u) <= policy.branch_distances[-1] and _stable(eq, found, checks):
            break
        found.converged = False
    found.iterations = spent
    return found


def _stored(eq: Equilibrium, e: Evaluation) -> float:
    """Energy of the bodies and of the contacts' penetration; without an end where it could not be evaluated."""
    if e.failed:
        return np.inf
    return eq.system.elastic_energy(e.history) + eq.system.contact_energy(e.contacts, eq.context.scales)


def _stable(eq: Equilibrium, found: NewtonResult, checks: RunChecks) -> bool:
    """Whether a converged attempt is acceptable and has no negative mode; it learns its softest ones."""
    at = None if checks.refusal(eq.context, found) else modes_after(eq, found)
    found.softest = at.stiffness if at is not None else None
    return at is not None and not at.negative


def _way(eq: Equilibrium, du: Array, mode: Array) -> float:
    """Sign with which a mode (ndof,) goes the way of a change du (ndof,) of the dofs."""
    nodal = eq.system.dofs.displacement.slice
    return -1.0 if float(du[nodal] @ mode[nodal]) < 0 else 1.0
