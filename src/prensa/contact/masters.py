"""Masters: what the points of a contact lie against. A rigid tool is one; those who report, load and differentiate know no more.

A master has a name, degrees of freedom, which are columns of the stencils of its contacts, and answers where points are seen from
it. What is a tool's alone (its description, shape, corners) is behind ``tool``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from prensa.contact.pairing import Pairs, Since, continued, current_pairs, reference_pairs, rotation, spatial_pairs
from prensa.tools.analytic import Tool
from prensa.tools.place import PlacedTool
from prensa.types import Array, Index


@dataclass(frozen=True)
class RigidMaster:
    """A rigid tool, the ``number``-th; dofs (d + w,): displacements of its reference point and rotations."""

    tool: PlacedTool
    number: int
    dofs: Index

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

    def place(self, u: Array) -> Array:
        """Displacement and rotation (d + w,) for degrees of freedom u (ndof,)."""
        return u[self.dofs]

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

    def pairs(
        self, X: Array, normal: Array, moved: Array, u: Array, reference: bool, limit: float, since: Since | None
    ) -> Pairs:
        """Pairs of points X (k, d) of an undeformed surface with normals (k, d), displaced by ``moved`` (k, d).

        ``reference``: gaps are those along the undeformed surface's normals, looked for within the length ``limit``.
        ``since``: where slip goes on; None: from the undeformed surface, or of current coordinates.
        """
        place = self.place(u)
        if reference:
            return reference_pairs(self.shape, X, normal, moved, self.at, place, limit, since)
        if self.dimension == 3:
            return spatial_pairs(self.shape, X, moved, self.at, place, since)
        pairs = current_pairs(self.shape, X + moved, self.at, place)
        if since is None or not np.isfinite(self.shape.period):
            return pairs
        return pairs._replace(s=continued(self.shape, pairs.s, X, moved, self.at, place, since))
