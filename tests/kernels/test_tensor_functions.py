"""Isotropic functions of tensors in space against SciPy's and against principal axes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.linalg import expm, logm

from prensa.kernels import tensor_functions
from prensa.types import Array

PAIRS = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]


def six(m: Array) -> Array:
    """Components of a symmetric tensor (3, 3)."""
    return np.array([m[i, j] for i, j in PAIRS])


def full(c: Array) -> Array:
    """Symmetric tensor (3, 3) of six components."""
    out = np.empty((3, 3))
    for x, (i, j) in zip(c, PAIRS):
        out[i, j] = out[j, i] = x
    return out


def strains(size: float) -> Iterator[Array]:
    """Random symmetric tensors with principal values up to a size, all different, two and three alike."""
    rng = np.random.default_rng(3)
    for k in range(12):
        Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        w = rng.uniform(-size, size, 3)
        w[: k % 3 + 1] = w[0]
        yield Q @ np.diag(w) @ Q.T


def columns(m: Array) -> list[Array]:
    """As the functions take them."""
    return [np.array([x]) for x in six(m)]


@pytest.mark.parametrize("size", [1e-9, 1e-3, 0.05, 0.4, 1.0])
def test_logarithm_and_exponential_are_those_of_scipy(size: float) -> None:
    """½ ln b and exp 2e − I, to round-off of the largest component."""
    for e in strains(size):
        b = expm(2.0 * e) - np.eye(3)
        found = np.ravel(tensor_functions.exponential(columns(e)))
        if size > 1e-3:
            assert np.abs(found - six(b)).max() <= 1e-14 * np.abs(b).max()
            strain = np.ravel(tensor_functions.logarithm(columns(b)))
            assert np.abs(strain - six(0.5 * np.real(logm(b + np.eye(3))))).max() <= 1e-13 * size
        # SciPy's b − I has lost digits of small strains: there and back again
        back = np.ravel(tensor_functions.logarithm([np.array([x]) for x in found]))
        assert np.abs(back - six(e)).max() <= 1e-14 * size


@pytest.mark.parametrize("size", [1e-6, 0.02, 0.5, 1.0])
def test_conjugate_stresses_are_those_in_principal_axes(size: float) -> None:
    """Components between principal axes of the strain become δ/sinh δ of themselves (Hoger 1987)."""
    rng = np.random.default_rng(4)
    for e in strains(size):
        s = full(rng.normal(size=6))
        w, Q = np.linalg.eigh(e)
        d = w[:, None] - w[None, :]
        factor = np.where(np.abs(d) < 1e-9, 1.0, d / np.sinh(np.where(d == 0.0, 1.0, d)))
        found = np.ravel(tensor_functions.conjugate(columns(s), columns(e)))
        assert np.abs(found - six(Q @ (factor * (Q.T @ s @ Q)) @ Q.T)).max() <= 1e-13 * np.abs(s).max()


def test_conjugate_stresses_of_principal_strains_too_far_apart_are_no_numbers() -> None:
    """Where its series would be wrong there is no answer."""
    e = np.diag([1.4, 0.0, -1.4])
    assert np.isnan(np.ravel(tensor_functions.conjugate(columns(np.ones((3, 3))), columns(e)))).any()
