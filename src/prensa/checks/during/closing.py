"""Folds that are about to close: nothing keeps a body from passing through itself, so they are reported before."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.check import Solved, warning
from prensa.checks.during.self_intersection import sides_of
from prensa.errors import Finding
from prensa.result.folding import CLOSING, Fold, folding
from prensa.system.interaction import Context
from prensa.system.system import System
from prensa.types import Array, Index

FOLDS = " begins to fold at "
"""Words by which a warning of a fold is known."""


class Closing:
    """Two parts of the outline of a body that come together; each place is reported once."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.known: dict[str, Index] = {}
        """By body: nodes of its outline between the flanks of all folds so far."""

    def __call__(self, given: Solved) -> Iterator[Finding]:
        """Outlines are right in every increment, whatever is condensed."""
        for body, fold in self._folds(given.context, given.outlines):
            if not self._is_known(body, fold):
                yield warning(self._words(given.context, body, fold))
            # flanks close on and on, and what lies between them grows
            self.known[body] = np.union1d(self.known.get(body, fold.arc), fold.arc)

    def new(self, c: Context, u: Array) -> list[Fold]:
        """Folds that were not reported yet, for degrees of freedom u (ndof,) at the end of an increment."""
        return [fold for body, fold in self._folds(c, u) if not self._is_known(body, fold)]

    def _folds(self, c: Context, u: Array) -> Iterator[tuple[str, Fold]]:
        if self.system.problem.kinematics != "small":
            for body, found in folding(self.system, u, c.state.step_start, CLOSING).items():
                yield from ((body, fold) for fold in found.folds)

    def _is_known(self, body: str, fold: Fold) -> bool:
        """Whether most of what lies between the flanks of a fold lay between those of one that was reported.

        Flanks that meet may do so all along at once, far beyond what was known: then any part of it will do.
        """
        inside = int(np.isin(fold.arc, self.known[body]).sum()) if body in self.known else 0
        return 2 * inside > len(fold.arc) or (inside > 0 and fold.opening == 0.0)

    def _words(self, c: Context, body: str, fold: Fold) -> str:
        side = " and ".join(sides_of(self.system, body, fold.nodes + self.system.offsets[body]))
        flanks = f"its two flanks are {fold.gap:.3g} apart and close" if fold.gap > 0.0 else "its two flanks have met"
        return (
            f"{side!r}{FOLDS}({fold.x:.4g}, {fold.y:.4g}) in increment {c.state.clock.number + 1}, step {c.plan.name!r}: "
            f"{flanks}; results end where they meet, as a body has no contact with itself; change the blank or the die, or end "
            f"the step there: 'until: {{measure: {{{body}.folds: 1}}}}'"
        )
