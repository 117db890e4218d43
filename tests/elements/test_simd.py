"""Elements that are answered for eight at a time."""

from __future__ import annotations

import numpy as np
import pytest

from prensa.elements import q4
from prensa.kernels.lanes import WIDE


@pytest.mark.parametrize("finite", [False, True])
@pytest.mark.parametrize("axisymmetric", [False, True])
def test_an_element_answers_the_same_whoever_stands_beside_it(axisymmetric: bool, finite: bool) -> None:
    """Gradients, forces and stiffnesses of an element have the same bits alone and among any number of others.

    Of one element the increment is large, so that in axisymmetry its α is not found as that of the others; forces are the same
    with and without stiffness.
    """
    rng, n = np.random.default_rng(0), 4 * WIDE + 3
    x = np.array([[3.0, 0.0], [4.0, 0.0], [4.0, 1.0], [3.0, 1.0]]) + 0.1 * rng.standard_normal((n, 4, 2))
    d = 0.03 * rng.standard_normal((n, 4, 2))
    d[9] = [[0.0, 0.0], [0.0, 0.0], [-0.4, 0.0], [0.4, 0.0]]
    P, A = rng.standard_normal((n, 4, 5)), rng.standard_normal((n, 4, 5, 5))
    h, w, failed = np.empty((n, 4, 5)), np.empty((n, 4)), np.zeros(n, dtype=np.bool_)
    q4.kinematics(x, d, axisymmetric, finite, 1.0, h, w, failed)
    assert not failed.any()

    def answer(rows: slice, stiffness: bool) -> list[np.ndarray]:
        k = len(x[rows])
        out = [np.empty(k), np.empty((k, 8)), np.zeros((k, 8, 8))]
        at = [a[rows].copy() for a in (w, P, A)]
        q4.integrate(x[rows].copy(), d[rows].copy(), axisymmetric, finite, 1.0, *at, out[0], stiffness, *out[1:])
        return out

    kinematics = [h, w]
    for first, last in ((0, 1), (5, 20), (WIDE, WIDE + 1), (7, n)):
        k = last - first
        alone = [np.empty((k, 4, 5)), np.empty((k, 4))]
        q4.kinematics(x[first:last].copy(), d[first:last].copy(), axisymmetric, finite, 1.0, *alone, np.zeros(k, dtype=np.bool_))
        for some, others in zip(alone, kinematics):
            assert some.tobytes() == others[first:last].tobytes()
    assert np.array_equal(answer(slice(None), False)[1], answer(slice(None), True)[1])
    for stiffness in (False, True):
        every = answer(slice(None), stiffness)
        for first, last in ((0, 1), (5, 20), (WIDE, WIDE + 1), (7, n)):
            for some, others in zip(answer(slice(first, last), stiffness), every):
                assert some.tobytes() == others[first:last].tobytes()


def test_elements_with_a_point_that_has_little_area_are_counted() -> None:
    """Of any number of elements in finite strain those are to which `unfold` adds forces, and no others."""
    rng, n = np.random.default_rng(1), 2 * WIDE + 5
    x = np.array([[3.0, 0.0], [4.0, 0.0], [4.0, 1.0], [3.0, 1.0]]) + 0.005 * rng.standard_normal((n, 4, 2))
    d = np.zeros_like(x)
    for e in (2, WIDE, n - 1):
        d[e, 2] = [-0.6, -0.6]  # a corner beyond the line of its neighbours
    counts = []
    for first in range(n + 1):
        k = n - first
        out = [np.empty((k, 4, 5)), np.empty((k, 4)), np.zeros(k, dtype=np.bool_)]
        folds = q4.kinematics(x[first:].copy(), d[first:].copy(), True, True, 1.0, *out)
        counts.append(np.count_nonzero(folds))
        assert np.array_equal(q4.folding(x[first:], d[first:]), folds)
    assert counts == [sum(e >= first for e in (2, WIDE, n - 1)) for first in range(n + 1)]
    size, r = np.zeros(n), np.zeros((n, 8))
    q4.unfold(x, x, d, True, 1.0, size, False, r, np.empty((n, 8, 8)))
    assert np.flatnonzero(size).tolist() == [2, WIDE, n - 1]
