"""Stick and slip decided together with the pressures: the complementarity problem, its method, and strips that roll freely."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import prensa as pr
from prensa.solver.complementarity import complementary
from problems import pressed_block


@pytest.mark.parametrize("seed", range(8))
def test_pivots_find_what_enumeration_finds(seed):
    """A matrix with positive principal minors has one solution, whichever signs its unsymmetric part has."""
    rng = np.random.default_rng(seed)
    n = 7
    A = rng.standard_normal((n, n))
    M = A @ A.T + 0.1 * np.eye(n) + 3.0 * (A - A.T)
    q = rng.standard_normal(n)
    answers = []
    for takes in itertools.product([False, True], repeat=n):
        values = np.linalg.solve(np.where(takes, -M, np.eye(n)), q)
        if (values >= 0).all():
            answers.append(np.where(takes, values, 0.0))
    assert len(answers) == 1
    z, w = complementary(np.eye(n), M, q)
    np.testing.assert_allclose(z, answers[0], atol=1e-9 * max(1.0, np.abs(z).max()))
    np.testing.assert_allclose(w, M @ z + q, atol=1e-9 * max(1.0, np.abs(w).max()))


def test_a_problem_without_a_solution_has_none():
    """Where w = q can only be negative the method ends on a ray; where q ≥ 0 nothing moves."""
    assert complementary(np.eye(2), np.zeros((2, 2)), -np.ones(2)) is None
    z, w = complementary(np.eye(2), np.eye(2), np.ones(2))
    assert (w == 1).all() and not z.any()


def rolling(friction):
    """A thin strip drawn into the gap of a roll at a given speed, then released."""
    R, h, out = 20.0, 1.0, 0.85
    length = 6.0
    return pressed_block(
        pr.Step("bite", move={"roll": pr.Motion(rz=0.14)}, fixed={"strip.left": pr.Fixed(x=2.6)}),
        pr.Step("roll", move={"roll": pr.Motion(rz=0.18)}, fixed={"strip.left": "free"}),
        tools={"roll": pr.Circle(radius=R, at=(0.0, R + out))},
        material=pr.J2(E=100000.0, nu=0.3, flow=pr.Perfect(s0=150.0)), size=(length, h), n=(24, 3),
        origin=(-length - 2.45, 0.0), body="strip", friction=friction, fixed={"strip.bottom": "y"},
    )  # fmt: skip


def test_a_strip_that_rolls_freely_goes_to_its_end():
    """All points slip wherever the neutral point passes between nodes, and only those that stick next hold the strip."""
    increments = list(pr.solve(rolling(pr.Coulomb(0.12))))
    last = increments[-1]
    assert last.time == 2.0
    # nothing pulls at it any more: the roll's forces on the strip balance along it
    assert abs(last.force("roll").x) < 1e-6 * last.force("roll").y
    assert sum(i.statistics.cutbacks for i in increments) <= 2
    assert sum(i.statistics.iterations for i in increments) <= 4 * len(increments)
