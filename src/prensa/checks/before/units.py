"""Lengths, thicknesses and turns that are likely in another unit than the rest of the description."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from prensa.checks.before.file_units import OTHER_SIZE
from prensa.checks.before.tool_sizes import smallest_element
from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding
from prensa.model.feed import ends_early
from prensa.model.fields import motions_in
from prensa.model.units import factor
from prensa.system.system import System

SMALLEST_BODY = 5e-5
"""Size (m) below which a body is likely in another unit: that of foils."""
LARGEST_BODY = 50.0
"""The same above which it is: that of the plates of ships."""
SHEET = 5.0
"""Length of a sheet in the plane over its thickness, from which both are not those of a square bar."""
THIN = 0.02
"""Thickness out of the plane, over the least extent in it, below which plane strain is unlikely to be meant."""
THICK_SHEET = 2.0
"""Thickness of a sheet in plane stress, over the largest extent in the plane, that no sheet has."""
ROUND_TURN = 2.0
"""Radians from which a multiple of a half is likely a number of degrees …"""
PAST_BODIES = 3.0
"""… if the surface of a round tool goes that far by it, over the size of the bodies."""


def lengths(system: System) -> Iterator[Finding]:
    """Lengths that belong to another unit than the rest, or angles to degrees."""
    unit, strange = system.problem.units.length, False
    for name, mesh in system.meshes.items():
        size = float(mesh.extent.max())
        metre = factor(f"1 {unit}", "m", "N", (0, 1))
        # Who writes a case in micrometres means small bodies: what is less than one of a unit that small is still no body.
        if size * metre > LARGEST_BODY or (
            size * metre < SMALLEST_BODY and not (metre < SMALLEST_BODY and size >= 1.0)
        ):
            strange = True
            yield Finding(f"bodies.{name}.mesh", f"the body measures {size:.4g} {unit}; is the unit right?")
    yield from _long_bodies(system)
    if strange:
        return  # what else is out of proportion is so beside that body
    size, next_unit = system.length, factor("1 m", "mm", "N", (0, 1))  # as many micrometres are in a millimetre
    for name, tool in system.problem.tools.items():
        sizes = ("radius", "width", "outer", "fillet")
        for key in (*sizes, *(f"section.{k}" for k in sizes if hasattr(tool, "section"))):
            of, _, own = key.rpartition(".")
            given = getattr(getattr(tool, of) if of else tool, own, None)
            values = given if isinstance(given, tuple) else (given,)  # a fillet of each corner
            least = size / 500 if key != tool.face()[1] else max(size / 500, _fits_nowhere(system, name))
            value = next((v for v in values if v and not least <= v <= 500 * size), None)
            if value is not None and (value > size or _fits(system, name, key, next_unit * value)):
                yield Finding(
                    f"tools.{name}.{key}",
                    f"{value:.4g} {unit} against bodies of {size:.4g} {unit}; are both in the same unit?",
                )
    for i, step in enumerate(system.problem.steps):
        # A step that ends early gives a travel that need not be reached.
        for kind in ("move", "by", "velocity", "control") if not ends_early(step) else ():
            for name, motion in getattr(step, kind).items():
                for key in motions_in(system.problem.space):
                    value = getattr(motion, key)
                    most = (
                        max((abs(v) for _, v in value), default=0.0) if isinstance(value, tuple) else abs(value or 0.0)
                    )
                    path = f"steps.{i}.{kind}.{name}.{key}"
                    # Degrees are mostly written as multiples of five, and ten radians are more than one and a half turns.
                    if key[0] == "r" and most >= 10 and most % 5 == 0:
                        yield Finding(path, f"a turn of {most:g} radians; for degrees write '{most:g} deg'")
                    elif key[0] != "r" and most > 20 * size:
                        yield Finding(
                            path, f"a travel of {most:.4g} {unit} past bodies of {size:.4g} {unit}; is the unit right?"
                        )


def _fits(system: System, tool: str, key: str, value: float) -> bool:
    """Whether a tool can have a size: one that is sharp on purpose has no fillet of the next larger unit."""
    *of, own = key.split(".")
    made = system.problem.tools[tool]
    try:
        sized = replace(getattr(made, of[0]) if of else made, **{own: value})
        sized.shape(sized.looks(np.eye(2 if of else system.dofs.dimension)[1]), 0.0)
    except ValueError:
        return False
    return True


def _fits_nowhere(system: System, tool: str) -> float:
    """Size of a tool below which it is less than any element that it meets, and far below the bodies."""
    elements = (smallest_element(system, s) for s in system.tool_contacts if s.against == tool)
    return min(system.length / OTHER_SIZE, min(elements, default=0.0))


def _long_bodies(system: System) -> Iterator[Finding]:
    """A thickness out of the plane that is that of a sheet in it, or next to nothing, where strain out of the plane is zero.

    A slice of one millimetre, centimetre, metre, inch or foot is the force per length of a long body.
    """
    p, unit = system.problem, system.problem.units.length
    slices = [factor(f"1 {u}", unit, "N", (0, 1)) for u in ("mm", "cm", "m", "in", "ft")] + [1.0]
    if p.space != "plane strain" or any(abs(p.thickness / s - 1.0) < NO_DIFFERENCE for s in slices):
        return
    extents = {name: mesh.extent for name, mesh in system.meshes.items()}
    for name, extent in extents.items():
        if abs(extent.min() / p.thickness - 1.0) < NO_DIFFERENCE and extent.max() > SHEET * p.thickness:
            yield Finding(
                "thickness",
                f"{p.thickness:.4g} {unit} is the thickness of body {name!r} in the plane: 'thickness' is the length out of "
                "it, the width of a sheet, which plane strain takes to be large; give that, or leave it out for forces per "
                "length",
            )
            return
    least = min(float(extent.min()) for extent in extents.values())
    if p.thickness < THIN * least:
        yield Finding(
            "thickness",
            f"{p.thickness:.4g} {unit} out of the plane, of bodies that measure {least:.4g} {unit} or more in it: plane strain "
            "is for long bodies; is the unit right? For a thin sheet loaded in its plane use 'space: plane stress'",
        )


def thick_sheets(system: System) -> Iterator[Finding]:
    """Plane stress, of sheets, with a thickness that none of the bodies has in the plane; of 1 forces are per thickness."""
    p = system.problem
    largest = max(float(mesh.extent.max()) for mesh in system.meshes.values())
    if p.space == "plane stress" and p.thickness != 1.0 and p.thickness > THICK_SHEET * largest:
        yield Finding(
            "thickness",
            f"{p.thickness:.4g} {p.units.length} out of the plane, of bodies that measure {largest:.4g} {p.units.length} at most "
            "in it: plane stress is for thin sheets; is the unit right? Long bodies are in 'space: plane strain'",
        )


def turns(system: System) -> Iterator[Finding]:
    """Turns by a round number of radians that are likely degrees, of tools where they start and in steps."""
    size = system.length
    for name, tool in system.problem.tools.items():
        for angle in np.atleast_1d(getattr(tool, "turn", ())).tolist():
            if abs(angle) > 2.0 * np.pi:
                yield Finding(f"tools.{name}.turn", f"a turn of {angle:g} radians; for degrees write '{angle:g} deg'")
                break
    for i, step in enumerate(system.problem.steps):
        for kind in ("move", "by", "control"):
            for name, motion in getattr(step, kind).items():
                turn = motion.rz
                if isinstance(turn, tuple):
                    turn = max((v for _, v in turn), key=abs)
                if turn is None or abs(turn) < ROUND_TURN or turn % 0.5 != 0.0 or (abs(turn) >= 10 and turn % 5 == 0):
                    continue  # the last are for another check
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
