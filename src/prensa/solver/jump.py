"""Snap-through of bodies without history: overdamped motion from where their path ends to the next stable equilibrium.

What is elastic and smooth has a potential, and its equilibria depend on where the tools are alone. Where none of them
follows on the last one, the bodies go on by themselves. They are let do so at standing tools, against viscous forces, by implicit
Euler steps as long as these converge and move the bodies by little (pseudo-transient continuation: Kelley and Keyes 1998,
SIAM J. Numer. Anal. 35, 508). None of these places is committed, so that viscous forces have no part in the answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from prensa.solver.attempt import attempt_from
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.stabilisation import Drag, nodal_volumes
from prensa.system.outcome import NewtonResult
from prensa.system.system import Evaluation, System
from prensa.types import Array


def is_path_independent(eq: Equilibrium) -> bool:
    """Whether the equilibrium does not depend on the path: elastic bodies, smooth contacts, and all motions prescribed.

    Beyond a limit *force* a body goes as far as it takes to bear the force elsewhere: that is for the user to decide on.
    """
    c, system = eq.context, eq.system
    return (
        not system.has_memory
        and not c.state.stability.viscosity > 0
        and all(law is None for law in c.laws)
        and c.driven_by_ways
    )


def jump(eq: Equilibrium, mode: Array, stiff: float, stable: Callable[[NewtonResult], bool]) -> NewtonResult | None:
    """The stable equilibrium that bodies come to from the last one, pushed along its softest ``mode`` (ndof,); None if none.

    ``stiff``: stiffness of a mode that holds. They are pushed the way that they were going, the other way where that leads
    back, and farther where both do: a contact point that just opens holds them against the least push. A jump sets energy free.
    """
    c, policy = eq.context, eq.policy
    nodal = eq.system.dofs.displacement.slice
    way = -1.0 if float(c.state.du[nodal] @ mode[nodal]) < 0 else 1.0
    u = c.state.u.copy()
    u[c.plan.fixed] = c.plan.values(c.time)
    before, spent = _stored(eq, eq.evaluate(u, c.state.lam, stiffness=False)), 0
    for push in [sign * share for share in policy.branch_distances for sign in (way, -way)]:
        found = _at_rest(eq, eq.system.with_slaves(u + push * eq.system.length * mode), stiff, stable)
        spent += found.iterations
        e = found.evaluation
        away = found.converged and _apart(eq.system, found.u, u) > policy.branch_distances[0]
        if away and e is not None and _stored(eq, e) < before:
            found.iterations, found.jumped = spent, True
            return found
    return None


def _at_rest(eq: Equilibrium, u: Array, drag: float, stable: Callable[[NewtonResult], bool]) -> NewtonResult:
    """Where bodies come to rest from the dofs u (ndof,) on, in a stable equilibrium; the last attempt at one if nowhere."""
    system, policy, spent = eq.system, eq.policy, 0
    volumes = nodal_volumes(system)
    share = volumes / volumes.mean()
    found = NewtonResult(False, None, u, None, eq.context.state.lam, 0)
    for _ in range(policy.max_jump_steps):
        interactions = [*eq.context.interactions, Drag(system, drag * share, u)]
        dragged = attempt_from(replace(eq, context=replace(eq.context, interactions=interactions)), u)
        spent += dragged.iterations
        moved = _apart(system, dragged.u, u) if dragged.converged else np.inf
        if not moved <= policy.branch_distances[-1]:
            drag *= policy.jump_drag_factor
            continue
        u = dragged.u
        if dragged.iterations <= policy.easy_iterations:
            drag /= policy.jump_drag_factor
        if moved > policy.branch_distances[0]:
            continue
        found = attempt_from(eq, u)
        spent += found.iterations
        if found.converged and _apart(system, found.u, u) <= policy.branch_distances[-1] and stable(found):
            break
        found.converged = False
    found.iterations = spent
    return found


def _stored(eq: Equilibrium, e: Evaluation) -> float:
    """Energy of the bodies and of the contacts' penetration; without an end where it could not be evaluated."""
    if e.failed:
        return np.inf
    return eq.system.elastic_energy(e.history) + eq.system.contact_energy(e.contacts, eq.context.scales)


def _apart(system: System, u: Array, v: Array) -> float:
    """Largest displacement of a node between dofs u and v (ndof,), over the size of the bodies."""
    return float(np.abs(system.displacement(u) - system.displacement(v)).max()) / system.length
