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

from prensa.contact.integration import Points
from prensa.contact.point import normal
from prensa.contact.record import ContactRecord, magnitude
from prensa.contact.redundant import RedundantMultipliers, RedundantPoints
from prensa.contact.stencil import Response, Stencils, assemble
from prensa.friction.law import At, FrictionLaw
from prensa.friction.return_map import BRANCH, OPEN, SLIDING, STUCK, return_map
from prensa.types import Array, Bytes, Flags


class ContactSets(NamedTuple):
    """Which points are ``closed`` and which of those ``slip`` (k,): the sides of the kinks of contact and friction.

    ``redundant``: whose multipliers supports leave undetermined; None if nobody's.
    """

    closed: Flags
    slip: Flags
    redundant: RedundantPoints | None = None

    @property
    def wanted(self) -> Bytes:
        """The branches (k,) that `forces` is to take."""
        return np.where(self.closed, np.where(self.slip, SLIDING, STUCK), OPEN).astype(np.int8)


class ContactForces(NamedTuple):
    """k ``stencils``: p, kappa (k,), t (k, t) along the tangents e; slip flags; F (k, m) forces on q; K (k, m, m) = −∂F/∂q.

    weight (k,) belongs to p, area (k,) to t: the same but for laws that are not proportional to the pressure.
    stretched (k, t): ∂(a t)/∂a, force per area that the surface gains, where the areas are current ones; else None.
    dp (k, 1 + t + m), dt (k, t, 1 + t + m): derivatives of p and t by λ_n, λ_T and q.
    ``rests`` (k,): closed, or open by no more than round-off.
    bound (k, 2): the bound of friction per area and its derivative by p; None without friction.
    ``points``: those of the increment, which differ from the surface's where edges are cut.
    ``redundant``: what multipliers are that supports leave undetermined; None if there are none. acting (2, k, d): `vectors` and
    `by_pressure` of the evaluation, found with F.
    """

    stencils: Stencils
    p: Array
    t: Array
    kappa: Array
    slip: Flags
    F: Array
    K: Array
    weight: Array
    area: Array
    dp: Array
    dt: Array
    rests: Flags
    stretched: Array | None = None
    bound: Array | None = None
    points: Points | None = None
    redundant: RedundantMultipliers | None = None
    acting: Array | None = None

    @property
    def g(self) -> Array:
        """Gaps (k,)."""
        return self.stencils.g

    @property
    def active_sets(self) -> ContactSets:
        """The sides on which the points are, and on which K has them."""
        # Read off the slope, not the pressure: a point that rests with p = 0 has a closed point's row in K.
        return ContactSets(self.dp[:, 0] > 0, self.slip, self.redundant and self.redundant.points)

    @property
    def vectors(self) -> Array:
        """Forces (k, d) on the bodies at the points."""
        pull = ((self.area[:, None] * self.t)[:, :, None] * self.stencils.e).sum(axis=1)
        return np.asarray((self.weight * self.p)[:, None] * self.stencils.n + pull)

    @property
    def by_p(self) -> Array:
        """Derivatives (k, t) of the tractions by the pressure: of points that slip, the slope of their bound."""
        return np.asarray(self.dt[:, :, 0] / np.where(self.dp[:, 0] > 0, self.dp[:, 0], 1.0)[:, None])

    @property
    def by_pressure(self) -> Array:
        """Forces (k, d) on the bodies of a unit of pressure, with the friction that follows it."""
        pull = ((self.area[:, None] * self.by_p)[:, :, None] * self.stencils.e).sum(axis=1)
        return np.asarray(self.weight[:, None] * self.stencils.n + pull)

    @property
    def record(self) -> ContactRecord:
        """What is committed of the points; speed, time and path, which need the increment, are those of points at rest."""
        none = np.zeros_like(self.kappa)
        return ContactRecord(self.stencils.to_keep(self.t), self.kappa, self.s, self.p > 0, none, self.area, none, none)

    def slid(self, before: ContactRecord, du: Array, free: bool) -> Array:
        """Ways (k,) along the tangents in an increment du (ndof,) of points that are closed then.

        With friction what has slipped, so that a penalty's elastic part does not count; ``free`` of it, all that moves along.
        """
        if not free:
            return self.kappa - before.slip
        way = (self.stencils.ds @ du[self.stencils.dofs][:, :, None])[..., 0]
        return np.where(self.p > 0, magnitude(way), 0.0)

    @property
    def s(self) -> Array:
        """Surface coordinates (k, t)."""
        return self.stencils.s

    @property
    def way(self) -> Bytes:
        """Eighth of a turn (k,), 0 … 7 from the first tangent on, in which the traction lies; 0 or 4 in the plane."""
        if self.t.shape[1] == 1:
            # Two directions of the same eight that the solver watches for points that go to and fro.
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
    x: Stencils, weight: Array, scale: Scale, lam: Array, committed: ContactRecord, law: FrictionLaw | None, at: At,
    round_off: Array, want: Bytes, area: Array | None = None, picard_friction: bool = False,
    turning: tuple[Array, Array] | None = None, foundation: Array | None = None, points: Points | None = None,
) -> ContactForces:  # fmt: skip
    """Contact forces on the unknowns of stencils and their exact, unsymmetric stiffness.

    weight (k,); lam (k, 1 + t) multipliers normal, tangential; ``committed``: the points at the last commit; ``round_off`` (k,)
    of the gaps.
    want (k,): the branch that a point takes, its sides of the kinks: `DECIDE`, or `OPEN`, `STUCK`, `SLIDING` whatever pressure
    and traction say, so that its forces are smooth. K has the slope of the side that p is on, so that a point in tension
    opens; what was closed and is open by round-off keeps that of closed points. To `DECIDE` may be added `NEARBY`, with which
    a point also resists that is open by less than `TOUCH`, and `HOLD` (see `return_map`).
    area (k,): current areas, to which the tractions of a law that is not proportional to the pressure belong, its bound being
    that at the pressure per current area, P/a; None: those are ``weight``, or cancel. How areas depend on the positions is not
    in K (see `by_area`).
    ``picard_friction``: stiffness of the paper (24)-(26), k_n n⊗n + k_TT e⊗e: friction at the pressure of the last iterate and
    the tool's curvature are in the forces only.
    ``turning``: pressures (k,) and tractions (k, t) in the terms of K that turn the frame, in the place of those at the gaps.
    foundation (k, 2): where it is not 0, the slopes of p and of t in K are these shares of those of a closed point and of one
    that sticks, whatever the state.
    """
    k, t = lam.shape[0], lam.shape[1] - 1
    p, touching, rests = normal(x.g, lam[:, 0], scale.k_n, scale.h, round_off, committed.closed, want)
    slope = touching.astype(np.float64)  # −∂p/∂g over k_n: 1 of a closed point, 0 where nothing touches
    if foundation is not None:
        springs = foundation[:, 0] > 0.0
        slope, touching = np.where(springs, foundation[:, 0], slope), touching | springs
    stretched, bound = None, None
    if law is None:
        tractions, kappa, slip = np.zeros((k, t)), committed.slip.copy(), np.zeros(k, dtype=bool)
        by_p, by_way = np.zeros((k, t)), np.zeros((k, t, t))
    else:
        share = None if area is None else weight / area
        # A point that is made to stay closed may be in tension, where no law has a bound. Where slip is prescribed p stays as
        # it is: derivatives at fixed active sets need forces that are smooth through p = 0.
        pressure = np.where((want & BRANCH) == SLIDING, p, np.maximum(p, 0.0))
        # P/a: laws are per current area, pressures per committed area, which leaves the frictionless tangent symmetric.
        pressure = pressure if share is None else pressure * share
        way = x.s - committed.coordinate
        out = return_map(law, at, lam[:, 1:], way, pressure, touching, committed.slip, scale.k_t, want)
        tractions, kappa, slip, by_p, by_way, bound = out.t, out.kappa, out.slip, out.dt_dp, out.dt_dg, out.bound
        if share is not None:
            by_p, bound = by_p * share[:, None], bound * np.stack([np.ones(k), share], axis=1)
            stretched = tractions - out.dt_dp * pressure[:, None]
    area = weight if area is None else area
    if picard_friction:
        by_p = np.zeros_like(by_p)
        # Equations (24)-(26) of the paper have no term from the frame's rotation; the forces keep it.
        turning = np.zeros(k), np.zeros((k, t))
    if foundation is not None and law is not None:
        springs = foundation[:, 1] > 0.0
        # On the weak foundation of a contact step every candidate sticks elastically, so its traction must not follow its
        # pressure; the complementarity problem takes the springs off again.
        by_p = np.where(springs[:, None], 0.0, by_p)
        stuck = -(foundation[:, 1] * scale.k_t)[:, None, None] * np.eye(t)
        by_way = np.where(springs[:, None, None], stuck, by_way)
    response = Response(p, tractions, slope, by_p, by_way, scale.k_n, scale.k_t, weight, area)
    F, K, dp, dt, acting = assemble(x, response, (p, tractions) if turning is None else turning)
    return ContactForces(x, p, tractions, kappa, slip, F, K, weight, area, dp, dt, rests, stretched, bound, points, None, acting)


