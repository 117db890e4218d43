"""Protection of 4-node quadrilaterals with F-bar against inversion.

F-bar sees no volume but that of the centroid (`prensa.elements.gradients`), so nothing keeps that of a point from vanishing:
`unfold` does, where `folding` finds a point of little area.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from prensa.elements import shapes
from prensa.kernels.compiled import njit
from prensa.kernels.emit import Kind, Marks, Program, Rows, puts
from prensa.kernels.machine_code import generated
from prensa.kernels.record import Node, absolute, many
from prensa.types import Array, Flags

POINTS, DOFS = 4, 8
# shape functions and their slopes at the points and, last row, at the centre
_VALUES = np.vstack([shapes.table(4, shapes.square(2)).rows[:, :-1], shapes.centre(4, 2)])
_N, _DX, _DY = (np.ascontiguousarray(_VALUES[:, 4 * k : 4 * k + 4]) for k in range(3))

LEAST_AREA_SHARE = 1.0 / 3.0
"""Area of a point over that of the centre, both over their initial ones, that F-bar keeps by itself."""


def narrow(x: Sequence[Node]) -> Node:
    """Whether a point of an element in places x (8) may have so little area that it needs forces of its own.

    The area of a point is linear in ξ and η. Points of convex shapes have 0.42 to 1.58 of that of their centre, initial ones too.
    """
    x1, y1, x2, y2, x3, y3 = (x[2 * a + i] - x[i] for a in (1, 2, 3) for i in (0, 1))
    # along ξ and η at the centre, and what changes along both, each four times
    ax, ay, bx, by, cx, cy = x1 + x2 - x3, y1 + y2 - y3, x3 + x2 - x1, y3 + y2 - y1, x2 - x3 - x1, y2 - y3 - y1
    centre = ax * by - ay * bx
    least = centre - (absolute(ax * cy - ay * cx) + absolute(cx * by - cy * bx)) / math.sqrt(3.0)
    # The initial shape is not looked at here: 1.6 covers the 1.58 that a point of a convex one may have, so none is missed.
    return ~(least > 1.6 * LEAST_AREA_SHARE * centre)


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
                            # ∂B_ai/∂v_bk = −B_ak B_bi, of the centre less of the point.
                            turn = B[q, 2 * a + k] * B[q, 2 * b + i] - B[POINTS, 2 * a + k] * B[POINTS, 2 * b + i]
                            K_out[e, 2 * a + i, 2 * b + k] += W * (slope[2 * a + i] * slope[2 * b + k] + excess * turn)
