"""Sides of curved patches: parabolas a + (b − a) s − c s (1 − s), with c from the normals at their ends.

A side is curved where its two normals n_a, n_b lean apart; else it is straight: a parabola would fold there, and a flat beside a
fillet, which leans at one end alone, stays flat. With d from end to end and the mean normal m, c·m = (d·n_a − d·n_b)/2: with both
conditions of Nagata (2005), c·n_a = d·n_a and c·n_b = −d·n_b, a side whose normals are nearly parallel and lean a little unlike
would wind.

That leaves free how a side bends within the surface. The shortest way between two points of the rim of a round fillet leaves
the rim and comes back, across the fillet's curvature, and no parabola follows how its normals turn; the rim itself is a circle.
So a side bends such that its normals turn alike at both ends: with the shape operators S there, t along the side and b across
it, its tangents turn by ±θ with b·S_a t + θ D_a = b·S_b t − θ D_b, where D = b·S b − t·S t. Where the curvatures along and
across differ by less than a quarter, or by less than they change from end to end, or where the operators say other turns along
the side than the normals at its ends, θ is uncertain and goes to zero (so on spheres and in flats). Bends are kept where they
make the surface smoother: where the patches around meet at smaller angles in the middles of their sides. Flats have the bends
as the curves that bound them alone.

Sides that bend unlike at a corner of a sliver fold it. Where a patch turns too far, the bends of its sides that run alike are set
to their mean curvature, as often as it takes; what turns too far then is a matter of normals, and becomes straight.
"""

from __future__ import annotations

import numpy as np

from prensa.precision import DRAWN, ROUND_OFF
from prensa.tools.facets import CREASE, SMOOTH, Facets, angles_between
from prensa.types import Array, Flags, Index

RINGS = 2
"""Rings of triangles around an edge in which bends are to make the surface smoother.

A ratio to no length: with one ring 2 of 26 fillets of Open CASCADE had normals more than 3° off, with two or three none.
"""
_LOOKS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 0.0], [1.0, 0.5], [0.5, 0.5], [0.75, 0.25]])
"""Places e, z on a patch at which it must not turn too far: corners, middles of sides, the inside."""


