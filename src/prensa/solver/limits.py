"""Limits reached where an increment fails: metal that flows at one place alone, friction as strong as the metal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.during.distortion import shapes
from prensa.contact.forces import ContactForces
from prensa.contact.surface import Surface
from prensa.errors import coordinates
from prensa.friction.law import bounded
from prensa.policy import Policy
from prensa.system.assembly import Block
from prensa.system.interaction import Context
from prensa.system.state import State
from prensa.system.system import Evaluation, System
from prensa.types import Array


def limits(system: System, c: Context, e: Evaluation, policy: Policy) -> Iterator[str]:
    """Clauses on the elements and contacts that are at their limit at an evaluated iterate of a failed increment."""
    yield from _flowing_alone(system, c, e, policy)
    yield from worn(system, c, policy)
    yield from friction_limits(system, c, e, policy)


def friction_limits(system: System, c: Context, e: Evaluation, policy: Policy) -> Iterator[str]:
    """Clauses on the contacts whose friction is at its limit."""
    for number, s in enumerate(system.surfaces):
        yield from _friction(system, c, s, e.contacts[number], number, policy)


def _flowing_alone(system: System, c: Context, e: Evaluation, policy: Policy) -> Iterator[str]:
    """Elements that flow many times as much as the rest of their body."""
    for block, new, old in zip(system.blocks, e.history, c.state.history):
        if not block.law.plastic:
            continue
        grown = (block.field(new, "plastic_strain") - block.field(old, "plastic_strain"))[..., 0].max(axis=1)
        worst, most = int(np.argmax(grown)), float(grown.max())
        others = float(np.quantile(grown, policy.plastic_quantile))
        if most > policy.localisation_strain and most > policy.localisation_ratio * others:
            times = f", {most / others:.0f} times as much as nearly all other elements" if others > 0 else ", alone"
            flow = f"has a plastic strain of {most:.2g} in an increment of {c.dt:.1g}{times}"
            yield f"{_element(system, block, worst)} {flow}: it collapses"


def worn(system: System, c: Context, policy: Policy) -> Iterator[str]:
    """The worst element, if it lost its shape during the run."""
    if system.problem.kinematics == "small":
        return
    for block in system.blocks:
        shape = shapes(system, block.body, c.state.u)
        worst = int(np.argmin(shape))
        if shape[worst] < min(policy.worn_shape, shapes(system, block.body, 0.0 * c.state.u)[worst]):
            yield f"{_element(system, block, worst)} is distorted (scaled Jacobian {shape[worst]:.2g})"


def _friction(
    system: System, c: Context, s: Surface, f: ContactForces, number: int, policy: Policy
) -> Iterator[str]:  # fmt: skip
    """A contact that nothing but friction at its bound holds, or whose friction is the shear strength of the metal under it."""
    bound, closed = _friction_bound(c, number, f), f.p > 0
    if bound is None or not closed.any():
        return
    shear, count = np.hypot.reduce(f.t, axis=1), int(closed.sum())
    if (shear[closed] >= (1.0 - policy.on_bound_tolerance) * bound[closed]).all():
        yield (f"friction of {s.name} is at its limit at all {count} points in contact: it does not resist further sliding")
    if system.problem.bodies[s.body].material.plastic:
        full = closed & (shear > policy.full_shear_ratio * system.shear_strength(s, c.state))
        if full.any():
            yield (
                f"friction of {s.name} reaches the shear strength of the metal at {int(full.sum())} of {count} closed points "
                f"(more than {policy.full_shear_ratio:g} of it): the surface layer shears instead of sliding"
            )


def mostly_sheared(system: System, state: State, policy: Policy) -> bool:
    """Whether in a committed state the skin under a contact flows instead of sliding, at half of its closed points or more."""
    for s in system.surfaces:
        closed = state.contact.closed[s.rows]
        if closed.any() and system.problem.bodies[s.body].material.plastic:
            shear = np.linalg.norm(state.contact.traction[s.rows].reshape(len(closed), -1), axis=1)
            full = closed & (shear > policy.full_shear_ratio * system.shear_strength(s, state))
            if 2 * full.sum() >= closed.sum():
                return True
    return False


def _element(system: System, block: Block, element: int) -> str:
    return f"element {element} of {block.body} (initially near {coordinates(system.X[block.cells[element]].mean(axis=0))})"


def _friction_bound(c: Context, number: int, f: ContactForces) -> Array | None:
    """Bounds (k,) of the tractions f of contact ``number``; None without friction."""
    law = c.laws[number]
    return None if law is None else bounded(law, f.p, f.kappa, c.law_at[number])[0]
