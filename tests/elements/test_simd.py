"""Elements that are answered for eight at a time."""

from __future__ import annotations

import numpy as np
import pytest

from prensa.elements import q4
from prensa.elements.element import element_of
from prensa.elements.form import Form
from prensa.elements.solid import integrate, kinematics
from prensa.kernels.lanes import WIDE

SQUARE = np.array([[3.0, 0.0], [4.0, 0.0], [4.0, 1.0], [3.0, 1.0]])
TRIANGLE = SQUARE[:3]
CUBE = np.concatenate([np.append(SQUARE, np.full((4, 1), z), axis=1) for z in (0.0, 1.0)])
NODES = {
    "q4_fbar": SQUARE, "t3": TRIANGLE, "t6": np.concatenate([TRIANGLE, 0.5 * (TRIANGLE + np.roll(TRIANGLE, -1, axis=0))]),
    "q8": np.concatenate([SQUARE, 0.5 * (SQUARE + np.roll(SQUARE, -1, axis=0))]), "h8": CUBE, "h8_fbar": CUBE,
    "q4_bbar": SQUARE, "h8_bbar": CUBE,
}  # fmt: skip


@pytest.mark.parametrize("finite", [False, True])
@pytest.mark.parametrize(
    ("name", "axisymmetric"), [(n, a) for n in NODES for a in (False, True) if not (a and n[0] == "h")]
)
def test_an_element_answers_the_same_whoever_stands_beside_it(name: str, axisymmetric: bool, finite: bool) -> None:
    """Gradients, forces and stiffnesses of an element have the same bits alone and among any number of others.

    Of one element the increment is large, so that in axisymmetry its α is not found as that of the others; forces are the same
    with and without stiffness.
    """
    rng, n, element = np.random.default_rng(0), 4 * WIDE + 3, element_of(name)
    form, rows = (
        Form(element.nodes, element.points, element.layout.dimension, axisymmetric, finite, element.bar, element.mean_dilatation),
        element.table.rows,
    )
    q, c, m = form.points, form.components, form.dofs
    x = NODES[name] + 0.1 * rng.standard_normal((n, *NODES[name].shape)) * (0.3 if form.nodes > 4 else 1.0)
    d = 0.03 * rng.standard_normal(x.shape) * (0.3 if form.nodes > 4 else 1.0)
    if name in ("q4_fbar", "q4_bbar"):
        d[9] = [[0.0, 0.0], [0.0, 0.0], [-0.4, 0.0], [0.4, 0.0]]
    P, A = rng.standard_normal((n, q, c)), rng.standard_normal((n, q, c, c))
    h, w, failed = np.empty((n, q, c)), np.empty((n, q)), np.zeros(n, dtype=np.bool_)
    X = x + 0.02 * rng.standard_normal(x.shape)
    kinematics(form, X, x, d, rows, 1.0, h, w, failed)
    assert not failed.any()

    def answer(some: slice, stiffness: bool) -> list[np.ndarray]:
        k = len(x[some])
        out = [np.empty(k), np.empty((k, m)), np.zeros((k, m, m))]
        at = [a[some].copy() for a in (w, P, A)]
        integrate(form, x[some].copy(), d[some].copy(), rows, 1.0, *at, out[0], stiffness, *out[1:])
        return out

    found = [h, w]
    for first, last in ((0, 1), (5, 20), (WIDE, WIDE + 1), (7, n)):
        k = last - first
        alone = [np.empty((k, q, c)), np.empty((k, q))]
        places = (a[first:last].copy() for a in (X, x, d))
        kinematics(form, *places, rows, 1.0, *alone, np.zeros(k, dtype=np.bool_))
        for some, others in zip(alone, found):
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
    x = SQUARE + 0.005 * rng.standard_normal((n, 4, 2))
    d = np.zeros_like(x)
    for e in (2, WIDE, n - 1):
        d[e, 2] = [-0.6, -0.6]  # a corner beyond the line of its neighbours
    counts = [np.count_nonzero(q4.folding(x[first:].copy(), d[first:].copy())) for first in range(n + 1)]
    assert counts == [sum(e >= first for e in (2, WIDE, n - 1)) for first in range(n + 1)]
    size, r = np.zeros(n), np.zeros((n, 8))
    q4.unfold(x, x, d, True, 1.0, size, False, r, np.empty((n, 8, 8)))
    assert np.flatnonzero(size).tolist() == [2, WIDE, n - 1]
