"""Duration of steps in seconds. The time of a run counts steps; rates, speeds and powers are per second."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


def duration_of(step: Any) -> float:
    """Seconds that a step lasts: as it says, or as a crank turns; one where neither does."""
    return float(stated(step) or 1.0)


def stated(step: Any) -> float | None:
    """Seconds that a step says that it lasts."""
    if step.duration is not None:
        return float(step.duration)
    return next((c.seconds for c in step.crank.values() if c is not None and c.seconds is not None), None)


def any_stated(problem: Any) -> bool:
    """Whether some step of a problem says how long it lasts."""
    return any(stated(step) is not None for step in problem.steps)


def elapsed(problem: Any, time: float, ends: Iterable[float] = ()) -> float:
    """Seconds until a time; ``ends``: times at which the steps so far ended, what they left of theirs having been passed over."""
    past, number = 0.0, 0
    for number, end in enumerate(ends, 1):
        # A step that ended early lasted only its share; the next one begins at the whole number all the same.
        past += (float(end) - number + 1) * duration_of(problem.steps[number - 1])
    return past if number >= len(problem.steps) else past + max(time - number, 0.0) * duration_of(problem.steps[number])
