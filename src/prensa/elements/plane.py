"""Plane elements, one point in textbook order: gradients, forces, F-bar of finite and B-bar of small strain.

F-bar (de Souza Neto, Perić, Dutko and Owen 1996): with the gradient of the increment f and det f at the centroid J₀, f̄ = α f,
α = (J₀/J)^(1/m); m = 3 in axisymmetry (hoop component included), m = 2 in plane strain (in-plane block). Nodal numbers go by x
and y of node after node, gradients 11, 12, 21, 22, 33; shapes are shape functions of the nodes, their derivatives by ξ and η.

All numbers may be recorded ones or arrays; nothing here knows of tangents, directions and rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from prensa.kernels.functions import expm1, half_log1p
from prensa.kernels.record import Node, absolute, lift, sqrt

_CORNER_PLACES = np.array([[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0]])  # ξ, η
_AT = np.append(_CORNER_PLACES / math.sqrt(3.0), [[0.0], [0.0]], axis=1)
SHAPE_VALUES = np.concatenate(
    [
        0.25 * (1.0 + _CORNER_PLACES[0] * _AT[0][:, None]) * (1.0 + _CORNER_PLACES[1] * _AT[1][:, None]),
        0.25 * _CORNER_PLACES[0] * (1.0 + _CORNER_PLACES[1] * _AT[1][:, None]),
        0.25 * _CORNER_PLACES[1] * (1.0 + _CORNER_PLACES[0] * _AT[0][:, None]),
    ],
    axis=1,
)
"""Of the quadrilateral at its 2 × 2 points and, last row, at the centre: (5, 12)."""
POINTS = 4
CENTRE = SHAPE_VALUES[POINTS]


class Gradients(NamedTuple):
    """At a point: derivatives of the shape functions by x and y, N/r of axisymmetry, of node after node; volume per weight."""

    by: list[tuple[Node, Node, Node]]
    volume: Node


def gradients(X: Sequence[Node], shapes: Sequence[Node], axisymmetric: bool) -> Gradients:
    """In the places X (2a) of a nodes."""
    n = len(X) // 2
    N, by_xi, by_eta = shapes[:n], shapes[n : 2 * n], shapes[2 * n :]
    x1, x2, y1, y2 = (_sum(X[2 * a + i] * d[a] for a in range(n)) for i in (0, 1) for d in (by_xi, by_eta))
    det = x1 * y2 - x2 * y1
    by = 1.0 / det
    r = _sum(X[2 * a] * N[a] for a in range(n)) if axisymmetric else 1.0
    over = 1.0 / r if axisymmetric else 0.0
    return Gradients(
        [((y2 * by_xi[a] - y1 * by_eta[a]) * by, (x1 * by_eta[a] - x2 * by_xi[a]) * by, N[a] * over) for a in range(n)],
        det * r,
    )  # fmt: skip


def _sum(terms: Iterable[Node]) -> Node:
    first, *others = terms
    for t in others:
        first = first + t
    return first


def gradient(u: Sequence[Node], g: Gradients) -> tuple[Node, ...]:
    """∇u of nodal motions u (2a)."""
    n = len(g.by)
    plane = [_sum(u[2 * a + i] * g.by[a][k] for a in range(n)) for i in (0, 1) for k in (0, 1)]
    return (*plane, _sum(u[2 * a] * g.by[a][2] for a in range(n)))


def dilatation(h: Sequence[Node]) -> Node:
    """Det(I + h) − 1."""
    plane = h[0] + h[3] + h[0] * h[3] - h[1] * h[2]
    return plane + h[4] + plane * h[4]


def fbar(h: Sequence[Node], centre: Node, axisymmetric: bool) -> tuple[tuple[Node, ...], Node, Node]:
    """F̄ − I of f = I + h, α, and α^m = J₀/J; centre: J₀ − 1."""
    here = dilatation(h)
    delta = (centre - here) / (1.0 + here)
    # α − 1, with all the digits of a small δ
    more = expm1((2.0 / 3.0) * half_log1p(delta)) if axisymmetric else delta / (1.0 + sqrt(1.0 + delta))
    stretched = (h[0] + more * (1.0 + h[0]), h[1] * (1.0 + more), h[2] * (1.0 + more), h[3] + more * (1.0 + h[3]))
    return (*stretched, h[4] + more * (1.0 + h[4]) if axisymmetric else h[4]), 1.0 + more, 1.0 + delta


def mean_dilatation(u: Sequence[Node], X: Sequence[Node], axisymmetric: bool) -> Node:
    """Average of tr ∇u over the volume, that of B-bar: that of the centroid would fail the patch test in axisymmetry."""
    all_ = [gradients(X, [lift(s) for s in row], axisymmetric) for row in SHAPE_VALUES[:POINTS]]
    by_volume = [(g.volume, gradient(u, g)) for g in all_]
    return _sum(v * (h[0] + h[3] + h[4]) for v, h in by_volume) / _sum(g.volume for g in all_)


def bbar(h: Sequence[Node], mean: Node, axisymmetric: bool) -> tuple[Node, ...]:
    """Gradients of small strain with a mean dilatation (Hughes 1980)."""
    more = (mean - h[0] - h[3] - h[4]) * (1.0 / 3.0 if axisymmetric else 0.5)
    return h[0] + more, h[1], h[2], h[3] + more, h[4] + more if axisymmetric else h[4]


def forces(P: Sequence[Node], g: Gradients) -> list[Node]:
    """Nodal forces P ∇N (2a) of a first Piola-Kirchhoff stress 11, 12, 21, 22, 33 times its volume."""
    return [f for x, y, r in g.by for f in (P[0] * x + P[1] * y + P[4] * r, P[2] * x + P[3] * y)]


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
    return ~(least > 1.6 * LEAST_AREA_SHARE * centre)