def symmetric_stiffness(f: ContactForces) -> Array:
    """Symmetric stand-in (k, m, m) for the stiffness of contact points: k_n n ⊗ n and what friction resists along the surface.

    Without what is unsymmetric or may be negative: friction that follows the pressure, and the curvature of tools. Along the
    surface it is the return map's: k_T of points that stick, and of those that slide k_T |t|/|t trial| across their way.
    """
    d = f.t.shape[1] + 1
    by_pressure = f.dp[:, d:]
    K = -(f.weight[:, None] * f.stencils.act(f.stencils.n))[:, :, None] * by_pressure[:, None, :]
    along = f.dt[:, :, d:] - f.by_p[:, :, None] * by_pressure[:, None, :]
    for a in range(d - 1):
        K -= (f.area[:, None] * f.stencils.act(f.stencils.e[:, a]))[:, :, None] * along[:, a, None, :]
    return np.asarray(0.5 * (K + K.transpose(0, 2, 1)))


def by_area(f: ContactForces, scale: Scale | None) -> tuple[Array, Array]:
    """Forces (k, m) on the unknowns of the stencils, and rows (k, t) of tangential multipliers, per area that points gain.

    F_T = a t(P/a) F_t, so ∂F_T/∂a has (t − (P/a) ∂t/∂p) F_t: all of t where the law says m k, nothing of it where it says μ p.
    scale: of points whose multipliers are degrees of freedom (see `multiplier_rows`); None: none are, and rows are (k, 0).
    ∂t/∂a of a point that slides is −(P/a) ∂t/∂p / a, as its pressure falls while its area grows.
    """
    assert f.stretched is not None
    force = f.stencils.act((f.stretched[:, :, None] * f.stencils.e).sum(axis=1))
    if scale is None:
        return force, np.zeros((len(force), 0))
    falls = f.stretched - f.t
    if f.redundant is not None and falls.shape[1] == 1:
        falls = np.where(f.redundant.points.tangential[:, None], f.redundant.falls[:, None], falls)
    falls = falls / f.area[:, None] * f.weight[:, None] * scale.unit[:, None] / scale.k_t[:, None]
    return force, falls


