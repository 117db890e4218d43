"""The ledger of energies: what the loads put in, what is stored, what is dissipated, and what does not add up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prensa.fem.context import Context
from prensa.fem.system import Evaluation, System

Array = NDArray[np.float64]
NAMES = ("external", "elastic", "plastic", "friction", "contact", "imbalance")


def nodal_work(system: System, c: Context, e: Evaluation) -> Array:
    """Forces (ndof,) that do external work: loads, and reactions where dofs are prescribed."""
    work = e.f_ext.copy()
    work[c.plan.fixed] += system.collected(e.r)[c.plan.fixed]
    return work


def ledger(system: System, c: Context, u: Array, e: Evaluation, work: Array) -> Array:
    """Energies (6,) as in `NAMES` after an increment that ends at dofs u (ndof,) with forces ``work`` (ndof,)."""
    old = c.state
    energy = old.energy.copy()
    energy[0] += 0.5 * float((old.work + work) @ (u - old.u))
    energy[1] = system.elastic_energy(e.history)
    energy[2] = system.plastic_work(e.history)
    for s, f in zip(system.surfaces, e.contacts):
        was = old.contact[s.rows]
        energy[3] += float((f.area * 0.5 * (np.abs(was[:, 0]) + np.abs(f.t)) * (f.kappa - was[:, 1])).sum())
    energy[4] = system.contact_energy(e.contacts, c.scales)
    for dof, (stiffness, _) in c.plan.springs.items():
        # work[dof] is the force of a spring: what it stores, and with that the work done at its mount
        before, now = 0.5 * old.work[dof] ** 2 / stiffness, 0.5 * work[dof] ** 2 / stiffness
        energy[0] += now - before
        energy[1] += now
    energy[5] = energy[0] - energy[1:5].sum()
    return energy
