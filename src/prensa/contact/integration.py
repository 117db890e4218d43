"""Quadrature of the contact terms: integration points on a candidate surface, their shape values and their weights.

A point lies at x = Σ N_a x_a of the surface nodes that carry it, its force goes to them with the same N_a, so that the
virtual work ∫ t·δu dΓ ≈ Σ w_q t_q·δu_q decides everything. The rules (the paper's open question, docs/theory/contact.md) are in
`prensa.contact.rules`, a file each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from prensa.layout import Field
from prensa.mesh.mesh import areas, beyond_corners, corner_cells, segments, sides
from prensa.types import Array, Flags, Index

# By the depth alone a penalty gives way far too much on deep elements. Two edges and not one, so that no square element
# changes.
SPREAD = 2.0  # edge lengths of material that one point presses in, however deep the elements behind are: docs/developer/book/04


class Rule(Protocol):
    """What points know of the rule that placed them; see `prensa.contact.rule.IntegrationRule`."""

    projected: ClassVar[bool]
    cuts: ClassVar[bool]
    point: ClassVar[str]

    @property
    def type(self) -> str:
        """Name in a case file."""

    def points(self, surface: Candidates) -> Points:
        """The contact points on a surface, in walking order."""


class Shares(NamedTuple):
    """Parts of edges that points stand for: (s,) point, edge, factor of its length.

    ``at``: place ξ on the edge where 2πr is taken; ``place``: where the point lies.
    """

    point: Index
    edge: Index
    factor: Array
    at: Array
    place: Array

    def rows(self, of: Index) -> Shares:
        """Some of the shares."""
        return Shares(self.point[of], self.edge[of], self.factor[of], self.at[of], self.place[of])

    @staticmethod
    def joined(parts: Sequence[Shares]) -> Shares:
        """Shares of several lists, one list after another."""
        return Shares(*(np.concatenate(values) for values in zip(*parts)))


@dataclass(frozen=True)
class Points:
    """k contact points on a surface of n nodes.

    ``nodes`` (n,) global numbers in walking order, ``edges`` (m, 2) with the body on the left (of quadratic ones the two
    pieces between neighbouring nodes); ``support`` (k, a) nodes that carry a point and ``N`` (k, a) their shape values;
    ``depth`` (k,) size of the adjacent elements into the body, in the initial mesh, and ``pressed`` (m,) the share of it that
    an edge presses in alone; ``shares``: the parts of the edges that make the weights, ``lumped`` those of the nodes.
    ``with_neighbours``: whether the points are nodes that share what a sharp
    corner covers with their neighbours (`prensa.contact.cut`).
    """

    rule: Rule
    nodes: Index
    edges: Index
    support: Index
    N: Array
    depth: Array
    pressed: Array
    shares: Shares
    lumped: Shares
    axisymmetric: bool
    thickness: float
    with_neighbours: bool = False

    def __len__(self) -> int:
        return len(self.support)

    def measure(self, x: Array, edge: Index, at: Array) -> Array:
        """Length times thickness or 2πr(ξ) of edges on node positions x (n, 2)."""
        a, b = x[self.edges[edge, 0]], x[self.edges[edge, 1]]
        length = np.hypot(*(b - a).T)
        return length * (2 * np.pi * ((1 - at) * a[:, 0] + at * b[:, 0]) if self.axisymmetric else self.thickness)

    def weights(self, x: Array) -> Array:
        """Areas (k,) of the points on node positions x (n, 2) of the whole system."""
        return self._areas(x, self.shares, len(self))

    def _areas(self, x: Array, s: Shares, n: int) -> Array:
        parts = s.factor * self.measure(x, s.edge, s.at)
        return np.asarray(np.bincount(s.point, parts, n), dtype=np.float64)

    def beyond_corners(self, x: Array, closed: Flags) -> Array:
        """What of the areas (k,) lies on edges that leave the tool at a corner of the body, some points closed."""
        touching = np.zeros(len(x), dtype=bool)
        touching[self.nodes[self.any_at_nodes(closed)]] = True
        off = np.flatnonzero(beyond_corners(x, self.edges, touching)[self.shares.edge])
        return self._areas(x, self.shares.rows(off), len(self))

    def slopes(self, x: Array) -> Array:
        """∂w/∂x (s, 2, 2) of the shares' areas on positions x (n, 2): share, end of its edge that moves, axis."""
        s = self.shares
        a, b = x[self.edges[s.edge, 0]], x[self.edges[s.edge, 1]]
        t = b - a
        length = np.hypot(*t.T)
        # The first end pulls the edge longer as it goes back along it, the second as it goes on.
        dL = np.stack([-t, t], axis=1) / length[:, None, None]
        if not self.axisymmetric:
            return np.asarray(self.thickness * s.factor[:, None, None] * dL)
        N = np.stack([1 - s.at, s.at], axis=1)
        out = (N[:, 0] * a[:, 0] + N[:, 1] * b[:, 0])[:, None, None] * dL
        out[:, :, 0] += length[:, None] * N  # the radius is the mean of both ends', by their shares
        return np.asarray(2 * np.pi * s.factor[:, None, None] * out)

    def stretched_dofs(self, field: Field, dofs: Index, own: Index) -> Index:
        """Degrees of freedom (s, m + 4 + t) of `stretching`: ``field`` of the displacements, dofs (k, m), own (k, t)."""
        s = self.shares
        ends = field.dofs(self.edges[s.edge]).reshape(len(s.edge), -1)
        return np.hstack([dofs[s.point], ends, own[s.point]])

    def stretching(self, x: Array, force: Array, own: Array) -> Array:
        """Stiffness (s, m + 4 + t, m + 4 + t) of areas that change with both nodes of the shares' edges, on positions x (n, 2).

        force (k, m): forces on the unknowns of the stencils per area of the points; own (k, t): what their own equations gain per
        area.
        """
        s, m, t = self.shares, force.shape[1], own.shape[1]
        slopes = self.slopes(x).reshape(-1, 1, 4)
        K = np.zeros((len(slopes), m + 4 + t, m + 4 + t))
        K[:, :m, m : m + 4] = -force[s.point][:, :, None] * slopes
        K[:, m + 4 :, m : m + 4] = own[s.point][:, :, None] * slopes
        return K

    @cached_property
    def beside(self) -> tuple[Index, Index]:
        """Points and edges, pair by pair, of which a point has a share in an edge."""
        has = self.shares.factor > 0
        return self.shares.point[has], self.shares.edge[has]

    def elements_behind(self, cells: Index) -> Index:
        """Elements (m,) of cells (e, a) that the edges are sides of."""
        return behind(self.edges, cells)

    def normals(self, x: Array) -> Array:
        """`point_normals`."""
        return point_normals(self, x)

    def node_normals(self, x: Array) -> Array:
        """`node_normals` of its nodes."""
        return node_normals(x, self.nodes, self.edges)

    def tributary(self, x: Array) -> Array:
        """∫ N_A dΓ (n,) of the surface nodes on positions x of the whole system: the trapezoid-lumped mass, exact."""
        return self._areas(x, self.lumped, len(self.nodes))

    def at(self, values: Array) -> Array:
        """Nodal values (n, …) of the whole system interpolated to the points (k, …)."""
        if self.N.shape[1] == 1:  # points that are nodes
            return values.take(self.support[:, 0], axis=0)
        return np.asarray(np.einsum("ka,ka...->k...", self.N, values[self.support]))

    @cached_property
    def pressed_length(self) -> Array:
        """Length (k,) of material that a point presses in: the depth, or `SPREAD` edges where that is less."""
        s = self.shares
        mean = np.bincount(s.point, self.pressed[s.edge], len(self)) / np.bincount(s.point, minlength=len(self))
        return self.depth * mean

    @cached_property
    def coefficients(self) -> Array:
        """Of the nodes that carry a point and of the tool's reference point (k, a + 1) in stencils: N, −1."""
        return np.hstack([self.N, np.full((len(self), 1), -1.0)])

    @cached_property
    def are_nodes(self) -> bool:
        """Whether the points are the nodes of the surface, one by one."""
        return self.N.shape[1] == 1 and self.one_a_node

    @cached_property
    def one_a_node(self) -> bool:
        """Whether every node of the surface has one point, at it or, beside an axis of revolution, near it."""
        return not self.with_neighbours and np.array_equal(self.support[:, 0], self.nodes)

    @cached_property
    def pairs_at_axis(self) -> Index:
        """Numbers (e, 2) of the points of quadratic edges that end on the axis, that on it last (`prensa.contact.axis`)."""
        beside = np.flatnonzero(self.N[:, 0] < 1.0) if self.one_a_node else np.zeros(0, dtype=np.int64)
        return np.column_stack([beside, self.slots[beside, min(1, self.N.shape[1] - 1)]])

    @cached_property
    def slots(self) -> Index:
        """Places (k, a) of the supporting nodes in ``nodes``."""
        number = np.full(int(self.nodes.max()) + 1, -1, dtype=np.int64)
        number[self.nodes] = np.arange(len(self.nodes))
        return number[self.support]

    def to_nodes(self, values: Array) -> Array:
        """Σ_q N_A values_q (n, …) at the surface nodes: forces of the points (k, …) as nodal forces."""
        out = np.zeros((len(self.nodes), *values.shape[1:]))
        for a in range(self.N.shape[1]):
            np.add.at(out, self.slots[:, a], self.N[:, a].reshape(-1, *[1] * (values.ndim - 1)) * values)
        return out

    @cached_property
    def has_point(self) -> Flags:
        """Whether some point has a share in the node (n,): one without area has none."""
        return self.any_at_nodes(np.ones(len(self), dtype=bool))

    def any_at_nodes(self, flags: Flags) -> Flags:
        """Whether some point (k,) with a share in the node (n,) has its flag set."""
        out = np.zeros(len(self.nodes), dtype=bool)
        out[self.slots[flags[:, None] & (self.N > 0)]] = True
        return out


