"""Tools out of files that state no unit, of another size than the bodies."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.errors import Finding
from prensa.system.system import System

OTHER_SIZE = 100
"""Size of a tool over that of the bodies, or the reverse, at which it is likely in another unit: a metre is a thousand mm."""


def file_units(system: System) -> Iterator[Finding]:
    """Tools with a ``unit`` of their own whose size has little to do with the bodies."""
    length = max(float(mesh.extent.max()) for mesh in system.meshes.values())
    for tool in system.tools:
        size = 0.5 * tool.shape.extent
        if getattr(tool.description, "unit", None) is None or length / OTHER_SIZE < size < length * OTHER_SIZE:
            continue
        yield Finding(
            f"tools.{tool.name}.unit",
            f"the tool measures {size:.3g} {system.problem.units.length} and the bodies {length:.3g}: an STL file states no "
            "unit; say what one is in it, such as 'unit: mm', 'unit: m' or 'unit: inch'",
        )
