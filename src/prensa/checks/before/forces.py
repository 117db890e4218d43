"""Forces beyond what bodies can carry, and springs stiffer than any machine."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity
from prensa.materials.flow_curve import stress_at
from prensa.materials.material import Material
from prensa.model.fields import motions_in
from prensa.model.press import drives
from prensa.system.system import System

CRUSHED = 50.0
"""Mean pressure of a push over the flow stress at a strain of 1, more than any die withstands."""
STIFFEST_MOUNT = 1e6
"""Stiffness of a spring over that of the bodies, beyond which its tool is as good as held."""
MOUNT_LOST = 1e8
"""The same, beyond which round-off of the spring's length is a force above the tolerance."""


def pushes(system: System) -> Iterator[Finding]:
    """Forces under which no body could stand: of another unit than they are meant in."""
    p = system.problem
    for i, step in enumerate(p.steps):
        for name, push in step.push.items():
            for axis, key in enumerate(motions_in(p.space)[: system.dofs.dimension]):
                value = getattr(push, key)
                most = max(abs(v) for _, v in value) if isinstance(value, tuple) else abs(value or 0.0)
                own = [s for s in system.surfaces if s.against == name]
                if not most or not own:
                    continue
                # The largest area that can carry the push, at the strength of metal that has flowed: what is beyond that by far
                # is another unit.
                carried = sum(_area(system, s, axis) * _strength(p.bodies[s.body].material) for s in own)
                if most > CRUSHED * carried > 0:  # along a flat surface nothing is pressed
                    yield Finding(
                        f"steps.{i}.push.{name}.{key}",
                        f"a push of {most:.4g} {p.units.force} is {most / carried:.2g} times what "
                        f"{' and '.join(dict.fromkeys(repr(s.body) for s in own))} can carry over the whole contact surface; "
                        "is the unit right?",
                    )


def weak(system: System) -> Iterator[Finding]:
    """Presses, pushes and forces to wait for under which no body would yield anywhere: of another unit than they are meant in."""
    for name, (path, force) in _largest_forces(system).items():
        own = [s for s in system.surfaces if s.against == name]
        sizes = [(_smallest(system, s.body), system.problem.bodies[s.body].material) for s in own]
        if not own or any(getattr(material, "flow", None) is None for _, material in sizes):
            continue
        yields = min(material.flow.proof() * size**2 for size, material in sizes)
        if 0.0 < 1000 * force < yields:  # of the next larger unit, kN for N, it would still not make the section yield
            unit = system.problem.units.force
            body = repr(own[0].body)
            yield Finding(
                path, f"{force:g} {unit} is {force / yields:.1g} of the force at which the smallest section of {body} yields, "
                f"{yields:.3g} {unit}: give its unit, such as '{force:g} kN'",
            )  # fmt: skip


def _largest_forces(system: System) -> dict[str, tuple[str, float]]:
    """Tool → place in the description and size of the largest force that it has: its press, pushes, what steps wait for.

    A tool that a step moves without waiting for a force presses as hard as it has to: then only its press counts.
    """
    p, found = system.problem, dict[str, tuple[str, float]]()
    for name, tool in p.tools.items():
        given = [
            (f"steps.{i}.{kind}.{name}", abs(v))
            for i, step in enumerate(p.steps)
            for kind, forces in (("push", step.push), ("until.force", step.until.force if step.until is not None else {}))
            for v in (getattr(forces.get(name), axis, None) for axis in "xyz")
            if isinstance(v, float | int)
        ]
        moved = any(drives(step, name, a) and not (step.until is not None and name in step.until.force)
                    for step in p.steps for a in "xyz" if not drives(step, name, a, ("push",)))  # fmt: skip
        if tool.press is not None and isinstance(tool.press.capacity, float | int):
            found[name] = f"tools.{name}.press", float(tool.press.capacity)
        elif given and not moved:
            found[name] = max(given, key=lambda g: g[1])
    return found


def _smallest(system: System, body: str) -> float:
    """Least extent of a body: in the plane the thickness of the problem counts too."""
    nodes = np.flatnonzero(system.has(body, np.arange(len(system.X))))
    extents = np.ptp(system.X[nodes], axis=0)
    if system.dofs.dimension == 2 and not system.axisymmetric:
        extents = np.append(extents, system.problem.thickness)
    return float(extents.min())


def _area(system: System, s: Surface, axis: int) -> float:
    """Area of a contact surface as seen along an axis."""
    if system.dofs.dimension == 3:
        return float(np.prod(np.delete(np.ptp(system.X[s.points.nodes], axis=0), axis)))
    across = 1 - axis
    low, high = (float(v) for v in (system.X[s.points.nodes, across].min(), system.X[s.points.nodes, across].max()))
    if system.axisymmetric and across == 0:
        return float(np.pi * (high**2 - low**2))
    return (high - low) * system.problem.thickness


def _strength(material: Material) -> float:
    """Flow stress at a plastic strain of 1, of an elastic body its modulus."""
    flow = getattr(material, "flow", None)
    return float(material.modulus if flow is None else stress_at(flow, np.ones(1), np.zeros(1))[0])


def mounts(system: System) -> Iterator[Finding]:
    """Springs so stiff that round-off of their lengths is a force."""
    p = system.problem
    stiffness = system.stiffness / system.length
    for name, tool in p.tools.items():
        for axis in motions_in(p.space):
            unit = stiffness if axis[0] != "r" else stiffness * system.length**2
            k = getattr(tool.spring, axis, None)
            if k is not None and k > STIFFEST_MOUNT * unit:
                yield Finding(
                    f"tools.{name}.spring.{axis}",
                    f"a stiffness of {k:.3g} is {k / unit:.1g} times that of the bodies, so that the tool is practically "
                    "fixed: is the unit right? A rigidly mounted tool needs no spring",
                    Severity.REFUSE if k > MOUNT_LOST * unit else Severity.WARN,
                )
