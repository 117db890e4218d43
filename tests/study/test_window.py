"""A window over two parameters: what is mapped, which runs are computed, and the commands that repeat them."""

from __future__ import annotations

import csv
import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.study.maps import Map
from prensa.study.results import Row
from prensa.study.sweep import sweep
from prensa.study.window import RUNS, grid, window

CASE = """
name: billet
space: axisymmetric
bodies: {b: {mesh: {type: rectangle, size: [4, 2], n: [2, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {t: {type: plane, touching: b.top, press: 2.2 kN}}
friction: {type: coulomb, mu: 0.1}
fixed: {b.bottom: y}
steps: [{name: press, move: {t: {y: -0.1}}, increments: 2}]
"""
VALUES = ["--set", "friction.mu=0:0.3:2", "--set", "steps.press.move.t.y=-0.05:-0.1:2"]


def case(folder: Path) -> Path:
    """The case in a file."""
    path = folder / "billet.yaml"
    path.write_text(CASE)
    return path


def test_every_run_is_repeated_by_its_line_and_none_computed_twice(tmp_path: Path) -> None:
    """The commands of window.csv give the values beside them; a window that is asked for again computes nothing."""
    path, out = case(tmp_path), tmp_path / "window"
    asked = ["window", str(path), *VALUES, "--limit", "max(t.fy)<=2000", "--out", str(out), "--jobs", "1", "-q"]
    assert CliRunner().invoke(app, asked).exit_code == 0
    with open(out / RUNS, newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4 and all((out / name).is_file() for name in ("window.png", "index.html", "table.csv"))
    words = shlex.split(rows[-1]["command"])
    assert words[0] == "prensa"
    assert CliRunner().invoke(app, [*words[1:], "--out", str(tmp_path / "again"), "-q"]).exit_code == 0
    force = pr.results(tmp_path / "again").history["t.fy"]
    assert float(rows[-1]["max(t.fy)"]) == force.max()
    times = (out / "timings.csv").read_text()
    assert CliRunner().invoke(app, [*asked, "--measure", "t.press_utilisation"]).exit_code == 0
    assert (out / "timings.csv").read_text() == times


def test_the_map_has_the_values_of_the_runs_where_they_belong(tmp_path: Path) -> None:
    """Of a problem in Python too, with the limit of its press by itself; ranges may fall."""
    values = {"friction.mu": "0:0.3:2", "steps.press.move.t.y": "-0.05:-0.1:2"}
    study = window(pr.load(case(tmp_path)), values, out=tmp_path / "w", jobs=1, quiet=True)
    assert [q.text for q in study.quantities] == ["max(t.press_utilisation)"]
    u, v, z = grid(study, "max(t.press_utilisation)", *study.plan.varied)
    assert np.array_equal(u, [0.0, 0.3]) and np.array_equal(v, [-0.1, -0.05])
    for row in study.rows:
        mu, y = (float(row.point.values[f.path]) for f in study.plan.varied)
        assert z[list(v).index(y), list(u).index(mu)] == row.value("max(t.press_utilisation)")
    assert (z[0] > z[1]).all() and (z[:, 1] > z[:, 0]).all()
    assert json.loads((tmp_path / "w" / "sweep.json").read_text())["name"] == "billet"


J2 = "type: j2, E: 1000, nu: 0.3, flow: {type: swift, K: 20, e0: 0.01, n: 0.2}"
METAL = CASE.replace("type: elastic, E: 1000, nu: 0.3", J2).replace("increments: 2", "increments: 5")


def test_runs_between_are_met_better_with_gradients(tmp_path: Path) -> None:
    """Held-out runs in all cells of a grid: ten times better than by values alone, with units as written."""
    path = tmp_path / "billet.yaml"
    path.write_text("units: {length: mm, force: N}" + METAL)
    asked, there = ["max(t.fy)", "t.wear"], ("friction.mu", "steps.press.move.t.y")
    study = window(path, {there[0]: "0.05:0.15:3", there[1]: "-300 um:-600 um:2"}, asked, out=tmp_path / "w", jobs=1, quiet=True)
    assert all("bicubic, by values and gradients; runs that are left out" in note for note in study.notes), study.notes
    u, v, _ = grid(study, asked[0], *study.plan.varied)
    between = {there[0]: "0.075, 0.125", there[1]: "-0.45"}
    held = sweep(path, between, asked, out=tmp_path / "held", jobs=1, quiet=True)
    rows = {at(row): row for row in study.rows}
    for text in asked:
        exact = [row.value(text) for row in held.rows]
        slopes = [np.array([[rows[x, y].slopes[text][p] for x in u] for y in v]) for p in there]
        known = Map(u, v, grid(study, text, *study.plan.varied)[2], slopes[0], 1e-3 * slopes[1])
        with_, without = (m.between(np.array([0.075, 0.125]), np.array([-450.0]))[0] - exact for m in (known, known.bilinear))
        assert np.abs(with_).max() < 0.1 * np.abs(without).max(), text


def at(row: Row) -> tuple[float, float]:
    """The two values of a run, as they are written."""
    return tuple(float(text.split()[0]) for text in row.point.values.values())  # type: ignore[return-value]


def test_without_derivatives_the_map_is_bilinear_and_says_why(tmp_path: Path) -> None:
    """A count has none, and a step that ends early has none by anything; what a run warned of stands in its line."""
    mu = "friction.mu"
    early = METAL.replace("increments: 5}", "increments: 5, until: {force: {t: {y: 400}}}}")
    for text, values, words in (
        (METAL, {mu: "0.1:0.3:2", "steps.press.increments": "2, 3"}, "cubic along friction.mu, linear else: no number at"),
        (early, {mu: "0.1:0.3:2", "steps.press.move.t.y": "-0.2:-0.3:2"}, "bilinear: step 'press' ends by its 'until'"),
    ):
        path = tmp_path / "billet.yaml"
        path.write_text(text)
        (note,) = window(path, values, out=tmp_path / words[:5], jobs=1, quiet=True).notes
        assert words in note, note
    with open(tmp_path / "cubic" / RUNS, newline="") as file:
        assert any("energy balance off by" in row["warnings"] for row in csv.DictReader(file))


def test_maps_are_exact_for_what_their_polynomials_hold() -> None:
    """Cubics along each parameter, linear without slopes; what is missing leaves its cells empty and no others."""
    u, v = np.array([0.0, 0.4, 1.0, 1.5]), np.array([-1.0, 0.0, 2.0])
    x, y = np.linspace(0.0, 1.5, 31), np.linspace(-1.0, 2.0, 13)

    def f(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return (x**3 - x)[None, :] + (2.0 * y**3 + y)[:, None]

    by_u, by_v = np.tile(3.0 * u**2 - 1.0, (3, 1)), np.tile((6.0 * v**2 + 1.0)[:, None], (1, 4))
    assert np.abs(Map(u, v, f(u, v), by_u, by_v).between(x, y) - f(x, y)).max() < 1e-12
    plane = 2.0 * u[None, :] - v[:, None]
    assert np.abs(Map(u, v, plane).between(x, y) - (2.0 * x[None, :] - y[:, None])).max() < 1e-12
    holed = f(u, v)
    holed[0, 0] = np.nan
    found = Map(u, v, holed, by_u, by_v).between(x, y)
    inside = (x[None, :] < 0.4) & (y[:, None] < 0.0)
    assert np.isnan(found[inside]).all() and np.isfinite(found[~inside]).all()
    assert Map(u, v, f(u, v), by_u, by_v).left_out() < 1e-12 < Map(u, v, f(u, v)).left_out()


@pytest.mark.parametrize(
    ("values", "limits", "says"),
    [
        ({"friction.mu": "0:0.3:2"}, [], "a window is over two parameters, and 1 have several numbers"),
        ({"friction.mu": "0:0.3:2", "thickness": "1"}, [], "over two parameters"),
        ({"friction.mu": "0:0.3:2", "steps.press.move.t.y": "-0.05:-0.1:2"}, ["t.fy"], "write MEASURE<=NUMBER"),
        ({"friction.mu": "0:0.3:2", "steps.press.move.t.y": "-0.05:-0.1:2"}, ["t.fz<=3"], "unknown measure 't.fz'"),
    ],
)
def test_what_makes_no_window_is_refused_before_anything_runs(values: dict, limits: list[str], says: str, tmp_path: Path) -> None:
    """In one line with the remedy."""
    with pytest.raises(pr.PrensaError, match=says):
        window(case(tmp_path), values, limits=limits, out=tmp_path / "w", jobs=1, quiet=True)
    assert not (tmp_path / "w").exists()


def test_a_measure_that_no_run_has_is_said_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a die that nothing closes: one sentence for all runs, a page without values, and no warning of NumPy."""
    values = {"friction.mu": "0:0.3:2", "steps.press.move.t.y": "-0.05:-0.1:2"}
    study = window(case(tmp_path), values, limits=["b.fill<=0.9"], out=tmp_path / "w", jobs=1, quiet=True)
    told = capsys.readouterr()
    said = " ".join((told.out + told.err).split())
    assert said.count("no closed die surrounds 'b'") == 1 and "3 more cases failed for the same reason" in said
    assert [row.status for row in study.rows] == ["failed"] * 4
    assert study.notes == ["b.fill: nothing is known: no run has a value"]
