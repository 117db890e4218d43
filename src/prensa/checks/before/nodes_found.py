"""How many nodes of a surface a small tool finds on its way through the steps."""

from __future__ import annotations

import numpy as np

from prensa.contact.surface import Surface
from prensa.system.moments import moments
from prensa.system.system import System


def few_nodes_met(system: System, s: Surface) -> str:
    """What to say of a tool that finds so few nodes that a pressure cannot be seen on them; '' if it finds enough.

    Counted are those that lie in it at once, past the undeformed bodies: a tip that goes in deep is as wide as its flanks there.
    Ways that a force or the end of a step decides are not known.
    """
    number, most, known = system.tool_masters[s.against].number, 0, True
    for m in moments(system):
        known &= bool(m.known[number])
        gap = system.nodes_seen(s, m.u).g
        most = max(most, int(np.count_nonzero(np.where(np.isfinite(gap), gap, 0.0) < 0.0)))
    if most >= 4 ** (system.dofs.dimension - 1):  # three elements across, in space both ways
        return ""
    if most <= 1:
        return f"it {'presses' if known else 'begins'} on one node{' at most' if known else ''}"
    return f"it presses on {most} nodes at most" if known else f"it presses on few nodes, {most} as far as its way is known"
