"""The linear solver seam: symmetric and general factorisations, and what happens when a matrix is not what it is said to be."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from scipy.sparse import csc_array, csc_matrix, diags, random_array, tril

from prensa.linear.factorisations import Factorisation, SingularError, Structure, available


def matrix(n: int, skew: float = 0.0) -> csc_matrix:
    """Indefinite matrix (n, n) with a symmetric pattern and an unsymmetric part."""
    side = np.linspace(0.3, 0.9, n - 1)
    a = diags([side + skew, np.where(np.arange(n) % 3, 2.0, -2.0), side - skew], [-1, 0, 1]).tocsc()
    a.sort_indices()
    return a


@pytest.mark.parametrize("solver", available("auto"))
def test_symmetric_and_general_factors_solve_a_symmetric_indefinite_matrix(solver):
    """LDLᵀ of the lower triangle and LU of the whole give the solution of a dense solve; new values reuse the analysis."""
    a, b = matrix(60), np.sin(np.arange(60.0))
    for symmetric, definite in ((True, True), (True, False), (False, False)):
        f = Factorisation(60, a.indptr, a.indices, solver, symmetric=symmetric, definite=definite)
        for scale in (1.0, -3.0):
            x = f.solve(scale * a.data, b)
            np.testing.assert_allclose(x, np.linalg.solve(scale * a.toarray(), b), rtol=1e-11)
        np.testing.assert_allclose(f.solve_with_factors(2 * b), 2 * x, rtol=1e-11)


@pytest.mark.parametrize("solver", available("auto"))
def test_a_definite_matrix_is_solved_and_one_that_is_not_after_all_too(solver):
    """LLᵀ where the solver has it; an indefinite matrix in between goes to LDLᵀ, and the next attempt begins anew."""
    a = matrix(60)
    definite = (a + diags(np.full(60, 10.0))).tocsc()
    definite.sort_indices()
    b = np.cos(np.arange(60.0))
    f = Factorisation(60, a.indptr, a.indices, solver, symmetric=True, definite=True)
    answers = []
    for data in (definite.data, a.data, definite.data):
        f.begin()
        answers.append(f.solve(data, b))
    np.testing.assert_allclose(answers[0], np.linalg.solve(definite.toarray(), b), rtol=1e-11)
    np.testing.assert_allclose(answers[1], np.linalg.solve(a.toarray(), b), rtol=1e-11)
    assert answers[0].tobytes() == answers[2].tobytes()


def test_an_unsymmetric_matrix_said_to_be_symmetric_is_found_by_its_residual(caplog):
    """The lower triangle alone would give another answer: the residual of the whole refuses it, and LU takes over."""
    a, b = matrix(60, skew=0.2), np.ones(60)
    f = Factorisation(60, a.indptr, a.indices, "rslab", symmetric=True)
    with caplog.at_level(logging.INFO, "prensa"):
        x = f.solve(a.data, b)
    np.testing.assert_allclose(x, np.linalg.solve(a.toarray(), b), rtol=1e-11)
    assert "rslab LDLᵀ (backward error" in caplog.text


@pytest.mark.parametrize("symmetric", [True, False])
def test_a_singular_matrix_is_refused_by_every_solver(symmetric):
    """A matrix with a nullspace, or with a NaN, raises instead of answering."""
    a = csc_matrix(np.array([[1.0, -1.0], [-1.0, 1.0]]))
    with pytest.raises(SingularError):
        Factorisation(2, a.indptr, a.indices, symmetric=symmetric).solve(a.data, np.array([1.0, 1.0]))
    with pytest.raises(SingularError, match="not numbers"):
        Factorisation(2, a.indptr, a.indices, symmetric=symmetric).solve(np.full(4, np.nan), np.ones(2))


def test_the_lower_triangle_is_that_of_scipy():
    """Pointers, rows and values of the lower triangle, columns without a diagonal entry or without any included."""
    rng = np.random.default_rng(3)
    full = random_array((40, 40), density=0.05, rng=rng, format="csc")
    full.sort_indices()
    structure = Structure(40, full.indptr, full.indices, "LDLᵀ", 1)
    indptr, indices, inside = structure.lower()
    expected = csc_array(tril(full))
    expected.sort_indices()
    assert (np.diff(full.indptr) == 0).any() and indptr.dtype == indices.dtype == np.int32
    assert indptr.tolist() == expected.indptr.tolist() and indices.tolist() == expected.indices.tolist()
    assert full.data[inside].tolist() == expected.data.tolist()
