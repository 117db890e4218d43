"""Elements that pass through a contact: what slides past a tool that has an end makes its forces step, a step an element.

A node that lands or leaves turns the velocities of the elements behind it, and with them the plastic work per travel: forces
of drawing and rolling are a staircase of the mesh, whatever the contact rule (docs/developer/book/12). The
period is the time in which one element passes; it is taken here from the motion of the surface and the length of its elements.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.contact.forces import ContactForces
from prensa.contact.masters import Geometry
from prensa.contact.surface import Surface
from prensa.geometry.plane import cross
from prensa.types import Array

STAIR = 0.75  # step of the force, over its mean, times the elements in the contact: measured in drawing, within 20 %
WORTH_SAYING = 0.05  # of a force: a step that is predicted, or an error, from which something is said of it
ROUNDNESS = 0.1  # sine between normal and arm up to which a tool turns within its own surface, as a roll does
INSIDE = 1e-6  # gap over element depth, and sine of a motion into the tool, that are none


class Passing(NamedTuple):
    """What an increment did in a contact: ``advance``, elements that passed through it, and ``elements`` that lie in it.

    ``pressure``: normal force over closed area.
    """

    advance: float
    elements: float
    pressure: float


def passable(system: Geometry) -> list[Surface]:
    """Contacts through which elements can pass: those in the plane, with tools that have an end."""
    if system.dofs.dimension != 2:
        return []
    return [s for s in system.tool_contacts if not system.tool_masters[s.against].shape.half_space]


def passing(system: Geometry, s: Surface, f: ContactForces, before: Array, after: Array) -> Passing:
    """Passing of a contact with forces f in the increment between degrees of freedom before and after (ndof,)."""
    closed = f.p > 0
    if not closed.any():
        return Passing(0.0, 0.0, 0.0)
    old, new = (s.points.at(system.positions(u))[closed] for u in (before, after))
    way = new - _carried(system, s, old, f.stencils.arm[closed], f.stencils.n[closed], before, after)
    along = (way * f.stencils.e[closed, 0]).sum(axis=1)
    # Elements stretch as they go through: a passage is over when the length is gone that they have now.
    share, weight = along / s.points.at(lengths(system, s, system.positions(after)))[closed], f.weight[closed]
    pressure = float(weight @ f.p[closed] / weight.sum())
    return Passing(abs(float(weight @ share / weight.sum())), _elements(system, s, int(closed.sum())), pressure)


def _elements(system: Geometry, s: Surface, points: int) -> float:
    """Elements that so many points of a contact stand for: a node one, or half of a quadratic one."""
    whole = len(s.points) if s.points.are_nodes else len(s.points.edges)
    # Rules with several points an edge count it once, the two pieces of a quadratic side as one element.
    return points * whole / len(s.points) / pieces(system, s)


def _carried(system: Geometry, s: Surface, x: Array, arm: Array, n: Array, before: Array, after: Array) -> Array:
    """Where points x (k, 2) come with the tool; one that turns within its own surface, as a roll does, does not turn them."""
    p, q = system.tool_masters[s.against].place(before), system.tool_masters[s.against].place(after)
    turn = q[2] - p[2]
    if turn == 0.0 or turns_within(system, s, arm, n):
        return np.asarray(x + q[:2] - p[:2])
    cos, sin = np.cos(turn), np.sin(turn)
    centre = system.tool_masters[s.against].at + p[:2]
    return np.asarray((x - centre) @ np.array([[cos, sin], [-sin, cos]]) + centre + q[:2] - p[:2])


def turns_within(system: Geometry, s: Surface, arm: Array, n: Array) -> bool:
    """Whether the surface of a tool at points with arms and normals n (k, 2) is round about its reference point."""
    if np.isfinite(system.tool_masters[s.against].shape.cylinder):
        return True
    across = np.abs(cross(arm, n))
    return bool((across <= ROUNDNESS * np.hypot(*arm.T)).all())


def pieces(system: Geometry, s: Surface) -> int:
    """Pieces of the surface that make a side of an element: two of quadratic ones."""
    return 2 if system.meshes[s.body].cells.shape[1] in (6, 8) else 1


def lengths(system: Geometry, s: Surface, x: Array) -> Array:
    """Lengths (all nodes,) along the surface of the elements at its nodes, on positions x (all nodes, 2); 0 elsewhere."""
    a, b = s.points.edges.T
    length, n = np.hypot(*(x[b] - x[a]).T), len(x)
    total, number = (np.bincount(a, w, n) + np.bincount(b, w, n) for w in (length, None))
    return np.asarray(pieces(system, s) * total / np.maximum(number, 1))


def sentence(lying: float, seen: float | None = None) -> str:
    """What there is to say of a contact with so few elements in it; seen: step of its force over the mean, if there is one."""
    few = max(round(lying), 1)
    step = f"{100 * STAIR / few:.0f} %" + (f" (here {100 * seen:.0f} %)" if seen is not None else "")
    return (
        f"about {few} element{'s' if few > 1 else ''} lie{'' if few > 1 else 's'} in the contact, forces step by {step} as "
        "nodes pass; shorten the elements along the motion ('grade' with 'x_between' or 'y_between'), and take the means over "
        "a passage (passages.csv), which are steady"
    )
