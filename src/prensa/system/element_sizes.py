"""Sizes that a description asks for of the elements of its bodies, in a state: `SizeField` with tools and strains of a system."""

from __future__ import annotations

from functools import partial

import numpy as np

from prensa.contact.masters import RigidMaster
from prensa.contact.recovery import recover
from prensa.mesh.mesh import areas
from prensa.mesh.sizes import SizeField, Strain
from prensa.model.remeshing import Sizes, remeshing_of
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array


def size_field(system: System, state: State, body: str, asked: Sizes, area: float, share: float = 1.0) -> SizeField:
    """Sizes of elements of a body in a committed state; ``area`` of its section at the beginning, ``share``: of all sizes."""
    mesh = system.meshes[body]
    positions = system.positions(state.u)[system.span(body)]
    own = len(system.tools) - system.mirrors  # lines of symmetry run through the metal, and ask for nothing
    names = [t.name for t in system.tools[:own] if any(s.body == body for s in system.against(t.name))]
    block = next(b for b in system.blocks if b.body == body)

    def strained() -> Strain:
        strain = block.field(state.history[system.blocks.index(block)], "plastic_strain")
        at = block.positions(system.positions(state.u))
        values = strain.reshape(*at.shape[:2], 1)
        return Strain(float(np.ptp(strain)), lambda: recover(positions, mesh.cells, at, values)[:, 0])

    distances = [partial(_distance, system.tool_masters[name], state.u) for name in names]
    return SizeField(mesh, positions, asked, area, distances, strained, share)


def _distance(master: RigidMaster, u: Array, x: Array) -> tuple[Array, Array]:
    """Gap (n,) between places x (n, 2) and a tool for degrees of freedom u (ndof,), and the radius (n,) of what faces them."""
    closest = master.shape.closest(master.local(x, u))
    with np.errstate(divide="ignore", invalid="ignore"):
        return closest.g, np.where(closest.c != 0, np.abs(1 / closest.c - closest.g), np.inf)


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
    return 0.5 * size_field(system, system.initial(), body, asked.size, section_area(system, body)).least


def elements_asked(system: System, body: str) -> tuple[float, str]:
    """About how many elements the sizes that are asked for would make of a body, and the key that does most of it.

    Equilateral triangles over its section, and no fewer than two rows of them along the part of its outline that tools can reach.
    """
    asked = remeshing_of(system.problem)
    assert asked is not None
    sizes = size_field(system, system.initial(), body, asked.size, section_area(system, body))
    mesh = system.meshes[body]
    edges = mesh.boundary
    length = np.hypot(*(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]).T)
    with np.errstate(over="ignore", divide="ignore"):
        inner = float(np.float64(sizes.area) / sizes.far / sizes.far) * 4 / np.sqrt(3)
        skin = 4 * float((length / sizes.by_tools(mesh.points[edges[:, :2]].mean(axis=1))).sum())
    return (inner, "far") if inner >= skin else (skin, "near_tools")
