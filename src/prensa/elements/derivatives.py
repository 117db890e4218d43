"""Derivatives of plane elements in finite strain, generated: along directions and backwards.

Point functions of elements (`prensa.elements.gradients`) and laws (`prensa.materials.point_form`) are recorded with the places
x_n and x of the nodes as an increment begins and ends, the committed history and the numbers of the law; which points flow is
that of the increment. Weights of forces and histories come back by the reverse mode of the same graphs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prensa.elements import shapes as tables
from prensa.elements.gradients import (
    Gradients,
    at_points,
    dilatation,
    fbar,
    forces,
    gradient,
    gradients,
    mean_change,
    volume_of,
    without_mean,
)  # fmt: skip
from prensa.kernels.differentiate import forward, reverse, units
from prensa.kernels.emit import Kind, Program, Put, Rows, Shared, puts, total
from prensa.kernels.machine_code import generated
from prensa.kernels.record import ONE, Node, answered, cell, constant, given, lift, many, piece, where
from prensa.materials.hardening import SHIFT_BEGUN, SHIFT_COMMITTED, SHIFT_NOW, TABLE_ARRAYS
from prensa.materials.hencky_j2 import first_piola
from prensa.materials.j2 import TABLES
from prensa.materials.point_form import Given, PointForm, PointLaw
from prensa.types import Array

BATCH = 10
"""Directions at a time, at most: their numbers of eight elements (4 kB each) are to stay in the first-level cache."""


class Variant(NamedTuple):
    """What differs between kernels: nodes and points, whether f is f̄, mode, the law, whether flow was ``shifted``.

    ``mean``: B-bar instead of F-bar.
    """

    nodes: int
    points: int
    bar: bool
    axisymmetric: bool
    law: PointForm
    shifted: bool
    mean: bool = False

    @property
    def dofs(self) -> int:
        """Degrees of freedom of an element."""
        return 2 * self.nodes

    @property
    def fields(self) -> int:
        """Columns of the history."""
        return self.law.size


class _Recorded(NamedTuple):
    """The point functions of an element: what it depends on, and forces, history, energies per initial volume.

    ``centre``: what points have in common, the dilatation of F-bar's and B-bar's; ``X``: initial places, with B-bar alone.
    """

    X: list[Node]
    x_n: list[Node]
    x: list[Node]
    centre: list[Node]
    committed: list[Node]
    p: list[Node]
    forces: list[Node]
    history: list[Node]
    energies: tuple[Node, Node]
    strains: tuple[Node, Node, Node]


def _record(v: Variant) -> _Recorded:
    """Record an element at a point; energies: what is stored and the plastic work."""
    n = v.nodes
    x_n, x, shapes, weight = many("x_n", v.dofs), many("x", v.dofs), many("shapes", 3 * n), given("shapes", 3 * n)
    committed, p = many("committed", v.fields), many("p", v.law.numbers)
    u = [b - a for a, b in zip(x_n, x)]
    if v.mean:
        return _record_mean(v, x_n, x)
    begun = _begun(x_n, u, shapes, v.axisymmetric)
    h = stretched = begun.h
    # Without F-bar nothing is shared: α is one, and forces are those of the point alone.
    ratio, middle = ONE, list[Node]()
    if v.bar:
        middle = [dilatation(_begun(x_n, u, [lift(s) for s in tables.centre(n, 2)], v.axisymmetric).h)]
        stretched, _, ratio = fbar(h, middle[0], v.axisymmetric)
    found = v.law.answer(stretched, _given(v, committed, p))
    # V τ ∇N in the present places, V = V_n/(α^m J_n): ∇N f⁻¹ of the places before
    volume = begun.volume * weight * given("scale", 0) / (ratio * found.volume)
    r = forces(begun.turned(first_piola(h, found.stress, volume)), begun.by)
    energies = found.energy, found.work
    return _Recorded([], x_n, x, middle, committed, p, r, list(found.history), energies, found.strains)


class _Begun(NamedTuple):
    """A point as the increment begins: gradients of N that stay ``by``, the volume, the gradient h of the increment.

    Derivatives by the places come through five numbers alone, the gradient L of how these move: (∇N)′ = −Lᵀ ∇N, V′ = V tr L,
    (∇u)′ = ∇u′ − ∇u L. Along m directions that is a third of the products of (∇N)′ node by node.
    """

    by: Gradients
    L: tuple[Node, ...]
    volume: Node
    h: tuple[Node, ...]

    def turned(self, P: Sequence[Node]) -> tuple[Node, ...]:
        """A stress P that meets the gradients which stay, with the derivative that P meets those that do not: −P Lᵀ."""
        L11, L12, L21, L22, L33 = self.L
        ways = ((L11, L12), (L21, L22), (L11, L12), (L21, L22))
        plane = [_less(P[c], ways[c], (P[c - c % 2], P[c - c % 2 + 1])) for c in range(4)]
        return (*plane, _less(P[4], (L33,), (P[4],)))


def _begun(x_n: list[Node], u: list[Node], shapes: list[Node], axisymmetric: bool) -> _Begun:
    g = gradients(x_n, shapes, axisymmetric)
    by = Gradients([tuple(map(constant, row)) for row in g.by], g.volume, g.good)
    L, h = gradient(x_n, by), gradient(u, by)
    L11, L12, L21, L22, L33 = L
    ways = ((L11, L21), (L12, L22), (L11, L21), (L12, L22))
    plane = [_less(h[c], ways[c], (h[c - c % 2], h[c - c % 2 + 1])) for c in range(4)]
    V = constant(g.volume)
    grows = [L11, L22, L33] if axisymmetric else [L11, L22]
    return _Begun(by, L, answered(V, grows, [V] * len(grows)), (*plane, _less(h[4], (L33,), (h[4],))))


def _less(x: Node, at: Sequence[Node], slopes: Sequence[Node]) -> Node:
    """X, with Σ slopes at′ less than its own derivative."""
    return answered(x, [x, *at], [ONE, *(-s for s in slopes)])


def _given(v: Variant, committed: list[Node], p: list[Node]) -> Given:
    share = given("share", 0) if v.shifted else None
    return Given(committed, many("old", v.fields), many("new", v.fields), p, share)


def _record_mean(v: Variant, x_n: list[Node], x: list[Node]) -> _Recorded:
    """B-bar: forces V (τ′ ∇N + p ∂ln v/∂x), p the mean of the Kirchhoff stress τ(f̄) over what is scaled, τ′ the rest of it."""
    X, shapes, weight = many("X", v.dofs), many("shapes", 3 * v.nodes), given("shapes", 3 * v.nodes)
    committed, p = many("committed", v.fields), many("p", v.law.numbers)
    rule = tables.table(v.nodes, tables.square(2)).rows
    u, g = [b - a for a, b in zip(x_n, x)], gradients(x_n, shapes, v.axisymmetric)
    before, initial = (at_points(places, rule, v.axisymmetric) for places in (x_n, X))
    h, mean = gradient(u, g), mean_change(u, before)
    found = v.law.answer(fbar(h, mean, v.axisymmetric)[0], _given(v, committed, p))
    own = gradients(X, shapes, v.axisymmetric).volume * weight * given("scale", 0)
    volume = own * volume_of(before) / (volume_of(initial) * found.volume)
    stress, pressure = without_mean(found.stress, v.axisymmetric)
    by_mean = volume * pressure / (1.0 + mean)
    growth = forward([mean], units(x), v.dofs, locals_=False)[0]
    r = [a + by_mean * b for a, b in zip(forces(first_piola(h, stress, volume), g), growth)]
    energies = found.energy, found.work
    return _Recorded(X, x_n, x, [mean], committed, p, r, list(found.history), energies, found.strains)


def _arrays(v: Variant) -> dict[str, Kind]:
    history = Rows(v.fields, points=True)
    return ({"X": Rows(v.dofs)} if v.mean else {}) | {
        "x_n": Rows(v.dofs), "x": Rows(v.dofs), "shapes": Shared(3 * v.nodes + 1), "committed": history, "old": history,
        "new": history, "p": Shared(), "share": Shared(), "scale": Shared(), **TABLES,
    }  # fmt: skip


def _seeds(e: _Recorded, v: Variant) -> dict[Node, list[Node]]:
    """A direction of all that an element depends on."""
    along = {
        **dict(zip(e.X, many("dX", v.dofs))), **dict(zip(e.x_n, many("dx_n", v.dofs))), **dict(zip(e.x, many("dx", v.dofs))),
        **dict(zip(e.committed, many("dcommitted", v.fields))), **dict(zip(e.p, many("dp", v.law.numbers))),
    }  # fmt: skip
    if (first := v.law.table_at) is not None:
        when = zip((SHIFT_COMMITTED, SHIFT_BEGUN, SHIFT_NOW), e.strains)
        along |= {e.p[first + shift]: _table_change(strain, e.p[first]) for shift, strain in when}
    return {n: [d] for n, d in along.items()}


def _table_change(a: Node, last: Node) -> Node:
    """What a direction changes of a table's stress at a strain, by its knots and coefficients; not by the last knot."""
    k = piece(a, TABLE_ARRAYS.knots)
    d = where(a < last, a, last) - cell(k, TABLE_ARRAYS.knots, 1, 0)
    c = [cell(k, TABLE_ARRAYS.coefficients, 4, i) for i in range(3)]
    by = [cell(k, "dcoefficients", 4, i) for i in range(4)]
    slope = (3.0 * c[0] * d + 2.0 * c[1]) * d + c[2]
    return ((by[0] * d + by[1]) * d + by[2]) * d + by[3] - slope * cell(k, "dknots", 1, 0)


