"""Linear complementarity, by methods that no active set can cycle in.

`complementary`: an interior point method, for many degenerate pairs; `pivoted`: Lemke's method, for matrices that are not
positive, as those of friction.
"""

from __future__ import annotations

import numpy as np

from prensa.policy import DEFAULT, Policy
from prensa.types import Array


def complementary(L: Array, R: Array, b: Array, policy: Policy = DEFAULT) -> tuple[Array, Array] | None:
    """x, y (n,) ≥ 0 with L y − R x = b and x y = 0 in every pair; None if none is found. L, R (n, n).

    A horizontal linear complementarity problem, in which neither L nor R need be regular. Predictor and corrector of
    Mehrotra (1992), as in Wright (1997), Primal-Dual Interior-Point Methods, box 10.1, carried on until pairs differ by many
    orders of magnitude; then the linear equations of the pairs that were found are solved, as often as a sign says that one
    was taken the wrong way round.
    """
    n, size = len(b), float(np.abs(b).max(initial=0.0))
    if size == 0.0:
        return np.zeros(n), np.zeros(n)
    rows = size * (np.abs(L).sum(axis=1) + np.abs(R).sum(axis=1))
    b = b / rows
    L, R = size * L / rows[:, None], size * R / rows[:, None]
    with np.errstate(all="ignore"):
        found = _central_path(L, R, b, policy)
    if found is None:
        return None
    x, y = _polished(L, R, b, *found, policy)
    return size * x, size * y


def _central_path(L: Array, R: Array, b: Array, policy: Policy) -> tuple[Array, Array] | None:
    """x, y > 0 with products that are nearly zero; None where the way there does not end."""
    from scipy.linalg.lapack import dgetrf, dgetrs

    x, y = np.ones((2, len(b)))
    for _ in range(policy.interior_max_iterations):
        mean = float(x @ y) / len(b)
        if mean < policy.complementarity_tolerance:
            return x, y
        missing = L @ y - R @ x - b
        ratio = y / x
        matrix = L * ratio + R
        if not np.isfinite(matrix).all():
            return None
        *factors, zero_pivot = dgetrf(matrix)
        if zero_pivot:
            return None
        dx = dgetrs(*factors, missing - L @ y)[0]
        dy = -y - ratio * dx
        step = min(1.0, _longest(x, dx), _longest(y, dy))
        ahead = float((x + step * dx) @ (y + step * dy)) / len(b)
        centre = ((ahead / mean) ** 3 * mean - dx * dy) / x
        dx = dgetrs(*factors, missing + L @ (centre - y))[0]
        dy = centre - y - ratio * dx
        step = min(1.0, policy.interior_step_share * min(_longest(x, dx), _longest(y, dy)))
        x, y = x + step * dx, y + step * dy
        if not (np.isfinite(x).all() and np.isfinite(y).all()):
            return None
    return None


def _longest(x: Array, dx: Array) -> float:
    """Largest step for which x + step dx ≥ 0."""
    falls = dx < 0
    return float((-x[falls] / dx[falls]).min(initial=np.inf))


def _polished(L: Array, R: Array, b: Array, x: Array, y: Array, policy: Policy) -> tuple[Array, Array]:
    """The solution of the linear equations of the pairs of x, y, or x, y with the lesser of each pair put to zero."""
    first = x > y
    takes_x = first
    for _ in range(policy.polishing_rounds):
        matrix = np.where(takes_x, -R, L)
        try:
            z = np.linalg.solve(matrix, b)
            z += np.linalg.solve(matrix, b - matrix @ z)
        except np.linalg.LinAlgError:
            break
        right = np.where(takes_x, z >= 0, z < 0)
        if np.array_equal(right, takes_x):
            return np.where(takes_x, z, 0.0), np.where(takes_x, 0.0, z)
        takes_x = right
    return np.where(first, x, 0.0), np.where(first, 0.0, y)


def pivoted(M: Array, q: Array, policy: Policy = DEFAULT) -> tuple[Array, Array] | None:
    """w, z (n,) ≥ 0 with w = M z + q and w z = 0 in every pair; None if the method ends on a ray or takes too long.

    Lemke (1965), as in Cottle, Pang and Stone (1992), The Linear Complementarity Problem, algorithm 4.4.5.
    """
    n = len(q)
    if q.min(initial=0.0) >= 0:
        return q.copy(), np.zeros(n)
    # columns: those of z, of the artificial variable, and the values; w stands for itself where it is basic
    table = np.hstack([np.eye(n), -M, -np.ones((n, 1)), q[:, None]])
    basis, artificial = np.arange(n), 2 * n
    row, entering = int(np.argmin(q)), artificial
    for _ in range(policy.pivots_per_equation * n):
        table[row] /= table[row, entering]
        others = np.arange(n) != row
        table[others] -= np.outer(table[others, entering], table[row])
        leaving, basis[row] = basis[row], entering
        if leaving == artificial:
            values = np.zeros(2 * n + 1)
            values[basis] = np.maximum(table[:, -1], 0.0)
            return values[:n], values[n : 2 * n]
        entering = leaving + n if leaving < n else leaving - n
        column = table[:, entering]
        able = column > policy.min_pivot_ratio * np.abs(column).max()
        if not able.any() or not np.isfinite(column).all():
            return None
        ratio = np.where(able, np.maximum(table[:, -1], 0.0) / np.where(able, column, 1.0), np.inf)
        least = ratio.min()
        ties = np.flatnonzero(ratio <= least * (1.0 + policy.min_pivot_ratio))
        out = ties[basis[ties] == artificial]
        row = int(out[0] if len(out) else ties[np.argmax(column[ties])])
    return None
