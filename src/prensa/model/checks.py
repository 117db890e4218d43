"""Cross-references of a description: every name that is used exists, and every combination written makes sense."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from math import isclose
from typing import Any

from prensa.model import body_contacts, crank, feed, heat, interference, press, space, until
from prensa.model.default_elements import element_name
from prensa.model.fields import force_along, motions_in
from prensa.model.names import SYMMETRY, Finding, suggest
from prensa.model.remeshing import remeshing_of
from prensa.model.units import PRESSURE, factor
from prensa.registry import DOORS

_OWN_NAME = re.compile(r"[^\W\d][\w-]*")
_TAKEN = ("step", "increment", "time", "iterations", "cutbacks")
_EDGES = ("bottom", "right", "top", "left")


class FindingsError(ValueError):
    """All the `Finding`s of a description; ``str`` is one line for each."""

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__("\n".join(map(str, self.findings)))


def find(p: Any) -> Iterator[Finding]:
    """Yield what is wrong with a problem, or with one whose unreadable parts are None (they are passed over)."""
    if not p.bodies:
        yield Finding(("bodies",), "at least one body is needed")
    if not p.steps:
        yield Finding(("steps",), "at least one step is needed")
    yield from _whole(p)
    yield from space.findings(p)
    yield from _remeshing(p)
    for key, tool in p.tools.items():
        if tool is not None:
            yield from _tool(p, ("tools", key), tool)
    yield from press.findings(p)
    yield from _surfaces(p)
    yield from _contacts(p)
    yield from _friction(p)
    yield from _measures(p)
    yield from _ties(p)
    yield from body_contacts.findings(p, _boundary)
    yield from interference.findings(p)
    yield from heat.findings(p)
    for name in p.heat.held if p.heat is not None else ():
        yield from _boundary(p, name, ("heat", "held", name), at_key=True)
    yield from _supports(p, p, ())
    seen: set[str] = set()
    for i, step in enumerate(p.steps):
        if step is None:
            continue
        if step.name in seen:
            yield Finding(("steps", i, "name"), f"two steps are called {step.name!r}; give each its own name")
        seen.add(step.name)
        yield from _step(p, ("steps", i), step)
    yield from until.tables_beyond(p)


def _measures(p: Any) -> Iterator[Finding]:
    """Names of measures are columns of a table beside those of every table, and differ from what is measured."""
    for name in p.measures:
        if not _OWN_NAME.fullmatch(name) or name in _TAKEN:
            why = "every table has such a column" if name in _TAKEN else "letters, digits, '_' and '-' make one"
            yield Finding(
                ("measures", name), f"{name!r} is not a name for a measure ({why}); write it like 'bore'", at_key=True
            )


def _metal(p: Any, body: str, metal: Any) -> Iterator[Finding]:
    """A temperature of its flow curve outside its range; of a script stresses in N/mm², which may not be those of the problem."""
    T = getattr(p.bodies[body].material.flow, "T", None) if metal is not None and "flow.T" in metal.changed else None
    if T is not None and (words := metal.refuses(T)):
        yield Finding(("bodies", body, "material", "flow", "T"), words)
    if metal is not None and metal.MPa is not None and p.units is not None:
        length, force = p.units.length, p.units.force
        if not isclose(metal.MPa, factor("1 MPa", length, force, PRESSURE.exponents)):
            message = f"the stresses of {metal.name!r} are not in {force}/{length}²: in Python 'of' gives them in N/mm²; "
            message += "use mm and N, or read the case from a file, where they are converted"
            yield Finding(("bodies", body, "material"), message)


def _whole(p: Any) -> Iterator[Finding]:
    for key, body in p.bodies.items():
        if body is None:
            continue
        # p may be the sketch of a case that could not be read: what is None was wrong, has been reported, and is passed over.
        if p.space is not None and body.mesh.type == ("strip" if p.space == "axisymmetric" else "wire"):
            other = "a strip is not round; use 'wire'" if p.space == "axisymmetric" else "a wire is round; use 'strip'"
            or_round = "" if p.space == "axisymmetric" else ", or write 'space: axisymmetric'"
            yield Finding(("bodies", key, "mesh", "type"), f"{other} in {p.space}{or_round}")
        yield from _metal(p, key, getattr(body.material, "of", None))
        known = body.material.kinematics
        if p.kinematics is not None and p.kinematics not in known:
            other = "use 'elastic' or 'kinematics: finite'" if p.kinematics == "small" else "use 'kinematics: small'"
            yield Finding(
                ("bodies", key, "material", "type"), f"{body.material.type} is a {known[0]}-strain law; {other}"
            )
        yield from _damage(p, key, body)
        element: Any = DOORS["element"].find(body.element) if body.element is not None else None
        if element is not None and element.no_plane_stress and p.space == "plane stress":
            yield Finding(("bodies", key, "element"), element.no_plane_stress)
    if p.space == "axisymmetric" and p.thickness not in (None, 1.0):
        yield Finding(
            ("thickness",),
            "an axisymmetric problem has no thickness, its forces are those of the whole circumference; leave it out",
            at_key=True,
        )
    if p.kinematics == "finite" and p.allow_large_strain:
        yield Finding(
            ("allow_large_strain",), "finite strain needs no permission; this goes with 'kinematics: small'", at_key=True
        )
    # Once a body deforms, gaps along normals of the undeformed surface are no distances.
    if p.kinematics == "finite" and p.contact_geometry == "reference":
        yield Finding(
            ("contact_geometry",), "'reference' is the linear Signorini problem and needs 'kinematics: small'"
        )


def _damage(p: Any, key: str, body: Any) -> Iterator[Finding]:
    """What is wrong with the damage laws of a body."""
    if not body.damage:
        return
    path = ("bodies", key, "damage")
    if not body.material.plastic:
        kind = body.material.type
        why = f"damage grows with plastic strain, and {kind} has none; use 'j2', or leave 'damage' out"
        yield Finding(path, why, at_key=True)
    names = [law.name for law in body.damage]
    for k, name in enumerate(names):
        if name in names[:k]:
            yield Finding((*path, k), f"two damage laws {name!r}; a body has one of each, so keep one of them")
        if words := body.damage[k].fault():
            yield Finding((*path, k), f"damage law {name!r}: {words}; try it with prensa.testing.check_damage")


def _remeshing(p: Any) -> Iterator[Finding]:
    """What in a problem that is remeshed cannot be; each with what to do."""
    if remeshing_of(p) is None:
        return
    if p.kinematics == "small":
        yield _not_remeshed("small strain keeps the initial shape; use 'kinematics: finite'")
    if p.space == "plane stress":
        yield _not_remeshed("the thickness of plane stress is not transferred to new meshes; use plane strain, or 'remesh: off'")
    if p.ties:
        yield _not_remeshed("tied sides are not transferred to new meshes; make one body of the tied ones, or use 'remesh: off'")
    if any(step is not None and step.control for step in p.steps):
        yield _not_remeshed("the factor of 'control' is not transferred to new meshes; move the tool, or use 'remesh: off'")
    bodies = {name: b for name, b in p.bodies.items() if b is not None and b.material is not None}
    flowing = {name: b for name, b in bodies.items() if getattr(b.material, "plastic", False)}
    # Only where every material could be read: one that could not may be the one that flows.
    if len(bodies) == len(p.bodies) and not flowing:
        yield _not_remeshed("no body flows plastically, and meshes of elastic ones do not become distorted; leave it out")
    for name, body in flowing.items():
        if body.element not in (None, "t6") and p.space != "solid":  # refused in space by its table
            yield Finding(
                ("bodies", name, "element"), f"new meshes are of 't6', triangles; {body.element!r} is not: leave the element out"
            )
    for k, contact in enumerate(p.contacts):
        if contact is None or contact.surface[0].partition(".")[0] not in flowing:
            continue
        # What contact remembers is carried over by nodes, which other rules' points are not.
        if contact.integration not in (None, "nodal"):
            yield Finding(("contacts", k, "integration"), "contacts of bodies that are remeshed have 'integration: nodal'")


def _not_remeshed(why: str) -> Finding:
    return Finding(("remesh",), why)


def _boundary(
    p: Any, name: str, path: tuple[str | int, ...], at_key: bool = False, body_too: bool = False
) -> Iterator[Finding]:
    """What is wrong with the name of a boundary; ``body_too``: a body's name alone may stand there."""
    body, _, edge = name.partition(".")
    if not body or not edge:
        also = " or, for its whole outline, 'body'" if body_too else ""
        yield Finding(path, f"{name!r} is not a boundary; write it as 'body.boundary'{also}", at_key)
    elif body not in p.bodies:
        yield Finding(path, f"unknown body {body!r} in {name!r}{suggest(body, p.bodies)}", at_key)
    elif (known := _boundaries(p.bodies.get(body))) and edge not in known and space.fits(p, p.bodies[body]):
        yield Finding(path, f"unknown boundary {edge!r} of body {body!r}{suggest(edge, known)}", at_key)


