"""Tools out of files that state no unit, or a wrong one, of another size than the bodies."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.before.tool_sizes import shortest
from prensa.errors import Finding
from prensa.system.system import System

OTHER_SIZE = 100
"""Size of a tool over that of the bodies, or the reverse, at which it is likely in another unit: a metre is a thousand mm."""


def file_units(system: System) -> Iterator[Finding]:
    """Tools with a ``unit`` of their own, or out of a drawing, whose size has little to do with the bodies.

    Or that are smaller than an element which they press, as what is drawn in inches is beside a body in millimetres.
    """
    length, unit = max(float(mesh.extent.max()) for mesh in system.meshes.values()), system.problem.units.length
    for tool in system.tools:
        own = getattr(tool.description, "unit", None) is not None
        if not own and not any(tool.description.notes()):
            continue
        outline = tool.description.facets(tool.direction, length)[0] if system.dofs.dimension == 3 else None
        # half of it, wherever it is drawn
        size = 0.5 * (tool.shape.extent if outline is None else float(np.ptp(outline, axis=0).max()))
        pressed = {"+".join(s.description.surface): shortest(system, s) for s in system.tool_contacts if s.against == tool.name}
        if not length / OTHER_SIZE < size < length * OTHER_SIZE:
            sizes = f"the tool measures {size:.3g} {unit} and the bodies {length:.3g}"
        elif pressed and 2.0 * size < min(pressed.values()):
            side = min(pressed, key=lambda name: pressed[name])
            sizes = f"the tool measures {2.0 * size:.3g} {unit}, and the smallest element of {side!r} {pressed[side]:.3g}"
        else:
            continue
        if own:
            where, why = "unit", "an STL file states no unit; say what one is in it, such as 'unit: mm', 'unit: m' or "\
                "'unit: inch'"
        else:
            where, why = "points", "the unit that a drawing states is often not its own; give it, 'points: {file: …, unit: mm}'"
        yield Finding(f"tools.{tool.name}.{where}", f"{sizes}: {why}")
