"""Solutions of linear equations by substitutions with factors of a matrix nearby, each of which learns from those before."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from prensa.sensitivity.combinations import nearest, row_sums
from prensa.types import Array

LEEWAY = 10.0
"""Shares ``fine`` of a solution that what it leaves may come from: rates of substitutions do not show them better."""

Solve = Callable[[Array], Array]


def initial_guess(A: Any, b: Array, before: Array, least: float) -> Array:
    """Combinations (n, m) of vectors before (n, k m) that come nearest to solutions of A x = b (n, m), rows over their diagonals.

    Those make lengths of the forces of penalties, which would hide all others. ``least``: see `nearest`.
    """
    count = before.shape[1] // b.shape[1]
    if not count:
        return np.zeros_like(b)
    diagonal, images, shares = A.diagonal(), A @ before, np.empty((count, b.shape[1]))
    nearest(images, b, np.divide(1.0, diagonal, out=np.zeros(len(b)), where=diagonal != 0.0), least, shares)
    return np.asarray(np.einsum("nkm,km->nm", before.reshape(len(b), count, -1), shares))


class Substitutions:
    """Room for ``most`` substitutions in n equations, which end when the next would change a share ``fine`` of x, or less.

    Anderson's (1965) acceleration with all steps kept: on linear equations they are those of GMRES, preconditioned from the left
    (Walker & Ni 2011), but each begins with what is left indeed, so that factors of single precision lead to all digits.
    """

    def __init__(self, n: int, most: int, fine: float) -> None:
        self.most, self.fine = most, fine
        self._ways, self._changes = np.empty((2, most, n))

    def solve(self, A: Any, again: Solve, b: Array, x: Array) -> Array | None:
        """Solution (n,) of A x = b (n,) from x (n,) on by substitutions ``again``; None where they do not lead there.

        What is left is judged by x: forces on tools make right-hand sides of their penalties, far larger than what comes of them.
        Where the factors are of a nearly singular matrix, single precision answers by noise, and directions mean nothing: what is
        taken for a solution has to leave no more of any equation than a change of x by a few ``fine`` could.
        """
        P, Q, size, rate, first = self._ways, self._changes, np.inf, np.inf, np.inf
        z = again(b - A @ x)
        for k in range(self.most):
            # Q: orthonormal changes of what substitutions answer; P: the steps that make these. The next step takes with it
            # what they can undo of z.
            shares = Q[:k] @ z
            rest = z - shares @ Q[:k]
            way = rest + shares @ P[:k]
            x = x + way
            before, size, slower = size, _length(rest), rate
            if not np.isfinite(size):
                return None
            rate = size / before if k and before > 0.0 else 0.0 if size == 0.0 else np.inf
            # The slower of the last two rates: Anderson's steps go unevenly, and one good step promises nothing.
            enough, slower = self.fine * _length(x), max(rate, slower if k > 1 else rate)
            left = b - A @ x
            if (size * slower <= enough or size == 0.0) and np.all(np.abs(left) <= LEEWAY * enough * _rows(A)):
                return x
            first = size if not k else first
            # At the mean rate since the first step, would the steps that are left do? Else new factors are cheaper.
            if (k > 1 and not size * (size / first) ** ((self.most - k) / k) <= enough) or k + 1 == self.most:
                return None
            after = again(left)
            change, z = z - after, after
            own = Q[:k] @ change
            change, way = change - own @ Q[:k], way - own @ P[:k]
            if not (length := _length(change)) > 0.0:
                return None
            by = 1.0 / length
            Q[k], P[k] = by * change, by * way
        return None


def _rows(A: Any) -> Array:
    """Sums (n,) of the sizes of each row of A, in compressed rows."""
    out = np.empty(A.shape[0])
    row_sums(A.data, A.indptr, out)
    return out


def _length(x: Array) -> float:
    return float(np.sqrt(x @ x))
