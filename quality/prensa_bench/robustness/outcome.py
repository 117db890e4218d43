"""Outcomes of random problems: verdicts, their counts, and how sure a share is."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

VERDICTS = ("right", "confirmed", "reported", "wrong", "time")
COMPARED, INSTEAD, NOT_COMPARED = "compared", "another compared", "not compared"


@dataclass(frozen=True)
class Outcome:
    """Result of a problem, with its cost.

    ``status``: 'right'; 'confirmed' (stopped for a reason that the checks find in the files too); 'reported' (the solver or the
    check before it said that it cannot, ``reason`` is the type of what it said); 'wrong' (an answer that does not hold what
    is asked of it); 'time' (not ended within its limit of processor time). ``words``: what was said, or what is wrong.
    ``twin``: of one solved in a second way, on a finer mesh, turned, in other units, that way and whether the answers were
    compared (`COMPARED`), or those of another problem in its place (`INSTEAD`), or none (`NOT_COMPARED`); '' of others.
    """

    number: int
    kind: str
    status: str
    words: str = ""
    iterations: int = 0
    cutbacks: int = 0
    seconds: float = 0.0
    reason: str = ""
    twin: str = ""


@dataclass
class Tally:
    """Outcomes of a family."""

    suite: str
    seed: int
    outcomes: list[Outcome] = field(default_factory=list)

    def count(self, status: str) -> int:
        """Number of outcomes with a status."""
        return sum(o.status == status for o in self.outcomes)

    def twins(self) -> str:
        """How many were solved in which second way, and compared or not, in words."""
        return ", ".join(f"{n} {how}" for how, n in sorted(Counter(o.twin for o in self.outcomes if o.twin).items()))

    def share(self, status: str) -> float:
        """Share of outcomes with a status."""
        return self.count(status) / max(len(self.outcomes), 1)


def bounds(hits: int, of: int, sure: float = 0.95) -> tuple[float, float]:
    """Two-sided confidence bounds of a share seen ``hits`` times of ``of`` (Clopper & Pearson 1934: never too narrow)."""
    from scipy.stats import beta

    if of == 0:
        return 0.0, 1.0
    tail = 0.5 * (1 - sure)
    low = float(beta.ppf(tail, hits, of - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1 - tail, hits + 1, of - hits)) if hits < of else 1.0
    return low, high
