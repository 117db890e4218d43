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
