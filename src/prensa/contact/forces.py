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
NO_FLAGS = np.zeros(0, dtype=bool)  # to kernels: none are given
NO_FOUNDATION = np.zeros((0, 2))
NO_FRICTION = np.zeros((0, 1)), np.zeros((0, 1, 1))  # slopes of tractions by pressure and way
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
    round_off: Array, hold: NDArray[np.bool_] | None = None, area: Array | None = None, lagged: bool = False,
    before: Array | None = None, landed: NDArray[np.bool_] | None = None,
    foundation: Array | None = None, like: Branches | None = None, points: Points | None = None,
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
    dp, dt = np.zeros((k, 1 + m + pairs.dg.shape[1])), np.zeros((k, m, 1 + m + pairs.dg.shape[1]))
    p, lam_T, ds, touching, rests = np.empty(k), np.empty((k, m)), np.empty((k, m)), np.empty(k, bool), np.empty(k, bool)
    resting = NO_FOUNDATION if foundation is None else foundation
    _normal(
        pairs.g, pairs.s, lam, scale.k_n, scale.h, round_off, committed.closed, committed.coordinate,
        NO_FLAGS if landed is None else landed, NO_FLAGS if like is None else like.closed, resting, before is not None,
        p, touching, rests, lam_T, ds, dp,
    )  # fmt: skip
    stretched, bound = None, None
    if law is None:
        t, kappa, slip = np.zeros((k, m)), committed.slip.copy(), np.zeros(k, dtype=bool)
        by_p, dt_dg = NO_FRICTION
    else:
        share = None if area is None else weight / area
        pressure = np.maximum(p, 0.0) if like is None else p
        pressure = pressure if share is None else pressure * share
        out = return_map(law, at, lam_T, ds, pressure, touching, committed.slip, scale.k_t, hold, like and like.slip)
        t, kappa, slip, by_p, dt_dg, bound = out.t, out.kappa, out.slip, out.dt_dp, out.dt_dg, out.bound
        if share is not None:
            by_p, bound = by_p * share[:, None], bound * np.stack([np.ones(k), share], axis=1)
            stretched = t - out.dt_dp * pressure[:, None]
    area = weight if area is None else area
    F, K = np.empty(pairs.Fn.shape), np.empty((k, pairs.Fn.shape[1], pairs.Fn.shape[1]))
    _assemble(
        pairs.Fn, pairs.Ft, pairs.dg, pairs.ds, weight, area, p, t, by_p, dt_dg, scale.k_n, scale.k_t, resting, lagged,
        dp, dt, F, K,
    )  # fmt: skip
    if not lagged:
        turned(pairs, weight, area, *((p, t) if before is None else (before, committed.traction)), K)
    return ContactForces(pairs, p, t, kappa, slip, F, K, weight, area, dp, dt, rests, stretched, bound, points)


@njit(cache=True, error_model="numpy")
def _normal(
    g, s, lam, k_n, h, round_off, closed, coordinate, landed, like, foundation, guess, p, touching, rests, lam_T, ds, dp,
):  # fmt: skip
    """Pressures p (k,) at gaps g (k,), which points resist, and which are open by no more than round-off.

    ``closed``: committed flags; ``guess``: points that were closed stay so, and what is within `TOUCH` of the tool resists;
    ``like``: which points are closed, whatever their gaps. dp (k, 1 + t + m): its first column, derivatives by λ_n. Besides
    lam_T (k, t), the tangential multipliers, and ds (k, t), the ways since the last commit.
    """
    n = lam.shape[1]
    for k in range(len(g)):
        trial = lam[k, 0] - k_n[k] * g[k]  # −inf where a ray misses the tool
        rests[k] = trial >= -(k_n[k] * round_off[k] + EPS * abs(lam[k, 0]))
        just = trial >= -TOUCH * k_n[k] * h[k]
        p[k] = 0.0 if trial <= 0.0 else trial
        if len(like) > 0:
            touching[k] = like[k]
            p[k] = trial if like[k] else 0.0
        elif guess:
            stays = closed[k] and np.isfinite(trial)  # a point that the tool has left behind has no gap
            touching[k] = just or stays
            if stays:
                p[k] = trial
        else:
            touching[k] = rests[k] if closed[k] else trial >= 0.0
            if len(landed) > 0 and landed[k] and just:
                touching[k] = True
        slope = 1.0 if touching[k] else 0.0  # 0 where nothing touches
        if len(foundation) > 0 and foundation[k, 0] > 0.0:
            slope, touching[k] = foundation[k, 0], True
        dp[k, 0] = slope
        for a in range(n - 1):
            lam_T[k, a], ds[k, a] = lam[k, 1 + a], s[k, a] - coordinate[k, a]


