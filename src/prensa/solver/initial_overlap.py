"""A tool that starts inside a body: the body is pressed out of it in stages, before the first increment is solved.

The overlap is there at time 0, however short the increment: cutting it changes nothing. Stages have the tools drawn back by a
part of it that falls to nothing. None of them is committed: history and friction see the increment as a whole.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from prensa.policy import Policy
from prensa.system.contacts import were_closed
from prensa.system.failure import StartsInside
from prensa.system.interaction import Context
from prensa.system.schedule import Prescribed
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array


def starts_inside(system: System, state: State, policy: Policy) -> list[tuple[StartsInside, Array]]:
    """Tools that lie inside bodies when a run begins: what there is to say, and the way out (2,)."""
    found: dict[str, tuple[StartsInside, Array]] = {}
    if state.clock.number or system.dofs.dimension != 2:
        return []
    for s in system.surfaces:
        if were_closed(state, s):
            continue
        pairs = system.node_stencils(s, state.u)
        k, depth = int(np.argmin(pairs.g)), float(s.points.depth.min())
        deep = -float(pairs.g[k])
        if deep > policy.overlap_ratio * depth and (s.against not in found or deep > found[s.against][0].depth):
            surface = "+".join(s.description.surface)
            found[s.against] = StartsInside(s.against, surface, deep, deep / depth), pairs.g[k] * pairs.n[k]
    return list(found.values())


def overlap_stages(system: System, c: Context, policy: Policy) -> list[Context]:
    """Contexts of an increment with the tools that start inside a body drawn back, less and less; none without need."""
    inside = starts_inside(system, c.state, policy)
    if not inside:
        return []
    fixed, values = c.plan.fixed, c.plan.values(c.time)
    back = np.zeros(system.ndof)
    for reason, way in inside:
        back[system.masters[reason.tool].dofs[:2]] = way
    count = int(np.ceil(max(reason.elements for reason, _ in inside) / policy.overlap_stage_ratio))
    return [
        replace(c, plan=replace(c.plan, groups=[Prescribed(fixed, values + (1.0 - share) * back[fixed])]))
        for share in np.linspace(0.0, 1.0, count + 1)[1:-1]
    ]
