"""Partial slip of a cylinder that is pressed on a block, then pushed sideways and let back (Cattaneo 1938, Mindlin 1949).

The contact slips at its rim and sticks in the middle; on the way back it slips the other way, from the rim inwards. The
closed form neglects, in the order of μ, the coupling of pressure and shear: hence a small coefficient of friction.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from common import Array, figure, judged, options, saved

import prensa as pr
from prensa.output import style
from prensa.reference import CattaneoMindlin, cattaneo_mindlin, hertz_line
from prensa.result.increment import Increment
from prensa.verify.table import Row, row

RADIUS, E, NU, MU = 40.0, 1000.0, 0.3, 0.02
TRAVEL = 0.016 * MU / 0.3


def problem(n: tuple[int, int]) -> pr.Problem:
    """A block a hundred half-widths deep, with small elements around the rims of contact and stick."""
    grade = pr.Grade(x=(-1.0, -0.5, 0.0, 0.5, 1.0), y=(0.0,), ratio=100)
    mesh = pr.Rectangle(size=(200, 100), n=n, origin=(-100, -100), grade=grade)
    friction = {"block.top-cylinder": pr.Coulomb(MU)}
    return pr.Problem(
        "partial slip",
        kinematics="small",
        contact_geometry="reference",
        bodies={"block": pr.Body(mesh, pr.Elastic(E=E, nu=NU))},
        tools={"cylinder": pr.Circle(radius=RADIUS, touching="block.top")},
        contacts=(pr.Contact("block.top", "cylinder"),),
        fixed={"block.bottom": "xy"},
        steps=(
            pr.Step("press", move={"cylinder": pr.Motion(y=-0.05)}, increments=1),  # without friction
            pr.Step("load", move={"cylinder": pr.Motion(x=TRAVEL)}, friction=friction, increments=4),
            pr.Step("unload", move={"cylinder": pr.Motion(x=-0.25 * TRAVEL)}, increments=5),
        ),
    )


@dataclass(frozen=True)
class Stage:
    """An increment with friction, and the closed form at its forces."""

    increment: Increment
    exact: CattaneoMindlin

    @property
    def traction(self) -> tuple[Array, Array]:
        """Place and shear traction on the block, along x."""
        c = self.increment.contacts["block.top-cylinder"]
        order = np.argsort(c.X[:, 0])
        return c.X[order, 0], (c.force[:, 0] / c.weight)[order]

    @property
    def stick(self) -> tuple[float, float, float]:
        """Half the width that sticks: closed form, ours (edges half way between nodes), and the element there."""
        c = self.increment.contacts["block.top-cylinder"]
        order = np.argsort(c.X[:, 0])
        x, inside = c.X[order, 0], np.flatnonzero(c.status[order] == 1)
        i, k = inside[0], inside[-1]
        ours = 0.25 * (x[k] + x[k + 1] - x[i] - x[i - 1])
        return self.exact.c if self.increment.step == "load" else self.exact.c_reversed, ours, x[k + 1] - x[k]


def stages(increments: list[Increment]) -> list[Stage]:
    """Those with friction, with P and Q as found and Hertz's half-width at that P."""
    found, largest = [], 0.0
    for inc in increments:
        if inc.step != "press":
            P, Q = inc.force("cylinder").y, -inc.force("cylinder").x
            largest = max(largest, Q)
            a = hertz_line(P, RADIUS, E, NU).a
            found.append(Stage(inc, cattaneo_mindlin(P=P, a=a, mu=MU, Q=Q, Q_max=largest)))
    return found


def rows(found: list[Stage], allowed: float) -> Iterator[Row]:
    """Width of stick within an element, and the traction."""
    for stage in found:
        exact, ours, h = stage.stick
        share = stage.exact.Q / (MU * stage.exact.P)
        yield row(f"{stage.increment.step}, Q = {share:+.2f} μP: half-width of stick (mm)", exact, ours, h, "absolute")
    for step in ("load", "unload"):
        worst = 0.0
        for stage in (s for s in found if s.increment.step == step):
            x, q = stage.traction
            inside = np.abs(x) < 0.95 * stage.exact.a
            error = (q - stage.exact.traction(x))[inside] / (MU * stage.exact.p0)
            worst = max(worst, float(np.sqrt(np.mean(error**2))))
        yield row(f"{step}: RMS error of the traction over μ p0, worst", 0.0, worst, allowed, "absolute")


def picture(found: list[Stage], path: Path) -> None:
    """Tractions on loading and unloading over those of the closed form."""
    with style.styled():
        made, panels = figure(7.4, 3.6, columns=2, sharey=True)
        for axes, step in zip(panels, ("load", "unload")):
            chosen = [s for s in found if s.increment.step == step]
            for colour, stage in zip(style.CYCLE, chosen):
                exact, (x, q) = stage.exact, stage.traction
                scale = MU * exact.p0
                shown = np.abs(x) < 1.02 * exact.a
                fine = exact.a * np.sin(np.linspace(-0.5, 0.5, 801) * np.pi)
                axes.plot(fine / exact.a, exact.traction(fine) / scale, color=style.BLACK, linewidth=0.9)
                axes.plot(x[shown] / exact.a, q[shown] / scale, "o", color=colour, markersize=2.2,
                          label=f"Q = {exact.Q / (MU * exact.P):+.2f} μP")  # fmt: skip
            axes.plot([], [], color=style.BLACK, linewidth=0.9, label="closed form")
            axes.set(xlim=(-1.05, 1.05), ylim=(-1.5, 1.05), xlabel="x / a", title=f"{step}ing")
            axes.set_yticks([-1, -0.5, 0, 0.5, 1])
            axes.legend(loc="lower center", ncols=2)
        panels[0].set_ylabel("shear traction / μ p₀")
    saved(made, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Press, push, let back, compare, draw; returns the exit code."""
    chosen = options(__doc__, "cattaneo_mindlin", argv)
    increments = list(pr.solve(problem((120, 40) if chosen.quick else (240, 80))))
    found = stages(increments)
    failed = judged("Partial slip of a cylinder", list(rows(found, 0.06 if chosen.quick else 0.03)))
    picture(found, chosen.out / "traction.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
