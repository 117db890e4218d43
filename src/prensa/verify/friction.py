"""Friction: a plate with lift-off, slip and stick; a block pushed up an incline; partial slip of a cylinder."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np

import prensa as pr
from prensa.reference import cattaneo_mindlin, hertz_line, sliding_wedge, tables
from prensa.result.increment import Increment
from prensa.types import Array, Flags
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row


# ------------------------------------------------------------------------------------------- plate on a rigid plane
def plate(n: int, E_scale: float, mu_scale: float) -> pr.Problem:
    """Square 40 × 40 on a rigid plane, μ = 1, pressed from above and pushed from the left; exact Coulomb by augmentation."""
    body = pr.Body(pr.Rectangle(size=(40, 40), n=(n, n)), pr.Elastic(E=130_000.0 * E_scale, nu=0.2))
    contact = pr.Contact(
        "plate.bottom", "plane", friction=pr.Coulomb(1.0 * mu_scale), enforcement=pr.Augmented(tolerance=1e-6)
    )
    return pr.Problem(
        "plate", kinematics="small", contact_geometry="reference",
        bodies={"plate": body}, tools={"plane": pr.Plane(normal=(0, 1), at=(0, 0))}, contacts=(contact,),
        fixed={"plate.right": "x"},
        steps=(
            pr.Step(
                "push", loads={"plate.top": pr.Load(pressure=50.0), "plate.left": pr.Load(pressure=150.0)}, increments=1
            ),
        ),
    )  # fmt: skip


def plate_rows(inc: Increment, what: str = "") -> Iterator[Row]:
    """Displacements of the plate along its plane beside the mesh-converged ones; ``what``: what each row begins with."""
    c = inc.contacts["plate.bottom-plane"]
    order = np.argsort(c.X[:, 0])
    for x, u in tables.PLATE_UX_CONVERGED.items():
        found = float(np.interp(x, c.X[order, 0], (c.x - c.X)[order, 0]))
        yield row(f"{what}u_x at x = {x:g} (10⁻³)", u, 1e3 * found, 0.005)


@case("plate with friction", suite="friction")
def plate_with_friction(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Feijóo, Barbosa & Zouain's plate (code_aster SSNV128) moves by the mesh-converged amounts on 64 × 64 elements."""
    balance = Balance()
    inc = balance.last(plate(64, E_scale, mu_scale))
    yield from plate_rows(inc)
    c = inc.contacts["plate.bottom-plane"]
    order = np.argsort(c.X[:, 0])
    X, status = c.X[order, 0], c.status[order]
    h = 40 / 64
    yield row("lift-off ends at x", 3.3, _edge(X, status > 0), h, "absolute")
    yield row("slip ends at x", 29.7, _edge(X, status == 1), h, "absolute")
    yield from balance.rows()


def _edge(x: Array, inside: Flags) -> float:
    """Where a flag first holds along x: half way between two nodes."""
    k = int(np.argmax(inside))
    return float(0.5 * (x[k - 1] + x[k]))


# -------------------------------------------------------------------------------------------------- block on an incline
ALPHA = math.atan(0.1)
WEIGHT = 8.0


def incline(mu: float, E_scale: float) -> pr.Problem:
    """A block lying on a plane inclined by atan 0.1, its weight 1 per area, driven up by its lower face's x.

    Nothing holds the driven face vertically: the plane carries the whole weight G and, once every closed point slides,
    each traction leans by the friction angle from the plane's normal, whatever the pressure distribution. F/G is then
    exact for a deformable body too.
    """
    c, s = math.cos(ALPHA), math.sin(ALPHA)
    nx, ny = 8, 4
    local = [(4.0 * i / nx, 2.0 * j / ny) for j in range(ny + 1) for i in range(nx + 1)]
    points = tuple((c * x - s * y, s * x + c * y) for x, y in local)
    cells = tuple((k, k + 1, k + nx + 2, k + nx + 1) for j in range(ny) for k in range(j * (nx + 1), j * (nx + 1) + nx))
    bottom = tuple(range(nx + 1))
    left = tuple(range(0, (nx + 1) * (ny + 1), nx + 1))
    mesh = pr.Points(points=points, cells=cells, boundaries={"bottom": bottom, "left": left})
    return pr.Problem(
        "incline", kinematics="finite",
        bodies={"block": pr.Body(mesh, pr.Elastic(E=10_000.0 * E_scale, nu=0.3))},
        tools={"plane": pr.Plane(normal=(-s, c), at=(0, 0))},
        contacts=(pr.Contact("block.bottom", "plane", friction=pr.Coulomb(mu)),),
        body_force={"block": (0.0, -1.0)},
        fixed={"block.left": "x"},
        steps=(
            pr.Step("rest", increments=1),
            pr.Step("push", fixed={"block.left": pr.Fixed(x=0.5)}, increments=5),
        ),
    )  # fmt: skip


