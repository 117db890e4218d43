"""Elements that will pass through a contact, known before anything is solved from the rigid motion of bodies and tools."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE, TOWARDS
from prensa.contact.passage import (
    INSIDE,
    STAIR,
    WORTH_SAYING,
    lengths,
    passable,
    pieces,
    sentence,
    turns_within,
)
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.geometry.plane import turned
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array

PREDICTED_FROM = 2.0
"""Elements that pass before anything is predicted: forces have not settled before."""


def plastic(system: System, body: str) -> bool:
    """Whether a body is plastic: the step is one of plastic work."""
    return any(b.law.plastic for b in system.blocks if b.body == body)


class _Track:
    """What slides past a tool in a rigid motion of the undeformed body: elements that passed, and most that lay in it."""

    def __init__(self) -> None:
        self.passed, self.lying = 0.0, 0.0


def few_passages(system: System, moments: Iterable[tuple[StepPlan, Array]]) -> Iterator[Finding]:
    """Findings on contacts through which few elements will pass; ``moments``: plans, and the bodies at rest (ndof,).

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
                    # Supports come before rolls: where they hold the body the rolls slip.
                    led[body] = np.where(np.isnan(step), np.mean(offered, axis=0), step)
            for s in wanted:
                _follow(system, s, feed[s.body], led[s.body], last, u, tracks[s.name])
            feed = {body: feed[body] + np.nan_to_num(step) for body, step in led.items()}
        last = u
    for s in wanted:
        t = tracks[s.name]
        if t.passed >= PREDICTED_FROM and t.lying > 0 and t.lying * WORTH_SAYING <= STAIR:
            yield Finding(f"contacts.{system.surfaces.index(s)}", sentence(t.lying))


def _lead(system: System, body: str, plan: StepPlan, before: Array, after: Array) -> Array:
    """Motion (2,) in which supports lead a body; not a number along an axis in which none holds it."""
    field = system.dofs.displacement
    dofs = plan.fixed[field.owns(plan.fixed)]
    nodes, axis = field.split(dofs)
    mine = system.has(body, nodes)
    out = np.full(2, np.nan)
    for a in range(2):
        step = (after - before)[dofs[mine & (axis == a)]]
        if len(step):
            # Supports that move by different ways stretch the body: they lead it nowhere as a whole.
            out[a] = step[0] if np.ptp(step) <= NO_DIFFERENCE * np.abs(step).max() else 0.0
    return out


def _taken(system: System, s: Surface, plan: StepPlan, feed: Array, before: Array, after: Array) -> Iterator[Array]:
    """The motion (2,) in which a tool takes a body along that it touches with friction, unless it is free to turn itself."""
    master = system.tool_masters[s.against]
    p, q, turn = master.place(before), master.place(after), master.dofs[-1]
    pairs = master.seen(system.X[s.points.nodes] + feed, before)
    inside = pairs.g <= INSIDE * s.points.depth.min()
    if plan.friction[system.surfaces.index(s)] is not None and inside.any() and turn not in plan.push:
        yield q[:2] - p[:2] + (q[2] - p[2]) * turned(pairs.arm[inside].mean(axis=0))


def _follow(
    system: System, s: Surface, feed: Array, step: Array, before: Array, after: Array, track: _Track
) -> None:  # fmt: skip
    """Add a motion of a body and its tool to a track; along an axis in which nothing leads the body it rests."""
    nodes, master = s.points.nodes, system.tool_masters[s.against]
    x = system.X[nodes] + feed
    p, q, pairs = master.place(before), master.place(after), master.seen(x, before)
    inside = pairs.g <= INSIDE * s.points.depth.min()
    way = np.nan_to_num(step) - (q[:2] - p[:2]) + np.zeros_like(x)
    if not turns_within(system, s, pairs.arm, pairs.n):
        way -= (q[2] - p[2]) * turned(pairs.arm)
    size = np.hypot(*way.T)
    slides = np.abs((way * s.node_normal).sum(axis=1)) < TOWARDS * size
    leading = inside & slides & ((way * pairs.n).sum(axis=1) < -INSIDE * size)
    if leading.any():
        along = np.abs((way * pairs.e[:, 0]).sum(axis=1))
        track.passed += float((along / lengths(system, s, system.X)[nodes])[leading].mean())
        track.lying = max(track.lying, np.count_nonzero(leading) / pieces(system, s))
