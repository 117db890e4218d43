"""Dimension of a problem: what goes together with it; what there is not in space is the table of `prensa.model.not_in_space`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from prensa.model.names import Finding
from prensa.model.not_in_space import words_of
from prensa.registry import DOORS

BRICKS = ("box", "cylinder", "extruded", "revolved", "bricks", "tetrahedra")
"""Meshes of bodies in space, and of no others."""
OF_SPACE = {"fixed": "z", "spring": "z rx ry", "push": "z mx my mz", "move": "z rx ry"}
"""Axes that the plane has not, by the kind of the entry; ``by`` and ``velocity`` have those of ``move``."""


def findings(p: Any) -> Iterator[Finding]:
    """What of a problem does not belong to the dimension of its space."""
    if p.space is None:
        return
    solid = p.space == "solid"
    solids = [name for name, body in p.bodies.items() if body is not None and body.mesh.type in BRICKS]
    if solids and not solid:
        left_out = ", and where 'space' is left out a case is in plane strain; write 'space: solid'" * (p.space == "plane strain")
        yield from (Finding(("bodies", name, "mesh"), f"bricks need 'space: solid'{left_out}") for name in solids[:1])
        return  # what else belongs to space does so for the same reason
    yield from _bodies(p, 3 if solid else 2)
    yield from _tools(p, 3 if solid else 2)
    owners: list[tuple[tuple[str | int, ...], Any]] = [((), p)]
    owners += [(("steps", i), step) for i, step in enumerate(p.steps) if step is not None]
    for path, owner in owners:
        yield from _normals(p, owner, path, solid)
        yield from _loads(owner, path, p.space, 3 if solid else 2)
        for kind in ("fixed", "move", "by", "velocity", "feed", "push"):
            for name, given in getattr(owner, kind, {}).items():
                yield from _axes(p, (*path, kind, name), kind, given)
    for name, tool in p.tools.items():
        if tool is not None:
            yield from _axes(p, ("tools", name, "spring"), "spring", tool.spring)
    if not solid:
        return
    if p.remesh not in (None, False, "off"):
        yield Finding(("remesh",), words_of("remesh"), at_key=True)
    if p.thickness not in (None, 1.0):
        yield Finding(("thickness",), words_of("thickness"), at_key=True)
    yield from _contacts(p)


def _normals(p: Any, owner: Any, path: tuple[str | int, ...], solid: bool) -> Iterator[Finding]:
    """Sides held along their normals: in space, by the problem or its first step, in all steps."""
    first = p.steps[0] if p.steps else None
    always = {**p.fixed, **(first.fixed if first is not None else {})}
    for name, support in owner.fixed.items():
        if getattr(support, "normal", None) is not None and (path[1:] > (0,) or not solid):
            words = "a side is held along its normal in all steps: write it under 'fixed' of the problem"
            words = words if solid else "'normal' is for sides in 'space: solid'; hold the side along x or y"
            yield Finding((*path, "fixed", name), words)
        if path and getattr(support, "free", False) and getattr(always.get(name), "normal", None) is not None:
            yield Finding((*path, "fixed", name), f"{name!r} is held along its normal in all steps and cannot be released")


def _loads(owner: Any, path: tuple[str | int, ...], space: str, dimension: int) -> Iterator[Finding]:
    """Loads with other components than the space has."""
    for name, load in owner.loads.items():
        if dimension == 3 and getattr(load, "shear", None) is not None:
            yield Finding((*path, "loads", name, "shear"), words_of("shear"), at_key=True)
    given: list[tuple[tuple[str, ...], Any]] = [(("body_force", name), force) for name, force in owner.body_force.items()]
    given += [(("loads", name, "traction"), getattr(load, "traction", None)) for name, load in owner.loads.items()]
    for place, components in given:
        if components is not None and len(components) != dimension:
            what = place[0].replace("_", " ") if len(place) == 2 else place[-1]
            yield Finding((*path, *place), f"the {what} has {dimension} components in {space}, not {len(components)}")


def _axes(p: Any, path: tuple[str | int, ...], kind: str, given: Any) -> Iterator[Finding]:
    """Axes of an entry that the space of a problem has not, and what to write instead."""
    if p.space == "solid":
        if kind == "push" and getattr(given, "m", None) is not None:
            yield Finding((*path, "m"), words_of("moment"), at_key=True)
        return
    remedy = {"fixed": "write 'x', 'y', 'xy'", "push": "write 'x', 'y' or 'm'"}.get(kind, "write 'x', 'y' or 'rz'")
    about = " In axisymmetry x is the radius and y the axis" if p.space == "axisymmetric" else ""
    for key in OF_SPACE.get(kind, OF_SPACE["move"]).split():
        if getattr(given, key, None) is not None:
            is_of = "is an axis of" if key == "z" else "turns a tool about an axis of"
            yield Finding((*path, key), f"{key!r} {is_of} 'space: solid'; {remedy}.{about}", at_key=True)


def fits(p: Any, body: Any) -> bool:
    """Whether the mesh of a body has the dimension of a problem's space, as far as is known before it is read."""
    return body.mesh.type == "file" or (body.mesh.type in BRICKS) == (p.space == "solid")


