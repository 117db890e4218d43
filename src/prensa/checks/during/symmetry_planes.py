"""Free sides that come to a plane of symmetry: the run goes on with tools there, or warns where none can stand."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.checks.check import Solved, warning
from prensa.checks.thresholds import TOUCHING_DEPTH
from prensa.errors import Finding
from prensa.system.symmetry_planes import Nearing, unguarded
from prensa.system.system import System


def symmetry_planes(given: Solved) -> Iterator[Finding]:
    """Raise `Nearing`, which is no fault of the increment, where a free side comes to a plane of symmetry; yields nothing."""
    if given.guard is not None and given.complete:
        for close in given.guard.near(given.result.u):
            raise Nearing(
                f"a free side reaches the {close.mirror.kind} {close.mirror} near {close.where}, where it meets its mirror "
                f"image: from here on the {close.mirror.kind.partition(' ')[0]} acts as a rigid frictionless plane"
            )
    yield from ()


class Passing:
    """Free sides that pass through a plane of symmetry at which no tool can stand: each plane is reported once.

    ``guard``: what there is to look at; without one this is not to be called.
    """

    def __init__(self, system: System) -> None:
        self.guard = unguarded(system)
        self.reported: set[str] = set()

    def __call__(self, given: Solved) -> Iterator[Finding]:
        """Of an increment; what lay beyond at its start has been reported."""
        assert self.guard is not None
        deep = [close for close in self.guard.close(given.outlines.u) if close.share < -TOUCHING_DEPTH]
        if not any(str(close.mirror) not in self.reported for close in deep):
            return
        before = {str(c.mirror) for c in self.guard.close(given.began.u) if c.share < -TOUCHING_DEPTH}
        for close in deep:
            if str(close.mirror) not in self.reported | before:
                remedy = "add a plane to the tools there, without friction, and a contact of the side with it"
                remedy = "let the tools stay and move them away ('by')" if self.guard.system.gone else remedy
                yield warning(
                    f"a free side of {' or '.join(map(repr, close.mirror.bodies))} passes through the {close.mirror.kind} "
                    f"{close.mirror} near {close.where}, beyond which lies its mirror image: what follows is wrong there; "
                    f"{remedy}, or, where that is no symmetry, list '{{surface: {close.mirror.bodies[0]}, against: symmetry}}' "
                    "under 'no_contact'"
                )
            self.reported.add(str(close.mirror))
