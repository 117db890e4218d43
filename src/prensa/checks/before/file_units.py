"""Tools out of files that state no unit, or a wrong one, of another size than the bodies."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.errors import Finding
from prensa.system.system import System

OTHER_SIZE = 100
"""Size of a tool over that of the bodies, or the reverse, at which it is likely in another unit: a metre is a thousand mm."""


def file_units(system: System) -> Iterator[Finding]:
    """Tools with a ``unit`` of their own, or out of a drawing, whose size has little to do with the bodies."""
    length = max(float(mesh.extent.max()) for mesh in system.meshes.values())
    for tool in system.tools:
        size = 0.5 * tool.shape.extent
        own = getattr(tool.description, "unit", None) is not None
        if not (own or any(tool.description.notes())) or length / OTHER_SIZE < size < length * OTHER_SIZE:
            continue
        sizes = f"the tool measures {size:.3g} {system.problem.units.length} and the bodies {length:.3g}"
        if own:
            where, why = "unit", "an STL file states no unit; say what one is in it, such as 'unit: mm', 'unit: m' or "\
                "'unit: inch'"
        else:
            where, why = "points", "the unit that a drawing states is often not its own; give it, 'points: {file: …, unit: mm}'"
        yield Finding(f"tools.{tool.name}.{where}", f"{sizes}: {why}")
