"""From one kind of cells to another: quadrilaterals split into triangles, mid-side nodes added or dropped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from prensa.mesh.mesh import CELL_NAMES, CORNERS, Mesh, MeshError, corner_cells, keys, meshed_like, sides
from prensa.precision import NEGLIGIBLE
from prensa.types import Array, Index

# ends a, b (k, 2) of edges of a curved boundary → points (k, 2) half way between them along the boundary
Midpoints = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Draft:
    """A mesh before it is decided which cells it has: linear cells, edges (k, 2), and how its boundaries curve.

    ``midside`` (undirected pair of nodes → place) are mid-side nodes that are known already.
    """

    points: Array
    cells: Index
    edges: Mapping[str, Index]
    corners: Mapping[str, int] = field(default_factory=dict)
    curves: Mapping[str, Midpoints] = field(default_factory=dict)
    midside: Mapping[tuple[int, int], Array] = field(default_factory=dict)


def nodes_of(element: str | int) -> int:
    """Nodes per cell, given as such or by an element's name: 3 for ``t3…``, 4 for ``q4…``, 6 for ``t6…``, 8 for ``q8…``."""
    return element if isinstance(element, int) else int(element[1])


def mesh_from_draft(draft: Draft, nodes: int, beside: Mesh | None = None) -> Mesh:
    """The mesh of a draft in cells of 3, 4, 6 or 8 nodes; ``beside``: one with nodes next to these, see `meshed_like`.

    Raises
    ------
    MeshError
        If quadrilaterals are asked of triangles, or the draft is no mesh.

    """
    points, cells = draft.points, draft.cells
    if CORNERS[nodes] == 4 and cells.shape[1] == 3:
        raise MeshError(
            f"the mesh is made of triangles and the element is {CELL_NAMES[nodes]}; use element 't6', or mesh with quadrilaterals"
        )
    if CORNERS[nodes] == 3 and cells.shape[1] == 4:
        cells = split(points, cells)
    if nodes == CORNERS[nodes]:
        return meshed_like(beside, points, cells, draft.edges, draft.corners)
    return _quadratic(draft, cells)


def split(points: Array, cells: Index) -> Index:
    """Triangles (2 m, 3) of quadrilaterals (m, 4): each cut along its shorter diagonal, but always into a free corner.

    A corner of the mesh that belongs to one quadrilateral only would otherwise make a triangle all of whose nodes are on
    the boundary, which supports on both sides would hold completely.
    """
    x = points[cells]
    first = np.linalg.norm(x[:, 2] - x[:, 0], axis=1)
    second = np.linalg.norm(x[:, 3] - x[:, 1], axis=1)
    along = first <= second * (1 + NEGLIGIBLE)
    alone = np.bincount(cells.ravel(), minlength=len(points))[cells] == 1
    into_first, into_second = alone[:, [0, 2]].any(axis=1), alone[:, [1, 3]].any(axis=1)
    # A triangle with all nodes on supports could not deform, and the corner would be too stiff, whatever the diagonals'
    # lengths.
    along = np.where(into_first != into_second, into_first, along)
    pair = np.where(along[:, None, None], cells[:, [[0, 1, 2], [0, 2, 3]]], cells[:, [[0, 1, 3], [1, 2, 3]]])
    return np.asarray(pair.reshape(-1, 3))


def _quadratic(draft: Draft, cells: Index) -> Mesh:
    """Mid-side nodes half way between the ends, on curved boundaries half way along them, or where they are known."""
    points = draft.points
    n = len(points)
    pairs = sides(cells)
    edges = np.unique(keys(pairs, n))
    ends = np.stack([edges // n, edges % n], axis=1)
    middle = points[ends].mean(axis=1)

    def number(some: Index) -> Index:
        return np.searchsorted(edges, keys(some, n))

    for name, between in draft.curves.items():
        e = draft.edges[name]
        middle[number(e)] = between(points[e[:, 0]], points[e[:, 1]])
    if draft.midside:
        at = number(np.array(list(draft.midside), dtype=np.int64))
        middle[at] = np.array(list(draft.midside.values()))
    quadratic = np.concatenate([cells, n + number(pairs)], axis=1)
    named = {name: np.concatenate([e, n + number(e)[:, None]], axis=1) for name, e in draft.edges.items()}
    return Mesh(np.concatenate([points, middle]), quadratic, named, draft.corners)


def draft_of(points: Array, cells: Index, edges: Mapping[str, Index], corners: Mapping[str, int]) -> Draft:
    """Draft of given arrays (cells of any kind): mid-side nodes are set apart, nodes are numbered without them."""
    ends = corner_cells(cells)
    if cells.shape[1] == ends.shape[1]:
        return Draft(points, cells, edges, corners)
    used = np.unique(ends)
    number = np.full(len(points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    three = sides(cells).reshape(-1, 3)
    pairs = np.sort(number[three[:, :2]], axis=1).tolist()
    midside = {(a, b): points[m] for (a, b), m in zip(pairs, three[:, 2].tolist())}
    lost = [name for name, node in corners.items() if number[node] < 0]
    if lost:
        raise MeshError(f"the named point {lost[0]!r} is a mid-side node; name a corner of an element")
    return Draft(
        points[used], number[ends], {k: number[e[:, :2]] for k, e in edges.items()},
        {k: int(number[v]) for k, v in corners.items()}, {}, midside,
    )  # fmt: skip
