"""Features for scripts that case files do not have yet: marked where they are defined, refused where files are read.

A capability begins here: it can be solved from Python, and files get its keys when checks, reports and restarts know of it.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from typing import Any

from pydantic_core import PydanticOmit

from prensa.model.names import Finding

ALONE = "is described in Python alone so far: write the problem as a script (docs/guide/python.md)"


class PythonAlone:
    """Marks a field of a description that may not stand in a file."""

    def __get_pydantic_json_schema__(self, core: Any, handler: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        """The JSON schema of case files has no such field: editors would offer what is refused."""
        raise PydanticOmit


WHOLE = PythonAlone()
"""The mark; there is one."""


@lru_cache
def marks(cls: Any) -> frozenset[str]:
    """The marked fields of a class of the vocabulary."""
    hints = typing.get_type_hints(cls, include_extras=True)
    return frozenset(name for name, hint in hints.items() if WHOLE in getattr(hint, "__metadata__", ()))


def in_files(cls: Any) -> list[str]:
    """Fields of a class that a case file may have."""
    return [f.name for f in dataclasses.fields(cls) if f.name not in marks(cls)]


def of_python_alone(value: Any, path: tuple[str | int, ...] = ()) -> Iterator[Finding]:
    """What of a description a case file may not say, each with its place."""
    if isinstance(value, Mapping):
        for key, entry in value.items():
            yield from of_python_alone(entry, (*path, key))
    # Rows of coordinates hold no descriptions: going into each number of a mesh takes longer than reading the file.
    elif isinstance(value, tuple) and not (value and isinstance(value[0], float)):
        for k, entry in enumerate(value):
            yield from of_python_alone(entry, (*path, k))
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        if not getattr(value, "offered", True):
            yield Finding(path, f"{getattr(value, 'type', '')!r} {ALONE}")
            return
        marked = marks(type(value))
        for f in dataclasses.fields(value):
            given = getattr(value, f.name)
            if f.name in marked and given != f.default:
                yield Finding((*path, f.name), f"{f.name} {ALONE}")
            else:
                yield from of_python_alone(given, (*path, f.name))
