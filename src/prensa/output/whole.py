"""The whole of which a part was modelled: whether sides are planes of symmetry, and forces of the whole.

The whole is the part times the order of the group that the reflections across its planes generate. A tool is one with its images
across the planes that it reaches, and along which it moves; with the group H of these and the force f on what is modelled, the
whole has Σ R f over H: the part of f along all of these planes, as often as H has elements. Across the others stand other tools;
those across planes along its way go the same way.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from prensa.checks.before.free_cuts import sectors
from prensa.checks.before.mirrored_tools import Wall, goes_across, meetings, motions_in_space
from prensa.checks.before.off_centre import Overlap, overlaps
from prensa.checks.before.preflight import preflight
from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding, PrensaError, Severity
from prensa.geometry.reflections import NoWhole, Plane, chamber, distinct, group
from prensa.model.press import CRANK_ACROSS, drives
from prensa.model.problem import Case, Problem, support_names, tools_removed
from prensa.precision import DRAWN
from prensa.result.presses import use_of
from prensa.system.held import held, held_along
from prensa.system.mirrored_sides import ENDS, Side, named_sides, plane_of, sides_in
from prensa.system.moments import Moment, moments, stages
from prensa.system.system import System
from prensa.types import Array


# ---------------------------------------------------------------------------------------------------- planes of symmetry
def mirror_findings(system: System, case: Case) -> Iterator[Finding]:
    """Sides that 'mirror' names, of the output and of presses, and that are no planes of symmetry, or make no whole."""
    given = {"output.mirror": case.output.mirror}
    for name, tool in system.problem.tools.items():
        if tool.press is not None and tool.press.mirror:
            given[f"tools.{name}.press.mirror"] = tool.press.mirror
    reported: set[str] = set()
    tools: set[str] = set()
    for path, sides in given.items():
        wrong = list(no_planes(system, [side for side in sides if side not in reported]))
        yield from (Finding(path, words, Severity.REFUSE) for words in wrong)
        use = None if wrong or path == "output.mirror" else use_of(system.problem, path.split(".")[1])
        if use is not None and use.strokes > 1 and use.press.torque is not None:
            yield Finding(path, CRANK_ACROSS, Severity.REFUSE)
        reported |= set(sides)
        if not wrong:
            named = system.problem.tools if path == "output.mirror" else [path.split(".")[1]]
            found = list(overlaps(system, walls_of(system, sides), [tool for tool in named if tool not in tools], named=True))
            tools |= {f.tool for f in found}
            yield from found


def findings(system: System, case: Case) -> list[Finding]:
    """All findings on a case before it runs; tools that are refused at planes that ``mirror`` names are not warned of as well."""
    of_whole = list(mirror_findings(system, case))
    refused = {f.tool for f in of_whole if isinstance(f, Overlap)}
    return [f for f in preflight(system) if not (isinstance(f, Overlap) and f.tool in refused)] + of_whole


def walls_of(system: System, sides: Sequence[str]) -> list[Wall]:
    """Planes of symmetry by the names of their sides, each once; what is round is its own image across the axis."""
    planes = [plane_of(system.problem, side, system.X, system.meshes) for side in sides]
    planes = [plane for plane in planes if not (system.axisymmetric and plane.axis == 0)]
    return [Wall(plane) for plane in distinct(planes, DRAWN * system.length)]


def no_planes(system: System, sides: Sequence[str]) -> Iterator[str]:
    """Why sides by name are no planes of symmetry of a whole: what is wrong with each, or with their angles."""
    planes, good = [], True
    for side in sides:
        try:
            plane = plane_of(system.problem, side, system.X, system.meshes)
        except PrensaError as error:
            yield str(error)
            good = False
            continue
        if words := _no_plane(system, plane):
            yield words
            good = False
        planes.append(plane)
    if good and planes:
        try:
            chamber(distinct(planes, DRAWN * system.length))
        except NoWhole as error:
            yield f"{error}; leave one out, or model another part"


def _no_plane(system: System, plane: Plane) -> str:
    """Why a plane through a side is none of symmetry; empty if it is one."""
    side = f"'{plane.name}'" if "." in plane.name else f"their {plane.name} side"
    found = sides_in(system.meshes, plane)
    if not found:
        return f"the bodies have no flat side at their {plane.name}, so that it is no plane of symmetry; name a flat one, or none"
    beyond = -float(plane.distance(system.X).min())
    if beyond > DRAWN * system.length:
        return f"the bodies go on beyond the plane of {side}, by {beyond:.3g}: their images would overlap; leave it out"
    for s in found:
        if not system.problem.bodies[s.body].material.is_mirrored(np.asarray(plane.normal)):
            return f"the axes of the material of {s.body!r} lie across {side}, so that it is no plane of symmetry; leave it out"
    if words := _body_force_across(system, plane, side):
        return words
    loose = [s for s in found if not held_along(system, s.body, np.asarray(plane.normal))[s.faces].all()]
    if not loose or _guided(system, plane, loose):
        return _stuck(system, plane, found)
    way = "xyz"[plane.axis] if plane.axis is not None else "its normal"
    bodies = " and ".join(repr(s.body) for s in loose)
    owner = plane.name.partition(".")[0]
    if "." in plane.name and all(s.body != owner for s in loose):
        side = f"what lies in the plane of {side}"
    effect = "it is no plane of symmetry, but forces of the whole part would count what is modelled twice for it"
    if pressing := [t for s in loose for t in _pressing(system, plane, s)]:
        return f"tool {pressing[0]!r} presses {bodies} at {side}, so that {effect}; leave {plane.name!r} out"
    support = f"{plane.name}: {way if plane.axis is not None else 'normal'}"
    hold = f"give 'fixed' '{support}'" if any(s.body == owner for s in loose) else "hold it in 'fixed'"
    what = f"nothing holds {bodies} along {way} all over {side} in every step"
    return f"{what}, so that {effect}; {hold}, or leave {plane.name!r} out"


def _stuck(system: System, plane: Plane, found: Sequence[Side]) -> str:
    """What is wrong with a cut side of a sector that supports hold along its radius too; empty of other planes.

    The whole has metal there that spreads as it does beside it.
    """
    for s in found:
        side = _cut_along_radius(system, s.body, plane)
        if side:
            normal = "normal" if plane.axis is None else "xyz"[plane.axis]
            return (
                f"supports hold the cut side '{s.body}.{side}' of the sector along its radius as well as its normal, so that "
                "metal cannot spread there and it is no plane of symmetry; hold it along its normal alone, "
                f"'{s.body}.{side}: {normal}' in 'fixed', or leave {plane.name!r} out"
            )
    return ""


def _cut_along_radius(system: System, body: str, plane: Plane) -> str:
    """The cut side of a sector in a plane that supports hold along its radius too, off the axis in all steps; empty if none."""
    sector, n = sectors(system)[body], np.asarray(plane.normal)
    if sector is None or len(n) == 2:
        return ""
    mesh = system.meshes[body]
    for side, normal in sector.cuts.items():
        nodes = np.unique(mesh.edges[side])
        nodes = nodes[sector.axis.radial(mesh.points[nodes])[0] > DRAWN * system.length]
        if abs(normal @ n) >= 1.0 - DRAWN and held_along(system, body, np.cross(sector.axis.way, normal))[nodes].all():
            return side
    return ""


def _body_force_across(system: System, plane: Plane, side: str) -> str:
    """What is wrong with a plane towards which, or away from which, a body force acts in any step; empty without one.

    In axisymmetry what acts along the radius is its own image across the axis.
    """
    if system.axisymmetric and plane.axis == 0:
        return ""
    for plan, *_ in stages(system):
        for body, courses in plan.body_force.items():
            times = np.concatenate([course.times for course in courses])  # between them all parts are linear
            force = np.array([[course(t) for course in courses] for t in times])
            if (np.abs(force @ np.asarray(plane.normal)) > NO_DIFFERENCE * np.linalg.norm(force, axis=1)).any():
                return (
                    f"'body_force' on {body!r} has a part across {side}, and the images would have the opposite one, so that it "
                    f"is no plane of symmetry; let it act along the plane, or leave {plane.name!r} out"
                )
    return ""


def _pressing(system: System, plane: Plane, side: Side) -> list[str]:
    """Tools that touch faces of a side, their normals along that of its plane."""
    nodes, u = np.unique(side.faces) + system.offsets[side.body], system.initial().u
    found = []
    for s in system.tool_contacts:
        there = s.points.nodes[np.isin(s.points.nodes, nodes)] if s.body == side.body else nodes[:0]
        if len(there):
            seen = system.tool_masters[s.against].seen(system.positions(u)[there], u)
            if ((np.abs(seen.n @ np.asarray(plane.normal)) >= 1.0 - DRAWN) & (seen.g <= DRAWN * system.length)).any():
                found.append(s.against)
    return found


def _guided(system: System, plane: Plane, loose: Sequence[Side]) -> bool:
    """Whether flat, smooth tools that stand still in a plane guide all that no support holds there."""
    guides = set()
    for name, master in system.tool_masters.items():
        u = system.initial().u
        at = float(plane.distance((master.at + master.place(u)[: system.dofs.dimension])[None])[0])
        own = float(np.asarray(master.tool.direction) @ np.asarray(plane.normal))
        flat, there = master.tool.shape.half_space, abs(at) <= DRAWN * system.length and own >= 1.0 - DRAWN
        if flat and there and _still(system.problem, name):
            guides.add(name)
    rough = {s.against for plan, *_ in stages(system) for s, law in zip(system.tool_contacts, plan.friction_at(plan.t1))
             if not system.frictionless(law)}  # fmt: skip
    return all(any(s.body == side.body and s.against in guides - rough for s in system.tool_contacts) for side in loose)


def _still(problem: Problem, tool: str) -> bool:
    ways = ("x", "y", "z", "rx", "ry", "rz", "m", "mx", "my", "mz")
    if tools_removed(problem, len(problem.steps) - 1):  # after which it guides nothing
        return False
    return problem.tools[tool].spring is None and not any(drives(step, tool, way) for step in problem.steps for way in ways)


# ------------------------------------------------------------------------------------------------- what may be a part
def part_of_whole(system: System, case: Case) -> str:
    """A sentence about a part in space whose forces are not those of the whole, since not all planes of symmetry are named.

    Flat sides that are held along their normal, and not along themselves, may be planes of symmetry beside those that the case
    names; of one along which a tool moves the whole has other forces. Empty where there is none, where the images across them
    make no whole, or where a press says that there are none.
    """
    p = system.problem
    if p.space != "solid" or any(t.press is not None and t.press.mirror == () for t in p.tools.values()):
        return ""
    ways = [np.eye(3)[k] for k in range(3) if any(drives(s, t, "xyz"[k]) for s in p.steps for t in p.tools)]
    turns = [np.eye(3)[k] for k in range(3) if any(drives(s, t, f"r{'xyz'[k]}") for s in p.steps for t in p.tools)]
    planes = []
    for plane in _held_sides(system):
        n = np.asarray(plane.normal)
        moved = any(abs(n @ w) <= DRAWN for w in ways) or any(abs(n @ w) >= 1.0 - DRAWN for w in turns)
        if moved and not _no_plane(system, plane):  # which would be refused where it is named
            planes.append(plane)
    given = named_sides(p)
    try:
        known = distinct([plane_of(p, side, system.X, system.meshes) for side in given], DRAWN * system.length)
        found = distinct([*known, *planes], DRAWN * system.length)
        chamber(found)
    except PrensaError:
        return ""
    names = [plane.name for plane in found[len(known) :]]
    if not names:
        return ""
    several = len(names) > 1
    what = f"of the whole across {' and '.join(map(repr, given))} alone" if given else "those of what is modelled"
    return (
        f"forces are {what}: {' and '.join(map(repr, names))} {'are' if several else 'is'} held along "
        f"{'their normals' if several else 'its normal'}; if {'these are planes' if several else 'that is a plane'} of symmetry, "
        f"'output: {{mirror: [{', '.join([*given, *names])}]}}' states those of the whole"
    )


def _held_sides(system: System) -> Iterator[Plane]:
    """Planes of flat sides that supports hold along the normal in all steps, not all of them along themselves."""
    for name in support_names(system.problem):
        body, _, side = name.partition(".")
        mesh = system.meshes[body]
        if side not in mesh.edges:
            continue
        try:
            plane = plane_of(system.problem, name, None, system.meshes)
        except PrensaError:  # it is not flat
            continue
        nodes = np.unique(mesh.edges[side])
        along = held(system, body).flags[nodes, : len(plane.normal)].all()
        beside = plane.distance(system.X).min() >= -DRAWN * system.length
        beside &= system.problem.bodies[body].material.is_mirrored(np.asarray(plane.normal))
        if beside and not along and held_along(system, body, np.asarray(plane.normal))[nodes].all():
            yield plane


# ------------------------------------------------------------------------------------------------- forces of the whole
class Share(NamedTuple):
    """What a tool of the model is in the whole: one with its images across ``sides``, of ``alike`` tools that go the same way."""

    sides: tuple[str, ...] = ()
    alike: int = 1


def shares_of(system: System, case: Case) -> dict[str, Share]:
    """What each tool is in the whole, by all its motions in a run: check, answer and report ask for it here.

    In space a tool that does not reach a plane is another one than its image. In the plane it is taken for a section of one tool.
    """
    return {tool: _share(system, case, tool) for tool in case.problem.tools}


def _share(system: System, case: Case, tool: str) -> Share:
    planes = _planes(case, tool, system)
    if not planes:
        return Share()
    met = {m.wall.plane.name: m for m in meetings(system, [Wall(plane) for plane in planes], [tool])}
    own = tuple(name for name, m in met.items() if m.reaches and m.across is None)
    if system.dofs.dimension == 2:
        # a smooth round one at the line may turn and is the same tool
        return Share(tuple(plane.name for plane in planes if not _goes_across(system, tool, plane, plane.name not in own)))
    more = tuple(name for name, m in met.items() if m.alike)
    return Share(own, len(images_of(case, tool, (*own, *more))) // len(images_of(case, tool, own)))


def _planes(case: Case, tool: str, system: System | None = None) -> list[Plane]:
    """Planes of symmetry of a case, those of its output and of the press of a tool; places of ends are those of a system."""
    press = case.problem.tools[tool].press
    sides = [*case.output.mirror, *(press.mirror or () if press is not None else ())]
    sides = [side for side in sides if case.problem.space == "solid" or ENDS.get(side, (0, 0))[0] < 2]
    X, meshes = (system.X, system.meshes) if system is not None else (None, None)
    planes = [plane_of(case.problem, side, X, meshes) for side in sides]
    return distinct(planes, np.inf if system is None else DRAWN * system.length)


def _goes_across(system: System, tool: str, line: Plane, turns: bool) -> bool:
    """Whether a tool in the plane moves across a line in a run, or if ``turns`` turns, or is free to."""
    number = list(system.problem.tools).index(tool)
    dofs, n = system.dofs.tool.dofs(number)[: 3 if turns else 2], np.append(line.normal, 0.0)
    before: Moment | None = None
    for now in moments(system):
        way = now.u[dofs] - before.u[dofs] if before is not None and before.plan is now.plan else np.zeros(len(dofs))
        free = np.eye(len(dofs))[~np.isin(dofs, now.plan.fixed)]
        if any(goes_across(w, n) for w in motions_in_space(np.vstack([way, free]))):
            return True
        before = now
    return False


def images_of(case: Case, tool: str, sides: Collection[str]) -> Array:
    """Matrices (h, d, d) of the group that the reflections across some of a case's planes of symmetry generate."""
    d = 3 if case.problem.space == "solid" else 2
    planes = [plane for plane in _planes(case, tool) if plane.name in sides]
    try:
        return group(chamber(planes)) if planes else np.eye(d)[None]
    except NoWhole:  # of a run of an earlier version
        return np.eye(d)[None]


def of_whole(images: Array, force: Array) -> Array:
    """Force (d,) of the whole on a tool that is one with its images, by that of what is modelled."""
    return np.asarray(images.sum(axis=0) @ force)


def moment_of_whole(images: Array, moment: Array) -> Array:
    """Moment (3,) of the whole on such a tool, about an axis through its reference point across the planes."""
    return np.asarray(np.einsum("hij,h->ij", images, np.linalg.det(images)) @ moment)


def parts_along(images: Array, key: str) -> int:
    """How many parts of the whole share what presses a tool along an axis (``y``), or turns it about one (``my``)."""
    d = images.shape[1]
    axis = np.eye(d)["xyz".index(key[-1])]
    shared = moment_of_whole(images, axis) if "m" in key else of_whole(images, axis)
    return round(float(axis @ shared))
