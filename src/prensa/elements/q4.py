"""4-node quadrilateral, 2 × 2 Gauss points, with F-bar, in plane strain and axisymmetry, small and finite strain.

Two kernels bracket the material: `kinematics` turns nodal increments into h = f̄ − I at the points, `integrate` turns stresses P
and tangents A = ∂P/∂f̄ into nodal forces and stiffnesses. Both are generated from `prensa.elements.plane`. Everything refers to
the last committed configuration x_n (updated Lagrangian); in small strain that is X. F-bar integrates the true virtual work;
B-bar is variational, its forces are derivatives of h.

F-bar sees no volume but that of the centroid, so nothing keeps that of a point from vanishing: `unfold` does.
"""

from __future__ import annotations

import math

import numpy as np

from prensa.elements.plane import (
    CENTRE,
    LEAST_AREA_SHARE,
    POINTS,
    SHAPE_VALUES,
    bbar,
    dilatation,
    fbar,
    forces,
    gradient,
    gradients,
    mean_dilatation,
    narrow,
)
from prensa.kernels.compiled import njit
from prensa.kernels.differentiate import forward, reverse, units
from prensa.kernels.emit import Kind, Marks, Program, Rows, Shared, generated, puts, total
from prensa.kernels.record import Node, absolute, answered, as_found, given, lift, local, many, where
from prensa.types import Array, Flags

DOFS, COMPONENTS = 8, 5
SHAPES_OF_POINTS = np.ascontiguousarray(SHAPE_VALUES[:POINTS])
_N, _DX, _DY = (np.ascontiguousarray(SHAPE_VALUES[:, 4 * k : 4 * k + 4]) for k in range(3))


@generated
def _kinematics(axisymmetric: bool, finite: bool) -> Program:
    x, u, shapes = many("x", DOFS), many("u", DOFS), many("shapes", 12)
    g = gradients(x, shapes, axisymmetric)
    h = gradient(u, g)
    good = g.volume * given("scale", 0) > 0.0
    if finite:
        middle = dilatation(gradient(u, gradients(x, [lift(s) for s in CENTRE], axisymmetric)))
        good = good & (dilatation(h) > -1.0) & (h[4] > -1.0) & (middle > -1.0)
        stretched, alpha, ratio = fbar(h, middle, axisymmetric)
        weight, folds = _weight(g.volume, alpha, ratio), narrow([a + b for a, b in zip(x, u)])
    else:
        stretched = bbar(h, mean_dilatation(u, x, axisymmetric), axisymmetric)
        weight, folds = g.volume * given("scale", 0), given("scale", 0) > math.inf
    written = [
        *puts("h", stretched), *puts("weight", [weight]), *puts("failed", [total(0) > 0.0]), *puts("folds", [folds]),
    ]  # fmt: skip
    arrays: dict[str, Kind] = {
        "x": Rows(DOFS), "u": Rows(DOFS), "shapes": Shared(12), "scale": Shared(), "h": Rows(COMPONENTS, points=True),
        "weight": Rows(1, points=True), "failed": Marks(), "folds": Marks(),
    }  # fmt: skip
    return Program(arrays, written, [where(good, 0.0, 1.0)], POINTS)


def _weight(volume: Node, alpha: Node, ratio: Node) -> Node:
    """Of P ∇N in forces: the volume times α^(1 − m), so that the sum is that of σ(f̄) ∇N dv."""
    return volume * given("scale", 0) * alpha / ratio


def kinematics(
    x: Array, d: Array, axisymmetric: bool, finite: bool, scale: float, h: Array, weight: Array, failed: Flags
) -> Flags:  # fmt: skip
    """X (e, 4, 2) committed positions, d (e, 4, 2) increments → h (e, 4, 5) of f̄, weight (e, 4) of P ∇N in forces, failed (e,).

    Returned: which elements (e,) `unfold` has to look at.

    ``scale`` multiplies the volumes (thickness, or 2π in axisymmetry). failed marks elements with det f ≤ 0 (or an inverted
    committed shape) at a point.
    """
    folds = np.empty(len(x), dtype=np.bool_)
    _kinematics(axisymmetric, finite)(len(x), x, d, SHAPES_OF_POINTS, np.array([scale]), h, weight, failed, folds)
    return folds


@generated
def _integrate(axisymmetric: bool, finite: bool, stiffness: bool) -> Program:
    x, u, shapes, P, A = many("x", DOFS), many("u", DOFS), many("shapes", 12), many("P", COMPONENTS), many("A", COMPONENTS**2)
    g = gradients(x, shapes, axisymmetric)
    h = gradient(u, g)

    def stress(at: tuple[Node, ...]) -> list[Node]:
        """The law's answer at a gradient."""
        rows = [A[COMPONENTS * k : COMPONENTS * (k + 1)] for k in range(COMPONENTS)] if stiffness else [[]] * COMPONENTS
        return [answered(p, at, row) if stiffness else p for p, row in zip(P, rows)]

    if finite:
        middle = dilatation(gradient(u, gradients(x, [lift(s) for s in CENTRE], axisymmetric)))
        stretched, alpha, ratio = fbar(h, middle, axisymmetric)
        weight = as_found(given("weight", 0), _weight(g.volume, alpha, ratio))
        weighted = local([p * weight for p in stress(stretched)], (*h, middle))
        r = forces(weighted, g)
    else:
        mean = mean_dilatation(u, x, axisymmetric)
        strains = bbar(h, mean, axisymmetric)
        r = reverse(strains, [p * given("weight", 0) for p in stress(strains)], u)
    size = absolute(r[0])
    for f in r[1:]:
        size = size + absolute(f)
    sums = [*r, size]
    if stiffness:
        sums += [k for row in forward(r, units(u), DOFS) for k in row]
    written = [*puts("r", map(total, range(DOFS))), *puts("forces", [total(DOFS)])]
    if stiffness:
        written += puts("K", map(total, range(DOFS + 1, len(sums))))
    arrays: dict[str, Kind] = {
        "x": Rows(DOFS), "u": Rows(DOFS), "shapes": Shared(12), "scale": Shared(), "weight": Rows(1, points=True),
        "P": Rows(COMPONENTS, points=True),
        "A": Rows(COMPONENTS**2, points=True), "forces": Rows(1), "r": Rows(DOFS), "K": Rows(DOFS**2),
    }  # fmt: skip
    return Program(arrays, written, sums, POINTS)


