"""Friction laws as functions of one point, recorded: graphs of bounds for the generator, the same for all laws of one form.

A law states its bound once, in `FrictionLaw.bound_of_point`, of its own fields, of the pressure and of the slip. Here it is
called on a copy whose numbers are recorded ones: so machine code belongs to the form of a law (its class, and which of its
fields are given) and not to its values, and there are derivatives by these.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from prensa.friction.at import At
from prensa.kernels.differentiate import forward, units
from prensa.kernels.emit import Kind, Program, Rows, Shared, puts
from prensa.kernels.machine_code import generated
from prensa.kernels.record import Node, given, lift, many
from prensa.kernels.table import Table
from prensa.kernels.template import Template
from prensa.types import Array


class LawOfPoint(Protocol):
    """A law that is stated for one point; see `prensa.friction.law.FrictionLaw`."""

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound at a pressure and a slip."""


Form = Template
"""What a law is but for its numbers and tables: machine code belongs to it."""


class Values(NamedTuple):
    """A law taken apart: its form, numbers (n,), and of its tables, one after another, knots (k,) and coefficients (k − 1, 4)."""

    form: Form
    numbers: Array
    tables: tuple[Array, ...]


_TAKEN_APART = "_taken_apart"


def values_of(law: LawOfPoint) -> Values:
    """Take a law apart: once for each, which keeps what it has been found to be."""
    # Not looked up among equal ones: laws with 1, 1.0 and True in a field are equal, and have other forms.
    kept = vars(law)
    if _TAKEN_APART not in kept:
        form, numbers, tables = Template.of(law)
        kept[_TAKEN_APART] = Values(form, numbers, tuple(array for table in tables for array in table))
    found: Values = kept[_TAKEN_APART]
    return found


def _tables(form: Form) -> list[tuple[str, str]]:
    """Names of the arrays of the tables of a form."""
    return [(f"knots_{k}", f"coefficients_{k}") for k in range(form.tables)]


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
        law = self.form.filled(self.numbers, [Table(*names, None, None) for names in _tables(self.form)])
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
    return PointLaw(form, hardens, [given("k", 0), given("speed", 0), *many("times", 2)], many("numbers", form.numbers))


def arrays_of(form: Form) -> dict[str, Kind]:
    """Arrays that a law of a form is read from."""
    names = [name for table in _tables(form) for name in table]
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
