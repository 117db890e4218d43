"""Release of forces in a step (springback): what supports, tools and loads carry at its start beyond what it asks for.

A jump of forces is in no equilibrium that an increment, however short, comes near to, and its way depends on the iteration.
So whatever changes between two steps starts from the force that it carries: the difference is kept as dead forces, which go
linearly to zero over the step, as those do that a case starts with (`system/start.py`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from prensa.errors import coordinates
from prensa.model.fields import force_along, motions_in
from prensa.system.planning import plan_step
from prensa.system.schedule import StepPlan
from prensa.system.self_equilibrated import self_equilibrated_forces, self_equilibrated_stiffness
from prensa.system.state import State
from prensa.system.system import NOTHING, System
from prensa.types import Array, Index


def release_forces(system: System, state: State, plan: StepPlan) -> Array | None:
    """Forces (ndof,) carried in the committed state in which the step before ended, less those of a plan at its start.

    What is left of those that the step before was releasing when it ended early is among them.

    Zero where it prescribes a tool's motion, and where a tool begins to roll; None if there is nothing to release.
    """
    before = plan_step(system, plan.number - 1, state.step_start, state.ends)
    carried = system.external(system.context(state, before, state.clock.time), state.u)
    asked = system.external(system.context(replace(state, release=None, self_equilibrated=None), plan, plan.t0), state.u)
    if before.control is not None:  # what its factor has come to is not known any more, what acts on free dofs is
        carried = np.where(np.isin(np.arange(system.ndof), before.held), carried, state.work)
    out = carried - asked
    # Reactions are no external forces: what a support held that this step frees is in the nodal forces alone.
    freed = np.setdiff1d(before.held, plan.held)
    out[freed] += state.work[freed] - carried[freed]
    # A tool whose motion is prescribed has any force that its motion needs: nothing of it is to be released.
    out[plan.held[system.dofs.tool.owns(plan.held)]] = 0.0
    out[_rolling(system, state, plan)] = 0.0
    return out if np.abs(out).sum() > NOTHING * np.abs(state.work).sum() else None


def removed_tools(system: System, state: State, plan: StepPlan) -> State:
    """The committed state at the start of the step in which the tools are removed, in a system without them.

    The forces that the bodies need for equilibrium beyond what is asked, those of the contacts among them, are released. What the
    springs of contacts and tools had stored leaves with the tools.
    """
    alone = replace(state, release=None, self_equilibrated=None)
    c = replace(system.context(alone, plan, plan.t0), dt=1.0)  # no time passes; nothing moves, so rates are 0 over any
    e = system.evaluate(c, state.u, state.lam, stiffness=False)
    missing = system.to_masters(e.r)
    release = missing.copy()
    release[_held_on(system, state, plan)] = 0.0
    work = e.f_ext + release
    work[plan.fixed] += (missing - release)[plan.fixed]
    for s in system.removed:
        if s.exact:
            release[s.unknowns] = work[s.unknowns] = 0.0
    self_equilibrated = None
    # Dead forces turn a body that turns as it springs back; K y has no moment on any shape (self_equilibrated.py).
    if system.problem.kinematics == "finite" and not system.axisymmetric:  # elsewhere dead forces stay in balance too
        self_equilibrated = self_equilibrated_stiffness(system, state)
        release -= self_equilibrated_forces(system, state.u, self_equilibrated)
    u = state.u.copy()
    for s in system.removed:
        if s.exact:
            u[s.unknowns] = 0.0
    energy, stored = state.energy, system.elastic_energy(state.history)
    away = energy.contact + energy.elastic - stored
    energy = energy._replace(external=energy.external - away, elastic=stored, contact=0.0)
    contact = state.contact
    contact = replace(contact, closed=np.zeros_like(contact.closed), traction=np.zeros_like(contact.traction))
    return replace(
        state, u=u, step_start=u, lam=np.zeros_like(state.lam), contact=contact, work=work, energy=energy,
        release=release, self_equilibrated=self_equilibrated,
    )  # fmt: skip


def minimal_supports_in_words(system: System, plan: StepPlan) -> str:
    """Where released bodies are held for want of other supports, in words; '' if they are nowhere."""
    field, parts = system.dofs.displacement, []
    for g in plan.groups:
        if g.found:
            node, axis = (int(v) for v in field.split(g.dofs[0]))
            body = system.body_of(node)
            at = coordinates(system.X[node])
            parts.append(f"{body!r} along {'xyz'[axis]} at node {node - system.offsets[body]} (initially at {at})")
    if not parts:
        return ""
    return f"step {plan.name!r} holds {', '.join(parts)}: against rigid-body motions; the reactions there are zero"


def _held_on(system: System, state: State, plan: StepPlan) -> Index:
    """What a step holds that was held before too: it goes on with its force. All tools are among it."""
    groups = [g for g in plan.groups if not g.found]
    held = np.concatenate([np.zeros(0, dtype=np.int64), *(g.dofs for g in groups)])
    if plan.number:
        before = plan_step(system, plan.number - 1, state.step_start, state.ends).held
        held = held[np.isin(held, before) | system.dofs.tool.owns(held)]
    return held


def _rolling(system: System, state: State, plan: StepPlan) -> list[int]:
    """Rotations of tools that begin to roll: free to turn, moved along rather than into the bodies, never mentioned before.

    Such a tool was held for want of a word; the moment that it has belongs to the points that it leaves behind as it rolls.
    """
    d, space = system.dofs.dimension, system.problem.space
    now, earlier = system.problem.steps[plan.number], system.problem.steps[: plan.number]
    way = np.zeros(system.ndof)
    way[plan.fixed] = plan.values(plan.t1) - plan.values(plan.t0)
    out = []
    for t, name in enumerate(system.problem.tools):
        goes, force = (system.place_of(t, v)[:d] for v in (way, state.work))
        about = np.atleast_1d(np.cross(goes, force)) if d == 3 else [goes[0] * force[1] - goes[1] * force[0]]
        for turn, moment, dof in zip(motions_in(space)[d:], about, system.dofs.tool.dofs(t)[d:].tolist()):
            key = force_along(space, turn)
            said = any(
                getattr(kind.get(name), word, None) is not None
                for step in earlier
                for kind, word in ((step.move, turn), (step.velocity, turn), (step.push, key))
            )
            if getattr(now.push.get(name), key, None) == 0 and not said and abs(moment) > abs(goes @ force):
                out.append(dof)
    return out


def release_in_words(system: System, state: State, plan: StepPlan) -> str:
    """What a step releases, in words, and how much of it the committed state still carries; '' if nothing."""
    if state.release is None:
        return ""
    parts, at_start = [], replace(state, u=state.step_start, clock=state.clock._replace(time=plan.t0))
    release = system.being_released(at_start, plan)
    for group in plan.released:
        force = float(release[group.dofs].sum())
        if group.support is not None and force != 0.0:
            parts.append(f"support {group.support[0]!r} ({force:.4g} along {group.support[1]})")
    for t, tool in enumerate(system.tools):
        for key, force in zip(system.dofs.tool.components, system.place_of(t, release)):
            if force != 0.0:
                way = "to turn" if key.startswith("r") else f"along {key}"
                parts.append(f"tool {tool.name!r} ({force:.4g} {way})")
    if not parts:
        return ""
    gone = 100.0 * (1.0 - plan.left(state.clock.time))
    return (
        f"The step releases {', '.join(parts)}, of which {gone:.3g} % had been released at the last good state: other forces "
        "on bodies and tools must balance the rest."
    )
