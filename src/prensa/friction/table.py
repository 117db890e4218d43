"""Piecewise cubics of one number, constant before the first and beyond the last knot."""

from __future__ import annotations

from typing import Any, NamedTuple

from prensa.kernels.record import cell, piece, where


class Table(NamedTuple):
    """``knots`` (k,), ``first`` to ``last``, ``coefficients`` (k − 1, 4), highest power first; of recorded laws their names."""

    knots: Any
    coefficients: Any
    first: Any
    last: Any

    def __call__(self, x: Any) -> Any:
        """Value at x, an array or a recorded number."""
        x = where(x > self.first, x, self.first)
        number = piece(x, self.knots)
        d = where(x < self.last, x, self.last) - cell(number, self.knots, 1, 0)
        c = [cell(number, self.coefficients, 4, i) for i in range(4)]
        return ((c[0] * d + c[1]) * d + c[2]) * d + c[3]
