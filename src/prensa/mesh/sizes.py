"""Element sizes of a new mesh from what is around: tools, the outline of the body, strains.

Never from the present mesh alone, which would coarsen from one to the next.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from prensa.geometry.plane import angle, cross, turned
from prensa.mesh.mesh import Mesh, areas, corner_cells, segments
from prensa.mesh.outline import GROWTH
from prensa.model.remeshing import Sizes
from prensa.types import Array, Index

LARGEST_SIZE = 1 / 12  # largest element over the root of the section's area
TOOL_SIZE = 0.6  # elements at tools over those
SMALLEST_SIZE = 1 / 8  # smallest elements over those at tools
NEIGHBOURS = 32  # nodes of the outline that are looked at for the size at a place
BENT = 0.15  # turn (rad) of an outline between neighbouring sides from which its curvature counts
LARGE = 1.5  # size of an element over that asked for from which it is much too large: new meshes have hardly any
BACK = -0.7  # cosine between normals of sides that face away from each other


Distance = Callable[[Array], tuple[Array, Array]]
"""Of a tool: its distance (n,) from places (n, 2), negative inside, and the radius (n,) of what faces them, inf where flat."""


class Strain(NamedTuple):
    """Equivalent plastic strain of a body: its range over all points, and its values (n,) at the nodes, computed when asked."""

    spread: float
    nodal: Callable[[], Array]


@dataclass(frozen=True)
class SizeField:
    """Sizes of elements of a body at places on and in it; ``area`` of its section at the beginning.

    ``positions`` (n, 2) of the nodes of its ``mesh``; ``tools`` against it, by distance; ``strain`` that it has by now.
    ``share``: of the sizes asked for, where finer meshes are tried; those by thickness and by curvature stay.
    """

    mesh: Mesh
    positions: Array
    asked: Sizes
    area: float
    tools: Sequence[Distance]
    strain: Callable[[], Strain]
    share: float = 1.0

    @cached_property
    def far(self) -> float:
        """Largest size."""
        return self.share * (self.asked.far or LARGEST_SIZE * self.area**0.5)

    @cached_property
    def near(self) -> float:
        """Size at tools."""
        asked = self.asked.near_tools
        return min(TOOL_SIZE * self.far if asked is None else self.share * asked, self.far)

    @cached_property
    def least(self) -> float:
        """Smallest size."""
        return min(self.asked.least or SMALLEST_SIZE * self.near, self.near)

    def __call__(self, x: Array) -> Array:
        """Sizes (n,) at places x (n, 2)."""
        h = self.by_tools(x)
        for places, sizes in (self._outline, self._strained):
            if len(places):
                from scipy.spatial import cKDTree

                distance, near = cKDTree(places).query(x, min(NEIGHBOURS, len(places)))
                distance, near = distance.reshape(len(x), -1), near.reshape(len(x), -1)
                h = np.minimum(h, (sizes[near] + GROWTH * distance).min(axis=1))
        return np.clip(h, self.least, self.far)

    def by_tools(self, x: Array) -> Array:
        """Sizes (n,) at places x (n, 2) that the tools alone ask for: their distance, and the radius that faces the place."""
        h = np.full(len(x), self.far)
        for distance in self.tools:
            gap, radius = distance(x)
            arc = np.maximum(self.share * 0.5 * np.pi * radius / self.asked.per_radius, self.least)
            h = np.minimum(h, np.minimum(self.near, arc) + GROWTH * np.maximum(gap, 0.0))
        return h

    @cached_property
    def _outline(self) -> tuple[Array, Array]:
        """Places (k, 2) on the outline, and sizes (k,) that its curvature and the thickness of the body there ask for."""
        x, edges = self.positions, self.mesh.boundary
        h = np.minimum(_by_thickness(x, segments(edges), self.asked.across), self._by_curvature(x, edges))
        small = h < self.far
        return x[edges[small, 2]], np.maximum(h[small], self.least)

    @cached_property
    def _strained(self) -> tuple[Array, Array]:
        """Middles (k, 2) of elements over which the plastic strain changes much, and the sizes (k,) that ask for less.

        None below that at tools: a band of shear is as thin as the elements that it has, and would ask for ever smaller ones.
        """
        # Not an error estimate of the stress: plastic zones end in kinks, whose error no size removes.
        strain = self.strain()
        steep = self.share / (self.asked.per_strain * self.far) if self.asked.per_strain else np.inf
        # No element can see a slope that counts then, and the strains at the nodes need not be recovered.
        if strain.spread < 0.5 * steep * self.near:
            return np.zeros((0, 2)), np.zeros(0)
        cells, nodal = self.mesh.cells, strain.nodal()
        x, e = self.positions[cells[:, :3]], nodal[cells[:, :3]]
        a, b, de = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], e[:, 1:] - e[:, :1]
        det = cross(a, b)
        slope = np.hypot(de[:, 0] * b[:, 1] - de[:, 1] * a[:, 1], de[:, 1] * a[:, 0] - de[:, 0] * b[:, 0]) / det
        much = slope > steep
        return x[much].mean(axis=1), np.maximum(steep * self.far / slope[much], self.near)

    def _by_curvature(self, x: Array, edges: Index) -> Array:
        """Sizes (k,) at sides (k, 3) that the bend of the outline there asks for; infinite where it is straight."""
        a, b = x[edges[:, 0]], x[edges[:, 1]]
        along = (b - a) / np.hypot(*(b - a).T)[:, None]
        after = np.full(len(x), -1)
        after[edges[:, 0]] = np.arange(len(edges))
        following = after[edges[:, 1]]
        t = along[following]
        turn = np.abs(angle(along, t))
        length = np.hypot(*(b - a).T)
        bent = (turn > BENT) & (turn < 0.6)  # more is a corner
        h = np.where(
            bent,
            0.5 * np.pi * 0.5 * (length + length[following]) / (np.maximum(turn, BENT) * self.asked.per_radius),
            np.inf,
        )
        return np.maximum(h, 0.5 * length)  # what one mesh takes for a corner the next one may resolve


def coarseness(field: SizeField) -> Array:
    """Sizes (m,) of the elements of a body over those asked for at their middles."""
    mesh = field.mesh
    x = field.positions[corner_cells(mesh.cells)]
    # Side of the equilateral triangle of that area.
    size = np.sqrt(4 / np.sqrt(3) * areas(field.positions, mesh.cells))
    return np.asarray(size / field(x.mean(axis=1)))


def mismatch(field: SizeField) -> tuple[float, float]:
    """Share of the elements asked for that lie in ones more than `LARGE` times as large, and elements over those asked for."""
    ratio = coarseness(field)
    # So many elements of the size asked for would take the place of each.
    asked = ratio**2
    return float(asked[ratio > LARGE].sum() / asked.sum()), len(ratio) / float(asked.sum())


def least_at_tools(field: SizeField) -> float:
    """Smallest size that tools ask for on the outline of a body."""
    nodes = np.unique(field.mesh.boundary)
    return float(field.by_tools(field.positions[nodes]).min())


def _by_thickness(x: Array, pieces: Index, across: float) -> Array:
    """Sizes (k,) at the quadratic sides of an outline, pieces (2 k, 2), of which ``across`` lie between it and its other side."""
    a, b = x[pieces[:, 0]], x[pieces[:, 1]]
    d = b - a
    n = turned(d) / np.hypot(*d.T)[:, None]  # inwards
    start, way = b[0::2], n[0::2] + n[1::2]
    way = way / np.hypot(*way.T)[:, None]
    # start + s way = a + t d
    det = way[:, None, 0] * d[:, 1] - way[:, None, 1] * d[:, 0]
    r = a - start[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = cross(r, d) / det
        t = (r[..., 0] * way[:, None, 1] - r[..., 1] * way[:, None, 0]) / det
    facing = (way @ n.T) < BACK
    hit = facing & (t >= 0) & (t <= 1) & (s > 0)
    return np.asarray(np.where(hit, s, np.inf).min(axis=1) / across)
