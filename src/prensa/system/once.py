"""What follows from a discretised problem alone, found once for all who ask: its steps with bodies at rest, what resists them."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

from prensa.system.bodies import Bodies

Of = TypeVar("Of", bound=Bodies)
Found = TypeVar("Found")
P = ParamSpec("P")


def once(find: Callable[Concatenate[Of, P], Found]) -> Callable[Concatenate[Of, P], Found]:
    """A function of a system, and of hashable values, that is called once for each.

    What it finds is kept as long as the system is, and not to be changed.

    The checks before a run are a list of functions that know nothing of one another, and several look at the same things.
    """
    known: WeakKeyDictionary[Of, dict[Hashable, Found]] = WeakKeyDictionary()

    @wraps(find)
    def found(system: Of, *args: P.args, **kwargs: P.kwargs) -> Found:
        of = known.setdefault(system, {})
        key = (args, *kwargs.items())
        if key not in of:
            of[key] = find(system, *args, **kwargs)
        return of[key]

    return found
