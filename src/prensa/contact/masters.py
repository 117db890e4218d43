"""Masters: what the points of a contact lie against, a rigid tool or a side of another body.

Those who assemble, solve, commit and report know no more of a master than `Master` says: its name, its degrees of freedom, and
the stencils of the points that lie against it. What is a tool's alone (its description, shape, corners, place) is asked of
`Geometry.tool_masters`; what is a side's alone is in `Surface.opposite`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import NamedTuple, Protocol

import numpy as np

from prensa.contact.pairing import Pairs, Since, continued, current_pairs, reference_pairs, rotation, spatial_pairs
from prensa.contact.stencil import Stencils
from prensa.contact.surface import Surface
from prensa.layout import DofMap
from prensa.mesh.mesh import Mesh
from prensa.tools.analytic import Tool
from prensa.tools.place import PlacedTool
from prensa.types import Array, Index


class Committed(NamedTuple):
    """Where slip goes on: coordinates s (k, t) of the points and degrees of freedom u (ndof,) at the last commit."""

    coordinate: Array
    u: Array


class Seen(Protocol):
    """Gaps g (k,) and unit normals n (k, d), outward from the master."""

    @property
    def g(self) -> Array:
        """Gaps (k,)."""

    @property
    def n(self) -> Array:
        """Normals (k, d)."""


class Master(Protocol):
    """What the points of a contact lie against.

    A master of another kind answers this, and its contacts have records, friction, energies and reports like all others.
    """

    @property
    def name(self) -> str:
        """As contacts name it."""

    @property
    def dofs(self) -> Index:
        """Degrees of freedom (m,) that move it."""

    def stencils(self, s: Surface, bodies: Geometry, u: Array, since: Committed | None) -> Stencils:
        """Stencils of the points of a contact with it at degrees of freedom u (ndof,); ``since`` None: no slip so far."""

    def nodes_seen(self, s: Surface, bodies: Geometry, u: Array) -> Seen:
        """Gaps and normals at the nodes of the surface of a contact, whatever the rule."""

    def moved(self, s: Surface, bodies: Geometry, u: Array, change: Callable[[Seen], Array]) -> Array:
        """Ways (k, d) of these nodes along the normals by which their gaps change (k,) as asked."""

    def coordinates(self, s: Surface, x: Stencils, bodies: Geometry, u: Array) -> Array:
        """Size (k,) of the coordinates whose differences the gaps are: their round-off is ε times that."""


@dataclass(frozen=True)
class RigidMaster:
    """A rigid tool, the ``number``-th; dofs (d + w,): displacements of its reference point and rotations.

    ``orientation`` (6,): where its `prensa.layout.ORIENTATION` stands, in space; (0,) in the plane.
    """

    tool: PlacedTool
    number: int
    dofs: Index
    orientation: Index

    @cached_property
    def name(self) -> str:
        """That of the tool."""
        return self.tool.name

    @cached_property
    def shape(self) -> Tool:
        """The tool's shape in its frame."""
        return self.tool.shape

    @cached_property
    def at(self) -> Array:
        """Where its reference point is at the beginning (d,)."""
        return self.tool.at

    @cached_property
    def dimension(self) -> int:
        """Displacements among its degrees of freedom."""
        return len(self.at)

    def place(self, u: Array, since: Array | None = None) -> Array:
        """Displacement and rotation (d + w,) for degrees of freedom u (ndof,); in space (12,), with what rotations count from.

        ``since`` (ndof,): a committed u of the same step, which has the latter.
        """
        if self.dimension == 2:
            return u[self.dofs]
        return np.append(u[self.dofs], (u if since is None else since)[self.orientation])

    def local(self, x: Array, u: Array) -> Array:
        """Positions x (k, d) in its frame."""
        d, place = self.dimension, self.place(u)
        return np.asarray((x - self.at - place[:d]) @ rotation(place[d:]))

    def seen(self, x: Array, u: Array) -> Pairs:
        """Gaps, normals and arms of positions x (k, d)."""
        return self.seen_at(x, self.place(u))

    def seen_at(self, x: Array, place: Array) -> Pairs:
        """As `seen`, the master being at a place (d + w,)."""
        if self.dimension == 3:
            return spatial_pairs(self.shape, x, np.zeros_like(x), self.at, place)
        return current_pairs(self.shape, x, self.at, place)

    @cached_property
    def has_memory(self) -> bool:
        """Whether coordinates of points on its moved surface are counted on from those of the last commit."""
        # Open tools in the plane have an absolute surface coordinate. A closed one jumps by its period at a cut, and in space
        # slip is a chord from the committed place: both need to know where the point was.
        return self.dimension == 3 or bool(np.isfinite(self.shape.period))

    def pairs(self, X: Array, normal: Array, moved: Array, place: Array, bodies: Geometry, since: Since | None) -> Pairs:
        """Pairs of points X (k, d) of an undeformed surface with normals (k, d), displaced by ``moved`` (k, d).

        ``place``: that of the tool. ``since``: where slip goes on; None: from the undeformed surface, or of current coordinates.
        """
        if bodies.on_undeformed:
            return reference_pairs(self.shape, X, normal, moved, self.at, place, bodies.reach, since)
        if self.dimension == 3:
            return spatial_pairs(self.shape, X, moved, self.at, place, since)
        pairs = current_pairs(self.shape, X + moved, self.at, place)
        if since is None or not np.isfinite(self.shape.period):
            return pairs
        return pairs._replace(s=continued(self.shape, pairs.s, X, moved, self.at, place, since))

    def stencils(self, s: Surface, bodies: Geometry, u: Array, since: Committed | None) -> Stencils:
        """See `Master`."""
        moved, before = s.points.at(bodies.displacement(u)), None
        place = self.place(u, None if since is None else since.u)
        if since is not None and (bodies.on_undeformed or self.has_memory):
            before = Since(since.coordinate, s.points.at(bodies.displacement(since.u)), self.place(since.u))
        pairs = self.pairs(s.X, s.normal, moved, place, bodies, before)
        if s.corners is not None:
            rows = s.corners.rows
            pairs = pairs.replaced(rows, current_pairs(s.corners, (s.X + moved)[rows], self.at, place))
        if s.shift is not None:
            pairs = pairs._replace(g=pairs.g + s.points.at(s.shift))
        return pairs.stencils(s.points.N, s.points.coefficients, s.dofs)

    def node_pairs(self, s: Surface, bodies: Geometry, u: Array) -> Pairs:
        """Gaps, normals and their derivatives at the nodes of a contact's surface, whatever the rule."""
        nodes = s.points.nodes
        pairs = self.pairs(bodies.X[nodes], s.node_normal, bodies.displacement(u)[nodes], self.place(u), bodies, None)
        return pairs if s.shift is None else pairs._replace(g=pairs.g + s.shift[nodes])

    def nodes_seen(self, s: Surface, bodies: Geometry, u: Array) -> Seen:
        """See `Master`."""
        return self.node_pairs(s, bodies, u)

    def moved(self, s: Surface, bodies: Geometry, u: Array, change: Callable[[Seen], Array]) -> Array:
        """See `Master`."""
        pairs = self.node_pairs(s, bodies, u)
        return change(pairs)[:, None] * pairs.n

    def coordinates(self, s: Surface, x: Stencils, bodies: Geometry, u: Array) -> Array:
        """See `Master`: arms, and where the reference point is."""
        centre = max(map(abs, self.at.tolist())) + max(map(abs, u[self.dofs[: self.dimension]].tolist()))
        return np.asarray(reduce(np.maximum, np.abs(x.arm).T) + centre)


