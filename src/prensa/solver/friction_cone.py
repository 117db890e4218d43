"""Contact and friction of points on linear bodies: pressures p ≥ 0 and tractions within bounds b(p), of one tangent or two.

A point has a pressure and perhaps a traction. Its trial value τ = λ − k g, or λ − k s, is that force f and what is beyond it,

    τ = f + d,    p = f ≥ 0, k g = −d ≥ 0, p g = 0,    |t| ≤ b(p), d along t, d ≠ 0 only at |t| = b

(Klarbring 1986; in space Alart and Curnier 1991: t is the projection of its trial value on a circle). Bodies answer linearly to

    v = (1 − a) Δf − a Δd,    f + d = τ' + A v,

a the share of the contact stiffness that is in their matrix, τ' the trial values after a step of that matrix alone. With one
tangent t lies in an interval and this is a linear complementarity problem. With two each pass takes the circle of a point for
its tangents at the trial traction of the pass before, τ_t = |τ_t| T: along T there is the same interval, and across it
t = (b/|τ_t|) τ_t, which is the derivative of the return map. Where directions stay this is the answer for the circle. It is
Newton's method in the directions alone, all else remains inequalities (Josephy 1979). Radii that are not linear in the pressure
are taken for their tangents too, at the pressures of the pass before: a shear factor's bound rises ten times as fast below a
tenth of k as Coulomb's with μ = m, and not at all above, so that of a point about to close no one tangent says what it bears.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.sparse import block_diag, bmat, csr_matrix, diags_array, eye_array

from prensa.policy import Policy
from prensa.precision import ROUND_OFF
from prensa.solver.complementarity import complementary
from prensa.types import Array, Flags, Index


class Bounds(NamedTuple):
    """Bounds of l tractions as functions of pressures: their ``value`` and ``slope`` (l,) at the pressures ``at`` (l,)."""

    value: Array
    slope: Array
    at: Array


class Unknowns(NamedTuple):
    """m pressures, then tractions of l points, the components along the first tangents before those along the second: n in all.

    forces (n, ndof): −∂r/∂v; slopes (n, ndof) of the trial values; ``trial`` values and forces f (n,) at the iterate;
    ``spring`` (n,): share a of the contact stiffness that is in the matrix. rubs (l,): the pressure that bounds each
    traction; bound, by_pressure (l,). ``tangents``: t, 1 in the plane and 2 in space; n = m + t l. ``law``: the bounds at
    pressures (l,); None where they are linear.
    """

    forces: csr_matrix
    slopes: csr_matrix
    trial: Array
    f: Array
    spring: Array
    rubs: Index
    bound: Array
    by_pressure: Array
    tangents: int
    law: Callable[[Array], Bounds] | None = None

    def bounds(self, f: Array) -> Bounds:
        """Bounds at forces f (n,)."""
        if self.law is not None:
            return _of_pressed(self.law(f[self.rubs]))
        value = np.maximum(self.bound + self.by_pressure * (f - self.f)[self.rubs], 0.0)
        return self.first._replace(value=value)

    @property
    def first(self) -> Bounds:
        """Bounds at the iterate."""
        found = Bounds(self.bound, self.by_pressure, self.f[self.rubs])
        return found if self.law is None else _of_pressed(found)

    def tractions(self, of: Array) -> Array:
        """Those of n values as vectors (t, l)."""
        l = len(self.rubs)
        return of[len(of) - self.tangents * l :].reshape(self.tangents, l)


def _of_pressed(b: Bounds) -> Bounds:
    """Bounds of points that press; open ones have none in the next pass: steep ones at p = 0 may leave it without an answer."""
    acts = b.at > 0.0
    return b._replace(value=np.where(acts, b.value, 0.0), slope=np.where(acts, b.slope, 0.0))


class _Values(NamedTuple):
    """Forces f and what trial values are beyond them, d, both (n,)."""

    f: Array
    d: Array


def moved_by(policy: Policy, k: Unknowns, after: Array, A: Array) -> Array | None:
    """What acts on the bodies, v (n,), by the answer; None if there is none.

    after (n,): trial values by the matrix alone; A (n, n): theirs by v. Passes go on while they lower what is missed of circles.
    """
    at, line, best, least = k.trial, k.first, None, np.inf
    radii = line.value
    while True:
        values = _pass(policy, k, after, A, at, radii, line)
        if values is None and k.law is not None:
            # Bounds that rise steeply may leave no answer; constant ones (Tresca's) have one on any bodies that resist.
            values = _pass(policy, k, after, A, at, radii, line._replace(slope=np.zeros_like(radii)))
        if values is None:
            return best
        at, bounds = values.f + values.d, k.bounds(values.f)
        # Radii that rise steeply are taken for their tangents anew in each pass: one tangent does not say what they bear.
        radii, line = bounds.value, line if k.law is None else bounds
        missed = _missed(k, values, radii)
        if missed < least:
            best = (1.0 - k.spring) * (values.f - k.f) - k.spring * (values.d - (k.trial - k.f))
        if missed >= least or missed <= ROUND_OFF * float(radii.sum()):
            return best
        least = missed


def _sizes(vectors: Array) -> Array:
    """Sizes (l,) of vectors (t, l)."""
    return np.asarray(np.sqrt((vectors**2).sum(axis=0)))


def _missed(k: Unknowns, values: _Values, bounds: Array) -> float:
    """How far tractions are from the projections of their trial values on circles of the size ``bounds`` (l,), in all."""
    if k.tangents == 1:
        return 0.0  # an interval is no approximation
    trial = k.tractions(values.f + values.d)
    return float(np.abs(k.tractions(values.f) - _slope(trial, bounds) * trial).sum())


def _slope(trial: Array, bounds: Array) -> Array:
    """|t|/|τ| (l,) of trial tractions (t, l): 1 in stick, b/|τ| in slip; 0 of what is not pressed."""
    size = _sizes(trial)
    slips = size > bounds
    return np.where(slips, bounds / np.where(slips, size, 1.0), bounds > 0.0)


def _frames(k: Unknowns, at: Array) -> csr_matrix:
    """Rotation (n, n) of tractions to components along those of ``at`` (n,), before those across; the identity in the plane."""
    n, l = len(at), len(k.rubs)
    if k.tangents == 1:
        return csr_matrix(eye_array(n))
    trial = k.tractions(at)
    size = _sizes(trial)
    along = np.where(size > 0.0, trial / np.where(size > 0.0, size, 1.0), [[1.0], [0.0]])
    turned = bmat([[diags_array(along[0]), diags_array(along[1])], [diags_array(-along[1]), diags_array(along[0])]])
    return csr_matrix(block_diag([eye_array(n - 2 * l), turned])) if l else csr_matrix(eye_array(n))


def _pass(
    policy: Policy, k: Unknowns, after: Array, A: Array, at: Array, radii: Array, line: Bounds
) -> _Values | None:  # fmt: skip
    """Values with the circles' tangents at trial values ``at`` (n,), of the ``radii`` (l,), and bounds along a ``line``."""
    a, n = k.spring, len(at)
    Q = _frames(k, at)
    A, after, trial, was = np.ascontiguousarray((Q @ A) @ Q.T), Q @ after, Q @ k.trial, Q @ k.f
    one = np.eye(n)
    F, D = one - A * (1.0 - a), one + A * a  # F f + D d is known
    known = after - A @ ((1.0 - a) * was - a * (trial - was))
    # across: f = β τ, d = (1 − β) τ, and τ is what the others leave of it
    m = n - (k.tangents - 1) * len(k.rubs)
    share = np.tile(_slope(k.tractions(at), radii), k.tangents - 1)
    by_across = F[:, m:] * share + D[:, m:] * (1.0 - share)
    others = np.hstack([F[:, :m], D[:, :m], known[:, None]])
    try:
        answer = np.linalg.solve(by_across[m:], others[m:])
    except np.linalg.LinAlgError:
        return None
    left = others[:m] - by_across[:m] @ answer
    found = _in_intervals(policy, k, left, at[: m - len(k.rubs)] > 0.0, line)
    if found is None:
        return None
    f, d = found
    across = answer[:, -1] - answer[:, :m] @ f - answer[:, m:-1] @ d
    return _Values(Q.T @ np.append(f, share * across), Q.T @ np.append(d, (1.0 - share) * across))


