"""Derivatives of F-bar quadrilaterals of isotropic metal in finite strain, generated: along directions and backwards.

Point functions of the element (`prensa.elements.fbar`) and the law (`prensa.materials.hencky_j2`) are recorded with the places
x_n and x of the nodes as an increment begins and ends, the committed history, moduli and the flow curve; which points flow is
that of the increment. Weights of forces and histories come back by the reverse mode of the same graphs.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.elements.fbar import CENTRE, POINTS, SHAPES, dilatation, fbar, forces, gradient, gradients
from prensa.kernels import record
from prensa.kernels.differentiate import forward, reverse
from prensa.kernels.emit import Kernel, Kind, Program, Put, Rows, Shared, puts, total
from prensa.kernels.record import ZERO, Node, cell, differs, given, lift, many, piece, where
from prensa.materials.flow_curve import FlowParameters
from prensa.materials.hardening import NAMES, SCALARS, SHIFT_BEGUN, SHIFT_COMMITTED, SHIFT_NOW, TABLE
from prensa.materials.hencky_j2 import (
    Begun,
    Flows,
    Metal,
    begin,
    determinant,
    first_piola,
    hencky_j2,
    stored_energy,
)
from prensa.materials.j2 import NUMBERS, TABLES, metal

Array = NDArray[np.float64]

LANES = 4
"""Directions at a time: they share what there is of values, and more would not stay in registers."""
DOFS = 8
SHAPES_OF_POINTS = np.ascontiguousarray(SHAPES[:POINTS])


class Variant(NamedTuple):
    """What differs between kernels: mode, kind of the flow curve (negative: none), what it limits, whether flow was shifted."""

    axisymmetric: bool
    kind: int
    cauchy: bool
    shifted: bool

    @property
    def fields(self) -> int:
        """Columns of the history."""
        return 10 if self.kind >= 0 else 4


class _Recorded(NamedTuple):
    """The point functions of an element: what it depends on, and forces, history, stored energy per initial volume."""

    x_n: list[Node]
    x: list[Node]
    centre: Node
    committed: list[Node]
    p: list[Node]
    forces: list[Node]
    history: list[Node]
    energy: Node
    strains: tuple[Node, Node, Node]


def _record(v: Variant) -> _Recorded:
    """Record an element at a point; strains: plastic ones as committed, as the increment begins and ends."""
    record.fresh()
    x_n, x, shapes = many("x_n", DOFS), many("x", DOFS), many("shapes", 12)
    committed, p = many("committed", v.fields), many("p", NUMBERS + SCALARS)
    u = [b - a for a, b in zip(x_n, x)]
    middle = dilatation(gradient(u, gradients(x_n, [lift(s) for s in CENTRE], v.axisymmetric)))
    g = gradients(x_n, shapes, v.axisymmetric)
    stretched, _, ratio = fbar(gradient(u, g), middle, v.axisymmetric)
    m = metal(v.kind, v.cauchy, p)
    begun, flows, strains = _begun(committed, m, v)
    found = hencky_j2(stretched, begun, m, flows)
    # V τ ∇N in the present places, V = V_n/(α^m J_n): ∇N f⁻¹ of the places before
    volume = g.volume * given("scale", 0) / (ratio * record.sqrt(determinant(begun.b)))
    r = forces(first_piola(gradient(u, g), found.stress, volume), g)
    after = found.history[4] if v.kind >= 0 else ZERO
    return _Recorded(x_n, x, middle, committed, p, r, list(found.history), stored_energy(found, m), (*strains, after))


def _begun(committed: Sequence[Node], m: Metal, v: Variant) -> tuple[Begun, Flows | None, tuple[Node, Node]]:
    """What the increment begins with, and which points flow by how much, as it found."""
    if v.kind < 0:
        return Begun(committed, ZERO, ZERO, committed), None, (ZERO, ZERO)
    first = begin(committed, given("share", 0), m) if v.shifted else (*committed[:6], *committed[:4])
    begun = Begun(first[:4], first[4], first[5], first[6:])
    was, now = given("old", 4), given("new", 4)
    return begun, Flows(differs(now, was), now - was), (committed[4], first[4])


def _arrays(v: Variant) -> dict[str, Kind]:
    history = Rows(v.fields, points=True)
    return {
        "x_n": Rows(DOFS), "x": Rows(DOFS), "shapes": Shared(12), "committed": history, "old": history, "new": history,
        "p": Shared(), "share": Shared(), "scale": Shared(), **TABLES,
    }  # fmt: skip


def _seeds(e: _Recorded, v: Variant, m: int) -> dict[Node, list[Node]]:
    """Directions of all that an element depends on."""
    along = {
        **dict(zip(e.x_n, _directions("dx_n", DOFS, m))), **dict(zip(e.x, _directions("dx", DOFS, m))),
        **dict(zip(e.committed, _directions("dcommitted", v.fields, m))),
    }  # fmt: skip
    along |= dict(zip(e.p, _directions("dp", NUMBERS + SCALARS, m)))
    if v.kind == TABLE:
        when = zip((SHIFT_COMMITTED, SHIFT_BEGUN, SHIFT_NOW), e.strains)
        along |= {e.p[NUMBERS + shift]: [_table_change(strain, e.p[NUMBERS], m, j) for j in range(m)] for shift, strain in when}
    return along


def _table_change(a: Node, last: Node, m: int, j: int) -> Node:
    """What direction j of m changes of a table's stress at a strain, by its knots and coefficients; not by the last knot."""
    k = piece(a, NAMES.knots)
    d = where(a < last, a, last) - cell(k, NAMES.knots, 1, 0)
    c = [cell(k, NAMES.coefficients, 4, i) for i in range(3)]
    by = [cell(k, "dcoefficients", 4 * m, m * i + j) for i in range(4)]
    slope = (3.0 * c[0] * d + 2.0 * c[1]) * d + c[2]
    return ((by[0] * d + by[1]) * d + by[2]) * d + by[3] - slope * cell(k, "dknots", m, j)