@dataclass(frozen=True)
class SideMaster:
    """A side of a deformable body; dofs (m,): displacements of its nodes. Gaps are weighted (`prensa.contact.weighted`).

    Nothing of it is remembered but the displacements at the last commit, of which the weights there follow.
    """

    name: str
    dofs: Index
    thickness: float

    def stencils(self, s: Surface, bodies: Geometry, u: Array, since: Committed | None) -> Stencils:
        """See `Master`: coefficients over the areas that they belong to, which are those of the moved sides."""
        assert s.opposite is not None
        sides, x = s.opposite.sides, bodies.positions(u)
        then = x if since is None else bodies.positions(since.u)
        out = sides.stencils(x, sides.coefficients(then), s.dofs)
        area = out.coef[:, : sides.there.shape[1]].sum(axis=1)
        over = 1.0 / np.where(area > 0.0, area, 1.0)
        assert out.dcoef is not None
        way = out.s if since is None else since.coordinate + out.s
        return out._replace(
            coef=out.coef * over[:, None], dcoef=out.dcoef * over[:, None, None], s=way, area=self.thickness * area,
        )  # fmt: skip

    def nodes_seen(self, s: Surface, bodies: Geometry, u: Array) -> Seen:
        """See `Master`: the points are the nodes."""
        assert s.opposite is not None
        return s.opposite.sides.seen(bodies.positions(u))

    def moved(self, s: Surface, bodies: Geometry, u: Array, change: Callable[[Seen], Array]) -> Array:
        """See `Master`."""
        assert s.opposite is not None
        return s.opposite.sides.moved(bodies.positions(u), change)

    def coordinates(self, s: Surface, x: Stencils, bodies: Geometry, u: Array) -> Array:
        """See `Master`: positions of the nodes of both sides."""
        assert s.opposite is not None
        return np.asarray(np.abs(bodies.positions(u)[s.opposite.sides.nodes]).max(axis=(1, 2)))


class Geometry(Protocol):
    """Where bodies and tools are, as contact sees it; `prensa.system.system.System` is one."""

    meshes: dict[str, Mesh]
    offsets: dict[str, int]
    X: Array
    tools: list[PlacedTool]
    surfaces: list[Surface]
    dofs: DofMap

    def positions(self, u: Array) -> Array:
        """Node positions (n, d) for degrees of freedom u (ndof,)."""

    def displacement(self, u: Array) -> Array:
        """Displacements (n, d) of the nodes, a view."""

    def place_of(self, t: int, u: Array) -> Array:
        """Displacement and rotation of tool number t."""

    @property
    def masters(self) -> dict[str, Master]:
        """What contacts lie against, by name."""

    @property
    def tool_masters(self) -> dict[str, RigidMaster]:
        """Those of them that are rigid tools."""

    @property
    def tool_contacts(self) -> list[Surface]:
        """The contacts with tools, which come first among all."""

    @property
    def on_undeformed(self) -> bool:
        """Whether contact is that of the undeformed surface."""

    @property
    def reach(self) -> float:
        """How far masters are looked for along its normals."""
