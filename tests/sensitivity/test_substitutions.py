"""Substitutions with factors of a matrix nearby lead to the solution, or say that they do not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse import csr_matrix

from prensa.sensitivity.substitutions import Substitutions

N = 30


def in_single(B: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Substitutions with factors of B in single precision, right-hand sides of length 1."""
    factors = lu_factor(B.astype(np.float32))

    def again(b: np.ndarray) -> np.ndarray:
        size = np.abs(b).max() or 1.0
        return size * np.asarray(lu_solve(factors, (b / size).astype(np.float32)), dtype=np.float64)

    return again


@pytest.mark.parametrize("seed", range(8))
def test_factors_nearby_lead_to_the_solution(seed: int) -> None:
    """To thirteen digits, from factors of another matrix in single precision."""
    rng = np.random.default_rng(seed)
    A = np.diag(rng.uniform(1.0, 2.0, N)) + 0.05 * rng.normal(size=(N, N))
    b, start = rng.normal(size=(2, N))
    x = Substitutions(N, 12, 1e-13).solve(csr_matrix(A), in_single(A + 1e-3 * rng.normal(size=(N, N))), b, start)
    assert x is not None
    exact = np.linalg.solve(A, b)
    assert np.linalg.norm(x - exact) <= 1e-12 * np.linalg.norm(exact)


@pytest.mark.parametrize("noise", [1e-3, 1e-2, 0.1, 1.0, 10.0])
@pytest.mark.parametrize("many", [1, 2, 3])
@pytest.mark.parametrize("seed", range(10))
def test_answers_with_noise_give_no_wrong_solution(noise: float, many: int, seed: int) -> None:
    """As factors of a nearly singular matrix in single precision answer: directions do not keep what they promise."""
    rng = np.random.default_rng(seed)
    A = np.diag(rng.uniform(1.0, 2.0, N)) + 0.05 * rng.normal(size=(N, N))
    inverse, soft = np.linalg.inv(A), np.linalg.qr(rng.normal(size=(N, many)))[0]

    def again(v: np.ndarray) -> np.ndarray:
        z = inverse @ v
        return np.asarray(z + noise * np.linalg.norm(z) * (soft @ rng.normal(size=many)))

    b, start = rng.normal(size=(2, N))
    x = Substitutions(N, 12, 1e-13).solve(csr_matrix(A), again, b, 0.1 * start)
    assert x is not None or noise > 1e-3 or many < 3
    if x is not None:
        exact = np.linalg.solve(A, b)
        assert np.linalg.norm(x - exact) <= 3e-11 * np.linalg.norm(exact)


def test_answers_that_change_nothing_are_given_up() -> None:
    """Nothing is learnt of a direction that leaves what there was."""
    A, b = np.eye(3), np.ones(3)
    assert Substitutions(3, 12, 1e-13).solve(csr_matrix(A), lambda v: np.array([0.0, 0.0, 1e-3]), b, np.zeros(3)) is None
