"""Before the solve: what cannot work and what was likely not meant, found on the bodies at rest.

Tools are moved through all steps past the undeformed bodies; supports and contacts are counted against rigid-body modes.
Every notice names the place in the description, the amount and what to write instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from prensa.checks.before.feeding import feeding
from prensa.checks.before.motions import motions
from prensa.checks.before.overlap import neighbours, overlaps
from prensa.checks.before.passages_ahead import few_passages
from prensa.checks.before.plausibility import plausibility_warnings
from prensa.checks.during.penetration import Watch, engulfed, inside, watches
from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity
from prensa.linear.rigid_modes import CLOSED, modes
from prensa.materials.flow_curve import stress_at
from prensa.mesh.quality import quality
from prensa.mesh.triangulate import NO_MESHER, has_mesher
from prensa.model import problem as model
from prensa.model.feed import ends_early
from prensa.model.meshes import MOST_ELEMENTS
from prensa.model.problem import tools_removed
from prensa.model.remeshing import remeshing_of
from prensa.model.tables import DRIVEN, tables_of
from prensa.model.units import factor
from prensa.system.element_sizes import elements_asked, least_size, section_area
from prensa.system.planning import plan_step
from prensa.system.schedule import StepPlan, tabulated
from prensa.system.system import System
from prensa.types import Array, Flags

SAMPLES = 17  # moments a step at which the tools are looked at
SUNK = 0.45  # depth over element depth from which no increment, however short, pushes a tool out of a plastic body
AWAY = (
    np.arange(1, 257) / 64
)  # ways along the axis, over the size of a surface, at which a tool is tried to come out of it
BISECTIONS = 40  # of the way by which it just does
SOFTLY = 0.1  # depth over element depth by which a tool sinks into a soft contact that is worth a word
BEHIND = 0.1  # depth over element depth in a tool of a node that is nearer to its far side
REACH = 0.01  # depth over element depth by which a tool may press a held node
ALONG = 0.9  # cosine from which a support acts along a tool's normal
KINKED = (
    0.766  # cosine of the angle, 40°, by which an undeformed surface may bend at a node and still have a normal there
)
IN_SECONDS = 2.0  # times the length of the run, from which on the time of a table that is not gone to its end is told
CRUSHED = 50.0  # mean pressure of a push over what the metal bears at a strain of 1, beyond any that a die holds in
SHEET = 5.0  # length of a sheet in the plane over its thickness, from which both are not those of a square bar
THIN = 0.02  # thickness out of the plane, over the least extent in it, below which plane strain is unlikely to be meant
TIP = 0.1  # distance from the end of a tool, over an element, at which its width is taken
POINT_INSIDE = "the point lies inside the body, where new meshes ('remesh') keep no node; hold a side or a corner"
STRAINS = np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 200)])  # at which flow curves are looked at


def preflight(system: System) -> list[Finding]:
    """All notices on a discretised problem, the fatal ones first."""
    if system.dofs.dimension != 2:
        return [*_without_effect(system)]
    watched = watches(system)
    beginning = [*_sizes(system), *_bends(system), *_beginning(system), *_overlaps(system)]
    if not any(n.fatal for n in beginning):
        beginning += _inside(system, watched)
    found = [
        *_without_effect(system), *_remeshing(system), *_flow_curves(system), *_tables(system), *_lengths(system),
        *_pushes(system), *_shapes(system),
        *motions(system), *feeding(system), *plausibility_warnings(system), *beginning,
        *([] if any(n.fatal for n in beginning) else _passage(system, watched)), *modes(system),
    ]  # fmt: skip
    return sorted(found, key=lambda n: not n.fatal)


def _without_effect(system: System) -> Iterator[Finding]:
    """Old keys of enforcements that are read and do nothing."""
    for k, contact in enumerate(system.problem.contacts):
        for key in contact.enforcement.without_effect():
            yield Finding(f"contacts.{k}.enforcement.{key}", "has no effect any more; leave it out")


def _remeshing(system: System) -> Iterator[Finding]:
    """The mesher that is asked for and not installed, sizes that ask for more elements than there can be, and a first mesh with
    points inside that no new mesh keeps.
    """
    asked = remeshing_of(system.problem)
    if asked is None:
        return
    if not has_mesher():
        yield Finding("remesh", NO_MESHER, Severity.REFUSE)
    for body, mesh in system.meshes.items():
        count, key = elements_asked(system, body)
        if system.problem.bodies[body].material.plastic and count > MOST_ELEMENTS:
            width, most = section_area(system, body) ** 0.5, f"{MOST_ELEMENTS:,}".replace(",", " ")
            yield Finding(
                f"remesh.size.{key}" if getattr(asked.size, key) is not None else "remesh.size",
                f"it asks for {min(count, 1e300):.1e} elements of body {body!r}, whose section is about {width:.3g} wide; a body "
                f"has {most} at most: write {0.02 * width:.2g}, say, or leave it out",
                Severity.REFUSE,
            )
        outline = mesh.boundary
        for name, node in mesh.corners.items():
            if node in outline:
                continue
            for prefix, source in _with_supports(system.problem):
                if f"{body}.{name}" in source.fixed:
                    yield Finding(f"{prefix}fixed.{body}.{name}", POINT_INSIDE, Severity.REFUSE)


def _with_supports(problem: model.Problem) -> list[tuple[str, model.Problem | model.Step]]:
    """The problem and its steps, with the path to what they hold."""
    return [("", problem), *((f"steps.{k}.", step) for k, step in enumerate(problem.steps))]


def staircase(system: System) -> list[Finding]:
    """Findings on contacts whose forces will step as elements pass; a run says it of those in which it is seen.

    Of a first mesh that others will take the place of nothing follows.
    """
    if remeshing_of(system.problem) is not None:
        return []
    return list(few_passages(system, ((m.plan, m.u) for m in _moments(system))))


# ------------------------------------------------------------------------------------------------ materials and tables
def _flow_curves(system: System) -> Iterator[Finding]:
    for name, body in system.problem.bodies.items():
        flow = getattr(body.material, "flow", None)
        if flow is None:
            continue
        path = f"bodies.{name}.material.flow"
        stress = stress_at(flow, STRAINS, np.zeros_like(STRAINS))
        k = int(np.argmin(stress))
        fall = np.diff(stress) < -1e-9 * stress[0]
        if not stress[k] > 0:
            yield Finding(
                path,
                f"the flow stress is {stress[k]:.4g} at a plastic strain of {STRAINS[k]:.3g}; it must stay positive",
                Severity.REFUSE,
            )
        elif fall.any():
            a = int(np.argmax(fall))
            yield Finding(
                path,
                f"the flow stress falls from {stress[a]:.5g} at a plastic strain of {STRAINS[a]:.3g}: the strain will gather in "
                "one row of elements and the answer depend on the mesh; let it rise or stay",
            )
        rise = (np.interp(0.01, STRAINS, stress) - stress[0]) / 0.01
        if rise > body.material.modulus:
            yield Finding(
                path,
                f"the flow stress rises by {rise:.3g} per unit of plastic strain at first, faster than E = "
                f"{body.material.modulus:.3g}; check the units of both",
            )


def _tables(system: System) -> Iterator[Finding]:
    """Tables in global time that do not cover the step in which they stand: they are held, not extrapolated."""
    p = system.problem
    sources: list[tuple[str, Any, float, float, str]] = [("", p, 0.0, float(len(p.steps)), "the steps")]
    sources += [(f"steps.{i}.", s, float(i), float(i + 1), f"step {s.name!r}") for i, s in enumerate(p.steps)]
    for prefix, owner, t0, t1, what in sources:
        for place, table in tables_of(owner):
            path = prefix + ".".join(map(str, place))
            first, last = table[0][0], table[-1][0]
            ends, end = float(len(p.steps)), table[-1][1]
            reached = tabulated(table)(ends)
            if first <= t0 + 1e-9 and last >= IN_SECONDS * ends and abs(reached - end) > 1e-3 * abs(end):
                yield Finding(
                    path,
                    f"the table goes on to time {last:g}, and the run ends at {ends:g}, at {reached:.4g} of {end:g}: times count "
                    "steps, each of them 1 long whatever its 'duration', not seconds",
                )
            there = tabulated(table)(t1)
            cut = owner is not p and last > t1 + 1e-9 and abs(there - end) > 1e-3 * abs(end)
            if cut and _left_off(p, int(t0), str(place[0]), str(place[1])):
                yield Finding(
                    path,
                    f"the table goes on to time {last:g}, and {what} ends at {t1:g}, at {there:.4g} of {end:g}: what a step does "
                    f"not mention is held, so that step {p.steps[int(t1)].name!r} has to have the table too",
                )
            if first <= t0 + 1e-9 and last >= t1 - 1e-9:
                continue
            held = (
                f"held at {table[-1][1]:g} after that"
                if first <= t0 + 1e-9
                else f"held at {table[0][1]:g} until it begins"
            )
            if last <= t0:
                held = f"so it stays at {table[-1][1]:g}"
            yield Finding(
                path,
                f"the table covers the times {first:g} … {last:g}, {what} {t0:g} … {t1:g}: {held}; times are counted over all "
                "steps",
            )


def _left_off(p: model.Problem, number: int, kind: str, name: str) -> bool:
    """Whether the step after a step has nothing to say of the tool or side that a table in it drives."""
    if kind not in ("move", "by", "velocity", "push") or number + 1 >= len(p.steps) or tools_removed(p, number + 1):
        return False
    return not any(name in getattr(p.steps[number + 1], other) for other in (*DRIVEN, "fixed"))


# ---------------------------------------------------------------------------------------------------- size and stiffness
def _lengths(system: System) -> Iterator[Finding]:
    """Lengths that belong to another unit than the rest, or angles to degrees."""
    unit = system.problem.units.length
    for name, mesh in system.meshes.items():
        size = float(mesh.extent.max())
        low, high = {"mm": (0.05, 5e4), "m": (5e-5, 50.0)}.get(unit, (0.0, np.inf))
        if not low <= size <= high:
            yield Finding(f"bodies.{name}.mesh", f"the body is {size:.4g} {unit} large; is that the unit meant?")
    yield from _thickness(system)
    size = system.length
    for name, tool in system.problem.tools.items():
        for key in ("radius", "width", "outer", "fillet"):
            given = getattr(tool, key, None)
            values = given if isinstance(given, tuple) else (given,)  # a fillet of each corner
            value = next((v for v in values if v and not size / 500 <= v <= 500 * size), None)
            if value is not None:
                yield Finding(
                    f"tools.{name}.{key}",
                    f"{value:.4g} {unit} against bodies of {size:.4g} {unit}; are both in the same unit?",
                )
    for i, step in enumerate(system.problem.steps):
        for kind in ("move", "by", "velocity", "control") if not ends_early(step) else ():
            for name, motion in getattr(step, kind).items():
                for key in ("x", "y", "rz"):
                    value = getattr(motion, key)
                    most = (
                        max((abs(v) for _, v in value), default=0.0) if isinstance(value, tuple) else abs(value or 0.0)
                    )
                    path = f"steps.{i}.{kind}.{name}.{key}"
                    if key == "rz" and most >= 10 and most % 5 == 0:
                        yield Finding(path, f"a turn of {most:g} radians; for degrees write '{most:g} deg'")
                    elif key != "rz" and most > 20 * size:
                        yield Finding(
                            path, f"a travel of {most:.4g} {unit} past bodies of {size:.4g} {unit}; is the unit right?"
                        )


def _pushes(system: System) -> Iterator[Finding]:
    """Forces under which no body could stand: of another unit than they are meant in."""
    p = system.problem
    for i, step in enumerate(p.steps):
        for name, push in step.push.items():
            for axis, key in enumerate("xy"):
                value = getattr(push, key)
                most = max(abs(v) for _, v in value) if isinstance(value, tuple) else abs(value or 0.0)
                own = [s for s in system.surfaces if s.against == name]
                if not most or not own:
                    continue
                bears = sum(_area(system, s, 1 - axis) * _strength(p.bodies[s.body].material) for s in own)
                if most > CRUSHED * bears > 0:  # along a flat surface nothing is pressed
                    yield Finding(
                        f"steps.{i}.push.{name}.{key}",
                        f"a push of {most:.4g} {p.units.force} is {most / bears:.2g} times what "
                        f"{' and '.join(dict.fromkeys(repr(s.body) for s in own))} bears over the whole contact surface; is the "
                        "unit right?",
                    )


def _area(system: System, s: Surface, across: int) -> float:
    """Area of a contact surface as seen along an axis; ``across``: the other one."""
    low, high = (float(v) for v in (system.X[s.points.nodes, across].min(), system.X[s.points.nodes, across].max()))
    if system.axisymmetric and across == 0:
        return float(np.pi * (high**2 - low**2))
    return (high - low) * system.problem.thickness


def _strength(material: Any) -> float:
    """Flow stress at a plastic strain of 1, of an elastic body its modulus."""
    flow = getattr(material, "flow", None)
    return float(material.modulus if flow is None else stress_at(flow, np.ones(1), np.zeros(1))[0])


def _thickness(system: System) -> Iterator[Finding]:
    """A thickness out of the plane that is that of a sheet in it, or next to nothing, where strain out of the plane is zero.

    A slice of one millimetre, centimetre, metre, inch or foot is the force per length of a long body.
    """
    p, unit = system.problem, system.problem.units.length
    slices = [factor(f"1 {u}", unit, "N", (0, 1)) for u in ("mm", "cm", "m", "in", "ft")] + [1.0]
    if p.space != "plane strain" or any(abs(p.thickness / s - 1.0) < 1e-6 for s in slices):
        return
    extents = {name: mesh.extent for name, mesh in system.meshes.items()}
    for name, extent in extents.items():
        if abs(extent.min() / p.thickness - 1.0) < 1e-6 and extent.max() > SHEET * p.thickness:
            yield Finding(
                "thickness",
                f"{p.thickness:.4g} {unit} is what body {name!r} measures across in the plane: 'thickness' is the length out of "
                "it, the width of a sheet, which plane strain takes for large; give that, or leave it out for forces per length",
            )
            return
    least = min(float(extent.min()) for extent in extents.values())
    if p.thickness < THIN * least:
        yield Finding(
            "thickness",
            f"{p.thickness:.4g} {unit} out of the plane, of bodies that measure {least:.4g} {unit} or more in it: plane strain "
            "is for long bodies; is the unit right? For a thin sheet loaded in its plane use 'space: plane stress'",
        )


def _shapes(system: System) -> Iterator[Finding]:
    for name, mesh in system.meshes.items():
        q = quality(mesh)
        quiet = _far_from_tools(system, name, q.centre[q.needles]) if len(q.needles) else None
        words = q.warnings(float(mesh.extent.min()), quiet)
        yield from (Finding(f"bodies.{name}.mesh", warning) for warning in words)


def _far_from_tools(system: System, body: str, x: Array) -> Array:
    """Least distance (k,) of points x (k, 2) of a body from the tools of its contacts, as far as their courses are known.

    A tool whose course is not known is looked at where it starts; 0 for a body that is brought to them.
    """
    out = np.full(len(x), np.inf)
    against = [s for s in system.surfaces if s.body == body]
    if not against or _driven(system, body):
        return np.zeros(len(x))
    for m in _moments(system):
        for s in against:
            master = system.master(s)
            if m.known[master.number] or m.t == 0.0:
                out = np.minimum(out, master.seen(x, m.u).g)
    return out


def _sizes(system: System) -> Iterator[Finding]:
    for i, s in enumerate(system.surfaces):
        tool = system.master(s).tool
        ends = system.X[s.points.edges]
        h = min(float(np.hypot(*(ends[:, 1] - ends[:, 0]).T).min()), least_size(system, s.body))
        size, key = tool.description.face()
        if tool.description.tip():
            yield from _tip(system, s, h)
        elif size < 2 * h:
            what = "radius" if key == "radius" else "face"
            yield Finding(
                f"tools.{tool.name}.{key}",
                f"the {what} {size:.4g} is less than two elements of {'+'.join(s.description.surface)!r}, the smallest of which "
                f"is {h:.4g} long: the tool finds no node to press on, or one; refine the surface there to {0.25 * size:.2g}",
                Severity.REFUSE if size < 0.5 * h else Severity.WARN,
            )
        yield from _corners(system, s)
        k_n = getattr(s.description.enforcement, "k_n", None)
        beta = s.description.enforcement.beta_of(s.unit)
        if beta > 1e4 or (beta < 1 and _gives_way(system, s, beta)):
            which = f"k_n = {k_n:.3g}, beta = {beta:.2g}" if k_n is not None else f"beta = {beta:.2g}"
            result = "iterations suffer and pressures oscillate" if beta > 1 else "the tool sinks in by whole elements"
            yield Finding(f"contacts.{i}.enforcement", f"{which}: {result}; leave it out (beta = 100)")


def _gives_way(system: System, s: Surface, beta: float) -> bool:
    """Whether a soft contact lets a tool sink in by a share of an element that is worth a word.

    Nothing bounds the pressure on an elastic body; a metal flows under three times its yield stress (Tabor).
    """
    flow = getattr(system.problem.bodies[s.body].material, "flow", None)
    if flow is None:
        return True
    stress = float(stress_at(flow, np.zeros(1), np.zeros(1))[0])
    return 3.0 * stress / (beta * s.modulus) > SOFTLY


def _corners(system: System, s: Surface) -> Iterator[Finding]:
    """Sharp corners between the points of a surface whose edges are not cut at them."""
    tool, start = system.master(s).tool, system.initial()
    cuts = [] if s.sharp or not len(tool.shape.edges) else system.cuts(s, start.u, system.master(s).place(start.u))
    if not cuts:
        return
    ends = system.X[s.points.edges[cuts[0].edge]]
    share = cuts[0].covered if cuts[0].end == 0 else 1.0 - cuts[0].covered
    x, y = ends[0] + share * (ends[1] - ends[0])
    rule = s.points.rule
    why = "on the edges of quadratic elements" if rule.cuts else f"with 'integration: {rule.type}'"
    use = "elements with straight edges" if rule.cuts else "'integration: nodal', which takes what is covered,"
    yield Finding(
        f"tools.{tool.name}",
        f"its sharp edge lies between the nodes of {'+'.join(s.description.surface)!r} at ({x:.4g}, {y:.4g}), which {why} "
        f"count whole or not at all: its width is known to {np.hypot(*(ends[1] - ends[0])):.2g} only; put a node there, "
        f"use {use} or give a 'fillet'",
    )


def _path_of(system: System, i: int) -> str:
    """The path of a contact, or of its tool where no contact is written."""
    if "contacts" in system.problem.stated or not system.problem.stated:
        return f"contacts.{i}"
    return f"tools.{system.surfaces[i].against}"


def _bends(system: System) -> Iterator[Finding]:
    """Surfaces with a corner whose gaps are measured along the normal before they deform, which a corner does not have."""
    for i, s in enumerate(system.surfaces if system.problem.contact_geometry == "reference" else ()):
        if s.points.rule.type != "nodal":  # points between nodes have the normal of their edge
            continue
        ends = s.points.edges[:, :2]
        along = system.X[ends[:, 1]] - system.X[ends[:, 0]]
        along /= np.hypot(*along.T)[:, None]
        into = {int(node): k for k, node in enumerate(ends[:, 1])}
        for k, node in enumerate(ends[:, 0].tolist()):
            if node in into and float(along[into[node]] @ along[k]) < KINKED:
                x, y = system.X[node]
                names = s.description.surface
                one = "make two boundaries of it, each with a contact"
                apart = one if len(names) == 1 else "give each side a contact of its own"
                yield Finding(
                    f"contacts.{i}.surface",
                    f"'contact_geometry: reference' measures gaps along the normal of the undeformed surface, which "
                    f"{'+'.join(names)!r} does not have at its corner at ({x:.4g}, {y:.4g}); {apart}",
                    Severity.REFUSE,
                )
                break


def _tip(system: System, s: Surface, h: float) -> Iterator[Finding]:
    """The end of a tool that is nearest to the surface: how wide it is a tenth of an element from its end."""
    master, start = system.master(s), system.initial()
    tool, shape = master.tool, master.shape
    if shape.cavity or not TIP * h > 0:  # sizes of new meshes may be as small as numbers are
        return
    x = system.positions(start.u)[s.points.nodes]
    pairs = master.seen(x, start.u)
    k = int(np.argmin(pairs.g))
    width, whole = shape.across(pairs.n[k], TIP * h)
    size = width**2 / (8 * TIP * h)  # the radius of a cylinder that is as wide there
    nearest, aside = x[k] - (pairs.g[k] + TIP * h) * pairs.n[k], 2 * np.sqrt(TIP) * h * pairs.e[k, 0]
    beside = master.seen(np.stack([nearest - aside, nearest + aside]), start.u)
    if size < 2 * h and (beside.g > 0).any():  # else it goes on to both sides: the floor of a container, under its rim
        surface = "+".join(s.description.surface)
        rounded = f", or give a 'fillet' of {2 * h:.2g}" if hasattr(tool.description, "fillet") else ""
        yield Finding(
            f"tools.{tool.name}.{tool.description.tip()}",
            f"the end towards {surface!r} is as sharp as a radius of {size:.2g}, less than two elements, the smallest of which "
            f"is {h:.4g} long: the tool finds no node to press on, or one; refine the surface there{rounded}",
            Severity.REFUSE if whole < h else Severity.WARN,
        )


# ------------------------------------------------------------------------------------------------------- the beginning
def _beginning(system: System) -> Iterator[Finding]:
    """Overclosure and tools that look the wrong way, before anything moves."""
    start = system.initial()
    for s in system.surfaces:
        tool = system.master(s).tool
        nodes = s.points.nodes
        pairs = system.master(s).seen(system.positions(start.u)[nodes], start.u)
        facing = (pairs.n * s.node_normal).sum(axis=1)
        name, surface = tool.name, "+".join(s.description.surface)
        if (facing > 0.5).all():
            key = tool.description.direction_key
            how = f"reverse '{key}'" if key else "put it on the other side"
            if getattr(tool.description, "type", "") == "profile":
                how = (
                    "reverse the order of its 'points' (those of a file with 'points: {file: …, reverse: true}'): who walks "
                    "along them has the tool on the left"
                )
            yield Finding(
                f"tools.{name}" + (f".{key}" if key and getattr(tool.description, key) is not None else ""),
                f"its normal points the same way as that of {surface!r}: it stands behind the surface and would pull it through "
                f"the body; {how}, or name the boundary that it is to press",
                Severity.REFUSE,
            )
            continue
        depth = -pairs.g / float(s.points.depth.min())
        behind = np.where(facing > 0.5, depth, 0.0)
        k = int(np.argmax(behind))
        if behind[k] > BEHIND and not start.contact.closed[s.rows].any():
            x, y = system.X[nodes[k]]
            to_touch = _to_touch(system, s, int(nodes[k]))
            yield Finding(
                f"tools.{name}",
                f"it starts so deep inside {surface!r} that node {nodes[k] - system.offsets[s.body]} ({x:.4g}, {y:.4g}) is "
                f"nearer to its far side, through which it would be pulled: move the tool out{to_touch}{tool.description.hint()}",
                Severity.REFUSE,
            )
            continue
        k = int(np.argmax(depth))
        if depth[k] > CLOSED and not start.contact.closed[s.rows].any():
            x, y = system.X[nodes[k]]
            n = pairs.n[k]
            plastic = system.problem.bodies[s.body].material.plastic
            yield Finding(
                f"tools.{name}",
                f"it starts {-pairs.g[k]:.4g} inside {surface!r}, deepest at node {nodes[k] - system.offsets[s.body]} "
                f"({x:.4g}, {y:.4g}): the first increment has to push it out; "
                + (
                    _along_axis(system, s)
                    if system.axisymmetric
                    else f"move the tool by ({pairs.g[k] * n[0] + 0.0:.4g}, {pairs.g[k] * n[1] + 0.0:.4g})"
                    + _to_touch(system, s, int(nodes[k]))
                )
                + (tool.description.hint() if depth[k] > SUNK else ""),
                Severity.REFUSE if plastic and depth[k] > SUNK else Severity.WARN,
            )


def _to_touch(system: System, s: Surface, node: int) -> str:
    """How to place a tool at the boundary of a node, in words; '' where that has no name."""
    sides = [name for name in s.description.surface if "." in name]
    sides += [f"{s.body}.{k}" for k, e in system.meshes[s.body].edges.items() if node - system.offsets[s.body] in e]
    return f", or place it with 'touching: {sides[0]}'" if sides else ""


def _along_axis(system: System, s: Surface) -> str:
    """How far along the axis, the only way there is in axisymmetry, a tool comes out of a surface, in words."""
    start, master = system.initial(), system.master(s)
    x, place = system.positions(start.u)[s.points.nodes], master.place(start.u)

    def least(way: float) -> float:
        return float(master.seen_at(x, place + np.array([0.0, way, 0.0])).g.min())

    ways = [sign * w for w in AWAY * float(np.ptp(x, axis=0).max()) for sign in (-1.0, 1.0)]
    out = next((w for w in ways if least(w) >= 0.0), None)
    if out is None:
        return f"leave {-least(0.0):.4g} more room between the two: no move along the axis brings it out"
    inside = 0.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (inside + out)
        inside, out = (inside, middle) if least(middle) >= 0.0 else (middle, out)
    return f"move the tool along the axis by {out:.4g}, or leave {-least(0.0):.4g} more room between the two"


def _overlaps(system: System) -> Iterator[Finding]:
    """Bodies that lie in one another, or on one another without a tie."""
    for o in overlaps(system):
        yield Finding(
            f"bodies.{o.second}",
            f"it overlaps body {o.first!r}, by {o.depth:.3g} at ({o.x:.4g}, {o.y:.4g}): bodies do not feel one another; move it "
            "('origin'), and join the two with 'ties' where they meet",
        )
    for o in neighbours(system):
        yield Finding(
            f"bodies.{o.second}",
            f"it lies on body {o.first!r} at ({o.x:.4g}, {o.y:.4g}), and nothing holds the two together or apart: bodies do not "
            "feel one another; join them with 'ties', or make one a tool",
        )


def _inside(system: System, watched: list[Watch]) -> list[Finding]:
    """Metal that lies inside a tool from the beginning, and tools that lie inside a body."""
    node = inside(system, watched, system.initial().u)
    if node is not None:
        remedy = "move the tool" if node.through else f"move the tool, or {node.remedy}"
        return [Finding(f"tools.{node.tool}", f"{node} when the run begins: {remedy}", Severity.REFUSE)]
    return [
        Finding(
            f"tools.{tool}", f"it lies inside body {body!r}, whose outline it does not meet: move the tool out", Severity.REFUSE
        )
        for tool, body in engulfed(system)
    ]


# ------------------------------------------------------------------------------------------------------------ the passage
class Pressed(NamedTuple):
    """A held node that a tool presses in: the largest ``depth``, at time t, and the axis along which it is held."""

    depth: float
    t: float
    node: int
    axis: int


NOT_PRESSED = Pressed(0.0, 0.0, 0, 0)


class _Moment(NamedTuple):
    """Bodies at rest at time t: degrees of freedom u (ndof,), and which tools have a place that is prescribed up to here."""

    plan: StepPlan
    t: float
    u: Array
    known: Flags


def _moments(system: System) -> Iterator[_Moment]:
    at_start, known = system.initial().u, np.ones(len(system.tools), dtype=bool)
    for number in range(len(system.problem.steps)):
        plan = plan_step(system, number, at_start)
        for t in range(len(system.tools)):
            own = np.isin(plan.fixed, system.dofs.tool.dofs(t))
            # what ends a step may do so anywhere on its way, and tools that are removed are nowhere
            still = not tools_removed(system.problem, number)
            still &= not ends_early(system.problem.steps[number]) or np.array_equal(
                plan.values(plan.t1)[own], at_start[plan.fixed[own]]
            )
            known[t] &= still and bool(np.isin(system.dofs.tool.dofs(t)[: system.dofs.dimension], plan.fixed).all())
        for t in np.unique(np.concatenate([np.linspace(plan.t0, plan.t1, SAMPLES), plan.corners()])):
            u = at_start.copy()
            u[plan.fixed] = plan.values(float(t))
            yield _Moment(plan, float(t), u, known)
        at_start = u


def _passage(system: System, watched: list[Watch]) -> Iterator[Finding]:
    """Tools that never touch, that press what cannot yield, that cross each other, or go into what has no contact with them."""
    nearest = np.full(len(system.surfaces), np.inf)
    known = np.ones(len(system.surfaces), dtype=bool)
    moved = {name for name, body in system.problem.bodies.items() if _driven(system, name)}
    pressed: dict[tuple[int, int], Pressed] = {}
    reported: dict[str, Finding] = {}
    for m in _moments(system):
        x = system.positions(m.u)
        for i, s in enumerate(system.surfaces):
            known[i] &= m.known[system.master(s).number]
            if not m.known[system.master(s).number]:
                continue
            pairs = system.node_stencils(s, m.u)
            nearest[i] = min(nearest[i], float(pairs.g.min()))
            _held(system, s, i, m, x, pressed)
        for notice in _crossing(system, m, x):
            reported.setdefault(notice.path, notice)
        at_rest = set(system.problem.bodies) - moved - _touched(system, nearest, known)
        for notice in _entered(system, watched, m, at_rest):
            reported.setdefault(notice.path, notice)
    for i, s in enumerate(system.surfaces):
        if nearest[i] <= 0 or not known[i]:
            moved.add(s.body)
    reached = {
        s.against for i, s in enumerate(system.surfaces) if nearest[i] <= CLOSED * s.points.depth.min() or not known[i]
    }
    for i, s in enumerate(system.surfaces):
        if s.against in reached and s.description.surface == (s.body,):
            continue  # a tool is against all bodies where nothing else is said, not meant to meet them all
        if known[i] and nearest[i] > CLOSED * s.points.depth.min() and s.body not in moved:
            gap = f"never comes nearer than {nearest[i]:.4g}" if np.isfinite(nearest[i]) else "never stands over it"
            yield Finding(
                _path_of(system, i),
                f"tool {s.against!r} never touches {'+'.join(s.description.surface)!r} in any step: it {gap}; "
                "check where it is placed, the sign and the size of its motion",
            )
    yield from reported.values()
    worst = _worst(pressed)
    for (number, k), most in worst.items():
        if k < 0 and not system.master(system.surfaces[number]).shape.half_space:
            continue  # what is no half-space may stand beside them, or the body yield in between
        if k >= 0 and (number, -1) in worst:
            continue  # the tool goes beyond the supports: said once
        i, s = number, system.surfaces[number]
        yield _overconstrained(system, s, i, most, candidate=k >= 0)


def _touched(system: System, nearest: Array, known: Flags) -> set[str]:
    """Bodies that some tool has reached by now, or may have, with those tied to them."""
    reached = {
        s.body for i, s in enumerate(system.surfaces) if nearest[i] <= CLOSED * s.points.depth.min() or not known[i]
    }
    return {other for body in reached for other in system.tied_bodies(body)}


def _entered(system: System, watched: list[Watch], m: _Moment, at_rest: set[str]) -> Iterator[Finding]:
    """Tools that are inside a body that nothing has touched before, past a side that has no contact with them."""
    node = inside(system, [w for w in watched if m.known[w.tool]], m.u) if at_rest else None
    if node is not None and node.body in at_rest:
        yield Finding(f"tools.{node.tool}", f"at time {m.t:.4g} {node}: {node.remedy}")


def _driven(system: System, body: str) -> bool:
    """Whether something besides tools can move a body."""
    p = system.problem
    owners: tuple[Any, ...] = (p, *p.steps)
    if any(name.partition(".")[0] == body for step in p.steps for name in p.driven(step)):
        return True
    for owner in owners:
        if any(name.partition(".")[0] == body for name in owner.loads) or body in owner.body_force:
            return True
        for name, f in owner.fixed.items():
            if name.partition(".")[0] == body and any(v is not None and v != "held" for v in (f.x, f.y)):
                return True
    return False


def _held(system: System, s: Surface, i: int, m: _Moment, x: Array, pressed: dict[tuple[int, int], Pressed]) -> None:
    """Nodes of the body that are held along the normal of a tool which reaches into them."""
    first = system.offsets[s.body]
    last = first + len(system.meshes[s.body].points)
    field = system.dofs.displacement
    nodes, axis = field.split(m.plan.fixed[field.owns(m.plan.fixed)])
    mine = (nodes >= first) & (nodes < last)
    nodes, axis = nodes[mine], axis[mine]
    if not len(nodes):
        return
    master = system.master(s)
    place, pairs = master.place(m.u), master.seen(x[nodes], m.u)
    h = float(s.points.depth.min())
    deep = (pairs.g < -REACH * h) & (np.abs(pairs.n[np.arange(len(nodes)), axis]) > ALONG)
    if not deep.any():
        return
    # beside the contact surface, a tool that came across the normal has pushed the free body ahead of it
    came = pairs.n @ place[:2] >= -0.5 * pairs.g
    # deep in a tool that is as narrow as its travel is long, its side may be nearer than the face that came
    across = np.abs(pairs.n @ place[:2]) < 0.5 * np.hypot(*place[:2])
    came |= np.isin(nodes, s.points.nodes) & (master.shape.half_space | ~across)
    # what is free across its support goes along with a tool that comes that way, down a bore under a fillet, say
    other, beside = 1 - axis, x[nodes].copy()
    free = ~np.isin(field.dofs(nodes)[np.arange(len(nodes)), other], m.plan.fixed)
    beside[np.arange(len(nodes)), other] += place[other] * free
    came &= ~free | (master.seen(beside, m.u).g < -REACH * h)
    for k in np.flatnonzero(deep & came):
        key = (i, int(nodes[k]) if nodes[k] in s.points.nodes else -1 - int(nodes[k]))
        if -pairs.g[k] > pressed.get(key, NOT_PRESSED).depth:
            pressed[key] = Pressed(float(-pairs.g[k]), m.t, int(nodes[k]), int(axis[k]))


def _worst(pressed: dict[tuple[int, int], Pressed]) -> dict[tuple[int, int], Pressed]:
    """The deepest node of each contact, candidates and others apart."""
    worst: dict[tuple[int, int], Pressed] = {}
    for (i, k), entry in pressed.items():
        key = (i, 1 if k >= 0 else -1)
        worst[key] = max(worst.get(key, NOT_PRESSED), entry)
    return worst


def _overconstrained(system: System, s: Surface, i: int, most: Pressed, candidate: bool) -> Finding:
    depth, t, node, _ = most
    x, y = system.X[node]
    where = f"node {node - system.offsets[s.body]} of {s.body!r} at ({x:.4g}, {y:.4g})"
    tool = s.against
    if candidate:
        return Finding(
            _path_of(system, i),
            f"{where} is held along the normal of tool {tool!r}, which presses it in by {depth:.4g} until time {t:.4g}: it can "
            f"obey only one of them; {_advice_to_release(system, s, most)}",
            Severity.REFUSE,
        )
    return Finding(
        _path_of(system, i),
        f"tool {tool!r} reaches {depth:.4g} beyond {where} at time {t:.4g}, which a support holds: is its travel larger than the "
        "body?",
        Severity.REFUSE if system.problem.kinematics == "finite" and system.master(s).shape.half_space else Severity.WARN,
    )


def _advice_to_release(system: System, s: Surface, most: Pressed) -> str:
    """What to do about a node of a contact surface that a support holds: by the support, which may be one beside the surface."""
    mesh, own = system.meshes[s.body], most.node - system.offsets[s.body]
    beside: dict[str, model.Fixed] = {}
    begun: list[Any] = [system.problem, *system.problem.steps[: int(np.ceil(most.t))]]
    for owner in begun:
        for name, support in owner.fixed.items():
            body, _, side = name.partition(".")
            of_side = mesh.edges[side] if side in mesh.edges else np.array([mesh.corners.get(side, -1)])
            if body == s.body and own in of_side and getattr(support, "xy"[most.axis]) is not None:
                beside[name] = support
    if len(beside) != 1 or s.body in s.description.surface or set(beside) & set(s.description.surface):
        return "take the support off the contact surface, or hold it across the normal only"
    ((name, support),) = beside.items()
    if support.x is None or support.y is None:
        return f"take the support {name!r} away, or keep the tool off it"
    return f"hold {name!r}, which meets the contact surface there, across the normal only, or keep the tool off it"


def _crossing(system: System, m: _Moment, x: Array) -> Iterator[Finding]:
    """Two tools whose faces pass each other where they press on the same body, or that press the same points."""
    for i, a in enumerate(system.surfaces):
        for b in system.surfaces[:i]:
            ta, tb = system.master(a), system.master(b)
            if ta.name == tb.name or a.body != b.body or not (m.known[ta.number] and m.known[tb.number]):
                continue
            shared = np.intersect1d(a.points.nodes, b.points.nodes)
            planes = ta.shape.half_space and tb.shape.half_space
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
                    _path_of(system, i),
                    f"tools {tb.name!r} and {ta.name!r} cross: at time {m.t:.4g} they overlap by {-between[k]:.4g} near "
                    f"({x[nodes[k], 0]:.4g}, {x[nodes[k], 1]:.4g}) and leave the body no room; check their travels",
                    Severity.REFUSE,
                )
            same = (facing > 1 - 1e-9) & (np.maximum(pa.g, pb.g) < -CLOSED * h) & (np.abs(pa.g - pb.g) < CLOSED * h)
            if len(shared) and same.any():
                yield Finding(
                    _path_of(system, i),
                    f"tools {tb.name!r} and {ta.name!r} press the same points of {'+'.join(a.description.surface)!r} at time "
                    f"{m.t:.4g}: which of them carries the force is not determined; keep one contact",
                )
