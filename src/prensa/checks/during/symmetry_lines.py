"""Free sides that come to a line of symmetry: the run goes on with planes there."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.checks.check import Solved
from prensa.errors import Finding
from prensa.system.symmetry_planes import Nearing


def symmetry_lines(given: Solved) -> Iterator[Finding]:
    """Raise `Nearing`, which is no fault of the increment, where a free side comes to a line of symmetry; yields nothing."""
    if given.guard is not None and given.complete:
        for line, (x, y) in given.guard.near(given.result.u):
            raise Nearing(
                f"a free side reaches the line of symmetry {line} near ({x:.4g}, {y:.4g}), where it meets its mirror image: "
                "from here on the line acts as a rigid frictionless plane"
            )
    yield from ()
