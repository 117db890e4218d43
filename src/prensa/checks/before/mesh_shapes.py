"""Elements of a bad shape."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.errors import Finding
from prensa.mesh.quality import quality
from prensa.system.moments import driven, moments
from prensa.system.system import System
from prensa.types import Array


def mesh_shapes(system: System) -> Iterator[Finding]:
    """Elements whose shape costs accuracy; needles are not reported far from the tools."""
    for name, mesh in system.meshes.items():
        q = quality(mesh)
        quiet = _far_from_tools(system, name, q.centre[q.needles]) if len(q.needles) else None
        words = q.warnings(float(mesh.extent.min()), quiet)
        yield from (Finding(f"bodies.{name}.mesh", warning) for warning in words)


def _far_from_tools(system: System, body: str, x: Array) -> Array:
    """Least distance (k,) of points x (k, 2) of a body from the tools of its contacts, as far as their courses are known.

    A tool whose course is not known is looked at where it starts; 0 for a body that is brought to them.
    """
    out = np.full(len(x), np.inf)
    against = [s for s in system.tool_contacts if s.body == body]
    if not against or driven(system, body):
        return np.zeros(len(x))
    for m in moments(system):
        for s in against:
            master = system.tool_masters[s.against]
            if m.known[master.number] or m.t == 0.0:
                out = np.minimum(out, master.seen(x, m.u).g)
    return out
