"""Tools across a line of symmetry, or the axis, that are not centred on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding
from prensa.model import problem as model
from prensa.model.names import SYMMETRY
from prensa.system.contact_surfaces import symmetry_planes
from prensa.system.system import System

OFF_LINE = 1e-3
"""Distance of a tool from the line that it crosses, over its half breadth, that is a rounded coordinate."""


def off_centre(system: System) -> Iterator[Finding]:
    """Tools, their own mirror images, that lie across a line of symmetry or the axis but are not centred on it.

    Those that are moved or pushed across it are on their way.
    """
    p = system.problem
    # A side held along its normal may be a wall as well as a line of symmetry: 'no_contact' against symmetry says which.
    not_lines = {s.partition(".")[0] for n in p.no_contact if n.against == SYMMETRY for s in n.surface}
    reported: set[str] = set()
    for s in system.tool_contacts:
        tool = system.tool_masters[s.against].tool
        own = p.tools.get(tool.name)
        if own is None or tool.name in reported or s.body in not_lines or _across(p, tool.name):
            continue
        # Neither a half-plane nor what encloses the body ends beside the line, so that it would overlap with its image.
        if tool.shape.half_space or tool.shape.cavity or not own.mirrored(True, tool.direction):
            continue
        half = max(float(np.abs(polygon[:, 0]).max()) for polygon in own.outline(NO_DIFFERENCE * system.length))
        lines = {plane.place for plane in symmetry_planes(p, s.body, system.meshes[s.body]) if plane.axis == 0}
        for at in sorted({0.0} if system.axisymmetric else lines):
            x = float(tool.at[0] + system.tool_masters[s.against].place(system.initial().u)[0])
            if OFF_LINE * half < abs(x - at) < (1.0 - OFF_LINE) * half:
                reported.add(tool.name)
                where = "the axis" if system.axisymmetric else f"the line of symmetry of {s.body!r}, x = {at:g},"
                yield Finding(
                    f"tools.{tool.name}.at" if own.at is not None else f"tools.{tool.name}",
                    f"it is centred at x = {x:.4g} and reaches across {where} by {half - abs(x - at):.4g}: with its mirror "
                    f"image there would be two tools that overlap; centre it there ('at: [{at:g}, …]'), or keep it on one side"
                    + ("" if system.axisymmetric else "; if this is not a line of symmetry, list "
                        f"'{{surface: {s.body}, against: symmetry}}' under 'no_contact'"),
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
