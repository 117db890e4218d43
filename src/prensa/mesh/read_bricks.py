"""Meshes of files in space: hexahedra and wedges, or tetrahedra of ten nodes, made into one body."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from prensa.importers.deck import LABELS, Deck, FileError
from prensa.mesh.brick_checks import bent_over, check_joints, face_keys, jacobians, near, tetrahedron_jacobians
from prensa.mesh.bricks import BrickMesh, corner_keys
from prensa.mesh.mesh import CORNERS, MeshError, named
from prensa.mesh.names import listed, names_of_file
from prensa.mesh.places import SPATIAL_SIDES, faces_by_place
from prensa.mesh.read import deck_of, fitting, in_units, merged
from prensa.model import meshes as model
from prensa.precision import DRAWN
from prensa.types import Array, Index


def bricks_from_file(m: model.File, unit: str) -> BrickMesh:
    """Mesh of a `prensa.File` in space, coordinates in the length *unit* of the case.

    Raises
    ------
    MeshError
        If the file cannot be read, holds no bricks or tetrahedra, lacks the part, or the mesh cannot be computed with.

    """
    file, deck = deck_of(m, solid=True)
    try:
        chosen = _chosen(deck, m.part)
        points, cells, label = _bricks(deck, chosen)
        points = in_units(m, points, unit)
        if m.merge:
            points, kinds, label = merged(points, {cells.shape[1]: cells}, label)
            cells = next(iter(kinds.values()))
        cells = _oriented(points, cells, deck, chosen)
    except FileError as error:
        raise MeshError(f"{file}: {error}") from None
    mesh = BrickMesh(points, cells, {})
    check_joints(points, mesh.boundary)
    return SpatialNames(file, deck, m.part).of(mesh, label)


def _chosen(deck: Deck, parts: tuple[str, ...]) -> list[int]:
    """Labels of the elements of the parts, each once."""
    if not deck.solids:
        raise FileError("there is no hexahedron, wedge or tetrahedron in it; is the volume meshed and in a physical group?")
    labels = fitting(parts, deck.volumes, {**deck.volume_numbers, **deck.volumes}, deck.solids, deck.exclusive)
    seen: dict[frozenset[int], int] = {}
    for label in labels:
        seen.setdefault(frozenset(deck.solids[label][1]), label)
    chosen = list(seen.values())
    first: dict[int, int] = {}  # nodes of an element here → the first such element
    for label in chosen:
        kind, _ = deck.solids[label]
        if not kind.order:
            raise FileError(f"{deck.element(label)} is one of {kind.name}, which bodies are not made of; {kind.remedy}")
        first.setdefault(len(kind.order), label)
    if len(first) > 1:
        a, b = first.values()
        raise FileError(
            f"{deck.element(a)} is one of {deck.solids[a][0].name}, {deck.element(b)} of {deck.solids[b][0].name}: a body has "
            "elements of one kind; make a body of each part and tie them"
        )
    return chosen


def _bricks(deck: Deck, labels: list[int]) -> tuple[Array, Index, dict[int, int]]:
    """Points (n, 3), cells (m, 8 | 10) and the number of each node label."""
    rows = []
    for label in labels:
        kind, nodes = deck.solids[label]
        rows.append([nodes[i] for i in kind.order])
        if missing := [n for n in nodes if n not in deck.nodes]:
            raise FileError(f"{deck.element(label)} refers to node {missing[0] % LABELS}, which the file does not have")
    order = sorted({n for row in rows for n in row})
    number = {n: k for k, n in enumerate(order)}
    points = np.array([deck.nodes[n] for n in order])
    if not (finite := np.isfinite(points).all(axis=1)).all():
        raise FileError(f"node {order[int(np.argmin(finite))] % LABELS} has a coordinate that is not a finite number")
    return points, np.array([[number[n] for n in row] for row in rows], dtype=np.int64), number


def _oriented(points: Array, cells: Index, deck: Deck, labels: list[int]) -> Index:
    """The cells with those that are left-handed turned round: programs write them either way."""
    if cells.shape[1] == 10:
        return _oriented_tetrahedra(points, cells, deck, labels)
    det = jacobians(points[cells])
    over = np.flatnonzero((det <= 0.0).any(axis=1) & (det >= 0.0).any(axis=1))
    if len(over):
        e = int(over[0])
        raise FileError(
            f"{deck.element(labels[e])} {near(points, cells[e])} is turned over: its Jacobian is {det[e].min():.3g} at one of "
            f"its points and {det[e].max():.3g} at another ({len(over)} of {len(cells)} are); mesh it again with better angles"
        )
    left = det[:, 0] < 0.0
    return np.where(left[:, None], cells[:, [4, 5, 6, 7, 0, 1, 2, 3]], cells)


def _oriented_tetrahedra(points: Array, cells: Index, deck: Deck, labels: list[int]) -> Index:
    """The same of tetrahedra of ten nodes."""
    det = tetrahedron_jacobians(points[cells])
    left = (det < 0.0).sum(axis=1) > det.shape[1] // 2
    det[left] *= -1.0
    if len(over := np.flatnonzero((det <= 0.0).any(axis=1))):
        e = int(over[np.argmin((det[over] / np.abs(det[over]).max(axis=1, keepdims=True)).min(axis=1))])
        raise FileError(f"{deck.element(labels[e])} {near(points, cells[e])} is {bent_over(det)}")
    return np.where(left[:, None], cells[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]], cells)


@dataclass(frozen=True)
class SpatialNames:
    """How the sides of one body of a ``file`` with contents ``deck`` are called; ``parts``: those that were asked for."""

    file: str
    deck: Deck
    parts: tuple[str, ...] = ()

    def of(self, mesh: BrickMesh, label: Mapping[int, int]) -> BrickMesh:
        """The mesh with names; ``label``: label of a node in the file → its number.

        The file's own names come first. Surfaces by their numbers, and sides by place, are added where names are missing.
        """
        deck = self.deck
        faces = {name: _corners(deck, labels) for name, labels in deck.parts.items()}
        faces |= {name: [g[: _ends(g)] for g in groups] for name, groups in deck.lines.items()}
        found = _on_outside(faces, mesh.boundary, label)
        corners: dict[str, int] = {}
        for name, nodes in deck.points.items():
            some = np.array(sorted({label[n] for n in nodes if n in label}), dtype=np.int64)
            corner = mesh.boundary[:, :3] if mesh.boundary.shape[1] == 6 else mesh.boundary
            inside = mesh.boundary[np.isin(corner, some).all(axis=1)]
            if len(some) == 1:
                corners[name] = int(some[0])
            elif name not in found and len(inside):
                found[name] = inside
        notes = self._own(faces, [*found, *corners])
        if not deck.parts and deck.surfaces:
            numbered = _on_outside({name: _corners(deck, e) for name, e in deck.surfaces.items()}, mesh.boundary, label)
            found |= {name: f for name, f in numbered.items() if name not in found}
            if numbered:
                notes.append(f"its surfaces by their numbers: {_where(mesh.points, numbered)}")
        taken = {name.casefold() for name in (*faces, *deck.points)}
        if taken.isdisjoint(SPATIAL_SIDES):
            sides = faces_by_place(mesh.points, mesh.boundary)
            found |= sides
            notes += _placed(mesh.points, sides)
        out = named(mesh, found, {k: v for k, v in corners.items() if k not in found}, tuple(notes))
        assert isinstance(out, BrickMesh)
        return out

    def _own(self, faces: Mapping[str, object], found: list[str]) -> list[str]:
        """What there is to say of the names in the file."""
        notes = names_of_file(self.file, self.deck, faces, found, "outside")
        if not self.parts and not self.deck.volumes and len(self.deck.volume_numbers) > 1:
            notes.append(f"one body of all its volumes; 'part' takes some of {listed(self.deck.volume_numbers)}")
        return notes


def _ends(nodes: tuple[int, ...]) -> int:
    """How many of the nodes of a face are its corners."""
    return CORNERS.get(len(nodes), 0)


def _corners(deck: Deck, labels: Iterable[int]) -> list[tuple[int, ...]]:
    """The corners of triangles and quadrilaterals."""
    return [cell[: _ends(cell)] for label in labels if (cell := deck.cells.get(label))]


def _on_outside(
    groups: Mapping[str, Iterable[tuple[int, ...]]], boundary: Index, label: Mapping[int, int]
) -> dict[str, Index]:
    """Faces (k, 4 | 6) of the outside that are in groups of three or four node labels each."""
    number = {tuple(key): k for k, key in enumerate(corner_keys(boundary).tolist())}
    out = {}
    for name, faces in groups.items():
        rows = [[label[n] for n in (*face, face[-1])[:4]] for face in faces if len(face) > 2 and all(n in label for n in face)]
        keys = face_keys(np.array(rows, dtype=np.int64).reshape(-1, 4)).tolist()
        if some := sorted({number[tuple(key)] for key in keys if tuple(key) in number}):
            out[name] = boundary[some]
    return out


def _where(points: Array, sides: Mapping[str, Index]) -> str:
    """Names of sides, each with the range of coordinates that it covers: one number where it lies across an axis."""
    said, size = [], float(np.ptp(points, axis=0).max())
    for name, faces in sides.items():
        x = points[faces].reshape(-1, 3)
        low, high = (np.where(np.abs(end) > DRAWN * size, end, 0.0) for end in (x.min(axis=0), x.max(axis=0)))
        ranges = (f"{c} {a:.5g}" if b - a <= DRAWN * size else f"{c} {a:.5g} … {b:.5g}" for c, a, b in zip("xyz", low, high))
        said.append(f"{name!r} ({', '.join(ranges)})")
    return ", ".join(said)


def _placed(points: Array, sides: Mapping[str, Index]) -> list[str]:
    """What was taken for the sides by place, and which there are not."""
    notes = [f"found by place: {_where(points, sides)}"] if sides else []
    if missing := [name for name in SPATIAL_SIDES if name not in sides]:
        notes.append(f"{listed(missing)} could not be found by place: no side between edges lies or looks that way alone")
    return notes
