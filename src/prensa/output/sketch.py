"""Picture of a case before anything is solved: bodies with the names of their sides, tools in their places."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from prensa.mesh.mesh import Mesh
from prensa.model.problem import Problem
from prensa.output import style
from prensa.output.cells import around, outline
from prensa.output.mirrors import Image
from prensa.output.outline import outlines
from prensa.output.plot import figure_of_section, finish_section
from prensa.output.sketch_in_space import sketch_in_space
from prensa.precision import SMALLEST
from prensa.result.increment import Force, Place, ToolState
from prensa.types import Array, Index

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from prensa.system.system import System


PAPER = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6}


class _Side(NamedTuple):
    """Edges of one or several names."""

    names: list[str]
    edges: Index


def sketch(problem: Problem, meshes: Mapping[str, Mesh], system: System | None = None) -> Figure:
    """Meshes of the bodies, each side in a colour with all its names, named points, and the tools of the system.

    system: None where the tools cannot be placed yet, because a side that they name does not exist.
    """
    if any(mesh.points.shape[1] != 2 for mesh in meshes.values()):
        return sketch_in_space(problem, meshes, system)
    x = np.vstack([mesh.points for mesh in meshes.values()])

    def tools(depth: float) -> Iterator[tuple[str, Array]]:
        for tool in system.tools if system is not None else ():
            state = ToolState(tool.at, Place(0, 0, 0), Force(0, 0, 0), tuple(map(float, tool.direction)))
            for polygon in outlines(tool.description, state, depth):
                yield tool.name, polygon

    box = _around(x, tools)
    with style.styled():
        figure, axes = figure_of_section(box)
        for name, mesh in meshes.items():
            _draw_body(axes, name, mesh, max(box[1] - box[0], box[3] - box[2]))
        part = Image().part(box, [(0, 0.0)], x.mean(axis=0)) if problem.space == "axisymmetric" else box
        _draw_tools(axes, tools(3 * max(box[1] - box[0], box[3] - box[2])), part)
        finish_section(axes, problem, box)
        axes.set_title("before the first step" if system is not None else "bodies alone: see the message")
    return figure


def _around(x: Array, tools: Callable[[float], Iterable[tuple[str, Array]]]) -> tuple[float, float, float, float]:
    """Part of the plane to show: the bodies, the tools up to once their size away from them, and a margin for names."""
    low, high = x.min(axis=0), x.max(axis=0)
    size = float((high - low).max())
    pieces = [np.clip(polygon, low - size, high + size) for _, polygon in tools(0.1 * size)]
    x = np.vstack([x, *pieces])
    (left, low_y), (right, high_y) = x.min(axis=0), x.max(axis=0)
    margin = 0.2 * max(right - left, high_y - low_y)
    return float(left - margin), float(right + margin), float(low_y - margin), float(high_y + margin)


def _draw_body(axes: Axes, name: str, mesh: Mesh, size: float) -> None:
    """A body with the names of its sides and points, in a picture of a ``size``."""
    from matplotlib.collections import LineCollection, PolyCollection

    x = mesh.points
    rings = list(x[around(mesh.cells)])
    axes.add_collection(PolyCollection(rings, facecolors="#F4F1EA", edgecolors="k", linewidths=0.2, alpha=0.6))
    axes.add_collection(LineCollection(list(x[outline(mesh.cells)]), colors="0.35", linewidths=0.8, zorder=3))
    for k, side in enumerate(_sides(mesh)):
        colour = style.CYCLE[k % len(style.CYCLE)]
        axes.add_collection(LineCollection(list(x[side.edges[:, :2]]), colors=colour, linewidths=2.2, zorder=4))
        middle, out = _middle(x, side.edges)
        # inside the body, since outside there are tools, unless it is too thin there for words
        room = float(np.ptp(x @ out)) / max(float(np.hypot(*out)), SMALLEST)
        _label(axes, ", ".join(side.names), middle, -out if room > size / 4 else out, colour)
    for node, names in _points(mesh).items():
        away = x[node] - x.mean(axis=0)
        axes.plot(*x[node], "o", color="0.2", markersize=2.5, zorder=5)
        _label(axes, ", ".join(names), x[node], away, "0.35", small=True)
    x0, y0 = x.mean(axis=0).tolist()
    axes.text(x0, y0, name, ha="center", va="center", zorder=6, weight="bold", bbox=PAPER)


def _sides(mesh: Mesh) -> list[_Side]:
    """Sides with all names that they have."""
    out: dict[bytes, _Side] = {}
    for name, edges in mesh.edges.items():
        if len(edges):
            key = np.unique(np.sort(edges[:, :2], axis=1), axis=0).tobytes()
            out.setdefault(key, _Side([], edges)).names.append(name)
    return list(out.values())


def _points(mesh: Mesh) -> dict[int, list[str]]:
    """Named points: node → names."""
    out: dict[int, list[str]] = {}
    for name, node in mesh.corners.items():
        out.setdefault(node, []).append(name)
    return out


def _middle(x: Array, edges: Index) -> tuple[Array, Array]:
    """Middle of the edge in the middle of a side, and the direction out of the body there."""
    centre = x[edges[:, :2]].mean(axis=1)
    k = int(np.argmin(np.hypot(*(centre - centre.mean(axis=0)).T)))
    along = x[edges[k, 1]] - x[edges[k, 0]]
    return centre[k], np.array([along[1], -along[0]])


def _label(axes: Axes, words: str, at: Array, away: Array, colour: str, small: bool = False) -> None:
    """Words beside a place, on the side to which ``away`` points."""
    dx, dy = away / max(float(np.hypot(*away)), SMALLEST)
    across = "left" if 2 * dx > 1 else "right" if 2 * dx < -1 else "center"
    along = "bottom" if 2 * dy > 1 else "top" if 2 * dy < -1 else "center"
    axes.annotate(
        words, tuple(at), (5 * dx, 5 * dy), textcoords="offset points", color=colour, zorder=7, ha=across, va=along,
        fontsize="xx-small" if small else "small", bbox=PAPER,
    )  # fmt: skip


def _draw_tools(axes: Axes, tools: Iterable[tuple[str, Array]], part: tuple[float, ...]) -> None:
    """Tools in a part of the plane (x from, to, y from, to)."""
    from matplotlib.patches import Polygon, Rectangle

    low, high = np.array(part[::2]), np.array(part[1::2])
    own = Rectangle(tuple(low), *(high - low).tolist(), transform=axes.transData)
    for name, polygon in tools:
        axes.add_patch(Polygon(polygon, closed=True, zorder=2.5, **style.TOOL)).set_clip_path(own)
        inside = polygon[(polygon >= low).all(axis=1) & (polygon <= high).all(axis=1)]
        x0, y0 = np.clip((inside if len(inside) else np.clip(polygon, low, high)).mean(axis=0), low, high).tolist()
        axes.text(x0, y0, name, ha="center", va="center", zorder=7, bbox=PAPER)
