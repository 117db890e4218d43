"""Features for scripts that case files do not have yet: marked where they are defined, refused where files are read.

A capability begins here: it can be solved from Python, and files get its keys when checks, reports and restarts know of it.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from typing import Annotated, Any

from pydantic_core import PydanticOmit

from prensa.model.names import Finding

ALONE = "is described in Python alone so far: write the problem as a script (docs/guide/python.md)"


@dataclasses.dataclass(frozen=True)
class PythonAlone:
    """Marks a field of a description: those of its values for which ``when`` holds may not stand in a file."""

    when: Callable[[Any], bool]

    def __get_pydantic_json_schema__(self, core: Any, handler: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        """The JSON schema of case files has no such field or value: editors would offer what is refused."""
        if self is WHOLE:
            raise PydanticOmit
        made = handler(core)
        if "enum" in made:
            made["enum"] = [value for value in made["enum"] if not self.when(value)]
        kept = [option for option in made.get("oneOf", ()) if not self.when((0.0,) * option["minItems"])]
        return kept[0] if len(kept) == 1 else made


WHOLE = PythonAlone(lambda value: True)
"""The field as a whole."""


@lru_cache
def marks(cls: Any) -> dict[str, PythonAlone]:
    """The marked fields of a class of the vocabulary."""
    found = typing.get_type_hints(cls, include_extras=True)
    return {name: mark for name, hint in found.items() if (mark := _mark(hint)) is not None}


def _mark(hint: Any) -> PythonAlone | None:
    """The mark of an annotation, that of an alternative included."""
    if typing.get_origin(hint) is Annotated:
        return next((m for m in hint.__metadata__ if isinstance(m, PythonAlone)), None) or _mark(hint.__origin__)
    options = typing.get_args(hint) if typing.get_origin(hint) in (typing.Union, types.UnionType) else ()
    return next((mark for option in options if (mark := _mark(option)) is not None), None)


def in_files(cls: Any) -> list[str]:
    """Fields of a class that a case file may have."""
    return [f.name for f in dataclasses.fields(cls) if marks(cls).get(f.name) is not WHOLE]


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
            given, mark = getattr(value, f.name), marked.get(f.name)
            if mark is not None and given != f.default and mark.when(given):
                yield Finding((*path, f.name), f"{f.name if mark is WHOLE else _shown(f.name, given)} {ALONE}")
            else:
                yield from of_python_alone(given, (*path, f.name))


def _shown(name: str, value: Any) -> str:
    return f"{name!r} with {len(value)} components" if isinstance(value, tuple) else f"'{name}: {value}'"
