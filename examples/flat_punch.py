"""Flat punch on a perfectly plastic half-plane: the mean pressure levels off at Prandtl's (2 + π) k.

On three meshes, with the plastic zone and the slip lines of Prandtl's and Hill's solutions. The element beside the edge of
the punch carries pressure too, so finite elements stop above the limit by an amount proportional to their size there;
extrapolated to zero size, it is gone.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from common import HERE, figure, judged, options, saved, section

import prensa as pr
from prensa.output import style
from prensa.reference import prandtl_punch
from prensa.result.increment import Increment
from prensa.verify.table import Row, row

YIELD = 100.0
LIMIT = prandtl_punch(YIELD / np.sqrt(3.0))
Runs = dict[int, list[Increment]]


def edge_element(inc: Increment) -> float:
    """Size of the element beside the punch, whose half-width is 1."""
    x = np.unique(inc.contacts["block.top-punch"].X[:, 0])
    return float(x[x > 1 + 1e-9][0] - 1.0)


def rows(runs: Runs) -> Iterator[Row]:
    """Mean pressure by elements under the punch and their size at its edge; extrapolated to zero size from the two finest."""
    p = {edge_element(increments[-1]): increments[-1].force("punch").y for increments in runs.values()}
    for n, (h, value) in zip(runs, p.items()):
        yield row(f"mean pressure, {n} elements of {h:.3f} mm (MPa)", LIMIT, value, 0.4 * h)
    *_, (h, coarse), (g, fine) = p.items()
    yield row("extrapolated to zero size (MPa)", LIMIT, fine + (fine - coarse) * g / (h - g), 0.005)


def pressures(runs: Runs, path: Path) -> None:
    """Mean pressure against travel."""
    with style.styled():
        made, axes = figure(5.4, 3.4)
        for n, increments in runs.items():
            travel = [0.0, *(-1e3 * i.tools["punch"].place.y for i in increments)]
            axes.plot(travel, [0.0, *(i.force("punch").y for i in increments)], label=f"{n} elements under the punch")
        axes.axhline(LIMIT, color=style.BLACK, linewidth=1.0, dashes=(5, 3), label="(2 + π) k")
        axes.set(xlim=(0, 60), ylim=(0, 1.12 * LIMIT), xlabel="travel of the punch (µm)", ylabel="mean pressure (MPa)")
        axes.set_title("Limit load of a flat punch")
        axes.legend(loc="lower right")
    saved(made, path)


def slip_lines() -> dict[str, np.ndarray]:
    """Outermost slip lines, right half: Prandtl's (triangle under the whole punch) and Hill's (one under each half)."""
    angle = np.linspace(1.25 * np.pi, 1.75 * np.pi, 60)
    found = {}
    for name, width, left in (("Prandtl", 2.0, -1.0), ("Hill", 1.0, 0.0)):
        fan = np.array([1.0, 4.0]) + width / np.sqrt(2.0) * np.column_stack([np.cos(angle), np.sin(angle)])
        found[name] = np.vstack([[left, 4.0], fan, [1.0 + width, 4.0]])
    return found


def zone(inc: Increment, path: Path) -> None:
    """Plastic strain at the end, on the undeformed block, and the slip lines over it."""
    from matplotlib.patches import Rectangle

    body = inc.bodies["block"]
    with style.styled():
        made, axes = figure(6.4, 3.6)
        drawn = section(axes, body.X, body.cells, 100 * body.plastic_strain, (0.0, 5.0))
        for (name, line), dashes in zip(slip_lines().items(), ((5, 2), (1.5, 1.5))):
            axes.plot(*line.T, color="w", linewidth=1.3, dashes=dashes)
            axes.plot([], [], color="0.35", linewidth=1.3, dashes=dashes, label=f"slip lines, {name}")
        axes.add_patch(Rectangle((-0.5, 4.0), 1.5, 0.3, **style.TOOL))
        axes.set(
            xlim=(0, 4), ylim=(2, 4.3), xlabel="x (mm)", ylabel="y (mm)", title="Plastic zone under half of the punch"
        )
        axes.legend(loc="upper right", ncols=2, bbox_to_anchor=(1.0, 1.02))
        made.colorbar(drawn, ax=axes, label="equivalent plastic strain (%)", extend="max", shrink=0.8)
    saved(made, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the three meshes, compare, draw; returns the exit code."""
    chosen = options(__doc__, "flat_punch", argv)
    runs: Runs = {}
    for n in (2, 4, 8) if chosen.quick else (4, 8, 16):
        changes = [f"bodies.block.mesh.n=[{4 * n}, {3 * n}]"]
        runs[n] = list(pr.solve(pr.load(HERE / "flat_punch.yaml", changes).problem))
        print(f"{n:2d} elements under the punch: {sum(i.statistics.iterations for i in runs[n])} Newton iterations")
    failed = judged("Flat punch, (2 + π) k", list(rows(runs)))
    pressures(runs, chosen.out / "pressure.png")
    zone(runs[max(runs)][-1], chosen.out / "plastic_zone.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
