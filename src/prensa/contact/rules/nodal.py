"""Trapezoid: a point a node, w_A = ∫ N_A dΓ exactly, thickness or 2πr inside; n + 1 constraints for n + 1 nodes.

On quadratic edges N_A is the quadratic shape function, 1/6, 4/6, 1/6 of a straight edge: all positive, and a uniform pressure is
the pressure of every point, which piecewise linear N_A (1/4, 1/2, 1/4) would report as 2/3 and 4/3 of it. On the axis of
revolution the corner of a quadratic edge has ∫ N_A dΓ = 0; such an edge has the points of Lobatto's rule (`prensa.contact.axis`).
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from prensa.contact.axis import edges_at_axis, with_points_at_axis
from prensa.contact.integration import Candidates, Points
from prensa.contact.rule import IntegrationRule


class Nodal(IntegrationRule):
    """Points at the nodes."""

    type: Literal["nodal"] = "nodal"
    quadratic_edges: ClassVar[bool] = True
    determined: ClassVar[bool] = True
    cuts: ClassVar[bool] = True
    point: ClassVar[str] = "node"

    def points(self, surface: Candidates) -> Points:
        """The nodes that have an area."""
        nodes = surface.nodes
        if surface.axisymmetric and surface.middle.any() and len(edges := edges_at_axis(surface)):
            return with_points_at_axis(surface, edges)
        # As many constraints as nodes: 2n or 3n points over-constrain a straight edge under a curved tool, one a side leaves a
        # zig-zag free.
        return surface.with_area(nodes[:, None], np.ones((len(nodes), 1)), surface.node_depth, surface.nodal)
