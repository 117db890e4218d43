"""What can be solved and was likely not meant, found on the bodies at rest: sizes of new meshes that cannot be had, springs as
stiff as no machine, turns in degrees, round tools off the line of symmetry that they cross, thick sheets.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.errors import Finding, Severity
from prensa.model import problem as model
from prensa.model.names import SYMMETRY
from prensa.model.remeshing import remeshing_of
from prensa.system.contact_surfaces import symmetry_lines
from prensa.system.element_sizes import section_area, size_field
from prensa.system.planning import plan_step
from prensa.system.system import System

STIFFEST_MOUNT = 1e6  # stiffness of a spring over E times the thickness, beyond which its tool is as good as held …
MOUNT_LOST = 1e8  # … and beyond which round-off of its length is more than tolerances of forces
ROUND_TURN = 2.0  # radians from which a multiple of a half is asked about
PAST_BODIES = 3.0  # way of a round tool's surface by a turn, over the size of the bodies, from which it is
THICK_SHEET = 2.0  # thickness of a sheet in plane stress over the largest extent in the plane
OFF_LINE = 1e-3  # of its half breadth, by which a tool may lie off the line that it crosses


def plausibility_warnings(system: System) -> Iterator[Finding]:
    """Warnings of what was likely meant otherwise."""
    yield from _new_sizes(system)
    yield from _mounts(system)
    yield from _turns(system)
    yield from _off_centre(system)
    yield from _thick_sheets(system)


# ------------------------------------------------------------------------------------------------------------ new meshes
def _new_sizes(system: System) -> Iterator[Finding]:
    """Sizes of new meshes beside the body, its tools and what is moved."""
    asked = remeshing_of(system.problem)
    if asked is None:
        return
    for body in (b.body for b in system.blocks if b.law.plastic):
        sizes = size_field(system, system.initial(), body, asked.size, section_area(system, body))
        width = sizes.area**0.5
        if asked.size.far is not None and asked.size.far > width:
            yield Finding(
                "remesh.size.far",
                f"elements of {asked.size.far:g} in body {body!r}, whose section is about {width:.3g} wide: it is the size of an "
                f"element; write {width / 12:.2g}, or leave it out",
            )
            continue
        for name in dict.fromkeys(s.against for s in system.surfaces if s.body == body):
            given = getattr(system.problem.tools[name], "fillet", None)
            radii = [r for r in (given if isinstance(given, tuple) else (given,)) if r]
            arc = 0.5 * np.pi * min(radii, default=np.inf)
            if arc < sizes.least:
                yield Finding(
                    f"tools.{name}.fillet",
                    f"a quarter of a circle of radius {min(radii):g} is {arc:.2g} long, and new meshes have no element "
                    f"below {sizes.least:.2g}: the tool is as sharp as these are long; give it {sizes.least:.2g} or more, "
                    f"or 'remesh.size.least: {arc / asked.size.per_radius:.1g}'",
                )
    travel = asked.when.travel
    if isinstance(travel, float):
        way = _longest_way(system)
        if way > travel * asked.at_most > 0.0:
            yield Finding(
                "remesh.when.travel",
                f"a new mesh after each {travel:g} of a way of {way:.4g} is {way / travel:.3g} meshes, and no more than "
                f"{asked.at_most} are made ('at_most'); is the unit right? Without it meshes are made where they are worth it",
            )


def _longest_way(system: System) -> float:
    """The longest of the ways that the steps prescribe to the tools, from the beginning of each step straight to its end."""
    at_start, gone = system.initial().u, np.zeros(len(system.tools))
    for number in range(len(system.problem.steps)):
        plan = plan_step(system, number, at_start)
        end = at_start.copy()
        end[plan.fixed] = plan.values(plan.t1)
        for t in range(len(gone)):
            gone[t] += np.hypot(*(system.place_of(t, end) - system.place_of(t, at_start))[:2])
        at_start = end
    return float(gone.max(initial=0.0))


# ---------------------------------------------------------------------------------------------------------------- mounts
def _mounts(system: System) -> Iterator[Finding]:
    """Springs so stiff that round-off of their lengths is a force."""
    p = system.problem
    stiffness = system.stiffness / system.length
    for name, tool in p.tools.items():
        for axis, unit in (("x", stiffness), ("y", stiffness), ("rz", stiffness * system.length**2)):
            k = getattr(tool.spring, axis, None)
            if k is not None and k > STIFFEST_MOUNT * unit:
                yield Finding(
                    f"tools.{name}.spring.{axis}",
                    f"a stiffness of {k:.3g} is {k / unit:.1g} times that of the bodies, and the tool as good as held: is the "
                    "unit right? A tool that does not give way needs no spring",
                    Severity.REFUSE if k > MOUNT_LOST * unit else Severity.WARN,
                )


# ----------------------------------------------------------------------------------------------------------------- turns
def _turns(system: System) -> Iterator[Finding]:
    """Turns by a round number of radians that are likely degrees."""
    size = system.length
    for i, step in enumerate(system.problem.steps):
        for kind in ("move", "by", "control"):
            for name, motion in getattr(step, kind).items():
                turn = motion.rz
                if isinstance(turn, tuple):
                    turn = max((v for _, v in turn), key=abs)
                if turn is None or abs(turn) < ROUND_TURN or turn % 0.5 != 0.0 or (abs(turn) >= 10 and turn % 5 == 0):
                    continue  # of those last another notice tells
                tool = next(t for t in system.tools if t.name == name)
                way = abs(turn) * tool.shape.period / (2 * np.pi)
                if way > PAST_BODIES * size:
                    past = (
                        ""
                        if not np.isfinite(way)
                        else f" and a way of its surface of {way:.4g} past bodies of {size:.4g}"
                    )
                    yield Finding(
                        f"steps.{i}.{kind}.{name}.rz",
                        f"a turn of {turn:g} radians, {np.degrees(turn):.0f} degrees{past}; for degrees write '{turn:g} deg'",
                    )


# -------------------------------------------------------------------------------------------------------------- symmetry
def _off_centre(system: System) -> Iterator[Finding]:
    """Tools, their own mirror images, that lie across a line of symmetry or the axis but are not centred on it.

    Those that are moved or pushed across it are on their way.
    """
    p = system.problem
    not_lines = {s.partition(".")[0] for n in p.no_contact if n.against == SYMMETRY for s in n.surface}
    reported: set[str] = set()
    for s in system.surfaces:
        tool = system.master(s).tool
        own = p.tools.get(tool.name)
        if own is None or tool.name in reported or s.body in not_lines or _across(p, tool.name):
            continue
        if tool.shape.half_space or tool.shape.cavity or not own.mirrored(True, tool.direction):
            continue
        half = max(float(np.abs(polygon[:, 0]).max()) for polygon in own.outline(1e-9))
        lines = {at for axis, at in symmetry_lines(p, s.body, system.meshes[s.body]) if axis == 0}
        for at in sorted({0.0} if system.axisymmetric else lines):
            x = float(tool.at[0] + system.master(s).place(system.initial().u)[0])
            if OFF_LINE * half < abs(x - at) < (1.0 - OFF_LINE) * half:
                reported.add(tool.name)
                where = "the axis" if system.axisymmetric else f"the line of symmetry of {s.body!r}, x = {at:g},"
                yield Finding(
                    f"tools.{tool.name}.at" if own.at is not None else f"tools.{tool.name}",
                    f"it is centred at x = {x:.4g} and reaches across {where} by {half - abs(x - at):.4g}: with its mirror image "
                    f"it would be two that overlap; centre it there ('at: [{at:g}, …]'), or keep it on one side"
                    + ("" if system.axisymmetric else f"; if that is no symmetry, '{{surface: {s.body}, against: symmetry}}' in "
                    "'no_contact' says so"),
                )  # fmt: skip


def _across(p: model.Problem, name: str) -> bool:
    """Whether any step moves a tool along x or turns it, or leaves it free to."""
    motions = [
        m for step in p.steps for k in ("move", "by", "velocity") for n, m in getattr(step, k).items() if n == name
    ]
    pushes = [push for step in p.steps for n, push in step.push.items() if n == name]
    springs = [p.tools[name].spring] if p.tools[name].spring is not None else []
    loose = any(getattr(m, key, None) is not None for m in (*motions, *pushes, *springs) for key in ("x", "rz", "m"))
    return loose or any(step.crank[name].x is not None for step in p.steps if name in step.crank)


# ---------------------------------------------------------------------------------------------------------- plane stress
def _thick_sheets(system: System) -> Iterator[Finding]:
    """Plane stress, of sheets, with a thickness that none of the bodies has in the plane; of 1 forces are per thickness."""
    p = system.problem
    largest = max(float(mesh.extent.max()) for mesh in system.meshes.values())
    if p.space == "plane stress" and p.thickness != 1.0 and p.thickness > THICK_SHEET * largest:
        yield Finding(
            "thickness",
            f"{p.thickness:.4g} {p.units.length} out of the plane, of bodies that measure {largest:.4g} {p.units.length} at most "
            "in it: plane stress is for thin sheets; is the unit right? Long bodies are in 'space: plane strain'",
        )
