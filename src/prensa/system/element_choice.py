"""The elements of bodies whose description names none, where the default is not the best one for what is asked."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from prensa.elements.element import element_of
from prensa.model import problem as model
from prensa.model.press import works
from prensa.system.bending import FOR_BENDING, bendings
from prensa.system.system import System

FOR_ENERGY = {2: "q4_bbar", 3: "h8_bbar"}
"""By the dimension of space: elements whose forces are the derivative of the energy stored and dissipated."""
BENDS = "it is elastic and may bend"
BALANCED = "energies are balanced"
REMESHED = "new meshes are of triangles"
AS_BEFORE = "as before"


class Choice(NamedTuple):
    """The ``element`` of a body, and ``why`` it has it."""

    element: str
    why: str


def with_chosen_elements(system: System, like: model.Problem | None) -> System:
    """The system with better elements than the default for bodies that name none, and why.

    ``like``: a problem whose elements are taken over instead, of bodies that it has.
    """
    p = system.problem
    if like is None:
        chosen = _for_energies(system) | _for_bending(system) | _for_new_meshes(p)
    else:
        before = {n: like.bodies[n].element for n, b in p.bodies.items() if b.element is None and n in like.bodies}
        chosen = {n: Choice(element, AS_BEFORE) for n, element in before.items() if element is not None}
    if not chosen:
        return system
    blocks = [replace(b, element=element_of(chosen[b.body].element)) if b.body in chosen else b for b in system.blocks]
    problem = p.with_elements({name: c.element for name, c in chosen.items()})
    return replace(system, problem=problem, blocks=blocks, chosen={name: c.why for name, c in chosen.items()})


def _for_bending(system: System) -> dict[str, Choice]:
    """Enhanced strains for elastic bodies that bend, unless something presses them across their thickness."""
    elastic = [name for name, b in system.problem.bodies.items() if b.element is None and not b.material.plastic]
    choice = Choice(FOR_BENDING[system.dofs.dimension], BENDS)
    return {name: choice for name, bending in bendings(system, elastic).items() if not bending.pressed}


def _for_new_meshes(p: model.Problem) -> dict[str, Choice]:
    """The triangles that bodies have which name no element and are remeshed; their first mesh is made of them already."""
    left = [name for name, b in p.bodies.items() if b.element is None and b.material.plastic]
    return {name: Choice("t6", REMESHED) for name in left if p.element_name(name) == "t6"}


def _for_energies(system: System) -> dict[str, Choice]:
    """B-bar for bodies that flow, of quadrilaterals and bricks, where a tool works with a given energy.

    The end of a blow and its efficiency are differences of energies, which F-bar misses by up to half a per cent.
    """
    p = system.problem
    if p.space == "plane stress" or not works(p):
        return {}
    flowing = [name for name, b in p.bodies.items() if b.element is None and b.material.plastic]
    choice, corners = Choice(FOR_ENERGY[system.dofs.dimension], BALANCED), 2**system.dofs.dimension
    return {name: choice for name in flowing if system.meshes[name].cells.shape[1] == corners}
