"""Elements that pass through a contact: what slides past a tool that has an end makes its forces step, a step an element.

A node that lands or leaves turns the velocities of the elements behind it, and with them the plastic work per travel: forces
of drawing and rolling are a staircase of the mesh, whatever the contact rule (docs/developer/book/12). The
period is the time in which one element passes; it is taken here from the motion of the surface and the length of its elements.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.contact.forces import ContactForces
from prensa.errors import Notice
from prensa.fem.schedule import StepPlan
from prensa.fem.surface import Surface
from prensa.fem.system import System

Array = NDArray[np.float64]

STAIR = 0.75  # step of the force, over its mean, times the elements in the contact: measured in drawing, within 20 %
WORTH_SAYING = 0.05  # step of the force that is foretold and told
ROUNDNESS = 0.1  # sine between normal and arm up to which a tool turns within its own surface, as a roll does
FORETOLD = 2.0  # elements that pass before anything is foretold
STEEP = 0.5  # share of a motion along the surface's normal from which it presses more than it slides
INSIDE = 1e-6  # gap over element depth, and sine of a motion into the tool, that are none
TURNED = np.array([[0.0, 1.0], [-1.0, 0.0]])  # v @ TURNED: v turned by +90°


class Passing(NamedTuple):
    """What an increment did in a contact: ``advance``, elements that passed through it, and ``elements`` that lie in it.

    ``pressure``: normal force over closed area.
    """

    advance: float
    elements: float
    pressure: float


def passable(system: System) -> list[Surface]:
    """Contacts through which elements can pass: those in the plane, with tools that have an end."""
    if system.dofs.dimension != 2:
        return []
    return [s for s in system.surfaces if not system.master(s).shape.half_space]


def plastic(system: System, body: str) -> bool:
    """Whether a body is plastic: the step is one of plastic work."""
    return any(b.law.plastic for b in system.blocks if b.body == body)


def passing(system: System, s: Surface, f: ContactForces, before: Array, after: Array) -> Passing:
    """Passing of a contact with forces f in the increment between degrees of freedom before and after (ndof,)."""
    closed = f.p > 0
    if not closed.any():
        return Passing(0.0, 0.0, 0.0)
    old, new = (s.points.at(system.positions(u))[closed] for u in (before, after))
    way = new - _carried(system, s, old, f.stencils.arm[closed], f.stencils.n[closed], before, after)
    along = (way * f.stencils.e[closed, 0]).sum(axis=1)
    share, weight = along / s.points.at(_lengths(system, s, system.positions(after)))[closed], f.weight[closed]
    pressure = float(weight @ f.p[closed] / weight.sum())
    return Passing(abs(float(weight @ share / weight.sum())), _elements(system, s, int(closed.sum())), pressure)


def _elements(system: System, s: Surface, points: int) -> float:
    """Elements that so many points of a contact stand for: a node one, or half of a quadratic one."""
    whole = len(s.points) if s.points.are_nodes else len(s.points.edges)
    return points * whole / len(s.points) / _pieces(system, s)


def _carried(system: System, s: Surface, x: Array, arm: Array, n: Array, before: Array, after: Array) -> Array:
    """Where points x (k, 2) come with the tool; one that turns within its own surface, as a roll does, does not turn them."""
    p, q = system.master(s).place(before), system.master(s).place(after)
    turn = q[2] - p[2]
    if turn == 0.0 or _turns_within(system, s, arm, n):
        return np.asarray(x + q[:2] - p[:2])
    cos, sin = np.cos(turn), np.sin(turn)
    centre = system.master(s).at + p[:2]
    return np.asarray((x - centre) @ np.array([[cos, sin], [-sin, cos]]) + centre + q[:2] - p[:2])


def _turns_within(system: System, s: Surface, arm: Array, n: Array) -> bool:
    """Whether the surface of a tool at points with arms and normals n (k, 2) is round about its reference point."""
    if np.isfinite(system.master(s).shape.cylinder):
        return True
    across = np.abs(arm[:, 0] * n[:, 1] - arm[:, 1] * n[:, 0])
    return bool((across <= ROUNDNESS * np.hypot(*arm.T)).all())


def _pieces(system: System, s: Surface) -> int:
    """Pieces of the surface that make a side of an element: two of quadratic ones."""
    return 2 if system.meshes[s.body].cells.shape[1] in (6, 8) else 1


def _lengths(system: System, s: Surface, x: Array) -> Array:
    """Lengths (all nodes,) along the surface of the elements at its nodes, on positions x (all nodes, 2); 0 elsewhere."""
    a, b = s.points.edges.T
    length, n = np.hypot(*(x[b] - x[a]).T), len(x)
    total, number = (np.bincount(a, w, n) + np.bincount(b, w, n) for w in (length, None))
    return np.asarray(_pieces(system, s) * total / np.maximum(number, 1))


# -------------------------------------------------------------------------------------------------- before anything is solved
class _Track:
    """What slides past a tool in a rigid motion of the undeformed body: elements that passed, and most that lay in it."""

    def __init__(self) -> None:
        self.passed, self.lying = 0.0, 0.0


def foretold(system: System, moments: Iterable[tuple[StepPlan, Array]]) -> Iterator[Notice]:
    """Notices on contacts through which few elements will pass; ``moments``: plans, and the bodies at rest (ndof,).

    Bodies go as rigid ones, as far as supports lead them, or with the rolls that have friction where no support holds them.
    What a tool then overlaps on its leading side is what will lie in the contact.
    """
    wanted = [s for s in passable(system) if plastic(system, s.body)]
    if not wanted:
        return
    tracks = {s.name: _Track() for s in wanted}
    feed = {s.body: np.zeros(2) for s in wanted}
    last: Array | None = None
    for plan, u in moments:
        if last is not None:
            led = {body: _lead(system, body, plan, last, u) for body in feed}
            for body, step in led.items():
                offered = [way for s in wanted if s.body == body for way in _taken(system, s, plan, feed[body], last, u)]
                if offered and np.isnan(step).any():
                    led[body] = np.where(np.isnan(step), np.mean(offered, axis=0), step)
            for s in wanted:
                _follow(system, s, feed[s.body], led[s.body], last, u, tracks[s.name])
            feed = {body: feed[body] + np.nan_to_num(step) for body, step in led.items()}
        last = u
    for s in wanted:
        t = tracks[s.name]
        if t.passed >= FORETOLD and t.lying > 0 and t.lying * WORTH_SAYING <= STAIR:
            yield Notice(f"contacts.{system.surfaces.index(s)}", sentence(t.lying))


def sentence(lying: float, seen: float | None = None) -> str:
    """What there is to say of a contact with so few elements in it; seen: step of its force over the mean, if there is one."""
    few = max(round(lying), 1)
    told = f"{100 * STAIR / few:.0f} %" + (f" (here {100 * seen:.0f} %)" if seen is not None else "")
    return (
        f"about {few} element{'s' if few > 1 else ''} lie{'' if few > 1 else 's'} in the contact, forces step by {told} as "
        "nodes pass; shorten the elements along the motion ('grade' with 'x_between' or 'y_between'), and take the means over "
        "a passage (passages.csv), which are steady"
    )


def _lead(system: System, body: str, plan: StepPlan, before: Array, after: Array) -> Array:
    """Motion (2,) in which supports lead a body; not a number along an axis in which none holds it."""
    first = system.offsets[body]
    field = system.dofs.displacement
    dofs = plan.fixed[field.owns(plan.fixed)]
    nodes, axis = field.split(dofs)
    mine = (nodes >= first) & (nodes < first + len(system.meshes[body].points))
    out = np.full(2, np.nan)
    for a in range(2):
        step = (after - before)[dofs[mine & (axis == a)]]
        if len(step):
            out[a] = step[0] if np.ptp(step) <= 1e-9 * np.abs(step).max() else 0.0
    return out


def _taken(system: System, s: Surface, plan: StepPlan, feed: Array, before: Array, after: Array) -> Iterator[Array]:
    """The motion (2,) in which a tool takes a body along that it touches with friction, unless it is free to turn itself."""
    master = system.master(s)
    p, q, turn = master.place(before), master.place(after), master.dofs[-1]
    pairs = master.seen(system.X[s.points.nodes] + feed, before)
    inside = pairs.g <= INSIDE * s.points.depth.min()
    if plan.friction[system.surfaces.index(s)] is not None and inside.any() and turn not in plan.push:
        yield q[:2] - p[:2] + (q[2] - p[2]) * (pairs.arm[inside].mean(axis=0) @ TURNED)


def _follow(
    system: System, s: Surface, feed: Array, step: Array, before: Array, after: Array, track: _Track
) -> None:  # fmt: skip
    """Add a motion of a body and its tool to a track; along an axis in which nothing leads the body it rests."""
    nodes, master = s.points.nodes, system.master(s)
    x = system.X[nodes] + feed
    p, q, pairs = master.place(before), master.place(after), master.seen(x, before)
    inside = pairs.g <= INSIDE * s.points.depth.min()
    way = np.nan_to_num(step) - (q[:2] - p[:2]) + np.zeros_like(x)
    if not _turns_within(system, s, pairs.arm, pairs.n):
        way -= (q[2] - p[2]) * (pairs.arm @ TURNED)
    size = np.hypot(*way.T)
    slides = np.abs((way * s.node_normal).sum(axis=1)) < STEEP * size
    leading = inside & slides & ((way * pairs.n).sum(axis=1) < -INSIDE * size)
    if leading.any():
        along = np.abs((way * pairs.e[:, 0]).sum(axis=1))
        track.passed += float((along / _lengths(system, s, system.X)[nodes])[leading].mean())
        track.lying = max(track.lying, np.count_nonzero(leading) / _pieces(system, s))