def _boundaries(body: Any) -> list[str]:
    """Boundaries and points of a body that are known before it is meshed; none where that takes the mesh."""
    if body is None:
        return []
    return _of_mesh(body.mesh)


def _of_mesh(mesh: Any) -> list[str]:
    match mesh.type:
        case "rectangle" | "patch" | "strip" | "wire":
            return [*_EDGES, *(f"{y}-{x}" for y in ("bottom", "top") for x in ("left", "right"))]
        case "disc":
            return _of_disc(mesh.part)
        case "annulus":
            ends = ["start", "end", "inner-start", "outer-start", "inner-end", "outer-end"]
            return ["inner", "outer", *(ends if mesh.angles[1] - mesh.angles[0] < 6.283185 else ends[2:4])]
        case "points" | "bricks" | "tetrahedra":
            return list(mesh.boundaries)
        case "box":
            return ["left", "right", "bottom", "top", "back", "front"]
        case "cylinder":
            ends = ["base", "cap"] if mesh.angle < 6.283185 else []
            return ["bottom", "top", "outer", *(["inner"] if mesh.bore else ["bottom-centre", "top-centre"]), *ends]
        case "extruded" | "revolved":
            known = _of_mesh(mesh.section)
            return [*known, "base", "cap"] if known else []
        case "outline":
            holes = [f"hole-{k + 1}" for k in range(len(mesh.holes))]
            return [*dict.fromkeys(mesh.sides or ("outline",)), *holes]
    return []


