"""Friction laws of forming: a block under a given pressure, slid along a plane at a given speed.

The sliding face is the one whose motion is prescribed, so that the support takes the friction, the block is not sheared and the
pressure is that of the load everywhere (Poisson's ratio is 0): the force on the plane is τ(p, κ, v) A with all four known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import prensa as pr
from prensa.friction.law import FrictionLaw
from prensa.reference import levanov, smooth_cap, stribeck, wang_osakada, wanheim_bay
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row

BLOCK_WIDTH, YIELD_K = 4.0, 50.0
GIVEN_PRESSURES = (30.0, 120.0, 300.0)
GIVEN_SPEEDS = (0.02, 0.1, 0.4)


def slid_block(law: FrictionLaw, pressures: tuple[float, ...], speeds: tuple[float, ...], E_scale: float) -> pr.Problem:
    """A block that is pressed on a plane, then slid: one step for each pressure and speed, half of it to get there."""
    place, steps = 0.0, [pr.Step("press", loads={"block.top": pr.Load(pressure=pressures[0])}, increments=1)]
    for number, (p, v) in enumerate(zip(pressures, speeds)):
        t0, before = number + 1.0, pressures[max(number - 1, 0)]
        load = pr.Load(pressure=((t0, before), (t0 + 0.5, p), (t0 + 1.0, p)))
        travel = pr.Fixed(x=((t0, place), (t0 + 1.0, place + v)))
        place += v
        steps.append(
            pr.Step(f"p = {p:g}, v = {v:g}", loads={"block.top": load}, fixed={"block.bottom": travel}, increments=4)
        )
    return pr.Problem(
        "slid block", kinematics="small",
        bodies={"block": pr.Body(pr.Rectangle(size=(BLOCK_WIDTH, 1.0), n=(4, 1)), pr.Elastic(E=1e5 * E_scale, nu=0.0))},
        tools={"plane": pr.Plane(normal=(0, 1), at=(0, 0))},
        contacts=(pr.Contact("block.bottom", "plane", friction=law, enforcement=pr.Exact()),),
        fixed={"block.bottom": pr.Fixed(x="held")}, steps=tuple(steps),
    )  # fmt: skip


def _capped(p: float, v: float) -> float:
    return min(0.3 * p, 0.5 * YIELD_K)


def _wang_osakada(p: float, v: float) -> float:
    m, p_cr = wang_osakada(0.1)
    return 0.1 * p if p < p_cr * math.sqrt(3.0) * YIELD_K else m * YIELD_K


Law = tuple[str, Callable[[float], FrictionLaw], Callable[[float, float], float]]
FORMING_LAWS: tuple[Law, ...] = (
    ("capped, sharp", lambda s: pr.Capped(0.3 * s, 0.5 * s, YIELD_K), _capped),
    ("capped, n = 1", lambda s: pr.Capped(0.3 * s, 0.5 * s, YIELD_K, 1), lambda p, v: smooth_cap(p, YIELD_K, 0.3, 0.5, 1)),
    ("capped, n = 3", lambda s: pr.Capped(0.3 * s, 0.5 * s, YIELD_K, 3), lambda p, v: smooth_cap(p, YIELD_K, 0.3, 0.5, 3)),
    ("Wanheim-Bay, f = 0.6", lambda s: pr.WanheimBay(0.6 * s, YIELD_K), lambda p, v: wanheim_bay(p, YIELD_K, 0.6)),
    ("Levanov, m = 0.4", lambda s: pr.Levanov(0.4 * s, YIELD_K), lambda p, v: levanov(p, math.sqrt(3.0) * YIELD_K, 0.4)),
    ("Wang-Osakada, μ = 0.1", lambda s: pr.WangOsakada(0.1 * s, 0.0, YIELD_K), _wang_osakada),
    (
        "Stribeck",
        lambda s: pr.Stribeck(0.3 * s, 0.1 * s, 0.2, 1.5, 0.05 * s),
        lambda p, v: p * stribeck(v, static=0.3, kinetic=0.1, speed=0.2, n=1.5, viscous=0.05),
    ),
    (
        "table over pressure and speed",
        lambda s: pr.FrictionTable(
            pressure=((30.0, 0.2), (120.0, 0.15), (300.0, 0.1)), speed=((0.02, 1.0), (0.1, 0.8), (0.4, 0.5)), mu=s
        ),
        lambda p, v: p * dict(zip(GIVEN_PRESSURES, (0.2 * 1.0, 0.15 * 0.8, 0.1 * 0.5)))[p],
    ),
)  # fmt: skip


@case("friction laws of forming", suite="friction")
def friction_laws_of_forming(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A block slid under a given pressure at a given speed feels what each friction law says."""
    balance = Balance()
    for name, law, exact in FORMING_LAWS:
        ends = [
            i for i in balance.watch(slid_block(law(mu_scale), GIVEN_PRESSURES, GIVEN_SPEEDS, E_scale)) if i.end_of_step
        ][1:]
        for inc, p, v in zip(ends, GIVEN_PRESSURES, GIVEN_SPEEDS, strict=True):
            yield row(f"{name}: F/A at p = {p:g}, v = {v:g}", exact(p, v), inc.force("plane").x / BLOCK_WIDTH, 1e-9)
    m, p_cr = wang_osakada(0.1)
    law = pr.WangOsakada(0.1 * mu_scale)
    yield row("Wang-Osakada, μ = 0.1: m", m, law.m, 1e-12)
    yield row("Wang-Osakada, μ = 0.1: m, to the digits of the source", 0.4534, law.m, 1e-4, "absolute")
    digits = "Wang-Osakada, μ = 0.1: critical pressure / σ_y, to the digits of the source"
    yield row(digits, 2.634, law.critical_pressure, 5e-4, "absolute")
    corner = law.m / 0.1 / math.sqrt(3.0)
    yield row("Wang-Osakada, μ = 0.1: pressure of the corner / σ_y", p_cr, corner, 0.01)
    yield from balance.rows()
