"""A round bar is pulled until it necks: force against elongation with Considère's point, and the shape of the neck.

Nothing marks the place of the neck: the gripped ends, which cannot contract, make the middle the weakest.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from common import HERE, beside, figure, judged, options, saved, section

import prensa as pr
from prensa.materials.hardening import flow_curve
from prensa.output import style
from prensa.reference import considere
from prensa.reference.upsetting import Necking
from prensa.result.increment import Increment
from prensa.verify.table import Row, row

RADIUS, LENGTH = 6.413, 53.334


def force(inc: Increment) -> float:
    """Pulling force at the grip (kN), of the supports there."""
    body = inc.bodies["bar"]
    return float(body.reaction[body.X[:, 1] == body.X[:, 1].max(), 1].sum()) / 1e3


def elongation(inc: Increment) -> float:
    """Of the half bar (mm)."""
    return float(inc.bodies["bar"].displacement[:, 1].max())


def neck(inc: Increment) -> float:
    """Radius in the middle over the initial one."""
    body = inc.bodies["bar"]
    return float(body.x[body.X[:, 1] == 0.0, 0].max()) / RADIUS


def exact(problem: pr.Problem) -> Necking:
    """Considère's point of the material in the case."""
    material = problem.bodies["bar"].material
    assert isinstance(material, pr.J2)
    flow = material.flow
    return considere(lambda e: float(flow_curve(flow, np.array([e]))[0]), area=np.pi * RADIUS**2, length=LENGTH,
                     E=material.E, nu=material.nu)  # fmt: skip


def rows(increments: list[Increment], point: Necking) -> Iterator[Row]:
    """Largest force and where; then, that it necks."""
    F = np.array([force(i) for i in increments])
    yield row("largest force (kN)", point.force / 1e3, float(F.max()), 0.003)
    at = elongation(increments[int(F.argmax())])
    yield beside("half-elongation there, beside that of a uniform bar (mm)", 0.5 * point.elongation, at)
    yield row("radius of the neck over the initial one, at the end", 0.6, neck(increments[-1]), 0.0, "at most")
    yield row("last force over the largest", 0.7, float(F[-1] / F.max()), 0.0, "at most")


def curve(increments: list[Increment], point: Necking, marked: list[Increment], path: Path) -> None:
    """Force against elongation, and the neck's radius."""
    with style.styled():
        made, axes = figure(5.6, 3.6)
        u = [0.0, *(elongation(i) for i in increments)]
        axes.plot(u, [0.0, *(force(i) for i in increments)], color=style.BLUE)
        axes.plot(0.5 * point.elongation, point.force / 1e3, "*", color=style.RED, markersize=11, label="Considère")
        axes.plot([elongation(i) for i in marked], [force(i) for i in marked], "o", color=style.BLUE, markersize=5,
                  label="shapes shown")  # fmt: skip
        right = axes.twinx()
        right.plot(u, [1.0, *(neck(i) for i in increments)], color=style.GREEN, linewidth=1.2, dashes=(5, 2))
        right.set(ylim=(0, 1.1), ylabel="radius of the neck / initial (dashed)")
        right.yaxis.label.set_color(style.GREEN)
        right.tick_params(axis="y", colors=style.GREEN)
        right.spines["right"].set(visible=True, color=style.GREEN)
        right.grid(False)
        axes.set(xlim=(0, None), ylim=(0, 88), xlabel="elongation of the half bar (mm)", ylabel="force (kN)")
        axes.set_title("Bar R = 6.413, length 53.334 mm")
        axes.legend(loc="lower left")
    saved(made, path)


def shapes(marked: list[Increment], path: Path) -> None:
    """The middle half of the bar at the marked stages."""
    bodies = [i.bodies["bar"] for i in marked]
    limits = (0.0, float(bodies[-1].plastic_strain.max()))
    with style.styled():
        made, panels = figure(6.4, 3.4, columns=len(marked), sharey=True)
        for axes, body, inc in zip(panels, bodies, marked):
            for mirror in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
                drawn = section(axes, body.x * mirror, body.cells, body.plastic_strain, limits)
            axes.set(
                xlim=(-7.5, 7.5),
                ylim=(-15, 15),
                xlabel="r (mm)",
                title=f"+{elongation(inc):.1f} mm, {force(inc):.1f} kN",
            )
        panels[0].set_ylabel("z (mm)")
        made.colorbar(drawn, ax=list(panels), label="equivalent plastic strain (–)", shrink=0.9)
    saved(made, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Pull, compare, draw; returns the exit code."""
    chosen = options(__doc__, "necking_bar", argv)
    changes = ["bodies.bar.mesh.n=[6, 18]", "steps.0.increments=35"] if chosen.quick else ["bodies.bar.mesh.n=[12, 36]"]
    problem = pr.load(HERE / "necking_bar.yaml", changes).problem
    increments = list(pr.solve(problem))
    point = exact(problem)
    failed = judged("Necking of a bar", list(rows(increments, point)))
    middle = min(increments, key=lambda i: abs(elongation(i) - 5.2))
    marked = [max(increments, key=force), middle, increments[-1]]
    curve(increments, point, marked, chosen.out / "force_elongation.png")
    shapes(marked, chosen.out / "neck.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
