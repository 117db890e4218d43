"""How far Hertz holds: a cylinder pressed into a layer, to a four-hundredth of its thickness up to a twentieth.

Half-width and peak pressure beside the exact solution for an elastic layer and beside Hertz's for a half-space at the same
force (the paper's figure 4, in numbers). The block is four times as wide as deep, nearly a layer.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from common import HERE, Array, beside, figure, half_width, judged, options, saved

import prensa as pr
from prensa.output import style
from prensa.reference import HertzLine, LayerLine, hertz_line, layer_line
from prensa.verify.table import Row, row

R, H, E, NU = 80.0, 40.0, 10_000.0, 0.3
DEPTHS = (0.1, 0.25, 0.5, 1.0, 1.5, 2.0)


@dataclass(frozen=True)
class Stage:
    """Pressure (k,) along x at a depth, with the layer's solution and Hertz's at the same force."""

    depth: float
    x: Array
    pressure: Array
    layer: LayerLine
    hertz: HertzLine

    @property
    def a(self) -> float:
        """Half-width."""
        return half_width(self.x, self.pressure)

    @property
    def p0(self) -> float:
        """Peak pressure."""
        return float(self.pressure.max())


def stages(n: int) -> Iterator[Stage]:
    """``cylinder_on_block.yaml`` with other steps, on n × n elements."""
    changes = [f"bodies.block.mesh.n=[{n}, {n}]", "bodies.block.mesh.grade.ratio=40"]
    base = pr.load(HERE / "cylinder_on_block.yaml", changes).problem
    steps = tuple(pr.Step(f"to {d:g}", move={"cylinder": pr.Motion(y=-d)}, increments=1) for d in DEPTHS)
    for depth, inc in zip(DEPTHS, pr.solve(replace(base, steps=steps))):
        c = inc.contacts["block.top-cylinder"]
        P = 2 * inc.force("cylinder").y
        layer = layer_line(R=R, H=H, E=E, nu=NU, P=P)
        yield Stage(depth, c.X[:, 0], c.pressure, layer, hertz_line(P, R, E, NU))


def rows(found: list[Stage], allowed: float) -> Iterator[Row]:
    """Against the layer with a verdict, beside Hertz without."""
    for s in found:
        yield row(f"δ = {s.depth:g} mm: half-width, layer (mm)", s.layer.a, s.a, allowed)
        yield row("  peak pressure, layer (MPa)", s.layer.p0, s.p0, allowed)
        yield beside("  half-width, beside Hertz", s.hertz.a, s.a)
        yield beside("  peak pressure, beside Hertz", s.hertz.p0, s.p0)


def thinned(x: Array, apart: float) -> list[int]:
    """Numbers of points at least *apart* from one another, the last one first: graded meshes have too many to draw."""
    kept: list[int] = []
    for k in np.argsort(x)[::-1]:
        if not kept or x[kept[-1]] - x[k] >= apart:
            kept.append(int(k))
    return kept


def profiles(found: list[Stage], path: Path) -> None:
    """Pressures at every depth but the second."""
    with style.styled():
        made, axes = figure(6.2, 4.6)
        for k, s in enumerate([found[0], *found[2:]]):
            curves = (
                (s.hertz, "--", style.RED, "Hertz, same force"),
                (s.layer, "-", style.BLACK, "elastic layer, same force"),
            )
            for exact, line, colour, name in curves:
                x = exact.a * np.sin(np.linspace(0.0, 0.5 * np.pi, 300))
                axes.plot(x, exact.pressure(x), line, color=colour, linewidth=1.1, label=None if k else name)
            closed = s.pressure > 0
            chosen = thinned(s.x[closed], 0.25)
            axes.plot(
                s.x[closed][chosen], s.pressure[closed][chosen], "o", color=style.BLUE, label=None if k else "prensa"
            )
            axes.annotate(f"{s.depth:g} mm", (0.2, s.layer.p0), xytext=(0, 7), textcoords="offset points", fontsize=8)
        axes.set(xlim=(0, 13.5), ylim=(0, 980), xlabel="x (mm)", ylabel="pressure (MPa)")
        axes.set_title("Cylinder on a layer, R = 80, thickness 40 mm")
        axes.legend(loc="upper right")
    saved(made, path)


def departure(found: list[Stage], path: Path) -> None:
    """Half-width and peak over Hertz's against depth."""
    with style.styled():
        made, axes = figure(5.4, 3.4)
        depths = np.linspace(0.02, 2.2, 60)
        exact = [layer_line(R=R, H=H, E=E, nu=NU, delta=float(d)) for d in depths]
        hertz = [hertz_line(s.P, R, E, NU) for s in exact]
        for name, colour, label in (("a", style.BLUE, "half-width"), ("p0", style.RED, "peak pressure")):
            ratio = [100 * (getattr(s, name) / getattr(h, name) - 1) for s, h in zip(exact, hertz)]
            axes.plot(depths, ratio, color=colour, linewidth=1.0)
            ours = [100 * (getattr(s, name) / getattr(s.hertz, name) - 1) for s in found]
            axes.plot([s.depth for s in found], ours, "o", color=colour, label=f"{label}, prensa (line: layer)")
        axes.axhline(0.0, color=style.BLACK, linewidth=0.8)
        axes.set(
            xlim=(0, 2.2), xlabel="depth δ (mm)", ylabel="departure from Hertz (%)", title="Hertz departs with depth"
        )
        axes.legend(loc="lower left")
    saved(made, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Press, compare, draw; returns the exit code."""
    chosen = options(__doc__, "hertz_depth", argv)
    found = list(stages(60 if chosen.quick else 140))
    failed = judged("Cylinder on a layer", list(rows(found, 0.01 if chosen.quick else 0.005)))
    profiles(found, chosen.out / "pressure.png")
    departure(found, chosen.out / "departure.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
