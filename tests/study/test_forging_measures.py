"""Damage, wear, filling and surface in sweeps, fits and derivatives: as single runs have them, and as differences of runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.measures import parse
from problems import ALUMINIUM, stroke, upset_block

MEASURES = {
    "damage": "max(b.max.damage)", "equator": "b.right.damage at Y=0.5", "wear": "t.wear", "fill": "b.fill",
    "missing": "b.missing_volume", "grown": "b.top.surface_expansion", "slid": "t.max.sliding_distance",
    "triaxiality": "b.max.triaxiality", "angle": "b.folding_angle", "used": "t.press_utilisation",
}  # fmt: skip
MU = "friction.mu"


def boxed(mu: float = 0.1, **more: object) -> pr.Problem:
    """A block of aluminium with damage between punch and base in a box that it does not fill."""
    tools = {"wall": pr.Plane(normal=(-1, 0), at=(3.0, 0)), "t": pr.Plane(touching="b.top", press=9e3)}
    p = upset_block(
        stroke(-0.5, 6), space="axisymmetric", material=ALUMINIUM, size=(2.0, 2.0), n=(4, 4), tools=tools,
        contacts=[pr.Contact(("b.top", "b.right"), "t"), pr.Contact("b.right", "wall")], fixed={"b.bottom": "y", "b.left": "x"},
        friction=pr.Coulomb(mu), **more,
    )  # fmt: skip
    return replace(p, bodies={"b": replace(p.bodies["b"], damage=(pr.Freudenthal(),))})


def test_a_sweep_has_what_single_runs_have(tmp_path: Path) -> None:
    """Each measure of each case is that of a run with its friction; the page of the sweep draws them."""
    study = pr.sweep(boxed(measures=MEASURES), {MU: [0.05, 0.2]}, list(MEASURES), out=tmp_path, jobs=1, quiet=True)
    assert study.status["completed"] == 2 and (tmp_path / "index.html").is_file()
    for row in (dict(zip(study.columns, cells)) for cells in study.cells()):
        problem = boxed(float(row[MU]))
        *_, last = pr.solve(problem)
        for name, text in MEASURES.items():
            value = last.measure(text.removeprefix("max(").removesuffix(")"))
            assert float(row[name]) == pytest.approx(value, rel=1e-9), name
    first, second = ([float(dict(zip(study.columns, c))[n]) for n in ("wear", "grown")] for c in study.cells())
    assert first[0] > second[0] and first[1] > second[1]  # rougher: the face slides and grows less


def test_a_fit_finds_friction_from_damage_wear_and_surface(tmp_path: Path) -> None:
    """Exact readings of three measures give back the friction that made them."""
    seen = {"damage": "b.right.damage at Y=0.5", "wear": "t.wear", "grown": "b.top.surface_expansion"}
    rows = ["punch [mm],damage [MPa],wear [N*mm],grown"]
    for i in pr.solve(boxed(0.15)):
        rows.append(",".join(f"{v:.12g}" for v in (-i.measure("t.uy"), *(i.measure(m) for m in seen.values()))))
    (tmp_path / "table.csv").write_text("\n".join(rows), encoding="utf-8")
    fit = pr.calibrate(
        boxed(0.3), tmp_path / "table.csv", seen, {MU: (0.02, 0.5)}, along="-t.uy", refine=False, compare=False, profiles=False,
        report=lambda line: None,
    )  # fmt: skip
    assert fit.parameters[MU].value == pytest.approx(0.15, rel=1e-5)


def plane(mu: float) -> pr.Problem:
    """Plane strain, a shear factor, damage by the mean stress, two Gauss points an edge."""
    p = upset_block(stroke(-0.3, 5), material=ALUMINIUM, size=(2.0, 2.0), n=(4, 4), fixed={"b.bottom": "y", "b.left": "x"},
                    contacts=[pr.Contact("b.top", "t", pr.Shear(mu), integration="gauss2")])  # fmt: skip
    return replace(p, bodies={"b": replace(p.bodies["b"], damage=(pr.Oyane(A=0.6),))})


def round_(mu: float) -> pr.Problem:
    """Axisymmetry, quadratic elements, exact enforcement, without damage: derivatives in closed form."""
    return upset_block(stroke(-0.3, 5), space="axisymmetric", material=ALUMINIUM, size=(2.0, 2.0), n=(4, 4),
                       contacts=[pr.Contact(("b.top", "b.right"), "t", pr.Coulomb(mu), enforcement=pr.Exact())])  # fmt: skip


@pytest.mark.parametrize(
    ("made", "mu", "path", "measures"),
    [
        (plane, 0.2, "contacts.0.friction.m", ("b.right.damage at Y=0.5", "t.wear", "b.top.surface_expansion")),
        (round_, 0.1, "contacts.0.friction.mu", ("t.wear", "b.top.surface_expansion", "b.right.x at y=0.2")),
    ],
)
def test_derivatives_by_friction_are_those_of_differences(made: object, mu: float, path: str, measures: tuple[str, ...]) -> None:
    """Two settings, central differences of whole runs: 1e-4."""
    *_, last = pr.solve(made(mu), derivatives=[path])
    ends = [list(pr.solve(made(mu * (1.0 + step))))[-1] for step in (-1e-3, 1e-3)]
    for text in measures:
        below, above = (parse(text, i.problem).value(i) for i in ends)
        found = last.derivative(text)[path]
        assert found == pytest.approx((above - below) / (2e-3 * mu), rel=1e-4), text
        assert np.isfinite(found) and found != 0.0
