"""Loads of a tool in space over its surface: largest pressure and shear, sliding and wear of a whole run, in the tool's own axes.

The surface that something pressed on is traced (`prensa.output.tool_surfaces`). Pressure, shear and slip of each increment, known
at the nodes of the sides in contact, are taken between these by the faces' shape functions, at places closer to one another than
the points of the tool's surface; a point of that has the values of the place that is nearest to it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from prensa.dies.loads import lasting
from prensa.dies.wear import rated
from prensa.errors import PrensaError, take_path
from prensa.friction.wear.archard import Archard
from prensa.friction.wear_law import WearLaw
from prensa.mesh.bricks import around_faces
from prensa.mesh.faces import multilinear
from prensa.mesh.generate import mesh_of
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.output.files import replacing
from prensa.output.tool_surfaces import TRACED, motion, surface
from prensa.result.increment import ContactState, Increment, ToolState
from prensa.types import Array, Index


@dataclass(frozen=True)
class ToolMap:
    """What a tool bore in a run, at m points of its surface.

    ``x`` (m, 3) in the tool's frame and its ``triangles`` (t, 3); ``pressure``, ``shear`` (m,) the largest of all increments;
    ``sliding`` (m,) way (length) that the bodies slid over each point while they pressed; ``wear`` (m,) by the law of the
    tool, a depth, or ∫ p ds of relative wear; ``work``: the worn volume of all nodes, or ∫ N ds.
    """

    tool: str
    x: Array
    triangles: Index
    pressure: Array
    shear: Array
    sliding: Array
    wear: Array
    work: float

    @property
    def fields(self) -> dict[str, Array]:
        """What is known at the points, by name."""
        return {"pressure": self.pressure, "shear": self.shear, "sliding": self.sliding, "wear": self.wear}

    @property
    def summary(self) -> dict[str, Any]:
        """Largest values, each with its place in the tool's frame, and the work."""
        places = {f"{name}_at": self.x[int(np.argmax(values))].tolist() for name, values in self.fields.items()}
        return {name: float(values.max()) for name, values in self.fields.items()} | places | {"work": self.work}

    def save(self, path: str | Path) -> Path:
        """Write the map: a surface for ParaView where the name ends with ``.vtu``, else a table (CSV); returns the path."""
        path = take_path("save", path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            if path.suffix == ".vtu":
                import meshio

                made = meshio.Mesh(self.x, [("triangle", self.triangles)], point_data=self.fields)
                made.write(temporary, file_format="vtu", binary=True, compression="zlib")
            else:
                columns, head = np.column_stack([self.x, *self.fields.values()]), ",".join(("x", "y", "z", *self.fields))
                np.savetxt(temporary, columns, fmt="%.9g", delimiter=",", header=head, comments="")
        return path


class _Pressed(NamedTuple):
    """Faces that press in an increment: corners (f, 4, 3) in the tool's frame; pressure, shear, slip, wear (4, f, 4); volume."""

    x: Array
    values: Array
    work: float


def tool_map(increments: Iterable[Increment], problem: Problem, tool: str, law: WearLaw | None = None) -> ToolMap:
    """Collect the loads of a tool in space from the increments of a run, from `solve` or read back from its folder.

    Wear is by a ``law``, without one ∫ p ds.

    Raises
    ------
    PrensaError
        For a tool that is unknown, of a section, or that nothing has touched.

    """
    if tool not in problem.tools:
        raise PrensaError(f"unknown tool {tool!r}{suggest(tool, problem.tools)}")
    if problem.space != "solid":
        raise PrensaError("tools of sections have loads along their outlines: take 'loads'")
    faces, by = _Faces(problem), Archard() if law is None else law
    pressed: list[_Pressed] = []
    state = None
    for increment, seconds in lasting(increments):
        state = increment.tools[tool]
        touching = [c for c in increment.contacts.values() if c.tool == tool and c.pressure.any()]
        if touching:
            pressed.append(_joined([_pressed(faces.of(c), c, state, seconds, by) for c in touching]))
    if not pressed or state is None:
        raise PrensaError(f"nothing has pressed on the tool {tool!r} in this run; name one that something presses on")
    corners = np.concatenate([p.x.reshape(-1, 3) for p in pressed])
    margin = float(np.ptp(pressed[0].x, axis=1).max())
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    made = surface(problem.tools[tool], state, low, high, beyond=0.0)
    pressure, shear, sliding, wear = _collected(pressed, made.points, margin, 0.5 * float((high - low).max()) / TRACED)
    return ToolMap(tool, made.points, made.triangles, pressure, shear, sliding, wear, sum(p.work for p in pressed))


class _Faces:
    """Faces of the sides of the bodies of a problem, as nodes in the order of each contact."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._known: dict[tuple[str, str], Index] = {}

    def of(self, contact: ContactState) -> Index:
        """Faces (f, 4) as rows of the contact, (f, 6) of tetrahedra."""
        key = contact.body, contact.surface
        if key not in self._known:
            p, body = self._problem, self._problem.bodies[contact.body]
            mesh = mesh_of(body.mesh, p.element_name(contact.body), p.units.length, dimension=3)
            sides = [name.removeprefix(f"{contact.body}.") for name in contact.surface.split("+")]
            faces = np.unique(np.concatenate([mesh.edges[side] for side in sides]), axis=0)
            row = np.full(len(mesh.points), -1, dtype=np.int64)
            row[contact.node] = np.arange(len(contact.node))
            self._known[key] = row[faces]
        return self._known[key]


def _pressed(faces: Index, c: ContactState, state: ToolState, seconds: float, law: WearLaw) -> _Pressed:
    turn, move = motion(state)
    speed = np.zeros(len(c.node)) if c.speed is None else np.nan_to_num(c.speed)
    worn = rated(law, np.maximum(c.pressure, 0.0), np.abs(speed)) * seconds
    values = np.stack([c.pressure, np.abs(c.shear), speed * seconds, worn])
    if faces.shape[1] == 6:  # contact is at the middles of the sides alone, which the corners take over
        middles = around_faces(faces)[:, 1::2]
        faces = np.concatenate([middles, middles[:, :1]], axis=1)
    near = faces[(c.pressure[faces] > 0.0).any(axis=1)]
    return _Pressed(((c.x - move) @ turn)[near], values[:, near], float(worn @ c.weight))


def _joined(parts: list[_Pressed]) -> _Pressed:
    x, values = np.concatenate([p.x for p in parts]), np.concatenate([p.values for p in parts], axis=1)
    return _Pressed(x, values, sum(p.work for p in parts))


def _collected(pressed: list[_Pressed], points: Array, margin: float, apart: float) -> Array:
    """Largest pressure and shear, sliding and wear (4, m) at points (m, 3): places ``apart`` on faces as long as ``margin``."""
    from scipy.spatial import cKDTree

    count = max(int(np.ceil(margin / apart)), 1)
    middle = (np.arange(count) + 0.5) * 2.0 / count - 1.0
    N = multilinear(np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2), 4)[0]
    found = np.zeros((4, len(points)))
    for p in pressed:
        places = np.einsum("qa,faj->fqj", N, p.x).reshape(-1, 3)
        values = np.einsum("qa,vfa->vfq", N, p.values).reshape(4, -1)
        off, nearest = cKDTree(places).query(points, distance_upper_bound=margin / count)
        near = np.isfinite(off)
        pressure, shear, slip, worn = values[:, nearest[near]]
        found[:2, near] = np.maximum(found[:2, near], [pressure, shear])
        found[2:, near] += np.where(pressure > 0.0, [slip, worn], 0.0)
    return found
