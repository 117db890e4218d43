"""A mesh: node coordinates, cells of one kind (T3, Q4, T6, Q8), named boundaries and named points.

Cells list their corners counter-clockwise and then, in quadratic ones, the mid-side nodes in the order of the sides
(corner 0 to 1 first): the order of VTK, gmsh and Abaqus.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from prensa.errors import PrensaError
from prensa.model.fields import LARGEST
from prensa.model.names import meant, suggest
from prensa.precision import DRAWN
from prensa.types import Array, Flags, Index

CORNERS = {3: 3, 4: 4, 6: 3, 8: 4}  # corners of a cell, by its nodes
CELL_NAMES = {3: "T3", 4: "Q4", 6: "T6", 8: "Q8"}
POINTS_AT_ONCE = 2**20  # candidate pairs that a search among points, or points and sides, holds at once: some tens of megabytes


class MeshError(PrensaError):
    """A mesh that cannot be computed with; the message names the element, node and coordinates."""


@dataclass(frozen=True)
class Mesh:
    """``points`` (n, 2), ``cells`` (m, 3|4|6|8), ``edges`` name → (k, 2|3), body on the left.

    A row of ``edges`` is the two ends and, in quadratic meshes, the node between them. ``corners`` names single nodes. ``notes``:
    where the names come from, for messages.

    Raises
    ------
    MeshError
        For what no element can be computed on: see `check`.

    """

    points: Array
    cells: Index
    edges: Mapping[str, Index]
    corners: Mapping[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check(self)

    def nodes(self, name: str, written: str = "") -> Index:
        """Nodes of a boundary in order along it, or the single node of a named point; unknown names raise MeshError.

        *written*: how the name stands in the description, body included, for the error.
        """
        if name in self.corners:
            return np.array([self.corners[name]])
        if name not in self.edges:
            known = [*self.edges, *self.corners]
            near = meant(name, known) if self.notes else None
            meaning = f"; did you mean {near!r}?" if near else "" if self.notes else suggest(name, known)
            where = "; ".join(("", *self.notes))
            raise MeshError(f"{f'{written!r}: ' * bool(written)}unknown boundary {name!r}{meaning}{where}")
        if name not in self._walked:
            self._walked[name] = self._along(name)
        return self._walked[name].copy()

    def _along(self, name: str) -> Index:
        return ordered_nodes(self.edges[name])

    @cached_property
    def _walked(self) -> dict[str, Index]:
        """Nodes of boundaries in order, as they are asked for: at every step and by every check of it."""
        return {}

    @cached_property
    def extent(self) -> Array:
        """Lengths (2,) of the box around it, along the axes."""
        return np.array([np.ptp(self.points[:, k]) for k in range(self.points.shape[1])])

    @cached_property
    def boundary(self) -> Index:
        """`boundary_edges` of its cells."""
        return boundary_edges(self.cells)


def named(mesh: Mesh, edges: Mapping[str, Index], corners: Mapping[str, int], notes: tuple[str, ...]) -> Mesh:
    """The mesh with other names, and notes on where they come from; it was checked already."""
    out = copy(mesh)
    for key, value in (("edges", edges), ("corners", corners), ("notes", notes)):
        object.__setattr__(out, key, value)
    out.__dict__.pop("_walked", None)
    return out


def displaced(mesh: Mesh, points: Array) -> Mesh:
    """The mesh with its nodes elsewhere; a deformed shape is not checked as a new mesh is."""
    moved = copy(mesh)
    object.__setattr__(moved, "points", points)
    # What was cached of numbers of nodes still holds, what was of their places does not.
    moved.__dict__.pop("extent", None)
    return moved


def meshed_like(
    mesh: Mesh | None, points: Array, cells: Index, edges: Mapping[str, Index], corners: Mapping[str, int]
) -> Mesh:  # fmt: skip
    """The mesh of given arrays; not checked where ``mesh``, which was, joins the same nodes next to these."""
    if mesh is None or mesh.points.shape != points.shape or not np.array_equal(mesh.cells, cells) or mesh.corners != corners:
        return Mesh(points, cells, edges, corners)
    same = mesh.edges.keys() == edges.keys() and all(np.array_equal(mesh.edges[name], e) for name, e in edges.items())
    return displaced(mesh, points) if same else Mesh(points, cells, edges, corners)


def renumbered(mesh: Mesh, cells: Index) -> Mesh:
    """The mesh with the nodes of each cell counted from another of its corners."""
    turned = copy(mesh)
    object.__setattr__(turned, "cells", cells)
    turned.__dict__.pop("boundary", None)  # it begins elsewhere
    return turned


def corner_cells(cells: Index) -> Index:
    """The corners (m, 3|4) of cells."""
    return cells[:, : CORNERS[cells.shape[1]]]


def sides(cells: Index) -> Index:
    """Sides (m, s, 2|3) of cells, oriented with the cell on the left: the ends, then the node between them if any."""
    c = CORNERS[cells.shape[1]]
    columns = [[i, (i + 1) % c] + ([c + i] if cells.shape[1] > c else []) for i in range(c)]
    return cells[:, columns]


def segments(edges: Index) -> Index:
    """Straight pieces (k, 2) or (2 k, 2) of edges (k, 2|3): those of quadratic ones meet at the node between the ends."""
    if edges.shape[1] == 2:
        return edges
    return np.stack([edges[:, [0, 2]], edges[:, [2, 1]]], axis=1).reshape(-1, 2)


def ordered_nodes(edges: Index) -> Index:
    """Distinct nodes of oriented edges (k, 2|3), chain after chain, each in walking order."""
    pieces = segments(edges)
    follower = dict(pieces.tolist())
    ends = set(follower.values())
    # A closed chain has no first node, and begins anywhere.
    starts = [a for a in follower if a not in ends] or [pieces[0, 0]]
    order: list[int] = []
    seen: set[int] = set()
    for start in [*starts, *follower]:
        node: int | None = int(start)
        while node is not None and node not in seen:
            seen.add(node)
            order.append(node)
            node = follower.get(node)
    return np.array(order, dtype=np.int64)


def keys(pairs: Index, n: int) -> Index:
    """One number for each undirected pair (…, 2) of node numbers below n."""
    return np.asarray(pairs.min(axis=-1) * np.int64(n) + pairs.max(axis=-1))


def boundary_edges(cells: Index) -> Index:
    """Sides (k, 2|3) that belong to one cell only, body on the left."""
    edges = np.swapaxes(sides(cells), 0, 1).reshape(-1, 2 if cells.shape[1] < 6 else 3)
    _, first, count = np.unique(keys(edges[:, :2], int(cells.max()) + 1), return_index=True, return_counts=True)
    return edges[np.sort(first[count == 1])]


def beyond_corners(x: Array, edges: Index, touching: Flags) -> Flags:
    """Whether an edge (m, 2), of nodes at x (n, 2) of which some touch, leaves what the others lie on at a corner (m,).

    It has one end that touches, beyond which the outline goes on in an edge that touches with both, turned by more than 60°: the
    side of a block under a punch. Edges that meet along one surface turn by less.
    """
    a, b = edges.T
    ends = touching[edges].sum(axis=1)
    t = x[b] - x[a]
    t = t / np.hypot(*t.T)[:, None]
    lies = np.full((len(x), 2), np.nan)  # directions of the edge that touches with both ends, at each of its ends
    lies[edges[ends == 2]] = t[ends == 2][:, None]
    at = np.where(touching[a], a, b)
    return np.asarray((ends == 1) & ((t * lies[at]).sum(axis=1) < 0.5))


def edges_between(edges: Index, nodes: Index) -> Index:
    """The edges both ends of which are in *nodes*."""
    return edges[np.isin(edges[:, :2], nodes).all(axis=1)]


def areas(points: Array, cells: Index) -> Array:
    """Signed areas (m,) of the polygons of the corners, positive counter-clockwise."""
    corners = corner_cells(cells)
    x, y = points[:, 0][corners], points[:, 1][corners]
    return np.asarray(0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))


def oriented(points: Array, cells: Index) -> Index:
    """The cells with those that go clockwise turned round."""
    c = CORNERS[cells.shape[1]]
    turned = [0, *range(c - 1, 0, -1)]
    turned += [c + k for k in range(c - 1, -1, -1)] if cells.shape[1] > c else []
    out = cells.copy()
    wrong = areas(points, cells) < 0
    out[wrong] = cells[wrong][:, turned]
    return out


# --------------------------------------------------------------------------------------------------------------- checks
def check(mesh: Mesh) -> None:
    """Raise MeshError for what no element can be computed on.

    That is: coordinates that are no numbers; cells that name nodes that do not exist or one node twice, that go
    clockwise or have no area; cells that overlap; nodes of no cell; nodes at one place; nodes in the middle of another
    cell's side.
    """
    points, cells = mesh.points, mesh.cells
    if not np.isfinite(points).all():
        raise MeshError(f"node {int(np.argwhere(~np.isfinite(points))[0, 0])} has a coordinate that is not a number")
    far = np.abs(points).max(axis=1, initial=0.0)
    if (far > LARGEST).any():
        n = int(np.argmax(far))
        raise MeshError(f"node {n} at {points[n].tolist()} is farther out than any length that can be computed with")
    if len(cells) == 0:
        raise MeshError("the mesh has no element")
    if cells.shape[1] not in CORNERS:
        raise MeshError(f"elements of {cells.shape[1]} nodes; T3, Q4, T6 and Q8 are known")
    if cells.min() < 0 or cells.max() >= len(points):
        e = int(np.argwhere((cells < 0) | (cells >= len(points)))[0, 0])
        raise MeshError(f"element {e} refers to a node outside 0 … {len(points) - 1}: {cells[e].tolist()}")
    _check_cells(points, cells)
    unused = np.flatnonzero(np.bincount(cells.ravel(), minlength=len(points)) == 0)
    if len(unused):
        raise MeshError(f"node {unused[0]} at {points[unused[0]].tolist()} belongs to no element; remove it")
    _check_open_joints(points, boundary_edges(cells))


def _where(points: Array, cell: Index) -> str:
    x, y = points[cell].mean(axis=0)
    return f"near ({x:g}, {y:g})"


def _check_cells(points: Array, cells: Index) -> None:
    twice = (np.diff(np.sort(cells, axis=1), axis=1) == 0).any(axis=1)
    if twice.any():
        e = int(np.argmax(twice))
        raise MeshError(
            f"element {e} {_where(points, cells[e])} names a node twice: {cells[e].tolist()}; write it as a triangle"
        )
    area = areas(points, cells)
    if (area <= 0).any():
        e = int(np.argmin(area))
        raise MeshError(
            f"element {e} {_where(points, cells[e])} has area {area[e]:g}: "
            "its nodes must go counter-clockwise and span an area"
        )
    edges = sides(cells)[..., :2]
    directed = edges[..., 0] * np.int64(len(points)) + edges[..., 1]
    order = np.argsort(directed, axis=None, kind="stable")
    # Neighbours walk their common side in opposite directions. Twice the same direction is two elements on one side of it.
    same = np.flatnonzero(np.diff(directed.ravel()[order]) == 0)
    if len(same):
        e, f = sorted(int(k) // edges.shape[1] for k in order[same[0] : same[0] + 2])
        raise MeshError(
            f"elements {e} and {f} {_where(points, cells[e])} lie on the same side of a common edge: they overlap"
        )


def _check_open_joints(points: Array, outline: Index) -> None:
    """Nodes of the outline at one place, and nodes in the middle of a side: the mesh is open there."""
    nodes = np.unique(outline)
    close = check_apart(points, nodes)
    pieces = segments(outline)
    start, along = points[pieces[:, 0]], points[pieces[:, 1]] - points[pieces[:, 0]]
    length = np.hypot(along[:, 0], along[:, 1])
    # Circles about the sides hold all nodes that may lie on them; a little smaller, they leave out the ends.
    i, j = within(points[nodes], start + 0.5 * along, 0.5 * length * (1 - DRAWN))
    r = points[nodes[j]] - start[i]
    inside = np.flatnonzero(np.abs(along[i, 0] * r[:, 1] - along[i, 1] * r[:, 0]) <= close * length[i])
    if len(inside):
        n, (a, b) = nodes[j[inside[0]]], pieces[i[inside[0]]]
        raise MeshError(
            f"node {n} at {written(points[n])} hangs in the middle of the side between nodes "
            f"{a} and {b}; split that element, or make two bodies and tie them"
        )


# ----------------------------------------------------------------------------------------------------------- neighbours
def check_apart(points: Array, nodes: Index) -> float:
    """Raise MeshError for two nodes of an outline at one place: the mesh is open there; return the distance that is none."""
    close = DRAWN * float(np.ptp(points, axis=0).max())
    i, j = coincident(points[nodes], close)
    if len(i):
        a, b = nodes[i[0]], nodes[j[0]]
        raise MeshError(
            f"nodes {a} and {b} are at the same place, {written(points[a])}, and the mesh is open between their elements; "
            "merge them ('merge: true' of a file), or make two bodies and tie them"
        )
    return close


def written(x: Array) -> str:
    """A place (d,) in a message."""
    return f"({', '.join(f'{c:g}' for c in x)})"


def coincident(points: Array, distance: float) -> tuple[Index, Index]:
    """Pairs i < j of points (n, d) no farther apart than *distance*, in order of i."""
    i, j = within(points, points, np.full(len(points), distance))
    return i[i < j], j[i < j]


def within(points: Array, centres: Array, radii: Array) -> tuple[Index, Index]:
    """Pairs (i, j), in order of i, with points (n, d) [j] in the circle round centres (k, d) [i] with radii (k,) [i]; k > 0.

    d is 2, or 3 for spheres. Looked for in the strip of each circle across a direction that is oblique to the lines of most
    meshes. A tree would look at fewer points, but SciPy's takes longer to import than most meshes take to check.
    """
    direction = np.array([np.cos(1.0), np.sin(1.0), 0.5 * np.sin(2.0)][: points.shape[1]])
    direction /= np.linalg.norm(direction) if len(direction) > 2 else 1.0
    place = points @ direction
    order = np.argsort(place, kind="stable")
    middle = centres @ direction
    first = np.searchsorted(place[order], middle - radii)
    many = np.searchsorted(place[order], middle + radii, side="right") - first
    ends = np.cumsum(many)
    found = []
    # some centres at a time: the strips of all of them may hold more points than there is memory
    cuts = np.unique([0, *np.searchsorted(ends, np.arange(POINTS_AT_ONCE, many.sum(), POINTS_AT_ONCE)), len(centres)])
    for a, b in pairwise(cuts):
        i = np.repeat(np.arange(a, b), many[a:b])
        j = order[np.arange(len(i)) + np.repeat(first[a:b] - (ends[a:b] - many[a:b] - ends[a] + many[a]), many[a:b])]
        d = points[j] - centres[i]
        near = (np.hypot(d[:, 0], d[:, 1]) if d.shape[1] == 2 else np.linalg.norm(d, axis=1)) <= radii[i]
        found.append((i[near], j[near]))
    i, j = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return i, j
