"""Summary by ``prensa check``: bodies, tools in their places, contacts, steps and the size of a case that would run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from prensa.model.problem import Case, Step
    from prensa.system.system import System


def lines_of(system: System) -> Iterator[str]:
    """Lines about a discretised problem: bodies, tools in their places, contacts, steps, size."""
    from prensa.mesh.quality import quality
    from prensa.model.metals import metals_of
    from prensa.model.schema import in_short

    p = system.problem
    geometry = "moved" if p.contact_geometry == "current" else "undeformed"
    yield f"{p.name}: {p.space}, {p.kinematics} deformation, contact on the {geometry} surface"
    yield f"units: {p.units.length}, {p.units.force}"
    metals = dict(metals_of(p))
    for name, body in p.bodies.items():
        mesh = system.meshes[name]
        ranges = zip("xyz", mesh.points.min(axis=0), mesh.points.max(axis=0))
        why = f" ({system.chosen[name]})" if name in system.chosen else ""
        yield f"body {name}: {len(mesh.cells)} elements {p.element_name(name)}{why}, {len(mesh.points)} nodes"
        material = replace(body.material, of=None) if name in metals else body.material
        yield f"  {', '.join(f'{c} {low:g} … {high:g}' for c, low, high in ranges)}; {in_short(material)}"
        if name in metals:
            yield f"  of {metals[name].words()}"
        yield f"  {quality(mesh).line()}"
        yield from (f"  sides: {note}" for note in mesh.notes)
    if p.start is not None:
        yield f"starts from the run in {p.start.run}"
    for tie in p.ties:
        yield f"tie: {tie.slave} follows {tie.master}"
    for tool in system.tools:
        place = f"reference point at ({', '.join(f'{v:.6g}' for v in tool.at)})"
        details = tool.description.details(tool.shape, tool.direction)
        if system.axisymmetric and math.isfinite(tool.shape.period) and abs(tool.at[0]) > 1e-9 * system.length:
            details += ", off the axis: a ring about it (a circle is a torus)"
        yield f"tool {tool.name}: {tool.description.type}, {place}{details}"
        yield from (f"  {note}" for note in tool.description.notes())
    for surface in system.surfaces:
        contact = surface.description
        law = contact.friction or p.friction
        friction = in_short(law) if law is not None else "none"
        rule = "" if contact.integration == "nodal" else f" ({contact.integration})"
        points = f"{len(surface.points)} candidate points{rule}"
        yield f"contact {surface.name}: {points}; friction {friction}; {contact.enforcement.type}"
    for number, step in enumerate(p.steps):
        yield f"step {step.name}: time {number} … {number + 1}{_lasting(step)}; {_actions(step)}"
    yield f"{system.ndof} unknowns; {'no increment' if p.space == 'solid' else 'nothing'} was solved"


def lines_of_whole(system: System, case: Case) -> Iterator[str]:
    """Lines about forces that are given for the part which is modelled, where mirror images show the rest of it, or may.

    Of a case that is refused there may be no whole.
    """
    from prensa.measures.units import force_unit, moment_unit
    from prensa.output.answer import shown
    from prensa.output.whole import images_of, part_of_whole, parts_along, shares_of

    shares = shares_of(system, case)
    images = {tool: images_of(case, tool, share.sides) for tool, share in shares.items()}
    for tool, share in shares.items():
        if share.alike > 1:
            yield f"tool {tool}: one of {share.alike} such tools of the whole, forces are those on each"
    keys = ("x", "y", "z", "mx", "my", "mz") if case.problem.space == "solid" else ("x", "y")
    for step in case.problem.steps:
        for kind, given in (("push", step.push), ("until.force", step.until.force if step.until else {})):
            for tool, of, key in ((tool, of, key) for tool, of in given.items() for key in keys):
                value = getattr(of, key, None)
                if isinstance(value, float) and value and (times := parts_along(images[tool], key)) > 1:
                    unit = moment_unit(case.problem) if "m" in key else force_unit(case.problem)
                    own, all_of_it = (shown(v, unit, both=False) or shown(v, unit) for v in (value, times * value))
                    yield f"step {step.name}: {kind} {key} of {tool} is {own} on what is modelled, {all_of_it} on the whole part"
    if words := part_of_whole(system, case):
        yield words


def _lasting(step: Step) -> str:
    """How long a step lasts, if it says so."""
    from prensa.model.seconds import stated

    seconds = stated(step)
    return "" if seconds is None else f", {seconds:g} s"


def _actions(step: Step) -> str:
    """What a step does, as it is written, and its increments."""
    from prensa.model.schema import in_short

    kinds = ("move", "by", "velocity", "crank", "feed", "push", "control", "fixed", "loads", "body_force", "friction", "until")
    acts = [f"{kind} {in_short(getattr(step, kind))}" for kind in kinds if getattr(step, kind)]
    many = "" if step.increments == 1 else "s"
    acts.append(f"{step.increments} increment{many}" if step.increments else "increments chosen on the way")
    return ", ".join(acts)


def summary_of(system: System) -> dict[str, Any]:
    """The same as data."""
    from prensa.model.metals import metals_of
    from prensa.model.schema import plain

    p = system.problem
    bodies = {
        name: {"elements": len(mesh.cells), "nodes": len(mesh.points), "element": p.element_name(name)}
        for name, mesh in system.meshes.items()
    }
    return {
        "name": p.name, "space": p.space, "kinematics": p.kinematics, "units": {"length": p.units.length, "force": p.units.force},
        "bodies": bodies, "metals": {name: plain(metal) for name, metal in metals_of(p)},
        "sides": {
            name: {"boundaries": [*mesh.edges], "points": [*mesh.corners], "notes": [*mesh.notes]}
            for name, mesh in system.meshes.items()
        },
        "tools": {t.name: {"type": t.description.type, "at": t.at} for t in system.tools},
        "drawings": {t.name: notes for t in system.tools if (notes := [*t.description.notes()])},
        "contacts": {s.name: {"points": len(s.points), "against": s.description.against} for s in system.surfaces},
        "steps": [{"name": s.name, "increments": s.increments} for s in p.steps],
        "unknowns": system.ndof,
    }  # fmt: skip
