"""Information of an experiment, against the Fisher information of upsetting without friction in closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.errors import ArgumentError
from prensa.inverse.tables import Table
from problems import single_block, stroke

K, N = "bodies.billet.material.flow.K", "bodies.billet.material.flow.n"
RADIUS, HEIGHT, PRESSED, ROWS = 5.0, 6.0, 2.0, 8


def billet() -> pr.Problem:
    """One element that is upset without friction, of σ_y = 500 ε̄^0.2 and next to no elasticity."""
    return single_block(
        stroke(-PRESSED, increments=8, tool="die"), tools={"die": pr.Plane(touching="billet.top")},
        material=pr.J2(2e7, 0.3, pr.Ludwik(1e-3, 500.0, 0.2)), size=(RADIUS, HEIGHT), n=(1, 1), body="billet",
        fixed={"billet.bottom": "y"}, space="axisymmetric", friction=pr.Coulomb(0.0),
    )  # fmt: skip


def halves(error: str, gain: float) -> np.ndarray:
    """Half widths of K and n, relative, from F = K ln(h₀/h)ⁿ A₀h₀/h with a factor that is known to ``gain``."""
    height = HEIGHT - PRESSED * np.arange(1, ROWS + 1) / ROWS
    strain = np.log(HEIGHT / height)
    force = 500 * strain**0.2 * np.pi * RADIUS**2 * HEIGHT / height
    sigma = 0.01 * (force if error == "1 % of reading" else force.max()) * np.ones(ROWS)
    J = np.column_stack([force, force * 0.2 * np.log(strain), gain * force]) / sigma[:, None]
    information = J.T @ J + np.diag([0.0, 0.0, 1.0])
    return np.asarray(1.96 * np.sqrt(np.diag(np.linalg.inv(information)))[:2])


@pytest.mark.parametrize("error", ["1 %", "1 % of reading"])
@pytest.mark.parametrize("gain", [0.0, 0.02])
def test_expected_intervals_are_those_of_the_fisher_information(error: str, gain: float) -> None:
    """Strength and exponent from a force, with and without a load cell that is known to 2 %."""
    seen = {"force": pr.Observe("die.force.y", sigma=error, gain=gain or None)}
    found = pr.identify(billet(), seen, [K, N], rows=ROWS)
    assert found.plans["all readings"] == pytest.approx(halves(error, gain), rel=2e-3)


def test_pressing_further_and_another_column_count_as_they_should() -> None:
    """Stopped halfway: the rows up to there; a second column of the same force halves the variance."""
    one = pr.identify(billet(), {"force": "die.force.y"}, [K, N], rows=ROWS)
    two = pr.identify(billet(), {"force": "die.force.y", "again": "die.force.y"}, [K, N], rows=ROWS)
    assert two.plans["all readings"] == pytest.approx(one.plans["all readings"] / np.sqrt(2), rel=1e-6)
    assert two.plans["without again"] == pytest.approx(one.plans["all readings"], rel=1e-6)
    stopped = one.plans["stopped at 50 % of the time"]
    assert (stopped > one.plans["all readings"]).all()
    # in a run that ends there the same rows are all there are, but 1 % is then of a smaller largest reading
    half = pr.identify(billet(), {"force": pr.Observe("die.force.y", sigma="1 % of reading")}, [K, N], rows=ROWS)
    assert half.plans["stopped at 50 % of the time"][0] > half.plans["all readings"][0]


def test_a_test_with_a_table_counts_as_one_that_is_planned() -> None:
    """Places and errors of a table's readings are taken, what was read is not; a second test is worth as much as the first."""
    planned = pr.identify(billet(), {"force": pr.Observe("die.force.y", sigma=800.0)}, [K, N], rows=ROWS)
    time = np.arange(1, ROWS + 1) / ROWS
    table = Table("t", {"time": time, "force": np.full(ROWS, 1.0)}, {"time": "", "force": ""})
    test = pr.Test(billet(), table, {"force": pr.Observe("die.force.y", sigma=800.0)})
    one = pr.identify(tests=[test], parameters=[K, N])
    for plan, halves_of in planned.plans.items():
        assert one.plans[plan] == pytest.approx(halves_of, rel=1e-9), plan
    two = pr.identify(tests=[test, replace(test, name="again")], parameters=[K, N])
    assert two.plans["all readings"] == pytest.approx(planned.plans["all readings"] / np.sqrt(2), rel=1e-9)
    assert two.plans["without force of again"] == pytest.approx(planned.plans["all readings"], rel=1e-9)
    with pytest.raises(ArgumentError, match="not both"):
        pr.identify(billet(), tests=[test], parameters=[K])


def test_a_calibration_file_is_identified() -> None:
    """`prensa identify` reads tests and parameters from the file, and refuses options that the file has."""
    file = str(Path(__file__).parents[2] / "examples" / "calibration" / "ring_test_fit.yaml")
    result = CliRunner().invoke(app, ["identify", file])
    assert result.exit_code == 0, result.output
    assert "only the last bore" in result.output
    result = CliRunner().invoke(app, ["identify", file, "--rows", "5"])
    assert result.exit_code == 2
    assert "leave --rows out" in result.output
