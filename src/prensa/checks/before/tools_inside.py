"""Tools that start inside a body with which they have no contact."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.checks.during.penetration import engulfed, inside, watches
from prensa.errors import Finding, Severity
from prensa.system.system import System


def tools_inside(system: System) -> Iterator[Finding]:
    """Metal that lies inside a tool from the beginning, and tools that lie inside a body."""
    node = inside(system, watches(system), system.initial().u)
    if node is not None:
        remedy = "move the tool" if node.through else f"move the tool, or {node.remedy}"
        yield Finding(f"tools.{node.tool}", f"{node} when the run begins: {remedy}", Severity.REFUSE)
        return
    for tool, body in engulfed(system):
        message = f"it lies inside body {body!r}, whose outline it does not meet: move the tool out"
        yield Finding(f"tools.{tool}", message, Severity.REFUSE)
