"""Normals of a surface that triangles stand for.

An edge between triangles is sharp from an angle on; what sharp edges part has normals of its own. Across the others the surface
is smooth. Its normals at the corners begin as means of those of the triangles around, weighted with their angles, and are mended

* where the surface goes on straight up to an edge: its normal there is that of the plane in which the triangle lies. Triangles on
  a surface of curvature κ meet at the angle κ (h + h') with the distances h, h' of the middles of the circles around them from
  their edge; beside a flat, or along the side of a cylinder, it is κ h alone. κ is that of the edges beyond, weighted with how
  parallel they are. Triangles in one plane that go on straight up to all their smooth edges are a flat;
* elsewhere so that the sides of triangles become arcs, n_a·d = −n_b·d with d from end to end: that is so on spheres, cylinders,
  cones, and where these begin in flats, whatever the triangles are. Least squares, in which the means count a quarter.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from prensa.importers.stl import Surface
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.types import Array, Flags, Index

SMOOTH, CREASE, BORDER = 0, 1, 2
"""What edges are."""
CORNER_TURN = 0.01
"""Angle by which the outline of a plane turns at a corner; what mesh generators put on a straight line turns by less."""
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
        group, f = self._groups, self.normals
        of_flat = np.repeat(self.flats, 3)
        there = np.bincount(group, weights=of_flat) > 0
        share = (self.angles[:, :, None] * f[:, None]).reshape(-1, 3)
        share = np.where((there[group] & ~of_flat)[:, None], 0.0, share)
        total = np.stack([np.bincount(group, weights=share[:, c]) for c in range(3)], axis=1)
        mended = self._arcs(total / np.linalg.norm(total, axis=1)[:, None], there)
        normals = mended[group].reshape(-1, 3, 3)
        # What a file's seven digits make of a flat is flat.
        same = np.abs(normals - f[:, None]).max(axis=2) < DRAWN
        return np.where(same[:, :, None], f[:, None], normals)

    def corners_at(self, owner: Index, point: Index) -> Index:
        """Numbers (k,) of the corners, three a triangle, of triangles (k,) at points of theirs (k,)."""
        return 3 * owner + np.argmax(self.surface.triangles[owner] == point[:, None], axis=1)

    def _opposite(self, edge: Index, side: int) -> Index:
        """Which corners (k,) of the triangles on a side of edges (k,) are not on these."""
        s = self.surface
        t, e = s.triangles[s.sides[edge, side]], s.edges[edge]
        return np.asarray(np.argmax((t != e[:, :1]) & (t != e[:, 1:]), axis=1))

    @cached_property
    def _groups(self) -> Index:
        """Numbers (3 m,) of the corners that have one normal: those that no sharp edge parts around a point."""
        smooth, s = np.flatnonzero(self.edge_kinds == SMOOTH), self.surface
        pairs = [[self.corners_at(s.sides[smooth, k], s.edges[smooth, end]) for end in range(2)] for k in range(2)]
        return _connected(3 * len(s.triangles), np.concatenate(pairs[0]), np.concatenate(pairs[1]))

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
    def _straight(self) -> Flags:
        """Whether at an edge (k,) the triangles of either side (2,) go on straight up to it; see the module."""
        s, region = self.surface, self._regions
        ends = region[s.sides]
        edge = np.flatnonzero((self.edge_kinds == SMOOTH) & (ends[:, 0] != ends[:, 1]))
        d = s.points[s.edges[edge, 1]] - s.points[s.edges[edge, 0]]
        length = np.linalg.norm(d, axis=1)
        d /= length[:, None]
        # The circle around a triangle has its middle so far from a side.
        angle = np.stack([self.angles[s.sides[edge, k], self._opposite(edge, k)] for k in range(2)], axis=1)
        h = 0.5 * length[:, None] / np.tan(angle)
        opposite = self.x.reshape(-1, 3)[3 * s.sides[edge, 1] + self._opposite(edge, 1)]
        rise = np.einsum("ki,ki->k", opposite - s.points[s.edges[edge, 0]], self.normals[s.sides[edge, 0]])
        bend = -np.sign(rise) * self._bend[edge]
        _, pair = np.unique(np.sort(ends[edge], axis=1), axis=0, return_inverse=True)
        weight = length[:, None, None] * d[:, :, None] * d[:, None]
        off = np.full((len(edge), 2), np.inf)
        for side in range(2):
            sums = []
            for what in (bend, h.sum(axis=1)):
                # Of the edges around the region beyond, but those that it shares with the one on this side.
                around, shared = np.zeros((region.max() + 1, 3, 3)), np.zeros((len(edge), 3, 3))
                np.add.at(around, ends[edge].ravel(), np.repeat(what[:, None, None] * weight, 2, axis=0))
                np.add.at(shared, pair.ravel(), what[:, None, None] * weight)
                sums.append(np.einsum("ki,kij,kj->k", d, around[ends[edge, 1 - side]] - shared[pair.ravel()], d))
            known = (h[:, side] > 0.0) & (sums[1] > NEGLIGIBLE * length**2)
            curvature = sums[0] / np.where(known, sums[1], 1.0)
            straight, arc = curvature * h[:, 1 - side], curvature * h.sum(axis=1)
            fits = known & (np.abs(bend - straight) < np.minimum(np.abs(bend - arc), 0.5 * np.abs(bend)))
            off[fits, side] = np.abs(bend - straight)[fits]
        # Where both did there would be no bend.
        out = np.zeros((len(s.edges), 2), dtype=bool)
        out[edge] = np.isfinite(off) & (off <= off[:, ::-1])
        # A plane of many corners is none of the facets beside it, however its own triangles lie in it.
        many, smooth = self._polygons[ends], np.zeros(len(ends), dtype=bool)
        smooth[edge] = True
        plane = smooth[:, None] & many & ~many[:, ::-1]
        return np.where(plane.any(axis=1, keepdims=True), plane, out)

    @cached_property
    def _polygons(self) -> Flags:
        """Which of the planes (r,) have outlines of more than four corners: no facets of a curved surface, which have three.

        Or four, two triangles of a cylinder, cone or torus. Points in the middle of straight stretches are no corners.
        """
        s, region = self.surface, self._regions
        ends = np.where(s.sides >= 0, region[s.sides], -1)
        edge, side = np.nonzero((ends[:, :1] != ends[:, 1:]) & (ends >= 0))
        # Each stretch of an outline at both of its ends, its direction away from there.
        owner = np.concatenate([ends[edge, side]] * 2)
        point = np.concatenate([s.edges[edge, 0], s.edges[edge, 1]])
        d = np.tile(s.points[s.edges[edge, 1]] - s.points[s.edges[edge, 0]], (2, 1))
        d[len(edge) :] *= -1.0
        order = np.lexsort((point, owner))
        owner, point, d = owner[order], point[order], d[order]
        _, first, count = np.unique(owner * len(s.points) + point, return_index=True, return_counts=True)
        a, b = d[first], d[np.minimum(first + 1, len(d) - 1)]
        turn = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), -np.einsum("ki,ki->k", a, b))
        corner = (count != 2) | (turn > CORNER_TURN)
        return np.bincount(owner[first][corner], minlength=region.max() + 1) > 4

    @cached_property
    def flats(self) -> Flags:
        """Which triangles (m,) belong to flats: those that go on straight up to all their smooth edges."""
        s, region = self.surface, self._regions
        ends = region[s.sides]
        flat = np.ones(region.max() + 1, dtype=bool)
        edge = (self.edge_kinds == SMOOTH) & (ends[:, 0] != ends[:, 1])
        flat[ends[edge[:, None] & ~self._straight]] = False
        return flat[region]

    def _held(self, normals: Array) -> tuple[Array, Array, Flags]:
        """Normals (g, 3) of groups across directions in which the surface goes on straight, these (g, 3), where they are."""
        s, group = self.surface, self._groups
        across = np.zeros((len(normals), 3, 3))
        for side in range(2):
            edge = np.flatnonzero(self._straight[:, side])
            owner, ends = s.sides[edge, side], s.edges[edge]
            m = np.cross(self.normals[owner], s.points[ends[:, 1]] - s.points[ends[:, 0]])
            m /= np.linalg.norm(m, axis=1)[:, None]
            for end in range(2):
                np.add.at(across, group[self.corners_at(owner, ends[:, end])], m[:, :, None] * m[:, None])
        values, vectors = np.linalg.eigh(across)
        there, m = values[:, 2] > 0.5, vectors[:, :, 2]
        out = normals - np.where(there, np.einsum("gi,gi->g", normals, m), 0.0)[:, None] * m
        return out / np.linalg.norm(out, axis=1)[:, None], m, there

    def _arcs(self, normals: Array, held: Flags) -> Array:
        """Normals (g, 3) of groups, mended so that sides are arcs, but those that are ``held``."""
        from scipy.sparse import coo_array
        from scipy.sparse.linalg import lsqr

        s, group = self.surface, self._groups
        ends = np.concatenate([
            np.stack([group[self.corners_at(s.sides[there, k], s.edges[there, end])] for end in range(2)] + [there], axis=1)
            for k in range(2) for there in [np.flatnonzero(s.sides[:, k] >= 0)]
        ])  # fmt: skip
        ends = np.unique(ends, axis=0)  # both sides of a smooth edge say the same
        d = s.points[s.edges[ends[:, 2], 1]] - s.points[s.edges[ends[:, 2], 0]]
        d /= np.linalg.norm(d, axis=1)[:, None]
        if not held.all():
            across, m, straight = self._held(normals)
            normals, straight = np.where(held[:, None], normals, across), straight & ~held
        else:
            m, straight = normals, ~held
        t = _tangents(normals)
        t[straight, 1] = np.cross(normals, m)[straight]
        t[straight, 0] = 0.0
        t[held] = 0.0
        right = -np.einsum("ki,ki->k", normals[ends[:, 0]] + normals[ends[:, 1]], d)
        rows = np.repeat(np.arange(len(d)), 4)
        columns = (2 * ends[:, :2, None] + np.arange(2)).reshape(-1)
        values = np.einsum("keai,ki->kea", t[ends[:, :2]], d)
        A = coo_array((values.ravel(), (rows, columns)), shape=(len(d), 2 * len(normals))).tocsr()
        change = lsqr(A, right, damp=0.25)[0].reshape(-1, 2)
        out = normals + np.einsum("ga,gai->gi", change, t)
        return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])


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
