"""The section of a tool as a mesh: its outline offset by a thickness, and a ring about that."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from prensa.errors import PrensaError
from prensa.geometry.plane import cross, turned
from prensa.model.problem import Points
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.types import Array


def mesh_of(lines: Array, names: tuple[str, str], on_axis: bool) -> Points:
    """Quadrilaterals between lines of nodes (m, n, 2), from the face inwards, the tool on their left.

    ``names`` of the first and the last line; the others are ``start`` and ``end`` where lines are not closed. The edges of the
    first line are ``e1``, ``e2``, …
    """
    m, n = lines.shape[:2]
    number = np.arange(m * n).reshape(m, n)
    closed = _closed(lines[0])
    if closed:
        number = np.arange(m * (n - 1)).reshape(m, n - 1)[:, [*range(n - 1), 0]]
        lines = lines[:, :-1]
    cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
    ends = {} if closed else {"start": number[:, 0], "end": number[:, -1]}
    sides = {names[0]: number[0], names[1]: number[-1]} | ends
    sides |= {f"e{k + 1}": number[0, k : k + 2] for k in range(n - 1)}
    points = lines.reshape(-1, 2).copy()
    if on_axis:
        points[np.abs(points[:, 0]) <= DRAWN * np.ptp(points, axis=0).max(), 0] = 0.0
    return Points(
        points=tuple((float(x), float(y)) for x, y in points), cells=tuple(map(tuple, cells.tolist())),
        boundaries={name: tuple(nodes.tolist()) for name, nodes in sides.items()},
    )  # fmt: skip


def _closed(x: Array) -> bool:
    """Whether a line (n, 2) ends where it begins."""
    return bool(np.hypot(*(x[-1] - x[0])) <= DRAWN * np.ptp(x, axis=0).max())


def face_nodes(
    span: tuple[float, float], touched: tuple[float, float], size: float, growth: float, corners: Array
) -> Array:
    """Coordinates of the nodes of a face: ``size`` apart where it is touched, growing from one to the next beyond."""
    lo, hi = max(span[0], touched[0]), min(span[1], touched[1])
    lo = span[0] if lo - span[0] < 0.5 * size else lo  # what is left would be a sliver
    hi = span[1] if span[1] - hi < 0.5 * size else hi
    if hi <= lo:
        lo, hi = span
    count = max(int(np.ceil((hi - lo) / size)), 1)
    inner = np.linspace(lo, hi, count + 1)
    parts = [lo - _growing(lo - span[0], size, growth)[:0:-1], inner, hi + _growing(span[1] - hi, size, growth)[1:]]
    s = np.concatenate(parts)
    s[0], s[-1] = span
    for corner in corners[(corners > span[0]) & (corners < span[1])]:
        near = int(np.argmin(np.abs(s[1:-1] - corner))) + 1
        s[near] = corner
    return np.asarray(s[np.concatenate([[True], np.diff(s) > NEGLIGIBLE * (span[1] - span[0])])])


def _growing(length: float, size: float, growth: float) -> Array:
    """Distances from 0 to a length, whose first is about ``size`` and each next one longer."""
    if length <= 0.0:
        return np.zeros(1)
    count = max(int(np.ceil(np.log1p(length / size * (growth - 1.0)) / np.log(growth))), 1)
    steps = growth ** np.arange(count)
    return np.concatenate([[0.0], np.cumsum(steps) / steps.sum() * length])


def offset(name: str, x: Array, depths: Array, mirrors: Mapping[str, str] | None = None) -> Array:
    """Lines (m, n, 2) parallel to an open one x (n, 2), to its left, at depths (m,).

    ``mirrors``: ends (``start``, ``end``) at lines of symmetry across x or y, beyond which the line goes on as its image.

    Raises
    ------
    PrensaError
        If lines cross: the tool is not as thick as that.

    """
    d = np.diff(x, axis=0)
    n = turned(d) / np.hypot(*d.T)[:, None]
    before, after = np.vstack([n[:1], n]), np.vstack([n, n[-1:]])
    if _closed(x):
        before[0], after[-1] = n[-1], n[0]
    else:
        for end, across in (mirrors or {}).items():
            image = np.array([-1.0, 1.0] if across == "x" else [1.0, -1.0])
            if end == "start":
                before[0] = image * n[0]
            else:
                after[-1] = image * n[-1]
    way = (before + after) / (1.0 + (before * after).sum(axis=1))[:, None]
    lines = x[None] + depths[:, None, None] * way[None]
    refuse_crossing(name, lines)
    return np.asarray(lines)


def refuse_crossing(name: str, lines: Array) -> None:
    """Refuse elements between lines (m, n, 2) that are turned inside out."""
    a, b, c, d = lines[:-1, :-1], lines[:-1, 1:], lines[1:, 1:], lines[1:, :-1]
    for p, q, r in ((a, b, d), (b, c, a), (c, d, b), (d, a, c)):
        u, v = q - p, r - p
        if (cross(u, v) <= 0.0).any():
            raise PrensaError(
                f"tool {name!r}: its outline cannot be offset that far, lines of it cross; give a smaller thickness, a shorter "
                "span of its outline"
            )


def depths_of(thickness: float, size: float, growth: float) -> Array:
    """Depths (m,) of the lines of a section: ``size`` apart at the face."""
    return _growing(thickness, size, growth)
