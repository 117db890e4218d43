"""What lies along a line of a body, as a table: a boundary of the plane, a side in space where a plane cuts it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.measures.bodies import Outline, field
from prensa.measures.cuts import Line
from prensa.measures.grammar import field_names, line_of, undeformed
from prensa.measures.measure import MeasureError
from prensa.mesh.generate import mesh_of
from prensa.model.problem import Problem
from prensa.output.files import write_spreadsheet
from prensa.result.increment import BodyState, Increment, Shape
from prensa.types import Array, Index

LINE_TABLE = "profile.csv"


class Profile(NamedTuple):
    """Columns (k,) along a ``line``, by name: ``part`` of a line in several, length ``s`` from its start, coordinates of the
    deformed body (x, y, z) and the undeformed one (X, Y, Z), and the fields that are known.
    """

    line: str
    columns: dict[str, Array]

    def save(self, path: str | Path, semicolons: bool = False) -> Path:
        """Write the columns, with their names in the first row; returns the path.

        ``semicolons``: between the columns, and decimal commas, as spreadsheets of many languages read them.
        """
        numbers = zip(*(c.tolist() for c in self.columns.values()))
        rows = ([f"{v:g}" if name == "part" else repr(v + 0.0) for name, v in zip(self.columns, row)] for row in numbers)
        return write_spreadsheet(path, list(self.columns), rows, semicolons)


def profile(increment: Increment, problem: Problem, line: str) -> Profile:
    """What lies along a line of a body in an increment: ``billet.right``, in space ``blank.top at Z=0``.

    In space its points are where the plane cuts the edges of the side's faces, in the plane the nodes of the boundary.

    Raises
    ------
    PrensaError
        If there is no such line, or the body has another mesh by then.

    """
    along = line_of(line, problem)
    outline = along if isinstance(along, Outline) else along.outline
    body = increment.bodies[outline.body]
    description = problem.bodies[outline.body]
    dimension = 3 if problem.space == "solid" else 2
    mesh = mesh_of(description.mesh, problem.element_name(outline.body), problem.units.length, dimension=dimension)
    if len(mesh.points) != len(body.x):
        raise PrensaError(f"{line!r}: {outline.body!r} was remeshed, and sides of later meshes are not stored; ask before that")
    shape = undeformed(mesh)
    lines = _boundary(outline, shape) if isinstance(along, Outline) else along.lines(shape, body.x)
    return Profile(line, _columns(lines, shape, body, field_names(problem)))


def _boundary(outline: Outline, shape: Shape) -> list[Line]:
    """The nodes of a boundary of the plane, part after part in walking order."""
    edges = outline.edges(shape)
    breaks = np.flatnonzero(edges[1:, 0] != edges[:-1, 1]) + 1
    return [_nodes(part) for part in np.split(edges, breaks)]


def _nodes(edges: Index) -> Line:
    walked = edges if edges.shape[1] == 2 else edges[:, [0, 2, 1]]
    nodes = np.append(walked[:, :-1].ravel(), walked[-1, -1])
    return Line(np.stack([nodes, nodes], axis=1), np.tile([1.0, 0.0], (len(nodes), 1)), bool(nodes[0] == nodes[-1]))


def _columns(lines: list[Line], shape: Shape, body: BodyState, names: tuple[str, ...]) -> dict[str, Array]:
    x = [line.of(body.x) for line in lines]
    way = [np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))]) for p in x]
    columns: dict[str, Array] = {}
    if len(lines) > 1:
        columns["part"] = np.concatenate([np.full(len(p), k + 1.0) for k, p in enumerate(x)])
    columns["s"] = np.concatenate(way)
    axes = "xyz"[: shape.X.shape[1]]
    columns |= dict(zip(axes, np.concatenate(x).T))
    columns |= dict(zip(axes.upper(), np.concatenate([line.of(shape.X) for line in lines]).T))
    for name in names:
        try:
            values = field(body, name)
        except MeasureError:
            continue  # not known of this increment
        columns[name] = np.concatenate([line.of(values) for line in lines])
    return columns
