"""Backwards through the way of a tool that a force brings through air: where points with friction begin to slip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prensa.policy import Policy
from prensa.sensitivity.transposed import Weights
from prensa.solver.approach import approach_of_tools
from prensa.system.interaction import Context
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array


class Landing(NamedTuple):
    """An increment with a way through air: its context, and weights (m, points) by contact of the coordinates at its end."""

    c: Context
    weights: Sequence[Array]


def landing_of(system: System, c: Context, before: Weights) -> Landing:
    """Adjoints of the state before a motion through air from coordinates at its end, which differ from the committed ones.

    A tool goes along its force until springs on the points that it meets first carry next to nothing: their gaps, weighted by
    these springs, stay what they are. See `System.through_air`.
    """
    way = np.asarray(c.through_air)
    u, weights = c.state.u + way, list[Array]()
    for k, adjoints in enumerate(before.contact):
        w = np.where(c.committed[k].closed | (c.laws[k] is None), 0.0, adjoints.s)
        before.contact[k] = adjoints._replace(s=adjoints.s - w)
        weights.append(w)
    for master in system.tool_masters.values():
        along = way[master.dofs]
        own = [(s, weights[k], c.scales[k].k_n * c.weights[k]) for k, s in enumerate(c.surfaces) if s.against == master.name]
        pairs = [system.stencils(s, u, c.state) for s, *_ in own]
        springs = [np.where(p.g < 0.0, stiff, 0.0) for p, (_, _, stiff) in zip(pairs, own)]
        rise = sum(float((met * (p.dg[:, s.of_master] @ along)).sum()) for p, met, (s, *_) in zip(pairs, springs, own))
        slide = np.sum([w @ (p.ds[:, 0, s.of_master] @ along) for p, (s, w, _) in zip(pairs, own)], axis=0)
        for p, met, (s, w, _) in zip(pairs, springs, own):
            q = w[:, :, None] * p.ds[:, 0]
            if along.any():
                # The length of the way is implicit: it changes so that Σ spring × gap of the points met stays what it is.
                q = q - (slide[:, None] / rise * met)[:, :, None] * p.dg
            for out, x in zip(before.u, q):
                np.add.at(out, s.dofs, x)
    return Landing(c, weights)


def coordinates(system: System, plan: StepPlan, c: Context, policy: Policy) -> list[Array]:
    """Those (points, 1) by contact from which points slip in an increment of another system from the same state."""
    beside = system.context(c.state, plan, c.time, c.rule)
    return [r.coordinate for r in system.through_air(beside, approach_of_tools(system, beside, policy).through_air).committed]
