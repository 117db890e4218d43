"""Meshes of files: what the file says, made into the mesh of one body."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from prensa.importers import abaqus, gmsh, vtk
from prensa.importers.deck import LABELS, Deck, FileError, text_of
from prensa.mesh.convert import Draft, draft_of, mesh_from_draft, split
from prensa.mesh.mesh import CELL_NAMES, CORNERS, Mesh, MeshError, coincident, named, oriented
from prensa.mesh.names import SideNames
from prensa.model import meshes as model
from prensa.model.names import suggest
from prensa.model.units import factor
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.types import Array, Index


def from_file(m: model.File, nodes: int, unit: str) -> Mesh:
    """Mesh of a `prensa.File` in cells of *nodes* nodes, coordinates in the length *unit* of the case.

    Raises
    ------
    MeshError
        If the file cannot be read, holds no plane mesh, lacks the part, or the mesh is one that cannot be computed with.

    """
    file, deck = deck_of(m)
    try:
        chosen = _chosen(deck, m.part)
        points, kinds, label = _cells(deck, chosen)
    except FileError as error:
        raise MeshError(f"{file}: {error}") from None
    points = in_units(m, points, unit)
    if m.merge:
        points, kinds, label = merged(points, kinds, label)
    # Programs write cells either way round.
    kinds = {k: oriented(points, c) for k, c in kinds.items()}
    names = SideNames(file, deck, chosen, m.part)
    if len(kinds) == 1:
        cells = next(iter(kinds.values()))
        read = names.of(points, cells, label)
        if cells.shape[1] == nodes:
            return read
        draft = draft_of(points, cells, read.edges, read.corners)
    else:
        draft, read = _of_two_kinds(names, points, kinds, label, nodes)
    mesh = mesh_from_draft(draft, nodes)
    return named(mesh, mesh.edges, mesh.corners, read.notes)


def deck_of(m: model.File, solid: bool = False) -> tuple[str, Deck]:
    """Name and contents of the file of a `prensa.File`; ``solid``: of bodies in space.

    Raises
    ------
    MeshError
        If the file cannot be read.

    """
    path = Path(m.path)
    try:
        if path.suffix.lower() in (".vtk", ".vtu"):
            return path.name, vtk.read(path, solid)
        # Readers of our own: meshio loses surfaces and sets, mixes parts, and allocates what a wrong file asks for.
        return path.name, (gmsh if path.suffix.lower() == ".msh" else abaqus).read(text_of(path), solid)
    except (FileError, OSError) as error:
        raise MeshError(f"{path.name}: {error}") from None


def in_units(m: model.File, points: Array, unit: str) -> Array:
    """Coordinates of the file in the length *unit* of the case."""
    return points if m.unit is None else points * factor(f"1 {m.unit}", unit, "N", (0, 1))


def _chosen(deck: Deck, parts: tuple[str, ...]) -> list[int]:
    """Labels of the cells of the parts, each once."""
    if not deck.cells:
        raise FileError("there is no triangle or quadrilateral in it; is the surface meshed and in a physical group?")
    labels = fitting(parts, deck.parts, {**deck.surfaces, **deck.parts}, deck.cells, deck.exclusive)
    # an element in two groups is written twice in the older format of gmsh
    seen: dict[frozenset[int], int] = {}
    for label in labels:
        if label in deck.cells:
            seen.setdefault(frozenset(deck.cells[label]), label)
    return list(seen.values())


def fitting(
    parts: tuple[str, ...], bodies: Mapping[str, list[int]], known: Mapping[str, list[int]], cells: Iterable[int],
    exclusive: bool,
) -> list[int]:  # fmt: skip
    """Labels of the cells of the ``parts`` among those ``known``, of the only body, or of all ``cells``.

    Raises
    ------
    FileError
        If there is no such part, or one has to be named.

    """
    for name in parts:
        if name not in known:
            raise FileError(f"there is no part {name!r}{suggest(name, known)}")
    if not parts and exclusive and len(bodies) > 1:
        raise FileError(f"it has several parts; say with 'part' which one the body is: {', '.join(map(repr, bodies))}")
    if parts:
        return [e for name in parts for e in known[name]]
    return next(iter(bodies.values())) if exclusive and bodies else list(cells)


def _cells(deck: Deck, labels: list[int]) -> tuple[Array, dict[int, Index], dict[int, int]]:
    """Points (n, 2) that cells use, cells by their number of nodes, and the number of each node label."""
    used: dict[int, None] = {}
    for label in labels:
        for n in deck.cells[label]:
            if n not in deck.nodes:
                raise FileError(f"element {label % LABELS} refers to node {n % LABELS}, which the file does not have")
            used[n] = None
    order = sorted(used)
    number = {n: k for k, n in enumerate(order)}
    xyz = np.array([deck.nodes[n] for n in order])
    if not np.isfinite(xyz).all():
        k = int(np.argmax(~np.isfinite(xyz).all(axis=1)))
        raise FileError(f"node {order[k] % LABELS} has a coordinate that is not a finite number")
    if np.ptp(xyz[:, 2]) > NEGLIGIBLE * np.ptp(xyz, axis=0).max():
        raise FileError("its elements do not lie in the plane of x and y (their z differs); draw the section in x, y")
    by_kind: dict[int, list[list[int]]] = {}
    for label in labels:
        cell = deck.cells[label]
        by_kind.setdefault(len(cell), []).append([number[n] for n in cell])
    return xyz[:, :2].copy(), {k: np.array(c, dtype=np.int64) for k, c in by_kind.items()}, number


def merged(
    points: Array, kinds: dict[int, Index], label: dict[int, int]
) -> tuple[Array, dict[int, Index], dict[int, int]]:
    """The same with nodes at one place made one."""
    n = len(points)
    pairs = coincident(points, DRAWN * float(np.ptp(points, axis=0).max()))
    if not len(pairs[0]):
        return points, kinds, label
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs[0])), pairs), (n, n))
    _, group = connected_components(graph, directed=False)
    _, first, number = np.unique(group, return_index=True, return_inverse=True)
    kinds = {k: number[c] for k, c in kinds.items()}
    return points[first], kinds, {name: int(number[k]) for name, k in label.items()}


def _of_two_kinds(
    names: SideNames, points: Array, kinds: dict[int, Index], label: dict[int, int], nodes: int
) -> tuple[Draft, Mesh]:
    """Triangles of a mesh of triangles and quadrilaterals; other elements cannot be had from it.

    Raises
    ------
    MeshError
        Unless both kinds are linear or both quadratic and triangles are wanted.

    """
    found = " and ".join(f"{len(c)} {CELL_NAMES[k]}" for k, c in sorted(kinds.items()))
    if CORNERS[nodes] == 4:
        raise MeshError(
            f"{names.file}: a body has elements of one kind, the file has {found}; use element 't6' (quadrilaterals are split), "
            "mesh it with quadrilaterals only, or make one body of each part and tie them"
        )
    if set(kinds) not in ({3, 4}, {6, 8}):
        raise MeshError(f"{names.file}: a body has elements of one order, the file has {found}; mesh it with one order")
    midside: dict[tuple[int, int], Array] = {}
    triangles = []
    for c in kinds.values():
        ends = c[:, : CORNERS[c.shape[1]]]
        triangles.append(split(points, ends) if ends.shape[1] == 4 else ends)
        for i in range(ends.shape[1] if c.shape[1] > 4 else 0):
            three = np.stack([ends[:, i], np.roll(ends, -1, axis=1)[:, i], c[:, ends.shape[1] + i]], axis=1)
            midside |= {(min(a, b), max(a, b)): points[m] for a, b, m in three.tolist()}
    cells = np.concatenate(triangles)
    used = np.unique(cells)
    number = np.full(len(points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    kept = {n: int(number[k]) for n, k in label.items() if number[k] >= 0}
    read = names.of(points[used], number[cells], kept)
    midside = {(int(number[a]), int(number[b])): x for (a, b), x in midside.items()}
    return Draft(points[used], number[cells], read.edges, read.corners, {}, midside), read
