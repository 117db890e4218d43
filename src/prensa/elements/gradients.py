"""Elements at one point in textbook order: gradients, forces, F-bar of finite strain and B-bar; in plane and space.

F-bar (de Souza Neto, Perić, Dutko and Owen 1996): with the gradient of the increment f and det f at the centroid J₀, f̄ = α f,
α = (J₀/J)^(1/m); m = 3 in space and in axisymmetry (hoop component included), m = 2 in plane strain (in-plane block). In B-bar
J₀ is the mean over the volume of the element (Nagtegaal, Parks and Rice 1974; Simo, Taylor and Pister 1985). Nodal
numbers go by x, y(, z) of node after node; gradients 11, 12, 21, 22, 33 in the plane, row by row in space; shapes are shape
functions of the nodes, then their derivatives by ξ, by η(, by ζ).

All numbers may be recorded ones or arrays; nothing here knows of tangents, directions and rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from prensa.kernels.algebra import Tensor, cofactors, det_less_one, total, trace
from prensa.kernels.functions import expm1, half_log1p
from prensa.kernels.record import Node, local, sqrt
from prensa.types import Array

Pairs = tuple[tuple[int, int], ...]
PLANE_PAIRS: Pairs = ((0, 0), (0, 1), (1, 0), (1, 1), (0, 2))
"""Components of gradients: of which displacement they are, by which number of a node; the hoop stretch is x's by N/r."""
SPACE_PAIRS: Pairs = tuple((i, k) for i in range(3) for k in range(3))


class Gradients(NamedTuple):
    """At a point: derivatives of the shape functions by x, y, z (in the plane N/r of axisymmetry) of node after node.

    ``volume`` per weight; ``good``: whether the element is not folded there.
    """

    by: list[tuple[Node, ...]]
    volume: Node
    good: Node


def gradients(X: Tensor, shapes: Tensor, axisymmetric: bool, dimension: int = 2) -> Gradients:
    """In the places X (d a) of a nodes."""
    n, axes = len(X) // dimension, range(dimension)
    N, slopes = shapes[:n], [shapes[n * (1 + k) : n * (2 + k)] for k in axes]
    # by ξ_k row after row, of x, y(, z)
    jacobian = [total(X[dimension * a + i] * slopes[k][a] for a in range(n)) for k in axes for i in axes]
    c = cofactors(jacobian)
    det = total(jacobian[k] * c[dimension * k] for k in axes)
    over = 1.0 / det
    by = [tuple(total(c[dimension * i + k] * slopes[k][a] for k in axes) * over for i in axes) for a in range(n)]
    if dimension == 3:
        return Gradients(by, det, det > 0.0)
    if not axisymmetric:
        return Gradients([(*g, 0.0) for g in by], det, det > 0.0)  # type: ignore[arg-type]
    r = total(X[2 * a] * N[a] for a in range(n))
    return Gradients([(*g, N[a] / r) for a, g in enumerate(by)], det * r, (det > 0.0) & (r > 0.0))


def _components(g: Gradients, numbers: Sequence[Node]) -> tuple[int, Pairs]:
    """Dimension and components, of nodal numbers."""
    dimension = len(numbers) // len(g.by)
    return dimension, SPACE_PAIRS if dimension == 3 else PLANE_PAIRS


def gradient(u: Tensor, g: Gradients) -> tuple[Node, ...]:
    """∇u of nodal motions u (d a)."""
    dimension, pairs = _components(g, u)
    return tuple(total(u[dimension * a + i] * by[k] for a, by in enumerate(g.by)) for i, k in pairs)


def forces(P: Tensor, g: Gradients) -> list[Node]:
    """Nodal forces P ∇N (d a) of a first Piola-Kirchhoff stress times its volume."""
    pairs = SPACE_PAIRS if len(P) == 9 else PLANE_PAIRS
    axes = range(3 if len(P) == 9 else 2)
    return [total(P[c] * by[k] for c, (i, k) in enumerate(pairs) if i == axis) for by in g.by for axis in axes]


