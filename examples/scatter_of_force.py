"""Scatter of a force: a pad of uncertain modulus and height is pressed many times; quantiles and what matters most.

The pad stays a block, so that each force, and with it the scatter, is known in closed form: F = E/(1 − ν²) · w d/h per unit of
thickness. `prensa.sweep` samples E and h, computes the cases and leaves a table and a page that compares them.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

import numpy as np
from common import figure, judged, options, saved
from scipy import stats

import prensa as pr
from prensa.output import style
from prensa.study.effects import effects
from prensa.study.results import Study
from prensa.verify.table import Row, row

E, E_DEVIATION = 10e3, 500.0  # MPa
H, H_DEVIATION = 10.0, 0.1  # mm
NU, WIDTH, DEPTH = 0.3, 20.0, 0.05
MODULUS, HEIGHT, FORCE = "bodies.pad.material.E", "bodies.pad.mesh.size.1", "punch.force.y"


def pad() -> pr.Problem:
    """The pad with its mean values: half of it, on a smooth base."""
    return pr.Problem(
        "pad",
        kinematics="small",
        bodies={"pad": pr.Body(pr.Rectangle((WIDTH / 2, H), (4, 4)), pr.Elastic(E=E, nu=NU))},
        tools={"punch": pr.Plane(touching="pad.top")},
        contacts=(pr.Contact("pad.top", "punch", enforcement=pr.Exact()),),
        fixed={"pad.bottom": "y", "pad.left": "x"},
        steps=(pr.Step("press", move={"punch": pr.Motion(y=-DEPTH)}, increments=1),),
    )


def force(modulus: np.ndarray | float, height: np.ndarray | float) -> np.ndarray:
    """Force on the half pad (N/mm), in closed form."""
    return np.asarray(modulus) / (1 - NU**2) * (WIDTH / 2) * DEPTH / np.asarray(height)


def rows(study: Study, allowed: float) -> Iterator[Row]:
    """Every force, moments, quantiles and effects against the closed form."""
    exact = force(study[MODULUS], study[HEIGHT])
    yield row(
        "largest error of a force (%)", 0.0, 100 * float(np.abs(study[FORCE] / exact - 1).max()), 1e-6, "absolute"
    )
    # the product of two independent quantities: moments by Gauss-Hermite quadrature over the height
    z, w = np.polynomial.hermite_e.hermegauss(20)
    inverse = [float(np.sum(w * (H + H_DEVIATION * z) ** -k) / np.sum(w)) for k in (1, 2)]
    factor = float(force(1.0, 1.0))
    mean = factor * E * inverse[0]
    deviation = np.sqrt(factor**2 * (E**2 + E_DEVIATION**2) * inverse[1] - mean**2)
    ((_, _, ours, spread, at),) = study.quantiles(FORCE)
    yield row("mean", mean, ours, allowed / 20)
    yield row("standard deviation", float(deviation), spread, allowed)
    law = stats.norm(mean, deviation)  # nearly: the height scatters by 1 % only
    for share, value in zip((0.05, 0.5, 0.95), (at[0], at[2], at[4])):
        yield row(f"{100 * share:g} % quantile", float(law.ppf(share)), value, allowed / 8)
    found = {e.path: e.swing for e in effects(study.plan, study.rows, FORCE)}
    for path, share in ((MODULUS, E_DEVIATION / E), (HEIGHT, H_DEVIATION / H)):
        yield row(f"effect of {path}", 2 * float(stats.norm.ppf(0.95)) * share * mean, found[path], allowed / 3)


def main(argv: Sequence[str] | None = None) -> int:
    """Sample, compute, compare, draw; returns the exit code."""
    chosen = options(__doc__, "scatter_of_force", argv)
    study = pr.sweep(
        pad(),
        {MODULUS: stats.norm(E, E_DEVIATION), HEIGHT: f"normal({H:g} mm, 1 %)"},
        FORCE,
        samples=16 if chosen.quick else 64,
        out=chosen.out / "sweep",
        jobs=1,
        quiet=True,
    )
    failed = judged("Scatter of the force on a pad", list(rows(study, 0.2 if chosen.quick else 0.1)))
    with style.styled():
        made, axes = figure(5, 3.4)
        points = axes.scatter(study[MODULUS], study[FORCE], c=study[HEIGHT], cmap=style.SEQUENTIAL)
        axes.set_xlabel("modulus (MPa)")
        axes.set_ylabel("force (N/mm)")
        made.colorbar(points, ax=axes, label="height (mm)")
    saved(made, chosen.out / "scatter.png")
    print(f"page: {study.page}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
