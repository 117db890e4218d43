"""Picture of a case in space before anything is solved: bodies from two sides, each of their sides in a colour with its names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from prensa.mesh.bricks import BrickMesh, corner_keys
from prensa.mesh.mesh import Mesh
from prensa.model.problem import Problem
from prensa.output import style
from prensa.output.cells import MOST_EDGES, covered
from prensa.output.mirrors import Whole
from prensa.output.spatial import VIEWS, Faces, directions, ends_of, frame, glass_of, outer_sides, paint, upright
from prensa.precision import SMALLEST
from prensa.solver.time_stepping import at_rest
from prensa.types import Array, Index

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from prensa.system.system import System

LABEL = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6}
NAMED_FROM = 0.25
"""Cosine of the angle between a face and the eye from which on its name is written there."""
TWO_VIEWS = (11.0, 5.2)
"""Inches of the two views beside each other."""


class _Side(NamedTuple):
    """A side with all of its names: ``at`` (k, 3) middles of its faces, ``normals`` (k, 3), its ``colour``."""

    names: str
    at: Array
    normals: Array
    colour: str


def sketch_in_space(problem: Problem, meshes: Mapping[str, Mesh], system: System | None) -> Figure:
    """Bodies from above at the right and from below at the left, with the names of sides; tools of the system as glass.

    ``system``: None where the tools cannot be placed yet, because a side that they name does not exist.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import to_rgba

    from prensa.output.picture import Picture

    palette = np.array([to_rgba(c) for c in ("#D8D4CA", *style.CYCLE)])
    parts, sides = [], []
    for mesh in meshes.values():
        own, colour = _sides(mesh)
        faces = mesh.boundary
        triangles = covered(faces)
        values = np.tile(colour.astype(float), len(triangles) // len(faces))
        off = np.full(triangles.shape, -1.0)
        parts.append(Faces(mesh.points[triangles], np.repeat(values[:, None], 3, axis=1), outer_sides(faces), off))
        sides += own
    bodies = Faces(*(np.concatenate(arrays) for arrays in zip(*parts)))
    first = at_rest(system) if system is not None else None
    (turn, lift) = VIEWS["iso"]
    with style.styled():
        figure = Picture(figsize=TWO_VIEWS, layout="constrained")
        FigureCanvasAgg(figure)
        for k, angles in enumerate(((turn, lift), (turn + 180.0, -lift))):
            axes: Any = figure.add_subplot(1, 2, k + 1, projection="3d", computed_zorder=False)
            eye = directions(*angles)[2]
            glass = glass_of(first, problem, Whole(), None, eye) if first is not None else None
            box = ends_of(bodies.x.reshape(-1, 3) if glass is None else np.concatenate([bodies.x, glass.x]).reshape(-1, 3))
            frame(axes, box, problem, angles)
            mesh_lines = len(bodies.x) // 2 <= MOST_EDGES
            paint(axes, bodies, glass, lambda v: palette[np.rint(v).astype(int)], angles, mesh_lines)
            _name(axes, sides, eye)
        figure.suptitle("before the first step" if system is not None else "bodies alone: see the message")
    return figure


def _sides(mesh: Mesh) -> tuple[list[_Side], Index]:
    """Sides with all names that they have, and the colour (k,) of each face of the outside, 0 of those without a name."""
    assert isinstance(mesh, BrickMesh)
    number = {tuple(key): k for k, key in enumerate(corner_keys(mesh.boundary).tolist())}
    found: dict[tuple[int, ...], list[str]] = {}
    for name, faces in mesh.edges.items():
        rows = tuple(sorted({number[tuple(key)] for key in corner_keys(faces).tolist() if tuple(key) in number}))
        if rows:
            found.setdefault(rows, []).append(name)
    x = mesh.points[mesh.boundary[:, :3]]
    normals = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), SMALLEST)
    at = mesh.points[mesh.boundary].mean(axis=1)
    colour, sides = np.zeros(len(mesh.boundary), dtype=np.int64), []
    # a side that is a part of another one keeps its own colour
    for k, (rows, names) in enumerate(sorted(found.items(), key=lambda item: len(item[0]))):
        own, hue = np.array(rows), 1 + k % len(style.CYCLE)
        free = own[colour[own] == 0]
        colour[free] = hue
        shown = free if len(free) else own
        sides.append(_Side(", ".join(names), at[shown], normals[shown], style.CYCLE[hue - 1] if len(free) else "0.25"))
    return sides, colour


def _name(axes: Any, sides: list[_Side], eye: Array) -> None:
    """Write the names of the sides that are seen from an eye on the face in their middle."""
    for side in sides:
        seen = np.flatnonzero(side.normals @ eye > NAMED_FROM)
        if not len(seen):
            continue
        middle = side.at[seen].mean(axis=0)
        k = seen[np.argmin(((side.at[seen] - middle) ** 2).sum(axis=1))]
        axes.text(
            *upright(side.at[k]), side.names, color=side.colour, ha="center", va="center", fontsize="small", zorder=8, bbox=LABEL
        )