def _bodies(p: Any, dimension: int) -> Iterator[Finding]:
    for name, body in p.bodies.items():
        if body is None:
            continue
        if not fits(p, body):
            kinds = ", ".join(map(repr, (*BRICKS, "file")))
            words = words_of("mesh", kinds=kinds, type=body.mesh.type)
            yield Finding(("bodies", name, "mesh"), words)
        if dimension == 2 and getattr(body.material, "rolling", None) is not None:
            words = (
                "is a direction in space; in the plane the sheet's normal is z, and 'angle' says where its rolling direction is; "
                "compute a section of a sheet in space, in one layer"
            )
            yield Finding(("bodies", name, "material", "rolling"), words)
        if dimension == 3 and not getattr(body.material, "in_space", True):
            words = words_of("material", type=type(body.material).__name__)
            yield Finding(("bodies", name, "material"), words)
        if body.element is not None:
            element: Any = DOORS["element"].find(body.element)
            if element.layout.dimension != dimension:
                words = f"{body.element!r} is an element of 'space: solid'"
                words = words_of("element", element=body.element) if dimension == 3 else words
                yield Finding(("bodies", name, "element"), words)
            elif dimension == 3 and body.mesh.type != "file" and (body.element == "t10") != (body.mesh.type == "tetrahedra"):
                words = "has tetrahedra; use 't10'" if body.element != "t10" else "has bricks; use 'h8_fbar'"
                yield Finding(("bodies", name, "element"), f"{body.element!r} does not fit the mesh, which {words}")


def _tools(p: Any, dimension: int) -> Iterator[Finding]:
    for name, tool in p.tools.items():
        if tool is None:
            continue
        if dimension not in tool.dimensions:
            words = words_of("tool", type=tool.type) if dimension == 3 else f"{tool.type!r} is a tool of 'space: solid'"
            yield Finding(("tools", name), words)
            continue
        for key in ("at", tool.direction_key):
            given = getattr(tool, key, None) if key else None
            if given is not None and len(given) != dimension:
                form = "[x, y, z]" if dimension == 3 else "[x, y]"
                words = f"{key} has {len(given)} components, and 'space: {p.space}' has {dimension}: write {form}"
                yield Finding(("tools", name, key), words)
        if dimension == 3:
            placed = tool.touching or tool.above or tool.below
            if tool.direction_key and getattr(tool, tool.direction_key) is None and not placed:
                yield Finding(("tools", name), f"give {tool.direction_key!r}: where the face looks in space")


def _contacts(p: Any) -> Iterator[Finding]:
    if getattr(p, "contacts_filled_in", False):  # a sketch of a case that could not be read is no problem
        entries = ", ".join(f"{{surface: {_side_for(p, c.surface[0], c.against)}, against: {c.against}}}" for c in p.contacts)
        yield Finding(("tools", p.contacts[0].against), words_of("no contacts", entries=entries), at_key=True)
        return
    for i, c in enumerate(p.contacts):
        if c is None:
            continue
        if c.integration != "nodal":
            yield Finding(("contacts", i, "integration"), words_of("integration"))
        whole = next((s for s in c.surface if "." not in s), None)
        if whole and not c.whole_in_space:
            words = words_of("whole body", body=whole, side=_side_for(p, whole, c.against), tool=c.against)
            yield Finding(("contacts", i, "surface"), words)


def _side_for(p: Any, body: str, tool: str) -> str:
    """A side of a body that a tool may be meant to touch: where it is placed, else the top."""
    touching = getattr(p.tools.get(tool), "touching", None)
    return str(touching) if str(touching).startswith(f"{body}.") else f"{body}.top"
