"""Surface edges that a tool with a sharp corner covers in part: what is integrated is the covered part.

A corner lies over an edge between a node under the tool, A, and one beside it, B. The point of A stands for the covered part of
its surroundings, no more and no less, and lies where a uniform pressure on it has its resultant: on the edge, a little towards B,
which gets ∫N_B over the covered part. The point of B keeps the rest and is open. So there is no point whose gap would have to be
measured beside the tool, no more constraints than nodes under the tool, and nothing changes where no edge is cut.

Where an edge goes up the flank beside a corner, from A under the tool to B on the flank, no place of the node B holds it off
the corner: the edge becomes a chord of the tool, and B hangs on the flank (docs/developer/book/04). There the point of B is the
place of the edge at the corner, and what it may not pass is the line through the corner along the edge (`Corners`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prensa.contact.integration import Points, edge_normals
from prensa.precision import NEGLIGIBLE
from prensa.tools.analytic import Closest, Tool
from prensa.types import Array, Index

BESIDE = 1e-4  # share of an edge by which a look at the tool is taken on either side of a corner
FLANK = 0.1  # cosine towards a surface below which a part of a tool is a flank, that covers nothing
PIERCED = 0.25  # depth of a point in the tool, over that of its element, from which its edge is not cut there
STEEP = 0.5  # sine of the angle between an edge and the face beside a corner from which it goes up the flank
SAME_PLACE = 0.01  # share of an edge between a corner and the end under the tool within which the point of that end is held
NEXT = 0.1  # share of an edge between its end and a corner within which the end may leave the tool in an increment


class Cut(NamedTuple):
    """An edge of a surface, which of its ends (0, 1) lies under the tool, and the covered share of it.

    With a ``corner`` (2,) and the ``normal`` (2,) of the edge from there into the body, in the tool's frame: an edge that goes
    up a flank, the end whose point the corner holds, and the share of it from there to the corner.
    """

    edge: int
    end: int
    covered: float
    corner: Array | None = None
    normal: Array | None = None


class Corners(NamedTuple):
    """Corners of a tool as lines that points may not pass.

    ``rows`` (k,): the points; ``place``, ``normal`` (k, 2) of the corners, ``s`` (k,) their surface coordinates, in the frame
    of the tool.
    """

    rows: Index
    place: Array
    normal: Array
    s: Array

    def closest(self, xi: Array) -> Closest:
        """Of the points (k, 2) in the frame of the tool."""
        # The line alone: the nearer of line and face would have a kink, at which Newton's iterations cycle.
        d, n = xi - self.place, self.normal
        s = self.s + n[:, 0] * d[:, 1] - n[:, 1] * d[:, 0]
        return Closest((d * n).sum(axis=1), n, np.zeros(len(d)), s)


def may_cut(points: Points, shape: Tool) -> bool:
    """Whether edges are cut at the tool's corners: it has sharp ones, the points are nodes, and the edges are straight."""
    # A factor of 1/2 everywhere is the trapezoid of straight edges. The covered part of a quadratic edge has shares of either
    # sign, which no pressure may carry.
    return bool(points.rule.cuts and len(shape.edges) and (points.shares.factor == 0.5).all())


def with_neighbours(points: Points) -> Points:
    """Points at nodes, carried by the node and, with no share yet, by those before and after it on the surface."""
    own = points.support[:, 0]
    # A node at the end of a surface stands in for its missing neighbour; with N = 0 until something is cut, that changes
    # nothing. All stencils have three nodes from the start: a cut changes numbers, not which unknowns are coupled.
    before, after = (np.arange(int(points.nodes.max()) + 1) for _ in range(2))
    before[points.edges[:, 1]], after[points.edges[:, 0]] = points.edges.T
    support = np.stack([own, before[own], after[own]], axis=1)
    return replace(points, support=support, N=np.tile([1.0, 0.0, 0.0], (len(own), 1)), with_neighbours=True)


