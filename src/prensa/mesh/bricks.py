"""Meshes in space: bricks or tetrahedra, whose boundaries are faces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from prensa.mesh.brick_checks import FACES, check_bricks, check_joints, collapsed, face_keys
from prensa.mesh.mesh import Mesh, MeshError
from prensa.mesh.spacing import graded
from prensa.model import meshes as model
from prensa.types import Array, Flags, Index

SOLID_CORNERS = {4: 4, 8: 8, 10: 4}  # corners of a cell in space, by its nodes
# of a tetrahedron of ten nodes: corners, then the middles of the sides after them
TETRAHEDRON_FACES = np.array([(0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (2, 0, 3, 6, 7, 9)])
_SECTION_AXES = {"x": [2, 1, 0], "y": [0, 2, 1], "z": [0, 1, 2]}
"""Axes of a section's x and y, and of the extrusion."""
_SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]  # corners along x and y, in the order of a brick's lower nodes


@dataclass(frozen=True)
class BrickMesh(Mesh):
    """``points`` (n, 3), ``cells`` (m, 8 | 10), ``edges``: name → faces (k, 4 | 6), seen from outside counter-clockwise.

    A wedge is a brick with two edges of one face collapsed, each named twice; where a section meets its axis in a node alone, one
    edge is. Faces of three nodes have one of them twice.

    Raises
    ------
    MeshError
        For what no brick can be computed on: see `check_bricks`.

    """

    def __post_init__(self) -> None:
        check_bricks(self.points, self.cells)

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


def corner_keys(faces: Index) -> Index:
    """Rows (k, 4) that are equal for faces (k, 4 | 6) of the same corners."""
    return face_keys(faces[:, [0, 1, 2, 2]] if faces.shape[1] == 6 else faces)


def around_faces(faces: Index) -> Index:
    """Nodes of faces (k, 4 | 6) in walking order around each, those in the middle of sides between their corners."""
    return faces if faces.shape[1] == 4 else faces[:, [0, 3, 1, 4, 2, 5]]


def every_face(cells: Index) -> Index:
    """All faces (k, 4 | 6) of bricks or tetrahedra cells (m, 8 | 10), those between two of them once."""
    faces = _faces(cells)
    return faces[np.unique(corner_keys(faces), axis=0, return_index=True)[1]]


def outside(cells: Index) -> Index:
    """Faces (k, 4 | 6) of one of the bricks or tetrahedra cells (m, 8 | 10) only; those collapsed into a line are none."""
    faces = _faces(cells)
    kept = np.flatnonzero(~collapsed(faces)) if cells.shape[1] == 8 else np.arange(len(faces))
    _, first, count = np.unique(corner_keys(faces[kept]), axis=0, return_index=True, return_counts=True)
    return faces[kept[np.sort(first[count == 1])]]


def bricks_behind(faces: Index, cells: Index) -> Index:
    """The bricks or tetrahedra (k,) of cells (m, 8 | 10) that have faces (k, 4 | 6) of the outside."""
    every = corner_keys(_faces(cells)).tolist()
    owner = {tuple(side): i for i, side in enumerate(every)}
    return np.array([owner[tuple(face)] for face in corner_keys(faces).tolist()], dtype=np.int64) // (len(every) // len(cells))


def wedges(cells: Index) -> Flags:
    """Bricks (m,) that name a node twice."""
    return np.asarray((np.diff(np.sort(cells, axis=1), axis=1) == 0).any(axis=1))


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
    return with_boundaries(points, cells, {name: nodes.ravel() for name, nodes in sides.items()})


def from_arrays(m: model.Bricks | model.Tetrahedra) -> BrickMesh:
    """Mesh of a `prensa.Bricks` or `prensa.Tetrahedra`."""
    named = {name: np.array(nodes, dtype=np.int64) for name, nodes in m.boundaries.items()}
    made = with_boundaries(np.array(m.points, dtype=np.float64), np.array(m.cells, dtype=np.int64), named)
    check_joints(made.points, made.boundary)
    return made


def extruded(m: model.Extrusion, section: Mesh) -> BrickMesh:
    """Mesh of a `prensa.Extrusion` over the mesh of its section."""
    ends = {"base": m.start, "cap": m.start + m.length}
    along = graded(ends["base"], ends["cap"], m.n, (ends[m.grade],) if m.grade else (), m.ratio)
    axes = _SECTION_AXES[m.axis]
    points = np.zeros((len(along), len(section.points), 3))
    points[:, :, axes[:2]] = section.points
    points[:, :, axes[2]] = along[:, None]
    # The section's axes and that of the extrusion are a left-handed triple for x and y: layers are then counted downwards.
    return _stacked(section, points, m.axis != "z")


def _stacked(section: Mesh, points: Array, downwards: bool) -> BrickMesh:
    """Bricks between layers of points (k, n, 3) over a section."""
    k, n, _ = points.shape
    lower = section.cells[None] + n * np.arange(k - 1)[:, None, None]
    pair = (lower + n, lower) if downwards else (lower, lower + n)
    cells = np.concatenate(pair, axis=2).reshape(-1, 8)
    named = {
        name: (np.unique(edges)[None] + n * np.arange(k)[:, None]).ravel() for name, edges in section.edges.items()
    }
    named |= {"base": np.arange(n), "cap": np.arange(n) + n * (k - 1)}
    return with_boundaries(points.reshape(-1, 3), cells, named)


def with_boundaries(points: Array, cells: Index, named: dict[str, Index]) -> BrickMesh:
    """Bricks with the faces of the outside that lists of nodes have; of one node, a named point."""
    corners = {name: int(nodes[0]) for name, nodes in named.items() if len(nodes) == 1}
    plain = BrickMesh(points, cells, {}, corners)
    faces = {name: _within(plain.boundary, nodes) for name, nodes in named.items() if len(nodes) > 1}
    if bare := [name for name, some in faces.items() if not len(some)]:
        raise MeshError(f"boundary {bare[0]!r}: no face on the outside of the bricks has all its nodes in its list")
    return BrickMesh(points, cells, faces, corners)


def _within(faces: Index, nodes: Index) -> Index:
    return faces[np.isin(faces[:, :3] if faces.shape[1] == 6 else faces, nodes).all(axis=1)]
