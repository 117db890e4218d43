"""Mechanisms of the solver, and what each is replaced by where it is off: its neutral element, put where the solver composes it.

The solver has no switches for the panel. A function is replaced in the module that calls it, a method in its class, or a constant
is given with which the mechanism cannot act. What is replaced is named by itself, so that type checks notice when it moves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from types import ModuleType
from typing import Any, NamedTuple

import prensa as pr
from prensa.policy import Policy


class Replaced(NamedTuple):
    """The name ``name`` of a module or class means ``neutral`` while the mechanism is off."""

    owner: ModuleType | type
    name: str
    neutral: Callable[..., Any]


def replaced(owner: ModuleType | type, original: Callable[..., Any], neutral: Callable[..., Any]) -> Replaced:
    """What *owner* calls *original* is *neutral*."""
    return Replaced(owner, original.__name__, neutral)


@dataclass(frozen=True)
class Mechanism:
    """A special mechanism of the solver, in one sentence, and how it is switched off.

    ``replaces``: functions and methods; ``policy``, ``numerics``: constants and settings with which it cannot act. ``guard``: the
    test, as pytest names it, that fails without it: it stays whatever it costs.
    """

    name: str
    what: str
    replaces: tuple[Replaced, ...] = ()
    policy: Mapping[str, Any] = field(default_factory=dict)
    numerics: Mapping[str, Any] = field(default_factory=dict)
    guard: str = ""


@contextmanager
def without(mechanisms: Iterable[Mechanism]) -> Iterator[None]:
    """A block in which the functions of some mechanisms are their neutral elements."""
    with ExitStack() as back:
        for owner, name, neutral in (r for m in mechanisms for r in m.replaces):
            before = owner.__dict__[name]
            setattr(owner, name, neutral)
            back.callback(setattr, owner, name, before)
        yield


def settings(mechanisms: Iterable[Mechanism], numerics: pr.Numerics) -> tuple[pr.Numerics, Policy]:
    """Numerics and constants with which some mechanisms cannot act."""
    policy = Policy()
    for m in mechanisms:
        numerics, policy = replace(numerics, **m.numerics), replace(policy, **m.policy)
    return numerics, policy
