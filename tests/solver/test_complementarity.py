"""Linear complementarity by Lemke's method, against all active sets in turn and where many pairs are degenerate."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from prensa.solver.complementarity import complementary


def by_enumeration(L, R, b):
    """Every solution of L y − R x = b, x, y ≥ 0, x y = 0 among the 2ⁿ choices of which of each pair is zero."""
    n, found = len(b), []
    for takes_x in itertools.product([False, True], repeat=n):
        takes = np.array(takes_x)
        try:
            z = np.linalg.solve(np.where(takes, -R, L), b)
        except np.linalg.LinAlgError:
            continue
        if (z >= -1e-12).all():
            found.append((np.where(takes, z, 0.0), np.where(takes, 0.0, z)))
    return found


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("family", ["definite", "unsymmetric", "singular"])
def test_it_finds_what_enumeration_finds(family, seed):
    """With a definite response the solution is the only one of the 2ⁿ candidates; friction makes the response unsymmetric."""
    rng = np.random.default_rng(seed)
    n = 8
    A = rng.standard_normal((n, n))
    S = A @ A.T + 0.1 * np.eye(n)
    if family == "unsymmetric":
        S = S @ np.diag(1.0 + 0.2 * rng.random(n)) + 0.05 * (A - A.T)
    if family == "singular":
        # a body that is free to move: one force pushes all points alike, and the foundation alone resists
        S = np.linalg.inv(np.eye(n) - 0.999999 * np.full((n, n), 1.0 / n)) / 0.1
        S = S / np.linalg.norm(S, 2) * 10.0
    share = 0.1 / max(1.0, np.linalg.norm(S, 2))
    L, R = np.eye(n) - share * S, np.eye(n) + (1 - share) * S
    b = rng.standard_normal(n)
    answers = by_enumeration(L, R, b)
    assert len(answers) == 1
    found = complementary(L, R, b)
    assert found is not None
    for ours, exact in zip(found, answers[0]):
        np.testing.assert_allclose(ours, exact, atol=1e-9 * np.abs(exact).max())


def test_a_beam_between_two_flat_tools_has_pairs_of_all_sizes():
    """A strip that is soft in bending rests on points whose forces are many orders apart: each has the right one of its pair."""
    n, h = 60, 1.0 / 60
    D = (np.diag(-2 * np.ones(n)) + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1)) / h**2
    K = 1e-6 * h * D.T @ D  # bending
    spring = 1.0
    share = 1e-4
    base = np.linalg.inv(K + share * spring * np.eye(n))
    load = np.zeros(n)
    load[20], load[21] = 1e-3, -1.2e-3
    S = spring * base
    left, right = np.eye(n) - share * S, np.eye(n) + (1 - share) * S
    found = complementary(left, right, -spring * (base @ load))
    assert found is not None
    p, g = found
    assert (p >= 0).all() and (g >= 0).all() and (p * g == 0).all()
    # equilibrium of the beam by its own matrix under the load and the pressures of the obstacle that it sinks into
    u = (p - g) / spring
    np.testing.assert_allclose(K @ u + p, load, atol=1e-12)


def test_nothing_to_solve_is_solved():
    """Without a right-hand side all is zero; what is not finite has no answer."""
    x, y = complementary(np.eye(3), np.eye(3), np.zeros(3))
    assert not x.any() and not y.any()
    assert complementary(np.full((2, 2), np.nan), np.eye(2), np.ones(2)) is None


def test_equations_that_contradict_each_other_have_no_solution_and_no_warning():
    """A matrix that is singular on the way ends the search; nothing is printed, and nothing is made up."""
    L = R = np.ones((2, 2))
    assert complementary(L, R, np.array([1.0, -1.0])) is None
