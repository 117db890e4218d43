"""Times at which the increments of a run are asked to end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from prensa.errors import ArgumentError, shown
from prensa.model import problem as model
from prensa.model.feed import ends_early
from prensa.types import Array


def increasing(name: str, given: Sequence[float]) -> Array:
    """Times as an array; raises `ArgumentError` where they do not increase. ``name``: of the argument of `solve`."""
    try:
        out = np.atleast_1d(np.asarray(given, dtype=np.float64))
    except (TypeError, ValueError):
        raise ArgumentError(f"solve: {name} is {shown(given)}; give a list of increasing times") from None
    if out.ndim != 1 or not np.isfinite(out).all() or (np.diff(out) <= 0).any():
        raise ArgumentError(f"solve: {name} is {shown(given)}; give a list of increasing times")
    return out


def given_times(problem: model.Problem, now: float, times: Sequence[float]) -> Array:
    """The times after ``now`` at which increments end, these and no others.

    Raises
    ------
    ArgumentError
        For times that do not increase, are over already, or leave the end of a step out.

    """
    last, given = len(problem.steps), increasing("times", times)
    until = next((s.name for s in problem.steps if ends_early(s)), None)
    if until is not None:
        raise ArgumentError(
            f"solve: step {until!r} ends by its 'until' or 'feed', so times cannot be given; leave one of them out"
        )
    left = given[given > now]
    ends = np.arange(np.floor(now) + 1.0, last + 1.0)
    missing = ends[~np.isin(ends, left)]
    if len(missing) or (len(given) and given[-1] > last):
        what = f"{missing[0]:g} is not among them" if len(missing) else f"{given[-1]:g} is after the last step"
        raise ArgumentError(
            f"solve: times have to be those of this run, the ends of its steps (1 … {last}) included; {what}"
        )
    return left
