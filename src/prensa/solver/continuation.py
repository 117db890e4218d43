"""Continuation in the penalty: an increment that fails is tried again with soft contacts that stiffen stage by stage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from prensa.fem.interaction import Context
from prensa.fem.system import System
from prensa.solver.policy import DEFAULT, Policy

Array = NDArray[np.float64]


def stages(system: System, c: Context, policy: Policy = DEFAULT) -> list[Context]:
    """Increment contexts of the stages before the last one: stiffnesses capped at E*/h × (β, β_T) × factorᵏ; none without need.

    The factor is each contact's ``continuation``; contacts without it, and the k_T that a softening law needs, keep theirs.
    """
    out: list[Context] = []
    while len(out) < policy.stages:
        scales = [
            s.description.enforcement.softened(
                scale, len(out), law is not None and law.hardens, policy.soft, policy.soft_tangential
            )
            for s, scale, law in zip(system.surfaces, c.scales, c.laws)
        ]
        if all(a is b for a, b in zip(scales, c.scales)):
            break
        out.append(replace(c, scales=scales))
    return out
