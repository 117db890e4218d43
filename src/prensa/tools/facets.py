"""Normals of a surface that triangles stand for.

An edge between triangles is sharp from an angle on; what sharp edges part has normals of its own. Across the others the surface
is smooth. Its normals at the corners begin as means of those of the triangles around, weighted with their angles, and are turned
so that the sides of triangles become arcs, n_a·d = −n_b·d with d from end to end: that is so on spheres, on cylinders, and where
these begin in flats, whatever the triangles are, and elsewhere but for terms of the third order in d. Least squares, in which the
means count a quarter: in regular strips normals that lean to and fro from line to line would make arcs as well.

The triangles on both sides of an edge share the angle between them. On a curved surface each has a part of it, half of it where
they are alike, and the normals at the ends of the edge lean by so much. A plane of several triangles from whose normal they lean
by less than half of that goes on straight up to the edge: a flat beside a fillet does, and the side of a cylinder; planes that do
so at all smooth edges are flats. There the normals are those of the plane or lie across the straight direction, and the others
are found again. (Quadrics fitted to the points around, Cazals & Pouget 2005, would mix what lies on both sides of such an edge.)
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from prensa.importers.stl import Surface
from prensa.precision import DRAWN
from prensa.types import Array, Flags, Index

SMOOTH, CREASE, BORDER = 0, 1, 2
"""What edges are."""
SIDE_CORNERS = np.array([[0, 1], [1, 2], [0, 2]])
"""Corners at the ends of the sides of a triangle."""


class Facets:
    """Triangles of a surface, what their edges are, and normals at their corners; ``sharp``: angle from which an edge is."""

    def __init__(self, surface: Surface, sharp: float) -> None:
        self.surface = surface
        self.x = np.ascontiguousarray(surface.points[surface.triangles])
        self.size = float(np.abs(surface.points).max())
        n = np.cross(self.x[:, 1] - self.x[:, 0], self.x[:, 2] - self.x[:, 0])
        self.normals = n / np.linalg.norm(n, axis=1)[:, None]
        a, b = surface.sides.T
        sine = np.linalg.norm(np.cross(self.normals[a], self.normals[b]), axis=1)
        self._bend = np.arctan2(sine, np.einsum("ki,ki->k", self.normals[a], self.normals[b]))
        self.edge_kinds = np.where(b < 0, BORDER, np.where(self._bend > sharp, CREASE, SMOOTH))

    @cached_property
    def edge_angles(self) -> Array:
        """Angles (k,) between the triangles at smooth edges, 0 at others."""
        return np.where(self.edge_kinds == SMOOTH, self._bend, 0.0)

    @cached_property
    def side_edges(self) -> Index:
        """Numbers of the edges (m, 3) at the sides of triangles."""
        s, n = self.surface, len(self.surface.points)
        ends = np.sort(s.triangles[:, SIDE_CORNERS], axis=2)
        keys, wanted = s.edges[:, 0] * n + s.edges[:, 1], ends[..., 0] * n + ends[..., 1]
        order = np.argsort(keys)
        return np.asarray(order[np.searchsorted(keys[order], wanted)])

    @cached_property
    def angles(self) -> Array:
        """Angles (m, 3) of triangles at their corners."""
        u, v = np.roll(self.x, -1, axis=1) - self.x, np.roll(self.x, 1, axis=1) - self.x
        return np.arctan2(np.linalg.norm(np.cross(u, v), axis=2), np.einsum("mci,mci->mc", u, v))

    @cached_property
    def corner_normals(self) -> Array:
        """Unit normals (m, 3, 3) at the corners of triangles; see the module."""
        return self._normals_and_flats[0]

    @cached_property
    def flats(self) -> Flags:
        """Which triangles (m,) belong to flats: planes that go on straight up to all their smooth edges."""
        return self._normals_and_flats[1]

    @property
    def largest_flat(self) -> Array | None:
        """Normal (3,) of the flat with the largest area; None if there is none."""
        double = np.linalg.norm(np.cross(self.x[:, 1] - self.x[:, 0], self.x[:, 2] - self.x[:, 0]), axis=1)
        area = np.bincount(self._regions, weights=np.where(self.flats, double, 0.0))
        return self.normals[np.argmax(self._regions == np.argmax(area))] if area.any() else None

    @cached_property
    def _normals_and_flats(self) -> tuple[Array, Flags]:
        straight = np.zeros((len(self.surface.edges), 2), dtype=bool)
        while True:
            flat = self._flat(straight)
            normals = self._arcs(*self._held(self._means(flat), flat, straight))
            more = straight | self._straight(normals)
            if (more == straight).all():
                break
            straight = more
        at, f = normals[self.groups].reshape(-1, 3, 3), self.normals[:, None]
        # What a file's seven digits make of a flat is flat.
        same = np.abs(at - f).max(axis=2) < DRAWN
        return np.where(same[:, :, None], f, at), flat

    @cached_property
    def shape_operators(self) -> Array:
        """Derivatives (g, 3, 3) of the normals of groups along the surface, symmetric; those of flats' borders beyond the flats.

        Least squares over the edges at each, with weights between those for errors of the normals, which are alike, and for what
        operators miss, of the second order in the lengths of edges.
        """
        s, normals = self.surface, self.corner_normals.reshape(-1, 3)
        n = np.zeros((self.groups.max() + 1, 3))
        n[self.groups] = normals
        both = []
        for side in range(2):
            owner = s.sides[:, side]
            edge = np.flatnonzero((owner >= 0) & ~self.flats[owner])
            both.append(np.concatenate([self._at_ends(side, edge), edge[:, None]], axis=1))
        ends = np.unique(np.concatenate(both), axis=0)
        at, other = np.concatenate([ends[:, :2], ends[:, 1::-1]]).T
        d = s.points[s.edges[ends[:, 2], 1]] - s.points[s.edges[ends[:, 2], 0]]
        d = np.concatenate([d, -d])
        t = _tangents(n)
        weight = np.linalg.norm(d, axis=1) ** -1.5
        x, y = (np.einsum("kai,ki->ka", t[at], v * weight[:, None]) for v in (d, n[other] - n[at]))
        zero = np.zeros(len(x))
        rows = np.stack([np.stack([x[:, 0], x[:, 1], zero], axis=1), np.stack([zero, x[:, 0], x[:, 1]], axis=1)], axis=1)
        matrix, right = np.zeros((len(n), 3, 3)), np.zeros((len(n), 3))
        np.add.at(matrix, at, np.einsum("kai,kaj->kij", rows, rows))
        np.add.at(right, at, np.einsum("kai,ka->ki", rows, y))
        a, b, c = np.einsum("gij,gj->ig", np.linalg.pinv(matrix, rcond=DRAWN, hermitian=True), right)
        inner = np.stack([np.stack([a, b], axis=1), np.stack([b, c], axis=1)], axis=1)
        return np.asarray(np.einsum("gab,gai,gbj->gij", inner, t, t))

    def _means(self, flat: Flags) -> Array:
        """Mean normals (g, 3) of groups, weighted with the angles of triangles there; at flats, theirs alone.

        (Weights that are exact on spheres, Max 1999, leave out what is large, such as a flat in long triangles beside a fillet.)
        """
        group, of_flat = self.groups, np.repeat(flat, 3)
        at_flat = np.bincount(group, weights=of_flat) > 0
        share = (self.angles[:, :, None] * self.normals[:, None]).reshape(-1, 3)
        share = np.where((at_flat[group] & ~of_flat)[:, None], 0.0, share)
        total = np.stack([np.bincount(group, weights=share[:, c]) for c in range(3)], axis=1)
        return np.asarray(total / np.linalg.norm(total, axis=1)[:, None])

    def corners_at(self, owner: Index, point: Index) -> Index:
        """Numbers (k,) of the corners, three a triangle, of triangles (k,) at points of theirs (k,)."""
        return 3 * owner + np.argmax(self.surface.triangles[owner] == point[:, None], axis=1)

    @cached_property
    def groups(self) -> Index:
        """Numbers (3 m,) of the corners that have one normal: those that no sharp edge parts around a point."""
        smooth, s = np.flatnonzero(self.edge_kinds == SMOOTH), self.surface
        pairs = [[self.corners_at(s.sides[smooth, k], s.edges[smooth, end]) for end in range(2)] for k in range(2)]
        return _connected(3 * len(s.triangles), np.concatenate(pairs[0]), np.concatenate(pairs[1]))

    @cached_property
    def around(self) -> tuple[Index, Index, Index]:
        """Groups of the corners of triangles (m, 3), and where in a list (3 m,) the triangles of each group begin (g + 1,)."""
        group = self.groups
        start = np.concatenate([[0], np.cumsum(np.bincount(group))])
        return group.reshape(-1, 3), start, np.argsort(group, kind="stable") // 3

    @cached_property
    def _regions(self) -> Index:
        """Numbers (m,) of the planes that triangles lie in with their neighbours."""
        a, b = self.surface.sides.T
        # Seen from either side, the other triangle rises by its corner that is farthest off the plane.
        rise = [
            np.abs(np.einsum("kci,ki->kc", self.x[o] - self.x[p][:, :1], self.normals[p])).max(axis=1)
            for o, p in ((a, b), (b, a))
        ]
        even = (self.edge_kinds == SMOOTH) & (np.maximum(*rise) < DRAWN * self.size)
        return _connected(len(self.normals), a[even], b[even])

    @cached_property
    def _bounds(self) -> Index:
        """Smooth edges (b,) between planes."""
        a, b = self._regions[self.surface.sides].T
        return np.flatnonzero((self.edge_kinds == SMOOTH) & (a != b))

    def _across(self, side: int, edge: Index) -> Array:
        """Unit vectors (k, 3) across edges (k,) in the planes of the triangles on a side of them."""
        s = self.surface
        out = np.cross(self.normals[s.sides[edge, side]], s.points[s.edges[edge, 1]] - s.points[s.edges[edge, 0]])
        return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])

    def _at_ends(self, side: int, edge: Index) -> Index:
        """Groups (k, 2) at the ends of edges (k,), of the triangles on a side of them."""
        s = self.surface
        owner = s.sides[edge, side]
        return np.stack([self.groups[self.corners_at(owner, s.edges[edge, end])] for end in range(2)], axis=1)

    @cached_property
    def _ends(self) -> Index:
        """Groups at both ends of edges, and the edge (e, 3); sharp ones twice, of either side."""
        both = []
        for side in range(2):
            edge = np.flatnonzero(self.surface.sides[:, side] >= 0)
            both.append(np.concatenate([self._at_ends(side, edge), edge[:, None]], axis=1))
        return np.unique(np.concatenate(both), axis=0)  # both sides of a smooth edge say the same

    def _straight(self, normals: Array) -> Flags:
        """Whether with normals (g, 3) the planes on either side (2,) of edges (k,) go on straight up to them; see the module.

        Planes of several triangles: single ones of curved surfaces do so by chance.
        """
        s, edge = self.surface, self._bounds
        several = np.bincount(self._regions)[self._regions] > 1
        out = np.zeros((len(s.edges), 2), dtype=bool)
        for side in range(2):
            lean = np.einsum("kei,ki->ke", normals[self._at_ends(side, edge)], self._across(side, edge))
            out[edge, side] = several[s.sides[edge, side]] & (np.abs(lean).max(axis=1) < 0.25 * self._bend[edge])
        return out

    def _flat(self, straight: Flags) -> Flags:
        """Which triangles (m,) are of planes that go on ``straight`` (k, 2) up to all their smooth edges."""
        region, edge = self._regions, self._bounds
        flat = np.ones(region.max() + 1, dtype=bool)
        flat[region[self.surface.sides[edge]][~straight[edge]]] = False
        return flat[region]

    def _held(self, normals: Array, flat: Flags, straight: Flags) -> tuple[Array, Array]:
        """Normals (g, 3) of groups and two directions (g, 2, 3) in which they may turn, each 0 if not.

        They are held at flats, beside other planes across the direction in which these go on straight, and where all triangles
        around turn about one line, as in long strips of a cylinder between slanted rims, across that line.
        """
        across = np.zeros((len(normals), 3, 3))
        for side in range(2):
            edge = np.flatnonzero(straight[:, side])
            m = self._across(side, edge)
            for group in self._at_ends(side, edge).T:
                np.add.at(across, group, m[:, :, None] * m[:, None])
        held = np.bincount(self.groups, weights=np.repeat(flat, 3)) > 0
        values, vectors = np.linalg.eigh(across)
        line, m = ~held & (values[:, 2] > 0.5), vectors[:, :, 2]
        out = normals - np.where(line, np.einsum("gi,gi->g", normals, m), 0.0)[:, None] * m
        out /= np.linalg.norm(out, axis=1)[:, None]
        t = self._turning(_tangents(out))
        t[line, 0], t[line, 1] = 0.0, np.cross(out, m)[line]
        t[held] = 0.0
        return out, t

    def _turning(self, t: Array) -> Array:
        """Directions (g, 2, 3) of groups, turned to the principal ones of the normals around; 0 if these all lie across one.

        Around are the triangles of a group, and of the groups at their other corners.
        """
        group, f = self.groups, self.normals

        def summed(corners: Array) -> Array:
            return np.stack([np.bincount(group, weights=c, minlength=len(t)) for c in corners.T], axis=1)

        here = summed(np.repeat((f[:, :, None] * f[:, None]).reshape(-1, 9), 3, axis=0))
        around = summed(np.repeat(here[group].reshape(-1, 3, 9).sum(axis=1), 3, axis=0)).reshape(-1, 3, 3)
        values, vectors = np.linalg.eigh(np.einsum("gai,gij,gbj->gab", t, around, t))
        out = np.einsum("gab,gai->gbi", vectors, t)
        out[values[:, 0] < DRAWN * values[:, 1], 0] = 0.0
        return out

    def _arcs(self, normals: Array, t: Array) -> Array:
        """Normals (g, 3) of groups, turned in directions t (g, 2, 3) so that sides become arcs; see the module."""
        from scipy.sparse import coo_array
        from scipy.sparse.linalg import lsqr

        s = self.surface
        ends = self._ends
        d = s.points[s.edges[ends[:, 2], 1]] - s.points[s.edges[ends[:, 2], 0]]
        d /= np.linalg.norm(d, axis=1)[:, None]
        right = -np.einsum("ki,ki->k", normals[ends[:, 0]] + normals[ends[:, 1]], d)
        rows = np.repeat(np.arange(len(d)), 4)
        columns = (2 * ends[:, :2, None] + np.arange(2)).reshape(-1)
        values = np.einsum("keai,ki->kea", t[ends[:, :2]], d)
        A = coo_array((values.ravel(), (rows, columns)), shape=(len(d), 2 * len(normals))).tocsr()
        change = lsqr(A, right, damp=0.25)[0].reshape(-1, 2)
        out = normals + np.einsum("ga,gai->gi", change, t)
        return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])


def angles_between(a: Array, b: Array) -> Array:
    """Angles (...) between vectors (..., 3)."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)))


def _connected(count: int, a: Index, b: Index) -> Index:
    """Numbers (count,) of the sets that pairs of a and b (k,) make of things."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(a)), (a, b)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _tangents(n: Array) -> Array:
    """Two unit vectors (k, 2, 3) across each of unit vectors (k, 3) and each other."""
    e = np.eye(3)[np.abs(n).argmin(axis=1)]
    u = np.cross(n, e)
    u /= np.linalg.norm(u, axis=1)[:, None]
    return np.stack([u, np.cross(n, u)], axis=1)
