"""Committed states compared: a continued run is the run, bit for bit."""

from __future__ import annotations

from prensa.system.state import State


def same(a: State, b: State) -> bool:
    """Whether two states have the same arrays with the same bits."""
    one, two = a.arrays(), b.arrays()
    return list(one) == list(two) and all(one[k].tobytes() == two[k].tobytes() for k in one)
