"""Flow curves σ_y(ε̄, ε̄̇) of one point, written once: slopes, curvatures and derivatives by parameters are generated from them.

They make the return map of the curves of `prensa.materials.flow` fast; a curve without one works too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from prensa.kernels import record
from prensa.kernels.differentiate import forward, units
from prensa.kernels.emit import Kind, Program, Rows, Shared, generated, puts
from prensa.kernels.record import TINY, Node, cell, exp, given, log, many, piece, power, where
from prensa.materials.flow_curve import FlowCurve, FlowParameters, stress_at
from prensa.materials.template import NO_TABLE, Template
from prensa.types import Array

PERFECT, LINEAR, LUDWIK, SWIFT, VOCE, HOCKETT_SHERBY, JOHNSON_COOK, TABLE = range(8)

CURVE_SCALARS = 5
"""Numbers p of the curves here; of a table its last strain, then shifts of its stresses, all 0, by which it is differentiated."""
SHIFT_NOW, SHIFT_BEGUN, SHIFT_COMMITTED = 1, 2, 3
"""Shifts of a table's stresses at the end of an increment, as it begins and as committed."""


class Table(NamedTuple):
    """Knots (k,) and coefficients (k − 1, 4) of the cubics between them; in recorded functions the names of the arrays."""

    knots: Any
    coefficients: Any


TABLE_ARRAYS = Table("knots", "coefficients")


def _perfect(a: Node, da: Node, dt: Node, p: Sequence[Node], table: Table) -> Node:
    return p[0] + 0.0 * a


def _linear(a: Node, da: Node, dt: Node, p: Sequence[Node], table: Table) -> Node:
    return p[0] + p[1] * a


def _ludwik(a: Node, da: Node, dt: Node, p: Sequence[Node], table: Table) -> Node:
    return p[0] + p[1] * power(a, p[2])


def _swift(a: Node, da: Node, dt: Node, p: Sequence[Node], table: Table) -> Node:
    return p[0] * exp(p[2] * log(p[1] + a))


def _voce(a: Node, da: Node, dt: Node, p: Sequence[Node], table: Table) -> Node:
    return p[0] + p[1] * (1.0 - exp(-(p[2] * a))) + p[3] * a


def _hockett_sherby(a: Node, da: Node, dt: Node, p: Sequence[Node], table: Table) -> Node:
    below = a < TINY
    x = where(below, TINY, a)
    risen = (p[1] - p[0]) * (1.0 - exp(-(p[2] * exp(p[3] * log(x)))))
    return p[0] + where(below, risen * (a / x), risen)


def _johnson_cook(a: Node, da: Node, dt: Node, p: Sequence[Node], table: Table) -> Node:
    timed = dt > 0.0
    rate = where(timed, da / where(timed, dt, 1.0), 0.0) / p[4]
    fast = rate > 1.0
    return _ludwik(a, da, dt, p, table) * (1.0 + p[3] * log(where(fast, rate, 1.0)))


def _table(a: Node, da: Node, dt: Node, p: Sequence[Node], table: Table) -> Node:
    k = piece(a, table.knots)
    d = where(a < p[0], a, p[0]) - cell(k, table.knots, 1, 0)
    c = [cell(k, table.coefficients, 4, i) for i in range(4)]
    return ((c[0] * d + c[1]) * d + c[2]) * d + c[3]


CURVES: tuple[Callable[[Node, Node, Node, Sequence[Node], Table], Node], ...] = (
    _perfect, _linear, _ludwik, _swift, _voce, _hockett_sherby, _johnson_cook, _table,
)  # fmt: skip
"""By kind: each takes the plastic strain a, the part da of it that the increment in the time dt has brought, and its scalars."""


def scalars(kind: int | Template) -> int:
    """How many numbers p a kind of curve has."""
    return kind.numbers if isinstance(kind, Template) else CURVE_SCALARS


def _stated(curve: Template, a: Node, da: Node, dt: Node, p: Sequence[Node]) -> Node:
    """The flow stress that a description states as a point function."""
    timed = dt > 0.0
    out = curve.filled(p).stress(a, where(timed, da / where(timed, dt, 1.0), 0.0))
    return out[0] if isinstance(out, tuple) else out


class Curve(NamedTuple):
    """A flow curve of a point: its kind, scalars and table."""

    kind: int | Template
    p: Sequence[Node]
    table: Table

    def stress(self, a: Node, da: Node, dt: Node, shift: int = SHIFT_NOW) -> Node:
        """Flow stress at the plastic strain a, da of which the increment in the time dt has brought; shift: of a table."""
        if isinstance(self.kind, Template):
            return _stated(self.kind, a, da, dt, self.p)
        found = CURVES[self.kind](a, da, dt, self.p, self.table)
        return found + self.p[shift] if self.kind == TABLE else found

    def at_rest(self, a: Node, shift: int = SHIFT_BEGUN) -> Node:
        """Flow stress at the plastic strain a of a rate of zero."""
        return self.stress(a, 0.0 * a, 0.0 * a, shift)

    @property
    def smooth(self) -> bool:
        """Whether its slope has a slope everywhere beyond zero."""
        return not isinstance(self.kind, Template) and self.kind < JOHNSON_COOK


@generated
def _stress_kernel(kind: int | Template) -> Program:
    """Rows (a, da) → stress, its first and second total derivative by a, that by a at a fixed da, by each of the scalars."""
    a, da = many("strain", 2)
    p, dt = many("p", scalars(kind)), given("dt", 0)
    stress = Curve(kind, p, TABLE_ARRAYS).stress(a, da, dt)
    along = {a: [record.ONE], da: [record.ONE]}
    slope = forward([stress], along, 1)[0][0]
    partial = forward([stress], {a: [record.ONE]}, 1)[0][0]
    by_p = forward([stress], units(p), len(p))[0]
    out = [stress, slope, forward([slope], along, 1)[0][0], partial, *by_p]
    arrays: dict[str, Kind] = {
        "strain": Rows(2), "p": Shared(), "dt": Shared(), "knots": Shared(), "coefficients": Shared(), "out": Rows(len(out)),
    }  # fmt: skip
    return Program(arrays, puts("out", out))


def stresses(f: FlowParameters, a: Array, da: Array | float = 0.0, dt: float = 0.0) -> Array:
    """Flow stresses (n, 4 + k) at plastic strains a (n,), da of which came in the time dt, with their derivatives.

    Columns: the stress, its first and second total derivative by a, that by a at a fixed da, and by each of the scalars (k).
    """
    strain = np.empty((len(a), 2))
    strain[:, 0], strain[:, 1] = a, da
    out = np.empty((len(a), 4 + len(f.p)))
    _stress_kernel(f.kind)(len(a), strain, f.p, np.array([dt]), f.knots, f.coefficients, out)
    return out


def parameters(kind: int, *p: float) -> FlowParameters:
    """Of a curve with the scalars p, at most five."""
    return FlowParameters(kind, np.append(p, np.zeros(CURVE_SCALARS - len(p))), *NO_TABLE)


def flow_curve(flow: FlowCurve, plastic_strain: Array, rate: float = 0.0) -> Array:
    """Flow stress at each plastic strain (n,) → (n,), for plots and closed forms; ``rate`` in 1/time."""
    a = np.atleast_1d(np.asarray(plastic_strain, dtype=np.float64))
    return stress_at(flow, a, np.full_like(a, rate))
