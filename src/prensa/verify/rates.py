"""Orders of convergence in the table: observed on three meshes or more, and results extrapolated with them.

Where results go up and down from mesh to mesh no order can be read off, and a row states that with their spread: nodes of a
side come into contact one by one, which a curved tool shows as a scatter of the forces of the order of their error.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from prensa.study.order import Convergence, observed
from prensa.types import Array
from prensa.verify.table import Row, row


def convergence(n: Sequence[int], results: Sequence[float]) -> Convergence:
    """Order and limit of results on meshes of n elements along the same length."""
    return observed(1.0 / np.array(n, dtype=float), np.array(results))


def order_row(
    quantity: str, n: Sequence[int], results: Sequence[float], expected: float, kind: Literal["at least", "report"] = "report"
) -> Row:  # fmt: skip
    """The observed order beside the ``expected`` one; of the kind `report` the spread of results that have no order.

    ``at least``: the order is judged, and results without one fail.
    """
    found, meshes = convergence(n, results), ", ".join(map(str, n))
    if found.has_order or kind == "at least":
        return row(f"{quantity}: order from n = {meshes}", expected, found.order, 0.0, kind)
    spread = 100.0 * float(np.ptp(results)) / abs(results[-1])
    return row(f"{quantity}: no order from n = {meshes} ({found.why}); spread (%)", 0.0, spread, 0.0, kind)


def order_rows(
    quantities: Sequence[str], n: Sequence[int], results: Sequence[Sequence[float]], expected: float
) -> Iterator[Row]:  # fmt: skip
    """Reports of the orders of several quantities (k,) from their results (meshes, k)."""
    for quantity, of_meshes in zip(quantities, zip(*results, strict=True), strict=True):
        yield order_row(quantity, n, of_meshes, expected)


def root_mean_square(errors: Array) -> float:
    """Of errors (n,)."""
    return float(np.sqrt((errors**2).mean()))
