"""The energy balance: what the loads put in, what is stored, what is dissipated, and what does not add up."""

from __future__ import annotations

import numpy as np

from prensa.contact.record import magnitude
from prensa.system.interaction import Context
from prensa.system.state import Energy
from prensa.system.system import Evaluation, System
from prensa.types import Array


def nodal_work(system: System, c: Context, e: Evaluation) -> Array:
    """Forces (ndof,) that do external work: loads, and reactions where dofs are prescribed."""
    work = e.f_ext.copy()
    work[c.plan.fixed] += system.to_masters(e.r)[c.plan.fixed]
    return work


def energies_after(system: System, c: Context, u: Array, e: Evaluation, work: Array, dissipated: float) -> Energy:
    """Energies after an increment that ends at dofs u (ndof,) with forces ``work`` (ndof,); ``dissipated`` by viscous forces.

    What forces bring through air into contact has nothing against it until it touches: their work counts from there on.
    """
    old = c.state
    pushed = system.surfaces_at(old.clock.time)
    way = system.way(old.u, u) if c.through_air is None else system.way(old.u, u) - c.through_air
    # Trapezoid: what forces do that jump within the increment is in the imbalance, from which `jump_of` reads when they did.
    external = old.energy.external + 0.5 * float((old.work + work) @ way)
    elastic, plastic, friction = system.elastic_energy(e.history), system.plastic_work(e.history), old.energy.friction
    for s, before, f, law in zip(c.surfaces, pushed, e.contacts, c.laws):
        if s.shift is before.shift and law is None:  # no way has been gone against a force
            continue
        was = old.contact.of(s.rows)
        if s.shift is not before.shift:
            # What an overlap that grows in the increment pushes the surfaces apart by, against the pressures of both ends.
            apart = s.points.at(_nothing(system, before.shift) - _nothing(system, s.shift))
            external += 0.5 * float((was.area * old.lam[s.rows, 0] + f.weight * f.p) @ apart)
        # the area of a point is another one than before: the work of the loads was done against the forces of both
        force = was.area * magnitude(was.traction) + f.area * magnitude(f.t)
        friction += float((0.5 * force * (f.kappa - was.slip)).sum())
    contact = system.contact_energy(e.contacts, c.scales)
    for dof, (stiffness, _) in c.plan.springs.items():
        # work[dof] is the force of a spring: what it stores, and with that the work done at its mount
        before, now = 0.5 * old.work[dof] ** 2 / stiffness, 0.5 * work[dof] ** 2 / stiffness
        external += float(now - before)
        elastic += float(now)
    viscous = old.energy.viscous + dissipated
    external += _freed(system, c, e, elastic + plastic + friction + contact + viscous - external)
    imbalance = external - (elastic + plastic + friction + contact + viscous)
    return Energy(external, elastic, plastic, friction, contact, imbalance, viscous)


def tool_work(system: System, c: Context, u: Array, work: Array) -> Array:
    """Work (tools,) of each tool since the step began, after an increment that ends at dofs u (ndof,) with forces ``work``.

    As `energies_after` counts it: what a spring stores between a tool and its mount is work of the mount too.
    """
    old, count = c.state, len(system.tools)
    way = system.way(old.u, u) if c.through_air is None else system.way(old.u, u) - c.through_air
    each = 0.5 * (old.work + work) * way
    for dof, (stiffness, _) in c.plan.springs.items():
        each[dof] += 0.5 * (work[dof] ** 2 - old.work[dof] ** 2) / stiffness
    done = np.array([float(system.place_of(t, each).sum()) for t in range(count)])
    goes_on = old.clock.time > c.plan.t0 and len(old.tool_work) == count
    return old.tool_work + done if goes_on else done


def tool_wear(system: System, c: Context, e: Evaluation) -> Array:
    """Normal force times way of slip (tools,) on each tool since the run began, after an increment.

    As Archard (1953), J. Appl. Phys. 24, 981, eq. 1 counts it: what a penalty gives along the tool elastically is no way.
    """
    number = {tool.name: k for k, tool in enumerate(system.tools)}
    out = c.state.tool_wear.copy() if len(c.state.tool_wear) == len(number) else np.zeros(len(number))
    for s, before, f in zip(c.surfaces, c.committed, e.contacts):
        if s.against in number:
            out[number[s.against]] += float((f.weight * f.p) @ (f.kappa - before.slip))
    return out


def _nothing(system: System, shift: Array | None) -> Array:
    return np.zeros(system.nodes) if shift is None else shift


def _freed(system: System, c: Context, e: Evaluation, missing: float) -> float:
    """Work of overlaps that there are when a run begins, of what is ``missing`` in the balance after the first increment.

    That pushes bodies and tools apart all at once, with forces that no way describes: pressures have risen from nothing to those
    at its end, so that it is between nothing and those times the overlap.
    """
    if c.state.clock.number or not missing > 0.0:
        return 0.0
    most = 0.0
    for s, f in zip(system.surfaces_at(c.state.clock.time), e.contacts):
        closed, gap = c.state.contact.of(s.rows).closed, system.stencils(s, c.state.u, c.state).g
        overlap = np.where(closed | ~np.isfinite(gap), 0.0, np.maximum(-gap, 0.0))
        most += float((f.weight * np.maximum(f.p, 0.0)) @ overlap)
    return min(missing, most)