def _in_intervals(
    policy: Policy, k: Unknowns, equations: Array, closed: Flags, line: Bounds
) -> tuple[Array, Array] | None:  # fmt: skip
    """Forces f and rests d (m + l,) of ``equations`` F f + D d = known, (m + l, 2 (m + l) + 1); one tangent each.

    closed (m,): in the pairs to begin with, in which all stick.
    """
    l, m = len(k.rubs), len(closed)
    n = m + l
    F, D, known = equations[:, :n], equations[:, n : 2 * n], equations[:, -1]
    # x = (p, b + t, b − t), y = (k g, d⁻, d⁺), and the bound: (b + t) + (b − t) = 2 b(p)
    L, R = np.zeros((2, m + 2 * l, m + 2 * l))
    L[:n] = np.hstack([-D[:, :m], -D[:, m:], D[:, m:]])
    R[:n] = -np.hstack([F[:, :m], 0.5 * F[:, m:], -0.5 * F[:, m:]])
    row = n + np.arange(l)
    R[row, k.rubs] = 2.0 * line.slope
    R[row, row - l] = R[row, row] = -1.0
    bound = 2.0 * (line.value - line.slope * line.at)
    # From the pairs of the pass before, 67 of 200 random problems end on a ray; from all sticking, 8 (chapter 5).
    first = np.append(closed, np.ones(2 * l, dtype=bool))
    found = complementary(L, R, np.append(known, bound), first, policy)
    if found is None:
        return None
    x, y = found
    f = np.append(x[:m], 0.5 * (x[m:n] - x[n:]))
    beyond = np.append(-y[:m], y[n:] - y[m:n])
    return f, beyond
