"""Ring compression: change of the bore against reduction for six coefficients of friction, the chart that measures friction.

Drawn beside the classical calibration curves of `prensa.reference` (rigid-perfectly plastic, without bulging) and compared
with an independent solver for this material.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from common import HERE, Array, figure, judged, options, saved

import prensa as pr
from prensa.output import style
from prensa.reference import ring_compression_calibration, tables
from prensa.result.increment import Increment
from prensa.verify.table import Row, row

MUS = (0.0, 0.03, 0.05, 0.1, 0.2, 0.3)
HEIGHT, BORE = 3.0, 4.5
REDUCTION = 0.5
"""At which the differences from the classical curves are taken apart."""

Curve = tuple[Array, Array]


def solved(mu: float, *changes: str) -> list[Increment]:
    """All the increments of ``ring_compression.yaml`` with these changes."""
    return list(pr.solve(pr.load(HERE / "ring_compression.yaml", [f"friction.mu={mu}", *changes]).problem))


def curve(increments: list[Increment]) -> Curve:
    """Reduction (%) and change of the bore at mid-height (%), from the origin: the inner corner at the die is overrun."""
    body = increments[0].bodies["ring"]
    node = int(np.argmin(np.abs(body.X[:, 0] - BORE) + np.abs(body.X[:, 1])))
    reduction = [0.0, *(-100 * i.tools["die"].place.y / HEIGHT for i in increments)]
    change = [0.0, *(100 * (i.bodies["ring"].x[node, 0] / BORE - 1) for i in increments)]
    return np.array(reduction), np.array(change)


def rows(curves: dict[float, Curve], allowed: float) -> Iterator[Row]:
    """Change of the bore in points against the independent solver, where it has an answer."""
    for mu, changes in tables.RING_BORE_CHANGE.items():
        for r, exact in zip(tables.UPSETTING_REDUCTION, changes):
            if mu in curves:
                ours = float(np.interp(100 * r, *curves[mu]))
                yield row(f"μ = {mu:g}: change of bore at {100 * r:.0f} % (points)", exact, ours, allowed, "absolute")


def chart(curves: dict[float, Curve], path: Path) -> None:
    """The calibration chart."""
    classical = ring_compression_calibration()
    known = dict(zip(classical.friction, classical.change))
    with style.styled():
        made, axes = figure(6.2, 4.6)
        for colour, (mu, (reduction, change)) in zip(style.CYCLE, curves.items()):
            axes.plot(reduction, change, color=colour)
            axes.annotate(f"μ = {mu:g}", (reduction[-1], change[-1]), xytext=(5, 0), textcoords="offset points",
                          va="center", color=colour, fontsize=8, annotation_clip=False)  # fmt: skip
            if f"mu={mu:g}" in known:
                points = np.concatenate(
                    [[[0.0], [0.0]], 100 * np.array([classical.reduction, known[f"mu={mu:g}"]])], axis=1
                )
                axes.plot(*points, "x--", color=colour, linewidth=1.0, markersize=4, dashes=(4, 3))
            if mu in tables.RING_BORE_CHANGE:
                points = 100 * np.array(tables.UPSETTING_REDUCTION)
                axes.plot(points, tables.RING_BORE_CHANGE[mu], "o", color=colour, markerfacecolor="white",
                          markersize=5, clip_on=False)  # fmt: skip
        kinds = {
            "-": "prensa",
            "o": "independent solver, same material",
            "x--": "classical, perfectly plastic, without bulging",
        }
        for marker, name in kinds.items():
            axes.plot([], [], marker, color=style.BLACK, markerfacecolor="white", linewidth=1.2, label=name)
        axes.axhline(0.0, color=style.BLACK, linewidth=0.6)
        axes.set(
            xlim=(0, 50),
            ylim=(-60, 48),
            xlabel="reduction of height (%)",
            ylabel="change of the bore at mid-height (%)",
        )
        axes.set_title("Ring compression test, ring 18 × 9 × 6 mm")
        axes.legend(loc="lower left")
    saved(made, path)


def mean_change(inc: Increment) -> float:
    """Change of the bore (%), mean over the height of its free surface."""
    body = inc.bodies["ring"]
    side = np.flatnonzero(body.X[:, 0] == BORE)
    r, z = body.x[side[np.argsort(body.X[side, 1])]].T
    top = HEIGHT + inc.tools["die"].place.y
    free = z < top - 1e-3 * HEIGHT
    r, z = np.append(r[free], r[~free][:1]), np.append(z[free], top)
    return float(100 * (np.sum(0.5 * (r[1:] + r[:-1]) * np.diff(z)) / (z[-1] - z[0]) / BORE - 1))


def why(mu: float, mesh: str) -> str:
    """Take the difference from the classical curve at *mu* apart, with numbers."""
    ours, perfect = (solved(mu, mesh, *flow) for flow in ((), ("bodies.ring.material.flow={type: perfect, s0: 500}",)))
    classical = ring_compression_calibration()
    straight = 100 * float(np.interp(REDUCTION, classical.reduction, classical.curve(f"mu={mu:g}")))
    (contact,) = perfect[-1].contacts.values()
    shear = float(np.abs(contact.shear[1:-1]).max())
    return f"""\
Why the classical curves differ, most for high friction (change of the bore at μ = {mu:g}, {100 * REDUCTION:.0f} %):
  classical: perfectly plastic, straight sides, Coulomb capped at k   {straight:+.1f} %
  perfectly plastic, at mid-height                                    {curve(perfect)[1][-1]:+.1f} %
  perfectly plastic, mean over the height                             {mean_change(perfect[-1]):+.1f} %
  this hardening material, at mid-height                              {curve(ours)[1][-1]:+.1f} %
  this hardening material, mean over the height                       {mean_change(ours[-1]):+.1f} %
Bulging: a ring that may bulge closes further than one that keeps straight sides, and furthest at mid-height, where it is
measured. (Straight sides constrain the whole flow, which is presumably the rest.) Hardening works against it: where the
ring has deformed most it becomes the strongest. The cap is not at work: friction stays below k, {shear:.0f} against
{500 / np.sqrt(3):.0f} MPa in the perfectly plastic ring."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the rings, compare, draw; returns the exit code."""
    chosen = options(__doc__, "ring_chart", argv)
    mesh = f"bodies.ring.mesh.n={'[9, 6]' if chosen.quick else '[24, 16]'}"
    curves = {}
    for mu in MUS[::2] if chosen.quick else MUS:
        curves[mu] = curve(solved(mu, mesh))
        print(f"μ = {mu:<4g} bore at 50 %: {curves[mu][1][-1]:+.2f} %")
    failed = judged("Ring compression", list(rows(curves, 1.5 if chosen.quick else 0.4)))
    print(why(0.2, mesh))
    chart(curves, chosen.out / "chart.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
