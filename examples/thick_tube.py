"""Pressure in a thick tube of perfectly plastic metal: through yielding, then expanded to twice its bore.

Yielding in small strain against the elastic-plastic closed form (ν = 0.4999: the form is that of an incompressible tube);
expansion in finite strain against the rigid-plastic one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from common import HERE, Array, figure, judged, options, saved

import prensa as pr
from prensa.output import style
from prensa.reference import tube_expansion, tube_pressure
from prensa.result.increment import Increment
from prensa.verify.table import Row, row

K, A, B, E = 100.0, 10.0, 20.0, 200e3
G = E / 3.0
"""Shear modulus of the incompressible tube."""
YIELDING = K * B * B / (2 * G * A)
"""Displacement of the bore at which the whole wall has yielded (mm)."""


def pressure(inc: Increment, current: bool) -> float:
    """Pressure on the bore (MPa) from the support reactions, on its current or its initial area."""
    body = inc.bodies["tube"]
    bore = body.X[:, 0] == A
    radius = body.x[bore, 0].mean() if current else A
    return float(body.reaction[bore, 0].sum() / (2 * np.pi * radius))


def radius(inc: Increment) -> float:
    """Radius of the bore (mm)."""
    return float(inc.bodies["tube"].x[:, 0].min())


def yielding(u: Array) -> Array:
    """Displacement of the bore (mm) → pressure (MPa), incompressible: the plastic zone reaches c, u = k c²/(2 G a)."""
    c = np.sqrt(2 * G * A * u / K)
    elastic = tube_pressure(K, A, B, A) * (c / A) ** 2
    return np.array([tube_pressure(K, A, B, float(min(r, B))) if r > A else e for r, e in zip(c, elastic)])


def rows(small: list[Increment], finite: list[Increment], allowed: float) -> Iterator[Row]:
    """Pressures at chosen stages."""
    for inc in small[len(small) // 6 - 1 :: len(small) // 6]:
        u = radius(inc) - A
        exact = float(yielding(np.array([u]))[0])
        yield row(f"pressure with the bore displaced by {1e3 * u:.0f} µm (MPa)", exact, pressure(inc, False), allowed)
    for target in (12.0, 16.0, 20.0):
        inc = finite[int(np.argmin([abs(radius(i) - target) for i in finite]))]
        exact = float(tube_expansion(K * np.sqrt(3.0), A, B, radius(inc)))
        yield row(f"pressure at a bore radius of {radius(inc):.0f} mm (MPa)", exact, pressure(inc, True), allowed)


def picture(small: list[Increment], finite: list[Increment], path: Path) -> None:
    """Both stages beside the closed forms."""
    with style.styled():
        made, (left, right) = figure(7.4, 3.3, columns=2)
        u = np.linspace(0.0, 2 * YIELDING, 300)
        left.plot(1e3 * u, yielding(u), color=style.BLACK, linewidth=1.0, label="closed form")
        points = [1e3 * (radius(i) - A) for i in small], [pressure(i, False) for i in small]
        left.plot(*points, "o", color=style.BLUE, label="prensa")
        left.set(xlim=(0, 60), ylim=(0, 160), xlabel="displacement of the bore (µm)", ylabel="pressure (MPa)")
        left.set_title("Yielding")
        for u_mark, name in ((K * A / (2 * G), "first yield"), (YIELDING, "wall plastic")):
            left.axvline(1e3 * u_mark, color="0.5", linewidth=0.8, dashes=(3, 3))
            left.annotate(name, (1e3 * u_mark, 3), xytext=(3, 0), textcoords="offset points", fontsize=8, color="0.35")
        left.legend(loc="center right")
        r = np.linspace(A, 2 * A, 200)
        right.plot(
            r, tube_expansion(K * np.sqrt(3.0), A, B, r), color=style.BLACK, linewidth=1.0, label="rigid-plastic"
        )
        shown = finite[4::5]
        right.plot(
            [radius(i) for i in shown], [pressure(i, True) for i in shown], "o", color=style.BLUE, label="prensa"
        )
        right.set(
            xlim=(A, 2 * A + 0.2), ylim=(0, 160), xlabel="radius of the bore (mm)", title="Expansion to twice the bore"
        )
        right.legend(loc="upper right")
    saved(made, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Run both stages, compare, draw; returns the exit code."""
    chosen = options(__doc__, "thick_tube", argv)
    mesh = f"bodies.tube.mesh.n={'[8, 1]' if chosen.quick else '[32, 1]'}"
    first = [
        "kinematics=small",
        "allow_large_strain=true",
        "bodies.tube.material.nu=0.4999",
        f"fixed.tube.left.x={2 * YIELDING}",
        "steps.0.increments=24",
    ]
    small = list(pr.solve(pr.load(HERE / "thick_tube.yaml", [mesh, *first]).problem))
    finite = list(pr.solve(pr.load(HERE / "thick_tube.yaml", [mesh]).problem))
    failed = judged("Thick tube", list(rows(small, finite, 0.02 if chosen.quick else 0.005)))
    picture(small, finite, chosen.out / "pressure.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