def edge_normals(x: Array, edges: Index) -> Array:
    """Outward normals (m, 2) times length of edges with the body on the left."""
    t = x[edges[:, 1]] - x[edges[:, 0]]
    return np.stack([t[:, 1], -t[:, 0]], axis=1)


def node_normals(x: Array, nodes: Index, edges: Index) -> Array:
    """Outward unit normals (n, 2) of a surface at its nodes, weighted by edge length."""
    n = edge_normals(x, edges)
    out = np.zeros_like(x)
    np.add.at(out, edges[:, 0], n)
    np.add.at(out, edges[:, 1], n)
    return out[nodes] / np.hypot(*out[nodes].T)[:, None]


def point_normals(points: Points, x: Array) -> Array:
    """Outward unit normals (k, 2) of the surface at the points: of the edge inside it, averaged at a node and near it."""
    # A point inside an edge has one share, so its edge is unique; what the others get here is not read.
    inside = (points.N.max(axis=1) < 1.0) & (not points.one_a_node)
    at_nodes = np.zeros_like(x)
    at_nodes[points.nodes] = node_normals(x, points.nodes, points.edges)
    n = points.at(at_nodes)
    edge = np.zeros(len(points), dtype=np.int64)
    edge[points.shares.point] = points.shares.edge
    n[inside] = edge_normals(x, points.edges)[edge[inside]]
    return n / np.hypot(*n.T)[:, None]


