"""Residuals predicted along the stresses of flow curves: against differences, a fit in a bent valley, ends of profiles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_profile import Curve as Readings
from test_profile import _halves

import prensa as pr
from prensa.inverse.bends import Curve, LinearisedResiduals, curves_of
from prensa.inverse.profile import profile
from prensa.inverse.result import scattered
from rings import FLOW, MU, ring

Array = NDArray[np.float64]

OWN = Curve(pr.Ludwik(250.0, 450.0, 0.25), (0, 1, 2), ("s0", "K", "n"), (np.exp, np.exp, np.exp))


def near(x: Array, problem: Any) -> LinearisedResiduals:
    """Residuals predicted from unknowns."""
    at = problem.at(x)
    return LinearisedResiduals([OWN], x, at.r, at.J)


def test_slopes_are_those_of_what_is_predicted() -> None:
    """Where it begins and elsewhere, against differences; where it begins r and J are those given."""
    problem, x = Readings(0), np.log([300.0, 400.0, 0.3])
    model = near(x, problem)
    assert model.residuals(x) == pytest.approx(problem.at(x).r, rel=1e-12)
    assert model.slopes(x) == pytest.approx(problem.at(x).J, rel=1e-6)
    there = x + np.array([0.3, -0.2, 0.4])
    for k in range(3):
        step = 1e-4 * np.eye(3)[k]
        secant = (model.residuals(there + step) - model.residuals(there - step)) / 2e-4
        assert model.slopes(there)[:, k] == pytest.approx(secant, rel=1e-5, abs=1e-4)


def test_four_steps_go_down_a_bent_valley() -> None:
    """σ₀ + K εⁿ from numbers a factor of two off: χ² within 0.01 of the least in four steps, where Gauss and Newton are far."""
    problem = Readings(3)
    least = problem.least(np.log([250.0, 450.0, 0.25]), 0, 0.0)  # with σ₀ = 1, so more
    for along in (True, False):
        x = np.log([120.0, 900.0, 0.5])
        for _ in range(4):
            at = problem.at(x)
            step = np.linalg.lstsq(at.J, -at.r, rcond=None)[0]
            x = near(x, problem).least(x, x - 2.0, x + 2.0) if along else x + step
        final = problem.at(x)
        gain = final.square - float(np.sum((final.r - final.J @ np.linalg.lstsq(final.J, final.r, rcond=None)[0]) ** 2))
        assert (gain < 0.01) is along
        assert final.square < least or not along


@pytest.mark.parametrize("seed", [0, 3, 6])
def test_ends_take_two_runs(seed: int) -> None:
    """Within 3 % of each end χ², least over the others, passes 1.96² more than the least; two runs a side."""
    problem: Any = Readings(seed)
    x = np.log([250.0, 450.0, 0.25])
    for _ in range(12):
        x = near(x, problem).least(x, x - 2.0, x + 2.0)
    at, followed = problem.at(x), 0
    half = _halves(at)
    for i in range(3):
        problem.asked = 0
        found = profile(problem, x, at, i, half, (-np.inf, np.inf), [OWN])
        if not found.followed:
            continue
        followed += 1
        assert problem.asked <= 4
        for sign, end in ((-1.0, found.low), (1.0, found.high)):
            grown = [problem.least(x, i, x[i] + sign * share * end * half[i]) - at.square for share in (0.97, 1.03)]
            assert grown[0] < 1.96**2 < grown[1], (i, sign)
    assert followed


def test_curves_are_those_of_which_several_numbers_are_fitted() -> None:
    """Two numbers of a curve make one to follow, one does not; numbers that are not allowed have no stresses."""
    value = [np.exp] * 3
    assert curves_of(ring(), [MU, f"{FLOW}.K", "bodies.ring.material.E"], value) == []
    (found,) = curves_of(ring(), [MU, f"{FLOW}.n", f"{FLOW}.K"], value)
    assert (found.own, found.names) == ((1, 2), ("n", "K"))
    assert np.isnan(Curve(OWN.curve, (0,), ("n",), (lambda v: v,)).stresses(np.array([-3.0]))).all()


def test_errors_that_go_up_and_down() -> None:
    """Readings of one number, n of them, that change by c, each one way or the other, move it by c/√n."""
    assert scattered(np.ones((9, 1)), np.full(9, 0.6)) == pytest.approx([0.2])
