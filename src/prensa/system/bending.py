"""Bodies that bend, and the element for them where the description leaves it open.

Linear elements lock in bending: as long as they are over the thickness, since their sides stay straight (MacNeal 1994); those of
F-bar lose, with the volume, a part of the bending of each single layer. Enhanced strains do neither, but fail under large
compression. So elastic bodies get them where they matter, unless tools and supports press the body across its thickness.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from prensa.contact.passage import WORTH_SAYING
from prensa.elements.element import element_of
from prensa.mesh.mesh import Mesh, keys
from prensa.mesh.thin import Strips, strips
from prensa.model import problem as model
from prensa.precision import NEGLIGIBLE
from prensa.system.contact_surfaces import always_held
from prensa.system.moments import Moment, moments
from prensa.system.system import System
from prensa.types import Array, Flags, Index

FOR_BENDING = "q4_enhanced"


class Bending(NamedTuple):
    """What bending makes of a body: the relative ``error`` of its stiffness with the default element.

    ``pressed``: whether something presses the body across its thickness; ``bent``: whether something acts across it elsewhere.
    """

    error: float
    pressed: bool
    bent: bool


def stiffness_errors(s: Strips, nu: float, space: str) -> Array:
    """Relative error (m,) of the stiffness in bending of layers of the default element, of the strips of m elements.

    An element of length a bends in shear, (1 − ν)/2 (a/t)² of the bending of the thickness t. Of the bending of each of n layers
    by itself, 1/n² of the whole, F-bar with its one volume keeps the deviatoric part, `q4` in plane stress all.
    """
    row, m = s.thin
    thickness, layers = s.lengths[row, m], s.numbers[row, m]
    length = np.linalg.norm(s.across[1 - row, m], axis=1)
    kept = {"plane strain": (1.0 - nu) / 2.0, "axisymmetric": 2.0 * (1.0 - nu) / 3.0}.get(space, 1.0 / (1.0 - nu**2))
    return np.asarray((1.0 - nu) / 2.0 * (length / thickness) ** 2 - (1.0 - kept) / layers**2)


@dataclass(frozen=True)
class _Thickness:
    """The strips (s,) through the thickness of a body that end on its outline at both sides.

    ``ends`` (s, 2, 2): nodes of the two sides; ``middle`` (s, 2, 2): the places of their middles; ``across`` (s, 2): unit vectors
    from the first to the second; ``size`` (s,): the thickness; ``held`` (s, 2): ends that supports hold along it in all steps.
    """

    ends: Index
    middle: Array
    across: Array
    size: Array
    held: Flags

    @staticmethod
    def of(mesh: Mesh, s: Strips, held: Flags) -> _Thickness:
        """Of the strips of a mesh, of whose nodes supports hold components (n, 2) in all steps."""
        own, nodes = np.repeat(s.strip[s.thin], 2), s.sides[s.thin].reshape(-1, 2)
        outer = np.isin(keys(nodes, len(mesh.points)), keys(mesh.boundary[:, :2], len(mesh.points)))
        own, nodes = own[outer], nodes[outer]
        order = np.argsort(own, kind="stable")
        _, at, count = np.unique(own[order], return_index=True, return_counts=True)
        at = at[count == 2]
        ends = np.stack([nodes[order[at]], nodes[order[at + 1]]], axis=1)
        middle = mesh.points[ends].mean(axis=2)
        way = middle[:, 1] - middle[:, 0]
        size = np.linalg.norm(way, axis=1)
        across = way / size[:, None]
        towards = np.abs(across)[:, None, None, :] > np.sqrt(0.5)
        return _Thickness(ends, middle, across, size, (held[ends] & towards).any(axis=3).all(axis=2))


def bendings(system: System, unnamed: Iterable[str]) -> dict[str, Bending]:
    """What bending makes of the bodies of quadrilaterals that are ``unnamed``, where their elements err by `WORTH_SAYING`."""
    errors, through = {}, {}
    for body in unnamed:
        mesh, law = system.meshes[body], system.problem.bodies[body].material
        if system.dofs.dimension != 2 or mesh.cells.shape[1] != 4:
            continue
        s = strips(mesh)
        own = stiffness_errors(s, law.poisson, system.problem.space)
        error = float(own[np.argmax(np.abs(own))])
        if abs(error) > WORTH_SAYING:
            errors[body] = error
            through[body] = _Thickness.of(mesh, s, always_held(system.problem, body, mesh))
    if not errors:
        return {}
    # Of two bodies in contact nobody knows where they press on each other.
    pressed = {b: any(s.opposite is not None and s.acts_on((b,)) for s in system.surfaces) for b in errors}
    bent = {b: _driven_across(system, b, t) for b, t in through.items()}
    for moment in moments(system):
        for body, t in through.items():
            gaps = _gaps(system, body, t, moment)
            pressed[body] |= bool((gaps.sum(axis=1) < -NEGLIGIBLE * t.size).any())
            bent[body] |= bool((gaps < -NEGLIGIBLE * t.size[:, None]).any())
    return {body: Bending(errors[body], pressed[body], bent[body]) for body in errors}


def _gaps(system: System, body: str, t: _Thickness, moment: Moment) -> Array:
    """Gaps (s, 2) at the ends of strips to what is there at a moment: tools in contact with the body, and supports along them."""
    out = np.where(t.held, 0.0, np.inf)
    outward = np.stack([-t.across, t.across], axis=1)
    for s in system.tool_contacts:
        if s.body == body:
            seen = system.tool_masters[s.against].seen(t.middle.reshape(-1, 2), moment.u)
            # a tool that has come through from the other side faces away from this one
            facing = (seen.n.reshape(-1, 2, 2) * outward).sum(axis=2) < 0.0
            out = np.where(facing, np.minimum(out, seen.g.reshape(-1, 2)), out)
    return out


def _driven_across(system: System, body: str, t: _Thickness) -> bool:
    """Whether a support is moved, or a load acts, across the thickness of a body."""
    p, mesh = system.problem, system.meshes[body]
    ways: list[tuple[str, Array]] = []
    for step in p.steps:
        for name, motion in p.driven(step).items():
            ways.append((name, np.array([motion.x is not None, motion.y is not None], dtype=float)))
    owners: tuple[model.Problem | model.Step, ...] = (p, *p.steps)
    for owner in owners:
        for name, f in owner.fixed.items():
            ways.append((name, np.array([v is not None and v != "held" for v in (f.x, f.y)], dtype=float)))
        for name, load in owner.loads.items():
            ways.append((name, np.zeros(2) if load.traction is None else np.array([v != 0 for v in load.traction], dtype=float)))
            if load.pressure is not None and name.partition(".")[0] == body:
                nodes = mesh.nodes(name.partition(".")[2], name)
                if np.isin(t.ends, nodes).all(axis=2).any():
                    return True
    for name, way in ways:
        owner_body, _, side = name.partition(".")
        if owner_body == body and way.any():
            near = np.isin(t.ends, mesh.nodes(side, name)).any(axis=(1, 2))
            if (np.abs(t.across[near]) @ way > np.sqrt(0.5)).any():
                return True
    return False


def with_elements_for_bending(system: System, like: model.Problem | None) -> System:
    """The system with an element for bending in the elastic bodies that need it and whose description names none.

    ``like``: a problem whose elements are taken over instead, of bodies that it has.
    """
    p = system.problem
    open_ = [name for name, b in p.bodies.items() if b.element is None]
    chosen: dict[str, str] = {}
    if like is not None:
        chosen = {n: e for n in open_ if n in like.bodies and (e := like.bodies[n].element) is not None}
    elif elastic := [n for n in open_ if not p.bodies[n].material.plastic]:
        chosen = {name: FOR_BENDING for name, b in bendings(system, elastic).items() if not b.pressed}
    if not chosen:
        return system
    blocks = [replace(b, element=element_of(chosen[b.body])) if b.body in chosen else b for b in system.blocks]
    return replace(system, problem=p.with_elements(chosen), blocks=blocks, chosen=frozenset(chosen))