def dilatation(h: Tensor) -> Node:
    """Det(I + h) − 1."""
    if len(h) == 9:
        return det_less_one(h)
    plane = h[0] + h[3] + h[0] * h[3] - h[1] * h[2]
    return plane + h[4] + plane * h[4]


def _diagonal(h: Tensor, axisymmetric: bool) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Components of the diagonal that F-bar and B-bar change, and those that stay as they are."""
    if len(h) == 9:
        return (0, 4, 8), ()
    return ((0, 3, 4), ()) if axisymmetric else ((0, 3), (4,))


def fbar(h: Tensor, centre: Node, axisymmetric: bool) -> tuple[tuple[Node, ...], Node, Node]:
    """F̄ − I of f = I + h, α − 1, and α^m = J₀/J; centre: J₀ − 1."""
    diagonal, still = _diagonal(h, axisymmetric)
    here = dilatation(h)
    delta = (centre - here) / (1.0 + here)
    # with all the digits of a small δ
    more = expm1((2.0 / 3.0) * half_log1p(delta)) if len(diagonal) == 3 else delta / (1.0 + sqrt(1.0 + delta))
    # α depends on the nodes through h and J₀ alone: its slopes by these come once, not by every degree of freedom.
    (more,) = local([more], (*h, centre))
    alpha = 1.0 + more
    stretched = tuple(
        x if c in still else x + more * (1.0 + x) if c in diagonal else x * alpha for c, x in enumerate(h)
    )
    return stretched, more, alpha * alpha * alpha if len(diagonal) == 3 else alpha * alpha


def mean_dilatation(u: Tensor, points: Sequence[tuple[Gradients, float]]) -> Node:
    """Average of tr ∇u over the volume of the points (with their weights), that of B-bar.

    That of the centroid would fail the patch test in axisymmetry.
    """
    traces = [(g.volume * w, _trace(gradient(u, g))) for g, w in points]
    return total(v * t for v, t in traces) / total(v for v, _ in traces)


def at_points(X: Tensor, rows: Array, axisymmetric: bool, dimension: int = 2) -> list[tuple[Gradients, float]]:
    """Gradients in the places X (d a) of nodes at points, with the weights of these; rows: `Table.rows`."""
    return [(gradients(X, row[:-1], axisymmetric, dimension), row[-1]) for row in rows.tolist()]


def volume_of(points: Sequence[tuple[Gradients, float]]) -> Node:
    """Volume of an element by its points."""
    return total(g.volume * w for g, w in points)


def mean_change(u: Tensor, points: Sequence[tuple[Gradients, float]]) -> Node:
    """v/v_n − 1 of a whole element that moves by u (d a) from where ``points`` are: the mean of det f − 1 over its volume.

    In plane strain that of the centroid. In axisymmetry and in space that one would fail the patch test: its slopes by the nodes
    have another sum over the points than the slopes of the points themselves.
    """
    return total(g.volume * w * dilatation(gradient(u, g)) for g, w in points) / volume_of(points)


def without_mean(stress: Tensor, axisymmetric: bool) -> tuple[tuple[Node, ...], Node]:
    """A stress 11, 22, 33, 12 of the plane less its mean over the directions that F-bar and B-bar scale, and that mean."""
    s11, s22, s33, s12 = stress
    p = (s11 + s22 + s33) / 3.0 if axisymmetric else 0.5 * (s11 + s22)
    return (s11 - p, s22 - p, s33 - p if axisymmetric else s33, s12), p


def _trace(h: Tensor) -> Node:
    return trace(h) if len(h) == 9 else h[0] + h[3] + h[4]


def bbar(h: Tensor, mean: Node, axisymmetric: bool) -> tuple[Node, ...]:
    """Gradients of small strain with a mean dilatation (Hughes 1980)."""
    diagonal, _ = _diagonal(h, axisymmetric)
    more = (mean - _trace(h)) / float(len(diagonal))
    return tuple(x + more if c in diagonal else x for c, x in enumerate(h))
