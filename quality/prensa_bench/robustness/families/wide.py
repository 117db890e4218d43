"""The ends of the ranges of numbers: stiff and soft, rough and smooth, long elements, other units."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import prensa as pr
from prensa_bench.robustness.drawn import Drawn, Placed, Twin, circle, friction, logarithmic, number, plane, stamp

UNITS = {
    "mm-N": (1.0, 1.0),
    "m-N": (1e-3, 1.0),
    "m-kN": (1e-3, 1e-3),
    "cm-N": (0.1, 1.0),
}  # of a millimetre, of a newton
BELOW_EULER = 0.5  # shortening of a body over that at which a column of its size with a free head buckles
SAME_UNITS = 0.02  # allowed difference of the last forces in other units, of the largest


def problem(rng: np.random.Generator) -> Drawn:
    """Aspect ratios of elements to 20, E 1 to 1e6 MPa, μ 1e-6 to 2, in other units beside millimetres and newtons."""
    units = str(rng.choice(list(UNITS)))
    aspect, tall = logarithmic(rng, 1.0, 20.0), rng.random() < 0.5
    numbers: dict[str, Any] = {
        "E": logarithmic(rng, 1.0, 1e6), "nu": number(rng, 0.0, 0.499), "mu": logarithmic(rng, 1e-6, 2.0),
        "plastic": rng.random() < 0.4, "nx": int(rng.integers(6, 15)), "ny": int(rng.integers(3, 9)),
        "element": str(rng.choice(["q4_fbar", "q4_fbar", "q4_enhanced", "q8"])),
        "shape": str(rng.choice(["plane", "stamp", "circle"])),
        "axisymmetric": rng.random() < 0.3, "aspect": 1 / aspect if tall else aspect, "depth": number(rng, 0.002, 0.08),
        "way": number(rng, -2.0, 2.0),
    }  # fmt: skip
    p, tool = _in_units(units, **numbers)
    twins = [Twin(replace(_in_units("mm-N", **numbers)[0], name="the same in mm and N"), UNITS[units][1], SAME_UNITS)]
    L, F = UNITS[units]
    E, name = numbers["E"] * F / L**2, p.contacts[0].name
    strength = 6e-3 * E if numbers["plastic"] else 0.0
    kind = ", ".join([
        units, f"E {numbers['E']:.2g} MPa", f"nu {numbers['nu']:.2g}", f"mu {numbers['mu']:.1g}",
        f"aspect {numbers['aspect']:.2g}", numbers["shape"], "plastic" if strength else "elastic", numbers["element"], p.space,
    ])  # fmt: skip
    return Drawn(
        (p,), {"tool": tool}, {name: numbers["mu"]}, E, numbers["nu"], strength,
        twins=tuple(twins if units != "mm-N" else ()), limit=20.0, kind=kind,
    )  # fmt: skip


def _in_units(
    units: str, E: float, nu: float, mu: float, plastic: bool, nx: int, ny: int, element: str, shape: str,
    axisymmetric: bool, aspect: float, depth: float, way: float,
) -> tuple[pr.Problem, Placed]:  # fmt: skip
    """A block of elements of height 1 mm and a given aspect ratio under a tool: press, slide (in the plane), lift."""
    L, F = UNITS[units]
    if element == "q8":
        nx, ny = nx // 2, max(ny // 2, 2)
    E, width, height = E * F / L**2, nx * aspect * L, ny * L
    if axisymmetric and element == "q8":
        element = "q4_enhanced"
    material: Any = pr.J2(E, nu, pr.Linear(2e-3 * E, 0.01 * E)) if plastic else pr.Elastic(E, nu)
    left = 0.0 if axisymmetric else -width / 2
    middle = (0.0, height)
    if shape == "plane":
        tool = plane(middle, (0.0, -1.0))
    elif shape == "stamp":
        wide = 0.5 * width * (2 if axisymmetric else 1)
        tool = stamp(middle, wide, min(1.5 * aspect * L, 0.4 * wide))
    else:
        R = 1.5 * max(width, 2 * height)
        tool = circle((0.0, height + R), R)
    down = min(depth * height, 0.05 * width)
    if not axisymmetric:  # a tall one whose head a narrow tool does not hold upright buckles at π²/12 (width / 2 height)² (Euler)
        down = min(down, BELOW_EULER * np.pi**2 / 12 * (0.5 * width / height) ** 2 * height)
    steps = [pr.Step("press", move={"tool": pr.Motion(y=-down)})]
    if not axisymmetric:
        steps.append(pr.Step("slide", move={"tool": pr.Motion(x=way * down)}))
    steps.append(pr.Step("lift", move={"tool": pr.Motion(y=-0.98 * down)}))
    sides = ("block.right",) if axisymmetric else ("block.right", "block.left")
    surface = ("block.top", *(sides if shape == "plane" else ()))
    problem = pr.Problem(
        "wide", space="axisymmetric" if axisymmetric else "plane strain", units=pr.Units(*units.split("-")),
        thickness=1.0 if axisymmetric else L,
        bodies={"block": pr.Body(pr.Rectangle((width, height), (nx, ny), (left, 0.0)), material, element)},
        tools={"tool": tool.tool}, contacts=(pr.Contact(surface, "tool"),), friction=friction(mu),
        fixed={"block.bottom": "xy"}, steps=tuple(steps),
    )  # fmt: skip
    return problem, tool