def _of_disc(part: str) -> list[str]:
    """The sides that close a part of a disc are opposite to it; it has the points of the rim that are not cut off."""
    opposite = {"right": "left", "left": "right", "top": "bottom", "bottom": "top"}
    closing = [opposite[word] for word in part.split("-") if word in opposite]
    return ["rim", *closing, "centre", *(f"rim-{side}" for side in opposite if side not in closing)]


def _tool(p: Any, path: tuple[str | int, ...], tool: Any) -> Iterator[Finding]:
    placed = [w for w in ("touching", "above", "below") if getattr(tool, w) is not None]
    if len(placed) > 1:
        yield Finding(path, f"tool {path[-1]!r} is placed twice; give only one of {', '.join(placed)}")
    if not placed and tool.at is None:
        yield Finding(path, f"tool {path[-1]!r} has no position; give 'at', 'touching', 'above' or 'below'")
    for w in placed:
        yield from _boundary(p, getattr(tool, w), (*path, w))
    if tool.spring is not None:
        for name in ("x", "rz"):
            if p.space == "axisymmetric" and getattr(tool.spring, name) is not None:
                yield Finding((*path, "spring", name), "in axisymmetry a tool moves along y only", at_key=True)
        if tool.spring == type(tool.spring)():
            *first, last = motions_in(p.space)
            yield Finding((*path, "spring"), f"a spring needs a stiffness: {', '.join(first)} or {last}")
    yield from tool.findings(p, path)