@njit(cache=True, error_model="numpy")
def _assemble(Fn, Ft, dg, ds, weight, area, p, t, by_p, dt_dg, k_n, k_t, foundation, lagged, dp, dt, F, K):
    """Derivatives dp, dt (k, t, 1 + t + m) by multipliers and q, forces F, and K = −∂F/∂q while the frame stays.

    dp (k, 1 + t + m) has its first column. by_p (k, t), dt_dg (k, t, t): derivatives of the return map, (0, …) without
    friction. Points that rest on a tangential ``foundation`` have the derivatives of its springs.
    """
    n = 1 + t.shape[1]
    for k in range(len(p)):
        share = foundation[k, 1] if len(foundation) > 0 else 0.0
        for i in range(Fn.shape[1]):
            F[k, i] = weight[k] * p[k] * Fn[k, i]
            for a in range(n - 1):
                F[k, i] += area[k] * t[k, a] * Ft[k, a, i]
        for c in range(dp.shape[1]):
            if c >= n:
                dp[k, c] = (-dp[k, 0] * k_n[k]) * dg[k, c - n]
            for a in range(n - 1):
                if len(by_p) == 0:
                    break
                change = 0.0 if lagged else by_p[k, a] * dp[k, c]
                if c >= n:
                    way = 0.0
                    for b in range(n - 1):
                        way += dt_dg[k, a, b] * ds[k, b, c - n]
                    change = change + way if share <= 0.0 else -(share * k_t[k]) * ds[k, a, c - n]
                elif share > 0.0:
                    change = share if c == 1 + a else 0.0
                elif c > 0:  # the trial traction is λ_T − k_T Δg_T
                    change -= dt_dg[k, a, c - 1] / k_t[k]
                dt[k, a, c] = change
            if c >= n:
                for i in range(Fn.shape[1]):
                    stiff = -Fn[k, i] * (weight[k] * dp[k, c])
                    for a in range(n - 1):
                        stiff -= Ft[k, a, i] * (area[k] * dt[k, a, c])
                    K[k, i, c - n] = stiff


def turned(pairs: Pairs, weight: Array, area: Array, p: Array, t: Array, K: Array) -> None:
    """Add to K (k, m, m) what the turn of the frame and the change of the arm make of pressures p and tractions t."""
    if t.shape[1] == 1:
        _turn(pairs.n, pairs.e, pairs.arm, pairs.turn, pairs.moving, weight, area, p, t, K)
        return
    # the arm moves with the body point and against the tool; the frame of a plane that does not turn stays
    f = (weight * p)[:, None] * pairs.n + ((area[:, None] * t)[:, :, None] * pairs.e).sum(axis=1)
    across = np.cross(np.eye(3)[None], f[:, None]).transpose(0, 2, 1)  # column j: e_j × f
    K[:, 6:, :3] += across
    K[:, 6:, 3:6] -= across


@njit(cache=True)
def _turn(n, e, arm, turn, moving, weight, area, p, t, K):
    """`turned` in the plane."""
    for k in range(len(p)):
        P, T = weight[k] * p[k], area[k] * t[k, 0]
        v0, v1 = P * e[k, 0, 0] - T * n[k, 0], P * e[k, 0, 1] - T * n[k, 1]
        v = (v0, v1, -v0, -v1, arm[k, 1] * v0 - arm[k, 0] * v1)
        for i in range(5):
            for j in range(5):
                K[k, i, j] -= v[i] * turn[k, j]
        # the arm moves against the tool, and with the body point where forces act at it
        x, y = P * n[k, 0] + T * e[k, 0, 0], P * n[k, 1] + T * e[k, 0, 1]
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
