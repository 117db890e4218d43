"""Simpson's rule: nodes (1/6 of each edge at either end) and middles of the edges (4/6), in walking order."""

from __future__ import annotations

from typing import Literal

import numpy as np

from prensa.contact.integration import Candidates, Points, Shares
from prensa.contact.rule import IntegrationRule


class Simpson(IntegrationRule):
    """Nodes and middles of the edges."""

    type: Literal["simpson"] = "simpson"

    def points(self, surface: Candidates) -> Points:
        """The nodes and middles that have an area (on the axis of revolution an end has none)."""
        nodes, edges, nodal = surface.nodes, surface.edges, surface.nodal
        n, m = len(nodes), len(edges)
        # A point at a node has a partner of weight zero, so that all points are carried by two nodes.
        other = {a: b for a, b in edges.tolist()} | {b: a for a, b in edges[::-1].tolist()}
        support = np.concatenate([np.stack([nodes, [other[a] for a in nodes.tolist()]], axis=1), edges])
        N = np.concatenate([np.tile([1.0, 0.0], (n, 1)), np.full((m, 2), 0.5)])
        shares = Shares(
            np.concatenate([nodal.point, n + np.arange(m)]),
            np.concatenate([nodal.edge, np.arange(m)]),
            np.repeat([1 / 6, 4 / 6], [2 * m, m]),
            np.repeat([0.0, 1.0, 0.5], m),
            np.repeat([0.0, 1.0, 0.5], m),
        )
        # Middles come after the first end of their edge: walking order, as profiles of pressure are written.
        along = np.argsort(np.concatenate([np.arange(n), nodal.point[:m] + 0.5]), kind="stable")
        return surface.with_area(support, N, np.concatenate([surface.node_depth, surface.depth]), shares, along)
