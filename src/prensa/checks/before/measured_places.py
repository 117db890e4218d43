"""Places of measures that are all of a side: on it the coordinate that names them is the same everywhere."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.errors import Finding
from prensa.measures import along_sides
from prensa.system.system import System


def measured_places(system: System) -> Iterator[Finding]:
    """Places of deformed bodies that are all of a side at the start; those of undeformed ones are refused when they are read."""
    for name, found in along_sides(system.problem, system.meshes):
        yield Finding(f"measures.{name}", f"at the start {found}; it has a value only once the side has bent or turned across it")
