"""Errors in the arguments of a description made in Python, in the sentences that a case file gets.

The arguments are laid out as the tree that a file would be, without places: the traceback shows the line of the script.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from prensa.errors import CaseError, Mark, Mistake, shown
from prensa.model.checks import FindingsError
from prensa.model.fields import explain_with
from prensa.model.messages import mistakes
from prensa.model.places import Place
from prensa.model.text import MAX_NESTING, Node

NOWHERE = Mark("")
MOST_VALUES = 5_000  # of the arguments that are laid out: more say nothing about what is wrong


class _Value(Node):
    """A value of a script: what it is called in a message is how Python would write it."""

    def shown(self) -> str:
        """The value in a message."""
        return self.text


def explained(cls: type, error: ValidationError, arguments: tuple[Any, ...], named: Mapping[str, Any]) -> CaseError:
    """All that is wrong with ``cls(*arguments, **named)``, one sentence each, as of the keys of a file."""
    # pydantic gives positional arguments by number: their names are those of the fields in order.
    names = [f.name for f in dataclasses.fields(cls) if f.init]
    found = error.errors(include_url=False)
    given = dict(zip(names, arguments)) | dict(named)
    node = _tree(given, itertools.repeat(None, MOST_VALUES), 0)
    root = Place((), cls, node, None, cls.__name__)
    said = list(_of_the_call(cls, found, names, len(arguments)))
    inside = [
        e | {"loc": _by_name(e["loc"], names)}
        for e in found
        if e["type"] not in ("unexpected_positional_argument", "multiple_argument_values")
    ]
    said += [f"{f.path and '.'.join(map(str, f.path))}: {f.message}" for e in inside for f in _findings(e)]
    said += [
        str(e["ctx"]["error"]) for e in inside if not e["loc"] and not _findings(e) and "error" in e.get("ctx", {})
    ]
    # of a file's errors the first key is that of a case's problem, and is left out
    within = mistakes([e | {"loc": ("problem", *e["loc"])} for e in inside if e["loc"]], (), root, [])
    return CaseError([*(Mistake(NOWHERE, s) for s in said), *within])


def _of_the_call(cls: type, errors: list[Any], names: list[str], given: int) -> Iterator[str]:
    """What can be wrong with a call and with no file: too many values, one given twice."""
    if given > len(names):
        yield f"{cls.__name__} is given {given} values and has {len(names)}: {', '.join(names)}"
    for e in errors:
        if e["type"] == "multiple_argument_values":
            yield f"{e['loc'][-1]!r} of {cls.__name__} is given twice, by its position and by its name; keep one"


def _findings(error: Any) -> tuple[Any, ...]:
    cause = error.get("ctx", {}).get("error")
    return cause.findings if isinstance(cause, FindingsError) and not error["loc"] else ()


def _by_name(loc: tuple[str | int, ...], names: list[str]) -> tuple[str | int, ...]:
    """A path whose beginning, where it is the number of an argument, is the argument's name."""
    if loc and isinstance(loc[0], int) and loc[0] < len(names):
        return (names[loc[0]], *loc[1:])
    return loc


def _tree(value: Any, left: Iterator[None], depth: int) -> Node:
    """Nodes of a value: mappings, lists and descriptions are gone into, as far as a file may be nested."""
    text = shown(value)
    below: Any = None
    # A mesh of a million points as an argument would take seconds to lay out, and no message shows it.
    if depth < MAX_NESTING and next(left, 0) is None:
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            below = {f.name: getattr(value, f.name, None) for f in dataclasses.fields(value)}
        elif isinstance(value, dict | list | tuple):
            below = value
    if isinstance(below, dict):
        nodes = {str(k): _tree(v, left, depth + 1) for k, v in below.items()}
        return _Value(nodes, NOWHERE, text, dict.fromkeys(nodes, NOWHERE))
    if below is not None:
        return _Value([_tree(v, left, depth + 1) for v in below], NOWHERE, text)
    return _Value(None if isinstance(value, dict | list | tuple) else value, NOWHERE, text)


explain_with(explained)
