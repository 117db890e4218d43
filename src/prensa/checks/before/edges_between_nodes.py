"""Edges of tools that go in between the nodes of a side, without one that would resist."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.after.between_nodes import NO_FORCE, BetweenNodes
from prensa.errors import Finding
from prensa.linear.rigid_modes import CLOSED
from prensa.system.moments import contact_path, driven, moments
from prensa.system.once import once
from prensa.system.system import System


def edges_between_nodes(system: System) -> Iterator[Finding]:
    """Tools that at the end of a step lie inside bodies which nothing has touched, between the nodes of their contacts."""
    yield from dips(system).values()


@once
def dips(system: System) -> dict[str, Finding]:
    """By contact, what there is to say of such a tool."""
    between = BetweenNodes(system)
    moved = {name for name in system.problem.bodies if driven(system, name)}
    found: dict[str, Finding] = {}
    for m in moments(system):
        x = system.positions(m.u)
        for i, s in between.contacts:
            known = m.known[system.tool_masters[s.against].number]
            if not known or float(system.nodes_seen(s, m.u).g.min()) < -CLOSED * float(s.points.depth.min()):
                moved |= {other for other in system.tied_bodies(s.body)}
            elif not s.sharp and s.body not in moved and np.isclose(m.t, m.plan.t1) and s.name not in found:
                dip = between.deepest(s, x, m.u)
                if dip is not None:
                    words = between.words(s, dip, x, NO_FORCE)
                    found[s.name] = Finding(contact_path(system, i), words, seen_in_run=True)
    return found
