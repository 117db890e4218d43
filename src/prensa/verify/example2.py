"""Example 2 of the founding paper: a flat ring stamp, 8-12 mm, on an elastic disc, axisymmetric, frictionless, smooth base."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

import prensa as pr
from prensa.reference import ring_stamp, tables
from prensa.result.increment import Increment
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row

E, NU, INNER, OUTER, DEPTH = 1000.0, 0.3, 8.0, 12.0, 0.01


def problem(n: tuple[int, int], radius: float, height: float, ratio: float, E_scale: float) -> pr.Problem:
    """Disc with n elements, fine at the two edges of the ring (largest size ``ratio`` times the smallest)."""
    mesh = pr.Rectangle(size=(radius, height), n=n, grade=pr.Grade(x=(INNER, OUTER), y=(height,), ratio=ratio))
    return pr.Problem(
        "ring on a disc", space="axisymmetric", kinematics="small", contact_geometry="reference",
        bodies={"disc": pr.Body(mesh, pr.Elastic(E=E * E_scale, nu=NU))},
        tools={"ring": pr.Ring(inner=INNER, outer=OUTER, touching="disc.top")},
        contacts=(pr.Contact("disc.top", "ring"),),
        fixed={"disc.bottom": "y"},
        steps=(pr.Step("press", move={"ring": pr.Motion(y=-DEPTH)}, increments=1),),
    )  # fmt: skip


def stiffness(inc: Increment) -> float:
    """P/δ (N/mm)."""
    return inc.force("ring").y / DEPTH


def extrapolated(values: Sequence[float]) -> tuple[float, float]:
    """Limit and observed rate of three values on meshes (or sizes) that differ by a factor of 2 (Richardson)."""
    a, b, c = values
    q = (a - b) / (b - c)
    return c + (c - b) / (q - 1.0), math.log2(q)


@case("example 2, disc", suite="contact")
def disc(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The disc of radius 20 and thickness 10 converges to its stiffness at the first order that its edges allow."""
    balance = Balance()
    values = [stiffness(balance.last(problem((n, n // 2), 20, 10, 10, E_scale))) for n in (40, 80, 160)]
    low, high = tables.EXAMPLE2_DISC_STIFFNESS
    yield row("P/δ on 160 × 80", 51_800, values[-1], 0.004)
    limit, rate = extrapolated(values)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    yield row("P/δ extrapolated from 40, 80, 160, inside the published range", middle, limit, half, "absolute")
    yield row("observed order in h", 0.9, rate, 0.0, "at least")
    yield from balance.rows()


@case("example 2, half-space limit", suite="contact")
def half_space(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A growing block on a smooth base, sides free, approaches the half-space, whose stiffness is known."""
    balance = Balance()
    exact = tables.EXAMPLE2_STIFFNESS["halfspace"]
    values = []
    sizes = (40, 80, 160, 320)
    for k, size in enumerate(sizes):
        # nearly the same elements at the ring on every size; the mesh error, of first order (edges), extrapolated away
        n, ratio = 20 + 10 * k, 1.25 * size
        coarse, fine = (stiffness(balance.last(problem((m, m), size, size, ratio, E_scale))) for m in (n, 2 * n))
        values.append(2 * fine - coarse)
    for size, value in zip(sizes, values):
        yield row(f"P/δ of a block of {size} above the half-space", exact, value, 0.0, "at least")
    yield row("extrapolated", exact, extrapolated(values[1:])[0], 0.005)
    yield from balance.rows()


@case("example 2, layer pressure", suite="contact", expected_warnings=("times longer than wide",))
def layer_pressure(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Away from its edges the ring on a wide disc has the pressure of the infinite layer within 1 %."""
    balance = Balance()
    layer = ring_stamp(inner=INNER, outer=OUTER, E=E, nu=NU, H=10.0)
    inc = balance.last(problem((160, 60), 120, 10, 200, E_scale))
    yield row("P/δ of a disc of radius 120 against the layer", layer.stiffness, stiffness(inc), 0.004)
    c = inc.contacts["disc.top-ring"]
    inside = (c.X[:, 0] > 8.8) & (c.X[:, 0] < 11.2)
    exact = layer.pressure(c.X[inside, 0], DEPTH)
    for name, p in (("nodal force", c.pressure), ("σ·n", c.pressure_from_stress)):
        worst = float(np.abs(p[inside] / exact - 1.0).max())
        yield row(f"largest error of p from {name}, r = 8.8 … 11.2", 0.0, worst, 0.01, "absolute")
    yield from balance.rows()
