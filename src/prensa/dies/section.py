"""The section of a tool as a mesh: its outline offset by a thickness, and a ring about that; or a mesh that is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from prensa.dies.surface import Outline
from prensa.errors import PrensaError
from prensa.model.problem import Points
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.types import Array, Index

GROWTH = 1.2  # of elements from one to the next away from what is touched


@dataclass(frozen=True)
class Strip:
    """Quadrilaterals between an outline and its offset, in the tool's frame.

    ``s`` (n,) coordinates of the nodes of the face, ``lines`` (m, n, 2) nodes from the face inwards, ``starts_on``, ``ends_on``:
    axis (0, 1) that holds the side at the first or last coordinate as a line of symmetry, None of free sides.
    """

    s: Array
    lines: Array

    def mesh(self, to_space: Array, names: tuple[str, str], on_axis: bool) -> Points:
        """The mesh at places (m, n, 2); ``names`` of its first and last line. Edges of the face are ``e1``, ``e2``, …"""
        m, n = self.lines.shape[:2]
        number = np.arange(m * n).reshape(m, n)
        cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
        sides = {names[0]: number[0], names[1]: number[-1], "start": number[:, 0], "end": number[:, -1]}
        sides |= {f"e{k + 1}": number[0, k : k + 2] for k in range(n - 1)}
        points = to_space.reshape(-1, 2).copy()
        if on_axis:
            points[np.abs(points[:, 0]) <= DRAWN * np.ptp(points, axis=0).max(), 0] = 0.0
        return Points(
            points=tuple(map(tuple, points.tolist())), cells=tuple(map(tuple, cells.tolist())),
            boundaries={name: tuple(nodes.tolist()) for name, nodes in sides.items()},
        )  # fmt: skip


def face_nodes(span: tuple[float, float], touched: tuple[float, float], size: float, corners: Array) -> Array:
    """Coordinates of the nodes of a face: ``size`` apart where it is touched, farther and farther away from there."""
    lo, hi = max(span[0], touched[0]), min(span[1], touched[1])
    if hi <= lo:
        lo, hi = span
    count = max(int(np.ceil((hi - lo) / size)), 1)
    inner = np.linspace(lo, hi, count + 1)
    parts = [lo - _growing(lo - span[0], size)[:0:-1], inner, hi + _growing(span[1] - hi, size)[1:]]
    s = np.concatenate(parts)
    s[0], s[-1] = span
    for corner in corners[(corners > span[0]) & (corners < span[1])]:
        near = int(np.argmin(np.abs(s[1:-1] - corner))) + 1
        s[near] = corner
    return np.asarray(s[np.concatenate([[True], np.diff(s) > NEGLIGIBLE * (span[1] - span[0])])])


def _growing(length: float, size: float) -> Array:
    """Distances from 0 to a length, whose first is about ``size`` and each next one longer."""
    if length <= 0.0:
        return np.zeros(1)
    count = max(int(np.ceil(np.log1p(length / size * (GROWTH - 1.0)) / np.log(GROWTH))), 1)
    steps = GROWTH ** np.arange(count)
    return np.concatenate([[0.0], np.cumsum(steps) / steps.sum() * length])


def offset(name: str, outline: Outline, s: Array, depths: Array) -> Strip:
    """The face at coordinates s (n,) and its parallel lines at depths (m,) inside the tool.

    Raises
    ------
    PrensaError
        If lines cross: the tool is not as thick as that.

    """
    x = outline.at(s)
    d = np.diff(x, axis=0)
    n = np.stack([-d[:, 1], d[:, 0]], axis=1) / np.hypot(*d.T)[:, None]  # to the left, where the tool is
    before, after = np.vstack([n[:1], n]), np.vstack([n, n[-1:]])
    if abs(s[-1] - s[0] - outline.tool.shape.period) <= DRAWN * (s[-1] - s[0]):
        before[0], after[-1] = n[-1], n[0]
    way = (before + after) / (1.0 + (before * after).sum(axis=1))[:, None]
    lines = x[None] + depths[:, None, None] * way[None]
    refuse_crossing(name, lines)
    return Strip(s, lines)


def refuse_crossing(name: str, lines: Array) -> None:
    """Refuse elements between lines (m, n, 2) that are turned inside out."""
    a, b, c, d = lines[:-1, :-1], lines[:-1, 1:], lines[1:, 1:], lines[1:, :-1]
    for p, q, r in ((a, b, d), (b, c, a), (c, d, b), (d, a, c)):
        u, v = q - p, r - p
        if (u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0] <= 0.0).any():
            raise PrensaError(
                f"tool {name!r}: its outline cannot be offset that far, lines of it cross; give a smaller thickness, a shorter "
                "span of its outline, or a mesh of the section"
            )


def depths_of(thickness: float, size: float) -> Array:
    """Depths (m,) of the lines of a section: ``size`` apart at the face."""
    return _growing(thickness, size)


def face_edges(mesh_points: Array, edges: Index, outline: Outline, near: float) -> tuple[Index, Array]:
    """Edges (k, 2) of a given mesh's boundary that lie on the tool's outline, in its order, and coordinates (k, 2) of their ends."""
    close = outline.tool.shape.closest(mesh_points[edges[:, :2]].reshape(-1, 2))
    on = (np.abs(close.g) <= near).reshape(-1, 2).all(axis=1)
    s = np.asarray(close.s).reshape(-1, 2)[on]
    order = np.argsort(s.mean(axis=1))
    return edges[on][order], np.sort(s[order], axis=1)
