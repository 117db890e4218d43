"""Stresses of dies and wear of tools, against closed forms and an independent program."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa.reference import tables
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row
from prensa.verify.ties import shell_flexibility


@case("upsetting, its forces on an elastic die", suite="forming")
def deflection(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The die of a rigid run, loaded with the run's forces, against a solution in which die and billet are elastic together."""
    balance, known = Balance(), tables.die_deflection()
    flow = pr.Ludwik(s0=250.0, K=500.0, n=0.3)
    problem = pr.Problem(
        "upsetting", space="axisymmetric",
        bodies={"billet": pr.Body(pr.Rectangle(size=(10, 7.5), n=(24, 18)), pr.J2(E=200e3 * E_scale, nu=0.3, flow=flow))},
        tools={"die": pr.Plane(touching="billet.top")}, fixed={"billet.bottom": "y"},
        contacts=(pr.Contact(("billet.top", "billet.right"), "die", friction=pr.Coulomb(mu=0.1 * mu_scale)),),
        steps=tuple(
            pr.Step(f"to {h:g}", move={"die": pr.Motion(y=float(h) - 7.5)}, increments=10) for h in known["half_height"]
        ),
    )  # fmt: skip
    for inc in balance.watch(problem):
        if not inc.end_of_step:
            continue
        k = inc.step_number - 1
        found = pr.die_stress(inc, problem, "die", pr.Die(thickness=20.0, E=210e3 * E_scale, span=(0.0, 20.0)))
        at = f"half height {known['half_height'][k]:.3f}"
        yield row(f"{at}: force", 1e3 * float(known["force"][k]), inc.force("die").y, 3e-3)
        for r, within in ((0, 3e-2), (5, 1.5e-2), (10, 1.5e-2), (15, 1.5e-2), (20, 1.5e-2)):
            lift = float(np.interp(r, found.X[:, 0], found.u[:, 1]))
            yield row(f"{at}: lift of the face at r = {r}", float(known[f"lift_{r}"][k]), lift, within)
        yield row(f"{at}: imbalance of the die's forces", 0.0, found.imbalance, 1e-10, "absolute")
    yield from balance.rows()


def container(height: float = 5.0) -> pr.Problem:
    """A stiff cylinder of radius 10 in a rigid container, pressed from above: the same pressure all over the wall."""
    return pr.Problem(
        "container", space="axisymmetric", kinematics="small", contact_geometry="reference",
        bodies={"billet": pr.Body(pr.Rectangle(size=(10, height), n=(8, 4)), pr.Elastic(E=2e5, nu=0.3))},
        tools={"wall": pr.Profile(points=((10.0, height), (10.0, 0.0)), at=(0.0, 0.0))}, fixed={"billet.bottom": "y"},
        contacts=(pr.Contact(("billet.right",), "wall"),),
        steps=(pr.Step("press", loads={"billet.top": pr.Load(pressure=1e-3)}, increments=1),),
    )  # fmt: skip


@case("container as a thick tube", suite="bodies")
def tube(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The wall's contact forces on a tube 10 … 30 in plane strain: Lamé's displacements and stresses."""
    balance, problem = Balance(), container()
    inc = balance.last(problem)
    ends = {"start": "y", "end": "y"}
    die = pr.Die(thickness=20.0, E=200e3 * E_scale, nu=0.3, span=(0.0, 5.0), size=0.25, fixed=ends)
    found = pr.die_stress(inc, problem, "wall", die)
    a, b, p = 10.0, 30.0, float(found.pressure.mean())
    yield row("pressure on the die", 1e-3 * 0.3 / 0.7, p, 2e-3)  # the penalty lets the cylinder widen a little
    yield row("scatter of it", 0.0, float(np.ptp(found.pressure)) / p, 1e-3, "absolute")
    for r, name in ((a, "bore"), (b, "outside")):
        body = found.increment.bodies["die"]
        k = np.flatnonzero(np.abs(body.X[:, 0] - r) < 1e-9)
        u = float(body.displacement[k, 0].mean())
        yield row(f"displacement, {name}", shell_flexibility(200e3, 0.3, a, b, r, p, 0.0), u, 3e-3)
        hoop = p * a**2 / (b**2 - a**2) * (1 + b**2 / r**2)
        yield row(f"hoop stress, {name}", hoop, float(body.stress[k, 2].mean()), 3e-3)
    yield from balance.rows()


@case("wear under a sliding block", suite="forming")
def worn(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A block under a constant force N slides over a plane: worn volume k N s/H, from when all of it slides."""
    balance, k, hardness, force, way = Balance(), 1e-4, 2000.0, 8.0, 1.5
    for rule in ("nodal", "gauss2"):
        problem = sliding(E_scale, mu_scale, rule, force, way)
        history = list(balance.watch(problem))
        loads = pr.tool_loads(history, problem, "plane")
        steady = slice(len(history) - 3, len(history))
        slid = 3 * way / 6  # of six increments
        yield row(f"{rule}: worn volume", k * force * slid / hardness, k / hardness * float(loads.work[steady].sum()), 1e-9)
        found = pr.wear(loads, k, hardness)
        total = float(np.dot(found.depth, loads.area))
        yield row(f"{rule}: sum over the plane's coordinate", found.volume, total, 1e-12)
        states = [c for inc in history for c in inc.contacts.values()]
        before = [np.zeros_like(states[0].points.slip), *(c.points.slip for c in states)]
        work = sum(float((c.points.weight * c.points.pressure) @ (c.points.slip - s)) for c, s in zip(states, before))
        yield row(f"{rule}: worn volume of all slip", k / hardness * work, found.volume, 1e-9)
        yield row(f"{rule}: measure", found.volume, k / hardness * history[-1].measure("plane.wear"), 1e-9)
    yield from balance.rows()


def sliding(E_scale: float, mu_scale: float, rule: str, force: float, way: float) -> pr.Problem:
    """A block, held at its top, on a plane that is pressed on it and then moved in six increments."""
    push = {"plane": pr.Push(y=force)}
    return pr.Problem(
        "sliding", kinematics="small", contact_geometry="reference",
        bodies={"block": pr.Body(pr.Rectangle(size=(4, 2), n=(8, 4)), pr.Elastic(E=1000.0 * E_scale, nu=0.3))},
        tools={"plane": pr.Plane(touching="block.bottom")}, fixed={"block.top": "xy"},
        contacts=(pr.Contact(("block.bottom",), "plane", friction=pr.Coulomb(mu=0.2 * mu_scale), integration=rule),),
        steps=(pr.Step("press", push=push, increments=2),
               pr.Step("slide", push=push, by={"plane": pr.Motion(x=way)}, increments=6)),
    )  # fmt: skip
