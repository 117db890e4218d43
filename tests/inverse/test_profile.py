"""Profile likelihood: ends that a search over the other parameter confirms, and ellipses that are left alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from prensa.inverse.objective import Residuals
from prensa.inverse.profile import BENT_BY, FARTHEST, profile
from prensa.inverse.result import Interval

Array = NDArray[np.float64]
T = np.linspace(0.5, 4.0, 8)


class Decay:
    """Readings of a e^(−b t): b bends the problem; ``straight``: of a + b t, which does not."""

    def __init__(self, readings: Array, sigma: float, straight: bool = False) -> None:
        self.readings, self.sigma, self.straight = readings, sigma, straight

    def at(self, x: Array) -> Residuals:
        """Residuals and derivatives."""
        a, b = x
        if self.straight:
            y, J = a + b * T, np.column_stack([np.ones(len(T)), T])
        else:
            y, J = a * np.exp(-b * T), np.column_stack([np.exp(-b * T), -a * T * np.exp(-b * T)])
        return Residuals((y - self.readings) / self.sigma, J / self.sigma, [])

    def residuals(self, x: Array) -> Array:
        """Residuals alone."""
        return self.at(x).r


def _fitted(problem: Decay) -> tuple[Array, Residuals]:
    x = np.array([1.0, 0.7])
    for _ in range(100):
        at = problem.at(x)
        x = x + np.linalg.lstsq(at.J, -at.r, rcond=None)[0]
    return x, problem.at(x)


def _halves(at: Residuals) -> Array:
    return 1.96 * np.sqrt(np.diag(np.linalg.inv(at.J.T @ at.J)))


def test_a_straight_problem_keeps_its_ellipse() -> None:
    """Residuals that are linear in the parameters: nothing is bent, ends are those of the ellipse."""
    problem: Any = Decay(1.0 + 0.3 * T + 0.1 * np.cos(7 * T), 0.1, straight=True)
    x, at = _fitted(problem)
    for i in range(2):
        found = profile(problem, x, at, i, _halves(at), (-np.inf, np.inf))
        assert found.bent < 1e-6
        assert (found.low, found.high, found.followed) == (1.0, 1.0, False)


@pytest.mark.parametrize("number", [0, 1])
def test_ends_are_where_least_squares_has_grown_enough(number: int) -> None:
    """A bent problem: at the ends χ², made least over a fine grid of the other parameter, has grown by 1.96²."""
    noise = np.random.default_rng(1).standard_normal(len(T))
    problem: Any = Decay(np.exp(-0.7 * T) + 0.12 * noise, 0.12)
    x, at = _fitted(problem)
    halves = _halves(at)
    found = profile(problem, x, at, number, halves, (-np.inf, np.inf))
    assert found.followed
    assert found.bent > BENT_BY
    other = np.linspace(-1.0, 6.0, 200001)
    for end in (-found.low, found.high):
        value = x[number] + end * halves[number]
        # by hand: the amplitude is linear, so its best value is known for every rate; the rate is searched
        if number == 1:
            shape = np.exp(-value * T)
            left = problem.readings - shape * (shape @ problem.readings) / (shape @ shape)
            square = float(left @ left)
        else:
            square = float(((value * np.exp(-np.outer(other, T)) - problem.readings) ** 2).sum(axis=1).min())
        grown = square / 0.12**2 - at.square
        assert np.sqrt(grown) == pytest.approx(1.96, rel=0.03)
    assert found.low != pytest.approx(found.high, rel=0.02)


def test_a_bound_ends_a_profile_and_a_plain_has_no_end() -> None:
    """Beside a bound the interval ends there; where nothing is reported it has no end."""
    problem: Any = Decay(np.exp(-0.7 * T), 0.12)
    x, at = _fitted(problem)
    halves = _halves(at)
    found = profile(problem, x, at, 1, halves, (x[1] - 0.5 * halves[1], np.inf))
    assert found.low == pytest.approx(0.5)
    vague: Any = Decay(np.exp(-0.7 * T), 0.9)
    x, at = _fitted(vague)
    assert np.isinf(profile(vague, x, at, 1, _halves(at), (-np.inf, np.inf)).high)


class Curve:
    """Readings of σ₀ + K εⁿ by the logarithms of all three, which trade with each other: a flat valley that bends."""

    strain = np.linspace(0.03, 0.6, 20)

    def __init__(self, seed: int) -> None:
        y = 250.0 + 450.0 * self.strain**0.25
        self.sigma, self.asked = 0.01 * y, 0
        self.readings = y + self.sigma * np.random.default_rng(seed).normal(size=len(y))

    def at(self, x: Array) -> Residuals:
        """Residuals and derivatives."""
        self.asked += 1
        s, K, n = np.exp(x)
        power = K * self.strain**n
        J = np.column_stack([np.full_like(power, s), power, power * np.log(self.strain) * n])
        return Residuals((s + power - self.readings) / self.sigma, J / self.sigma[:, None], [])

    def residuals(self, x: Array) -> Array:
        """Residuals alone."""
        return self.at(x).r

    def least(self, x: Array, number: int, value: float) -> float:
        """Least χ² with one parameter held, by SciPy."""

        def all_of(others: Array) -> Array:
            return np.insert(others, number, value)

        found = least_squares(
            lambda y: self.at(all_of(y)).r, np.delete(x, number), x_scale="jac", xtol=1e-13, ftol=1e-13, gtol=1e-13,
            jac=lambda y: np.delete(self.at(all_of(y)).J, number, axis=1), max_nfev=3000,
        )  # fmt: skip
        return 2.0 * float(found.cost)


@pytest.mark.parametrize("seed", [0, 3, 6, 7])
def test_ends_in_a_flat_valley_are_where_the_likelihood_has_fallen(seed: int) -> None:
    """Within 3 % of each end χ², least over the others, passes 1.96² more than the least; an open end stays below it."""
    problem: Any = Curve(seed)
    x = least_squares(problem.residuals, np.log([250.0, 450.0, 0.25]), jac=lambda y: problem.at(y).J, xtol=1e-14, ftol=1e-14).x
    at = problem.at(x)
    half = _halves(at)
    for i in range(3):
        problem.asked = 0
        found = profile(problem, x, at, i, half, (-np.inf, np.inf))
        assert problem.asked <= (15 if seed < 7 else 40)
        for sign, end in ((-1.0, found.low), (1.0, found.high)):
            if np.isinf(end):
                assert seed == 7
                assert problem.least(x, i, x[i] + sign * FARTHEST * half[i]) - at.square < 1.96**2
                continue
            grown = [problem.least(x, i, x[i] + sign * share * end * half[i]) - at.square for share in (0.97, 1.03)]
            assert grown[0] < 1.96**2 < grown[1], (i, sign)


@pytest.mark.parametrize("log", [False, True])
def test_the_parts_of_an_interval_add_up(log: bool) -> None:
    """Value, what the readings leave open, and what the mesh changes, give the ends that are stated; open ends have no parts."""
    p = Interval(400.0, 30.0, -12.0, 500.0, log, scatter=20.0)
    assert p.low == pytest.approx(p.value - (p.value - p.ends[0]) - p.by_mesh[0], rel=1e-14)
    assert p.high == pytest.approx(p.value + (p.ends[1] - p.value) + p.by_mesh[1], rel=1e-14)
    assert p.by_mesh == pytest.approx((20.0, 20.0), rel=0.15 if log else 1e-12)
    side = Interval(0.0, 1.0, 0.1, 0.5, False, one_sided=(0.0, 0.2))
    assert side.ends == (side.low, side.high) == (0.0, 0.2) and side.by_mesh == (0.0, 0.0)
    assert Interval(400.0, np.inf, 1.0, 500.0, False).by_mesh == (0.0, 0.0)
