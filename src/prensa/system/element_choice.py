"""The elements of bodies whose description names none, where the default is not the best one for what is asked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from prensa.elements.element import element_of
from prensa.mesh.bricks import BrickMesh
from prensa.model import problem as model
from prensa.model.press import works
from prensa.system.bending import FOR_BENDING, bendings
from prensa.system.system import System

FOR_ENERGY = {2: "q4_bbar", 3: "h8_bbar"}
"""By the dimension of space: elements whose forces are the derivative of the energy stored and dissipated."""
BENDS = "it is elastic and may bend"
BALANCED = "energies are balanced"


def with_chosen_elements(system: System, like: model.Problem | None) -> System:
    """The system with better elements than the default for bodies that name none, and why.

    ``like``: a problem whose elements are taken over instead, of bodies that it has.
    """
    p = system.problem
    chosen: dict[str, tuple[str, str]] = {}
    if like is not None:
        names = {n: b.element for n, b in p.bodies.items() if b.element is None and n in like.bodies}
        chosen = {n: (e, "as before") for n in names if (e := like.bodies[n].element) is not None}
    else:
        chosen = dict(_for_energies(system)) | dict(_for_bending(system))
    if not chosen:
        return system
    elements = {name: element for name, (element, _) in chosen.items()}
    blocks = [replace(b, element=element_of(elements[b.body])) if b.body in elements else b for b in system.blocks]
    why = {name: reason for name, (_, reason) in chosen.items()}
    return replace(system, problem=p.with_elements(elements), blocks=blocks, chosen=why)


def _for_bending(system: System) -> Iterator[tuple[str, tuple[str, str]]]:
    """Enhanced strains for elastic bodies that bend, unless something presses them across their thickness."""
    elastic = [name for name, b in system.problem.bodies.items() if b.element is None and not b.material.plastic]
    for name, bending in bendings(system, elastic).items():
        if not bending.pressed:
            yield name, (FOR_BENDING[system.dofs.dimension], BENDS)


def _for_energies(system: System) -> Iterator[tuple[str, tuple[str, str]]]:
    """B-bar for bodies that flow, of quadrilaterals and bricks, where a tool works with a given energy.

    The end of a blow and its efficiency are differences of energies, which F-bar misses by up to half a per cent.
    """
    p = system.problem
    if p.space == "plane stress" or not works(p):
        return
    for name, b in p.bodies.items():
        mesh = system.meshes[name]
        if b.element is None and b.material.plastic and mesh.cells.shape[1] == (8 if isinstance(mesh, BrickMesh) else 4):
            yield name, (FOR_ENERGY[system.dofs.dimension], BALANCED)
