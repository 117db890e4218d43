"""Meshes in space: bricks or tetrahedra, whose boundaries are faces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from prensa.mesh.mesh import Mesh, MeshError
from prensa.mesh.spacing import graded
from prensa.model import meshes as model
from prensa.precision import NEGLIGIBLE, ROUND_OFF
from prensa.types import Array, Index

# corners of the six faces of a brick, seen from outside counter-clockwise
FACES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
# of a tetrahedron of ten nodes: corners, then the middles of the sides after them
TETRAHEDRON_FACES = np.array([(0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (2, 0, 3, 6, 7, 9)])
_SECTION_AXES = {"x": [2, 1, 0], "y": [0, 2, 1], "z": [0, 1, 2]}
"""Axes of a section's x and y, and of the extrusion."""
_SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]  # corners along x and y, in the order of a brick's lower nodes


@dataclass(frozen=True)
class BrickMesh(Mesh):
    """``points`` (n, 3), ``cells`` (m, 8 | 10), ``edges``: name → faces (k, 4 | 6), seen from outside counter-clockwise.

    Raises
    ------
    MeshError
        For coordinates and node numbers that are none, nodes of no brick, a brick with a node twice, faces of more than two.

    """

    def __post_init__(self) -> None:
        points, cells = self.points, self.cells
        if not np.isfinite(points).all():
            raise MeshError(
                f"node {int(np.argwhere(~np.isfinite(points))[0, 0])} has a coordinate that is not a number"
            )
        if len(cells) == 0 or cells.min() < 0 or cells.max() >= len(points):
            raise MeshError(f"bricks need nodes of the {len(points)} that there are")
        if len(unused := np.setdiff1d(np.arange(len(points)), cells)):
            raise MeshError(f"node {unused[0]} at {points[unused[0]].tolist()} belongs to no brick; remove it")
        if len(twice := np.flatnonzero((np.diff(np.sort(cells, axis=1), axis=1) == 0).any(axis=1))):
            raise MeshError(f"brick {twice[0]} names a node twice: {cells[twice[0]].tolist()}")
        _, count = np.unique(_sorted(_faces(cells)), axis=0, return_counts=True)
        if count.max() > 2:
            raise MeshError("three bricks have a face in common: they overlap")

    def _along(self, name: str) -> Index:
        return np.unique(self.edges[name])

    @cached_property
    def boundary(self) -> Index:
        """Faces (k, 4 | 6) of one brick or tetrahedron only."""
        return outside(self.cells)


def _faces(cells: Index) -> Index:
    """All faces (k, 4) of bricks (m, 8), (k, 6) of tetrahedra (m, 10)."""
    of = FACES if cells.shape[1] == 8 else TETRAHEDRON_FACES
    return np.asarray(cells[:, of].reshape(-1, of.shape[1]))


def _sorted(faces: Index) -> Index:
    """Their corners (k, 4 | 3) in ascending order."""
    return np.sort(faces[:, :3] if faces.shape[1] == 6 else faces, axis=1)


