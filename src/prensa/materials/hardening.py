"""Flow curves at one point, recorded: slopes, curvatures and derivatives by parameters are generated from what they state.

A curve states its stress once, see `prensa.materials.flow_curve.PointCurve`. Here that is called on a copy of it whose numbers
are recorded ones: so machine code belongs to a curve's class, and not to its values.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from prensa.kernels import record
from prensa.kernels.differentiate import forward, units
from prensa.kernels.emit import Kind, Program, Rows, Shared, puts
from prensa.kernels.machine_code import generated
from prensa.kernels.record import Node, given, many, where
from prensa.kernels.table import Table
from prensa.kernels.template import Template
from prensa.materials.flow_curve import SHIFTS, FlowCurve, FlowParameters, stress_at
from prensa.types import Array

SHIFT_NOW, SHIFT_BEGUN, SHIFT_COMMITTED = 1, 2, 3
"""Shifts of a table's values at the end of an increment, as it begins and as committed: places beyond its last knot."""


class Knots(NamedTuple):
    """Knots (k,) and coefficients (k − 1, 4) of the cubics between them; in recorded functions the names of the arrays."""

    knots: Any
    coefficients: Any


TABLE_ARRAYS = Knots("knots", "coefficients")


def scalars(kind: Template | None) -> int:
    """How many numbers p a kind of curve has: those of its description, then the shifts of a table."""
    return 0 if kind is None else kind.numbers + (SHIFTS if kind.tables else 0)


def table_at(kind: Template | None) -> int | None:
    """Place among these of the last knot of a table, which the shifts follow; None where there is none."""
    return kind.numbers - 1 if kind is not None and kind.tables else None


class Curve(NamedTuple):
    """A flow curve of a point: its kind, numbers p and table."""

    kind: Template
    p: Sequence[Node]
    table: Knots

    def stress(self, a: Node, da: Node, dt: Node, shift: int = SHIFT_NOW) -> Node:
        """Flow stress at the plastic strain a, da of which the increment in the time dt has brought; shift: of a table."""
        timed = dt > 0.0
        last = table_at(self.kind)
        tables = [] if last is None else [Table(*self.table, None, None, self.p[last + shift])]
        found = self.kind.filled(self.p, tables).stress(a, where(timed, da / where(timed, dt, 1.0), 0.0))
        return (found[0] if isinstance(found, tuple) else found) + 0.0 * a

    def at_rest(self, a: Node, shift: int = SHIFT_BEGUN) -> Node:
        """Flow stress at the plastic strain a of a rate of zero."""
        return self.stress(a, 0.0 * a, 0.0 * a, shift)

    @property
    def smooth(self) -> bool:
        """Whether its slope has a slope everywhere beyond zero."""
        return bool(self.kind.description.smooth)


@generated
def _stress_kernel(kind: Template) -> Program:
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


def flow_curve(flow: FlowCurve, plastic_strain: Array, rate: float = 0.0) -> Array:
    """Flow stress at each plastic strain (n,) → (n,), for plots and closed forms; ``rate`` in 1/time."""
    a = np.atleast_1d(np.asarray(plastic_strain, dtype=np.float64))
    return stress_at(flow, a, np.full_like(a, rate))
