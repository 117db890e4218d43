"""Kernels of isoparametric elements, generated: T3, T6, Q4, Q8 in the plane and in axisymmetry, H8, T10 in space; F-bar, B-bar.

Two kernels bracket the material: `kinematics` turns nodal increments into h = f − I at the points, `integrate` turns stresses P
and tangents A = ∂P/∂f into nodal forces and stiffnesses. Both are recorded from the point functions of
`prensa.elements.gradients`; the shape functions at the points are an argument, so that an element is its table. Everything refers
to the last committed configuration x_n (updated Lagrangian); in small strain that is X. F-bar integrates the true virtual work,
∫ σ(f̄) ∇N dv; B-bar is variational, its forces are derivatives of h̄: in finite strain ∫ τ(f̄) : (∂f̄/∂u) f̄⁻¹ dV, the derivative of
what is stored and dissipated at the points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.elements import shapes
from prensa.elements.form import Form
from prensa.elements.gradients import (
    Gradients,
    at_points,
    bbar,
    dilatation,
    fbar,
    forces,
    gradient,
    gradients,
    mean_change,
    mean_dilatation,
    volume_of,
)
from prensa.kernels.differentiate import forward, reverse, units
from prensa.kernels.emit import Kind, Marks, Program, Rows, Shared, puts, total
from prensa.kernels.machine_code import generated
from prensa.kernels.record import Node, absolute, answered, as_found, given, lift, local, many, where
from prensa.types import Array, Flags


class _Point(NamedTuple):
    """Gradients at a point: of the motion h, what the law is given, and the weight of P ∇N in forces."""

    g: Gradients
    h: tuple[Node, ...]
    given: tuple[Node, ...]
    weight: Node
    shared: list[Node]
    good: Node


def _record(f: Form, x: list[Node], u: list[Node]) -> _Point:
    """A point of an element in places x that moves by u; shared: what h̄ depends on besides h."""
    shapes_ = many("shapes", f.row)
    g = gradients(x, shapes_, f.axisymmetric, f.dimension)
    h = gradient(u, g)
    weight, good = g.volume * shapes_[-1] * given("scale", 0), g.good
    if f.finite:
        good = good & (dilatation(h) > -1.0)
        good = good & (h[4] > -1.0) if f.axisymmetric else good
    if not f.bar:
        return _Point(g, h, h, weight, [], good)
    rule = shapes.table(f.nodes, shapes.square(2) if f.dimension == 2 else shapes.cube(2)).rows
    if f.finite and f.mean:
        before, initial = (at_points(places, rule, f.axisymmetric, f.dimension) for places in (x, many("X", f.dofs)))
        mean = mean_change(u, before)
        stretched, _, _ = fbar(h, mean, f.axisymmetric)
        # The law's P is per volume as the increment begins, which by h̄ has changed by v_n/V in every point of initial volume dV.
        own = gradients(many("X", f.dofs), shapes_, f.axisymmetric, f.dimension).volume * shapes_[-1]
        weight = own * given("scale", 0) * volume_of(before) / volume_of(initial)
        return _Point(g, h, stretched, weight, [mean], good & (mean > -1.0))
    if f.finite:
        middle = [lift(s) for s in shapes.centre(f.nodes, f.dimension)]
        centre = dilatation(gradient(u, gradients(x, middle, f.axisymmetric, f.dimension)))
        stretched, more, ratio = fbar(h, centre, f.axisymmetric)
        # with α^(1 − m) the sum is that of σ(f̄) ∇N dv
        return _Point(g, h, stretched, weight * (1.0 + more) / ratio, [more], good & (centre > -1.0))
    mean = mean_dilatation(u, at_points(x, rule, f.axisymmetric, f.dimension))
    return _Point(g, h, bbar(h, mean, f.axisymmetric), weight, [mean], good)


def _arrays(f: Form) -> dict[str, Kind]:
    return {
        "x": Rows(f.dofs), "u": Rows(f.dofs), "shapes": Shared(f.row), "scale": Shared(), "weight": Rows(1, points=True),
    }  # fmt: skip


@generated
def _kinematics(f: Form) -> Program:
    p = _record(f, many("x", f.dofs), many("u", f.dofs))
    written = [*puts("h", p.given), *puts("weight", [p.weight]), *puts("failed", [total(0) > 0.0])]
    arrays = _arrays(f) | {"h": Rows(f.components, points=True), "failed": Marks()}
    if f.finite and f.mean:
        arrays |= {"X": Rows(f.dofs)}
    return Program(arrays, written, [where(p.good, 0.0, 1.0)], f.points)


def kinematics(
    f: Form, X: Array, x: Array, d: Array, rows: Array, scale: float, h: Array, weight: Array, failed: Flags
) -> None:
    """X, x (e, a, dim) initial and committed positions, d increments → h (e, q, c) of f or f̄, weight (e, q), failed (e,).

    rows (q, (1 + dim) a + 1): `Table.rows`; ``scale``: thickness, 2π in axisymmetry, 1 in space. weight is that of P ∇N in
    forces, with F-bar the volume times α^(1 − m), with B-bar of finite strain the initial one times v_n/V of the element. failed:
    which elements have det f ≤ 0, or an inverted committed shape, at a point.
    """
    initial = (X,) if f.finite and f.mean else ()
    _kinematics(f)(len(x), x, d, rows, np.array([scale]), weight, h, failed, *initial)


@generated
def _integrate(f: Form, stiffness: bool) -> Program:
    c = f.components
    x, u, P, A = many("x", f.dofs), many("u", f.dofs), many("P", c), many("A", c * c)
    p = _record(f, x, u)
    # the law's answer at a gradient
    stress = [answered(P[k], p.given, A[c * k : c * (k + 1)]) for k in range(c)] if stiffness else P
    weight = given("weight", 0) if f.mean or not f.finite else as_found(given("weight", 0), p.weight)
    weighted = local([s * weight for s in stress], (*p.h, *p.shared))
    if f.variational:
        *by_h, by_mean = reverse(p.given, weighted, (*p.h, *p.shared))
        r = [a + by_mean * b for a, b in zip(forces(by_h, p.g), forward(p.shared, units(u), f.dofs)[0])]
    else:
        r = forces(weighted, p.g)
    size = absolute(r[0])
    for one in r[1:]:
        size = size + absolute(one)
    sums = [*r, size]
    if stiffness:
        sums += [k for row in forward(r, units(u), f.dofs) for k in row]
    written = [*puts("r", map(total, range(f.dofs))), *puts("forces", [total(f.dofs)])]
    if stiffness:
        written += puts("K", map(total, range(f.dofs + 1, len(sums))))
    arrays = _arrays(f) | {
        "P": Rows(c, points=True), "A": Rows(c * c, points=True), "forces": Rows(1), "r": Rows(f.dofs), "K": Rows(f.dofs**2),
    }  # fmt: skip
    return Program(arrays, written, sums, f.points)


def integrate(
    f: Form, x: Array, d: Array, rows: Array, scale: float, weight: Array, P: Array, A: Array, forces: Array, stiffness: bool,
    r_out: Array, K_out: Array,
) -> None:  # fmt: skip
    """Weights (e, q) of `kinematics`, P (e, q, c), A (e, q, c, c) → r_out (e, n) forces, K_out (e, n, n) their derivative.

    Without ``stiffness`` A is not read and K_out stays as it is.
    forces (e,) receives Σ |r| before the points cancel each other: the scale against which a residual is small.
    """
    _integrate(f, stiffness)(len(x), x, d, rows, np.array([scale]), weight, P, A, forces, r_out, K_out)
