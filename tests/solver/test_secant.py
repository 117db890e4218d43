"""Broyden's steps on factors that stay."""

from __future__ import annotations

import numpy as np

from prensa.solver.finish import Secant


def test_a_linear_system_is_solved_in_fewer_steps_than_by_the_factors_alone():
    """Finite termination: with K of rank two off K₀, at most 2·2 steps and the last one (Gay 1979), the chord needs many."""
    rng = np.random.default_rng(3)
    n = 12
    K = np.eye(n) + 0.3 * sum(np.outer(*rng.normal(size=(2, n))) / n for _ in range(2))
    b = rng.normal(size=n)
    secant, x = Secant(None), np.zeros(n)
    for _ in range(5):
        x = x + secant.step(b - K @ x)
    np.testing.assert_allclose(x, np.linalg.solve(K, b), rtol=1e-11)
    chord = np.zeros(n)
    for _ in range(5):
        chord = chord + (b - K @ chord)
    assert np.abs(chord - x).max() > 1e-6


def test_steps_below_round_off_teach_nothing():
    """A residual that a step leaves as it was, bit for bit, or a step of nothing, must not divide by zero."""
    z = np.array([1e-17, -2e-17])
    np.testing.assert_array_equal(Secant(z).step(z), z)
    np.testing.assert_array_equal(Secant(np.zeros(2)).step(z), z)
    again = Secant(None)
    np.testing.assert_array_equal(again.step(z), again.step(z))
