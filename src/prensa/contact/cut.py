"""Surface edges that a tool with a sharp corner covers in part: what is integrated is the covered part.

A corner lies over an edge between a node under the tool, A, and one beside it, B. The point of A stands for the covered part of
its surroundings, no more and no less, and lies where a uniform pressure on it has its resultant: on the edge, a little towards B,
which gets ∫N_B over the covered part. The point of B keeps the rest and is open. So there is no point whose gap would have to be
measured beside the tool, no more constraints than nodes under the tool, and nothing changes where no edge is cut.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.contact.integration import Points, edge_normals
from prensa.tools.analytic import Tool

Array = NDArray[np.float64]
Index = NDArray[np.int64]

BESIDE = 1e-4  # share of an edge by which a look at the tool is taken on either side of a corner
FLANK = 0.1  # cosine towards a surface below which a part of a tool is a flank, that covers nothing
PIERCED = 0.25  # depth of a point in the tool, over that of its element, from which its edge is not cut there
AT_NODE = 1e-9  # share of an edge by which a corner may miss a node that it lies on


class Cut(NamedTuple):
    """An edge of a surface, which of its ends (0, 1) lies under the tool, and the covered share of it."""

    edge: int
    end: int
    covered: float


def may_cut(points: Points, shape: Tool) -> bool:
    """Whether edges are cut at the tool's corners: it has sharp ones, the points are nodes, and the edges are straight."""
    return bool(points.rule.cuts and len(shape.edges) and (points.shares.factor == 0.5).all())


def with_neighbours(points: Points) -> Points:
    """Points at nodes, carried by the node and, with no share yet, by those before and after it on the surface."""
    own = points.support[:, 0]
    before, after = (np.arange(int(points.nodes.max()) + 1) for _ in range(2))
    before[points.edges[:, 1]], after[points.edges[:, 0]] = points.edges.T
    support = np.stack([own, before[own], after[own]], axis=1)
    return replace(points, support=support, N=np.tile([1.0, 0.0, 0.0], (len(own), 1)), with_neighbours=True)


def cuts_of(shape: Tool, at: Array, place: Array, x: Array, edges: Index, limit: float) -> list[Cut]:
    """Edges (m, 2) on node positions x (n, 2), body on the left, that end beside a sharp corner of the tool at its place (3,).

    A corner cuts the edge that it stands over, seen along the edge's normal, if the tool lies over one side of it alone.
    limit: length beyond which the tool is not looked for.
    """
    c, s = np.cos(place[2]), np.sin(place[2])
    R = np.array([[c, -s], [s, c]])
    centre = at + place[:2]
    a = x[edges[:, 0]]
    t = x[edges[:, 1]] - a
    length = np.hypot(*t.T)
    t, outward = t / length[:, None], edge_normals(x, edges) / length[:, None]
    found: list[Cut] = []
    for *corner, ex, ey in shape.edges:
        to = centre + R @ corner - a
        along = (to * t).sum(axis=1) / length
        facing = outward @ (R @ [ey, -ex]) < 0.0
        over = np.flatnonzero(facing & (along > AT_NODE) & (along < 1.0 - AT_NODE))
        if not len(over):
            continue
        k = over[np.argmin(np.abs((to * outward).sum(axis=1))[over])]
        beside = a[k] + (along[k] + np.array([[-BESIDE], [BESIDE]])) * length[k] * t[k]
        under = _lies_over(shape, (beside - centre) @ R, outward[k] @ R, limit)
        if under[0] != under[1]:
            end = 0 if under[0] else 1
            found.append(Cut(int(k), end, float(along[k] if end == 0 else 1.0 - along[k])))
    several = [cut.edge for cut in found]
    return [cut for cut in found if several.count(cut.edge) == 1]


def _lies_over(shape: Tool, xi: Array, direction: Array, limit: float) -> Array:
    """Whether a tool lies over points xi (k, 2) in its frame, seen along the unit direction, with more than a flank."""
    h = shape.along(xi, direction, limit)
    hit = np.isfinite(h)
    n = shape.closest(xi + np.where(hit, h, 0.0)[:, None] * direction).n
    return np.asarray(hit & (n @ direction < -FLANK))


def cut(points: Points, x: Array, cuts: list[Cut]) -> Points:
    """The points `with_neighbours` on node positions x (n, 2) whose edges are covered in part."""
    shares, N = points.shares, points.N.copy()
    factor, at, transfers = shares.factor.copy(), shares.at.copy(), []
    for edge, end, covered in cuts:
        of = {int(shares.place[i]): i for i in np.flatnonzero(shares.edge == edge)}
        if len(of) < 2:  # an end has no area
            continue
        inside, outside = of[end], of[1 - end]
        factor[inside], factor[outside] = covered, 1.0 - covered
        for i, middle in ((inside, 0.5 * covered), (outside, 0.5 * (1.0 + covered))):
            at[i] = middle if end == 0 else 1.0 - middle
        transfers.append((int(shares.point[inside]), edge, end, covered))
    out = replace(points, shares=shares._replace(factor=factor, at=at))
    weight = out.weights(x)
    for point, edge, end, covered in transfers:
        # ∫N_B over the covered part, of length or area of revolution: its centroid is at 2/3 of it
        centroid = 2.0 / 3.0 * covered
        place = np.array([centroid if end == 0 else 1.0 - centroid])
        share = 0.5 * covered**2 * float(out.measure(x, np.array([edge]), place)[0]) / weight[point]
        N[point, 2 if end == 0 else 1] += share
        N[point, 0] -= share
    return replace(out, N=N)
