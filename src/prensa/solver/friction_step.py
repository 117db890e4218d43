"""Stick, slip and pressure of contact points decided together, with bodies that answer linearly.

With Coulomb's law the points' equations are a complementarity problem too (Klarbring 1986): the trial traction is t + e with
e > 0 only where t = τ and e < 0 only where t = −τ, so with a = τ + t and b = τ − t

    a ≥ 0, e⁻ ≥ 0, a e⁻ = 0,   b ≥ 0, e⁺ ≥ 0, b e⁺ = 0,   τ = τ_0 + τ_p (p − p_0).

Where all points slip next to nothing holds a body along its tool, and Newton's step from there reverses the slip of many at
once; here the points that have to stick are found.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from prensa.policy import Policy
from prensa.solver.complementarity import pivoted
from prensa.types import Array, Flags, Index


class Friction(NamedTuple):
    """m points with friction: forces (m, ndof) by their traction, slopes (m, ndof) of the trial traction.

    trial, t, p, bound and its slope by the pressure, each (m,), at the iterate.
    """

    forces: csr_matrix
    slopes: csr_matrix
    trial: Array
    t: Array
    p: Array
    bound: Array
    slope: Array


def as_rows(values: Array, dofs: Index, ndof: int) -> csr_matrix:
    """Rows (m, ndof) with values (m, k) at dofs (m, k)."""
    m, k = dofs.shape
    return csr_matrix((values.ravel(), dofs.ravel(), np.arange(0, m * k + 1, k)), (m, ndof))


def tractions(
    policy: Policy, trial: Array, friction: Friction, rubbing: Flags, S: Array, ahead: Array
) -> Array | None:  # fmt: skip
    """What acts on the bodies besides the springs of m candidates' pressures and l tractions (m + l,); None if not found.

    trial (m,) trial pressures; rubbing (m,): those that the friction belongs to; S (m + l, m + l) minus the responses of the
    trial values, ahead (m + l,) their changes by the springs alone.
    """
    m, share, A = len(trial), policy.foundation_ratio, -S
    x0, y0 = np.maximum(trial, 0.0), np.maximum(-trial, 0.0)
    t0, e0 = friction.t, friction.trial - friction.t
    normal, tangent = A[:, :m], A[:, m:]
    one = np.eye(len(A))
    Cx, Cy = one[:, :m] - (1.0 - share) * normal, -one[:, :m] - share * normal
    Ct, Ce = one[:, m:] - (1.0 - share) * tangent, one[:, m:] + share * tangent
    known = np.concatenate([trial, friction.trial]) + ahead
    known -= normal @ ((1.0 - share) * x0 + share * y0) + tangent @ ((1.0 - share) * t0 - share * e0)
    # x of closed points, y of open ones and all tractions in terms of the others
    closed = trial > 0
    try:
        solved = np.linalg.solve(
            np.hstack([np.where(closed, Cx, Cy), Ct]), np.hstack([np.where(closed, Cy, Cx), Ce, known[:, None]])
        )
    except np.linalg.LinAlgError:
        return None
    if not np.isfinite(solved).all():
        return None
    # columns: the other of x and y, e = e⁺ − e⁻, the constant
    solved[:, :-1] *= -1.0
    takes_x = np.where(closed[:, None], solved[:m], np.hstack([np.eye(m), np.zeros((m, len(t0) + 1))]))
    size = float(max(x0.max(initial=0.0), np.abs(solved[:m, -1][closed]).max(initial=0.0)))
    size = size if size > 0 else 1.0
    bound = friction.slope[:, None] * takes_x[rubbing]
    bound[:, -1] += friction.bound - friction.slope * friction.p
    t = solved[m:]
    parts = np.vstack([solved[:m], bound + t, bound - t])  # y or x, a, b by (x or y, e, constant)
    M = np.hstack([parts[:, :m], -parts[:, m:-1], parts[:, m:-1]])
    constant = parts[:, -1] / size
    adhesion = np.where(np.arange(len(M)) < m, 0.0, policy.adhesion_ratio)
    found = pivoted(M, constant + adhesion, policy)
    if found is None:
        return None
    w, z = _without_adhesion(M, constant, *found)
    l = len(t0)
    e = z[m + l :] - z[m : m + l]
    x, y = size * np.where(closed, w[:m], z[:m]), size * np.where(closed, z[:m], w[:m])
    e *= size
    t_new = t @ np.concatenate([size * z[:m], e, [1.0]])
    return np.concatenate(
        [(1.0 - share) * (x - x0) + share * (y - y0), (1.0 - share) * (t_new - t0) - share * (e - e0)]
    )


def _without_adhesion(M: Array, q: Array, w: Array, z: Array) -> tuple[Array, Array]:
    """w, z (n,) of the same pairs with w = M z + q."""
    takes = z > w
    try:
        values = np.linalg.solve(np.where(takes, -M, np.eye(len(q))), q)
    except np.linalg.LinAlgError:
        return w, z
    return np.where(takes, 0.0, values), np.where(takes, values, 0.0)
