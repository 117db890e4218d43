"""Which increments a report shows where not all of them fit: first, last, largest force, and evenly by travel between.

The order is one list, of which a page shows as many as it has room for: how many follows from the size of the page alone, not
from the number of steps.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.measures.columns import directions, place_columns
from prensa.model.problem import Problem
from prensa.output.maxima import largest_force
from prensa.output.stored import Stored
from prensa.types import Array


def travelled(history: Mapping[str, NDArray[Any]], problem: Problem) -> Array:
    """Distance (n,) that the tools have moved up to each increment, all together; rotations where none moves, else time."""
    columns, d = place_columns(problem), directions(problem)
    for kind in (columns[:d], columns[d:]):
        places = [np.column_stack([history[f"{t}.{c}"] for c in kind]) for t in problem.tools]
        path = sum((np.linalg.norm(np.diff(p, axis=0, prepend=0.0), axis=1) for p in places), np.zeros(len(history["time"])))
        if path.any():
            return np.cumsum(path)
    return np.asarray(history["time"], dtype=float)


def evenly(travel: Sequence[float], first: Sequence[int], preferred: Collection[int] = ()) -> Iterator[int]:
    """All places 0 … n − 1 of a list, so ordered that any number of them from the front covers *travel* (n,) evenly.

    *first* come first, with both ends of the list. Then the widest gap is divided again and again, where travel stands still
    by the number of places: at one that is *preferred* if there is any in it, at the one nearest to its middle.
    """
    n = len(travel)
    known = list(dict.fromkeys([*first, *([n - 1, 0] if n else [])]))
    yield from known
    fixed = sorted(known)
    gaps = [_gap(travel, a, b) for a, b in pairwise(fixed) if b - a > 1]
    heapq.heapify(gaps)
    while gaps:
        *_, a, b = heapq.heappop(gaps)
        inside = range(a + 1, b)
        some = [k for k in inside if k in preferred] or inside
        k = min(some, key=lambda k: (abs(2 * travel[k] - travel[a] - travel[b]), abs(2 * k - a - b), k))
        yield k
        for ends in ((a, k), (k, b)):
            if ends[1] - ends[0] > 1:
                heapq.heappush(gaps, _gap(travel, *ends))


def frame_order(stored: Stored) -> list[int]:
    """Numbers of the increments with fields, the ones to show first in front: last, largest force, first, then `evenly`."""
    there = list(stored.with_fields)
    if not there:
        return []
    rows = np.searchsorted(stored.history["increment"], there)
    travel = travelled(stored.history, stored.problem)[rows].tolist()
    ends = set(np.flatnonzero(stored.ends[rows]).tolist())
    peak = largest_force(stored, there)
    first = [len(there) - 1, *([there.index(peak)] if peak is not None else [])]
    return [there[k] for k in evenly(travel, first, ends)]


def row_order(stored: Stored, first: Sequence[int]) -> Iterator[int]:
    """Rows of the history, the ones to show first in front: *first*, then `evenly`."""
    return evenly(travelled(stored.history, stored.problem).tolist(), first)


# ------------------------------------------------------------------------------------------------------------- details
def _gap(travel: Sequence[float], a: int, b: int) -> tuple[float, int, int, int]:
    """A gap as it is sorted: the widest by travel first, of equal ones that with most places."""
    return -abs(travel[b] - travel[a]), a - b, a, b
