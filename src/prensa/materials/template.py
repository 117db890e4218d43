"""Descriptions apart from their numbers: the same with recorded numbers in their place, of which point functions make graphs."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np

from prensa.types import Array

NO_TABLE = np.zeros(2), np.zeros((1, 4))
"""Knots and coefficients of laws without a table."""

NUMBER = "number"


class Template(NamedTuple):
    """What a description is but for its numbers: its class, and the ``parts`` that are no numbers; hashable."""

    parts: Any
    numbers: int

    @classmethod
    def of(cls, description: Any, without: Collection[str] = ()) -> tuple[Template, Array]:
        """With the numbers (k,) that it has, in the order of its fields; ``without`` the fields of these names."""
        numbers: list[float] = []
        parts = _parts(description, numbers, without)
        return cls(parts, len(numbers)), np.array(numbers)

    def filled(self, numbers: Sequence[Any]) -> Any:
        """The description with other numbers, which are not checked."""
        return _filled(self.parts, iter(numbers))


def _parts(value: Any, numbers: list[float], without: Collection[str] = ()) -> Any:
    if isinstance(value, float):
        numbers.append(value)
        return NUMBER
    if isinstance(value, list | tuple):
        return type(value), *(_parts(v, numbers) for v in value)
    if is_dataclass(value):
        some = [f.name for f in fields(value) if f.name not in without]
        return type(value), *((name, _parts(getattr(value, name), numbers)) for name in some)
    return None, value


def _filled(parts: Any, numbers: Iterator[Any]) -> Any:
    if parts is NUMBER or parts == NUMBER:
        return next(numbers)
    cls: Any = parts[0]
    inner = parts[1:]
    if cls is None:
        return inner[0]
    if not is_dataclass(cls):
        return cls(_filled(p, numbers) for p in inner)
    out: Any = object.__new__(cls)  # type: ignore[arg-type]
    for name, p in inner:
        object.__setattr__(out, name, _filled(p, numbers))
    return out
