"""Folds that are about to close: nothing keeps a body from passing through itself, so they are reported before."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from prensa.checks.check import Solved, warning
from prensa.checks.during.self_intersection import sides_of
from prensa.errors import Finding
from prensa.result.folding import Fold
from prensa.system.interaction import Context
from prensa.system.system import System
from prensa.types import Array, Flags, Index

FOLDS = " begins to fold at "
"""Words by which a warning of a fold is known."""


KnownFolds: TypeAlias = dict[str, tuple[Array, Flags]]
"""By body: places (k, 2) of nodes of its outline, and which of them (k,) lie between the flanks of folds that were reported."""


class Closing:
    """Two parts of the outline of a body that come together; each place is reported once."""

    def __init__(self, system: System) -> None:
        self.system, self.applies = system, system.problem.kinematics != "small"
        self.known: dict[str, Index] = {}
        """By body: nodes of its outline between the flanks of all folds so far."""

    def reported(self, u: Array) -> KnownFolds:
        """What is known, with outlines at degrees of freedom u (ndof,)."""
        places = {body: self._outline(body, u) for body in self.known}
        return {body: (x, np.isin(nodes, self.known[body])) for body, (nodes, x) in places.items()}

    def know(self, reported: KnownFolds, u: Array) -> None:
        """Go on from a check on other meshes of the same outlines, which are at degrees of freedom u (ndof,) here."""
        for body, (places, within) in reported.items():
            nodes, x = self._outline(body, u)
            nearest = np.hypot(*np.moveaxis(x[:, None] - places, 2, 0)).argmin(axis=1)
            self.known[body] = nodes[within[nearest]]

    def _outline(self, body: str, u: Array) -> tuple[Index, Array]:
        """Nodes (k,) of the outline of a body, as it counts them, and where they are (k, 2) at degrees of freedom u (ndof,)."""
        nodes = np.unique(self.system.meshes[body].boundary)
        return nodes, self.system.positions(u)[self.system.offsets[body] + nodes]

    def __call__(self, given: Solved) -> Iterator[Finding]:
        """Outlines are right in every increment, whatever is condensed."""
        for body, fold in self._folds(given):
            known = _most(fold, self.known.get(body)) or (fold.across and _most(fold, _begun(given, body)))
            if not known:
                yield warning(self._words(given.context, body, fold))
            # flanks close on and on, and what lies between them grows
            self.known[body] = np.union1d(self.known.get(body, fold.arc), fold.arc)

    def new(self, given: Solved) -> list[Fold]:
        """Folds at the end of an increment that were not reported yet.

        Across a line of symmetry those that were not there at its start: a run goes on when such a fold has closed, and its
        increments must be as long as those of one that is resumed, which does not know what was reported.
        """
        return [
            fold
            for body, fold in self._folds(given)
            if not _most(fold, _begun(given, body) if fold.across else self.known.get(body))
        ]

    def _folds(self, given: Solved) -> Iterator[tuple[str, Fold]]:
        if self.applies:
            for body, found in given.outlines.folds.items():
                yield from ((body, fold) for fold in found.folds)

    def _words(self, c: Context, body: str, fold: Fold) -> str:
        side = " and ".join(sides_of(self.system, body, fold.nodes + self.system.offsets[body]))
        flanks = "its two flanks" if fold.across is None else f"its flank and its mirror image across {fold.across}"
        met = "have met within one increment, with no state in between"
        apart = f"are {fold.gap:.3g} apart and close" if fold.gap > 0.0 else met
        end = (
            "results end where they meet, as a body has no contact with itself"
            if fold.across is None
            else "a lap remains where they meet"
        )
        return (
            f"{side!r}{FOLDS}({fold.x:.4g}, {fold.y:.4g}) in increment {c.state.clock.number + 1}, step {c.plan.name!r}: "
            f"{flanks} {apart}; {end}; change the blank or the die, or end the step there: "
            f"'until: {{measure: {{{body}.folds: 1}}}}'"
        )


def _begun(given: Solved, body: str) -> Index:
    """Nodes between the flanks of the folds of a body across lines of symmetry at the start of an increment."""
    arcs = [fold.arc for fold in given.began.folds[body].folds if fold.across]
    return np.concatenate([np.zeros(0, dtype=np.int64), *arcs])


def _most(fold: Fold, known: Index | None) -> bool:
    """Whether most of what lies between the flanks of a fold lay between those of one that is known.

    Flanks that meet may do so all along at once, far beyond what was known: then any part of it will do.
    """
    inside = 0 if known is None else int(np.isin(fold.arc, known).sum())
    return 2 * inside > len(fold.arc) or (inside > 0 and fold.opening == 0.0)
