"""Tools made of lines and arcs, and cavities: balance on a drag, equal tools drawn in two ways, a tube in a round hole."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row

WAVE = ((-9.0, 3.0), (-5.0, 0.0), pr.Arc(through=(-3.0, -0.6), to=(-1.0, 0.0)), (1.0, 0.3), (3.0, -0.4), (9.0, 2.0))


def _dragged(
    tool: pr.Profile | pr.Stamp, kinematics: str, geometry: str, E_scale: float, mu_scale: float
) -> pr.Problem:
    """A block under a tool that is pressed down, dragged and turned a little."""
    block = pr.Body(pr.Rectangle(size=(6, 2), n=(24, 8)), pr.Elastic(E=1000.0 * E_scale, nu=0.3))
    return pr.Problem(
        "dragged", kinematics=kinematics, contact_geometry=geometry, allow_large_strain=kinematics == "small",
        bodies={"block": block}, tools={"tool": tool},
        contacts=(pr.Contact("block.top", "tool", friction=pr.Coulomb(0.2 * mu_scale)),), fixed={"block.bottom": "xy"},
        steps=(
            pr.Step("press", move={"tool": pr.Motion(y=-0.15)}, increments=2),
            pr.Step("drag", move={"tool": pr.Motion(x=1.3, rz=0.03)}, increments=6),
        ),
    )  # fmt: skip


@case("block dragged under a profile", suite="tools")
def dragged(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Forces and moments of a wavy profile balance those of the nodes and the supports; a stamp drawn as a chain is a stamp."""
    for kinematics, geometry in (("small", "reference"), ("small", "current"), ("finite", "current")):
        balance = Balance()
        wave = pr.Profile(points=WAVE, fillet=0.5, at=(3.0, 0.0), above="block.top")
        for _ in balance.watch(_dragged(wave, kinematics, geometry, E_scale, mu_scale)):
            pass
        for r in balance.rows():
            yield row(f"{kinematics} strain, {geometry} geometry: {r.quantity}", 0.0, r.ours, r.tolerance, r.kind)
    face = ((-1.6, 1.0), (-1.6, 0.0), (1.6, 0.0), (1.6, 1.0))
    force = []
    for tool in (
        pr.Stamp(width=3.2, fillet=0.4, at=(2.6, 2.0), facing=(0, -1)),
        pr.Profile(points=face, fillet=0.4, at=(2.6, 2.0)),
    ):
        *_, inc = pr.solve(_dragged(tool, "finite", "current", E_scale, mu_scale))
        force.append(inc.force("tool"))
    for name in ("x", "y", "m"):
        yield row(
            f"stamp drawn as a profile: {name} of its force", getattr(force[0], name), getattr(force[1], name), 1e-8
        )


@case("tube in a round cavity", suite="tools", expected_warnings=("tools.hole: it starts 0.01 inside 'tube.outer'",))
def jacket(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Pressure on a tube forced into a rigid hole that is too small (Lamé: Timoshenko and Goodier, art. 28), order 2."""
    a, b, e, nu, E = 2.0, 5.0, 0.01, 0.3, 1000.0 * E_scale
    # u(b) = −e and σ_r(a) = 0
    exact = E * e * (b**2 - a**2) / ((1 + nu) * b * ((1 - 2 * nu) * b**2 + a**2))
    errors, balance = [], Balance()
    for n in (6, 12):
        mesh = pr.Annulus(inner=a, outer=b, n=(2 * n, n), angles=(0.0, 0.5 * np.pi))
        problem = pr.Problem(
            "jacket", kinematics="small", bodies={"tube": pr.Body(mesh, pr.Elastic(E=E, nu=nu))},
            tools={"hole": pr.Circle(radius=b - e, concave=True, at=(0.0, 0.0))},
            contacts=(pr.Contact("tube.outer", "hole", enforcement=pr.Augmented()),),
            fixed={"tube.start": "y", "tube.end": "x"}, steps=(pr.Step("fit", increments=1),),
        )  # fmt: skip
        inc = balance.last(problem)
        ours = float(inc.contacts["tube.outer-hole"].pressure.mean())
        errors.append(abs(ours / exact - 1.0))
    yield row("mean pressure, 24 × 12 elements", exact, ours, 5e-3)
    yield row("error at twice the elements / error", 0.25, errors[1] / errors[0], 0.05, "absolute")
    yield from balance.rows()