def cuts_of(shape: Tool, at: Array, place: Array, x: Array, edges: Index, limit: float, flanks: bool = False) -> list[Cut]:
    """Edges (m, 2) on node positions x (n, 2), body on the left, that end beside a sharp corner of the tool at its place (3,).

    A corner cuts the edge that it stands over, seen along the edge's normal, if the tool lies over one side of it alone.
    limit: length beyond which the tool is not looked for; ``flanks``: whether corners hold edges that go up a flank.
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
        # Edges that look the same way as the corner are on the far side of the body, or on another body's.
        facing = outward @ (R @ [ey, -ex]) < 0.0
        # A corner over a node covers whole edges: there is nothing to cut.
        over = np.flatnonzero(facing & (along > NEGLIGIBLE) & (along < 1.0 - NEGLIGIBLE))
        if not len(over):
            continue
        k = over[np.argmin(np.abs((to * outward).sum(axis=1))[over])]
        ends = (x[edges[k]] - centre) @ R
        # Where nothing slides corners that hold edges converge faster, but coarse meshes that are pressed far take up to ten
        # times the iterations with them.
        up = _up_flank(shape, np.array([*corner, ex, ey]), ends, outward[k] @ R, float(along[k])) if flanks else None
        if up is not None:
            found.append(up._replace(edge=int(k)))
            continue
        beside = a[k] + (along[k] + np.array([[-BESIDE], [BESIDE]])) * length[k] * t[k]
        under = _lies_over(shape, (beside - centre) @ R, outward[k] @ R, limit)
        if under[0] != under[1]:
            end = 0 if under[0] else 1
            found.append(Cut(int(k), end, float(along[k] if end == 0 else 1.0 - along[k])))
    # Of an edge under two corners (a tool narrower than it) no end has one covered part: it stays whole.
    several = [cut.edge for cut in found]
    return [cut for cut in found if several.count(cut.edge) == 1]


def _up_flank(shape: Tool, corner: Array, ends: Array, outward: Array, along: float) -> Cut | None:
    """The cut of an edge that goes up the flank behind a corner, at the share ``along`` of it; None if it does not.

    corner (4,) as in `Tool.edges`, ends (2, 2), outward normal (2,) in the frame of the tool. A corner holds an edge that it
    comes nearer to than the flank to its end. It also does while that end is under the tool still, but next to the corner: the
    node may leave the tool in the increment, and nothing else would hold the surface then. The point of that end is held; at the
    other end its own, of which there would be two at the same place else.
    """
    place, e = corner[:2], corner[2:]
    # Both faces of the corner, a hair beside it: at the corner itself normals fan out.
    faces = shape.closest(place + BESIDE * np.hypot(*(ends[1] - ends[0])) * np.array([-e, e])).n @ outward
    flank = int(np.argmax(faces))
    end = int(np.argmax((2 * flank - 1) * (ends @ e)))
    share = along if end == 0 else 1.0 - along
    if faces[flank] > -STEEP:
        return None
    if share > NEXT and (place - ends[0]) @ outward >= shape.closest(ends[end][None]).g[0]:
        return None
    if share > 1.0 - SAME_PLACE:
        return Cut(-1, 1 - end, 1.0 - share, place, -outward)
    return Cut(-1, end, share, place, -outward)


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
    for one in cuts:
        (edge, end, covered, corner, _), of = one, _points_of(points, one)
        if len(of) < 2:  # an end has no area
            continue
        inside, outside = of[end], of[1 - end]
        if corner is not None:
            # The point moves to the corner and keeps all of its area: the rest of its edges has no other point.
            N[shares.point[inside]] = [1.0 - covered, *((0.0, covered) if end == 0 else (covered, 0.0))]
            continue
        # A constraint on the node beside the tool would make a stamp as wide as the whole edge:
        # up to 11.6 % of the force at β = 1e4.
        factor[inside], factor[outside] = covered, 1.0 - covered
        # 2πr is taken in the middle of each part.
        for i, middle in ((inside, 0.5 * covered), (outside, 0.5 * (1.0 + covered))):
            at[i] = middle if end == 0 else 1.0 - middle
        transfers.append((int(shares.point[inside]), edge, end, covered))
    out = replace(points, shares=shares._replace(factor=factor, at=at))
    # N_B is a share of the area that the point has after the cut, so the weights are those of the new shares.
    weight = out.weights(x)
    for point, edge, end, covered in transfers:
        # ∫N_B over the covered part, of length or area of revolution: its centroid is at 2/3 of it
        centroid = 2.0 / 3.0 * covered
        place = np.array([centroid if end == 0 else 1.0 - centroid])
        share = 0.5 * covered**2 * float(out.measure(x, np.array([edge]), place)[0]) / weight[point]
        N[point, 2 if end == 0 else 1] += share
        N[point, 0] -= share
    return replace(out, N=N)


def corners_of(points: Points, shape: Tool, cuts: list[Cut]) -> Corners | None:
    """The corners that hold points of a surface whose edges go up a flank; None if none does."""
    row = {int(node): k for k, node in enumerate(points.support[:, 0])}
    held = {row[int(points.edges[c.edge, c.end])]: c for c in cuts if c.corner is not None and len(_points_of(points, c)) == 2}
    if not held:
        return None
    place, normal = (np.array([getattr(c, of) for c in held.values()]) for of in ("corner", "normal"))
    return Corners(np.array(list(held)), place, normal, shape.closest(place).s)


def _points_of(points: Points, c: Cut) -> dict[int, int]:
    """Shares of the edge of a cut by its ends (0, 1); an end that has no area has none."""
    shares = points.shares
    return {int(shares.place[i]): int(i) for i in np.flatnonzero(shares.edge == c.edge)}
