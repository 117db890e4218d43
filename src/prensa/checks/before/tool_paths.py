"""Tools that never touch, cross each other, press what is held, or enter a body past its contacts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.before.edges_between_nodes import dips
from prensa.checks.before.held_nodes import Pressed, deepest, held, overconstrained
from prensa.checks.during.penetration import Watch, inside, watches
from prensa.checks.thresholds import ALONG, NO_DIFFERENCE, SLIGHT
from prensa.contact.faces import FacePoints
from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity, coordinates
from prensa.linear.rigid_modes import CLOSED
from prensa.model.interference import interference_of
from prensa.system.moments import Moment, contact_path, driven, moments
from prensa.system.system import System
from prensa.types import Array, Flags

AT_MIDDLES = ", and contact is at the middle of the sides of its faces alone: shorten the elements there, or "
"""What is said of a tool that touches a corner of quadratic faces."""


def tool_paths(system: System) -> Iterator[Finding]:
    """Tools that never touch, that press what cannot yield, that cross each other, or go into what has no contact with them."""
    watched = watches(system)
    nearest, farthest, first = (np.full(len(system.tool_contacts), v) for v in (np.inf, -np.inf, np.nan))
    driven_tools = np.zeros(len(system.tools), dtype=bool)
    at_first = system.initial().u
    known = np.ones(len(system.tool_contacts), dtype=bool)
    moved = {name for name, body in system.problem.bodies.items() if driven(system, name)}
    moved |= {body for s in system.surfaces if s.opposite is not None for body in s.bodies}  # one may move the other
    pressed: dict[tuple[int, int], Pressed] = {}
    reported: dict[str, Finding] = {}
    passed, before = np.zeros(len(system.tool_contacts), dtype=bool), at_first
    for m in moments(system):
        x = system.positions(m.u)
        for t in range(len(system.tools)):
            own = system.dofs.tool.dofs(t)
            driven_tools[t] |= bool((m.u[own] != at_first[own]).any())
        for i, s in enumerate(system.tool_contacts):
            known[i] &= m.known[system.tool_masters[s.against].number]
            if not m.known[system.tool_masters[s.against].number]:
                continue
            pairs = system.nodes_seen(s, m.u)
            gap = float(pairs.g.min())
            passed[i] = passed[i] or (s.body not in moved and gap > 0.0 and _passes(system, s, before, m.u))
            nearest[i], farthest[i] = min(nearest[i], gap), max(farthest[i], gap)
            first[i] = gap if np.isnan(first[i]) else first[i]
            held(system, s, i, m, x, pressed)
        for notice in _crossing(system, m, x):
            reported.setdefault(notice.path, notice)
        at_rest = set(system.problem.bodies) - moved - _touched(system, nearest, known)
        for notice in _entered(system, watched, m, at_rest):
            reported.setdefault(notice.path, notice)
        before = m.u
    idle: list[tuple[int, Finding]] = []
    if system.problem.start is None:  # tools of an earlier run may have pressed before
        idle += _never_pressing(system, first, nearest, farthest, known, moved, driven_tools)
    for i, s in enumerate(system.tool_contacts):
        if nearest[i] <= 0 or not known[i]:
            # A tool that reached a body, or whose place is not known, may have moved it: nothing is known of it from then on.
            moved.add(s.body)
    idle += _never_touching(system, nearest, known, moved)
    # what goes in between two nodes comes near none, and has a word of its own, as has what enters past its contacts
    between = dips(system) if idle else {}
    idle = [(i, f) for i, f in idle if f"tools.{system.tool_contacts[i].against}" not in reported]
    yield from (_through(system, i) if passed[i] else f for i, f in idle if system.tool_contacts[i].name not in between)
    yield from reported.values()
    worst = deepest(pressed)
    for (number, k), most in worst.items():
        if k < 0 and not system.tool_masters[system.surfaces[number].against].shape.half_space:
            continue  # what is no half-space may stand beside them, or the body yield in between
        if k >= 0 and (number, -1) in worst:
            continue  # the tool goes beyond the supports: said once
        i, s = number, system.surfaces[number]
        yield overconstrained(system, s, i, most, candidate=k >= 0)


def _never_touching(system: System, nearest: Array, known: Flags, moved: set[str]) -> Iterator[tuple[int, Finding]]:
    """Contacts of tools that never come near, by their number."""
    reached = {
        s.against for i, s in enumerate(system.tool_contacts) if nearest[i] <= CLOSED * s.points.depth.min() or not known[i]
    }
    for i, s in enumerate(system.tool_contacts):
        if s.against in reached and s.description.surface == (s.body,):
            continue  # a tool is against all bodies where nothing else is said, not meant to meet them all
        if known[i] and nearest[i] > CLOSED * s.points.depth.min() and s.body not in moved:
            gap = f"never comes nearer than {nearest[i]:.4g}" if np.isfinite(nearest[i]) else "is never opposite to it"
            yield i, Finding(
                contact_path(system, i),
                f"tool {s.against!r} never touches {'+'.join(s.description.surface)!r} in any step: it {gap}"
                + (AT_MIDDLES if _coarse(s, nearest[i]) else "; ")
                + "check where it is placed, the sign and the size of its motion",
            )


def _passes(system: System, s: Surface, before: Array, u: Array) -> bool:
    """Whether a tool that is moved straight from degrees of freedom ``before`` (ndof,) to u enters a node on its way.

    Of that nothing is seen at either end where the tool is smaller than its way.
    """
    master, d = system.tool_masters[s.against], system.dofs.dimension
    way = master.place(u) - master.place(before)
    length = float(np.linalg.norm(way[:d]))
    if not length or way[d:].any():
        return False
    x = system.positions(before)[s.points.nodes]
    start, end = (np.asarray(master.local(x + shift, before)) for shift in (0.0, -way[:d]))
    ahead = (end - start)[0] / length
    far = master.shape.along(start, ahead, length)
    met = np.isfinite(far) & (far > -NO_DIFFERENCE * length) & (far < length)
    entered = master.shape.closest(start[met] + far[met, None] * ahead).n @ ahead
    return bool((entered < -SLIGHT).any())  # what goes along it touches it


def _through(system: System, i: int) -> Finding:
    """What there is to say of a tool that passes nodes of its contact in less than the time between two moments."""
    s = system.tool_contacts[i]
    return Finding(
        contact_path(system, i),
        f"tool {s.against!r} passes right through {'+'.join(s.description.surface)!r}: check its size, and that of its motion",
    )


def _coarse(s: Surface, gap: float) -> bool:
    """Whether a tool misses points of a surface of quadratic faces by less than an element."""
    return isinstance(s.points, FacePoints) and s.points.faces.shape[1] == 6 and gap < float(s.points.depth.min())


def _never_pressing(
    system: System, first: Array, nearest: Array, farthest: Array, known: Flags, moved: set[str], driven_tools: Flags
) -> Iterator[tuple[int, Finding]]:
    """Tools that touch a body that nothing presses or moves, and stay, or are moved along it or away from it.

    Those that stay are named only where no other one is moved: what it does not press, they cannot.
    ``first``, ``nearest``, ``farthest``: their gaps at first, and the least and largest, by contact, whose numbers come with
    what there is to say; ``driven_tools``: which are moved.
    """
    near = np.array([CLOSED * s.points.depth.min() for s in system.tool_contacts])
    pressing = {
        other
        for s, least, close, sure in zip(system.tool_contacts, nearest, near, known)
        if least < -close or not sure or interference_of(s.description) is not None
        for other in system.tied_bodies(s.body)
    }
    moved = {other for body in moved for other in system.tied_bodies(body)}
    idle = [
        (i, s) for i, s in enumerate(system.tool_contacts) if abs(nearest[i]) <= near[i] and s.body not in pressing | moved
    ]
    left = {other for _, s in idle if driven_tools[system.tool_masters[s.against].number] for other in system.tied_bodies(s.body)}
    for i, s in idle:
        drives = driven_tools[system.tool_masters[s.against].number]
        if drives or s.body not in left:
            way = f"goes away from it, by up to {farthest[i]:.4g}" if farthest[i] > near[i] else "goes along it"
            if not drives:
                way = "stays there"
            what = "+".join(s.description.surface)
            does = f"touches {what!r} at first and only {way}"
            if not first[i] <= near[i]:
                does = f"comes to touch {what!r} and goes no deeper"
            yield i, Finding(
                contact_path(system, i),
                f"tool {s.against!r} {does}: it never presses; check the sign and the axis of its motion",
            )


def _touched(system: System, nearest: Array, known: Flags) -> set[str]:
    """Bodies that some tool has reached by now, or may have, with those tied to them."""
    reached = {
        s.body for i, s in enumerate(system.tool_contacts) if nearest[i] <= CLOSED * s.points.depth.min() or not known[i]
    }
    return {other for body in reached for other in system.tied_bodies(body)}


def _entered(system: System, watched: list[Watch], m: Moment, at_rest: set[str]) -> Iterator[Finding]:
    """Tools that are inside a body that nothing has touched before, past a side that has no contact with them."""
    node = inside(system, [w for w in watched if m.known[w.tool]], m.u) if at_rest else None
    if node is not None and node.body in at_rest:
        yield Finding(f"tools.{node.tool}", f"at time {m.t:.4g} {node}: {node.remedy}")


def _crossing(system: System, m: Moment, x: Array) -> Iterator[Finding]:
    """Two tools whose faces pass each other where they press on the same body, or that press the same points."""
    for i, a in enumerate(system.tool_contacts):
        for b in system.tool_contacts[:i]:
            ta, tb = system.tool_masters[a.against], system.tool_masters[b.against]
            if ta.name == tb.name or a.body != b.body or not (m.known[ta.number] and m.known[tb.number]):
                continue
            shared = np.intersect1d(a.points.nodes, b.points.nodes)
            planes = ta.shape.half_space and tb.shape.half_space
            # Tools with an end pass beside each other on different nodes: they only cross where both press the same ones.
            nodes = shared if len(shared) or not planes else a.points.nodes[:1]
            if not len(nodes):
                continue
            pa = ta.seen(x[nodes], m.u)
            pb = tb.seen(x[nodes], m.u)
            facing = (pa.n * pb.n).sum(axis=1)
            h = float(a.points.depth.min())
            between = np.where(facing < -ALONG, pa.g + pb.g, np.inf)
            k = int(np.argmin(between))
            if between[k] < -CLOSED * h:
                yield Finding(
                    contact_path(system, i),
                    f"tools {tb.name!r} and {ta.name!r} cross: at time {m.t:.4g} they overlap by {-between[k]:.4g} near "
                    f"({coordinates(x[nodes[k]])}) and leave the body no room; check their travels",
                    Severity.REFUSE,
                )
            same = (facing > 1.0 - NO_DIFFERENCE) & (np.maximum(pa.g, pb.g) < -CLOSED * h) & (np.abs(pa.g - pb.g) < CLOSED * h)
            if len(shared) and same.any():
                yield Finding(
                    contact_path(system, i),
                    f"tools {tb.name!r} and {ta.name!r} press the same points of {'+'.join(a.description.surface)!r} at time "
                    f"{m.t:.4g}: their shares of the force are undetermined; keep one contact",
                )
