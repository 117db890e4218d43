"""Continuation in the penalty: an increment that fails is tried again with soft contacts that stiffen stage by stage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from prensa.contact.enforcement import Scale
from prensa.fem.system import Circumstances, Surface, System
from prensa.model import problem as model
from prensa.solver.policy import DEFAULT, Policy

Array = NDArray[np.float64]


def stages(system: System, c: Circumstances, policy: Policy = DEFAULT) -> list[Circumstances]:
    """Increment contexts of the stages before the last one: stiffnesses capped at E*/h × (β, β_T) × factorᵏ; none without need.

    The factor is each contact's ``continuation``; contacts without it keep their stiffness.
    """
    out: list[Circumstances] = []
    while len(out) < policy.stages:
        scales = [
            _capped(s, scale, law is not None and law.hardens, len(out), policy)
            for s, scale, law in zip(system.surfaces, c.scales, c.laws)
        ]
        if all(a is b for a, b in zip(scales, c.scales)):
            break
        out.append(replace(c, scales=scales))
    return out


def _capped(s: Surface, scale: Scale, hardens: bool, stage: int, policy: Policy) -> Scale:
    """Stiffnesses of a contact in a stage; the same object when nothing is capped. A softening law has the k_T that it needs."""
    enforcement = s.description.enforcement
    if not isinstance(enforcement, model.Penalty) or enforcement.continuation <= 1:
        return scale
    growth = enforcement.continuation**stage
    k_n = np.minimum(scale.k_n, policy.soft * growth * scale.unit)
    k_t = scale.k_t if hardens else np.minimum(scale.k_t, policy.soft_tangential * growth * scale.unit)
    if np.array_equal(k_n, scale.k_n) and np.array_equal(k_t, scale.k_t):
        return scale
    return replace(scale, k_n=k_n, k_t=k_t)
