"""Convergence studies: orders, limits and bands where the results have them, and a plain word where they have not."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from press import written
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.reference import tables
from prensa.study.order import observed

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("order", [0.7, 1.0, 2.0, 3.3])
@pytest.mark.parametrize("sizes", [[1, 0.5, 0.25], [4, 2, 1, 0.5], [0.3, 1.1, 0.7, 0.2, 2.0]])
def test_a_power_law_is_found(order: float, sizes: list[float]) -> None:
    """Results that follow y0 + a hᵖ have this order and limit, whatever the sizes and their sequence."""
    h = np.array(sizes)
    c = observed(h, 7.0 - 0.3 * h**order)
    assert c.has_order
    assert c.order == pytest.approx(order, abs=1e-4)
    assert c.limit == pytest.approx(7.0, abs=1e-6)
    assert abs(7.0 - 0.3 * h.min() ** order - 7.0) <= c.band


@pytest.mark.parametrize(
    ("results", "why"),
    [
        ([1.0, 1.1], "at least three|takes three"),
        ([1.0, 1.1, math.nan, math.nan], "takes three"),
        ([1.0, 1.1, 1.05], "up and down"),
        ([1.0, 1.2, 0.9, 1.15], "scatter|orders from|no power"),
        ([5.0, 5.0, 5.0, 5.0 + 1e-12], "same to round-off"),
        ([1.0, 1.1, 1.3, 1.6], "no power"),
        ([2.0, 3.0, 4.0], "no power"),
    ],
)
def test_where_there_is_no_order_that_is_said(results: list[float], why: str) -> None:
    """Too few results, results that go up and down, scatter, do not depend on the size or run away have no order."""
    import re

    c = observed(2.0 ** -np.arange(len(results)), np.array(results))
    assert not c.has_order and re.search(why, c.why), c.why
    assert math.isnan(c.order)
    known = [r for r in results if not math.isnan(r)]
    assert c.limit == known[-1] and c.band == pytest.approx(max(known) - min(known))


def test_the_band_holds_the_limit_of_results_with_scatter() -> None:
    """Of results with noise of a tenth of their last change, 95 % of the bands about the finest result hold the limit."""
    random, held, orders = np.random.default_rng(3), 0, 0
    h = np.array([1, 0.5, 0.25, 0.125])
    for _ in range(200):
        y = 1 + 0.1 * h**2 + 5e-4 * random.standard_normal(4)
        c = observed(h, y)
        orders += c.has_order
        held += c.has_order and abs(y[-1] - 1) <= c.band
    assert orders > 150 and held >= 0.95 * orders


@pytest.mark.slow
def test_example_1(tmp_path: Path) -> None:
    """The forces of the paper's Example 1 tend with an order to the layer's within 0.05 %; penalties do with the order 1.

    Where nodes come into contact one by one the shallowest depth shows no order, which is said. Steps make no difference.
    """
    at = ["end(cylinder.force.y, to 0.5 mm)", "end(cylinder.force.y, to 1 mm)", "cylinder.force.y"]
    study = pr.converge(
        EXAMPLES / "cylinder_on_block.yaml", at, mesh=[0.5, 1, 2, 4], penalty=[0.1, 1, 10], step=[1, 2, 3],
        changes={"bodies.block.mesh.n": [[40, 40]]}, out=tmp_path / "out", jobs=1, quiet=True,
    )  # fmt: skip
    for measure, force in zip(at, tables.EXAMPLE1_FORCE_REFERENCE_GEOMETRY, strict=True):
        mesh, penalty, step = (study[kind, measure] for kind in ("mesh", "penalty", "step"))
        assert mesh.limit == pytest.approx(force / 2, rel=5e-4)
        assert penalty.order == pytest.approx(1, abs=0.01)
        assert penalty.limit == pytest.approx(force / 2, rel=2e-3)  # of the mesh of 40 × 40
        assert not step.has_order and "same to round-off" in step.why
    assert [study["mesh", m].has_order for m in at] == [False, True, True]
    assert all(1.4 < study["mesh", m].order < 2.2 for m in at[1:])
    assert (study.study.directory / "index.html").stat().st_size > 10_000


def test_upsetting_with_friction_says_where_no_order_can_be_read(tmp_path: Path) -> None:
    """The force of an upsetting has an order; its largest pressure, at the corner, grows without limit, and that is said."""
    study = pr.converge(
        EXAMPLES / "upsetting.yaml", ["punch.force.y", "punch.max.pressure"], mesh=[0.5, 1, 2],
        changes={"bodies.billet.mesh.n": [[8, 6]], "steps.0": [{"name": "press", "move": {"punch": {"y": -0.75}}}]},
        out=tmp_path / "out", jobs=1, quiet=True,
    )  # fmt: skip
    force, pressure = (study["mesh", m] for m in ("punch.force.y", "punch.max.pressure"))
    assert force.has_order and 0.5 < force.order < 2.5 and force.band < 1e-2 * force.limit
    assert not pressure.has_order
    assert "no convergence order" in repr(study)


def test_levels_that_fail_are_reported_and_the_others_count(tmp_path: Path) -> None:
    """A level that cannot be computed has its reason among the lines; automatic increments are counted first."""
    path = written(tmp_path)
    text = path.read_text().replace(", increments: 3", "").replace(", increments: 2", "")
    path = written(tmp_path, "automatic.yaml", text)
    result = CliRunner().invoke(
        app, ["converge", str(path), "--step", "0.5,1,2", "--measure", "end(punch.fy, down)", "--jobs", "1", "--quiet",
              "--out", str(tmp_path / "out")]
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    counts = [line.split(",")[1] for line in (tmp_path / "out" / "table.csv").read_text().splitlines()[1:]]
    assert float(counts[2]) == 2 * float(counts[1]) > 8
    assert "step: end(punch.fy, down)" in result.output


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (["--mesh", "1,2"], "at least three"),
        (["--mesh", "0,1,2"], "numbers above 0"),
        (["--mesh", "fine"], "give factors"),
        (["--penalty", "auto", "--set", "contacts.0.enforcement={type: exact}"], "no penalty to refine"),
        (["--step", "0.01,0.02,0.03"], "give larger factors"),
        (["--mesh", "auto", "--set", "bodies.block.mesh.n=[4, 2], [8, 4]"], "one value each"),
    ],
)
def test_what_cannot_be_refined_is_refused(tmp_path: Path, asked: list[str], words: str) -> None:
    """One line before anything is computed."""
    path = written(tmp_path)
    command = ["converge", str(path), *asked, "--measure", "punch.fy", "--jobs", "1", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2 and words in result.output and len(result.output.splitlines()) == 1, result.output
    assert not (tmp_path / "out").exists()
