"""Friction laws as functions of one point, recorded: graphs of bounds for the generator, the same for all laws of one form.

A law states its bound once, in `FrictionLaw.bound_of_point`, of its own fields, of the pressure and of the slip. Here it is
called on a copy whose numbers are recorded ones: so machine code belongs to the form of a law (its class, and which of its
fields are given) and not to its values, and there are derivatives by these.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum, auto
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np

from prensa.friction.at import At
from prensa.friction.table import Table
from prensa.kernels.differentiate import forward, units
from prensa.kernels.emit import Kind, Program, Rows, Shared, generated, puts
from prensa.kernels.record import ZERO, Node, given, lift, many
from prensa.types import Array


class LawOfPoint(Protocol):
    """A law that is stated for one point; see `prensa.friction.law.FrictionLaw`."""

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound at a pressure and a slip."""


class Stands(Enum):
    """What stands for a value of a law that is recorded."""

    NUMBER = auto()
    TABLE = auto()


Form = tuple[type, tuple[tuple[str, Any], ...]]
"""Class of a part of a law, and what it has by name: what stands for a value, the form of another part, or a value itself."""


class Values(NamedTuple):
    """A law taken apart: its form, numbers (n,), and of its tables, one after another, knots (k,) and coefficients (k − 1, 4)."""

    form: Form
    numbers: Array
    tables: tuple[Array, ...]


def values_of(law: LawOfPoint) -> Values:
    """Take a law apart."""
    own: Any = law
    try:
        hash(own)
    except TypeError:  # a law with a field that is a list
        return _values.__wrapped__(own)
    return _values(own)


@lru_cache(maxsize=256)
def _values(law: Any) -> Values:
    numbers, tables = list[float](), list[Array]()
    return Values(_form(law, numbers, tables), np.array(numbers), tuple(tables))


def _form(part: Any, numbers: list[float], tables: list[Array]) -> Form:
    found = []
    for name in (*(f.name for f in fields(part)), *getattr(part, "derived", ())):
        value: Any = getattr(part, name)
        kind: Any = value
        if isinstance(value, float):
            numbers.append(value)
            kind = Stands.NUMBER
        elif isinstance(value, Table):
            numbers += [value.first, value.last]
            tables += [value.knots, value.coefficients]
            kind = Stands.TABLE
        elif is_dataclass(value):
            kind = _form(value, numbers, tables)
        elif isinstance(value, tuple | list):  # of these there is what is derived of them
            continue
        found.append((name, kind))
    return type(part), tuple(found)


class Recorded:
    """A ``law`` of a form with recorded numbers; ``tables``: names of the arrays of its tables."""

    def __init__(self, form: Form, numbers: Iterator[Node]) -> None:
        self.tables: list[tuple[str, str]] = []
        self.law: Any = self._part(form, numbers)

    def _part(self, form: Form, numbers: Iterator[Node]) -> Any:
        cls, found = form
        # Past the validation of the class, whose fields are nodes here, and into __dict__, where cached properties look first:
        # what is `derived` becomes a number of the graph too.
        out: Any = object.__new__(cls)
        for name, kind in found:
            if kind is Stands.NUMBER:
                # `arrays_of` asks for the names of tables alone, and has no numbers to give.
                out.__dict__[name] = next(numbers, ZERO)
            elif kind is Stands.TABLE:
                own = f"knots_{len(self.tables)}", f"coefficients_{len(self.tables)}"
                self.tables.append(own)
                out.__dict__[name] = Table(*own, next(numbers, ZERO), next(numbers, ZERO))
            elif isinstance(kind, tuple):
                out.__dict__[name] = self._part(kind, numbers)
            else:
                out.__dict__[name] = kind
        return out


AT = ("k", "speed", "dt", "time")
"""What a bound depends on besides pressure, slip and the numbers of the law; see `At`."""


class PointLaw(NamedTuple):
    """A law of a form at a point: what `AT` names, and its numbers."""

    form: Form
    hardens: bool
    at: Sequence[Node]
    numbers: Sequence[Node]

    def bound(self, p: Node, kappa: Node) -> Node:
        """The bound at a pressure and a slip."""
        k, speed, dt, time = self.at
        law = Recorded(self.form, iter(self.numbers)).law
        return lift(law.bound_of_point(p, kappa, At(k, dt, time, speed)))  # type: ignore[arg-type]

    @property
    def args(self) -> list[Node]:
        """What it depends on, for functions that are recorded by themselves."""
        return [*self.at, *self.numbers]

    def of(self, args: Sequence[Node]) -> PointLaw:
        """The same law of other `args`."""
        return self._replace(at=args[: len(AT)], numbers=args[len(AT) :])


def read(form: Form, hardens: bool) -> PointLaw:
    """A law of a form whose numbers are read from `arrays_of` it."""
    return PointLaw(
        form, hardens, [given("k", 0), given("speed", 0), *many("times", 2)], many("numbers", count_of(form))
    )


def count_of(form: Form) -> int:
    """How many numbers a law of a form has."""
    own = {Stands.NUMBER: 1, Stands.TABLE: 2}
    return sum(count_of(kind) if isinstance(kind, tuple) else own.get(kind, 0) for _, kind in form[1])


def arrays_of(form: Form) -> dict[str, Kind]:
    """Arrays that a law of a form is read from."""
    names = [name for table in Recorded(form, iter(())).tables for name in table]
    tables: dict[str, Kind] = dict.fromkeys(names, Shared())
    return {"k": Rows(1), "speed": Rows(1), "times": Shared(), "numbers": Shared(), **tables}


def arrays(values: Values, at: At, count: int) -> tuple[Array, ...]:
    """A law and what it depends on, as `arrays_of` has them, for ``count`` points."""
    none = np.zeros(count) if at.k is None or at.speed is None else values.numbers
    k, speed = none if at.k is None else at.k, none if at.speed is None else at.speed
    return k, speed, np.array([at.dt, at.time]), values.numbers, *values.tables


@generated
def _bounds(form: Form) -> Program:
    """Rows (p, κ) → the bound and its derivatives by both."""
    p, kappa = many("x", 2)
    tau = read(form, True).bound(p, kappa)
    slopes = forward([tau], units((p, kappa)), 2)[0]
    return Program({"x": Rows(2), **arrays_of(form), "out": Rows(3)}, puts("out", [tau, *slopes]))


def bounds(law: LawOfPoint, p: Array, kappa: Array, at: At) -> tuple[Array, Array, Array]:
    """τ_y, ∂τ_y/∂p, ∂τ_y/∂κ, each (k,), of a law that is stated for one point."""
    values, out = values_of(law), np.empty((len(p), 3))
    _bounds(values.form)(len(p), np.stack([p, kappa], axis=1), *arrays(values, at, len(p)), out)
    tau, by_p, by_kappa = np.ascontiguousarray(out.T)
    return tau, by_p, by_kappa
