"""Quadratic edges that end on the axis of revolution: a rule whose points keep their corner out of a tool.

With 2πr inside, ∫ N_A dΓ of the corner on the axis is zero: a uniform pressure does not push it, so a point at the corner with
that weight would hold nothing, and the corner would sink into the tool. The Gauss-Lobatto points of ∫₀¹ f(s) s ds, which lie at
both ends and at s = 3/5, have positive weights,

    ∫₀¹ f(s) s ds = f(0)/36 + 25/72 f(3/5) + f(1)/8        for cubics f,

and so integrate every N_A of the edge exactly: the force that the point on the axis puts on the corner under a uniform pressure
is taken off by the point at 3/5, where N is negative there. There are as many points as nodes.
"""

from __future__ import annotations

import numpy as np

from prensa.contact.integration import Candidates, Points
from prensa.types import Array, Index

# Points of Radau's rule fail the patch test, a small weight leaves the node in the middle loose, a point beside the corner does
# not lie on a curved edge.
LOBATTO_POINT = 3 / 5  # the point between the ends, on an edge that begins on the axis


def _values(s: float) -> Array:
    return np.array([4 * s * (1 - s), (1 - s) * (1 - 2 * s), s * (2 * s - 1)])


CARRIED = _values(LOBATTO_POINT)
"""N of the point between the ends at the middle, at the corner on the axis and at the other one."""


def edges_at_axis(surface: Candidates) -> Index:
    """Slots (e, 3) of middle, corner on the axis and other corner of the quadratic edges that end on the axis."""
    area = surface.tributary()
    # ∫ N_A 2πr dΓ of the corner on the axis vanishes, but only to round-off.
    bare = area <= 1e-12 * area.max()
    ends = np.full((len(area), 2), -1)
    first, second = surface.slots(surface.edges).T
    ends[second, 0], ends[first, 1] = first, second
    middle = np.flatnonzero(surface.middle & ~bare)
    ends = ends[middle]
    there = bare[ends]
    # An edge that lies on the axis itself has both ends there, and no area to integrate over.
    touches = there.sum(axis=1) == 1
    ends = np.where(there[:, 1:], ends[:, ::-1], ends)
    return np.column_stack([middle, ends])[touches]


def with_points_at_axis(surface: Candidates, edges: Index) -> Points:
    """A point a node, of ``edges`` (e, 3) at the axis those of Lobatto's rule: the one of the middle lies at 3/5.

    Areas are parts of the nodes', so that they follow edges whose middle is not half-way: with w the middle's, 25/24 w for its
    point and w/12 for that on the axis, w/8 less than the node's for the other corner.
    """
    nodes, nodal = surface.nodes, surface.nodal
    support, N = np.repeat(nodes[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (len(nodes), 1))
    support[edges[:, 0]], N[edges[:, 0]] = nodes[edges], CARRIED
    parts = [nodal]
    # What N of the point at 3/5 puts on each node is made up by that node's own point, so that Σ_q w_q N_A(q) is the node's
    # area again: without it the patch test fails.
    for share, to in zip((1.0 - CARRIED[0], -CARRIED[1], -CARRIED[2]), edges.T):
        moved = np.full(len(nodes), -1)
        moved[edges[:, 0]] = to
        of = np.flatnonzero(moved[nodal.point] >= 0)
        part = nodal.rows(of)
        parts.append(part._replace(point=moved[part.point], factor=share / CARRIED[0] * part.factor))
    return surface.with_area(support, N, surface.node_depth, nodal.joined(parts))
