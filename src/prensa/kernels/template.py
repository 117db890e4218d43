"""Descriptions apart from their numbers: the same with recorded numbers in their place, of which point functions make graphs.

Machine code belongs to what a description is without its numbers, and there are derivatives by these.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum, auto
from typing import Any, NamedTuple

import numpy as np

from prensa.errors import ArgumentError, shown
from prensa.kernels.table import Table
from prensa.types import Array


class Stands(Enum):
    """What stands for a value that is no part of a template."""

    NUMBER = auto()
    DERIVED = auto()
    """A table of numbers, of which there is what its class names as ``derived``."""

    __hash__ = object.__hash__  # that of Enum takes as long as all the rest of a look-up


class Apart(NamedTuple):
    """A description taken apart: ``numbers`` (n,) in the order of its fields, of tables knots (k,), coefficients (k − 1, 4)."""

    template: Template
    numbers: Array
    tables: tuple[tuple[Array, Array], ...]


class Template(NamedTuple):
    """What a description is but for its numbers: its class, and the ``parts`` that are no numbers, with their types; hashable."""

    parts: Any
    numbers: int
    tables: int

    @classmethod
    def of(cls, description: Any, without: Collection[str] = ()) -> Apart:
        """Take a description apart, ``without`` the fields of these names.

        Numbers are its floats, those in its tuples, lists and dicts and in descriptions within it too, and the cached properties
        that its class names as ``derived``, numbers and `Table`s; where there are such, tuples and lists are left out.

        Raises
        ------
        ArgumentError
            Of a field of which no template can be made.

        """
        found = _Reader(type(description).__name__)
        parts = found.parts(description, "", without)
        return Apart(cls(parts, len(found.numbers), len(found.tables)), np.array(found.numbers), tuple(found.tables))

    @property
    def description(self) -> Any:
        """Its class."""
        return self.parts[0]

    def filled(self, numbers: Sequence[Any], tables: Iterable[Table] = ()) -> Any:
        """The description with other numbers, which are not checked, and with other arrays of its tables."""
        return _filled(self.parts, iter(numbers), iter(tables))


class _Reader:
    """What is read of the description of a ``name``."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.numbers: list[float] = []
        self.tables: list[tuple[Array, Array]] = []

    def parts(self, value: Any, field: str, without: Collection[str] = ()) -> Any:
        """Of a value: what stands for it, its class and parts, or itself with its type (1, 1.0 and True are equal)."""
        if isinstance(value, float):
            self.numbers.append(float(value))
            return Stands.NUMBER
        if isinstance(value, Table):
            self.tables.append((value.knots, value.coefficients))
            return Table, self.parts(value.first, field), self.parts(value.last, field)
        if isinstance(value, list | tuple):
            return type(value), *(self.parts(v, field) for v in value)
        if isinstance(value, dict):
            return type(value), *((self._itself(k, field), self.parts(v, field)) for k, v in value.items())
        if is_dataclass(value) and not isinstance(value, type):
            return type(value), *self._fields(value, field, without)
        return self._itself(value, field)

    def _fields(self, value: Any, field: str, without: Collection[str]) -> Iterator[tuple[str, Any]]:
        derived = getattr(value, "derived", ())
        for name in (*(f.name for f in fields(value) if f.name not in without), *derived):
            own = getattr(value, name)
            left_out = derived and isinstance(own, list | tuple) and not isinstance(own, Table)
            yield name, Stands.DERIVED if left_out else self.parts(own, f"{field}.{name}" if field else name)

    def _itself(self, value: Any, field: str) -> tuple[Any, ...]:
        try:
            hash(value)
        except TypeError:
            raise ArgumentError(
                f"{self.name}: no machine code can be made of {shown(value)} in the field {field!r}: a law that is stated for "
                "one point has numbers, texts, and tuples, lists and dicts of these as fields; a long table is a "
                "prensa.kernels.table.Table that the class names in 'derived'"
            ) from None
        inside = frozenset(self._itself(v, field) for v in value) if isinstance(value, frozenset) else None
        return None, type(value), value, inside


class _LeftOut:
    """A field of which a law that is stated for one point has what is ``derived`` of it."""

    def __init__(self, law: str, field: str) -> None:
        self._words = (
            f"{law}: the field {field!r} cannot be used where the law is stated for one point, for the class names what is "
            "'derived' of its fields: use that, or name there a cached property, a number or a Table, that has what is needed"
        )

    def __iter__(self) -> Iterator[Any]:
        raise ArgumentError(self._words)

    def __len__(self) -> int:
        raise ArgumentError(self._words)

    def __getitem__(self, key: Any) -> Any:
        raise ArgumentError(self._words)


def _filled(parts: Any, numbers: Iterator[Any], tables: Iterator[Table]) -> Any:
    if parts is Stands.NUMBER:
        return next(numbers)
    cls: Any = parts[0]
    inner = parts[1:]
    if cls is None:
        return inner[1]
    if cls is Table:
        first, last = (_filled(p, numbers, tables) for p in inner)
        return next(tables)._replace(first=first, last=last)
    if issubclass(cls, dict):
        return {k[2]: _filled(p, numbers, tables) for k, p in inner}
    if not is_dataclass(cls):
        return getattr(cls, "_make", cls)(_filled(p, numbers, tables) for p in inner)
    description: Any = cls
    # Past the validation of the class, whose fields are nodes here, and into __dict__, where cached properties look first: what
    # is `derived` becomes a number of the graph too.
    out = object.__new__(description)
    for name, p in inner:
        out.__dict__[name] = _LeftOut(description.__name__, name) if p is Stands.DERIVED else _filled(p, numbers, tables)
    return out
