"""How large the elements of a new mesh are to be, from what is around: tools, the outline of the body, strains.

Never from the present mesh alone, which would coarsen from one to the next.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from prensa.contact.recovery import recover
from prensa.fem.state import State
from prensa.fem.system import System
from prensa.mesh.mesh import areas, corner_cells, segments
from prensa.model.remeshing import Sizes, remeshing_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]

LARGEST_SIZE = 1 / 12  # largest element over the root of the section's area
TOOL_SIZE = 0.6  # elements at tools over those
SMALLEST_SIZE = 1 / 8  # smallest elements over those at tools
SLOPE = 0.25  # growth of sizes over the way
NEIGHBOURS = 32  # nodes of the outline that are looked at for the size at a place
BENT = 0.15  # turn (rad) of an outline between neighbouring sides from which its curvature counts
LARGE = 1.5  # size of an element over that asked for from which it is much too large: new meshes have hardly any
BACK = -0.7  # cosine between normals of sides that face away from each other


@dataclass(frozen=True)
class SizeField:
    """Sizes of elements of a body at places on and in it, in a state; ``area`` of its section at the beginning.

    ``share``: of all sizes, where finer meshes are tried.
    """

    system: System
    state: State
    body: str
    asked: Sizes
    area: float
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
                h = np.minimum(h, (sizes[near] + SLOPE * distance).min(axis=1))
        return np.clip(h, self.least, self.far)

    def by_tools(self, x: Array) -> Array:
        """Sizes (n,) at places x (n, 2) that the tools alone ask for: their distance, and the radius that faces the place."""
        h = np.full(len(x), self.far)
        system = self.system
        own = len(system.tools) - system.mirrors  # lines of symmetry run through the metal, and ask for nothing
        for tool in system.tools[:own]:
            master = system.masters[tool.name]
            if not any(s.body == self.body for s in system.against(tool.name)):
                continue
            closest = tool.shape.closest(master.local(x, self.state.u))
            with np.errstate(divide="ignore", invalid="ignore"):
                radius = np.where(closest.c != 0, np.abs(1 / closest.c - closest.g), np.inf)
            arc = np.maximum(self.share * 0.5 * np.pi * radius / self.asked.per_radius, self.least)
            h = np.minimum(h, np.minimum(self.near, arc) + SLOPE * np.maximum(closest.g, 0.0))
        return h

    @cached_property
    def positions(self) -> Array:
        """Places (n, 2) of the nodes of the body."""
        first = self.system.offsets[self.body]
        return self.system.positions(self.state.u)[first : first + len(self.system.meshes[self.body].points)]

    @cached_property
    def _outline(self) -> tuple[Array, Array]:
        """Places (k, 2) on the outline, and sizes (k,) that its curvature and the thickness of the body there ask for."""
        x, edges = self.positions, self.system.meshes[self.body].boundary
        h = np.minimum(_by_thickness(x, segments(edges), self.asked.across), self._by_curvature(x, edges))
        small = h < self.far
        return x[edges[small, 2]], np.maximum(h[small], self.least)

    @cached_property
    def _strained(self) -> tuple[Array, Array]:
        """Middles (k, 2) of elements over which the plastic strain changes much, and the sizes (k,) that ask for less.

        None below that at tools: a band of shear is as thin as the elements that it has, and would ask for ever smaller ones.
        """
        block = next(b for b in self.system.blocks if b.body == self.body)
        strain = block.field(self.state.history[self.system.blocks.index(block)], "plastic_strain")
        steep = self.share / (self.asked.per_strain * self.far) if self.asked.per_strain else np.inf
        if np.ptp(strain) < 0.5 * steep * self.near:
            return np.zeros((0, 2)), np.zeros(0)
        cells = block.cells - self.system.offsets[self.body]
        at = block.positions(self.system.positions(self.state.u))
        nodal = recover(self.positions, cells, at, strain.reshape(*at.shape[:2], 1))[:, 0]
        x, e = self.positions[cells[:, :3]], nodal[cells[:, :3]]
        a, b, de = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], e[:, 1:] - e[:, :1]
        det = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
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
        turn = np.abs(np.arctan2(along[:, 0] * t[:, 1] - along[:, 1] * t[:, 0], (along * t).sum(axis=1)))
        length = np.hypot(*(b - a).T)
        bent = (turn > BENT) & (turn < 0.6)  # more is a corner
        h = np.where(
            bent,
            0.5 * np.pi * 0.5 * (length + length[following]) / (np.maximum(turn, BENT) * self.asked.per_radius),
            np.inf,
        )
        return np.maximum(h, 0.5 * length)  # what one mesh cannot tell from a corner the next one can


def section_area(system: System, body: str) -> float:
    """Area of the section of a body on the mesh of its description."""
    mesh = system.meshes[body]
    return float(areas(mesh.points, mesh.cells).sum())


def least_size(system: System, body: str) -> float:
    """Smallest side of an element that a body may be given; infinite where it keeps its mesh."""
    asked = remeshing_of(system.problem)
    plastic = any(b.body == body and b.law.plastic for b in system.blocks)
    if asked is None or not plastic:
        return np.inf
    return 0.5 * SizeField(system, system.initial(), body, asked.size, section_area(system, body)).least


def elements_asked(system: System, body: str) -> tuple[float, str]:
    """About how many elements the sizes that are asked for would make of a body, and the key that does most of it.

    Equilateral triangles over its section, and no fewer than two rows of them along the part of its outline that tools can reach.
    """
    asked = remeshing_of(system.problem)
    assert asked is not None
    sizes = SizeField(system, system.initial(), body, asked.size, section_area(system, body))
    mesh = system.meshes[body]
    edges = mesh.boundary
    length = np.hypot(*(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]).T)
    with np.errstate(over="ignore", divide="ignore"):
        inner = float(np.float64(sizes.area) / sizes.far / sizes.far) * 4 / np.sqrt(3)
        skin = 4 * float((length / sizes.by_tools(mesh.points[edges[:, :2]].mean(axis=1))).sum())
    return (inner, "far") if inner >= skin else (skin, "near_tools")


def coarseness(field: SizeField) -> Array:
    """Sizes (m,) of the elements of a body over those asked for at their middles."""
    mesh = field.system.meshes[field.body]
    x = field.positions[corner_cells(mesh.cells)]
    size = np.sqrt(4 / np.sqrt(3) * areas(field.positions, mesh.cells))
    return np.asarray(size / field(x.mean(axis=1)))


def mismatch(field: SizeField) -> tuple[float, float]:
    """Share of the elements asked for that lie in ones more than `LARGE` times as large, and elements over those asked for."""
    ratio = coarseness(field)
    asked = ratio**2
    return float(asked[ratio > LARGE].sum() / asked.sum()), len(ratio) / float(asked.sum())


def least_at_tools(field: SizeField) -> float:
    """Smallest size that tools ask for on the outline of a body."""
    nodes = np.unique(field.system.meshes[field.body].boundary)
    return float(field.by_tools(field.positions[nodes]).min())


def _by_thickness(x: Array, pieces: Index, across: float) -> Array:
    """Sizes (k,) at the quadratic sides of an outline, pieces (2 k, 2), of which ``across`` lie between it and its other side."""
    a, b = x[pieces[:, 0]], x[pieces[:, 1]]
    d = b - a
    n = np.stack([-d[:, 1], d[:, 0]], axis=1) / np.hypot(*d.T)[:, None]  # inwards
    start, way = b[0::2], n[0::2] + n[1::2]
    way = way / np.hypot(*way.T)[:, None]
    # start + s way = a + t d
    det = way[:, None, 0] * d[:, 1] - way[:, None, 1] * d[:, 0]
    r = a - start[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (r[..., 0] * d[:, 1] - r[..., 1] * d[:, 0]) / det
        t = (r[..., 0] * way[:, None, 1] - r[..., 1] * way[:, None, 0]) / det
    facing = (way @ n.T) < BACK
    hit = facing & (t >= 0) & (t <= 1) & (s > 0)
    return np.asarray(np.where(hit, s, np.inf).min(axis=1) / across)
