"""The state that follows on a converged increment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from prensa.result.energy_balance import nodal_work, tool_wear, tool_work
from prensa.solver.stabilisation import Stabilisation
from prensa.solver.stability import looked
from prensa.system.damage import damaged
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.state import Clock, State
from prensa.system.system import Evaluation, System
from prensa.types import Array


def fresh_mesh(state: State) -> bool:
    """Whether no increment has followed on the last remeshing."""
    return state.remeshed is not None and state.remeshed.number == state.clock.number


def along_kept(system: System, e: Evaluation, u: Array) -> Array:
    """Values (ndof,) with tangential multipliers along the tangents that tractions are kept along: the next increment's."""
    turning = [
        (s.multipliers, f.stencils)
        for s, f in zip(system.surfaces, e.contacts)
        if s.multipliers is not None and f.stencils.kept is not None
    ]
    if not turning:
        return u
    u = u.copy()
    for multipliers, stencils in turning:
        own = multipliers.of(u)
        own[:, 1:] = stencils.to_keep(own[:, 1:])
    return u


def committed(
    system: System, c: Context, result: NewtonResult, e: Evaluation, dt: float, stabilisation: Stabilisation
) -> State:
    """The state after a converged increment; dt: duration of the next one, 0 at the end of the step.

    At the end of a step all dofs are recovered: the next step may need some that this one does not.
    """
    old, contact, lam = c.state, c.state.contact, result.lam.copy()
    for s, f, before, law in zip(system.surfaces, e.contacts, c.committed, c.laws):
        slid, touched = f.slid(before, result.u - old.u, law is None), np.where(f.p > 0, c.seconds, 0.0)
        record = replace(
            f.record, speed=(f.kappa - before.slip) / c.seconds, time=before.time + touched, path=before.path + slid
        )
        contact = contact.replaced(s.rows, record)
        # Multipliers of an augmented contact are its whole pressures when it has converged: the next increment begins there.
        lam[s.rows, 0], lam[s.rows, 1:] = f.p, record.traction
    work = nodal_work(system, c, e)
    ended, du = c.ends_step, result.u - old.u
    energy = stabilisation.energies(c, result)
    largest = max(float(old.largest_energies[1]), energy.largest)
    stability = stabilisation.after(c, du, energy.external - old.energy.external, result.negative)
    stability, softest = looked(stability, old, result, stabilisation.policy)
    if ended and result.recover is not None:
        result.u, result.recover = result.recover(), None
    du = along_kept(system, e, du)
    u = along_kept(system, e, system.step_begun(result.u) if ended else result.u)
    step, step_start = (c.plan.number + 1, u) if ended else (c.plan.number, old.step_start)
    nodal = system.dofs.displacement.slice
    difference, damping = old.damped_difference(du, c.dt, nodal)
    clock = Clock(step, old.clock.number + 1, c.time, dt, damping)
    damage = old.damage
    if damage:
        places = system.positions(old.u), system.positions(result.u)
        damage = damaged(system.problem, system.blocks, damage, old.history, e.history, places)
    # dt_last 0: nothing is extrapolated, neither over a step's end, where supports and ways change, nor from a motion in air.
    return State(
        u=u, du=du, dt_last=0.0 if ended or c.brought_into_contact else c.dt, second_difference=difference,
        history=e.history, contact=contact,
        lam=lam, energy=energy, work=work, clock=clock,
        step_start=step_start, release=None if c.time >= c.plan.t1 else old.release,
        self_equilibrated=None if c.time >= c.plan.t1 else old.self_equilibrated, stability=stability,
        ends=np.append(old.ends, c.time) if ended else old.ends, watched=c.watched, softest=softest,
        tool_work=tool_work(system, c, result.u, work), tool_wear=tool_wear(system, c, e), remeshed=old.remeshed,
        damage=damage, largest_energies=np.array([largest if ended else old.largest_energies[0], largest]),
    )  # fmt: skip
