"""Example 1 of the founding paper: a rigid cylinder, R = 80, on an elastic block 160 × 40 (half modelled), smooth base.

"Small strain" has two meanings here: contact on the undeformed surface along its own normal (linear Signorini, what the
layer solution solves) and contact on the moved surface along the cylinder's normal. Both are compared.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa.reference import LayerLine, layer_line, tables
from prensa.result.increment import ContactState, Increment
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row

E, NU, R, H = 10_000.0, 0.3, 80.0, 40.0


def problem(
    n: tuple[int, int], kinematics: str, geometry: str, material: pr.Elastic | pr.NeoHooke, steps: tuple[pr.Step, ...]
) -> pr.Problem:
    """Half of the block with n elements, fine under the cylinder (largest size 20 times the smallest)."""
    mesh = pr.Rectangle(size=(80, H), n=n, grade=pr.Grade(x=(0,), y=(H,), ratio=20))
    return pr.Problem(
        "cylinder on a block", kinematics=kinematics, contact_geometry=geometry,
        bodies={"block": pr.Body(mesh, material)},
        tools={"cylinder": pr.Circle(radius=R, touching="block.top")},
        contacts=(pr.Contact("block.top", "cylinder"),),
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=steps,
    )  # fmt: skip


def press(depth: float, increments: int = 1) -> pr.Step:
    """Step that lowers the cylinder to *depth*."""
    return pr.Step(f"to {depth:g}", move={"cylinder": pr.Motion(y=-depth)}, increments=increments)


def force(inc: Increment) -> float:
    """P (N/mm) of the whole block: twice that of the half model."""
    return 2.0 * inc.force("cylinder").y


def half_width(inc: Increment) -> tuple[float, float]:
    """Contact half-width, half way between the last closed and the first open node, and the element size there."""
    c = inc.contacts["block.top-cylinder"]
    x, closed = np.sort(c.X[:, 0]), c.pressure[np.argsort(c.X[:, 0])] > 0
    k = int(closed.sum())
    return 0.5 * (x[k - 1] + x[k]), x[k] - x[k - 1]


def pressure_errors(c: ContactState, layer: LayerLine) -> Iterator[tuple[str, float]]:
    """RMS error / p0 within 0.95 of the layer's half-width: of the pressure from nodal forces, of that from stresses."""
    inside = c.X[:, 0] < 0.95 * layer.a
    exact = layer.pressure(c.X[inside, 0])
    for name, pressure in (("nodal force", c.pressure), ("σ·n", c.pressure_from_stress)):
        yield name, float(np.sqrt(np.mean((pressure[inside] - exact) ** 2))) / layer.p0


@case("example 1, reference geometry", suite="contact")
def reference_geometry(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The linear Signorini problem gives the layer's force, half-width and pressure on 100 × 100 elements."""
    balance = Balance()
    p = problem((100, 100), "small", "reference", pr.Elastic(E=E * E_scale, nu=NU), (press(0.5), press(1), press(2)))
    for inc, d, P in zip(
        balance.watch(p), tables.EXAMPLE1_DELTA, tables.EXAMPLE1_FORCE_REFERENCE_GEOMETRY, strict=True
    ):
        yield row(f"P at δ = {d:g}", P, force(inc), 0.002)
        layer = layer_line(R=R, H=H, E=E, nu=NU, delta=d)
        a, h = half_width(inc)
        c = inc.contacts["block.top-cylinder"]
        yield row(f"half-width a at δ = {d:g}, within an element", layer.a, a, h, "absolute")
        yield row(f"closed points in a at δ = {d:g}", 11, int((c.pressure > 0).sum()), 0.0, "at least")
        for name, rms in pressure_errors(c, layer):
            yield row(f"RMS error of p from {name} / p0 at δ = {d:g}", 0.0, rms, 0.01, "absolute")
    yield from balance.rows()


@case("example 1, current geometry", suite="contact")
def current_geometry(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Linear elasticity with contact on the moved surface gives the force of four other programs."""
    balance = Balance()
    p = problem((100, 100), "small", "current", pr.Elastic(E=E * E_scale, nu=NU), (press(0.5), press(1), press(2)))
    for inc, d, P in zip(balance.watch(p), tables.EXAMPLE1_DELTA, tables.EXAMPLE1_FORCE_CURRENT_GEOMETRY, strict=True):
        yield row(f"P at δ = {d:g}", P, force(inc), 0.002)
    yield from balance.rows()


@case("example 1, neo-Hooke", suite="contact", slow=True)
def neo_hooke(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Finite strain to a tenth of the radius in at most 20 increments on default settings."""
    balance = Balance()
    steps = (press(0.5), press(1), press(2), press(4, 2), press(8, 4))
    p = problem((70, 60), "finite", "current", pr.NeoHooke(E=E * E_scale, nu=NU), steps)
    count = 0
    for inc in balance.watch(p):
        count = inc.number
        for d, P in tables.EXAMPLE1_NEO_HOOKE.items():
            if inc.end_of_step and abs(inc.tools["cylinder"].place.y + d) < 1e-9:
                yield row(f"P at δ = {d:g}", P, force(inc), 0.002)
    yield row("increments to δ = 8", 20, count, 0, "at most")
    yield from balance.rows()
