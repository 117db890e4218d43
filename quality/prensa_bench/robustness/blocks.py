"""Problems of one body under one tool, elastic and elastic-plastic, and their drawing.

A problem is drawn from tool shape, motion (press, press and slide, roll, turn, push by force, twist by moment, release), the
springs the tool hangs on, friction (none to sticking, hardening, softening, shear factor), mode, material, element, grading and
distortion of the mesh, steps that are often too large on purpose, and units. Elastic problems have any element, plastic ones
those that do not lock.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

import prensa as pr

SYSTEMS = {"mm-N": (1.0, 1.0), "m-N": (1e-3, 1.0), "inch-lbf": (1 / 25.4, 1 / 4.4482216152605)}
PRESSED_IN = 0.15  # to which a circle is pressed in, over the height of the body
ANY = ("q4", "q4_enhanced", "t3", "t6", "q8", "q8_full")
# by suite, out of and in plane stress; F-bar, the default, more often
SUITE_ELEMENTS = {
    "elastic": (("q4_fbar", "q4_fbar", *ANY), ANY),
    "plastic": (("q4_fbar", "q4_fbar", "q4_fbar", "q4_enhanced", "t6", "q8"), ("q4", "q4", "q4_enhanced", "t6", "q8")),
}


def draw(suite: str, seed: int, number: int) -> pr.Problem:
    """Problem *number* of a suite (``elastic`` or ``plastic``): the same for the same arguments."""
    rng = np.random.default_rng([seed, number, suite == "plastic"])
    system = str(rng.choice(list(SYSTEMS)))
    L, F = SYSTEMS[system]
    P = F / L**2
    space = str(rng.choice(["plane strain", "axisymmetric", "plane stress"], p=[0.45, 0.4, 0.15]))
    axi = space == "axisymmetric"
    plastic = suite == "plastic"
    kinematics = "finite" if plastic or rng.random() < 0.5 else "small"
    geometry = "reference" if kinematics == "small" and rng.random() < 0.5 else "current"
    E = 10 ** rng.uniform(3, 5.3) * P
    nu = float(rng.uniform(0.0, 0.45))
    s0 = float(rng.uniform(0.001, 0.005)) * E
    material = _material(rng, plastic, kinematics, E, nu, s0)
    width, height = float(rng.uniform(8, 20)), float(rng.uniform(5, 15))
    nx, ny = int(rng.integers(8, 17)), int(rng.integers(5, 13))
    origin = float(rng.choice([0.0, 2.0])) if axi else 0.0
    element: Any = str(rng.choice(SUITE_ELEMENTS[suite][space == "plane stress"]))
    if element[:2] in ("t6", "q8"):  # of twice the size: as many nodes
        nx, ny = nx // 2 + 1, ny // 2 + 1
    body = pr.Body(_mesh(rng, width * L, height * L, nx, ny, origin * L), material, element)
    tool, flat, most = _tool(rng, axi, width, height, width / nx, origin, L)
    depth = float(rng.uniform(0.02, most)) * height * L
    law = _friction(rng, depth, L, plastic, E)
    motion = _motion(rng, axi, tool, law)
    if motion != "twist" and rng.random() < 0.15:
        tool = replace(tool, spring=_springs(rng, axi, E, width * L))
    increments = int(rng.integers(2, 9)) if rng.random() < 0.7 else None
    strength, share = (s0, (0.05, 0.6)) if plastic else (E, (1e-4, 2e-3))
    moment = (
        float(rng.uniform(0.1, 0.5)) * _smallest_coefficient(law) * getattr(tool, "radius", 0.0)
    )  # per force, of what friction bears
    hollow = tool.type == "circle" and tool.concave
    area = _whole_top(width * L, axi) if hollow else _covered(tool, depth, origin * L, width * L, axi)
    steps = _steps(rng, motion, depth, width * L, area, strength, share, increments, axi, flat, moment, tool)
    rng.random()  # whether sides are listed was drawn here: kept, so that a seed means the problems that it meant
    # a cavity meets the body at its corner, which has no normal before it deforms
    geometry = "current" if hollow else geometry
    # a tool wider than the body stands over its side, or beside it: without contact there it would be metal inside it. On the
    # undeformed surface a side is parallel to what stands over it, and never meets it
    wide = flat or hollow or tool.type == "profile"
    sides = [
        "body.top",
        *(["body.right"] if wide and geometry == "current" else []),
        *(["body.left"] if plastic and origin else []),
    ]
    tied = motion in ("press and slide", "roll", "twist")
    left = pr.Fixed(x=0.0) if origin else "x"  # round a rigid mandrel
    fixed = {"body.bottom": "xy" if tied or rng.random() < 0.5 else "y", "body.left": left}
    shape = ("hollow " if hollow else "") + tool.type + (" on springs" if tool.spring else "")
    return pr.Problem(
        f"{number}: {shape}, {motion}, {_name(law)}, {kinematics}-{geometry}, {space}, {material.type}, {element}, {system}",
        space=space, kinematics=kinematics, contact_geometry=geometry, allow_large_strain=kinematics == "small",
        bodies={"body": body}, tools={"tool": tool},
        contacts=(pr.Contact(tuple(sides), "tool", friction=law),), fixed=fixed,
        steps=tuple(replace(s, duration=1.0) for s in steps),  # metals whose flow depends on the rate need one
        units=pr.Units(*system.split("-")),
    )  # fmt: skip


def _material(rng: np.random.Generator, plastic: bool, kinematics: str, E: float, nu: float, s0: float) -> Any:
    if plastic:
        return pr.J2(E, nu, _flow(rng, E, s0))
    return pr.NeoHooke(E, nu) if kinematics == "finite" and rng.random() < 0.5 else pr.Elastic(E, nu)


def _flow(rng: np.random.Generator, E: float, s0: float) -> Any:
    return [
        pr.Perfect(s0), pr.Linear(s0, 0.01 * E), pr.Ludwik(s0, 2 * s0, 0.3), pr.Swift(3 * s0, 0.01, 0.2),
        pr.Voce(s0, s0, 8.0), pr.HockettSherby(s0, 2 * s0, 3.0, 0.8), pr.JohnsonCook(s0, s0, 0.4, 0.02, 0.1),
        pr.FlowTable(((0.0, s0), (0.1, 1.6 * s0), (0.4, 2.2 * s0), (1.0, 2.6 * s0))),
    ][rng.integers(8)]  # fmt: skip


def _mesh(rng: np.random.Generator, width: float, height: float, nx: int, ny: int, x0: float) -> Any:
    kind = rng.integers(3)
    rectangle = pr.Rectangle(size=(width, height), n=(nx, ny), origin=(x0, 0.0))
    if kind == 1:
        grade = pr.Grade(x=(x0,), y=(height,), ratio=float(rng.uniform(2, 5)))
        return pr.Rectangle(size=(width, height), n=(nx, ny), origin=(x0, 0.0), grade=grade)
    if kind == 2:
        from prensa.mesh.generate import mesh_of

        mesh = mesh_of(rectangle)
        x = mesh.points.copy()
        inner = (
            (x[:, 0] > x0 + 1e-9 * width)
            & (x[:, 0] < x0 + width * (1 - 1e-9))
            & (x[:, 1] > 0)
            & (x[:, 1] < height * (1 - 1e-9))
        )
        x[inner] += rng.uniform(-0.2, 0.2, (int(inner.sum()), 2)) * np.array([width / nx, height / ny])
        return pr.Points(
            tuple(map(tuple, x.tolist())), tuple(map(tuple, mesh.cells.tolist())),
            {name: tuple(mesh.nodes(name).tolist()) for name in mesh.edges},
        )  # fmt: skip
    return rectangle


def _motion(rng: np.random.Generator, axi: bool, tool: Any, law: Any) -> str:
    """A motion that the problem has: friction must bear a moment, and a cylinder rolls."""
    options = ["press", "push", "release"]
    if not axi:
        options += ["press and slide", "turn"]
        if tool.type == "circle" and not tool.concave:
            options += ["roll", *(["twist"] if _smallest_coefficient(law) else [])]
    return str(rng.choice(options))


def _smallest_coefficient(law: Any) -> float:
    """The smallest coefficient that a Coulomb law can come to; 0 for others."""
    match getattr(law, "mu", None):
        case float() as mu:
            return mu
        case pr.MuExponential() as mu:
            return min(mu.mu0, mu.mu_inf)
        case pr.MuLinear() as mu:
            return mu.mu0
        case pr.MuTable() as mu:
            return min(mu.mu)
    return 0.0


def _springs(rng: np.random.Generator, axi: bool, E: float, width: float) -> Any:
    """A mount about as stiff as the body, along y, in rotation, or both."""
    c = float(10 ** rng.uniform(-0.5, 1.0)) * E
    if axi:
        return pr.Springs(y=c * width)
    which = rng.integers(3)
    return pr.Springs(y=c if which != 1 else None, rz=c * width**2 if which else None)


def _profile(rng: np.random.Generator, width: float, height: float, h: float, L: float) -> Any:
    """A wedge with a round nose, a bulged face, or two flats with a step between them."""
    w = float(rng.uniform(0.4, 0.9)) * width
    match rng.integers(3):
        case 0:
            slope = float(rng.uniform(0.2, 0.8))
            points: Any = ((-3 * width * L, 3 * width * slope * L), (0.0, 0.0), (3 * width * L, 3 * width * slope * L))
            fillet = float(rng.uniform(2.5, 6.0)) * h
        case 1:
            bulge, top = float(rng.uniform(0.05, 0.2)) * w, height * L
            points = ((-w * L, top), (-w * L, 0.0), pr.Arc(through=(0.0, -bulge * L), to=(w * L, 0.0)), (w * L, top))
            fillet = float(rng.uniform(1.0, 2.0)) * h
        case _:
            a, step = float(rng.uniform(0.3, 0.6)) * width, float(rng.uniform(0.02, 0.08)) * height
            b = a + step + h
            points = ((-3 * width * L, 0.0), (a * L, 0.0), (b * L, step * L), (3 * width * L, step * L))
            fillet = float(rng.uniform(1.0, 2.0)) * h
    return pr.Profile(points=points, fillet=fillet * L, touching="body.top")


def _polygon(rng: np.random.Generator, width: float, h: float, L: float) -> Any:
    """A trapezium on its short side, or a square on its tip."""
    a = float(rng.uniform(0.4, 1.0)) * width
    if rng.random() < 0.5:
        b = float(rng.uniform(0.1, 0.5)) * a
        points = ((-a, 0.0), (a, 0.0), (a + b, 2 * a), (-a - b, 2 * a))
        fillet = min(float(rng.uniform(1.0, 2.0)) * h, 0.4 * a)
    else:
        points = ((0.0, -2 * a), (2 * a, 0.0), (0.0, 2 * a), (-2 * a, 0.0))
        fillet = min(float(rng.uniform(2.5, 5.0)) * h, 1.2 * a)
    return pr.Polygon(points=tuple((x * L, y * L) for x, y in points), fillet=fillet * L, touching="body.top")


def _tool(
    rng: np.random.Generator, axi: bool, width: float, height: float, h: float, x0: float, L: float
) -> tuple[Any, bool, float]:
    """A tool, whether it is flat over the whole body, and the largest sensible depth as a share of the height."""
    kinds = ["plane", "circle", "stamp", "profile", "polygon", "hollow", *(["ring"] if axi else [])]
    kind = str(rng.choice(kinds))
    if kind == "plane":
        return pr.Plane(touching="body.top"), True, 0.3
    if kind == "circle":
        # over a bore, which a mandrel holds: it meets the edge from above, within 45° of the axis, however deep it goes
        over_bore = float(np.hypot(x0, x0 + PRESSED_IN * height)) if x0 else 0.0
        radius = max(float(rng.uniform(2.5 * h, 2 * width)), over_bore)
        return pr.Circle(radius=radius * L, touching="body.top"), False, PRESSED_IN
    if kind == "hollow":  # wide enough for the far corner of the body below
        radius = float(np.hypot(width + x0, rng.uniform(0.8, 3.0) * height))
        return pr.Circle(radius=radius * L, concave=True, touching="body.top"), False, 0.15
    if kind == "profile":
        return _profile(rng, width, height, h, L), False, 0.12
    if kind == "polygon":
        return _polygon(rng, width, h, L), False, 0.12
    if kind == "stamp":
        w = float(rng.uniform(0.4, 1.2)) * width
        w += 2 * x0 if w <= 2 * x0 else 0.0  # as narrow as a bore it would go into it and meet nothing
        fillet = float(rng.uniform(1.0, 2.0)) * h
        return pr.Stamp(width=w * L, fillet=min(fillet, 0.4 * w) * L, touching="body.top"), False, 0.1
    inner = float(rng.uniform(0.3, 0.5)) * width
    outer = inner + float(rng.uniform(0.25, 0.4)) * width
    return (
        pr.Ring(inner=inner * L, outer=outer * L, fillet=min(h, 0.3 * (outer - inner)) * L, touching="body.top"),
        False,
        0.1,
    )


def _friction(rng: np.random.Generator, depth: float, L: float, plastic: bool, E: float) -> Any:
    """None, weak, strong, sticking, hardening (exponential, linear, table), softening, shear factor.

    Softening stays slower than the body's own stiffness, (μ0 − μ∞) p/u0 < E/height with p ≈ E depth/height: beyond that
    the quasi-static answer jumps (stick-slip), and no increment, however small, follows a jump.
    """
    low, high = float(rng.uniform(0.05, 0.15)), float(rng.uniform(0.2, 0.5))
    slip = float(rng.uniform(0.05, 1.0)) * L
    match rng.integers(9):
        case 0:
            return None
        case 1:
            return pr.Coulomb(float(rng.uniform(0.02, 0.2)))
        case 2:
            return pr.Coulomb(float(rng.uniform(0.2, 0.6)))
        case 3:
            return pr.Coulomb(float(rng.uniform(1.0, 5.0)))
        case 4:
            return pr.Coulomb(pr.MuExponential(low, high, slip))
        case 5:
            return pr.Coulomb(pr.MuLinear(low, (high - low) / slip, high))
        case 6:
            return pr.Coulomb(pr.MuTable((0.0, 0.5 * slip, 2 * slip), (low, 0.8 * high, high)))
        case 7:
            return pr.Coulomb(pr.MuExponential(high, low, float(rng.uniform(1.5, 10.0)) * depth))
    return pr.Shear(float(rng.uniform(0.05, 1.0)), None if plastic else float(rng.uniform(1e-3, 1e-2)) * E)


def _name(law: Any) -> str:
    if law is None:
        return "frictionless"
    if law.type == "shear":
        return "shear factor"
    match law.mu:
        case pr.MuExponential() if law.mu.mu_inf < law.mu.mu0:
            return "softening"
        case float():
            return "sticking" if law.mu >= 1 else "Coulomb"
    return "hardening"


def _whole_top(width: float, axi: bool) -> float:
    return np.pi * width**2 if axi else width


def _covered(tool: Any, depth: float, x0: float, width: float, axi: bool) -> float:
    """Area of the top, from x0 on, that a tool covers once it has sunk by ``depth``: a narrow stamp bears less than a plane."""
    x = x0 + width * (np.arange(400) + 0.5) / 400
    below = 10 * width
    height = tool.shape(np.array([0.0, -1.0]), 0.0).along(
        np.stack([x, np.full(400, -below)], axis=1), np.array([0.0, 1.0]), 4 * below
    )
    under = height <= height.min() + depth
    return float((under * (2 * np.pi * x if axi else 1.0)).sum() * width / 400)


def _steps(
    rng: np.random.Generator, motion: str, depth: float, width: float, area: float, strength: float,
    share: tuple[float, float], increments: int | None, axi: bool, flat: bool, moment: float, tool: Any,
) -> Iterator[pr.Step]:  # fmt: skip
    """Steps of a motion; a force is what a plastic body of that flow stress carries on the ``area`` that the tool covers."""
    sign = float(rng.choice([-1, 1]))
    if motion in ("push", "twist"):
        force = float(rng.uniform(*share)) * strength * area
        if motion == "push" and tool.spring is not None and tool.spring.y is not None:
            # the mount is moved by what the spring would give under the force
            yield pr.Step("push", move={"tool": pr.Motion(y=-min(force / tool.spring.y, depth))}, increments=increments)
            return
        yield pr.Step("push", push={"tool": pr.Push(y=-force)}, increments=increments)
        if motion == "twist":
            push = pr.Push(y=-force, m=sign * moment * force)
            yield pr.Step("twist", push={"tool": push}, increments=increments)
        return
    yield pr.Step("press", move={"tool": pr.Motion(y=-depth)}, increments=increments)
    if motion == "press and slide":
        x = float(rng.uniform(0.2, 1.5)) * depth * sign
        yield pr.Step("slide", move={"tool": pr.Motion(x=x)}, increments=increments)
    elif motion == "roll":
        x = float(rng.uniform(0.5, 3.0)) * depth * sign
        yield pr.Step("roll", move={"tool": pr.Motion(x=x, rz=-x / tool.radius)}, increments=increments)
    elif motion == "turn":
        most = 0.5 * depth / width if flat else 0.05
        yield pr.Step("turn", move={"tool": pr.Motion(rz=float(rng.uniform(-most, most)))}, increments=increments)
    elif motion == "release":
        yield pr.Step("release", move={"tool": pr.Motion(y=0.2 * depth)}, increments=increments)
