"""Tools of triangles, read as curved patches through the corners and the normals there.

The normals are those of `prensa.tools.facets`, the sides of patches those of `prensa.tools.sides`. A sharp edge is a curve with
the conditions of the surfaces on both sides of it; a patch there has its own alone, as at smooth edges. What a curve adds to a
patch or takes from it, within its surface, only says how far it goes: a rim that bends in a flat or on a cylinder changes nothing
in how these are curved. (With the curve itself as its side, a triangle with two sides on a rim folds: they meet at 180°.)
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
from prensa.tools.sides import Sides
from prensa.tools.tool import Touched
from prensa.types import Array, Flags, Index


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
        self._C, self._R = Sides(self.facets, sharp).coefficients()
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
    def _trims(self) -> Array:
        """How far the curves go beyond the sides of patches, and where the corner opposite is (m, 3, 2): `patches._within`."""
        P, out = self._P, np.zeros((len(self._P), 3, 2))
        for k, (i, j) in enumerate(SIDE_CORNERS):
            d, inward = P[:, j] - P[:, i], P[:, 3 - i - j] - P[:, i]
            out[:, k, 1] = np.einsum("mi,mi->m", inward, d) / np.einsum("mi,mi->m", d, d)
            inward = inward - out[:, k, 1, None] * d
            out[:, k, 0] = np.einsum("mi,mi->m", self._R[:, k] - self._C[:, k], inward) / np.einsum("mi,mi->m", inward, inward)
        kinds, flats = self.facets.edge_kinds[self.facets.side_edges], self.facets.flats[:, None]
        out[(kinds == BORDER) | ((kinds == SMOOTH) & ~flats), 0] = 0.0
        return out

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