def _directions(array: str, count: int, m: int) -> list[list[Node]]:
    """Numbers of an array with the m directions of each beside one another."""
    return [many(array, m, m * k) for k in range(count)]


def _along(v: Variant, m: int) -> dict[str, Kind]:
    return {
        **_arrays(v), "dx_n": Rows(DOFS * m), "dx": Rows(DOFS * m), "dcommitted": Rows(v.fields * m, points=True),
        "dp": Shared(), "dknots": Shared(), "dcoefficients": Shared(),
    }  # fmt: skip


@cache
def _forces_along(v: Variant, m: int) -> Kernel:
    """Of m directions of all that an element depends on: what they change of its forces, (8, m)."""
    e = _record(v)
    d = forward(e.forces, _seeds(e, v, m), m, locals_=False)
    sums = [x for row in d for x in row]
    return Kernel(Program(_along(v, m) | {"r": Rows(DOFS * m)}, puts("r", map(total, range(len(sums)))), sums, POINTS))


@cache
def _history_along(v: Variant, m: int) -> Kernel:
    """Of m directions: what they change of histories, (4, h, m), and of stored energy and plastic work, (2, m)."""
    e = _record(v)
    d = forward([*e.history, e.energy], _seeds(e, v, m), m, locals_=False)
    volume = given("volume", 0)
    work = d[5] if v.kind >= 0 else [ZERO] * m
    sums = [volume * x for x in [*d[-1], *work]]
    written = [
        *puts("dnew", [x for row in d[: v.fields] for x in row]), *puts("energy", map(total, range(2 * m))),
    ]  # fmt: skip
    arrays = _along(v, m) | {"volume": Rows(1, points=True), "dnew": Rows(v.fields * m, points=True), "energy": Rows(2 * m)}
    return Kernel(Program(arrays, written, sums, POINTS))


