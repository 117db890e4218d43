"""A mesh: node coordinates, quadrilaterals, named boundaries and named points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError
from prensa.model.checks import suggest

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class MeshError(PrensaError):
    """A mesh that cannot be computed with; the message names the element, node and coordinates."""


@dataclass(frozen=True)
class Mesh:
    """``points`` (n, 2), ``cells`` (m, 4) counter-clockwise, ``edges`` name → (k, 2) node pairs with the body on the left.

    ``corners`` names single nodes.
    """

    points: Array
    cells: Index
    edges: Mapping[str, Index]
    corners: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check(self)

    def nodes(self, name: str) -> Index:
        """Nodes of a boundary in order along it, or the single node of a named point; unknown names raise MeshError."""
        if name in self.corners:
            return np.array([self.corners[name]])
        if name not in self.edges:
            raise MeshError(f"unknown boundary {name!r}{suggest(name, [*self.edges, *self.corners])}")
        return ordered_nodes(self.edges[name])


def ordered_nodes(edges: Index) -> Index:
    """Distinct nodes of oriented edges (k, 2), chain after chain, each in walking order."""
    follower = dict(edges.tolist())
    starts = [a for a in follower if a not in set(follower.values())] or [edges[0, 0]]
    order: list[int] = []
    seen: set[int] = set()
    for start in [*starts, *follower]:
        node: int | None = int(start)
        while node is not None and node not in seen:
            seen.add(node)
            order.append(node)
            node = follower.get(node)
    return np.array(order, dtype=np.int64)


def boundary_edges(cells: Index) -> Index:
    """Edges (k, 2) that belong to one cell only, body on the left."""
    edges = np.concatenate([cells[:, [i, (i + 1) % 4]] for i in range(4)])
    key = np.sort(edges, axis=1)
    _, first, count = np.unique(key, axis=0, return_index=True, return_counts=True)
    return edges[np.sort(first[count == 1])]


def edges_between(edges: Index, nodes: Index) -> Index:
    """The edges both ends of which are in *nodes*."""
    return edges[np.isin(edges, nodes).all(axis=1)]


def check(mesh: Mesh) -> None:
    """Raise MeshError for what no element can be computed on."""
    points, cells = mesh.points, mesh.cells
    if not np.isfinite(points).all():
        raise MeshError(f"node {int(np.argwhere(~np.isfinite(points))[0, 0])} has a coordinate that is not a number")
    if len(cells) == 0:
        raise MeshError("the mesh has no element")
    if cells.min() < 0 or cells.max() >= len(points):
        e = int(np.argwhere((cells < 0) | (cells >= len(points)))[0, 0])
        raise MeshError(f"element {e} refers to a node outside 0 … {len(points) - 1}: {cells[e].tolist()}")
    x = points[cells]
    d1, d2 = x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]
    area = 0.5 * (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
    if (area <= 0).any():
        e = int(np.argmin(area))
        raise MeshError(
            f"element {e} near ({x[e, :, 0].mean():g}, {x[e, :, 1].mean():g}) has area {area[e]:g}: "
            "its nodes must go counter-clockwise and span an area"
        )
    unused = np.setdiff1d(np.arange(len(points)), cells)
    if len(unused):
        raise MeshError(f"node {unused[0]} at {points[unused[0]].tolist()} belongs to no element; remove it")
