"""Contacts as data: candidate points of a surface against a master, which is a tool or a side of another body."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from prensa.contact.cut import Corners
from prensa.contact.faces import FacePoints
from prensa.contact.forces import Scale
from prensa.contact.integration import Points
from prensa.contact.redundant import NO_SLOPE, Supports
from prensa.contact.weighted import FacingSides
from prensa.layout import DofMap, Field
from prensa.model import problem as model
from prensa.types import Array, Index

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


class Follows(NamedTuple):
    """All degrees of freedom (ndof,) from the ``free`` ones (f,): ``matrix`` (ndof, f)."""

    free: Index
    matrix: csr_matrix


class Opposite(NamedTuple):
    """The other side of a contact of two bodies: its ``body``, nodes of both ``sides``, the body's ``modulus`` as of a `Surface`.

    ``pressed``: the longest length of material that a node of the side presses in.
    """

    body: str
    sides: FacingSides
    modulus: float
    pressed: float


@dataclass(frozen=True)
class Surface:
    """One contact: candidate points against a master. ``first`` is the row of its first point in the state's arrays.

    ``X`` (k, d) initial positions of the points, ``dofs`` (k, m) unknowns of their stencils: displacements of each supporting
    node, then those of the master (of the nodes of both sides, where that is a body); ``normal`` (k, d) of the undeformed
    surface at the points, ``node_normal`` (n, d) at its nodes;
    ``behind`` (m,): elements of the body behind the edges.
    ``multipliers``: their field, normal and tangential ones of each point; None if they are no degrees of freedom.
    ``corners``: those of the tool that hold points in this increment. ``shift`` (n,): what is added to the gaps at the nodes of
    the system, for overlaps that are meant; None: nothing. ``opposite``: the side of the body that is the master, None where that
    is a tool.
    """

    name: str
    description: model.Contact | model.BodyContact
    body: str
    points: Points
    first: int
    X: Array
    dofs: Index
    normal: Array
    node_normal: Array
    modulus: float
    behind: Index
    multipliers: Field | None = None
    corners: Corners | None = None
    shift: Array | None = None
    opposite: Opposite | None = None

    @cached_property
    def against(self) -> str:
        """Name of its master."""
        return self.description.against

    @cached_property
    def sharp(self) -> bool:
        """Whether edges may be cut at sharp corners of the tool, anew in each increment."""
        return self.points.with_neighbours

    @cached_property
    def exact(self) -> bool:
        """Whether its multipliers are degrees of freedom."""
        return self.multipliers is not None

    @property
    def unknowns(self) -> slice:
        """Places of its multipliers in the vector of degrees of freedom."""
        assert self.multipliers is not None
        return self.multipliers.slice

    @cached_property
    def rows(self) -> slice:
        """Rows of this contact in `State.contact` and `State.lam`."""
        return slice(self.first, self.first + len(self.points))

    @cached_property
    def touching(self) -> Index:
        """Nodes that lie on it, those too that carry no pressure: the corners of quadratic tetrahedra."""
        return np.unique(self.points.faces) if isinstance(self.points, FacePoints) else self.points.nodes

    @property
    def of_master(self) -> slice:
        """Which of the unknowns of a stencil are the master's."""
        slaves = self.points.N.shape[1] if self.opposite is None else self.opposite.sides.there.shape[1]
        return slice(self.X.shape[1] * slaves, None)

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """The bodies that it acts on: its own, and the one that is its master, if one is."""
        return (self.body,) if self.opposite is None else (self.body, self.opposite.body)

    def acts_on(self, bodies: Collection[str]) -> bool:
        """Whether it acts on one of some bodies."""
        return any(body in bodies for body in self.bodies)

    @cached_property
    def coupled(self) -> Index:
        """Unknowns of the stencils (k, d a + m), followed by the multipliers where these are dofs (k, d a + m + 1 + t)."""
        if self.multipliers is None:
            return self.dofs
        return np.hstack([self.dofs, self.multipliers.dofs(np.arange(len(self.points)))])

    def stretched_dofs(self, dofs: DofMap) -> Index:
        """Sets of degrees of freedom that areas of the points couple: of stencils, and of the nodes of their edges or faces.

        With the tangential multipliers of the points where these are degrees of freedom.
        """
        k = len(self.points)
        own = np.zeros((k, 0), dtype=np.int64) if self.multipliers is None else self.multipliers.dofs(np.arange(k))[:, 1:]
        return self.points.stretched_dofs(dofs.displacement, self.dofs, own)

    @property
    def unit(self) -> Array:
        """M/h (k,) of the points: what β multiplies, h what they press in; of multipliers the unit, E*/h, h the depth there.

        Between bodies the least of both sides, at all points: the softer side decides how much a layer of elements gives.
        """
        # Not the body's own stiffness at the point: that differs with every law and state, and its derivative would belong to
        # the tangent.
        own = self.modulus / (self.points.depth if self.exact else self.points.pressed_length)
        if self.opposite is None:
            return own
        return np.full(len(own), min(float(own.min()), self.opposite.modulus / self.opposite.pressed))

    def supports(self, fixed: Index, follows: Follows | None = None) -> Supports | None:
        """Of exact contacts: the points with ``fixed`` degrees of freedom of the body; None if there are none.

        ``follows``: how some follow others in space; None: none does.
        """
        if not self.exact:
            return None
        free = ~np.isin(self.dofs, fixed)
        held = ~free[:, : self.of_master.start].all(axis=1)
        if follows is not None:
            held |= ~np.isin(self.dofs[:, : self.of_master.start], follows.free).all(axis=1)
        at = np.flatnonzero(held)
        if not len(at):
            return None
        return Supports(at, free[at], None if follows is None else _ways(follows.matrix, self.dofs[at]))

    def scale(self, k_t_least: Array) -> Scale:
        """Penalty stiffnesses of the points: k_n = β M/h, k_T = β_T M/h, not below ``k_t_least`` (k,)."""
        unit = self.unit
        k_n, k_t = self.description.enforcement.stiffness(unit)
        # A law that falls by more than k_T per slip has no unique slip; the least stiffness comes from `FrictionLaw.softening`.
        return Scale(k_n, np.maximum(k_t, k_t_least), self.points.depth, unit)


def _ways(follows: csr_matrix, dofs: Index) -> Array:
    """Projections (m, k, k) on the motions of degrees of freedom (m, k) that free ones make."""
    out = np.zeros((*dofs.shape, dofs.shape[1]))
    for i, own in enumerate(dofs):
        rows = follows[own]
        rows = rows[:, np.unique(rows.indices)].toarray()
        if rows.size:
            U, s, _ = np.linalg.svd(rows, full_matrices=False)
            U = U[:, s > NO_SLOPE * s[0]]
            out[i] = U @ U.T
    return out
