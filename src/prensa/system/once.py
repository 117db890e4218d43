"""What follows from a discretised problem alone, found once for all who ask: its steps with bodies at rest, what resists them."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

from prensa.system.bodies import Bodies

Of = TypeVar("Of", bound=Bodies)
Found = TypeVar("Found")


def once(find: Callable[[Of], Found]) -> Callable[[Of], Found]:
    """A function of a system that is called once for each; what it finds is kept as long as the system is, and not to be changed.

    The checks before a run are a list of functions that know nothing of one another, and several look at the same things.
    """
    known: WeakKeyDictionary[Of, Found] = WeakKeyDictionary()

    @wraps(find)
    def found(system: Of) -> Found:
        if system not in known:
            known[system] = find(system)
        return known[system]

    return found
