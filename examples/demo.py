"""First steps: the paper's cylinder on a block and an upsetting with friction, against independent references.

Runs ``cylinder_on_block.yaml`` and ``upsetting.yaml`` as ``prensa run`` does, leaves everything under results/, and
compares. Exit code 1 if any error is above 0.5 % (1 % with --quick, on coarser meshes).
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from common import HERE, Array, beside, figure, half_width, judged, options, saved

import prensa as pr
from prensa.kernels.compiling import announced
from prensa.output import style
from prensa.output.history import read_contact
from prensa.output.run import RunResult, run
from prensa.reference import hertz_line, layer_line, tables
from prensa.verify.table import Row, row

R, H, E, NU = 80.0, 40.0, 10_000.0, 0.3
DEPTHS = tables.EXAMPLE1_DELTA
CONTACT = "block.top-cylinder"


def pressures(result: RunResult) -> Iterator[tuple[float, float, Array, Array]]:
    """Depth, force of the whole block (N/mm), undeformed abscissa and pressure of every step of the cylinder's run."""
    assert result.increment is not None
    X = result.increment.contacts[CONTACT].X[:, 0]  # the table has current places; linear theory has undeformed ones
    history = result.history
    for k, (uy, fy) in enumerate(zip(history["cylinder.uy"], history["cylinder.fy"]), 1):
        table = read_contact(result.directory / "contact" / CONTACT / f"{k:04d}.csv")
        yield -uy, 2 * fy, X, table["pressure"]


def cylinder_rows(result: RunResult, allowed: float) -> Iterator[Row]:
    """Force and half-width at each depth; Hertz beside, at the same force."""
    for (depth, P, X, p), reference in zip(pressures(result), tables.EXAMPLE1_FORCE_REFERENCE_GEOMETRY):
        layer, hertz = layer_line(R=R, H=H, E=E, nu=NU, delta=depth), hertz_line(P, R, E, NU)
        a = half_width(X, p)
        yield row(f"P at {depth:g} mm (N/mm)", reference, P, allowed)
        yield row("  half-width, elastic layer (mm)", layer.a, a, allowed)
        yield beside("  half-width, beside Hertz (mm)", hertz.a, a)


def upsetting_rows(result: RunResult, allowed: float) -> Iterator[Row]:
    """Force at three reductions, and the barrel at the last."""
    assert result.increment is not None
    travel, force = -result.history["punch.uy"], result.history["punch.fy"]
    for reduction, reference in tables.UPSETTING_FORCE_MU_01["cauchy"].items():
        k = int(np.argmin(np.abs(travel - reduction * 7.5)))
        yield row(f"force at {100 * reduction:.0f} % (kN)", reference, force[k] / 1e3, allowed)
    radius = float(result.increment.bodies["billet"].x[:, 0].max())
    yield row("largest radius at 50 % (mm)", 14.350, radius, allowed)


def pressure_picture(result: RunResult, path: Path) -> None:
    """Pressure at each depth as found, of the elastic layer, and Hertz's at the same force (the paper's figure 4)."""
    with style.styled():
        made, axes = figure(6.0, 4.0)
        for k, (depth, P, X, p) in enumerate(pressures(result)):
            layer, hertz = layer_line(R=R, H=H, E=E, nu=NU, delta=depth), hertz_line(P, R, E, NU)
            shown = layer.a * 1.12 > X
            first = k == 0
            curves = ((hertz, "--", style.RED, "Hertz, same force"), (layer, "-", style.BLACK, "elastic layer"))
            for exact, line, colour, name in curves:
                x = exact.a * np.sin(np.linspace(0.0, 0.5 * np.pi, 200))
                axes.plot(x, exact.pressure(x), line, color=colour, linewidth=1.1, label=name if first else None)
            axes.plot(X[shown], p[shown], "o", color=style.BLUE, label="prensa, nodal forces" if first else None)
            axes.annotate(f"{depth:g} mm", (0.25, layer.p0), xytext=(0, 7), textcoords="offset points", fontsize=8)
        axes.set(xlim=(0, 13.5), ylim=(0, 980), xlabel="x (mm)", ylabel="pressure (MPa)")
        axes.set_title("Cylinder on a block: Hertz departs with depth")
        axes.legend(loc="upper right")
    saved(made, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Run, compare, and say where everything is; returns the exit code."""
    chosen = options(__doc__, "demo", argv)
    results = chosen.out if chosen.out != Path("results/demo") else Path("results")
    say = partial(print, flush=True)  # seen at once, whatever stands between
    begin, allowed = time.perf_counter(), 0.01 if chosen.quick else 0.005
    coarse = {"cylinder_on_block": ["bodies.block.mesh.n=[60, 60]"], "upsetting": ["bodies.billet.mesh.n=[12, 9]"]}
    done = {}
    for name, changes in coarse.items():
        source = HERE / f"{name}.yaml"
        say(f"{name}: {source}")
        case = pr.load(source, changes if chosen.quick else [])
        with announced(say):
            done[name] = run(case, out=results / name, quiet=chosen.quick, source=source)
    cylinder, billet = done["cylinder_on_block"], done["upsetting"]
    failed = judged("Cylinder on a block, whole block (paper, Example 1)", list(cylinder_rows(cylinder, allowed)))
    failed += judged("Upsetting with friction, μ = 0.1", list(upsetting_rows(billet, allowed)))
    pressure_picture(cylinder, chosen.out / "pressure_by_depth.png")
    for result in done.values():
        for path in sorted((result.directory / "pictures").glob("*.png")):
            print(f"picture: {path}")
        print(f"report:  {result.directory / 'report.html'}")
    verdict = f"{failed} errors above {100 * allowed:g} %" if failed else f"every error is within {100 * allowed:g} %"
    print(f"{verdict}; {time.perf_counter() - begin:.0f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
