"""Meshes from descriptions, in the cells that the element of the body has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from prensa.mesh import blocks, bricks
from prensa.mesh.convert import Draft, draft_of, mesh_from_draft, nodes_of
from prensa.mesh.mesh import Mesh, MeshError, boundary_edges, edges_between
from prensa.mesh.spacing import graded
from prensa.model import meshes as model
from prensa.types import Array, Index


def rectangle(m: model.Rectangle) -> Draft:
    """Draft of a `prensa.Rectangle`."""
    (x0, y0), (lx, ly), (nx, ny) = m.origin, m.size, m.n
    grade = m.grade
    if isinstance(grade, str):
        grade = model.Grade(
            x=(x0,) if "left" in grade else (x0 + lx,) if "right" in grade else (),
            y=(y0,) if "bottom" in grade else (y0 + ly,) if "top" in grade else (),
        )
    grade = grade or model.Grade(ratio=1.0)
    x = graded(x0, x0 + lx, nx, grade.x, grade.ratio, grade.x_between)
    y = graded(y0, y0 + ly, ny, grade.y, grade.ratio, grade.y_between)
    points = np.stack(np.meshgrid(x, y, indexing="xy"), axis=-1)
    node = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    edges = {
        "bottom": blocks.chain(node[0, :]),
        "right": blocks.chain(node[:, -1]),
        "top": blocks.chain(node[-1, ::-1]),
        "left": blocks.chain(node[::-1, 0]),
    }
    corners = {
        "bottom-left": int(node[0, 0]),
        "bottom-right": int(node[0, -1]),
        "top-right": int(node[-1, -1]),
        "top-left": int(node[-1, 0]),
    }
    return Draft(points.reshape(-1, 2), blocks.grid(points), edges, corners)


def strip(m: model.Strip) -> Draft:
    """Draft of a `prensa.Strip`: a rectangle whose height follows the nose."""
    right = m.toward == "right"
    length, low = m.length, 0.0 if m.half else -1.0
    nose = () if m.nose is None else (-m.nose.length if right else m.nose.length,)
    # The outline has a kink where the nose ends: a line of nodes has to lie there.
    grid = model.Grade(x=nose, ratio=1.0)
    plain = rectangle(model.Rectangle((length, 1.0 - low), m.n, (-length if right else 0.0, low), grid))
    x, eta = plain.points.T
    points = np.column_stack([m.front[0] + x, m.front[1] + eta * 0.5 * _thickness(np.abs(x), m.thickness, m.nose)])
    return replace(plain, points=points)


def wire(m: model.Wire) -> Draft:
    """Draft of a `prensa.Wire`: half of its section, with the axis on the left."""
    top = m.toward == "top"
    nose = () if m.nose is None else (-m.nose.length if top else m.nose.length,)
    grid = model.Grade(y=nose, ratio=1.0)
    plain = rectangle(model.Rectangle((1.0, m.length), (m.n[1], m.n[0]), (0.0, -m.length if top else 0.0), grid))
    eta, y = plain.points.T
    points = np.column_stack([eta * 0.5 * _thickness(np.abs(y), m.diameter, m.nose), m.front + y])
    return replace(plain, points=points)


def _thickness(behind: Array, thickness: float, nose: model.Nose | None) -> Array:
    """Thickness (n,) at distances (n,) behind the front face."""
    if nose is None:
        return np.full_like(behind, thickness)
    return np.asarray(np.interp(behind, [0.0, nose.length], [nose.thickness, thickness]))


def from_points(m: model.Points, nodes: int) -> Mesh:
    """Mesh of a `prensa.Points` in cells of *nodes* nodes: a boundary of one node becomes a named point."""
    points, last = np.array(m.points, dtype=np.float64), len(m.points) - 1
    named = {f"element {e}": c for e, c in enumerate(m.cells)} | {f"boundary {k!r}": b for k, b in m.boundaries.items()}
    for what, some in named.items():  # in Python: numbers may be too large for any array
        if not all(0 <= n <= last for n in some):
            raise MeshError(f"{what} refers to a node outside 0 … {last}: {str(list(some))[:80]}")
    cells = np.array(m.cells, dtype=np.int64)
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
    mesh = Mesh(points, cells, edges, corners)  # checked first: errors name the nodes by the numbers that were given
    if cells.shape[1] == nodes:
        return mesh
    return mesh_from_draft(draft_of(points, cells, edges, corners), nodes)


def _section(description: Any, unit: str) -> Mesh:
    """Mesh of a section that bricks stand on."""
    mesh = mesh_of(description, "q4", unit)
    if mesh.cells.shape[1] != 4:
        raise MeshError("the section has triangles, and bricks stand on quadrilaterals; draw it as a 'patch', or import those")
    return mesh


def mesh_of(
    description: Any, element: str | int = "q4", unit: str = "mm", beside: Mesh | None = None, dimension: int = 2
) -> Mesh:
    """The mesh of a description in the cells of an element (``q4_fbar``, ``t6``, …); *unit*: of length, of the case.

    ``beside``: the mesh of a description with numbers next to these. ``dimension``: 3 for the mesh of a file in space.

    Raises
    ------
    MeshError
        If the description gives no mesh, or one that cannot be had in those cells.

    """
    nodes = nodes_of(element)
    match description:
        case model.Points():
            return from_points(description, nodes)
        case model.Rectangle():
            return mesh_from_draft(rectangle(description), nodes, beside)
        case model.Strip():
            return mesh_from_draft(strip(description), nodes, beside)
        case model.Wire():
            return mesh_from_draft(wire(description), nodes, beside)
        case model.Disc():
            return mesh_from_draft(blocks.disc(description), nodes, beside)
        case model.Annulus():
            return mesh_from_draft(blocks.annulus(description), nodes, beside)
        case model.File() if dimension == 3:
            from prensa.mesh.read_bricks import bricks_from_file

            return bricks_from_file(description, unit)
        case model.File():
            from prensa.mesh.read import from_file

            return from_file(description, nodes, unit)
        case model.Outline():
            from prensa.mesh.outlined import outlined

            return mesh_from_draft(outlined(description), nodes, beside)
        case model.Patch():
            return mesh_from_draft(blocks.patch(description), nodes, beside)
        case model.Box():
            return bricks.box(description)
        case model.Bricks() | model.Tetrahedra():
            return bricks.from_arrays(description)
        case model.Extrusion():
            return bricks.extruded(description, _section(description.section, unit))
        case model.Cylinder():
            from prensa.mesh.revolve import cylinder, profile_of

            return cylinder(description, _section(profile_of(description), unit))
        case model.Revolution():
            from prensa.mesh.revolve import revolved

            return revolved(description, _section(description.section, unit))
    raise TypeError(f"unknown mesh {description!r}")