@case("sliding wedge", suite="friction")
def wedge(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A block pushed up an incline needs F/G = (tan α + μ)/(1 − μ tan α) (NAFEMS CGS-4) as long as it slides."""
    balance = Balance()
    exact = sliding_wedge(ALPHA, 0.3)
    forces: list[float] = []
    for inc in balance.watch(incline(0.3 * mu_scale, E_scale)):
        if inc.step == "push":
            c = inc.contacts["block.bottom-plane"]
            if (c.status[c.pressure > 0] == 2).all():
                forces.append(inc.force("plane").x / WEIGHT)
    yield row("increments in which every closed point slides", 4, len(forces), 0.0, "at least")
    yield row("F/G at the end", exact, forces[-1], 0.0005)
    worst = max(abs(force / exact - 1.0) for force in forces)
    yield row("largest relative error while it slides", 0.0, worst, 1e-6, "absolute")
    yield from balance.rows()


# --------------------------------------------------------------------------------------------------------- shear factor
def dragged_strip(material: pr.J2 | pr.Elastic, law: pr.Shear, kinematics: Literal["small", "finite"]) -> pr.Problem:
    """A strip flattened without friction, released by a part of its elastic strain, then dragged along by its die."""
    drag = {"die": pr.Motion(x=0.2)}
    return pr.Problem(
        "dragged strip", kinematics=kinematics, allow_large_strain=kinematics == "small", thickness=2.0,
        bodies={"strip": pr.Body(pr.Rectangle(size=(4, 2), n=(8, 4)), material)},
        tools={"die": pr.Plane(touching="strip.top")}, contacts=(pr.Contact("strip.top", "die"),),
        fixed={"strip.bottom": "y", "strip.left": "x"},
        steps=(
            pr.Step("flatten", move={"die": pr.Motion(y=-0.4)}, increments=20),
            pr.Step("release", move={"die": pr.Motion(y=-0.3994)}, increments=2),
            pr.Step(
                "drag", move=drag, fixed={"strip.left": pr.Fixed(free=True), "strip.bottom": pr.Fixed(x="held", y="held")},
                friction={"strip.top-die": law}, increments=8,
            ),
        ),
    )  # fmt: skip


@case("shear factor", suite="friction")
def shear_factor(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A die that drags a strip along feels m k A, A the present area: k = σ_y/√3 of a perfectly plastic strip, or given."""
    balance = Balance()
    m, s0, k = 0.3, 100.0, 40.0
    law, given = pr.Shear(m * mu_scale), pr.Shear(m * mu_scale, k)
    plastic = pr.J2(1e5 * E_scale, 0.3, pr.Perfect(s0))
    elastic = pr.Elastic(1e3 * E_scale, 0.3)
    cases: tuple[tuple[str, pr.Problem, float], ...] = (
        ("plastic, finite strain", dragged_strip(plastic, law, "finite"), s0 / math.sqrt(3.0)),
        ("plastic, small strain", dragged_strip(plastic, law, "small"), s0 / math.sqrt(3.0)),
        ("elastic, k given, finite strain", dragged_strip(elastic, given, "finite"), k),
    )
    for name, problem, strength in cases:
        inc = balance.last(problem)
        c = inc.contacts["strip.top-die"]
        finite = problem.kinematics == "finite"
        length = float(np.ptp(c.x[:, 0])) if finite else 4.0
        yield row(f"{name}: share of the points that slide", 1.0, float((c.status == 2).mean()), 0.0, "absolute")
        yield row(f"{name}: F_x / (m k A)", 1.0, -inc.force("die").x / (m * strength * 2.0 * length), 1e-7)
    yield from balance.rows()


# ------------------------------------------------------------------------------------------------ Cattaneo and Mindlin
RADIUS, E, NU, MU = 40.0, 1000.0, 0.3, 0.02
TANGENTIAL_TRAVEL = 0.016 * MU / 0.3


def partial_slip(n: tuple[int, int], mu: float, E_scale: float) -> pr.Problem:
    """A cylinder pressed without friction on a block a hundred half-widths deep, then moved sideways with it, and back."""
    grade = pr.Grade(x=(-1.0, -0.5, 0.0, 0.5, 1.0), y=(0.0,), ratio=100)
    mesh = pr.Rectangle(size=(200, 100), n=n, origin=(-100, -100), grade=grade)
    return pr.Problem(
        "partial slip", kinematics="small", contact_geometry="reference",
        bodies={"block": pr.Body(mesh, pr.Elastic(E=E * E_scale, nu=NU))},
        tools={"cylinder": pr.Circle(radius=RADIUS, touching="block.top")},
        contacts=(pr.Contact("block.top", "cylinder"),),
        fixed={"block.bottom": "xy"},
        steps=(
            pr.Step("press", move={"cylinder": pr.Motion(y=-0.05)}, increments=1),
            pr.Step(
                "load", friction={"block.top-cylinder": pr.Coulomb(mu)},
                move={"cylinder": pr.Motion(x=TANGENTIAL_TRAVEL)}, increments=4,
            ),
            pr.Step("unload", move={"cylinder": pr.Motion(x=-0.25 * TANGENTIAL_TRAVEL)}, increments=5),
        ),
    )  # fmt: skip


def stick_half_width(inc: Increment) -> tuple[float, float]:
    """Half the width of the sticking zone, edges half way between nodes, and the size of the elements at its edges."""
    c = inc.contacts["block.top-cylinder"]
    order = np.argsort(c.X[:, 0])
    x, stick = c.X[order, 0], np.flatnonzero(c.status[order] == 1)
    i, k = stick[0], stick[-1]
    return 0.25 * (x[k] + x[k + 1] - x[i] - x[i - 1]), max(x[k + 1] - x[k], x[i] - x[i - 1])


@case("Cattaneo-Mindlin", suite="friction")
def cattaneo(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The stick zone of a cylinder shrinks on loading and the reversed slip grows on unloading as in the closed form.

    P and Q are the measured ones of each increment, a is Hertz's at that P. The closed form neglects, in the order of μ,
    the sideways travel of the cylinder over the half-width and the pressure that shear brings about on a compressible
    body; a small μ keeps both below the mesh error.
    """
    balance = Balance()
    largest = 0.0
    edges: dict[str, list[tuple[float, float, float]]] = {"load": [], "unload": []}
    rms = {"load": 0.0, "unload": 0.0}
    slope = 0.0
    for inc in balance.watch(partial_slip((240, 80), MU * mu_scale, E_scale)):
        if inc.step == "press":
            continue
        P, Q = inc.force("cylinder").y, -inc.force("cylinder").x
        largest = Q if inc.step == "load" else largest
        exact = cattaneo_mindlin(P=P, a=hertz_line(P, RADIUS, E, NU).a, mu=MU, Q=Q, Q_max=largest)
        edges[inc.step].append((*stick_half_width(inc), exact.c if inc.step == "load" else exact.c_reversed))
        c = inc.contacts["block.top-cylinder"]
        inside = np.abs(c.X[:, 0]) < 0.95 * exact.a
        q = c.force[:, 0] / c.weight
        error = (q - exact.traction(c.X[:, 0]))[inside]
        rms[inc.step] = max(rms[inc.step], float(np.sqrt(np.mean(error**2))) / (MU * exact.p0))
        sliding = c.status == 2
        slope = max(slope, abs(float(np.abs(q[sliding]).sum() / c.pressure[sliding].sum()) / MU - 1.0))
    for step, found in edges.items():
        ours, h, c_exact = max(found, key=lambda e: abs(e[0] - e[2]) / e[1])
        yield row(f"half-width of stick on {step}, worst, within an element", c_exact, ours, h, "absolute")
    for step, value in rms.items():
        yield row(f"RMS error of q on {step}, worst / μ p0", 0.0, value, 0.03, "absolute")
    yield row("|q|/p where it slips, worst relative error", 0.0, slope, 1e-9, "absolute")
    yield from balance.rows()
