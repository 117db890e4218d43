"""Linear complementarity by Lemke's pivots: the solution of the problems of contact and friction.

Lemke (1965), Management Science 11, 681-689; Cottle, Pang and Stone (1992), The Linear Complementarity Problem, section 4.4.
"""

from __future__ import annotations

import numpy as np

from prensa.policy import DEFAULT, Policy
from prensa.types import Array, Flags


def complementary(
    L: Array, R: Array, b: Array, first: Flags | None = None, policy: Policy = DEFAULT
) -> tuple[Array, Array] | None:  # fmt: skip
    """x, y (n,) ≥ 0 with L y − R x = b and x y = 0 in every pair; None if none is found. L, R (n, n).

    A horizontal linear complementarity problem. ``first`` (n,): pairs of which x is taken to begin with, y of the others. From
    there Lemke's method goes on, which wants neither symmetry nor a positive matrix, and once more from where round-off ends it.
    Pairs are scaled: those of a loose end are orders of magnitude smaller than others. Points without pressure would make ratios
    tie; a small force on every chosen unknown breaks ties and is left out of the solution.
    """
    takes_x = np.zeros(len(b), dtype=bool) if first is None else first
    try:
        # Where round-off ends the method on a ray or lets it cycle, the pairs that it came to are a better beginning.
        for _ in ("from the first pairs", "from where that ended"):
            solved = np.linalg.solve(np.where(takes_x, -R, L), np.hstack([np.where(takes_x, -L, R), b[:, None]]))
            if not np.isfinite(solved).all():
                return None
            M, q = solved[:, :-1], solved[:, -1]  # those taken are M times the others, and q
            diagonal = np.abs(M.diagonal())
            # Pairs of a loose sheet end span thirteen orders of magnitude; unscaled, 73 of 1230 problems had no answer, scaled
            # 60.
            size = np.where(diagonal > 0, diagonal, 1.0) ** -0.5
            q = q + takes_x * policy.adhesion_ratio * np.abs(q[takes_x]).max(initial=0.0)
            changed, ended = _pivoted(size[:, None] * M * size, size * q, policy)
            takes_x = takes_x != changed
            if ended:
                values = np.maximum(np.linalg.solve(np.where(takes_x, -R, L), b), 0.0)
                return np.where(takes_x, values, 0.0), np.where(takes_x, 0.0, values)
    except np.linalg.LinAlgError:
        pass
    return None


def _pivoted(M: Array, q: Array, policy: Policy) -> tuple[Flags, bool]:
    """Pairs (n,) of w = M z + q, w, z ≥ 0, w z = 0, of which z is not zero; False if the method ends on a ray or takes too long.

    Lemke (1965), as in Cottle, Pang and Stone (1992), The Linear Complementarity Problem, algorithm 4.4.5.
    """
    n = artificial = len(q)
    if q.min(initial=0.0) >= 0.0:
        return np.zeros(n, dtype=bool), True
    # rows: basic variables by the others and a constant; z have the numbers 0 … n − 1, the artificial one n, w those after it
    table = np.hstack([M, np.ones((n, 1)), q[:, None]])
    basic, others = np.arange(n + 1, 2 * n + 1), np.arange(n + 1)
    row, column = int(np.argmin(q)), artificial
    for _ in range(policy.pivots_per_equation * n):
        by_entering, pivot = table[:, column].copy(), table[row, column]
        table[:, column] = 0.0
        entering = table[row] / -pivot
        entering[column] = 1.0 / pivot
        table += np.outer(by_entering, entering)
        table[row] = entering
        basic[row], others[column] = others[column], basic[row]
        left = others[column]
        if left == artificial:
            return np.isin(np.arange(n), basic), True
        column = int(np.flatnonzero(others == (left + n + 1) % (2 * n + 2))[0])
        falls = -table[:, column]
        able = falls > policy.min_pivot_ratio * np.abs(falls).max()
        if not able.any() or not np.isfinite(falls).all():
            break
        ratio = np.where(able, np.maximum(table[:, -1], 0.0) / np.where(able, falls, 1.0), np.inf)
        ties = np.flatnonzero(ratio <= ratio.min() * (1.0 + policy.min_pivot_ratio))
        out = ties[basic[ties] == artificial]
        row = int(out[0] if len(out) else ties[np.argmax(falls[ties])])
    return np.isin(np.arange(n), basic), False
