"""The shear yield stress of a metal by its committed history, which limits friction, and its derivatives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.kernels.differentiate import forward, units
from prensa.kernels.emit import Kind, Program, Rows, Shared, puts
from prensa.kernels.machine_code import generated
from prensa.kernels.record import Node, many, sqrt
from prensa.kernels.template import Template
from prensa.materials.flow_curve import FlowParameters
from prensa.materials.hardening import SHIFT_COMMITTED, TABLE_ARRAYS, Curve, scalars, table_at
from prensa.materials.hencky_j2 import Tensor, determinant
from prensa.types import Array, Index


def shear_strength(b: Tensor, strain: Node, curve: Curve, cauchy: bool) -> Node:
    """σ_y/√3, a Cauchy stress, of a point of elastic strains b and the plastic ``strain`` at rest; plastic flow is isochoric."""
    stress = curve.at_rest(strain, SHIFT_COMMITTED) / np.sqrt(3.0)
    return stress if cauchy else stress / sqrt(determinant(b))


@generated
def _strength(kind: Template, cauchy: bool) -> Program:
    old, p = many("old", 5), many("p", scalars(kind))
    k = shear_strength(old[:4], old[4], Curve(kind, p, TABLE_ARRAYS), cauchy)
    of = [*old, *p]
    J = forward([k], units(of), len(of))[0]
    arrays: dict[str, Kind] = {
        "old": Rows(5), "p": Shared(), "knots": Shared(), "coefficients": Shared(), "out": Rows(1 + len(of)),
    }  # fmt: skip
    return Program(arrays, puts("out", [k, *J]))


class Strength(NamedTuple):
    """Shear yield stresses ``k`` (n,), their derivatives by histories (n, 5) and scalars of the curve (n, c).

    ``piece`` (n,) of a table, ``powers`` (n, 4): derivatives by its coefficients; ``by_knot`` (n,): by the knot where it begins.
    """

    k: Array
    by_history: Array
    by_scalars: Array
    piece: Index
    powers: Array
    by_knot: Array


def strength(history: Array, cauchy: bool, flow: FlowParameters) -> Strength:
    """Of histories (n, ≥5), the left Cauchy-Green tensor less one and the plastic strain first."""
    n, at = len(history), table_at(flow.kind)
    out = np.empty((n, 6 + scalars(flow.kind)))
    _strength(flow.kind, cauchy)(n, history, flow.p, flow.knots, flow.coefficients, out)
    piece, powers, by_knot = np.zeros(n, dtype=np.int64), np.zeros((n, 4)), np.zeros(n)
    if at is not None:
        by_stress, strain, last = out[:, 6 + at + SHIFT_COMMITTED], history[:, 4], len(flow.knots) - 1
        # Tables are differentiated here: their coefficients are arrays that all points share, not numbers of the graph.
        piece = np.clip(np.searchsorted(flow.knots, strain, side="right") - 1, 0, last - 1)
        d = np.minimum(strain, flow.knots[last]) - flow.knots[piece]
        powers = by_stress[:, None] * np.stack([d**3, d**2, d, np.ones(n)], axis=1)
        c = flow.coefficients[piece]
        by_knot = -by_stress * ((3.0 * c[:, 0] * d + 2.0 * c[:, 1]) * d + c[:, 2])
    return Strength(out[:, 0], out[:, 1:6], out[:, 6:], piece, powers, by_knot)
