"""A die by a mesh of one's own, in the coordinates of the case: which of its sides is the face that the workpiece touches."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from prensa.dies.surface import in_space
from prensa.errors import PrensaError
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import Mesh, MeshError
from prensa.model.problem import Points
from prensa.precision import DRAWN
from prensa.result.increment import ToolState
from prensa.tools.place import PlacedTool
from prensa.types import Array, Index


class OwnMesh(NamedTuple):
    """Coordinates ``s`` (n,) of the nodes of the face on the tool's outline, increasing, the ``mesh`` where the tool is, and
    whether its cells are triangles.

    Boundaries of the mesh are its own, ``face`` and the edges of that, ``e1``, ``e2``, …
    """

    s: Array
    mesh: Points
    triangles: bool


def own_mesh(description: Any, unit: str, tool: PlacedTool, state: ToolState, touched: tuple[float, float]) -> OwnMesh:
    """The mesh of a description (`File`, `Outline`, …) moved with its tool, whose face is what of it lies on the outline.

    Raises
    ------
    PrensaError
        If no side of the mesh lies on the outline where it is touched.

    """
    mesh, triangles = _drawn(description, unit)
    xi = mesh.points - state.at
    close = tool.shape.closest(xi)
    size = float(mesh.extent.max())
    on = np.abs(close.g) <= DRAWN * size
    s, middle = np.array(close.s, dtype=float), 0.5 * (touched[0] + touched[1])
    if np.isfinite(tool.shape.period):
        s = middle + np.mod(s - middle + 0.5 * tool.shape.period, tool.shape.period) - 0.5 * tool.shape.period
    edges = mesh.boundary[:, :2]
    edges = edges[on[edges].all(axis=1)]
    face = _walked(edges, s, touched)
    if not len(face):
        outline = np.unique(mesh.boundary[:, :2])
        away = float(np.abs(close.g[outline]).min())
        raise PrensaError(
            f"tool {tool.name!r}: no side of the mesh of the die lies on its outline between {touched[0]:.5g} and "
            f"{touched[1]:.5g}, where it is touched (the nearest node is {away:.3g} off it); draw the die in the coordinates of "
            "the case, where the tool is at first"
        )
    names = {name: tuple(np.unique(e[:, :2]).tolist()) for name, e in mesh.edges.items()}
    names |= {"face": tuple(face.tolist())} | {f"e{k + 1}": tuple(face[k : k + 2].tolist()) for k in range(len(face) - 1)}
    placed = in_space(xi, state)
    made = Points(tuple(map(tuple, placed.tolist())), tuple(map(tuple, mesh.cells.tolist())), names)
    return OwnMesh(s[face], made, triangles)


def _drawn(description: Any, unit: str) -> tuple[Mesh, bool]:
    """The mesh in quadrilaterals, else in triangles, and whether these it is; straight sides."""
    try:
        return mesh_of(description, "q4", unit), False
    except MeshError:
        return mesh_of(description, "t3", unit), True


def _walked(edges: Index, s: Array, touched: tuple[float, float]) -> Index:
    """Nodes in order along the edges (k, 2) that are joined to one another and reach over most of the touched part."""
    runs: list[list[int]] = []
    for a, b in sorted((sorted(pair, key=lambda n: s[n]) for pair in edges.tolist()), key=lambda pair: s[pair[0]]):
        if runs and runs[-1][-1] == a:
            runs[-1].append(b)
        else:
            runs.append([a, b])
    reach = [min(s[r[-1]], touched[1]) - max(s[r[0]], touched[0]) for r in runs]
    best = int(np.argmax(reach)) if runs else 0
    return np.array(runs[best] if runs and reach[best] > 0.0 else [], dtype=np.int64)