def integrate(
    x: Array, d: Array, axisymmetric: bool, finite: bool, scale: float, weight: Array, P: Array, A: Array, forces: Array,
    stiffness: bool, r_out: Array, K_out: Array,
) -> None:  # fmt: skip
    """Weights (e, 4) of `kinematics`, P (e, 4, 5), A (e, 4, 5, 5) → r_out (e, 8) forces, K_out (e, 8, 8) their derivative.

    Without ``stiffness`` A is not read and K_out stays as it is.
    forces (e,) receives Σ |r| before the points cancel each other: the scale against which a residual is small.
    """
    _integrate(axisymmetric, finite, stiffness)(
        len(x), x, d, SHAPES_OF_POINTS, np.array([scale]), weight, P, A, forces, r_out, K_out
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def _shape_gradients(v, e, q, out):
    """∂N_a/∂v_i of element e at point q in node positions v (e, 4, 2) → out[q] (8,), by x and y of node after node; Jacobian."""
    j11 = j12 = j21 = j22 = 0.0
    for a in range(4):
        dx, dy = _DX[q, a], _DY[q, a]
        j11 += dx * v[e, a, 0]
        j12 += dx * v[e, a, 1]
        j21 += dy * v[e, a, 0]
        j22 += dy * v[e, a, 1]
    det = j11 * j22 - j12 * j21
    for a in range(4):
        dx, dy = _DX[q, a], _DY[q, a]
        out[q, 2 * a] = (j22 * dx - j12 * dy) / det
        out[q, 2 * a + 1] = (j11 * dy - j21 * dx) / det
    return det


@generated
def _narrow() -> Program:
    x, d = many("x", DOFS), many("d", DOFS)
    arrays: dict[str, Kind] = {"x": Rows(DOFS), "d": Rows(DOFS), "folds": Marks()}
    return Program(arrays, puts("folds", [narrow([a + b for a, b in zip(x, d)])]))


def folding(x: Array, d: Array) -> Flags:
    """Of which elements (e,) some point may have so little area that `unfold` has to look; x, d (e, 4, 2) as there."""
    folds = np.empty(len(x), dtype=np.bool_)
    _narrow()(len(x), x, d, folds)
    return folds


def unfold(
    X: Array, x: Array, d: Array, axisymmetric: bool, modulus: float, forces: Array, stiffness: bool, r_out: Array, K_out: Array
) -> None:  # fmt: skip
    """Add forces and stiffness of the energy V E*/2 ln²(ρ/3) of the points whose ρ, centre over point, exceeds 3.

    ρ is the ratio of the areas of centre and point over that of the initial shape X (e, 4, 2), V the point's initial volume
    over the thickness (or over 2π) and ``modulus`` E* times that; x + d are the present positions. With F-bar the energy
    of a point does not depend on its own volume, so that it stays finite while that goes to zero and the element through
    itself (of neo-Hooke in plane strain this is exact: see `prensa.system.matrix_symmetry`). A corner of 180° has ρ = 2.37.
    """
    _unfold(folding(x, d), X, x, d, axisymmetric, modulus, forces, stiffness, r_out, K_out)


@njit(cache=True, error_model="numpy")
def _unfold(folds, X, x, d, axisymmetric, modulus, forces, stiffness, r_out, K_out):
    """See `unfold`; folds (e,): which elements have such points."""
    v = np.empty((1, 4, 2))
    B, B0 = np.empty((2, 5, 8))
    slope = np.empty(8)
    only, middle = np.int64(0), np.int64(POINTS)
    for e in range(X.shape[0]):
        if not folds[e]:
            continue
        for a in range(4):
            for i in range(2):
                v[0, a, i] = x[e, a, i] + d[e, a, i]
        j0, J0 = _shape_gradients(v, only, middle, B), _shape_gradients(X, e, middle, B0)
        for q in range(4):
            j, J = _shape_gradients(v, only, q, B), _shape_gradients(X, e, q, B0)
            excess = math.log(j0 / j * J / J0 * LEAST_AREA_SHARE)
            if not excess > 0.0:
                continue
            W = modulus * J
            if axisymmetric:
                radius = 0.0
                for a in range(4):
                    radius += _N[q, a] * X[e, a, 0]
                W *= radius
            for i in range(8):
                slope[i] = B[POINTS, i] - B[q, i]
                r_out[e, i] += W * excess * slope[i]
                forces[e] += abs(W * excess * slope[i])
            if not stiffness:
                continue
            for a in range(4):
                for i in range(2):
                    for b in range(4):
                        for k in range(2):
                            turn = B[q, 2 * a + k] * B[q, 2 * b + i] - B[POINTS, 2 * a + k] * B[POINTS, 2 * b + i]
                            K_out[e, 2 * a + i, 2 * b + k] += W * (slope[2 * a + i] * slope[2 * b + k] + excess * turn)
