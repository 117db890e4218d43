"""Second-order tensors at a point as point functions, row by row 3 × 3; in the plane the zeros of its tensors fold away.

Numbers may be recorded ones or arrays. Components in arrays are those of `prensa.layout`: of any tensor 11, 12, 21, 22, 33 in the
plane, row by row in space; of a symmetric one 11, 22, 33, 12(, 13, 23).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from prensa.kernels.record import Node

Tensor = Sequence[Node]

SPACE_AXES = range(3)
UNIT: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_PLANE, _KEPT = (0, 1, 3, 4, 8), (0, 4, 8, 1, 2, 5)


def total(terms: Iterable[Node]) -> Node:
    """Their sum, from the first one on."""
    first, *others = terms
    for t in others:
        first = first + t
    return first


def tensor(c: Tensor) -> Tensor:
    """Nine components of five or nine."""
    return c if len(c) == 9 else (c[0], c[1], 0.0, c[2], c[3], 0.0, 0.0, 0.0, c[4])  # type: ignore[return-value]


def symmetric(c: Tensor) -> Tensor:
    """Nine components of a symmetric tensor of four or six."""
    a, b = c[4:] if len(c) == 6 else (0.0, 0.0)
    return c[0], c[3], a, c[3], c[1], b, a, b, c[2]  # type: ignore[return-value]


def components(m: Tensor, like: Tensor) -> tuple[Node, ...]:
    """As many of nine components as there are of another tensor."""
    return tuple(m) if len(like) == 9 else tuple(m[k] for k in _PLANE)


def kept(m: Tensor, like: Tensor) -> tuple[Node, ...]:
    """As many components of a symmetric tensor of nine as there are of another one."""
    return tuple(m[k] for k in _KEPT[: len(like)])


def product(a: Tensor, b: Tensor) -> Tensor:
    """A b."""
    return tuple(total(a[3 * i + k] * b[3 * k + j] for k in SPACE_AXES) for i in SPACE_AXES for j in SPACE_AXES)


def by_transposed(a: Tensor, b: Tensor) -> Tensor:
    """A bᵀ."""
    return tuple(total(a[3 * i + k] * b[3 * j + k] for k in SPACE_AXES) for i in SPACE_AXES for j in SPACE_AXES)


def plus(*tensors: Tensor) -> Tensor:
    """Sum of tensors."""
    return tuple(total(t) for t in zip(*tensors))


def times(x: Node, a: Tensor) -> Tensor:
    """X a."""
    return tuple(x * c for c in a)


def trace(a: Tensor) -> Node:
    """Tr a."""
    return a[0] + a[4] + a[8]


def cofactors(m: Tensor) -> Tensor:
    """That of column j and row i in place (i, j), so that m times it is det m; of 2 × 2 components too."""
    if len(m) == 4:
        return m[3], -m[1], -m[2], m[0]
    a, b, c, d, e, f, g, h, i = m
    return (
        e * i - f * h, c * h - b * i, b * f - c * e,
        f * g - d * i, a * i - c * g, c * d - a * f,
        d * h - e * g, b * g - a * h, a * e - b * d,
    )  # fmt: skip


def invariants(h: Tensor) -> tuple[Node, Node, Node]:
    """Trace, second invariant and determinant of a tensor."""
    second = h[0] * h[4] - h[1] * h[3] + (h[0] * h[8] - h[2] * h[6]) + (h[4] * h[8] - h[5] * h[7])
    c = cofactors(h)
    return trace(h), second, h[0] * c[0] + h[1] * c[3] + h[2] * c[6]


def det_less_one(h: Tensor) -> Node:
    """Det(I + h) − 1 without cancellation, by the invariants of h."""
    first, second, third = invariants(h)
    return first + second + third


def push_forward(h: Tensor, b: Tensor) -> Tensor:
    """F b fᵀ − I, without cancellation; h = f − I, and b − I."""
    m = plus(h, b, product(h, b))
    transposed = tuple(h[3 * j + i] for i in SPACE_AXES for j in SPACE_AXES)
    return plus(m, transposed, by_transposed(m, h))
