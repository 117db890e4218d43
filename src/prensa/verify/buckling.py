"""Columns that buckle against the elastica; an arch that snaps through, led by its tool; ironing from jump to jump."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa.errors import SolveError
from prensa.reference.buckling import elastica_clamped
from prensa.system.failure import LimitPoint
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row

COLUMN_LENGTH = 40.0
SHORTENING = 2.0
SLIDE = 10.0
LEDGER = 0.01


def column(E_scale: float, element: str, bend: float, layers: int, stabilise: str = "off") -> pr.Problem:
    """A column of thickness 1, straight or bent by ``bend`` in its middle, pressed in increments far too long."""
    sides = {}
    if bend:
        sides = {k: pr.ArcSide(through=(x + bend, COLUMN_LENGTH / 2)) for k, x in (("left", 0.0), ("right", 1.0))}
    mesh = pr.Patch(corners=((0, 0), (1, 0), (1, COLUMN_LENGTH), (0, COLUMN_LENGTH)), n=(2, layers), sides=sides)
    return pr.Problem(
        "column", bodies={"b": pr.Body(mesh, pr.Elastic(E=1e5 * E_scale, nu=0.3), element)},
        fixed={"b.bottom": "xy"}, stabilise=stabilise,
        steps=(pr.Step("press", fixed={"b.top": pr.Fixed(x="held", y=-SHORTENING)}),),
    )  # fmt: skip


@case("column beyond its buckling load", suite="bodies", expected_warnings=("the bodies buckle",))
def columns(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Bent by 2 % of its thickness, by a millionth, or straight, a column follows the elastica, not the straight path beyond."""
    reference = elastica_clamped(SHORTENING, E=1e5 / (1 - 0.3**2), length=COLUMN_LENGTH, thickness=1.0)
    for element, layers, bend in (("q4_enhanced", 60, 0.02), ("q8", 16, 0.02), ("q8", 16, 1e-6), ("q8", 16, 0.0)):
        *_, last = pr.solve(column(E_scale, element, bend, layers))
        force, below = -last.supports["b.top"].y, last.supports["b.bottom"].y
        yield row(f"{element}, bent by {bend:g}: force", reference, force, 0.01)
        yield row(
            f"{element}, bent by {bend:g}: forces out of balance / force",
            0.0,
            (force - below) / force,
            1e-8,
            "absolute",
        )


def arch(*steps: pr.Step, E_scale: float = 1.0) -> pr.Problem:
    """A shallow arch clamped at its ends under a circle."""
    radius, half = 40.0, 0.35
    angles = (math.pi / 2 - half, math.pi / 2 + half)
    body = pr.Body(pr.Annulus(radius, radius + 1.0, (20, 1), angles=angles), pr.Elastic(E=1e4 * E_scale, nu=0.3), "q8")
    return pr.Problem(
        "arch", {"b": body}, steps or (pr.Step("rest"),), {"p": pr.Circle(radius=8, at=(0.0, radius + 9.0))},
        (pr.Contact("b.outer", "p"),), fixed={"b.start": "xy", "b.end": "xy"},
    )  # fmt: skip


