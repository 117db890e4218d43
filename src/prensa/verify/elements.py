"""Elements and plane stress: patch tests, bending, incompressibility and homogeneous large strain against closed forms."""

from __future__ import annotations

from collections.abc import Iterator

import prensa as pr
from prensa import reference as ref
from prensa.verify.balance import Balance
from prensa.verify.forming import FLOWS, NU, REDUCTIONS, E, at, curve, johnson_cook_force, upsetting
from prensa.verify.table import Row, case, row


@case("frictionless upsetting in plane stress, every flow law", suite="elements")
def plane_stress_upsetting(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The uniaxial solution, elasticity included, to 1e-4 in force, width and thickness at 50 %."""
    balance = Balance()
    for name, flow in FLOWS.items():
        p = upsetting(
            (2, 2), 0.0, flow, space="plane stress", enforcement=pr.Augmented(), increments=50, E_scale=E_scale,
            reductions=REDUCTIONS if name == "ludwik" else (0.5,),
        )  # fmt: skip
        history = list(balance.watch(p))
        marks = REDUCTIONS if name == "ludwik" else (0.5,)
        for r, inc in zip(marks, at(marks, history), strict=True):
            exact = ref.upset_plane_stress(r, width=10.0, flow=curve(flow), E=E, nu=NU)
            sheet = inc.bodies["billet"]
            assert sheet.thickness is not None
            yield row(f"{name}: force at {r:.0%}", float(exact.force), inc.force("punch").y, 1e-4)
            yield row(f"{name}: width at {r:.0%}", float(exact.size), float(sheet.x[:, 0].max()), 1e-4)
            thin, thick = float(sheet.thickness.min()), float(sheet.thickness.max())
            yield row(f"{name}: least thickness at {r:.0%}", float(exact.lateral_stretch), thin, 1e-4)
            yield row(f"{name}: largest thickness at {r:.0%}", float(exact.lateral_stretch), thick, 1e-4)
    yield from balance.rows()


@case("rate-dependent upsetting in plane stress", suite="elements")
def plane_stress_rate(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Johnson-Cook under uniaxial stress: first order in time, and the limit is the solution of the rate equation."""
    balance = Balance()
    flow = pr.JohnsonCook(250.0, 500.0, 0.3, 0.05, 1e-3)
    # the cylinder of radius 10 and the strip of width 10 and thickness 1 have the same stress: areas 100π and 10
    exact = johnson_cook_force(flow, 0.3) / (100.0 * 3.141592653589793) * 10.0
    forces = []
    for increments in (25, 50, 100):
        p = upsetting(
            (1, 1), 0.0, flow, space="plane stress", enforcement=pr.Augmented(), increments=increments,
            E_scale=E_scale, reductions=(0.3,),
        )  # fmt: skip
        forces.append(balance.last(p).force("punch").y)
    yield row("force at 30 % in 100 increments", exact, forces[2], 1e-3)
    yield row("force extrapolated to zero step", exact, 2 * forces[2] - forces[1], 1e-4)
    yield row("ratio of differences, first order", 2.0, (forces[1] - forces[0]) / (forces[2] - forces[1]), 0.1)
    yield from balance.rows()
