"""One return map for every friction law: stick or slip, the slip increment, the traction and its exact tangent.

Coulomb friction is regularised by an elastic slip (penalty) or exact (multipliers). Elastic-plastic analogy (paper eqs. 9-23),
integrated by backward Euler in the tool frame; see docs/theory/contact.md. It is stated for one
point (`decide`, `returned`), and all derivatives are generated from that.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from prensa.friction.law import At, FrictionLaw, bounded
from prensa.friction.point import Form, arrays, arrays_of, read, values_of
from prensa.kernels.differentiate import forward, units
from prensa.kernels.emit import Kind, Marks, Program, Rows, puts
from prensa.kernels.machine_code import generated
from prensa.kernels.record import NO_ROOT, Node, absolute, answered, differs, given, many, root, sqrt, where
from prensa.precision import ROUND_OFF
from prensa.types import Array, Bytes, Flags

OPEN, STUCK, SLIDING, DECIDE = 0, 1, 2, 3
"""Branches of contact and friction that a point may be made to take; `DECIDE`: its pressure and trial traction say which."""
BRANCH = STUCK | SLIDING | DECIDE  # the bits that hold one of these
HOLD = 4  # a flag besides: where it touches, the point sticks


class Tangential(NamedTuple):
    """t (k, d) traction, dt_dg (k, d, d), dt_dp (k, d), kappa (k,) new accumulated slip, slip (k,) flags.

    bound (k, 2): the bound and its derivative by the pressure, whether a point slips or not; of laws that harden the total one,
    with the slip that follows the pressure.
    """

    t: Array
    dt_dg: Array
    dt_dp: Array
    kappa: Array
    slip: Flags
    bound: Array


class Bounds(Protocol):
    """A bound at a point, and what it depends on besides pressure and slip."""

    @property
    def hardens(self) -> bool:
        """Whether it depends on the slip."""

    @property
    def args(self) -> list[Node]:
        """What else it depends on."""

    def bound(self, p: Node, kappa: Node) -> Node:
        """The bound at a pressure and a slip."""

    def of(self, args: Sequence[Node]) -> Bounds:
        """The same law of other `args`."""


class Tangent(NamedTuple):
    """The bound of a law that is stated in NumPy: the tangent to it at one pressure and a slip κ₀, τ_y and its slopes there."""

    hardens: bool
    args: list[Node]

    def bound(self, p: Node, kappa: Node) -> Node:
        """The bound at the pressure that it was found at, and a slip."""
        tau, by_p, by_kappa, at = self.args
        return answered(tau, [p], [by_p]) + by_kappa * (kappa - at)

    def of(self, args: Sequence[Node]) -> Tangent:
        """See `Bounds`."""
        return self._replace(args=list(args))


class Sides(NamedTuple):
    """On which sides of its kinks a point is: whether it slips, by more than nothing, and in a slip that is prescribed."""

    slip: Node
    moves: Node
    held: Node


def magnitude(t: Sequence[Node]) -> Node:
    """Size of a tangential traction, with no derivative where that is zero."""
    square = sum((x * x for x in t[1:]), start=t[0] * t[0])
    some = square > 0.0
    return where(some, absolute(t[0]) if len(t) == 1 else sqrt(where(some, square, 1.0)), 0.0)


def trial(lam: Sequence[Node], way: Sequence[Node], k_t: Node, touching: Node) -> list[Node]:
    """Traction of a point that sticks."""
    return [where(touching, x - k_t * s, 0.0) for x, s in zip(lam, way)]


def decide(size: Node, tau: Node, p: Node, touching: Node, want: Node) -> Sides:
    """The sides of a point with a trial traction of a ``size`` and the bound tau; ``want``: see `return_map`."""
    # 2 HOLD is `NEARBY` of contact points, of which friction knows nothing; flags are subtracted as in `contact.point`.
    rest = where(want >= 2.0 * HOLD, want - 2.0 * HOLD, want)
    hold = rest >= 1.0 * HOLD
    branch = where(hold, rest - 1.0 * HOLD, rest)
    held, sticks = ~differs(branch, SLIDING), hold | ~differs(branch, STUCK)
    # Without the margin a point that slid and rests would flip between stick and slip by round-off, a factorisation each time.
    # a point that slid and has not moved yet is on the bound: it sticks
    beyond = size > (1.0 + ROUND_OFF) * tau
    slip = touching & (held | (beyond & ~sticks))
    return Sides(slip, slip & ((held & (size > 0.0)) | (~held & (p > 0.0))), held)


def returned(
    t: Sequence[Node], p: Node, kappa: Node, k_t: Node, law: Bounds, sides: Sides
) -> tuple[list[Node], Node, Node]:
    """Trial traction t → traction, accumulated slip and bound of a point: |t| = τ_y(p, κ_n + Δ) with Δ = (|t_tr| − |t|)/k_T.

    Of a law that hardens Δ is the root between 0 and |t_tr|/k_T. Where slip is held bounds may be above |t_tr|, and below zero at
    a pressure below zero: the bracket reaches as far to both sides of |t_tr|/k_T.
    """
    size = magnitude(t)
    tau = law.bound(p, kappa)
    # Of a law that does not harden this is the slip itself, of others where the search begins.
    rise = where(sides.moves, (size - tau) / k_t, 0.0)
    if law.hardens:
        most, reach = size / k_t, 2.0 * where(size > absolute(tau), size, absolute(tau)) / k_t
        low, high = where(sides.held, most - reach, 0.0), where(sides.held, most + reach, most)
        start = where(rise > low, where(rise < high, rise, high), low)

        def beyond(x: Node, size: Node, p: Node, kappa: Node, k_t: Node, *args: Node) -> Node:
            return size - k_t * x - law.of(args).bound(p, kappa + x)

        rise = root(beyond, sides.moves, start, low, high, size, size, p, kappa, k_t, *law.args, smooth=False)
        tau = law.bound(p, kappa + rise)
    # in the plane the direction is a sign, which has no derivative
    sign = where(t[0] > 0.0, 1.0, where(t[0] < 0.0, -1.0, t[0] / size))
    along = [sign] if len(t) == 1 else [x / size for x in t]
    return [where(sides.slip, tau * a, x) for a, x in zip(along, t)], kappa + rise, tau


@generated
def _return_map(form: Form | None, hardens: bool, d: int) -> Program:
    """See `return_map`; no form: of a law in NumPy, as the `Tangent` to it."""
    lam, way, p, kappa, k_t = many("lam", d), many("way", d), given("p", 0), given("kappa", 0), given("k_t", 0)
    law: Bounds = Tangent(hardens, many("line", 4)) if form is None else read(form, hardens)
    touching = given("touching", 0)
    t = trial(lam, way, k_t, touching)
    sides = decide(magnitude(t), law.bound(p, kappa), p, touching, given("want", 0))
    found, after, tau = returned(t, p, kappa, k_t, law, sides)
    slopes = forward(found, units([p, *way]), 1 + d)
    own: dict[str, Kind] = {"line": Rows(4)} if form is None else arrays_of(form)
    arrays: dict[str, Kind] = {
        "lam": Rows(d), "way": Rows(d), "p": Rows(1), "touching": Marks(), "kappa": Rows(1), "k_t": Rows(1), "want": Rows(1),
        **own, "t": Rows(d), "dt_dg": Rows(d * d), "dt_dp": Rows(d), "after": Rows(1), "slip": Marks(), "bound": Rows(2),
    }  # fmt: skip
    by_p, by_way = [row[0] for row in slopes[:d]], [x for row in slopes[:d] for x in row[1:]]
    bound_by_p = forward([law.bound(p, after)], units([p]), 1)[0]
    written = [
        *puts("t", found), *puts("dt_dg", by_way), *puts("dt_dp", by_p), *puts("after", [after]), *puts("slip", [sides.slip]),
        *puts("bound", [tau, *bound_by_p]),
    ]  # fmt: skip
    return Program(arrays, written)


def return_map(
    law: FrictionLaw, at: At, lam: Array, dg: Array, p: Array, touching: Flags, kappa: Array, k_t: Array,
    want: Bytes | None = None,
) -> Tangential:  # fmt: skip
    """Traction t_T(Δg_T, p) from the committed traction (or multiplier).

    lam (k, d): traction at the start of the increment or multiplier, in d tangential axes of the tool; dg (k, d):
    tangential displacement relative to the tool during the increment; p (k,) pressure; touching (k,) flags, which
    include the points of p = 0 that are just in touch; kappa (k,) committed slip; k_t (k,) tangential stiffness.
    Where a point does not touch everything is zero, and the slip is kept. ``want`` (k,): branches that points take: with
    `SLIDING` they slip, also where that takes back some of the slip, with `STUCK` or the flag `HOLD`, by which the solver breaks
    cycles, they stick whatever the bound says; None: the trial tractions decide.

    The trial is t_tr = λ − k_T Δg; slip iff |t_tr| > τ_y(p, κ_n); then |t_tr| − k_T Δλ = τ_y(p, κ_n + Δλ).
    A softening law needs k_T > |∂τ_y/∂κ| for the root to be unique; where it may not be, the tangent is NaN, which the
    solver takes as a failed evaluation.
    """
    values = values_of(law) if law.is_of_point else None
    want = np.full(len(dg), DECIDE, dtype=np.int8) if want is None else want
    points = lam, dg, p, touching, kappa, k_t
    if values is not None:
        out = _mapped(values.form, law.hardens, points, want, arrays(values, at, len(dg)))
    else:
        out = _of_arrays(law, at, points, want)
    # NaN makes the evaluation fail and the increment be cut: where the root is not unique any tangent would lead to one of
    # several answers.
    if law.hardens and (soft := out.slip & (law.softening(p, kappa, at) >= k_t)).any():
        out.dt_dg[soft], out.dt_dp[soft] = np.nan, np.nan
    return out


_Points = tuple[Array, Array, Array, Flags, Array, Array]


def _mapped(form: Form | None, hardens: bool, points: _Points, want: Bytes, law: tuple[Array, ...]) -> Tangential:
    k, d = points[1].shape
    t, dt_dp, dt_dg, kappa = np.empty((k, d)), np.empty((k, d)), np.empty((k, d, d)), np.empty(k)
    slip, bound = np.empty(k, dtype=bool), np.empty((k, 2))
    kernel = _return_map(form, hardens, d)
    kernel(k, *points, want.astype(np.float64), *law, t, dt_dg, dt_dp, kappa, slip, bound)
    return Tangential(t, dt_dg, dt_dp, kappa, slip, bound)


def _of_arrays(law: FrictionLaw, at: At, points: _Points, want: Bytes) -> Tangential:
    """The return map of a law that is stated in NumPy: its slips are found here, of all points at once."""
    lam, dg, p, touching, kappa, k_t = points
    tau, by_p, by_kappa = bounded(law, p, kappa, at)
    # This pass decides the branches, at the committed slip; the one below has the tangent to the bound at the slip that is
    # found.
    out = _mapped(None, False, points, want, (np.stack([tau, by_p, 0.0 * tau, kappa], axis=1),))
    if not law.hardens:
        return out
    size = np.sqrt((np.where(touching[:, None], lam - k_t[:, None] * dg, 0.0) ** 2).sum(axis=1))
    held = (want & BRANCH) == SLIDING
    moves = out.slip & np.where(held, size > 0.0, p > 0.0)
    rise, tau, by_p, by_kappa = _hardening_root(law, at, size, tau, p, kappa, k_t, moves, held)
    as_found = np.where(out.slip, SLIDING, STUCK).astype(np.int8)
    by_kappa = np.where(out.slip & ~moves, 0.0, by_kappa)  # what slips without pressure leaves the slip as it is
    out = _mapped(None, True, points, as_found, (np.stack([tau, by_p, by_kappa, kappa + rise], axis=1),))
    return out._replace(kappa=kappa + rise)


def _hardening_root(
    law: FrictionLaw, at: At, size: Array, tau0: Array, p: Array, kappa: Array, k_t: Array, slip: Flags,
    held: Flags,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Safeguarded Newton for Δλ of all points at once; brackets as in `returned`.

    Δλ is NaN, and so is all that follows from it, where no root is found: the bound jumps.
    """
    hi = size / k_t
    lo = np.zeros_like(hi)
    reach = 2.0 * np.maximum(size, np.abs(tau0)) / k_t
    lo, hi = np.where(held, hi - reach, lo), np.where(held, hi + reach, hi)
    x = np.where(slip, np.clip((size - tau0) / k_t, lo, hi), 0.0)
    for _ in range(100):
        tau, dtau_p, dtau_k = bounded(law, p, kappa + x, at)
        f = size - k_t * x - tau
        lo, hi = np.where(f > 0, x, lo), np.where(f > 0, hi, x)
        if (~slip | (np.abs(f) <= 2e-16 * size) | (hi - lo <= 2e-16 * hi)).all():
            break
        D = k_t + dtau_k
        # Where the bound falls faster than k_T Newton's step leads away from the root; the bracket is halved instead.
        newton = x + f / np.where(D > 0, D, np.inf)
        inside = (newton > lo) & (newton < hi)
        x = np.where(slip & (np.abs(f) > 0), np.where(inside, newton, 0.5 * (lo + hi)), x)
    tau, dtau_p, dtau_k = bounded(law, p, kappa + x, at)
    missed = np.abs(size - k_t * x - tau)
    found = missed <= NO_ROOT * np.maximum(size, np.abs(tau))
    return np.where(found | ~slip, x, np.nan), tau, dtau_p, dtau_k