def _along(v: Variant) -> dict[str, Kind]:
    places = Rows(v.dofs, directions=True)
    return {
        **_arrays(v), **({"dX": places} if v.mean else {}), "dx_n": places, "dx": places,
        "dcommitted": Rows(v.fields, points=True, directions=True),
        "dp": Shared(directions=True), "dknots": Shared(directions=True), "dcoefficients": Shared(directions=True),
    }  # fmt: skip


@generated
def _forces_along(v: Variant) -> Program:
    """Of directions m of all that an element depends on: what they change of its forces, (2a, m)."""
    e = _record(v)
    # Places and numbers of the law reach local values by more than what these name, so they are looked through here.
    d = forward(e.forces, _seeds(e, v), 1, locals_=False)
    sums = [x for (x,) in d]
    arrays = _along(v) | {"r": Rows(v.dofs, directions=True)}
    return Program(arrays, puts("r", map(total, range(len(sums)))), sums, v.points)


@generated
def _history_along(v: Variant) -> Program:
    """Of directions m: what they change of histories, (q, h, m), and of stored energy and plastic work, (2, m)."""
    e = _record(v)
    d = forward([*e.history, *e.energies], _seeds(e, v), 1, locals_=False)
    volume, found = given("volume", 0), [x for (x,) in d]
    sums = [volume * x for x in found[v.fields :]]
    written = [*puts("dnew", found[: v.fields]), *puts("energy", map(total, range(len(sums))))]
    arrays = _along(v) | {
        "volume": Rows(1, points=True), "dnew": Rows(v.fields, points=True, directions=True), "energy": Rows(2, directions=True),
    }  # fmt: skip
    return Program(arrays, written, sums, v.points)


