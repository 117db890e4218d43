"""Meshes from descriptions: graded rectangles with named boundaries, and meshes given by their arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.mesh.convert import Draft, draft_of, finished, nodes_of
from prensa.mesh.mesh import Index, Mesh, MeshError, boundary_edges, edges_between
from prensa.model import problem as model

Array = NDArray[np.float64]


def graded(start: float, end: float, n: int, towards: tuple[float, ...], ratio: float) -> Array:
    """Coordinates (n + 1,) from start to end, element size growing linearly with the distance from the nearest target.

    ``ratio`` = largest size wanted / smallest. Every target inside the range becomes a coordinate.

    Raises
    ------
    MeshError
        If a target lies outside, or n is too small to keep every target.

    """
    if not towards or ratio == 1.0:
        targets = np.array(sorted(towards)) if towards else np.array([])
        if len(targets) == 0:
            return np.linspace(start, end, n + 1)
    targets = np.unique(np.asarray(towards, dtype=np.float64))
    span = end - start
    if targets[0] < start - 1e-12 * span or targets[-1] > end + 1e-12 * span:
        raise MeshError(f"grading target {targets.tolist()} lies outside {start:g} … {end:g}")
    fine = np.linspace(start, end, 20_001)
    fine = np.unique(np.concatenate([fine, targets]))
    distance = np.min(np.abs(fine[:, None] - targets[None, :]), axis=1)
    density = 1.0 / (1.0 + (ratio - 1.0) * distance / max(distance.max(), 1e-300))
    count = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine))])
    knots = np.unique(np.concatenate([[start], targets, [end]]))
    knots = knots[np.concatenate([[True], np.diff(knots) > 1e-12 * span])]
    if n < len(knots) - 1:
        raise MeshError(f"{n} elements cannot keep {len(knots) - 2} grading targets as mesh lines")
    share = np.diff(np.interp(knots, fine, count))
    exact = n * share / share.sum()
    parts = np.maximum(1, np.floor(exact).astype(int))
    for k in np.argsort(parts - exact):  # largest remainder first
        if parts.sum() >= n:
            break
        parts[k] += 1
    while parts.sum() > n:
        parts[np.argmax(parts - exact + (parts > 1) * 1e3)] -= 1
    out = [np.array([knots[0]])]
    for a, b, m in zip(knots[:-1], knots[1:], parts):
        levels = np.linspace(float(np.interp(a, fine, count)), float(np.interp(b, fine, count)), int(m) + 1)
        x = np.interp(levels[1:], count, fine)
        x[-1] = b
        out.append(x)
    return np.concatenate(out)


def rectangle(m: model.Rectangle) -> Draft:
    """Draft of a `prensa.Rectangle`."""
    (x0, y0), (lx, ly), (nx, ny) = m.origin, m.size, m.n
    grade = m.grade
    if isinstance(grade, str):
        grade = model.Grade(
            x=(x0,) if "left" in grade else (x0 + lx,) if "right" in grade else (),
            y=(y0,) if "bottom" in grade else (y0 + ly,) if "top" in grade else (),
        )
    towards_x, towards_y, ratio = (grade.x, grade.y, grade.ratio) if grade else ((), (), 1.0)
    x = graded(x0, x0 + lx, nx, towards_x, ratio)
    y = graded(y0, y0 + ly, ny, towards_y, ratio)
    points = np.stack(np.meshgrid(x, y, indexing="xy"), axis=-1).reshape(-1, 2)
    node = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    cells = np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1).reshape(-1, 4)

    def chain(nodes: Any) -> Any:
        return np.stack([nodes[:-1], nodes[1:]], axis=1)

    edges = {
        "bottom": chain(node[0, :]),
        "right": chain(node[:, -1]),
        "top": chain(node[-1, ::-1]),
        "left": chain(node[::-1, 0]),
    }
    corners = {
        "bottom-left": int(node[0, 0]),
        "bottom-right": int(node[0, -1]),
        "top-right": int(node[-1, -1]),
        "top-left": int(node[-1, 0]),
    }
    return Draft(points, cells, edges, corners)


def from_points(m: model.Points, nodes: int) -> Mesh:
    """Mesh of a `prensa.Points` in cells of *nodes* nodes: a boundary of one node becomes a named point."""
    points, cells = np.array(m.points, dtype=np.float64), np.array(m.cells, dtype=np.int64)
    bad = (cells < 0) | (cells >= len(points))
    if bad.any():
        e = int(np.argmax(bad.any(axis=1)))
        raise MeshError(f"element {e} refers to a node outside 0 … {len(points) - 1}: {cells[e].tolist()}")
    outline = boundary_edges(cells)
    edges, corners = {}, {}
    for name, some in m.boundaries.items():
        if len(some) == 1:
            corners[name] = int(some[0])
            continue
        edges[name] = edges_between(outline, np.array(some))
        if len(edges[name]) == 0:
            raise MeshError(f"boundary {name!r}: no element edge on the outline has both ends in its node list")
    return in_cells_of(nodes, points, cells, edges, corners)


def in_cells_of(
    nodes: int, points: Array, cells: Index, edges: Mapping[str, Index], corners: Mapping[str, int]
) -> Mesh:
    """Mesh of given arrays; where they are not of *nodes* nodes a cell, corners are numbered first and converted."""
    mesh = Mesh(points, cells, edges, corners)  # its mistakes are told in the numbers that it was given in
    if cells.shape[1] == nodes:
        return mesh
    return finished(draft_of(points, cells, edges, corners), nodes)


def mesh_of(description: Any, element: str = "q4") -> Mesh:
    """The mesh of a description in the cells of an element (``q4_fbar``, ``t6``, …).

    Raises
    ------
    MeshError
        If the description gives no mesh, or one that cannot be had in those cells.

    """
    nodes = nodes_of(element)
    if isinstance(description, model.Points):
        return from_points(description, nodes)
    return finished(rectangle(description), nodes)
