"""Dimension of a problem: what goes together with it, and what cannot be done in space yet; one table, refused in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from prensa.model.names import Finding
from prensa.registry import DOORS

BRICKS = ("box", "extruded", "revolved", "bricks", "tetrahedra")
"""Meshes of bodies in space."""
NOT_IN_SPACE = {
    "problem": ("no_contact", "ties", "loads", "body_force", "stabilise", "remesh", "start"),
    "tools": ("spring",),
    "steps": ("crank", "feed", "push", "loads", "body_force", "control", "stabilise", "until", "remove_tools"),
}
"""Keys that mean nothing in space yet, where they are given."""
_NOTHING = (None, False, "off")


def findings(p: Any) -> Iterator[Finding]:
    """What of a problem does not belong to the dimension of its space."""
    if p.space is None:
        return
    solid = p.space == "solid"
    yield from _bodies(p, 3 if solid else 2)
    yield from _tools(p, 3 if solid else 2)
    owners: list[tuple[tuple[str | int, ...], Any]] = [((), p)]
    owners += [(("steps", i), step) for i, step in enumerate(p.steps) if step is not None]
    for path, owner in owners:
        for kind in ("fixed", "move", "by", "velocity"):
            for name, given in getattr(owner, kind, {}).items():
                axis = "rz" if solid else "z"
                if getattr(given, axis, None) is not None:
                    words = "tools do not turn in space yet" if solid else _no_z(p, kind)
                    yield Finding((*path, kind, name, axis), words, at_key=True)
    if not solid:
        return
    for path, owner in owners:
        yield from _not_yet(owner, "steps" if path else "problem", path)
    if p.thickness not in (None, 1.0):
        yield Finding(("thickness",), "bodies in space have no thickness; leave it out", at_key=True)
    yield from _contacts(p)


def _no_z(p: Any, kind: str) -> str:
    """What to write in the plane instead."""
    remedy = "write 'x', 'y', 'xy'" if kind == "fixed" else "write 'x', 'y' or 'rz'"
    about = " In axisymmetry x is the radius and y the axis" if p.space == "axisymmetric" else ""
    return f"'z' is an axis of 'space: solid'; {remedy}.{about}"


def _not_yet(owner: Any, kind: str, path: tuple[str | int, ...]) -> Iterator[Finding]:
    for key in NOT_IN_SPACE[kind]:
        given = getattr(owner, key, None)
        if not (given in _NOTHING or given == () or given == {}):
            yield Finding((*path, key), f"{key!r} is not there in space yet; leave it out", at_key=True)


def _bodies(p: Any, dimension: int) -> Iterator[Finding]:
    for name, body in p.bodies.items():
        if body is None:
            continue
        if (body.mesh.type in BRICKS) != (dimension == 3):
            kinds = ", ".join(map(repr, BRICKS))
            words = f"bodies in space have a mesh of type {kinds}" if dimension == 3 else "bricks need 'space: solid'"
            yield Finding(("bodies", name, "mesh"), words)
        if body.element is not None:
            element: Any = DOORS["element"].find(body.element)
            if element.layout.dimension != dimension:
                words = "of the plane; use 'h8_fbar'" if dimension == 3 else "of 'space: solid'"
                yield Finding(("bodies", name, "element"), f"{body.element!r} is an element {words}")
            elif dimension == 3 and (body.element == "t10") != (body.mesh.type == "tetrahedra"):
                words = "has tetrahedra; use 't10'" if body.element != "t10" else "has bricks; use 'h8_fbar'"
                yield Finding(("bodies", name, "element"), f"{body.element!r} does not fit the mesh, which {words}")


def _tools(p: Any, dimension: int) -> Iterator[Finding]:
    for name, tool in p.tools.items():
        if tool is None:
            continue
        if dimension not in tool.dimensions:
            words = "has no shape in space yet" if dimension == 3 else "is a tool of 'space: solid'"
            yield Finding(("tools", name), f"{tool.type!r} {words}")
            continue
        for key in ("at", tool.direction_key):
            given = getattr(tool, key, None) if key else None
            if given is not None and len(given) != dimension:
                yield Finding(("tools", name, key), f"{key} has {len(given)} components; {p.space} has {dimension}")
        if dimension == 3:
            yield from _not_yet(tool, "tools", ("tools", name))
            placed = tool.touching or tool.above or tool.below
            if tool.direction_key and getattr(tool, tool.direction_key) is None and not placed:
                yield Finding(("tools", name), f"give {tool.direction_key!r}: where the face looks in space")


def _contacts(p: Any) -> Iterator[Finding]:
    laws: list[tuple[tuple[str | int, ...], Any]] = [(("friction",), p.friction)]
    for i, c in enumerate(p.contacts):
        if c is None:
            continue
        laws.append((("contacts", i, "friction"), c.friction))
        if c.enforcement.has_multipliers:
            yield Finding(("contacts", i, "enforcement"), "in space the enforcement is 'penalty' or 'augmented'")
        if c.integration != "nodal":
            yield Finding(("contacts", i, "integration"), "in space contact is integrated by the rule 'nodal'")
        if any("." not in s for s in c.surface):
            yield Finding(("contacts", i, "surface"), "in space name the sides of the body that the tool may touch")
    laws += [
        (("steps", i, "friction", name), law) for i, s in enumerate(p.steps) if s for name, law in s.friction.items()
    ]
    for path, law in laws:
        if law is not None and not law.proportional:
            yield Finding(path, "in space friction is proportional to the pressure")
