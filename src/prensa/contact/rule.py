"""Integration rules (quadrature) of contact: the points of a surface where its terms are taken, with their shares of edges."""

from __future__ import annotations

from typing import ClassVar

from prensa.contact.integration import Candidates, Points
from prensa.model.doors import Member


class IntegrationRule(Member, abstract=True):
    """Base of the integration rules; one without fields is named in a case file by its ``type`` alone."""

    door: ClassVar[str] = "integration rule"
    quadratic_edges: ClassVar[bool] = False
    """Whether it has points for edges of three nodes."""
    determined: ClassVar[bool] = False
    """Whether it has no more points than the surface has nodes, so that exact multipliers are unique."""
    projected: ClassVar[bool] = False
    """Whether the pressures reported at the points are those projected to the nodes and interpolated back."""
    cuts: ClassVar[bool] = False
    """Whether the part of an edge that a sharp corner of a tool covers is what it integrates over (`prensa.contact.cut`)."""
    point: ClassVar[str] = "contact point"
    """What a point is called in messages."""

    def points(self, surface: Candidates) -> Points:
        """The contact points on a surface, in walking order."""
        raise NotImplementedError(f"{self.type!r} places no points: define points(self, surface)")
