"""Tied bodies of different materials and meshes: a bar of two layers, a tube of two shells."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row

APPLIED_PRESSURE = 10.0


@case("bar of two layers, tied", suite="bodies")
def bar(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Held at its sides, a bar of two materials shortens by p (h₁/M₁ + h₂/M₂), whatever the two meshes are."""
    balance = Balance()
    lower, upper = pr.Elastic(E=1000.0 * E_scale, nu=0.3), pr.Elastic(E=4000.0 * E_scale, nu=0.2)
    modulus = [m.E * (1 - m.nu) / ((1 + m.nu) * (1 - 2 * m.nu)) for m in (lower, upper)]
    for space, element in (("plane strain", "q4_fbar"), ("axisymmetric", "q8")):
        for n in ((4, 3), (7, 3), (3, 2)):
            problem = pr.Problem(
                "bar", space=space, kinematics="small",
                bodies={
                    "lower": pr.Body(pr.Rectangle(size=(4, 2), n=(4, 2)), lower, element),
                    "upper": pr.Body(pr.Rectangle(size=(4, 3), n=n, origin=(0, 2)), upper, element),
                },
                ties=(pr.Tie("upper.bottom", "lower.top"),),
                fixed={"lower.bottom": "y", **{f"{b}.{s}": "x" for b in ("lower", "upper") for s in ("left", "right")}},
                steps=(pr.Step("load", loads={"upper.top": pr.Load(pressure=APPLIED_PRESSURE)}, increments=1),),
            )  # fmt: skip
            inc = balance.last(problem)
            down = -inc.bodies["upper"].displacement[:, 1].min()
            what = f"{space}, {element}, 4 × 2 under {n[0]} × {n[1]}"
            yield row(f"{what}: shortening", APPLIED_PRESSURE * (2 / modulus[0] + 3 / modulus[1]), down, 1e-9)
            spread = max(float(np.abs(b.stress[:, 1] + APPLIED_PRESSURE).max()) for b in inc.bodies.values())
            yield row(f"{what}: largest error of σ_yy / p", 0.0, spread / APPLIED_PRESSURE, 1e-9, "absolute")
    yield from balance.rows()


def shell_flexibility(E: float, nu: float, a: float, b: float, r: float, inner: float, outer: float) -> float:
    """Radial displacement at r of a tube a … b in plane strain under the pressures inner and outer (Lamé 1852)."""
    A = (inner * a**2 - outer * b**2) / (b**2 - a**2)
    B = (inner - outer) * a**2 * b**2 / (b**2 - a**2)
    return (1 + nu) / E * ((1 - 2 * nu) * A * r + B / r)


@case("tube of two shells, tied", suite="bodies")
def tube(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Two tied shells of different materials under inner pressure: Lamé in each, one displacement where they meet."""
    balance = Balance()
    (E1, nu1), (E2, nu2), (a, b, c) = (70e3 * E_scale, 0.33), (210e3 * E_scale, 0.3), (10.0, 12.0, 16.0)
    # pressure q between the shells from the equality of their displacements, linear in q
    gap = [
        shell_flexibility(E1, nu1, a, b, b, APPLIED_PRESSURE, q) - shell_flexibility(E2, nu2, b, c, b, q, 0.0)
        for q in (0.0, 1.0)
    ]
    q = gap[0] / (gap[0] - gap[1])
    bore = shell_flexibility(E1, nu1, a, b, a, APPLIED_PRESSURE, q)
    outside = shell_flexibility(E2, nu2, b, c, c, q, 0.0)
    quarter = (0.0, math.pi / 2)
    errors: dict[str, list[float]] = {}
    for element in ("q4_fbar", "t6", "q8"):
        for k in (1, 2):
            problem = pr.Problem(
                "tube", kinematics="small",
                bodies={
                    "inside": pr.Body(
                        pr.Annulus(inner=a, outer=b, n=(9 * k, 2 * k), angles=quarter), pr.Elastic(E1, nu1), element
                    ),
                    "outside": pr.Body(
                        pr.Annulus(inner=b, outer=c, n=(7 * k, 3 * k), angles=quarter), pr.Elastic(E2, nu2), element
                    ),
                },
                ties=(pr.Tie("inside.outer", "outside.inner"),),
                fixed={f"{body}.{s}": v for body in ("inside", "outside") for s, v in (("start", "y"), ("end", "x"))},
                steps=(pr.Step("load", loads={"inside.inner": pr.Load(pressure=APPLIED_PRESSURE)}, increments=1),),
            )  # fmt: skip
            inc = balance.last(problem)
            u = {}
            for name, radius in (("inside", a), ("outside", c)):
                body = inc.bodies[name]
                at = np.abs(np.hypot(*body.X.T) - radius) < 1e-6
                u[name] = float(np.hypot(*body.x[at].T).mean()) - radius
            errors.setdefault(element, []).append(u["inside"] / bore - 1.0)
            if k == 2:
                tolerance = 0.005 if element == "q4_fbar" else 0.0005
                yield row(f"{element}: displacement of the bore", bore, u["inside"], tolerance)
                yield row(f"{element}: displacement outside", outside, u["outside"], tolerance)
        order = math.log2(abs(errors[element][0] / errors[element][1]))
        yield row(f"{element}: observed order of the bore", 1.8, order, 0.0, "at least")
    yield from balance.rows()
