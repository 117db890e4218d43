"""Rows of observed orders: what is judged, what is reported, and results that have no order."""

from __future__ import annotations

import math

import numpy as np
import pytest

from prensa.verify.rates import convergence, order_row, order_rows, root_mean_square

MESHES = (4, 8, 16)


def falling(order, limit=3.0):
    """Results on the meshes whose error falls with an order."""
    return [limit + 0.7 * n**-order for n in MESHES]


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0, 3.3])
def test_an_order_and_its_limit_are_found(order):
    """Of results that have one."""
    results = falling(order)
    assert order_row("P", MESHES, results, 1.0).ours == pytest.approx(order, rel=1e-4)
    assert convergence(MESHES, results).limit == pytest.approx(3.0, rel=1e-6)


def test_an_order_that_is_judged_fails_below_what_is_expected():
    """And where there is none; a report passes, with the spread of results that have none."""
    assert order_row("P", MESHES, falling(1.2), 1.0, "at least").passed
    assert not order_row("P", MESHES, falling(0.8), 1.0, "at least").passed
    scattered = [3.0, 3.3, 3.2]
    judged, reported = (order_row("P", MESHES, scattered, 1.0, kind) for kind in ("at least", "report"))
    assert math.isnan(judged.ours) and not judged.passed
    assert reported.passed and "no order from n = 4, 8, 16 (the results go up and down)" in reported.quantity
    assert reported.ours == pytest.approx(100.0 * 0.3 / 3.2)


def test_quantities_have_rows_of_their_own():
    """From results mesh by mesh."""
    rows = list(order_rows(("P", "M"), MESHES, list(zip(falling(1.0), falling(2.0))), 2.0))
    assert [r.ours for r in rows] == pytest.approx([1.0, 2.0], rel=1e-4)
    assert [r.quantity.split(":")[0] for r in rows] == ["P", "M"]


def test_a_root_mean_square():
    """Of two numbers."""
    assert root_mean_square(np.array([3.0, -4.0])) == pytest.approx(math.sqrt(12.5))
