"""The meshed bodies of a problem: what supports act on, whether or not tools and contacts are known yet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from prensa.layout import DofMap
from prensa.mesh.mesh import Mesh, MeshError
from prensa.model import problem as model
from prensa.system.ties import Ties
from prensa.types import Array, Flags, Index


class Bodies:
    """Meshes by body, the number of the first node of each (``offsets``), places X (n, d), degrees of freedom, ties."""

    problem: model.Problem
    meshes: dict[str, Mesh]
    offsets: dict[str, int]
    X: Array
    dofs: DofMap
    ties: Ties | None

    @cached_property
    def axisymmetric(self) -> bool:
        """Whether x is a radius."""
        return self.problem.space == "axisymmetric"

    @cached_property
    def length(self) -> float:
        """Size of the bodies, the length by which moments are divided."""
        return float(np.ptp(self.X, axis=0).max())

    @property
    def displaced(self) -> Array:
        """Displacements (n, d) of the nodes when the first step begins."""
        return np.zeros_like(self.X)

    def span(self, body: str) -> slice:
        """The nodes of a body among those of all."""
        first = self.offsets[body]
        return slice(first, first + len(self.meshes[body].points))

    def nodes_of(self, body: str) -> Index:
        """Global numbers (n,) of the nodes of a body."""
        return self.offsets[body] + np.arange(len(self.meshes[body].points))

    def has(self, body: str, nodes: Index) -> Flags:
        """Which nodes (n,) are those of a body."""
        own = self.span(body)
        return (nodes >= own.start) & (nodes < own.stop)

    def body_of(self, node: int) -> str:
        """The body that a node belongs to."""
        return next(b for b in reversed(list(self.offsets)) if self.offsets[b] <= node)

    def boundary_nodes(self, name: str) -> Index:
        """Global nodes of 'body.boundary' (or 'body.point')."""
        body, _, edge = name.partition(".")
        return self.meshes[body].nodes(edge, name) + self.offsets[body]

    def boundary_edges(self, name: str) -> Index:
        """Global edges (k, 2) of 'body.boundary'."""
        body, _, edge = name.partition(".")
        mesh = self.meshes[body]
        mesh.nodes(edge, name)
        if edge not in mesh.edges:
            raise MeshError(f"{name!r} is a point; a load or a contact needs a boundary")
        return mesh.edges[edge] + self.offsets[body]

    @cached_property
    def axis_nodes(self) -> Index:
        """Nodes on the axis of revolution, whose radial displacement is zero."""
        if not self.axisymmetric:
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(self.X[:, 0] <= 1e-12 * self.length)

    def master_dofs(self, dofs: Index) -> Index:
        """Unknowns with those of nodes that a tie has made one replaced by the one that stands for them."""
        return dofs if self.ties is None else np.unique(self.ties.owner[dofs])

    def tied_bodies(self, body: str) -> list[str]:
        """A body and those that ties join to it, in the order of the description."""
        group = {body}
        pairs = [{t.slave.partition(".")[0], t.master.partition(".")[0]} for t in self.problem.ties]
        for _ in pairs:
            group |= {b for pair in pairs if pair & group for b in pair}
        return [b for b in self.problem.bodies if b in group]


@dataclass(eq=False)
class Meshed(Bodies):
    """Bodies alone, before there are tools and contacts."""

    problem: model.Problem
    meshes: dict[str, Mesh]
    offsets: dict[str, int]
    X: Array
    dofs: DofMap
    ties: Ties | None = None
