"""From gaps and slips to contact forces: penalty, augmented and exact forms of the normal and tangential conditions.

p = ⟨λ_n − k_n g⟩ with the total gap (paper eqs. 4-8, corrected) and t_T by the return map. The augmented form is the
penalty form with multipliers that an outer loop updates; for plain penalty λ_n = 0 and λ_T is the committed traction. In
the exact form the multipliers are dofs of the same Newton iteration and p = λ_n, t_T = λ_T are its further equations
(`multiplier_rows`; Alart and Curnier 1991, Hüeber and Wohlmuth 2005).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.contact.integration import Points
from prensa.contact.kept import Held, Kept
from prensa.contact.pairing import Pairs
from prensa.contact.record import ContactRecord
from prensa.friction.law import At, FrictionLaw
from prensa.friction.return_map import return_map
from prensa.kernels.compiled import njit

Array = NDArray[np.float64]

EPS = float(np.finfo(np.float64).eps)
TOUCH = 1e-10  # gap over element depth below which a point touches where an increment starts


class Branches(NamedTuple):
    """Which points are ``closed`` and which of those ``slip`` (k,): the sides of the kinks of contact and friction.

    ``held``: whose multipliers supports leave undetermined; None if nobody's.
    """

    closed: NDArray[np.bool_]
    slip: NDArray[np.bool_]
    held: Held | None = None


class ContactForces(NamedTuple):
    """k ``pairs``: p, kappa (k,), t (k, t) along the tangents e; slip flags; F (k, m) forces on q; K (k, m, m) = −∂F/∂q.

    weight (k,) belongs to p, area (k,) to t: the same but for laws that are not proportional to the pressure.
    stretched (k, t): ∂(a t)/∂a, force per area that the surface gains, where the areas are current ones; else None.
    dp (k, 1 + t + m), dt (k, t, 1 + t + m): derivatives of p and t by λ_n, λ_T and q.
    ``rests`` (k,): closed, or open by no more than round-off.
    bound (k, 2): what friction can bear per area and its derivative by p; None without friction.
    ``points``: those of the increment, which differ from the surface's where edges are cut.
    ``kept``: what multipliers are that supports leave undetermined; None if there are none.
    """

    pairs: Pairs
    p: Array
    t: Array
    kappa: Array
    slip: NDArray[np.bool_]
    F: Array
    K: Array
    weight: Array
    area: Array
    dp: Array
    dt: Array
    rests: NDArray[np.bool_]
    stretched: Array | None = None
    bound: Array | None = None
    points: Points | None = None
    kept: Kept | None = None

    @property
    def g(self) -> Array:
        """Gaps (k,)."""
        return self.pairs.g

    @property
    def branches(self) -> Branches:
        """The sides on which the points are, and on which K has them."""
        return Branches(self.dp[:, 0] > 0, self.slip, self.kept and self.kept.held)

    @property
    def record(self) -> ContactRecord:
        """What is committed of the points; the speed, for which a duration is needed, is that of points at rest."""
        return ContactRecord(self.t, self.kappa, self.s, self.p > 0, np.zeros_like(self.kappa), self.area)

    @property
    def s(self) -> Array:
        """Surface coordinates (k, t)."""
        return self.pairs.s

    @property
    def way(self) -> NDArray[np.int8]:
        """Eighth of a turn (k,), 0 … 7 from the first tangent on, in which the traction lies; 0 or 4 in the plane."""
        if self.t.shape[1] == 1:
            return np.where(self.t[:, 0] < 0, 4, 0).astype(np.int8)
        eighths = np.round(np.arctan2(self.t[:, 1], self.t[:, 0]) / (0.25 * np.pi))
        return np.asarray(eighths % 8, dtype=np.int8)

    @property
    def resists(self) -> Array:
        """Largest share (k,) of a change of λ_T that comes out in t: 1 in stick."""
        t = self.t.shape[1]
        if t == 1:
            return np.abs(self.dt[:, 0, 1])
        return np.asarray(np.abs(self.dt[:, :, 1 : 1 + t]).max(axis=(1, 2)))


@dataclass(frozen=True)
class Scale:
    """Stiffnesses per area k_n, k_t (k,) of the points and depths h (k,) of elements, against which penetration is small.

    unit (k,): pressure per length by which multipliers, as degrees of freedom, are divided, and that β multiplies.
    """

    k_n: Array
    k_t: Array
    h: Array
    unit: Array


def forces(
    pairs: Pairs, weight: Array, scale: Scale, lam: Array, committed: ContactRecord, law: FrictionLaw | None, at: At,
    hold: NDArray[np.bool_] | None = None, area: Array | None = None, lagged: bool = False,
    before: Array | None = None, round_off: Array | float = 0.0, landed: NDArray[np.bool_] | None = None,
    foundation: Array | None = None, like: Branches | None = None,
) -> ContactForces:  # fmt: skip
    """Contact forces on the pair coordinates and their exact, unsymmetric stiffness.

    weight (k,); lam (k, 1 + t) multipliers normal, tangential; ``committed``: the points at the last commit; hold (k,): points
    made to stick (see `return_map`).
    area (k,): current areas, to which the tractions of a law that is not proportional to the pressure belong, its bound being
    that at the pressure per current area, P/a; None: those are ``weight``, or cancel. How areas depend on the positions is not
    in K (see `stretching`).
    ``lagged``: stiffness of the paper (24)-(26), k_n n⊗n + k_TT e⊗e: friction at the pressure of the last iterate and
    the tool's curvature are in the forces only.
    before (k,): committed pressures, an override for the first guess of an increment, which has the tools deep in the bodies:
    points that were closed stay so whatever their pressure, and in the terms of K that turn the frame tractions are the
    committed ones, since those of the overlaps would outweigh the bodies. What just touches resists then: the kink's other
    slope would leave a resting body free.
    ``round_off`` (k,) of the gaps; landed (k,): points that a prediction has put on the tool from inside it. K has the slope
    of the side that p is on, so that a point in tension is let go; what was closed and is open by round-off, or has landed
    and is open by less than `TOUCH`, keeps that of closed points.
    foundation (k, 2): where it is not 0, the slopes of p and of t in K are these shares of those of a closed point and of one
    that sticks, whatever the state. ``like``: the points are closed and slip as these do, so that their forces are smooth.
    """
    k, m = len(weight), pairs.s.shape[1]
    p, touching, rests = _normal(pairs.g, scale, lam[:, 0], committed.closed, before is not None, round_off, landed, like)
    n = 1 + m
    slope = touching.astype(np.float64)  # 0 where nothing touches
    if foundation is not None:
        slope = np.where(foundation[:, 0] > 0, foundation[:, 0], slope)
        touching = slope > 0
    dp, dt = np.zeros((k, n + pairs.dg.shape[1])), np.zeros((k, m, n + pairs.dg.shape[1]))
    _normal_slopes(slope, scale.k_n, pairs.dg, n, dp)
    stretched, bound = None, None
    if law is None:
        t, kappa, slip = np.zeros((k, m)), committed.slip.copy(), np.zeros(k, dtype=bool)
    else:
        ds = pairs.s - committed.coordinate
        share = np.ones(k) if area is None else weight / area
        pressure = (np.maximum(p, 0.0) if like is None else p) * share
        out = return_map(law, at, lam[:, 1:], ds, pressure, touching, committed.slip, scale.k_t, hold, like and like.slip)
        by_p = out.dt_dp
        bound = out.bound
        if area is not None:
            by_p, bound = by_p * share[:, None], bound * np.stack([np.ones(k), share], axis=1)
            stretched = out.t - out.dt_dp * pressure[:, None]
        t, kappa, slip = out.t, out.kappa, out.slip
        _tangential_slopes(by_p, out.dt_dg, scale.k_t, dp, pairs.ds, lagged, dt)
        _rest(dt, foundation, scale, pairs)
    area = weight if area is None else area
    P, T = weight * p, area[:, None] * t
    F, K = assembled(pairs, P, T, weight[:, None] * dp, area[:, None, None] * dt)
    if not lagged:
        if before is not None:
            P, T = weight * before, area[:, None] * committed.traction
        turned(pairs, P, T, K)
    return ContactForces(pairs, p, t, kappa, slip, F, K, weight, area, dp, dt, rests, stretched, bound)


def _normal(
    g: Array, scale: Scale, lam: Array, closed: NDArray[np.bool_], guess: bool, round_off: Array | float,
    landed: NDArray[np.bool_] | None, like: Branches | None,
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:  # fmt: skip
    """Pressures (k,) at gaps g (k,), which points resist, and which are open by no more than round-off.

    ``closed``: committed flags; ``guess``: points that were closed stay so, and what is within `TOUCH` of the tool resists;
    ``like``: which points are closed, whatever their gaps.
    """
    trial = lam - scale.k_n * g  # −inf where a ray misses the tool
    rests = trial >= -(scale.k_n * round_off + EPS * np.abs(lam))
    if like is not None:
        return np.where(like.closed, trial, 0.0), like.closed, rests
    if guess:
        closed = closed & np.isfinite(trial)  # a point that the tool has left behind has no gap
        return np.where(closed, trial, np.maximum(trial, 0.0)), _just(trial, scale) | closed, rests
    touching = np.where(closed, rests, trial >= 0.0)
    if landed is not None:
        touching = touching | (landed & _just(trial, scale))
    return np.maximum(trial, 0.0), touching, rests


def _just(trial: Array, scale: Scale) -> NDArray[np.bool_]:
    """Which points (k,) are within `TOUCH` of the tool, by λ − k_n g."""
    return np.asarray(trial >= -TOUCH * scale.k_n * scale.h)


def _rest(dt: Array, foundation: Array | None, scale: Scale, pairs: Pairs) -> None:
    """Put the derivatives dt (k, t, 1 + t + m) of the points that rest on a tangential foundation at those of its springs."""
    if foundation is None:
        return
    share, n = foundation[:, 1], 1 + dt.shape[1]
    on = np.flatnonzero(share > 0)
    dt[on] = 0.0
    for a in range(n - 1):
        dt[on, a, 1 + a] = share[on]
    dt[on, :, n:] = -(share[on] * scale.k_t[on])[:, None, None] * pairs.ds[on]


@njit(cache=True)
def _normal_slopes(slope, k_n, dg, n, dp):
    """Slopes (k,) of p by λ_n → its derivatives dp (k, n + m) by multipliers and q."""
    for k in range(len(slope)):
        dp[k, 0] = slope[k]
        for i in range(dg.shape[1]):
            dp[k, n + i] = (-slope[k] * k_n[k]) * dg[k, i]


@njit(cache=True)
def _tangential_slopes(by_p, dt_dg, k_t, dp, ds, lagged, dt):
    """Derivatives by_p (k, t), dt_dg (k, t, t) of the tractions → dt (k, t, 1 + t + m) by multipliers and q."""
    t = by_p.shape[1]
    for k in range(len(by_p)):
        for a in range(t):
            if not lagged:
                for i in range(dp.shape[1]):
                    dt[k, a, i] = by_p[k, a] * dp[k, i]
            for b in range(t):  # the trial traction is λ_T − k_T Δg_T
                dt[k, a, 1 + b] -= dt_dg[k, a, b] / k_t[k]
            for i in range(ds.shape[2]):
                change = 0.0
                for b in range(t):
                    change += dt_dg[k, a, b] * ds[k, b, i]
                dt[k, a, 1 + t + i] += change


def assembled(pairs: Pairs, P: Array, T: Array, dP: Array, dT: Array) -> tuple[Array, Array]:
    """F (k, m) of forces P (k,) along n and T (k, t) along e, and K = −∂F/∂q while the frame stays.

    dP (k, 1 + t + m), dT (k, t, 1 + t + m): derivatives by multipliers and q.
    """
    k, m = pairs.Fn.shape
    F, K = np.empty((k, m)), np.empty((k, m, m))
    if T.shape[1] == 1:
        _assemble(pairs.Fn, pairs.Ft[:, 0], P, T[:, 0], dP, dT[:, 0], F, K)
    else:
        _assemble_any(pairs.Fn, pairs.Ft, P, T, dP, dT, F, K)
    return F, K


def turned(pairs: Pairs, P: Array, T: Array, K: Array) -> None:
    """Add to K (k, m, m) what the turn of the frame and the change of the arm make of the forces P along n and T along e."""
    if T.shape[1] == 1:
        _turn(pairs.n, pairs.e[:, 0], pairs.arm, pairs.turn, pairs.moving, P, T[:, 0], K)
        return
    # the arm moves with the body point and against the tool; the frame of a plane that does not turn stays
    f = P[:, None] * pairs.n + (T[:, :, None] * pairs.e).sum(axis=1)
    across = np.cross(np.eye(3)[None], f[:, None]).transpose(0, 2, 1)  # column j: e_j × f
    K[:, 6:, :3] += across
    K[:, 6:, 3:6] -= across


@njit(cache=True)
def _assemble_any(Fn, Ft, P, T, dP, dT, F, K):
    """As `_assemble` for any number of tangents: T (k, t), dT (k, t, 1 + t + m)."""
    first = 1 + T.shape[1]
    for k in range(len(P)):
        for i in range(Fn.shape[1]):
            F[k, i] = P[k] * Fn[k, i]
            for j in range(Fn.shape[1]):
                K[k, i, j] = -Fn[k, i] * dP[k, first + j]
            for a in range(T.shape[1]):
                F[k, i] += T[k, a] * Ft[k, a, i]
                for j in range(Fn.shape[1]):
                    K[k, i, j] -= Ft[k, a, i] * dT[k, a, first + j]


@njit(cache=True)
def _assemble(Fn, Ft, P, T, dP, dT, F, K):
    """Forces P, T (k,) along n and e, their derivatives (k, 2 + 5) → F, and K = −∂F/∂q while the frame stays."""
    for k in range(len(P)):
        for i in range(5):
            F[k, i] = P[k] * Fn[k, i] + T[k] * Ft[k, i]
            for j in range(5):
                K[k, i, j] = -Fn[k, i] * dP[k, 2 + j] - Ft[k, i] * dT[k, 2 + j]


@njit(cache=True)
def _turn(n, e, arm, turn, moving, P, T, K):
    """Add to K what the turn of the frame and the change of the arm make of the forces P along n and T along e."""
    for k in range(len(P)):
        v0, v1 = P[k] * e[k, 0] - T[k] * n[k, 0], P[k] * e[k, 1] - T[k] * n[k, 1]
        v = (v0, v1, -v0, -v1, arm[k, 1] * v0 - arm[k, 0] * v1)
        for i in range(5):
            for j in range(5):
                K[k, i, j] -= v[i] * turn[k, j]
        # the arm moves against the tool, and with the body point where forces act at it
        x, y = P[k] * n[k, 0] + T[k] * e[k, 0], P[k] * n[k, 1] + T[k] * e[k, 1]
        if moving:
            K[k, 4, 0] += y
            K[k, 4, 1] -= x
        K[k, 4, 2] -= y
        K[k, 4, 3] += x


def stretching(f: ContactForces, points: Points, share: Array, slopes: Array) -> Array:
    """Stiffness (s, 2a + 7, 2a + 7) of the areas of the shares of edges, with which the forces of tangential tractions grow.

    On the a nodes that carry the point, both nodes of the share's edge, the tool. share (k,) of their area that points have;
    slopes (s, 2, 2) as `Points.slopes`. F_T = a t(P/a) F_t, so −∂F_T/∂x has −(t − (P/a) ∂t/∂p) F_t ⊗ ∂a/∂x, which reaches over
    the edge: all of t where the law says m k, nothing of it where it says μ p.
    """
    assert f.stretched is not None
    point = points.shares.point
    force, N = (f.stretched[:, 0] * share)[point, None] * f.pairs.Ft[point, 0], points.N[point]
    a = 2 * N.shape[1]
    columns = slopes.reshape(-1, 1, 4)
    K = np.zeros((len(force), a + 7, a + 7))
    K[:, :a, a : a + 4] = -(N[:, :, None] * force[:, None, :2]).reshape(-1, a, 1) * columns
    K[:, a + 4 :, a : a + 4] = -force[:, 2:, None] * columns
    return K


def with_stretched_bounds(K: Array, f: ContactForces, points: Points, share: Array, slopes: Array, scale: Scale) -> Array:
    """K of `stretching` (s, m, m) with the row of the point's tangential multiplier (see `multiplier_rows`) after the others.

    ∂t/∂x of a point that slides has −(P/a) ∂t/∂p ∂a/∂x / a: its pressure falls as its area grows.
    """
    assert f.stretched is not None
    m, point, edge = K.shape[1], points.shares.point, 2 * points.N.shape[1]
    falls = (f.stretched - f.t)[:, 0]
    if f.kept is not None:
        falls = np.where(f.kept.held.tangential, f.kept.falls, falls)
    falls = falls / f.area * share * f.weight * scale.unit / scale.k_t
    out = np.zeros((len(K), m + 1, m + 1))
    out[:, :m, :m] = K
    out[:, m, edge : edge + 4] = falls[point, None] * slopes.reshape(-1, 4)
    return out


def multiplier_rows(f: ContactForces, pairs: Pairs, lam: Array, scale: Scale) -> tuple[Array, Array]:
    """Equations of the multipliers and the stiffness of the extended pairs (q, ℓ_n, ℓ_T), ℓ = λ/c, c = E*/h.

    lam (k, 1 + t) multipliers → R (k, 1 + t) = w c ((p − λ_n)/k_n, (t − λ_T)/k_T), forces; K (k, m + 1 + t, m + 1 + t), the
    derivative of (−F, R). R = 0 says g = 0 where closed, no slip where stuck, t_T on its bound along the slip where it
    slides, and no multiplier where open; of points whose supports prescribe gap or slip, that λ is what they keep. Frictionless,
    K is as symmetric as the contact geometry.
    """
    q, n = f.F.shape[1], lam.shape[1]
    w, c = f.weight, scale.unit
    stiff = np.stack([scale.k_n, *[scale.k_t] * (n - 1)], axis=1)
    values, dR = np.hstack([f.p[:, None], f.t]), np.concatenate([f.dp[:, None], f.dt], axis=1)
    if f.kept is not None:
        f.kept.put(values, dR)
    R = (w * c)[:, None] * ((values - lam) / stiff)
    K = np.empty((len(w), q + n, q + n))
    K[:, :q, :q] = f.K
    dP, dT = w[:, None] * f.dp[:, :n], f.area[:, None, None] * f.dt[:, :, :n]
    by_lam = pairs.Fn[:, :, None] * dP[:, None]
    for a in range(n - 1):
        by_lam = by_lam + pairs.Ft[:, a, :, None] * dT[:, a, None]
    K[:, :q, q:] = -c[:, None, None] * by_lam
    for a in range(n):
        dR[:, a, a] -= 1.0
    dR *= (w * c)[:, None, None] / stiff[:, :, None]
    K[:, q:, :q] = dR[:, :, n:]
    K[:, q:, q:] = c[:, None, None] * dR[:, :, :n]
    return R, K