def multiplier_rows(f: ContactForces, lam: Array, scale: Scale) -> tuple[Array, Array]:
    """Equations of the multipliers and the stiffness of the extended stencils (q, ℓ_n, ℓ_T), ℓ = λ/c, c = E*/h.

    lam (k, 1 + t) multipliers → R (k, 1 + t) = w c ((p − λ_n)/k_n, (t − λ_T)/k_T), forces; K (k, m + 1 + t, m + 1 + t), the
    derivative of (−F, R). R = 0 says g = 0 where closed, no slip where stuck, t_T on its bound along the slip where it
    slides, and no multiplier where open; of points whose supports prescribe gap or slip, that λ is what they keep. Frictionless,
    K is as symmetric as the contact geometry.
    """
    q, n = f.F.shape[1], lam.shape[1]
    w, c = f.weight, scale.unit
    stiff = np.stack([scale.k_n, *[scale.k_t] * (n - 1)], axis=1)
    values, dR = np.hstack([f.p[:, None], f.t]), np.concatenate([f.dp[:, None], f.dt], axis=1)
    if f.redundant is not None:
        f.redundant.put(values, dR)
    R = (w * c)[:, None] * ((values - lam) / stiff)
    K = np.empty((len(w), q + n, q + n))
    K[:, :q, :q] = f.K
    dP, dT = w[:, None] * f.dp[:, :n], f.area[:, None, None] * f.dt[:, :, :n]
    by_lam = f.stencils.act(f.stencils.n)[:, :, None] * dP[:, None]
    for a in range(n - 1):
        by_lam = by_lam + f.stencils.act(f.stencils.e[:, a])[:, :, None] * dT[:, a, None]
    # Unknowns ℓ are lengths and equations R forces: the extended matrix has the unit of a stiffness throughout.
    K[:, :q, q:] = -c[:, None, None] * by_lam
    for a in range(n):
        dR[:, a, a] -= 1.0
    dR *= (w * c)[:, None, None] / stiff[:, :, None]
    K[:, q:, :q] = dR[:, :, n:]
    K[:, q:, q:] = c[:, None, None] * dR[:, :, :n]
    return R, K
