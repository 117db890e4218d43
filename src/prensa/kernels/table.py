"""Piecewise cubics of one number, constant beyond their ends."""

from __future__ import annotations

from typing import Any, NamedTuple

from prensa.kernels.record import cell, piece, where


class Table(NamedTuple):
    """``knots`` (k,), ``first`` to ``last``, ``coefficients`` (k − 1, 4), highest power first; of recorded laws their names.

    Without ``first`` nothing before it is asked for. ``shift``: a zero that is added, by which values are differentiated.
    """

    knots: Any
    coefficients: Any
    first: Any
    last: Any
    shift: Any = None

    def __call__(self, x: Any) -> Any:
        """Value at x, an array or a recorded number."""
        if self.first is not None:
            x = where(x > self.first, x, self.first)
        number = piece(x, self.knots)
        d = where(x < self.last, x, self.last) - cell(number, self.knots, 1, 0)
        c = [cell(number, self.coefficients, 4, i) for i in range(4)]
        found = ((c[0] * d + c[1]) * d + c[2]) * d + c[3]
        return found if self.shift is None else found + self.shift
