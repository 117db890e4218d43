"""Euler's load and the elastica."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from prensa.reference import elastica_clamped, euler_clamped

COLUMN = {"E": 1e5, "length": 40.0, "thickness": 1.0}


def test_the_elastica_starts_at_eulers_load_with_its_initial_slope():
    """Just beyond buckling P/Pcr grows by half the shortening over the length; below it the column is a straight bar."""
    critical = euler_clamped(**COLUMN)
    assert critical == pytest.approx(4 * math.pi**2 * 1e5 / 12 / 1600)
    axial = 1e5 / 40.0
    start = critical / axial
    assert elastica_clamped(0.5 * start, **COLUMN) == pytest.approx(0.5 * critical)
    small = 1e-3 * 40.0
    assert elastica_clamped(start + small, **COLUMN) / critical - 1 == pytest.approx(0.5e-3, rel=0.01)


@pytest.mark.parametrize("ratio", [1.01, 1.1, 1.5])
def test_the_elastica_solves_its_differential_equation(ratio):
    """Integrated as an initial value problem from an inflection, a quarter of the column turns back upright at its end."""
    critical = euler_clamped(**COLUMN)
    force, stiff = ratio * critical, 1e5 / 12

    def shape(angle: float):
        # from the point of inflection, where the moment vanishes and the angle is largest, to where it is zero
        def rate(s, y):
            return [y[1], -force / stiff * math.sin(y[0]), math.cos(y[0])]

        return solve_ivp(rate, (0.0, 10.0), [angle, 0.0, 0.0], rtol=1e-10, atol=1e-12).y[:, -1]

    low, high = 1e-6, 3.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if shape(middle)[0] < 0 else (low, middle)
    shortening = 4 * (10.0 - shape(low)[2]) + force * 40.0 / 1e5
    assert elastica_clamped(shortening, **COLUMN) == pytest.approx(force, rel=1e-6)


def test_arguments_that_mean_nothing_are_refused():
    """A shortening is above zero and below the length."""
    for shortening in (0.0, -1.0, 40.0, np.inf):
        with pytest.raises(ValueError, match="shortening"):
            elastica_clamped(shortening, **COLUMN)
