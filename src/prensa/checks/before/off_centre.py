"""Tools that overlap their own mirror images: across a plane of symmetry or the axis, off it, turned, or moved across it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prensa.checks.before.mirrored_tools import OFF_LINE, Meeting, Wall, endless, meetings, surface_of
from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.contact.masters import RigidMaster
from prensa.errors import Finding, Severity
from prensa.geometry.reflections import Plane, axis_plane
from prensa.model import problem as model
from prensa.model.names import SYMMETRY
from prensa.precision import NEGLIGIBLE
from prensa.system.held import symmetry_planes
from prensa.system.system import System
from prensa.types import Array, Index

TWO = "with its mirror image there would be two tools that overlap"
"""What is wrong with them."""


class Middle(NamedTuple):
    """Plane about which a tool is its own mirror image: ``off`` (length) beside a plane of symmetry, in a breadth of 2 ``half``.

    ``plate``: whether the tool goes straight across the plane of symmetry and is only drawn beyond it: its image adds nothing.
    """

    off: float
    half: float
    plate: bool = False

    @property
    def apart(self) -> bool:
        """Whether it is beside the plane by more than a rounded coordinate."""
        return not self.plate and OFF_LINE * self.half < abs(self.off) < (1.0 - OFF_LINE) * self.half


class Crossing(NamedTuple):
    """A tool that reaches across a ``line`` of symmetry of a ``body`` in the plane, None where it is the axis of revolution."""

    master: RigidMaster
    line: Plane
    body: str | None
    middle: Middle


@dataclass(frozen=True, kw_only=True)
class Overlap(Finding):
    """A finding on a ``tool`` that overlaps its own image."""

    tool: str


def off_centre(system: System) -> Iterator[Finding]:
    """Tools that overlap their own mirror images, across planes of symmetry or the axis.

    A side that is held along its normal may be a wall as well as a plane of symmetry: only what surely reaches across is
    reported. In the plane those that are moved or pushed across the line are on their way.
    """
    p = system.problem
    # 'no_contact' against symmetry says which sides are walls.
    walls = {s.partition(".")[0] for n in p.no_contact if n.against == SYMMETRY for s in n.surface}
    if system.dofs.dimension == 3:
        planes = [
            Wall.of(plane, system, body)
            for body in system.meshes if body not in walls for plane in symmetry_planes(system, body)
        ]  # fmt: skip
        yield from overlaps(system, planes)
        return
    reported: set[str] = set()
    for c in _crossings(system, walls):
        if c.master.name not in reported and c.middle.apart and not _loose(p, c.master.name, np.array(c.line.normal)):
            reported.add(c.master.name)
            yield _apart(c)


def _apart(c: Crossing) -> Overlap:
    """What to say of a tool in the plane whose middle is beside the line."""
    across, place, at = c.middle.half - abs(c.middle.off), c.line.place + c.middle.off, c.line.place
    where = "the axis" if c.body is None else f"the line of symmetry of {c.body!r}, x = {at:g},"
    return Overlap(
        _place(c.master),
        f"it is centred at x = {place:.4g} and reaches across {where} by {across:.4g}: {TWO}; centre it there "
        f"('at: [{at:g}, …]'), or keep it on one side" + ("" if c.body is None else _no_symmetry(c.body, "line")),
        tool=c.master.name,
    )


def _place(master: RigidMaster) -> str:
    """The path of what places a tool."""
    return f"tools.{master.name}" + (".at" if master.tool.description.at is not None else "")


def _no_symmetry(body: str, kind: str) -> str:
    """What to write if the sides are no symmetry."""
    return f"; if this is not a {kind} of symmetry, list '{{surface: {body}, against: symmetry}}' under 'no_contact'"


# ---------------------------------------------------------------------------------------------------------------- in space
def overlaps(
    system: System, walls: Sequence[Wall], tools: Sequence[str] | None = None, named: bool = False
) -> Iterator[Overlap]:  # fmt: skip
    """Tools that are not their own images across planes of symmetry, or do not stay so, one finding for each tool.

    ``named``: whether the case says that these are planes of symmetry: then what is surely no symmetric whole is refused, and
    nothing else reported.
    """
    reported: set[str] = set()
    met = meetings(system, walls, tools)
    for m in met:
        came = m.moved is not None and not m.began  # as a tool that passes a wall does
        if m.master.name in reported or (came and not named):
            continue
        normals = [np.asarray(o.wall.plane.normal) for o in met if o.master is m.master and o.reaches]
        found = _moves(m, named) if m.across is not None else _stands(system, m, named, normals)
        if found is not None and (not named or found.severity is Severity.REFUSE):
            reported.add(m.master.name)
            yield found


def _moves(m: Meeting, named: bool) -> Overlap:
    """What to say of a tool that a step moves across a plane, or leaves free to go."""
    moves = m.across == m.moved
    how = "moves or turns across it" if moves else "is free to move or turn across it"
    image = "moves the other way" if moves else "would move the other way"
    kind = "line" if m.master.dimension == 2 else "plane"
    hold = f"move it along the {kind}" if moves else f"hold it across the {kind}"
    return Overlap(
        f"steps.{m.across}",
        f"tool {m.master.name!r} reaches across {_plane(m)}, and {how}, while its mirror image {image}: there would be two tools "
        f"that overlap; {hold}, or {_otherwise(m, named)}",
        Severity.REFUSE if named else Severity.WARN,
        tool=m.master.name,
    )


def _stands(system: System, m: Meeting, named: bool, normals: Sequence[Array]) -> Overlap | None:
    """What to say of a tool that is not its own image where it stands; None of one that is.

    ``normals`` (d,): of all planes that it reaches.
    """
    name, n = m.master.name, np.asarray(m.wall.plane.normal)
    if m.since is None and _loose(system.problem, name, n):
        return None  # on its way
    middle = _across_plane(system, m) if m.crosses and m.since is None and not endless(m) else None
    if middle is not None and not middle.apart:
        return None
    if middle is None and m.unlike is None:
        return None
    sure = m.reaches and (m.unlike is None or m.unlike.adds or not m.master.tool.description.goes_on(m.master.shape))
    severity = Severity.REFUSE if named and sure else Severity.WARN
    if middle is not None:
        across, axis = middle.half - abs(middle.off), int(np.argmax(np.abs(n)))
        place = float(n[axis]) * (m.wall.plane.place + middle.off) + 0.0
        centre = f"at {'xyz'[axis]} = {place:.4g}" if abs(n[axis]) == 1.0 else f"{abs(middle.off):.4g} beside it"
        rest = _no_symmetry(m.wall.body, "plane") if m.wall.body else f", or {_otherwise(m, named)}"
        return Overlap(
            _place(m.master),
            f"it reaches across {_plane(m)}, by {across:.4g} and is centred {centre}: {TWO}; centre it there, or keep it on one "
            f"side{rest}",
            severity,
            tool=name,
        )
    assert m.unlike is not None
    remedy = m.master.tool.description.into_image(m.master.shape, normals, OFF_LINE)
    return Overlap(
        f"tools.{name}" if m.since is None else f"steps.{m.since}",
        f"{'it' if m.since is None else f'tool {name!r}'} reaches across {_plane(m)}, and is not its own mirror image there (off "
        f"by {m.unlike.off:.3g} near the bodies): {TWO}; {f'{remedy}, or ' if remedy else ''}{_otherwise(m, named)}",
        severity,
        tool=name,
    )


def _plane(m: Meeting) -> str:
    """A plane in words."""
    plane, kind = m.wall.plane, "line" if m.master.dimension == 2 else "plane"
    return f"the {kind} of symmetry {f'of {m.wall.body!r}' if m.wall.body else repr(plane.name)}, {plane}"


def _otherwise(m: Meeting, named: bool) -> str:
    """What to do where a tool is to be as it is."""
    if not named:
        return f"model the whole{_no_symmetry(m.wall.body or '', 'plane')}"
    return f"model the whole, without {m.wall.plane.name!r} in 'mirror'"


# ------------------------------------------------------------------------------------------------------ places of the middle
def _crossings(system: System, walls: set[str]) -> Iterator[Crossing]:
    """The tools in the plane that reach across lines of symmetry of the bodies that they touch."""
    p = system.problem
    for s in system.tool_contacts:
        master = system.tool_masters[s.against]
        # Neither a half-plane nor what encloses the body ends beside the plane, so that it would overlap with its image.
        if master.name not in p.tools or s.body in walls or master.shape.half_space or master.shape.cavity:
            continue
        at = master.at + master.place(system.initial().u)[: len(master.at)]
        if system.axisymmetric:
            lines: list[tuple[Plane, str | None]] = [(axis_plane(0, 0.0, 2), None)]
        else:
            lines = [(line, s.body) for line in symmetry_planes(system, s.body)]
        for line, body in lines:
            middle = _beside_line(system, master, line, at)
            if middle is not None:
                yield Crossing(master, line, body, middle)


def _beside_line(system: System, master: RigidMaster, line: Plane, at: Array) -> Middle | None:
    """The middle of a tool at a place (2,) in the plane, beside a line across x; None if it has none."""
    own = master.tool.description
    if line.axis != 0 or not own.mirrored(True, master.tool.direction):
        return None
    half = max(float(np.abs(polygon[:, 0]).max()) for polygon in own.outline(NO_DIFFERENCE * system.length))
    return Middle(float(line.distance(at)), half)


def _across_plane(system: System, m: Meeting) -> Middle | None:
    """The middle of a tool that is drawn on both sides of a plane; None if it is its own image about none."""
    master, n = m.master, np.asarray(m.wall.plane.normal)
    own, shape = master.tool.description, master.shape
    points, pairs = surface_of(master, system)
    at = master.at + master.place(system.initial().u)[: master.dimension]
    d = m.wall.plane.distance(points + at)
    some, half = points[:: 1 + len(points) // len(system.X)], 0.5 * float(np.ptp(d))
    plane = m.wall.plane._replace(place=-float(m.wall.plane.distance(at)))  # in the frame of the tool
    middle = _middle(master, some, plane._replace(place=plane.place + 0.5 * float(d.min() + d.max())), half)
    if middle is None:
        return None
    plate = False
    if not getattr(own, "section", own).mirrored(True, np.array([0.0, -1.0])):  # that are drawn about their middles
        beyond = some[plane.distance(some) < 0.0]
        out = shape.closest(plane.image(beyond)).g - shape.closest(beyond).g
        plate = _straight(master, points, pairs, d, n) and bool((out <= OFF_LINE * half).all())
    return Middle(middle - plane.place, half, plate)


def _middle(master: RigidMaster, x: Array, guess: Plane, half: float) -> float | None:
    """Place of the plane along the guess about which a tool with surface points x (k, 3) is its own image; None without.

    By Gauss-Newton steps on the distances of the images; ``half``: breadth.
    """
    g, n, middle, place, least = master.shape.closest(x).g, np.asarray(guess.normal), guess.place, guess.place, np.inf
    while True:
        found = master.shape.closest(guess._replace(place=place).image(x))
        slope, missing = 2.0 * (found.n @ n), found.g - g
        if not (left := float(np.abs(missing).max())) < least:
            break
        middle, least = place, left
        if np.abs(slope).max() <= NEGLIGIBLE:
            break
        place -= float(slope @ missing / (slope @ slope))
    return middle if least <= OFF_LINE * half else None


def _straight(master: RigidMaster, points: Array, ends: Index, d: Array, n: Array) -> bool:
    """Whether a surface goes across a plane at right angles wherever it does; d (k,): distances of points, ``ends`` (e, 2)."""
    ends = ends[d[ends[:, 0]] * d[ends[:, 1]] < 0.0]
    a, b = ends.T
    through = points[a] + (d[a] / (d[a] - d[b]))[:, None] * (points[b] - points[a])
    return len(through) > 0 and bool(np.abs(master.shape.closest(through).n @ n).max() <= OFF_LINE)


def _loose(p: model.Problem, name: str, normal: Array) -> bool:
    """Whether any step moves a tool across a plane with a normal (d,) or turns it, or leaves it free to."""
    axes = [axis for axis, n in zip("xyz", normal) if abs(n) > NEGLIGIBLE]
    turns = (
        ["rz", "m"]
        if len(normal) == 2
        else [f"{k}{axis}" for k in "rm" for axis, n in zip("xyz", normal) if abs(n) < 1.0]
    )
    motions = [
        m for step in p.steps for k in ("move", "by", "velocity") for n, m in getattr(step, k).items() if n == name
    ]
    pushes = [push for step in p.steps for n, push in step.push.items() if n == name]
    springs = [p.tools[name].spring] if p.tools[name].spring is not None else []
    loose = any(getattr(m, key, None) is not None for m in (*motions, *pushes, *springs) for key in (*axes, *turns))
    cranks = [step.crank[name] for step in p.steps if name in step.crank]
    return loose or any(getattr(crank, axis, None) is not None for crank in cranks for axis in axes)