@generated
def _back(v: Variant, by_forces: bool) -> Program:
    """Weights of histories, and ``by_forces`` of forces, → those of all that an element depends on; without: of x alone."""
    e = _record(v)
    outputs, weights = list(e.history), many("w", v.fields)
    if by_forces:
        outputs, weights = outputs + e.forces, weights + many("r", v.dofs)
    places = [*e.X, *e.x_n, *e.x] if by_forces else e.x
    wanted = [*places, *e.centre, *(e.committed + e.p if by_forces else [])]
    bar = reverse(outputs, weights, wanted)
    k = len(places) + len(e.centre)
    sums, written = bar[:k], list[Put]()
    arrays = _arrays(v) | {"w": Rows(v.fields, points=True), "r": Rows(v.dofs), "to_X": Rows(v.dofs)}
    arrays |= {"to_x_n": Rows(v.dofs), "to_x": Rows(v.dofs)}
    # The dilatation at the centre is one for all points: weights on it are summed over them, and go back to the places once.
    middle = reverse(e.centre, [total(len(places) + i) for i in range(len(e.centre))], places)
    back = [total(i) + b for i, b in enumerate(middle)]
    if by_forces:
        written += puts("to_X", back[: len(e.X)]) + puts("to_x_n", back[len(e.X) : len(e.X) + v.dofs])
        sums += bar[k + v.fields :]
        written += puts("to_committed", bar[k : k + v.fields])
        written += puts("to_p", map(total, range(k, len(sums))))
        if (first := v.law.table_at) is not None:
            written += puts("to_stress", [bar[k + v.fields + first + SHIFT_NOW]])
        arrays |= {
            "to_committed": Rows(v.fields, points=True), "to_p": Rows(v.law.numbers), "to_stress": Rows(1, points=True),
        }  # fmt: skip
    written += puts("to_x", back[-v.dofs :])
    return Program(arrays, written, sums, v.points)


