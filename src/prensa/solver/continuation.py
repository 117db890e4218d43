"""Continuation in the penalty: an increment that fails is tried again with soft contacts that stiffen stage by stage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from prensa.contact.forces import Scale
from prensa.fem.system import Circumstances, Surface, System

Array = NDArray[np.float64]

ROUGH = 1e-4  # relative residual to which a stage before the last is solved


def stages(system: System, c: Circumstances) -> list[Circumstances]:
    """Circumstances of the stages before the last one: stiffnesses capped at E*/h × (10, 1) × factorᵏ; empty without need.

    The factor is each contact's ``continuation``; contacts without it keep their stiffness.
    """
    out: list[Circumstances] = []
    while len(out) < 64:
        scales = [_capped(s, scale, c, i, len(out)) for i, (s, scale) in enumerate(zip(system.surfaces, c.scales))]
        if all(a is b for a, b in zip(scales, c.scales)):
            break
        out.append(replace(c, scales=scales))
    return out


def _capped(s: Surface, scale: Scale, c: Circumstances, i: int, stage: int) -> Scale:
    """Stiffnesses of a contact in a stage; the same object when nothing is capped."""
    law = c.laws[i]
    return s.description.enforcement.softened(scale, stage, law is not None and law.hardens)


def stiffened(system: System, now: Circumstances, then: Circumstances, u: Array) -> Array:
    """Unknowns of a solved stage moved to where the next one has the same pressures: penetrations shrink as k_n grows."""
    u = u.copy()
    nodal = u[: 2 * system.nodes].reshape(-1, 2)
    for s, a, b in zip(system.surfaces, now.scales, then.scales):
        if a is b:
            continue
        pairs, nodes = system.node_pairs(s, u), s.points.nodes
        free = ~system.supported(nodes, now.plan)
        inside = np.where(free & np.isfinite(pairs.g), np.minimum(pairs.g, 0.0), 0.0)
        share = s.points.to_nodes(np.ones(len(s.points)))
        carries = share > 0  # the end on the axis of a quadratic edge carries no point
        softer = np.where(carries, s.points.to_nodes(a.k_n / b.k_n) / np.where(carries, share, 1.0), 1.0)
        nodal[nodes] += ((softer - 1.0) * inside)[:, None] * pairs.n
    return u
