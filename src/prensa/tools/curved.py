"""Tools of triangles, read as curved patches through the corners and the normals there.

The normals are those of `prensa.tools.facets`. A side is curved where its two normals n_a, n_b lean apart; else it is straight: a
parabola would fold there, and a flat beside a fillet, which leans at one end alone, stays flat. With d from end to end and the
mean normal m, c·m = (d·n_a − d·n_b)/2: with both conditions of Nagata (2005), c·n_a = d·n_a and c·n_b = −d·n_b, a side whose
normals are nearly parallel and lean a little unlike would wind.

A sharp edge is a curve with both conditions, of the surface on either side; a patch there has its own alone, as at smooth edges.
What a curve adds to a patch or takes from it, within its surface, only says how far it goes: a rim that bends in a flat or on a
cylinder changes nothing in how these are curved. (With the curve itself as its side, a triangle with two sides on a rim folds:
they meet at 180°.)
"""

from __future__ import annotations

import copy
from functools import cached_property

import numpy as np

from prensa.geometry.box_tree import box_tree
from prensa.importers.stl import Surface
from prensa.precision import DRAWN, ROUND_OFF
from prensa.tools import patches
from prensa.tools.analytic import Analytic, Closest, marched_along
from prensa.tools.facets import BORDER, CREASE, SIDE_CORNERS, SMOOTH, Facets
from prensa.tools.tool import Touched
from prensa.types import Array, Flags, Index

EPS = 0.25
CH = 4.0
NB = True
_LOOKS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 0.0], [1.0, 0.5], [0.5, 0.5], [0.75, 0.25]])
"""Places e, z on a patch at which it must not turn too far: corners, middles of sides, the inside."""