def outside(cells: Index) -> Index:
    """Faces (k, 4 | 6) that belong to one of the bricks or tetrahedra cells (m, 8 | 10) only."""
    faces = _faces(cells)
    _, first, count = np.unique(_sorted(faces), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def bricks_behind(faces: Index, cells: Index) -> Index:
    """The bricks or tetrahedra (k,) of cells (m, 8 | 10) that have faces (k, 4 | 6) of the outside."""
    all_ = _sorted(_faces(cells))
    owner = {tuple(side): i for i, side in enumerate(all_.tolist())}
    found = [owner[tuple(face)] for face in _sorted(faces).tolist()]
    return np.array(found, dtype=np.int64) // (len(all_) // len(cells))


def box(m: model.Box) -> BrickMesh:
    """Mesh of a `prensa.Box`."""
    toward = [(at,) for at in m.toward] if m.toward is not None else [()] * 3
    lines = [graded(a, a + size, n, to, m.ratio) for a, size, n, to in zip(m.origin, m.size, m.n, toward)]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([len(x) for x in lines])
    a, b, c = m.n
    corners = [number[i : a + i, j : b + j, k : c + k] for k in (0, 1) for i, j in _SQUARE]
    cells = np.stack(corners, axis=-1).reshape(-1, 8)
    names = ("left", "right"), ("bottom", "top"), ("back", "front")
    sides = {name: number.take(end, axis=axis) for axis, pair in enumerate(names) for name, end in zip(pair, (0, -1))}
    return _with_boundaries(points, cells, {name: nodes.ravel() for name, nodes in sides.items()})


def from_arrays(m: model.Bricks | model.Tetrahedra) -> BrickMesh:
    """Mesh of a `prensa.Bricks` or `prensa.Tetrahedra`."""
    named = {name: np.array(nodes, dtype=np.int64) for name, nodes in m.boundaries.items()}
    return _with_boundaries(np.array(m.points, dtype=np.float64), np.array(m.cells, dtype=np.int64), named)


def extruded(m: model.Extrusion, section: Mesh) -> BrickMesh:
    """Mesh of a `prensa.Extrusion` over the mesh of its section."""
    ends = {"base": m.start, "cap": m.start + m.length}
    along = graded(ends["base"], ends["cap"], m.n, (ends[m.grade],) if m.grade else (), m.ratio)
    axes = _SECTION_AXES[m.axis]
    points = np.zeros((len(along), len(section.points), 3))
    points[:, :, axes[:2]] = section.points
    points[:, :, axes[2]] = along[:, None]
    # The section's axes and that of the extrusion are a left-handed triple for x and y: layers are then counted downwards.
    return _swept(section, points, False, m.axis != "z")


def revolved(m: model.Revolution, section: Mesh) -> BrickMesh:
    """Mesh of a `prensa.Revolution` over the mesh of its section.

    Raises
    ------
    MeshError
        If the section touches the axis, or crosses it.

    """
    radius, height = section.points.T
    if radius.min() <= NEGLIGIBLE * radius.max():
        raise MeshError(
            f"the section comes to x = {radius.min():g}, and bricks would collapse on the axis; leave a bore, "
            "or make a cylinder of a disc that is extruded along y"
        )
    whole = m.angle >= math.tau * (1.0 - NEGLIGIBLE)
    angle = np.linspace(0.0, m.angle, m.n + 1)[: m.n + (not whole)]
    points = np.stack(
        [radius * np.cos(angle)[:, None], height + 0.0 * angle[:, None], radius * np.sin(angle)[:, None]], axis=-1
    )
    points[np.abs(points) < ROUND_OFF * radius.max()] = 0.0  # a quarter ends in the plane x = 0
    return _swept(section, points, whole, False)


def _swept(section: Mesh, points: Array, closed: bool, downwards: bool) -> BrickMesh:
    """Bricks between layers of points (k, n, 3) over a section; ``closed``: the last layer is under the first one."""
    k, n, _ = points.shape
    layer = np.arange(k if closed else k - 1)
    lower = section.cells[None] + n * layer[:, None, None]
    upper = section.cells[None] + n * ((layer + 1) % k)[:, None, None]
    pair = (upper, lower) if downwards else (lower, upper)
    cells = np.concatenate(pair, axis=2).reshape(-1, 8)
    named = {
        name: (np.unique(edges)[None] + n * np.arange(k)[:, None]).ravel() for name, edges in section.edges.items()
    }
    if not closed:
        named |= {"base": np.arange(n), "cap": np.arange(n) + n * (k - 1)}
    return _with_boundaries(points.reshape(-1, 3), cells, named)


def _with_boundaries(points: Array, cells: Index, named: dict[str, Index]) -> BrickMesh:
    """Bricks with the faces of the outside that lists of nodes have; of one node, a named point."""
    corners = {name: int(nodes[0]) for name, nodes in named.items() if len(nodes) == 1}
    plain = BrickMesh(points, cells, {}, corners)
    faces = {name: _within(plain.boundary, nodes) for name, nodes in named.items() if len(nodes) > 1}
    if bare := [name for name, some in faces.items() if not len(some)]:
        raise MeshError(f"boundary {bare[0]!r}: no face on the outside of the bricks has all its nodes in its list")
    return BrickMesh(points, cells, faces, corners)


def _within(faces: Index, nodes: Index) -> Index:
    return faces[np.isin(faces[:, :3] if faces.shape[1] == 6 else faces, nodes).all(axis=1)]