def behind(edges: Index, cells: Index) -> Index:
    """Elements (m,) of which the oriented edges (m, 2|3), or their pieces (m, 2), are a side, cells (e, a)."""
    some = sides(cells)
    number = np.repeat(np.arange(len(cells)), some.shape[1])
    flat = some.reshape(-1, some.shape[2])
    if flat.shape[1] == 3:
        flat, number = np.concatenate([flat[:, :2], segments(flat)]), np.concatenate([number, np.repeat(number, 2)])
    base = int(cells.max()) + 1
    # few of the sides are edges of the surface: the others need not be sorted
    near = np.zeros(base, dtype=bool)
    near[edges[:, :2]] = True
    mine = near[flat[:, 0]] & near[flat[:, 1]]
    keys, owner = flat[mine, 0] * base + flat[mine, 1], number[mine]
    order = np.argsort(keys)
    wanted = edges[:, 0] * base + edges[:, 1]
    place = order[np.searchsorted(keys, wanted, sorter=order)]
    return np.asarray(owner[place], dtype=np.int64)


def depth_of(edges: Index, cells: Index, points: Array) -> Array:
    """Size (m,) into the body of the element behind each surface edge (m, 2|3): area over length, twice that of a triangle."""
    length = np.hypot(*(points[edges[:, 1]] - points[edges[:, 0]]).T)
    twice = 2.0 if len(corner_cells(cells)[0]) == 3 else 1.0
    # Area over edge length is the depth of a quadrilateral, but half the height of a triangle.
    return np.asarray(twice * areas(points, cells)[behind(edges, cells)] / length)


