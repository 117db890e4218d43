"""Increments that end before a fold closes, so that it is reported while it is open.

A long increment may begin before a fold does and end after it has closed: the outline is smooth at one end and has passed through
itself at the other. Such an increment is halved until it ends in between, where as much motion again closes the fold.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from prensa.result.folding import Fold
from prensa.solver.until import Outcome


class Halved(NamedTuple):
    """The ``outcome`` of an increment up to where a fold is open, and whether it was ``found``."""

    outcome: Outcome
    found: bool


def before_it_closes(
    new: Callable[[Outcome], list[Fold]], outcome: Outcome, solve: Callable[[float], Outcome], shortest: float
) -> Halved:
    """The outcome of an increment, or of the shorter one in which a fold that it would begin and close has only begun.

    ``new``: folds at the end of an increment that were not reported yet; ``solve``: the outcome of the increment from the same
    committed state to another time, which may fail: the fold is looked for before that. One that begins and closes within the
    duration ``shortest`` jumps: there is nothing to report before it, and the increment is as good as it was.
    """

    def met(now: Outcome) -> bool:
        return any(not fold.gap > 0.0 for fold in new(now))

    if not met(outcome):
        return Halved(outcome, False)
    smooth, closed = outcome[0].state.clock.time, outcome[0].time
    while closed - smooth > shortest:
        tried = solve(0.5 * (smooth + closed))
        if not tried[1].converged or met(tried):
            closed = tried[0].time
        elif new(tried):
            return Halved(tried, True)
        else:
            smooth = tried[0].time
    return Halved(outcome, False)
