"""Tools that overlap their own mirror images: across a plane of symmetry, or the axis, off it or moved across it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE, SLIGHT
from prensa.contact.masters import RigidMaster
from prensa.errors import Finding
from prensa.geometry.reflections import Plane, axis_plane
from prensa.model import problem as model
from prensa.model.names import SYMMETRY
from prensa.precision import NEGLIGIBLE
from prensa.system.held import symmetry_planes
from prensa.system.moments import Moment, moments
from prensa.system.system import System
from prensa.types import Array, Index

OFF_LINE = 1e-3
"""Distance of a tool from the plane that it crosses, over its half breadth, that is a rounded coordinate."""


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
    """A tool that reaches across a ``plane`` of symmetry of a ``body``, None where it is the axis of revolution."""

    master: RigidMaster
    plane: Plane
    body: str | None
    middle: Middle | None


def off_centre(system: System) -> Iterator[Finding]:
    """Tools, their own mirror images, that lie across a plane of symmetry or the axis but are not centred on it.

    Those that are moved or pushed across it are on their way; in space what crosses a plane as it moves is reported.
    """
    reported: set[str] = set()
    crossings = list(_crossings(system))
    moved = list(_moved_across(system)) if crossings and system.dofs.dimension == 3 else []
    for c in crossings:
        if c.master.name in reported:
            continue
        step = next((step for tool, plane, step in moved if tool == c.master.name and plane == c.plane), None)
        found = None
        if step is not None:
            found = _moves(c, step)
        elif c.middle is not None and c.middle.apart and not _loose(system.problem, c):
            found = _apart(c, c.middle)
        if found is not None:
            reported.add(c.master.name)
            yield found


def _apart(c: Crossing, middle: Middle) -> Finding:
    """What to say of a tool whose middle is beside the plane."""
    name, across, place = c.master.name, middle.half - abs(middle.off), c.plane.place + middle.off
    path = f"tools.{name}.at" if c.master.tool.description.at is not None else f"tools.{name}"
    overlap = "with its mirror image there would be two tools that overlap"
    if len(c.master.at) == 2:
        at = c.plane.place
        where = "the axis" if c.body is None else f"the line of symmetry of {c.body!r}, x = {at:g},"
        return Finding(
            path,
            f"it is centred at x = {place:.4g} and reaches across {where} by {across:.4g}: {overlap}; centre it there "
            f"('at: [{at:g}, …]'), or keep it on one side" + ("" if c.body is None else _no_symmetry(c)),
        )
    centre = f"{abs(middle.off):.4g} beside it" if c.plane.axis is None else f"at {'xyz'[c.plane.axis]} = {place:.4g}"
    return Finding(
        path,
        f"it reaches across the plane of symmetry of {c.body!r}, {c.plane}, by {across:.4g} and is centred {centre}: {overlap}"
        f"; centre it there, or keep it on one side{_no_symmetry(c)}",
    )


def _moves(c: Crossing, step: int) -> Finding:
    """What to say of a tool in space that a step moves across the plane."""
    return Finding(
        f"steps.{step}",
        f"tool {c.master.name!r} reaches across the plane of symmetry of {c.body!r}, {c.plane}, and moves or turns across it, "
        "while its mirror image moves the other way: there would be two tools that overlap; move it along the plane, or model "
        f"the whole{_no_symmetry(c)}",
    )


def _no_symmetry(c: Crossing) -> str:
    """What to write if the sides are no symmetry."""
    kind = "line" if len(c.master.at) == 2 else "plane"
    return f"; if this is not a {kind} of symmetry, list '{{surface: {c.body}, against: symmetry}}' under 'no_contact'"


def _crossings(system: System) -> Iterator[Crossing]:
    """The tools that reach across planes of symmetry of the bodies that they touch."""
    p = system.problem
    # A side held along its normal may be a wall as well as a plane of symmetry: 'no_contact' against symmetry says which.
    not_planes = {s.partition(".")[0] for n in p.no_contact if n.against == SYMMETRY for s in n.surface}
    for s in system.tool_contacts:
        master = system.tool_masters[s.against]
        # Neither a half-plane nor what encloses the body ends beside the plane, so that it would overlap with its image.
        if master.name not in p.tools or s.body in not_planes or master.shape.half_space or master.shape.cavity:
            continue
        at = master.at + master.place(system.initial().u)[: len(master.at)]
        if system.axisymmetric:
            planes: list[tuple[Plane, str | None]] = [(axis_plane(0, 0.0, 2), None)]
        else:
            planes = [(plane, s.body) for plane in symmetry_planes(system, s.body)]
        for plane, body in planes:
            if system.dofs.dimension == 2:
                middle = _beside_line(system, master, plane, at)
                if middle is not None:
                    yield Crossing(master, plane, body, middle)
            else:
                yield from _across_plane(system, master, plane, at, s.body)


def _beside_line(system: System, master: RigidMaster, line: Plane, at: Array) -> Middle | None:
    """The middle of a tool at a place (2,) in the plane, beside a line across x; None if it has none."""
    own = master.tool.description
    if line.axis != 0 or not own.mirrored(True, master.tool.direction):
        return None
    half = max(float(np.abs(polygon[:, 0]).max()) for polygon in own.outline(NO_DIFFERENCE * system.length))
    return Middle(float(line.distance(at)), half)


def _across_plane(system: System, master: RigidMaster, plane: Plane, at: Array, body: str) -> Iterator[Crossing]:
    """A tool with its reference point at a place (3,) in space, if it reaches across a plane."""
    own, shape, n = master.tool.description, master.shape, np.array(plane.normal)
    points, triangles = own.facets(master.tool.direction, system.length)
    d = plane.distance(points + at)
    if d.min() >= -NEGLIGIBLE * system.length or d.max() <= NEGLIGIBLE * system.length:
        return
    some, half = points[:: 1 + len(points) // len(system.X)], 0.5 * float(np.ptp(d))
    place = -float(plane.distance(at))  # of the plane along its normal, in the frame of the tool
    middle = _middle(master, some, n, place + 0.5 * float(d.min() + d.max()), half)
    if middle is None:
        yield Crossing(master, plane, body, None)
        return
    plate = False
    if not getattr(own, "section", own).mirrored(True, np.array([0.0, -1.0])):  # that are drawn about their middles
        side = np.sign(plane.distance(system.X[system.span(body)]).sum())
        beyond = some[side * (some @ n - place) < 0.0]
        out = shape.closest(_image(beyond, n, place)).g - shape.closest(beyond).g
        plate = _straight(master, points, triangles, d, n) and bool((out <= OFF_LINE * half).all())
    yield Crossing(master, plane, body, Middle(middle - place, half, plate))


def _image(x: Array, n: Array, place: float) -> Array:
    """Mirror images (k, 3) of places (k, 3) across the plane with a normal (3,) at a place along it."""
    return np.asarray(x - 2.0 * (x @ n - place)[:, None] * n)


def _middle(master: RigidMaster, x: Array, n: Array, guess: float, half: float) -> float | None:
    """Place along a normal (3,) of the plane about which a tool with surface points x (k, 3) is its own image; None without.

    From a guess by Gauss-Newton steps on the distances of the images; ``half``: breadth.
    """
    g, middle, place, least = master.shape.closest(x).g, guess, guess, np.inf
    while True:
        found = master.shape.closest(_image(x, n, place))
        slope, missing = 2.0 * (found.n @ n), found.g - g
        if not (left := float(np.abs(missing).max())) < least:
            break
        middle, least = place, left
        if np.abs(slope).max() <= NEGLIGIBLE:
            break
        place -= float(slope @ missing / (slope @ slope))
    return middle if least <= OFF_LINE * half else None


def _straight(master: RigidMaster, points: Array, triangles: Index, d: Array, n: Array) -> bool:
    """Whether a surface goes across a plane at right angles wherever it does; d (k,): distances of its points from it."""
    ends = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    ends = ends[d[ends[:, 0]] * d[ends[:, 1]] < 0.0]
    a, b = ends.T
    through = points[a] + (d[a] / (d[a] - d[b]))[:, None] * (points[b] - points[a])
    return len(through) > 0 and bool(np.abs(master.shape.closest(through).n @ n).max() <= OFF_LINE)


def _moved_across(system: System) -> Iterator[tuple[str, Plane, int]]:
    """Tools in space, planes of symmetry, and steps that move tools across them, or turn them about other axes than the normal.

    Only where a tool touches the body at rest meanwhile: those that are lifted off it may go anywhere.
    """
    planes = [q for body in system.meshes for q in symmetry_planes(system, body)]
    before: Moment | None = None
    for now in moments(system) if planes else ():
        for t, tool in enumerate(system.tools if before is not None and before.plan is now.plan else ()):
            assert before is not None
            dofs = system.dofs.tool.dofs(t)
            across = [plane for plane in planes if _goes_across(now.u[dofs] - before.u[dofs], np.array(plane.normal))]
            if across and (not now.known[t] or any(_touches(system, tool.name, u) for u in (before.u, now.u))):
                yield from ((tool.name, plane, now.plan.number) for plane in across)
        before = now


def _goes_across(way: Array, n: Array) -> bool:
    """Whether a motion (6,) of a tool, its turns last, has a part along a normal (3,), or turns about another axis."""
    turns = way[3:] - (way[3:] @ n) * n
    return bool(
        abs(way[:3] @ n) > NO_DIFFERENCE * np.linalg.norm(way[:3])
        or np.abs(turns).max() > NO_DIFFERENCE * np.abs(way).max()
    )


def _touches(system: System, tool: str, u: Array) -> bool:
    """Whether a tool comes up to the surfaces in contact with it, for degrees of freedom u (ndof,)."""
    return any((system.nodes_seen(s, u).g <= SLIGHT * s.points.depth).any() for s in system.against(tool))


def _loose(p: model.Problem, c: Crossing) -> bool:
    """Whether any step moves a tool across the plane or turns it, or leaves it free to."""
    name, normal = c.master.name, c.plane.normal
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