def _surfaces(p: Any) -> Iterator[Finding]:
    """Names in contacts and in ``no_contact``, and sides that two of these entries claim with the same tool."""
    claimed: dict[tuple[str, str], str] = {}
    seen: set[str] = set()
    for kind in ("contacts", "no_contact"):
        for i, entry in enumerate(getattr(p, kind)):
            if entry is None:
                continue
            path = (kind, i)
            twice = kind == "contacts" and entry.name in seen  # reported as such
            seen.add(getattr(entry, "name", ""))
            for k, s in enumerate(entry.surface):
                here = (*path, "surface", k)
                if "." in s or s not in p.bodies:
                    yield from _boundary(p, s, here, body_too=True)
                elif len(entry.surface) > 1:
                    yield Finding(here, f"{s!r} alone is its whole outline; leave out the rest of the list")
                other = claimed.setdefault((s, entry.against), f"{kind}.{i}")
                if other != f"{kind}.{i}" and not twice:
                    yield Finding(
                        here,
                        f"{s!r} is against {entry.against!r} in {other} already: it is ambiguous which of the two applies; "
                        "name it in one of them",
                    )
            if kind == "no_contact" and entry.against == SYMMETRY and SYMMETRY not in p.tools:
                parts = [s for s in entry.surface if s not in p.bodies]
                if parts:
                    message = f"lines of symmetry and the axis are for whole bodies: write {parts[0].partition('.')[0]!r}"
                    yield Finding((*path, "surface"), message)
            elif entry.against not in p.tools:
                yield Finding((*path, "against"), f"unknown tool {entry.against!r}{suggest(entry.against, p.tools)}")
    if p.contact_geometry == "reference":
        yield from _corners(p)


def _corners(p: Any) -> Iterator[Finding]:
    """An outline has corners, at which the undeformed surface has no normal to measure a gap along."""
    for i, c in enumerate(p.contacts):
        if c is not None and any("." not in s for s in c.surface):
            yield Finding(
                ("contacts", i, "surface"),
                f"'contact_geometry: reference' measures gaps along the normal of the undeformed surface, which the outline of "
                f"{c.surface[0]!r} does not have at its corners; name the boundaries that tool {c.against!r} touches",
            )
            return


def _contacts(p: Any) -> Iterator[Finding]:
    seen: set[str] = set()
    for i, c in enumerate(p.contacts):
        if c is None:
            continue
        path = ("contacts", i)
        if c.name in seen:
            yield Finding(path, f"contact {c.name!r} appears twice; keep one")
        seen.add(c.name)
        bodies = {s.partition(".")[0] for s in c.surface}
        rule: Any = DOORS["integration rule"].find(c.integration)
        if not rule.quadratic_edges:
            for name in bodies:
                element = element_name(p, name) if p.bodies.get(name) is not None else ""
                if element and DOORS["element"].find(element).quadratic:  # type: ignore[attr-defined]
                    yield Finding(
                        (*path, "integration"),
                        f"{c.integration!r} is a rule of straight edges and {element} has quadratic ones; use 'nodal'",
                    )
        # More multipliers than surface nodes that they press on: the constraints depend on one another, and the matrix is
        # singular.
        if c.enforcement.has_multipliers and not rule.determined:
            yield Finding(
                (*path, "integration"),
                f"{c.integration!r} has more points than the surface has nodes, so that exact multipliers are not unique; "
                "use 'nodal', or 'enforcement: penalty' or 'augmented'",
            )
        if len(bodies) > 1 and all(b in p.bodies for b in bodies):
            yield Finding((*path, "surface"), "one contact surface belongs to one body; write two contacts")