class At(NamedTuple):
    """Elements of an increment: places X, x_n, x (e, a, 2), histories (e, q, h) committed, old as it begins, new; their law.

    ``shapes`` (q, 3a + 1): `Table.rows`; ``share`` of the last plastic strain, see `prensa.materials.hencky_j2.begin`.
    """

    variant: Variant
    shapes: Array
    X: Array
    x_n: Array
    x: Array
    committed: Array
    old: Array
    new: Array
    law: PointLaw
    share: float
    scale: float

    def arrays(self) -> tuple[Array, ...]:
        """As kernels take them."""
        return (
            *((self.X,) if self.variant.mean else ()), self.x_n, self.x, self.shapes, self.committed, self.old, self.new,
            self.law.p, np.array([self.share]),
            np.array([self.scale]), self.law.knots, self.law.coefficients,
        )  # fmt: skip


class Along(NamedTuple):
    """Directions of places (e, a, 2, m), committed histories (e, q, h, m), numbers p (k, m), a table (k, m), (k − 1, 4, m)."""

    X: Array
    x_n: Array
    x: Array
    committed: Array
    p: Array
    knots: Array
    coefficients: Array

    def arrays(self, v: Variant) -> tuple[Array, ...]:
        """As kernels take them."""
        return self if v.mean else self[1:]


def forces_along(at: At, d: Along) -> Array:
    """What directions change of the forces, (e, a, 2, m)."""
    m = int(d.x_n.shape[-1])
    r = np.empty((*at.x_n.shape, m))
    _forces_along(at.variant)(len(r), *at.arrays(), *d.arrays(at.variant), r)
    return r


def history_along(at: At, d: Along, volume: Array, dnew: Array) -> Array:
    """What directions change of histories → dnew (e, q, h, m); of stored energy and plastic work: (2, m). volume (e, q)."""
    e, m = len(dnew), dnew.shape[-1]
    energy = np.empty((e, 2, m))
    _history_along(at.variant)(e, *at.arrays(), *d.arrays(at.variant), volume, dnew, energy)
    return np.asarray(energy.sum(axis=0))


def history_back(at: At, w: Array) -> Array:
    """Weights w (e, q, h) of histories → those of the present places, (e, a, 2)."""
    x = np.empty(at.x.shape)
    _back(at.variant, False)(len(x), *at.arrays(), w, x, x, x, x)
    return x


class Back(NamedTuple):
    """Weights of places (e, a, 2), committed histories (e, q, h), numbers p (k,) and a table's stresses at the end (e, q)."""

    X: Array
    x_n: Array
    x: Array
    committed: Array
    p: Array
    stress: Array


def back(at: At, w: Array, r: Array) -> Back:
    """Weights w (e, q, h) of histories and r (e, 2a) of forces → of all that they depend on."""
    X, x_n, x = np.zeros((3, *at.x.shape))
    committed, p, stress = np.empty(w.shape), np.empty((len(w), len(at.law.p))), np.zeros(w.shape[:2])
    _back(at.variant, True)(len(w), *at.arrays(), w, r, X, x_n, x, committed, p, stress)
    return Back(X, x_n, x, committed, np.asarray(p.sum(axis=0)), stress)