@cache
def _back(v: Variant, by_forces: bool) -> Kernel:
    """Weights of histories, and ``by_forces`` of forces, → those of all that an element depends on; without: of x alone."""
    e = _record(v)
    outputs, weights = list(e.history), many("w", v.fields)
    if by_forces:
        outputs, weights = outputs + e.forces, weights + many("r", DOFS)
    places = [*e.x_n, *e.x] if by_forces else e.x
    wanted = [*places, e.centre, *(e.committed + e.p if by_forces else [])]
    bar = reverse(outputs, weights, wanted)
    k = len(places) + 1
    sums, written = bar[:k], list[Put]()
    arrays = _arrays(v) | {"w": Rows(v.fields, points=True), "r": Rows(DOFS), "to_x_n": Rows(DOFS), "to_x": Rows(DOFS)}
    back = [total(i) + b for i, b in enumerate(reverse([e.centre], [total(k - 1)], places))]
    if by_forces:
        written += puts("to_x_n", back[:DOFS])
        sums += bar[k + v.fields :]
        written += puts("to_committed", bar[k : k + v.fields])
        written += puts("to_p", map(total, range(k, len(sums))))
        written += puts("to_stress", [bar[k + v.fields + NUMBERS + SHIFT_NOW]])
        arrays |= {
            "to_committed": Rows(v.fields, points=True), "to_p": Rows(NUMBERS + SCALARS), "to_stress": Rows(1, points=True),
        }  # fmt: skip
    written += puts("to_x", back[-DOFS:])
    return Kernel(Program(arrays, written, sums, POINTS))


class At(NamedTuple):
    """Elements of an increment: places x_n, x (e, 4, 2), histories (e, 4, h) committed, old as it begins, new; numbers p.

    ``share`` of the last plastic strain, see `prensa.materials.hencky_j2.begin`.
    """

    variant: Variant
    x_n: Array
    x: Array
    committed: Array
    old: Array
    new: Array
    p: Array
    share: float
    scale: float
    flow: FlowParameters

    def arrays(self) -> tuple[Array, ...]:
        """As kernels take them."""
        return (
            self.x_n, self.x, SHAPES_OF_POINTS, self.committed, self.old, self.new, self.p, np.array([self.share]),
            np.array([self.scale]), self.flow.knots, self.flow.coefficients,
        )  # fmt: skip


class Along(NamedTuple):
    """Directions of places (e, 4, 2, m), committed histories (e, 4, h, m), numbers p (9, m), a table (k, m), (k − 1, 4, m)."""

    x_n: Array
    x: Array
    committed: Array
    p: Array
    knots: Array
    coefficients: Array


def forces_along(at: At, d: Along) -> Array:
    """What directions change of the forces, (e, 4, 2, m)."""
    m = int(d.x_n.shape[-1])
    r = np.empty((*at.x_n.shape, m))
    _forces_along(at.variant, m)(len(r), *at.arrays(), *d, r)
    return r


def history_along(at: At, d: Along, volume: Array, dnew: Array) -> Array:
    """What directions change of histories → dnew (e, 4, h, m); of stored energy and plastic work: (2, m). volume (e, 4)."""
    e, m = len(dnew), dnew.shape[-1]
    energy = np.empty((e, 2, m))
    _history_along(at.variant, m)(e, *at.arrays(), *d, volume, dnew, energy)
    return np.asarray(energy.sum(axis=0))


def history_back(at: At, w: Array) -> Array:
    """Weights w (e, 4, h) of histories → those of the present places, (e, 4, 2)."""
    x = np.empty(at.x.shape)
    _back(at.variant, False)(len(x), *at.arrays(), w, x, x, x)
    return x


class Back(NamedTuple):
    """Weights of places (e, 4, 2), committed histories (e, 4, h), numbers p (9,) and the flow stresses at the end (e, 4)."""

    x_n: Array
    x: Array
    committed: Array
    p: Array
    stress: Array


def back(at: At, w: Array, r: Array) -> Back:
    """Weights w (e, 4, h) of histories and r (e, 8) of forces → of all that they depend on."""
    x_n, x = np.empty((2, *at.x.shape))
    committed, p, stress = np.empty(w.shape), np.empty((len(w), NUMBERS + SCALARS)), np.empty(w.shape[:2])
    _back(at.variant, True)(len(w), *at.arrays(), w, r, x_n, x, committed, p, stress)
    return Back(x_n, x, committed, np.asarray(p.sum(axis=0)), stress)
