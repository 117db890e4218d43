"""Upsetting of a cylinder to half its height with μ = 0, 0.1 and 0.3: forces, barrels and where the metal flows.

References: the exact homogeneous solution without friction, an independent solver with friction. The steps in the force at
μ = 0.3 are points of the free side that fold onto the die one after the other; smaller elements at the corner make them smaller.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from common import HERE, figure, judged, options, saved, section

import prensa as pr
from prensa.output import style
from prensa.reference import tables
from prensa.result.increment import Increment
from prensa.verify.table import Row, row

if TYPE_CHECKING:
    from matplotlib.patches import Rectangle

HEIGHT = 7.5
RADIUS = {0.0: 14.1323, 0.1: 14.350, 0.3: 14.517}
FORCE = {
    0.0: dict(zip(tables.UPSETTING_REDUCTION, tables.UPSETTING_FORCE["cauchy"])),
    0.1: tables.UPSETTING_FORCE_MU_01["cauchy"],
    0.3: tables.UPSETTING_FORCE_MU_03,
}
"""kN at reductions, by μ."""

Runs = dict[float, list[Increment]]


def reduction(inc: Increment) -> float:
    """Travel of the punch over the initial height."""
    return -inc.tools["punch"].place.y / HEIGHT


def changes(mu: float, quick: bool) -> list[str]:
    """What differs from the case file."""
    mesh = ["bodies.billet.mesh.n=[12, 9]"] if quick else []
    return [f"friction.mu={mu}", "bodies.billet.mesh.grade={x: [10], y: [7.5], ratio: 3}", *mesh]


def rows(runs: Runs, quick: bool) -> Iterator[Row]:
    """Forces and barrel radii against the references."""
    for mu, increments in runs.items():
        allowed = (0.01 if mu == 0.3 else 0.005) * (2 if quick else 1)
        for r, F in FORCE[mu].items():
            inc = min(increments, key=lambda i: abs(reduction(i) - r))
            yield row(f"μ = {mu:g}: force at {100 * r:.0f} % (kN)", F, inc.force("punch").y / 1e3, allowed)
        radius = float(increments[-1].bodies["billet"].x[:, 0].max())
        yield row(f"μ = {mu:g}: largest radius at 50 % (mm)", RADIUS[mu], radius, allowed)


def forces(runs: Runs, path: Path) -> None:
    """Force against stroke."""
    with style.styled():
        made, axes = figure(5.4, 3.6)
        for colour, (mu, increments) in zip(style.CYCLE, runs.items()):
            stroke = [0.0, *(100 * reduction(i) for i in increments)]
            force = [0.0, *(i.force("punch").y / 1e3 for i in increments)]
            axes.plot(stroke, force, color=colour, label=f"μ = {mu:g}")
            axes.plot([100 * r for r in FORCE[mu]], list(FORCE[mu].values()), "o", markerfacecolor="white", markersize=5,
                      color=colour, clip_on=False)  # fmt: skip
        axes.plot([], [], "o", color=style.BLACK, markerfacecolor="white", markersize=5, label="references")
        axes.set(xlim=(0, 50), ylim=(0, None), xlabel="reduction of height (%)", ylabel="force on the punch (kN)")
        axes.set_title("Upsetting of a cylinder, R = 10, height 15 mm")
        axes.legend(loc="upper left")
    saved(made, path)


def shapes(runs: Runs, path: Path) -> None:
    """Right half of each section at the end, coloured by plastic strain on one scale."""
    last = {mu: increments[-1].bodies["billet"] for mu, increments in runs.items()}
    limits = (0.0, min(1.5, max(float(b.plastic_strain.max()) for b in last.values())))
    with style.styled():
        made, panels = figure(7.6, 2.5, columns=len(last), sharey=True)
        for axes, (mu, body) in zip(panels, last.items()):
            for side in (1.0, -1.0):
                drawn = section(axes, body.x * (1.0, side), body.cells, body.plastic_strain, limits)
            height = 0.5 * HEIGHT
            for bottom in (height, -height - 1.2):
                axes.add_patch(_die(bottom))
            axes.set(xlim=(0, 15.5), ylim=(-height - 1.2, height + 1.2), xlabel="r (mm)", title=f"μ = {mu:g}")
        panels[0].set_ylabel("z (mm)")
        made.colorbar(drawn, ax=list(panels), label="equivalent plastic strain (–)", location="bottom", shrink=0.5, aspect=40,
                      extend="max")  # fmt: skip
    saved(made, path)


def _die(bottom: float) -> Rectangle:
    from matplotlib.patches import Rectangle

    return Rectangle((-1.0, bottom), 20.0, 1.2, **style.TOOL)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the three cases, compare, draw; returns the exit code."""
    chosen = options(__doc__, "upsetting_friction", argv)
    runs: Runs = {}
    for mu in FORCE:
        runs[mu] = list(pr.solve(pr.load(HERE / "upsetting.yaml", changes(mu, chosen.quick)).problem))
        cost = sum(i.statistics.iterations for i in runs[mu])
        print(f"μ = {mu:g}: {len(runs[mu])} increments, {cost} Newton iterations")
    failed = judged("Upsetting with friction", list(rows(runs, chosen.quick)))
    forces(runs, chosen.out / "force_stroke.png")
    shapes(runs, chosen.out / "shapes.png")
    rise = {mu: increments[-1].force("punch").y / runs[0.0][-1].force("punch").y - 1 for mu, increments in runs.items()}
    text = ", ".join(f"{100 * r:.0f} % at μ = {mu:g}" for mu, r in rise.items() if mu)
    print(f"Friction raises the final force by {text}; the free side has folded onto the dies.")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