def _friction(p: Any) -> Iterator[Finding]:
    """Laws that need what the body does not have: a shear yield stress."""

    def needs(law: Any, c: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
        body = p.bodies.get(c.surface[0].partition(".")[0]) if c is not None else None
        if body is not None and law is not None and law.asks_for_k and not body.material.plastic:
            message = (
                f"the {body.material.type} body of {c.surface[0]!r} has no shear yield stress; give 'k', or use coulomb"
            )
            yield Finding(path, message)

    every = (*p.contacts, *p.body_contacts)
    for kind in ("contacts", "body_contacts"):
        for i, c in enumerate(getattr(p, kind)):
            if c is not None and c.friction is not None:
                yield from needs(c.friction, c, (kind, i, "friction"))
    if p.friction is not None:
        found = [f for c in every if c is not None and c.friction is None for f in needs(p.friction, c, ("friction",))]
        # One law of the whole problem is one mistake, however many contacts it reaches.
        yield from found[:1]
    for i, step in enumerate(p.steps):
        for name, law in step.friction.items() if step is not None else ():
            c = next((c for c in every if c is not None and c.name == name), None)
            yield from needs(law, c, ("steps", i, "friction", name))


def _ties(p: Any) -> Iterator[Finding]:
    for i, tie in enumerate(p.ties):
        if tie is None:
            continue
        for key in ("slave", "master"):
            yield from _boundary(p, getattr(tie, key), ("ties", i, key))
        if tie.slave.partition(".")[0] == tie.master.partition(".")[0]:
            yield Finding(("ties", i, "master"), "a tie joins two bodies; both sides are of the same one")


def _supports(p: Any, owner: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
    """Boundaries and bodies named by ``fixed``, ``loads`` and ``body_force`` of the problem or of a step."""
    for kind in ("fixed", "loads"):
        for key in getattr(owner, kind):
            yield from _boundary(p, key, (*path, kind, key), at_key=True)
    for key in owner.body_force:
        if key not in p.bodies:
            yield Finding((*path, "body_force", key), f"unknown body {key!r}{suggest(key, p.bodies)}", at_key=True)


def _removed(p: Any, path: tuple[str | int, ...], step: Any) -> Iterator[Finding]:
    """What a step asks of tools that it, or an earlier one, removes."""
    by = next((s.name for s in p.steps[: int(path[1]) + 1] if s is not None and s.remove_tools), None)
    if by is None:
        return
    gone = f"step {by!r} removes all tools, which are gone from then on"
    if not p.tools:
        yield Finding((*path, "remove_tools"), "there are no tools", at_key=True)
    for kind in ("move", "by", "velocity", "crank", "push", "control"):
        for key in getattr(step, kind):
            if key in p.tools:
                yield Finding((*path, kind, key), f"{gone}: tool {key!r} does nothing then; leave it out", at_key=True)
    for key in step.friction:
        yield Finding((*path, "friction", key), f"{gone}: {key!r} does nothing then; leave it out", at_key=True)
    for kind in ("force", "travel", "contact", "energy") if step.until is not None else ():
        for key in getattr(step.until, kind):
            yield Finding((*path, "until", kind, key), f"{gone}: {key!r} cannot end a step; leave it out", at_key=True)


def _step(p: Any, path: tuple[str | int, ...], step: Any) -> Iterator[Finding]:
    given: dict[tuple[str, str], str] = {}
    for kind in ("move", "by", "velocity", "push"):
        for key, motion in getattr(step, kind).items():
            here = (*path, kind, key)
            # 'by' moves boundaries too; a name with a dot is one, one without a dot is a tool that is misspelt.
            if kind == "by" and key not in p.tools and "." in key:
                yield from _boundary_moved(p, step, here, motion)
                continue
            if key not in p.tools:
                yield Finding(here, f"unknown tool {key!r}{suggest(key, p.tools)}", at_key=True)
                continue
            for freedom in motions_in(p.space):
                name = force_along(p.space, freedom) if kind == "push" else freedom
                if getattr(motion, name, None) is None:
                    continue
                if p.space == "axisymmetric" and name != "y":
                    yield Finding((*here, name), "in axisymmetry a tool moves along y only", at_key=True)
                if (
                    kind == "push"
                    and getattr(getattr(dict(p.tools).get(key), "spring", None), freedom, None) is not None
                ):
                    message = (
                        f"{freedom} of tool {key!r} is mounted on a spring; 'move' its mount instead (by force over "
                        "stiffness for a preload)"
                    )
                    yield Finding((*here, name), message, at_key=True)
                if (other := given.setdefault((key, freedom), kind)) != kind:
                    message = f"{freedom} of tool {key!r} is given by '{other}' and by '{kind}'; keep one"
                    yield Finding((*here, name), message, at_key=True)
    for key, drive in step.crank.items():
        axis = None if drive is None else next(a for a in "xyz" if getattr(drive, a) is not None)
        if axis is not None and (rival := given.get((key, axis))) is not None:
            message = f"{axis} of tool {key!r} is given by '{rival}' and by 'crank'; keep one"
            yield Finding((*path, "crank", key), message, at_key=True)
    yield from crank.findings(p, step, path)
    for key in step.feed:
        yield from _boundary(p, key, (*path, "feed", key), at_key=True)
    yield from feed.findings(p, step, path)
    yield from _supports(p, step, path)
    yield from _control(p, step, (*path, "control"))
    contacts = [c.name for c in (*p.contacts, *p.body_contacts) if c is not None]
    for key in step.friction:
        if key not in contacts and None not in p.contacts and contacts:
            message = f"unknown contact {key!r}{suggest(key, contacts)}"
            yield Finding((*path, "friction", key), message, at_key=True)
    yield from until.findings(p, step, path)
    yield from _removed(p, path, step)


def _control(p: Any, step: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
    """Displacement control: one component of a pushed tool, by a way in one number; and loads that are numbers."""
    known = motions_in(p.space)
    led = [(t, name) for t, m in step.control.items() for name in known if getattr(m, name, None) is not None]
    if not step.control:
        return
    if len(led) != 1:
        words = f"displacement control needs the way of one component of one tool: one of {', '.join(known)}"
        yield Finding(path, words, at_key=True)
        return
    ((tool, name),) = led
    here, way = (*path, tool, name), getattr(step.control[tool], name)
    if tool not in p.tools:
        yield Finding((*path, tool), f"unknown tool {tool!r}{suggest(tool, p.tools)}", at_key=True)
        return
    # The way leads and the factor of the loads follows: time has no part in such a step, and tables none to follow.
    if isinstance(way, tuple) or way == 0:
        yield Finding(here, "give the way from where the tool is at the start of the step, as a number other than 0")
    force = getattr(step.push.get(tool), force_along(p.space, name), None)
    # A force of zero times any factor is zero: it could not lead the tool anywhere.
    if force is None or force == 0:
        message = (
            f"{name} of tool {tool!r} leads, so 'push' has to drive it: give its force, not 0, or move it 'by' the way"
        )
        yield Finding(here, message, at_key=True)
    for kind in ("push", "loads", "body_force"):
        for key, entry in getattr(step, kind).items():
            values = entry if isinstance(entry, tuple) else (vars(entry).values() if entry is not None else ())
            flat = [
                v for value in values for v in (value if kind == "loads" and isinstance(value, tuple) else (value,))
            ]
            if any(isinstance(v, tuple) for v in flat):
                message = (
                    f"{kind} of {key!r} is a table over time; with 'control' the loads follow the tool: give numbers"
                )
                yield Finding((*path[:-1], kind, key), message, at_key=True)


def _boundary_moved(p: Any, step: Any, path: tuple[str | int, ...], motion: Any) -> Iterator[Finding]:
    """A boundary under ``by``: a support, so that the step cannot prescribe it otherwise too."""
    name = str(path[-1])
    yield from _boundary(p, name, path, at_key=True)
    if motion is None:
        return
    for turn in ("rx", "ry", "rz"):
        if getattr(motion, turn) is not None:
            yield Finding((*path, turn), f"{name!r} is a boundary, which has no rotation; give x or y", at_key=True)
    support = step.fixed.get(name)
    for axis in ("x", "y", "z"):
        if getattr(motion, axis, None) is not None and getattr(support, axis, None) is not None:
            yield Finding((*path, axis), f"{axis} of {name!r} is given by 'fixed' and by 'by'; keep one", at_key=True)
