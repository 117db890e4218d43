"""Eight points at a time between arrays and the scratch of kernels."""

from __future__ import annotations

import numpy as np
import pytest

from prensa.kernels import lanes
from prensa.kernels.compiled import njit


@njit()
def there_and_back(points, rows, out):
    """Columns 0 … 7, 2 … 6 and 6 … 9 of points (n, 10) → rows (17, 16), and from there → out (n, 10)."""
    flat, last = rows.ravel(), len(points) - 1
    lanes.to_be_read(points, 80, 10)
    lanes.to_be_written(out, 80, 10)
    lanes.into_rows(points, 0, 10, last, flat, 0, 16)
    lanes.five_into_rows(points, 2, 10, last, flat, 8 * 16, 16)
    lanes.four_into_rows(points, 6, 10, last, flat, 13 * 16, 16)
    lanes.out_of_rows(out, 0, 10, last, flat, 0, 16)
    lanes.five_out_of_rows(out, 0, 10, last, flat, 8 * 16, 16)
    lanes.four_out_of_rows(out, 6, 10, last, flat, 13 * 16, 16)


@pytest.mark.parametrize("n", [1, 3, 8])
def test_numbers_of_points_go_into_rows_and_back(n: int) -> None:
    """Rows have a number of each point, places of points that are not there have the last one's; out gets those columns alone."""
    points = np.random.default_rng(0).standard_normal((n, 10))
    rows, room = np.full((17, 16), np.nan), np.full((n + 1, 10), np.nan)
    there_and_back(points, rows, room[:n])
    columns = [*range(8), *range(2, 7), *range(6, 10)]
    there = points[np.minimum(np.arange(8), n - 1)]
    np.testing.assert_array_equal(rows[:, :8], there[:, columns].T)
    assert np.isnan(rows[:, 8:]).all()
    np.testing.assert_array_equal(room[:n], points[:, [2, 3, 4, 5, 6, 5, 6, 7, 8, 9]])
    assert np.isnan(room[n]).all()


def test_points_lie_in_order() -> None:
    """What is not in C order is refused when a kernel is compiled for it."""
    with pytest.raises(Exception, match="C order"):
        there_and_back(np.zeros((10, 4)).T, np.zeros((17, 16)), np.zeros((4, 10)))
