"""Folds that are about to close: nothing keeps a body from passing through itself, so they are reported before."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.checks.check import Solved, warning
from prensa.checks.during.self_intersection import sides_of
from prensa.errors import Finding
from prensa.result.folding import folding
from prensa.system.system import System

FOLDS = " begins to fold at "
"""Words by which a warning of a fold is known."""


class Closing:
    """Two parts of the outline of a body that come together; each pair of sides is reported once."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.reported: set[str] = set()

    def __call__(self, given: Solved) -> Iterator[Finding]:
        """Outlines are right in every increment, whatever is condensed."""
        if self.system.problem.kinematics == "small":
            return
        c = given.context
        for body, found in folding(self.system, given.outlines, c.state.step_start).items():
            for fold in found.folds:
                nodes = fold.nodes + self.system.offsets[body]
                side = " and ".join(sides_of(self.system, body, nodes))
                if side not in self.reported:
                    self.reported.add(side)
                    yield warning(
                        f"{side!r}{FOLDS}({fold.x:.4g}, {fold.y:.4g}) in increment {c.state.clock.number + 1}, step "
                        f"{c.plan.name!r}: its two flanks are {fold.gap:.3g} apart and close; results end where they meet, as a "
                        f"body has no contact with itself; change the blank or the die, or end the step there: 'until: "
                        f"{{measure: {{{body}.folds: 1}}}}'"
                    )