class Sides:
    """Sides of the patches of triangles; ``sharp``: angle by which one bends at most."""

    def __init__(self, facets: Facets, sharp: float) -> None:
        self.facets, self.sharp = facets, sharp
        s, normals = facets.surface, facets.corner_normals.reshape(-1, 3)
        self._d = s.points[s.edges[:, 1]] - s.points[s.edges[:, 0]]
        self._length = np.linalg.norm(self._d, axis=1)
        self._corners = np.stack(
            [np.stack([facets.corners_at(o, s.edges[:, e]) for e in range(2)], axis=1) for o in s.sides.T], axis=1
        )
        """Corners (k, 2, 2) of the triangles on both sides of edges, at both ends."""
        m = normals[self._corners[:, 0]].sum(axis=1)
        self._m = m / np.linalg.norm(m, axis=1)[:, None]
        self._side = (s.sides[facets.side_edges, 1] == np.arange(len(s.triangles))[:, None]).astype(np.int64)
        lean = angles_between(facets.corner_normals, facets.normals[:, None]).max(axis=1)
        self._least = np.cos(np.minimum(2.0 * lean, 0.5 * np.pi))

    def coefficients(self) -> tuple[Array, Array]:
        """Coefficients (m, 3, 3) of the sides of patches, and of the curves that bound them: see the module."""
        edge, bends = self.facets.side_edges, self._smoother(self._bends())
        own, curve = self._of(np.arange(len(bends)), bends)
        turned = self._turned(own[edge, self._side], np.arange(len(edge)))
        while turned.any():
            at, even = self._evened(bends, np.flatnonzero(turned))
            # What they differ by goes down by a third each time.
            if not (np.linalg.norm(even - bends[at], axis=1) > DRAWN * self._length[at]).any():
                break
            bends[at] = even
            own[at], curve[at] = self._of(at, even)
            around = self._at(at)
            turned[around] = self._turned(own[edge[around], self._side[around]], around)
        straight = np.zeros(len(bends), dtype=bool)
        while turned.any():
            # The steepest side becomes straight: of a sliver a long one, which a normal that is a little off bends too far.
            which = np.flatnonzero(turned)
            steepest = edge[which, np.argmax(self._slopes(own[edge[which], self._side[which]], which), axis=1)]
            straight[steepest] = True
            # The normals there are not right: sides beside it do not bend either.
            at = np.unique(edge[self._at(steepest)])
            own[at], curve[at] = self._of(at, np.zeros((len(at), 3)))
            own[straight], curve[straight] = 0.0, 0.0
            around = self._at(at)
            turned[around] = self._turned(own[edge[around], self._side[around]], around)
        return np.ascontiguousarray(own[edge, self._side]), np.ascontiguousarray(curve[edge])

    def _smoother(self, bends: Array) -> Array:
        """The bends (k, 3) that make the surface smoother than none: normals of patches differ less at middles of sides."""
        worse = self._rough(bends) >= self._rough(np.zeros_like(bends))
        return np.where(worse[:, None], 0.0, bends)

    def _rough(self, bends: Array) -> Array:
        """Sums (k,) of the angles at which patches meet in the middle of the sides of the triangles at edges that bend (k, 3)."""
        s, edge = self.facets.surface, self.facets.side_edges
        C, P = self._of(np.arange(len(bends)), bends)[0][edge, self._side], self.facets.x
        n = np.zeros((len(bends), 2, 3))
        for k, (e, z) in enumerate(_LOOKS[3:6]):
            n[edge[:, k], self._side[:, k]] = _normals(P, C, e, z)
        step = np.where(self.facets.edge_kinds == SMOOTH, angles_between(n[:, 0], n[:, 1]), 0.0)
        around = step[edge].sum(axis=1)
        for _ in range(RINGS):
            group = self.facets.groups.reshape(-1, 3)
            total = np.bincount(group.ravel(), weights=np.repeat(around, 3))
            around = total[group].sum(axis=1)
        return around[s.sides[:, 0]] + np.where(s.sides[:, 1] >= 0, around[s.sides[:, 1]], 0.0)

    def _at(self, edge: Index) -> Index:
        """Numbers (m,) of the triangles at edges (k,)."""
        out = np.unique(self.facets.surface.sides[edge])
        return out[out >= 0]

    def _of(self, edge: Index, bends: Array) -> tuple[Array, Array]:
        """Coefficients of edges (k,) that bend (k, 3), as sides of the patches at them (k, 2, 3), and as curves (k, 3)."""
        s, normals, d = self.facets.surface, self.facets.corner_normals.reshape(-1, 3), self._d[edge]
        A, right = np.zeros((len(d), 2, 3)), np.zeros((len(d), 2))
        for side in range(2):
            there = s.sides[edge, side] >= 0
            at = normals[self._corners[edge, side]]
            p, q = (np.einsum("ki,ki->k", at[:, end], d + way * bends) for end, way in ((0, -1.0), (1, 1.0)))
            # The tangents at the ends meet over the chord, and not all but at one end of it.
            less, more = np.minimum(abs(p), abs(q)), np.maximum(abs(p), abs(q))
            leans = there & (p * q < 0.0) & (less >= 0.25 * more) & (more > DRAWN * self._length[edge])
            A[:, side] = np.where(there[:, None], 0.5 * at.sum(axis=1), 0.0)
            right[:, side] = np.where(leans, 0.5 * (p - q), 0.0)
        own = A * (right / np.maximum(np.einsum("ksi,ksi->ks", A, A), ROUND_OFF))[:, :, None]
        both = np.einsum("kij,kj->ki", np.linalg.pinv(A, rcond=DRAWN), right)
        curve = np.where((self.facets.edge_kinds[edge] == CREASE)[:, None], both, own[:, 0] + bends)
        flat = self.facets.flats[s.sides[edge]]
        return own + np.where(flat[:, :, None], 0.0, bends[:, None]), curve

    def _bends(self) -> Array:
        """Coefficients (k, 3) of all edges within the surface, none but at smooth ones: see the module."""
        f = self.facets
        edge = np.flatnonzero(f.edge_kinds == SMOOTH)
        at, m, d = self._corners[edge, 0], self._m[edge], self._d[edge]
        t = d - np.einsum("ki,ki->k", d, m)[:, None] * m
        t /= np.linalg.norm(t, axis=1)[:, None]
        b = np.cross(m, t)
        S = f.shape_operators[f.groups[at]]
        along, across, twist = (np.einsum("ki,keij,kj->ke", x, S, y) for x, y in ((t, t), (b, b), (b, t)))
        D = 0.5 * (across - along).sum(axis=1)
        change = (np.diff(along, axis=1) ** 2 + np.diff(across, axis=1) ** 2)[:, 0]
        normals = f.corner_normals.reshape(-1, 3)
        turning = (normals[at[:, 1]] - normals[at[:, 0]]) / self._length[edge][:, None]
        missed = (along - np.einsum("ki,ki->k", turning, t)[:, None]) ** 2
        unsure = change + missed.sum(axis=1) + 0.25**2 * np.einsum("keij,keij->k", S, S)
        more = np.diff(twist, axis=1)[:, 0]
        mean = np.einsum("ki,ki->k", turning, b)
        more *= more**2 / np.maximum(more**2 + (twist.sum(axis=1) - 2.0 * mean) ** 2, np.finfo(float).tiny)
        turn = 0.5 * more * D / np.maximum(D**2 + unsure, np.finfo(float).tiny)
        turn = np.clip(turn, -0.5 * self.sharp, 0.5 * self.sharp)
        out = np.zeros_like(self._d)
        out[edge] = -(self._length[edge] * np.tan(turn))[:, None] * b
        return out

    def _evened(self, bends: Array, which: Index) -> tuple[Index, Array]:
        """The smooth edges (k,) of patches, and bends (k, 3) of the mean curvature of the sides there that run alike."""
        edge = self.facets.side_edges[which]
        square, t = self._length**2, self._d / self._length[:, None]
        share = np.einsum("msi,mri->msr", t[edge], t[edge]) ** 2 * square[edge][:, None]
        mean = np.einsum("msr,mri->msi", share, (bends / square[:, None])[edge]) / share.sum(axis=2)[:, :, None]
        at, number, count = np.unique(edge, return_inverse=True, return_counts=True)
        out = np.zeros((len(at), 3))
        np.add.at(out, number.reshape(edge.shape), mean)
        out *= (square[at] / count)[:, None]
        for v in (self._m[at], t[at]):
            out -= np.einsum("ki,ki->k", out, v)[:, None] * v
        smooth = self.facets.edge_kinds[at] == SMOOTH
        return at[smooth], out[smooth]

    def _slopes(self, C: Array, which: Index) -> Array:
        """How far sides C (m, 3, 3) of triangles rise from these (m, 3), over their heights there."""
        rise = np.abs(np.einsum("mki,mi->mk", C, self.facets.normals[which]))
        slopes = rise * self._length[self.facets.side_edges[which]]
        # A side that is curved within the triangle alone comes last, but comes.
        return np.where((C != 0.0).any(axis=2), np.maximum(slopes, np.finfo(float).tiny), 0.0)

    def _turned(self, C: Array, which: Index) -> Flags:
        """Which curved patches C (m, 3, 3) of triangles turn from these by more than twice what the normals at their corners do.

        Of a sphere, a cylinder or any surface that these normals are right of they turn by as much, wherever one looks.
        """
        P, normals, out = self.facets.x[which], self.facets.normals[which], np.zeros(len(C), dtype=bool)
        for e, z in _LOOKS:
            n = _normals(P, C, e, z)
            out |= np.einsum("mi,mi->m", n, normals) < self._least[which] * np.linalg.norm(n, axis=1)
        return out & (C != 0.0).any(axis=(1, 2))


def _normals(P: Array, C: Array, e: float, z: float) -> Array:
    """Normals (m, 3), of any length, of patches with corners P (m, 3, 3) and sides C (m, 3, 3) at a place e, z."""
    a, b = 1.0 - e, e - z
    xe = P[:, 1] - P[:, 0] - C[:, 0] * (a - b) - C[:, 1] * z + C[:, 2] * z
    xz = P[:, 2] - P[:, 1] + C[:, 0] * a - C[:, 1] * (b - z) - C[:, 2] * a
    return np.cross(xe, xz)