@dataclass(frozen=True)
class Candidates:
    """A surface on which a rule places its points.

    ``X`` (all nodes, 2) initial positions; ``nodes`` (n,) in walking order; ``edges`` (m, 2) of straight edges or of the two
    pieces of quadratic ones, body on the left, and the ``depth`` (m,) of the elements behind them, of which they press in the
    share ``pressed`` (m,); ``node_depth`` (n,) the depth at the nodes; ``nodal``: the shares of the nodes; ``middle`` (n,):
    whether a node is the middle of a quadratic edge.
    """

    rule: Rule
    X: Array
    nodes: Index
    edges: Index
    depth: Array
    pressed: Array
    node_depth: Array
    nodal: Shares
    middle: Flags
    axisymmetric: bool
    thickness: float

    def tributary(self) -> Array:
        """∫ N_A dΓ (n,) of the nodes."""
        return self.all_of(self.nodes[:, None], np.ones((len(self.nodes), 1)), self.node_depth, self.nodal).weights(self.X)

    def slots(self, nodes: Index) -> Index:
        """Places of nodes of any shape in ``nodes``."""
        order = np.argsort(self.nodes)
        return np.asarray(order[np.searchsorted(self.nodes, nodes, sorter=order)], dtype=np.int64)

    def all_of(self, support: Index, N: Array, depth: Array, shares: Shares) -> Points:
        """Points carried by the nodes ``support`` (k, a) with shape values N (k, a), whose weights are ``shares``."""
        return Points(
            self.rule, self.nodes, self.edges, support, N, depth, self.pressed, shares, self.nodal, self.axisymmetric,
            self.thickness,
        )  # fmt: skip

    def with_area(self, support: Index, N: Array, depth: Array, shares: Shares, along: Index | None = None) -> Points:
        """As `all_of`, but those that have an area alone, in the order ``along``."""
        return _with_area(self.all_of(support, N, depth, shares), self.X, along)


def points_of(
    rule: Rule, X: Array, nodes: Index, edges: Index, depth: Array, axisymmetric: bool, thickness: float
) -> Points:
    """Contact points of a rule on a surface: X (all nodes, 2) initial positions, edges (m, 2|3), depth (m,) behind them.

    A point that has no area (on the axis of revolution Simpson's) is left out.
    """
    number = np.full(int(nodes.max()) + 1, -1, dtype=np.int64)
    number[nodes] = np.arange(len(nodes))
    quadratic = edges.shape[1] == 3
    middle = edges[:, 2:].ravel()
    pressed = np.minimum(1.0, SPREAD * np.hypot(*(X[edges[:, 1]] - X[edges[:, 0]]).T) / depth)
    if quadratic:
        edges, depth, pressed = segments(edges), np.repeat(depth, 2), np.repeat(pressed, 2)
    walking = np.argsort(number[edges[:, 0]], kind="stable")
    edges, depth, pressed = edges[walking], depth[walking], pressed[walking]
    m = len(edges)
    ends = edges.T.ravel()  # first ends, then second ends
    total = np.bincount(ends, np.tile(depth, 2), len(number))
    at_nodes = total[nodes] / np.bincount(ends, minlength=len(number))[nodes]
    # ∫ N_A r over a straight edge is half its length times r at a third from node A: exact in axisymmetry with one value of r a
    # share.
    third = np.repeat([1 / 3, 2 / 3], m)
    nodal = Shares(number[ends], np.tile(np.arange(m), 2), np.full(2 * m, 0.5), third, np.repeat([0.0, 1.0], m))
    if quadratic:
        # Simpson's points are the nodes: the product of a quadratic N_A and a linear radius is integrated exactly
        nodal = nodal._replace(factor=np.where(np.isin(ends, middle), 2 / 3, 1 / 3), at=nodal.place)
    at_middle = np.isin(nodes, middle)
    return rule.points(
        Candidates(rule, X, nodes, edges, depth, pressed, at_nodes, nodal, at_middle, axisymmetric, thickness)
    )


def _with_area(points: Points, X: Array, along: Index | None = None) -> Points:
    """The points that have an area on positions X, in the order ``along``."""
    weight = points.weights(X)
    along = np.arange(len(points)) if along is None else along
    # On the axis 2πr vanishes to round-off only; a point of that weight would have a pressure that no force determines.
    along = along[weight[along] > 1e-12 * weight.max()]
    new = np.full(len(points), -1)
    new[along] = np.arange(len(along))
    s = points.shares
    kept = np.flatnonzero(new[s.point] >= 0)
    shares = s._replace(point=new[s.point]).rows(kept)
    return replace(points, support=points.support[along], N=points.N[along], depth=points.depth[along], shares=shares)
