"""Tools at planes of symmetry: whether one reaches a plane, is its own mirror image there, and stays so in a run.

The whole is the part with its images, so that beyond a plane the tool of the whole is the image of what stands on this side. A
tool that is drawn across the plane is one with its image only if both are the same near the bodies: where the nodes of its
contacts see it (at their closest points), bodies at rest, at the moments of all steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE, SLIGHT
from prensa.contact.masters import RigidMaster
from prensa.contact.pairing import rotation
from prensa.friction.fading import Fading
from prensa.geometry.plane import rotated
from prensa.geometry.reflections import Plane
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.system.moments import Moment, moments
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array, Flags, Index

OFF_LINE = 1e-3
"""Distance of a tool from the plane that it crosses, over its half breadth, that is a rounded coordinate."""


class Wall(NamedTuple):
    """A plane (or line) of symmetry, its normal into the part; ``body``: the one whose contacts meet tools there, None: all."""

    plane: Plane
    body: str | None = None

    @classmethod
    def of(cls, plane: Plane, system: System, body: str) -> Wall:
        """Of a body, by a plane with either normal."""
        if plane.distance(system.X[system.span(body)]).sum() >= 0.0:
            return cls(plane, body)
        return cls(plane._replace(normal=tuple(-n for n in plane.normal), place=-plane.place), body)


class Sight(NamedTuple):
    """What nodes x (k, d) of the contacts of a tool see of it: closest points ``feet`` (k, d) and normals n (k, d) there.

    ``touches``: whether any node is on the tool, or in it; ``chord``: how far (length) the surface may be off what it stands for.
    """

    x: Array
    feet: Array
    n: Array
    touches: bool
    chord: float


class Unlike(NamedTuple):
    """How a tool differs from its mirror image near the bodies: by ``off`` (length).

    ``adds``: whether the image sticks out of the tool on the side of the part, where it would press the bodies too.
    """

    off: float
    adds: bool


@dataclass
class Meeting:
    """A tool at a plane of symmetry in a run.

    ``crosses``: whether it is drawn on both sides of the plane at the start; ``reaches``: whether it comes up to the plane (what
    ends: on both sides; what has no end: where the bodies see it), ``began``: at the start. ``unlike``: how it differs from its
    image, first in the step ``since`` (None: at the start). ``moved``, ``free``: first step that moves it across the plane, or
    turns it about another axis than the normal, or leaves it free to, while it touches. ``ways`` (2, 3): whether it goes
    anywhere, goes across the plane, turns about another axis than the normal, or is free to: while it touches
    nothing, and while it does, if it ``touched``.
    """

    master: RigidMaster
    wall: Wall
    crosses: bool = False
    began: bool = False
    reaches: bool = False
    unlike: Unlike | None = None
    since: int | None = None
    moved: int | None = None
    free: int | None = None
    touched: bool = False
    ways: Flags = field(default_factory=lambda: np.zeros((2, 3), dtype=bool))
    _gone: bool = field(default=False, repr=False)  # across the plane, or up to it, since it was compared with its image

    @property
    def across(self) -> int | None:
        """The first step in which it does not stay its own image."""
        return min((step for step in (self.moved, self.free) if step is not None), default=None)

    @property
    def alike(self) -> bool:
        """Whether the image of a tool that does not reach the plane is another one that goes the same way, or turns so."""
        goes, beside, turns = self.ways[int(self.touched)]
        return not self.reaches and not beside and bool(goes or not turns)


def meetings(system: System, walls: Sequence[Wall], tools: Sequence[str] | None = None) -> list[Meeting]:
    """How tools, all or some by name, meet planes of symmetry; only those that have contacts with the bodies there."""
    p = system.problem
    pairs = {(s.against, k) for s in system.tool_contacts for k, wall in enumerate(walls) if wall.body in (None, s.body)}
    names = [name for name in (p.tools if tools is None else tools) if name in system.tool_masters]
    out = [Meeting(system.tool_masters[t], wall) for t in names for k, wall in enumerate(walls) if (t, k) in pairs]
    before: Moment | None = None
    then: dict[tuple[str, str | None], Sight] = {}
    for now in moments(system) if out else ():
        seen: dict[tuple[str, str | None], Sight] = {}
        for m in out:
            _follow(m, system, before, now, _sights(m, system, before, then), _sights(m, system, now, seen))
        before, then = now, seen
    return out


def _sights(
    m: Meeting, system: System, at: Moment | None, known: dict[tuple[str, str | None], Sight]
) -> Callable[[], Sight]:
    """What is seen of a tool at a moment, found when it is asked for and kept in ``known``."""

    def seen() -> Sight:
        key = m.master.name, m.wall.body
        if key not in known:
            assert at is not None
            known[key] = _seen(system, m.master, m.wall.body, at.u)
        return known[key]

    return seen


def _seen(system: System, master: RigidMaster, body: str | None, u: Array) -> Sight:
    contacts = [s for s in system.tool_contacts if s.against == master.name and body in (None, s.body)]
    x = system.positions(u)[np.concatenate([s.points.nodes for s in contacts])]
    depth = np.concatenate([s.points.depth for s in contacts])
    pairs = master.seen(x, u)
    feet = x - pairs.g[:, None] * pairs.n
    drawn = master.tool.description.touched(master.shape, master.local(feet, u))
    return Sight(x, feet, pairs.n, bool((pairs.g <= SLIGHT * depth).any()), 0.0 if drawn is None else drawn.chord)


# ---------------------------------------------------------------------------------------------------- in the course of a run
def _follow(
    m: Meeting, system: System, before: Moment | None, now: Moment, then: Callable[[], Sight], seen: Callable[[], Sight]
) -> None:
    """Add to a meeting what a moment shows; ``before``: the moment before it, in this step or another."""
    dofs, n = m.master.dofs, _in_space(np.asarray(m.wall.plane.normal))
    same = before is not None and before.plan is now.plan
    way = motions_in_space(now.u[dofs] - before.u[dofs] if same and before is not None else np.zeros(len(dofs)))
    free = motions_in_space(np.eye(len(dofs))[~np.isin(dofs, now.plan.fixed)])
    goes, loose = goes_across(way, n), np.array([w for w in free if goes_across(w, n)]).reshape(-1, 6)
    if before is None:
        m.crosses = _both_sides(m, system, now.u)
        m.began = m.reaches = (m.crosses and ends(m)) or _sees_plane(m.wall, seen(), system)
        m.unlike = unlike(m, system, now.u, seen()) if m.crosses or m.reaches else None
    m._gone |= goes or (before is not None and not m.reaches)
    if m.reaches and not m._gone and not len(loose):
        return
    lost = not now.known[m.master.number] and bool(free[:, :3].any())  # where forces take it is not known
    touches = lost or seen().touches or (goes and then().touches)
    m.touched |= touches
    for w in (way, *free):
        m.ways[int(touches)] |= _kinds(w, n)
    if not touches:
        return
    there = _reaches_at(m, system, now.u, seen())
    if goes and not there and before is not None:
        there = _reaches_at(m, system, before.u, then())
    m.reaches |= there
    if not there:
        return
    if m.moved is None and goes and _drags(m, now.plan, system, now.u, way[None], seen()):
        m.moved = now.plan.number
    if m.free is None and len(loose) and _drags(m, now.plan, system, now.u, loose, seen()):
        m.free = now.plan.number
    if m.unlike is None and m._gone:
        m.unlike = unlike(m, system, now.u, seen())
        m.since = None if m.unlike is None else now.plan.number
    m._gone = False


def _in_space(x: Array) -> Array:
    """Vectors (…, 3) of vectors (…, d)."""
    return np.concatenate([x, np.zeros((*x.shape[:-1], 3 - x.shape[-1]))], axis=-1)


def motions_in_space(ways: Array) -> Array:
    """Motions (…, 6) of a tool, its turns last, from its degrees of freedom (…, d + w): in the plane it turns about z."""
    d = 3 if ways.shape[-1] == 6 else 2
    turns = ways[..., d:]
    return np.concatenate([_in_space(ways[..., :d]), np.zeros((*ways.shape[:-1], 3 - turns.shape[-1])), turns], axis=-1)


def _kinds(way: Array, n: Array) -> Flags:
    """Whether a motion (6,) of a tool, its turns last, goes anywhere, goes along a normal (3,), turns about another axis."""
    size, turn = np.linalg.norm(way[:3]), np.linalg.norm(way[3:])
    across, beside = abs(way[:3] @ n), np.linalg.norm(way[3:] - (way[3:] @ n) * n)
    return np.array([size > 0.0, across > NO_DIFFERENCE * size, beside > NO_DIFFERENCE * turn])


def goes_across(way: Array, n: Array) -> bool:
    """Whether a motion (6,) is not its own mirror image across a plane with a normal (3,)."""
    return bool(_kinds(way, n)[1:].any())


def _drags(m: Meeting, plan: StepPlan, system: System, u: Array, ways: Array, sight: Sight) -> bool:
    """Whether one of some motions (k, 6) of a tool differs, where it is seen, from that of its image.

    Without friction only the parts along the normals act: a flat die that slides in its plane, or a round one that turns about
    its axis, stays what it is.
    """
    if rough(system, plan, m.master.name, m.wall.body):
        return True
    n, seen_n, feet = (_in_space(v) for v in (np.asarray(m.wall.plane.normal), sight.n, sight.feet))
    centre = m.master.at + m.master.place(u)[: m.master.dimension]
    arm, centre = -m.wall.plane.distance(centre[None])[0] * n, _in_space(centre)
    for way in ways:
        v, w = way[:3], way[3:]
        beside = v + np.cross(w, arm)  # on the plane
        off = 2.0 * (beside @ n) * n + 2.0 * np.cross(w - (w @ n) * n, feet - centre - arm)
        size = np.linalg.norm(v + np.cross(w, feet - centre), axis=1).max()
        if np.abs(np.einsum("ki,ki->k", off, seen_n)).max() > NO_DIFFERENCE * size:
            return True
    return False


def rough(system: System, plan: StepPlan, tool: str, body: str | None = None) -> bool:
    """Whether a tool has friction with bodies, or one, in a step."""
    laws = zip(system.tool_contacts, plan.friction)
    return any(
        not system.frictionless(law) or isinstance(law, Fading)
        for s, law in laws
        if s.against == tool and body in (None, s.body)
    )


# --------------------------------------------------------------------------------------------------------- where it stands
def endless(m: Meeting) -> bool:
    """Whether a tool is extruded across the plane, and has no ends: it is drawn as far as it has to be seen."""
    own = m.master.tool.description
    axis = np.asarray(getattr(own, "axis", np.zeros(3)), dtype=float)
    return own.type == "extruded" and bool(abs(axis @ np.asarray(m.wall.plane.normal)) > NEGLIGIBLE * np.linalg.norm(axis))


def ends(m: Meeting) -> bool:
    """Whether a tool has ends across the plane, so that what is drawn of it is all of it."""
    shape = m.master.shape
    on = shape.cavity or endless(m) or m.master.tool.description.goes_on(shape)
    return bool(0.0 < shape.extent < np.inf) and not on


def surface_of(master: RigidMaster, system: System) -> tuple[Array, Index]:
    """Points (k, d) of the surface of a tool in its frame, as it is drawn, and pairs (e, 2) of neighbours among them."""
    tool, depth = master.tool, system.length
    if master.dimension == 3:
        points, triangles = tool.description.facets(tool.direction, depth)
        return points, np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    lines = tool.description.outline(depth)
    points, starts = np.concatenate(lines), np.cumsum([0, *map(len, lines)])
    if tool.description.direction_key:
        points = rotated(points, float(np.arctan2(tool.direction[0], -tool.direction[1])))
    pairs = np.concatenate([np.stack([k := np.arange(a, b), np.roll(k, -1)], axis=1) for a, b in pairwise(starts)])
    on = np.abs(master.shape.closest(points).g) <= DRAWN * depth  # what closes an endless tool lies inside
    return points[on], (np.cumsum(on) - 1)[pairs[on[pairs].all(axis=1)]]


def _both_sides(m: Meeting, system: System, u: Array) -> bool:
    """Whether a tool is drawn on both sides of the plane; neither half-spaces nor what encloses the bodies are."""
    if m.master.shape.half_space or m.master.shape.cavity:
        return False
    place, d = m.master.place(u), m.master.dimension
    away = m.wall.plane.distance(m.master.at + place[:d] + surface_of(m.master, system)[0] @ rotation(place[d:]).T)
    return bool((away < -NEGLIGIBLE * system.length).any() and (away > NEGLIGIBLE * system.length).any())


def _sees_plane(wall: Wall, sight: Sight, system: System) -> bool:
    """Whether what is seen of a tool comes up to the plane; what lies along the plane presses it, and is left out."""
    beside = np.abs(sight.n @ np.asarray(wall.plane.normal)) < 1.0 - DRAWN
    return bool((wall.plane.distance(sight.feet)[beside] <= DRAWN * system.length).any())


def _reaches_at(m: Meeting, system: System, u: Array, sight: Sight) -> bool:
    return (ends(m) and _both_sides(m, system, u)) or _sees_plane(m.wall, sight, system)


def unlike(m: Meeting, system: System, u: Array, sight: Sight) -> Unlike | None:
    """How a tool differs from its image across the plane near the bodies; None where it is the same.

    Nor where the image adds nothing on the side of the part and the tool goes straight across the plane: it is drawn beyond it.
    """
    wall = m.wall
    g = m.master.seen(wall.plane.image(sight.feet), u).g
    least = max(OFF_LINE * float(np.abs(wall.plane.distance(sight.feet)).max()), 2.0 * sight.chord)
    off, adds = float(np.abs(g).max()), bool(g.min() < -least)
    on = np.abs(wall.plane.distance(sight.x)) <= DRAWN * system.length
    straight = bool((np.abs(sight.n[on] @ np.asarray(wall.plane.normal)) <= OFF_LINE).all())
    return None if off <= least or (straight and not adds) else Unlike(off, adds)