class Curved(Analytic):
    """A triangulated surface read as curved patches.

    Parameters
    ----------
    surface
        Points and triangles, in the tool's frame.
    sharp
        Angle between triangles from which their common edge is one of the tool.

    """

    def __init__(self, surface: Surface, sharp: float) -> None:
        self.surface, self.sharp, self.facets = surface, sharp, Facets(surface, sharp)
        self.size, self._P = self.facets.size, self.facets.x
        self._C, self._R = self._coefficients()
        self._T = self._trims()
        self._curved = np.ascontiguousarray((self._C != 0.0).any(axis=(1, 2)))
        self._kinds, self._means = self._places()
        self.lip = 0.0

    # ------------------------------------------------------------------------------------------------------ as a tool
    @property
    def extent(self) -> float:  # type: ignore[override]
        """Twice the farthest point from the reference point."""
        return 2.0 * self.size

    @property
    def cavity(self) -> bool:  # type: ignore[override]
        """Whether it is closed and bodies are inside."""
        return self.surface.closed and self.surface.volume < 0.0

    @property
    def centre(self) -> Array:
        """Middle of its points."""
        x = self.surface.points
        return np.asarray(0.5 * (x.min(axis=0) + x.max(axis=0)))

    @property
    def looks(self) -> Array | None:
        """Unit vector (3,) along the sum of the areas of an open surface, which its borders determine; None of closed ones."""
        areas = 0.5 * np.cross(self._P[:, 1] - self._P[:, 0], self._P[:, 2] - self._P[:, 0])
        total = areas.sum(axis=0)
        length = float(np.linalg.norm(total))
        return total / length if length > DRAWN * np.linalg.norm(areas, axis=1).sum() else None

    @property
    def radius(self) -> float:
        """0 with sharp edges, that of borders; else nothing is said."""
        kinds = self.facets.edge_kinds
        return 0.0 if (kinds == CREASE).any() else self.lip if (kinds == BORDER).any() else np.inf

    def closest(self, xi: Array) -> Closest:
        """Points (k, 3) → `Closest`."""
        return self._seen(xi)[0]

    def with_lip(self, radius: float) -> Curved:
        """The same with open borders that turn away with a radius: see `prensa.tools.patches`."""
        out = copy.copy(self)
        out.lip = radius
        return out

    def past_border(self, xi: Array) -> Flags:
        """Which points (k, 3) lie past an open border, where nothing of the surface is."""
        return self._seen(xi)[1]

    def _seen(self, xi: Array) -> tuple[Closest, Flags]:
        xi = np.ascontiguousarray(xi)
        k = len(xi)
        out, past = Closest(np.empty(k), np.empty((k, 3)), np.empty((k, 3, 3))), np.zeros(k, dtype=bool)
        triangle, where, at = self._nearest(xi)
        slack = self.chords if self.lip else self.chords + DRAWN * self.size
        patches.closest(
            self._P, self._C, self._R, self._curved, self._kinds, self._means, slack, self.lip, ROUND_OFF * self.size,
            xi, triangle, where, at, *out[:3], past,
        )  # fmt: skip
        return out, past

    def along(self, xi: Array, direction: Array, limit: float) -> Array:
        """Distance (k,) from points (k, 3) along a unit vector (3,) to the surface."""
        return marched_along(lambda x: self.closest(x).g, lambda x: self.closest(x).n, self.size, xi, direction, limit)

    def touched(self, xi: Array) -> Touched:
        """What there is to say of the surface at the places closest to points (k, 3)."""
        triangle, _, _ = self._nearest(np.ascontiguousarray(xi))
        return Touched(float(self.chords[triangle].max()), float(self.facet_angles[triangle].max()))

    def _nearest(self, xi: Array) -> tuple[Index, Index, Array]:
        k = len(xi)
        triangle, where, at = np.zeros(k, dtype=np.int64), np.zeros(k, dtype=np.int64), np.zeros((k, 2))
        patches.nearest(
            self._P, self._C, self._R, self._T, self._curved, self.facets.flats, self._kinds, *self.facets.around,
            *self._tree, xi, triangle, where, at,
        )  # fmt: skip
        return triangle, where, at

    # --------------------------------------------------------------------------------------------------- how coarse it is
    @cached_property
    def chords(self) -> Array:
        """Largest distance (m,) of each patch from its flat triangle, at the middle of its sides."""
        return 0.25 * np.abs(np.einsum("msi,mi->ms", self._C, self.facets.normals)).max(axis=1)

    @cached_property
    def facet_angles(self) -> Array:
        """Largest angle (m,) between each triangle and its neighbours across edges that are not sharp."""
        return self.facets.edge_angles[self.facets.side_edges].max(axis=1)

    # -------------------------------------------------------------------------------------------------------- construction
    def _coefficients(self) -> tuple[Array, Array]:
        """Coefficients (m, 3, 3) of the sides of patches, and of the curves that bound them: see the module."""
        own, curve = self._edge_coefficients()
        edge = self.facets.side_edges
        side = (self.surface.sides[edge, 1] == np.arange(len(edge))[:, None]).astype(np.int64)
        C = np.ascontiguousarray(own[edge, side])
        open_ = (C != 0.0).any(axis=2)  # sides that may become straight
        turns = self._turns(C, np.arange(len(C)))
        while True:
            turned = np.flatnonzero((turns > 2.0) & open_.any(axis=1))
            if not turned.size:
                return C, np.ascontiguousarray(curve[edge])
            # The steepest side becomes straight: of a sliver a long one, which a normal that is a little off bends too far.
            k = np.argmax(np.where(open_[turned], self._slopes(C)[turned], -1.0), axis=1)
            e, first = np.unique(edge[turned, k], return_index=True)
            # unless that turns the patch beyond it farther
            pair = self.surface.sides[e]
            pair = np.where(pair < 0, pair[:, :1], pair)
            at = [np.argmax(edge[pair[:, q]] == e[:, None], axis=1) for q in (0, 1)]
            new = np.zeros((len(e), 2))
            for q in (0, 1):
                trial = C[pair[:, q]]
                trial[np.arange(len(e)), at[q]] = 0.0
                new[:, q] = self._turns(trial, pair[:, q])
            gain = turns[pair].max(axis=1) - new.max(axis=1)
            # One at a time of each patch: that of the largest gain.
            best = np.full(len(C), -np.inf)
            np.maximum.at(best, pair, gain[:, None])
            mine = (gain[:, None] >= best[pair]).all(axis=1)
            for q in (0, 1):
                open_[pair[mine, q], at[q][mine]] = False
            better = mine & (gain > 0.0)
            for q in (0, 1):
                C[pair[better, q], at[q][better]] = 0.0
            curve[e[better]] = 0.0
            changed = np.unique(pair[better])
            turns[changed] = self._turns(C[changed], changed)

    def _edge_coefficients(self) -> tuple[Array, Array]:
        """Coefficients of edges as sides of the patches at them (k, 2, 3), and as curves (k, 3)."""
        s, normals = self.surface, self.facets.corner_normals.reshape(-1, 3)
        d = s.points[s.edges[:, 1]] - s.points[s.edges[:, 0]]
        A, right = np.zeros((len(d), 2, 3)), np.zeros((len(d), 2))
        bent = self._bent(d)
        for side in range(2):
            owner = s.sides[:, side]
            there = owner >= 0
            at = [normals[self.facets.corners_at(owner, s.edges[:, e])] for e in range(2)]
            p, q = (np.einsum("ki,ki->k", n, d + way * bent) for n, way in zip(at, (-1.0, 1.0)))
            # The tangents at the ends meet over the chord, and not all but at one end of it.
            less, more = np.minimum(abs(p), abs(q)), np.maximum(abs(p), abs(q))
            leans = there & (p * q < 0.0) & (less >= 0.25 * more) & (more > DRAWN * np.linalg.norm(d, axis=1))
            A[:, side] = np.where(there[:, None], 0.5 * (at[0] + at[1]), 0.0)
            right[:, side] = np.where(leans, 0.5 * (p - q), 0.0)
        own = A * (right / np.maximum(np.einsum("ksi,ksi->ks", A, A), ROUND_OFF))[:, :, None]
        both = np.einsum("kij,kj->ki", np.linalg.pinv(A, rcond=DRAWN), right)
        own += bent[:, None]
        return own, np.where((self.facets.edge_kinds == CREASE)[:, None], both, own[:, 0])

    def _bent(self, d: Array) -> Array:
        """Coefficients (k, 3) of edges d (k, 3) within the surface: see the module."""
        s, f = self.surface, self.facets
        smooth = np.flatnonzero((f.edge_kinds == SMOOTH))
        normals, curvature = f.corner_normals.reshape(-1, 3), f.shape_operators
        owner = s.sides[smooth, 0]
        at = [f.corners_at(owner, s.edges[smooth, e]) for e in range(2)]
        m = normals[at[0]] + normals[at[1]]
        m /= np.linalg.norm(m, axis=1)[:, None]
        length = np.linalg.norm(d[smooth], axis=1)
        t = d[smooth] - np.einsum("ki,ki->k", d[smooth], m)[:, None] * m
        t /= np.linalg.norm(t, axis=1)[:, None]
        b = np.cross(m, t)
        S = [curvature[f._groups[c]] for c in at]
        twist = [np.einsum("ki,kij,kj->k", b, X, t) for X in S]
        tt, bb = ([np.einsum("ki,kij,kj->k", v, X, v) for X in S] for v in (t, b))
        D = bb[0] + bb[1] - tt[0] - tt[1]
        change = (bb[0] - bb[1]) ** 2 + (tt[0] - tt[1]) ** 2
        K = sum(np.einsum("kij,kij->k", X, X) for X in S)
        turn = (twist[1] - twist[0]) * D / np.maximum(D**2 + CH * change + EPS * K, np.finfo(float).tiny)
        turn = np.clip(turn, -0.5 * self.sharp, 0.5 * self.sharp)
        out = np.zeros_like(d)
        out[smooth] = -(length * np.tan(turn))[:, None] * b
        return out

    def _trims(self) -> Array:
        """How far the curves go beyond the sides of patches, and where the corner opposite is (m, 3, 2): `patches._within`."""
        P, out = self._P, np.zeros((len(self._P), 3, 2))
        for k, (i, j) in enumerate(SIDE_CORNERS):
            d, inward = P[:, j] - P[:, i], P[:, 3 - i - j] - P[:, i]
            out[:, k, 1] = np.einsum("mi,mi->m", inward, d) / np.einsum("mi,mi->m", d, d)
            inward = inward - out[:, k, 1, None] * d
            out[:, k, 0] = np.einsum("mi,mi->m", self._R[:, k] - self._C[:, k], inward) / np.einsum("mi,mi->m", inward, inward)
        out[self.facets.edge_kinds[self.facets.side_edges] != CREASE, 0] = 0.0
        return out

    def _slopes(self, C: Array) -> Array:
        """How far sides (m, 3) rise from their flat triangle, over its height there."""
        rise = np.abs(np.einsum("mki,mi->mk", C, self.facets.normals))
        ends = self._P[:, SIDE_CORNERS]
        slopes = rise * np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
        # A side that is curved within the triangle alone comes last, but comes.
        return np.where((C != 0.0).any(axis=2), np.maximum(slopes, np.finfo(float).tiny), 0.0)

    @cached_property
    def _lean(self) -> Array:
        """Largest angle of normals"""
        own = _angles(self.facets.corner_normals, self.facets.normals[:, None]).max(axis=1)
        if not NB:
            return own
        s = self.surface
        smooth = self.facets.edge_kinds == SMOOTH
        out = own.copy()
        a, b = s.sides[smooth].T
        np.maximum.at(out, a, own[b])
        np.maximum.at(out, b, own[a])
        return out

    def _turns(self, C: Array, which: Index) -> Array:
        """How far patches C (k, 3, 3) of triangles (k,) turn from them, over what the normals at their corners do.

        Of a sphere, a cylinder or any surface that these normals are right of they turn by as much, wherever one looks.
        """
        P, f = self._P[which], self.facets
        normals = f.normals[which]
        lean = self._lean[which]
        most = np.zeros(len(C))
        for e, z in _LOOKS:
            a, b = 1.0 - e, e - z
            xe = P[:, 1] - P[:, 0] - C[:, 0] * (a - b) - C[:, 1] * z + C[:, 2] * z
            xz = P[:, 2] - P[:, 1] + C[:, 0] * a - C[:, 1] * (b - z) - C[:, 2] * a
            most = np.maximum(most, _angles(np.cross(xe, xz), normals))
        return np.where((C != 0.0).any(axis=(1, 2)), most / np.maximum(lean, ROUND_OFF), 0.0)

    def _places(self) -> tuple[Index, Array]:
        """Kinds (m, 7) and mean normals (m, 7, 3) of the insides, sides and corners of triangles: see `patches.closest`."""
        s, m, f = self.surface, len(self.surface.triangles), self.facets.normals
        kinds, means = np.zeros((m, 7), dtype=np.int64), np.zeros((m, 7, 3))
        kinds[:, 1:4] = self.facets.edge_kinds[self.facets.side_edges]
        points = np.zeros(len(s.points), dtype=np.int64)
        for kind in (CREASE, BORDER):  # a border goes before an edge that ends there
            points[s.edges[self.facets.edge_kinds == kind].ravel()] = kind
        kinds[:, 4:] = points[s.triangles]
        both = f[s.sides[:, 0]] + np.where(s.sides[:, 1:] >= 0, f[s.sides[:, 1]], 0.0)
        around = np.zeros((len(s.points), 3))
        np.add.at(around, s.triangles, self.facets.angles[:, :, None] * f[:, None])
        means[:, 0], means[:, 1:4], means[:, 4:] = f, both[self.facets.side_edges], around[s.triangles]
        return kinds, means / np.maximum(np.linalg.norm(means, axis=2, keepdims=True), ROUND_OFF)

    @cached_property
    def _tree(self) -> tuple[Array, Index]:
        """Heap of boxes and triangles of its leaves: see `patches.nearest`."""
        P = self._P
        ends = P[:, SIDE_CORNERS].sum(axis=2)
        net = np.concatenate([P, 0.5 * (ends - self._C), 0.5 * (ends - self._R)], axis=1)
        slack = ROUND_OFF * self.size
        return box_tree(net.min(axis=1) - slack, net.max(axis=1) + slack, P.mean(axis=1))


def _angles(a: Array, b: Array) -> Array:
    """Angles between vectors (..., 3)."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))
