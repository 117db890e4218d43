"""Layout of components in arrays. Nobody else does arithmetic on places."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from prensa.types import Array, Index

Pairs = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class TensorLayout:
    """Components that tensors of a space have in arrays, by pairs of axes counted from zero.

    ``dimension``: displacements of a point. ``full``: places of h = f − I, of P and of the rows and columns of A = ∂P/∂f.
    ``symmetric``: places of symmetric tensors kept as history (b_e − I, elastic strain) and of Cauchy stresses.
    """

    name: str
    dimension: int
    full: Pairs
    symmetric: Pairs

    @property
    def components(self) -> int:
        """Components of an unsymmetric tensor."""
        return len(self.full)

    @property
    def kept(self) -> int:
        """Components of a symmetric tensor; in histories of elastic-plastic laws the column that follows them."""
        return len(self.symmetric)

    @property
    def cauchy(self) -> list[int]:
        """Places of the symmetric components among the full ones, which a symmetric P = σ is read from."""
        return [self.full.index(pair) for pair in self.symmetric]


def _pairs(text: str) -> Pairs:
    return tuple((int(ij[0]) - 1, int(ij[1]) - 1) for ij in text.split())


PLANE = TensorLayout("plane", 2, _pairs("11 12 21 22 33"), _pairs("11 22 33 12"))
"""Plane strain, plane stress and axisymmetry."""

SPATIAL = TensorLayout("3d", 3, _pairs("11 12 13 21 22 23 31 32 33"), _pairs("11 22 33 12 13 23"))
"""Three dimensions."""

TETRAHEDRON_EDGES: Pairs = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
"""Corners that the nodes 4 to 9 of a tetrahedron stand between: the order of VTK."""

SIDE_ENDS: dict[int, Pairs] = {6: ((0, 1), (1, 2), (2, 0)), 8: ((0, 1), (1, 2), (2, 3), (3, 0)), 10: TETRAHEDRON_EDGES}
"""Corners that the nodes in the middle of the sides stand between, by the nodes of a quadratic element."""


def of_corners(N: Array) -> tuple[Array, Array]:
    """Values (q, c) of the fields that are 1 at one corner and (bi)linear between them, and those at all nodes (a, c).

    N (q, a): shape functions of an element in the plane or of a tetrahedron at some points. L_i is N_i and half of those in the
    middle of the sides that meet in i, for quadratic elements have all (bi)linear fields.
    """
    if N.shape[1] not in SIDE_ENDS:
        return N, np.eye(N.shape[1])
    ends = np.array(SIDE_ENDS[N.shape[1]])
    corners = np.eye(N.shape[1] - len(ends))
    at_nodes = np.concatenate([corners, 0.5 * corners[ends].sum(axis=1)])
    return N @ at_nodes, at_nodes


# ------------------------------------------------------------------------------------------------- degrees of freedom
@dataclass(frozen=True)
class Field:
    """Degrees of freedom of one kind: ``components`` at each of ``count`` entities (nodes, tools, contact points).

    They stand together in the vector of all, from ``first`` on, those of one entity side by side.
    """

    name: str
    entity: str
    count: int
    components: tuple[str, ...]
    first: int = 0

    @cached_property
    def width(self) -> int:
        """Degrees of freedom of one entity."""
        return len(self.components)

    @cached_property
    def size(self) -> int:
        """Degrees of freedom of the field."""
        return self.count * self.width

    @cached_property
    def slice(self) -> slice:
        """Their places in a vector of all."""
        return slice(self.first, self.first + self.size)

    @cached_property
    def places(self) -> Index:
        """Those of each entity (count, width)."""
        return self.dofs(np.arange(self.count))

    def of(self, values: Array) -> Array:
        """The field's part of a vector of all (ndof,), as a view (count, width)."""
        return values[self.slice].reshape(self.count, self.width)

    def dofs(self, entities: Index | int) -> Index:
        """Degrees of freedom (..., width) of entities (...)."""
        places = np.asarray(entities, dtype=np.int64)
        return self.first + self.width * places[..., None] + np.arange(self.width)

    def dof(self, entities: Index, component: str) -> Index:
        """One component's degrees of freedom (...) of entities (...)."""
        return self.first + self.width * np.asarray(entities, dtype=np.int64) + self.components.index(component)

    def owns(self, dofs: Index) -> Any:
        """Which of the degrees of freedom (k,) are the field's."""
        return (dofs >= self.first) & (dofs < self.first + self.size)

    def split(self, dofs: Index) -> tuple[Any, Any]:
        """Entity and number of the component of degrees of freedom of the field."""
        return (dofs - self.first) // self.width, (dofs - self.first) % self.width


RIGID = {2: ("x", "y", "rz"), 3: ("x", "y", "z", "rx", "ry", "rz")}
"""Rigid motions of a tool by the dimension of space."""
ORIENTATION = "orientation"
"""Field of tools in space: rotations (bx, by, bz) at the start of the step, and rotation vector (ox, oy, oz) of the tool there.

Nothing solves for them. Rotations rx, ry, rz less (bx, by, bz) are the rotation vector of the step: without it, two turns about
different axes, one after the other, would not be the sum of their vectors.
"""


class DofMap:
    """(field, component, entity) → degree of freedom; nobody else knows in which order they stand.

    ``displacement`` of the nodes comes first, then the ``tool``s, then multipliers and whatever else is asked for.
    """

    def __init__(
        self, dimension: int, nodes: int, tools: int = 0, more: Iterable[tuple[str, str, int, tuple[str, ...]]] = ()
    ) -> None:
        axes = ("x", "y", "z")[:dimension]
        wanted = [("displacement", "node", nodes, axes), ("tool", "tool", tools, RIGID[dimension])]
        wanted += [(ORIENTATION, "tool", tools, ("bx", "by", "bz", "ox", "oy", "oz"))] * (dimension == 3)
        wanted += more
        self.fields: dict[str, Field] = {}
        self.size = 0
        for name, entity, count, components in wanted:
            self.fields[name] = Field(name, entity, count, components, self.size)
            self.size += self.fields[name].size
        self.dimension = dimension
        self.displacement, self.tool = self.fields["displacement"], self.fields["tool"]

    def field_of(self, dof: int) -> Field:
        """The field that a degree of freedom belongs to."""
        return next(f for f in self.fields.values() if f.first <= dof < f.first + f.size)

    def orientation(self, tools: Index | int) -> Index:
        """Places of the `ORIENTATION` (..., 6) of tools (...); (..., 0) in the plane."""
        if ORIENTATION in self.fields:
            return self.fields[ORIENTATION].dofs(tools)
        return np.zeros((*np.shape(tools), 0), dtype=np.int64)

    def stencils(self, support: Index, master: Index) -> Index:
        """Degrees of freedom (k, d a + m) of stencils: displacements of their nodes (k, a), then those of a master (m,)."""
        nodal = self.displacement.dofs(support).reshape(len(support), -1)
        return np.hstack([nodal, np.broadcast_to(master, (len(support), len(master)))])