@case("arch that snaps through under a push", suite="bodies")
def snap_through(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Displacement control takes the push of an arch over its maximum and least, where a push alone ends: as a motion does."""
    way = pr.Motion(y=-4.0)
    led = arch(pr.Step("led", push={"p": pr.Push(y=-60.0)}, control={"p": way}, increments=20), E_scale=E_scale)
    moved = arch(pr.Step("moved", move={"p": way}, increments=20))
    balance = Balance()
    expected = [i.force("p").y for i in balance.watch(moved)]
    increments = list(pr.solve(led))  # its push is what carries the way, not what the step says: balanced here
    forces = [i.force("p").y for i in increments]
    carried = [sum(support.y for support in i.supports.values()) for i in increments]
    passed = next(k for k in range(1, 20) if expected[k] < expected[k - 1])
    yield row("largest force before it snaps", max(expected[:passed]), max(forces[:passed]), 1e-6)
    yield row("least force behind", min(expected[passed:]), min(forces[passed:]), 1e-6)
    yield row("force on the far side", expected[-1], forces[-1], 1e-6)
    apart = max(abs(f - c) for f, c in zip(forces, carried)) / max(forces)
    yield row("led: push out of balance with the supports / largest push", 0.0, apart, 1e-8, "absolute")
    yield from balance.rows()


def ironing(
    n: tuple[int, int], rule: pr.Enforcement, stabilise: str, E_scale: float, mu_scale: float, element: str = "q4_fbar"
) -> pr.Problem:
    """A round die with steep sides and sharp corners, pressed into a block of rubber, slides over it by eight times its width."""
    die = pr.Profile(
        points=((-0.6, 3.0), (-0.6, 0.3), pr.Arc(through=(0.0, 0.0), to=(0.6, 0.3)), (0.6, 3.0)), fillet=0.0, at=(0.8, 4.2)
    )
    mesh = pr.Rectangle(size=(12, 4), n=n, grade=pr.Grade(y=(4.0,), ratio=4.0))
    rubber = pr.NeoHooke(E=689.6 * E_scale, nu=0.32)
    return pr.Problem(
        "ironing", {"block": pr.Body(mesh, rubber, element)},
        (
            pr.Step("press", move={"die": pr.Motion(y=-1.0)}),
            pr.Step("slide", move={"die": pr.Motion(x=SLIDE, y=-1.0)}),
        ),
        {"die": die}, (pr.Contact("block.top", "die", enforcement=rule),), friction=pr.Coulomb(0.3 * mu_scale),
        stabilise=stabilise, fixed={"block.bottom": "xy"},
    )  # fmt: skip


def steady(increments: list[pr.Increment]) -> tuple[float, float, float]:
    """Mean force of the die along and down while it slides far from both ends, and its force along from energies alone."""
    window = [i for i in increments if 1.2 <= i.time <= 1.8]
    way = [i.tools["die"].place.x for i in window]
    along, down = (
        float(np.trapezoid([getattr(i.force("die"), axis) for i in window], way)) / (way[-1] - way[0]) for axis in "xy"
    )
    kept = [sum(i.energy[part] for part in ("elastic", "friction", "viscous")) for i in (window[0], window[-1])]
    return -along, down, (kept[1] - kept[0]) / (way[-1] - way[0])


@case(
    "ironing over its limit points", suite="bodies", slow=True, balance=False,
    expected_warnings=("viscous forces of 'stabilise' have dissipated", "folds over itself", "begins to fold"),
        # an element of the triangles does in a jump
)  # fmt: skip
def ironed(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The static path ends where sticking ends all at once, which is reported; viscous forces carry the block on to the end.

    There the work of the die is what is stored and dissipated, and its force does not depend on the mesh.
    """
    reason: object = None
    try:
        *_, last = pr.solve(ironing((60, 16), pr.Exact(), "off", E_scale, mu_scale))
    except SolveError as error:
        reason = error.reason
    yield row("without viscous forces: reported as a limit point (1: yes)", 1.0, float(isinstance(reason, LimitPoint)), 1e-12)
    found = {}
    for n, rule in (((60, 16), pr.Exact()), ((48, 13), pr.Penalty())):
        increments = list(pr.solve(ironing(n, rule, "auto", E_scale, mu_scale)))
        mesh, last = f"{n[0]} x {n[1]} elements, {rule.type}", increments[-1]
        work = last.energy["external"]
        found[n] = steady(increments)
        yield row(f"{mesh}: time at the end", 2.0, last.time, 1e-12)
        yield row(f"{mesh}: energy imbalance / work", 0.0, last.energy["imbalance"] / work, LEDGER, "absolute")
        yield row(f"{mesh}: dissipated by viscous forces / work", 0.0, last.energy["viscous"] / work, 0.1, "absolute")
        yield row(f"{mesh}: steady force along, from energies", found[n][2], found[n][0], 2 * LEDGER)
    for axis, name in enumerate(("along", "down")):
        yield row(f"steady force {name}, coarse against fine mesh", found[60, 16][axis], found[48, 13][axis], 0.05)
    *_, last = pr.solve(ironing((30, 8), pr.Penalty(), "auto", E_scale, mu_scale, "t6"))
    work = last.energy["external"]
    yield row("six-noded triangles: time at the end", 2.0, last.time, 1e-12)
    yield row("six-noded triangles: energy imbalance / work", 0.0, last.energy["imbalance"] / work, 0.05, "absolute")
    yield row("six-noded triangles: dissipated by viscous forces / work", 0.0, last.energy["viscous"] / work, 0.0, "report")
