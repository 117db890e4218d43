"""A contact as an interaction: what its points do to a residual and its matrix."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

from prensa.contact.forces import (
    ContactForces,
    Scale,
    by_area,
    forces,
    multiplier_rows,
)
from prensa.contact.point import NEARBY
from prensa.contact.record import magnitude
from prensa.contact.redundant import RedundantMultipliers, RedundantPoints, hold, hold_in_space
from prensa.contact.stencil import Stencils
from prensa.contact.surface import Surface
from prensa.friction.law import bounded
from prensa.friction.return_map import DECIDE, HOLD, STUCK
from prensa.precision import EPS
from prensa.system.failure import FrictionTooSoft
from prensa.system.interaction import ActiveSets, Context, Discretisation, Part, Request, Response
from prensa.types import Array, Bytes, Index

ROUND = 1.0  # round-off of a gap or slip over ε × size, at most
USUAL = (
    0.4  # share of that which gaps and slips of many points have: 0.1 to 0.35 measured under planes, 0.2 under rolls
)


@dataclass(frozen=True)
class ContactInteraction:
    """A contact in the residual: p and t_T on stencils, and the equations of multipliers that are degrees of freedom."""

    system: Discretisation
    surface: Surface
    number: int

    def couplings(self) -> list[Index]:
        """Of each stencil, and of the nodes of an edge or a face where areas change with them."""
        s = self.surface
        return [s.coupled, s.stretched_dofs(self.system.dofs)]

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        system, s, k = self.system, c.surfaces[self.number], self.number
        scale, law, own = c.scales[k], c.laws[k], s.rows
        stencils, lam = system.stencils(s, ask.u, c.state), ask.lam[own]
        weight = c.weights[k] if stencils.area is None else stencils.area
        # the first guess has the tools deep in the bodies: what those overlaps would turn with the frame outweighs the bodies
        turning = (c.state.lam[own, 0].copy(), c.committed[k].traction) if ask.guess else None
        follows = law is not None and not law.proportional and system.problem.kinematics == "finite" and not s.sharp
        follows = follows and stencils.area is None  # those that move with the coefficients are in these
        area = system.weights(s, system.positions(ask.u), c.depth) if follows else None
        round_off = self._round_off(stencils, ask.u)
        held = self._held_in_space(c, stencils, round_off, ask.active_sets)
        f = forces(
            stencils,
            weight,
            scale,
            lam if held is None else np.hstack([lam[:, :1], held.kept(lam[:, 1:], c.committed[k].traction)]),
            c.committed[k],
            law,
            c.law_at[k],
            round_off,
            self._wanted(c, ask),
            area,
            c.picard_friction,
            turning,
            None if ask.foundation is None else ask.foundation[own],
            s.points,
        )
        if held is not None:
            f = self._keeping(c, f, held)
        elif (redundant := self._redundant(c, f, round_off, ask.active_sets)) is not None:
            f = f._replace(redundant=redundant)
        # points that just touch are closed or open by the round-off of their gaps; those that stick have that of their slips
        assert f.acting is not None
        stiff = scale.k_n * (f.rests | (f.dp[:, 0] > 0)) * _along_axes(f.acting[1])
        if law is not None:
            stiff += f.area * scale.k_t * f.resists * _along_axes(stencils.e).max(axis=1)
        out = Response(floor=_usual_sum(stiff * round_off), trial=f)
        if not (np.isfinite(f.K.sum()) or np.isfinite(f.K).all()):  # most need no flags
            out.failed = FrictionTooSoft(s.name)
            return out
        out.scale = float(np.abs(f.acting[0]).sum())
        r, K = -f.F, f.K
        if s.exact:
            rows, K = multiplier_rows(f, lam, scale)
            r = np.hstack([r, rows])
            out.violation = self._violation(f, rows, scale, ask.reach)
        parts = [Part(s.name, s.coupled, r, K if ask.stiffness else None)]
        if f.stretched is not None and ask.stiffness and not c.picard_friction:
            parts.append(self._stretching(c, f, scale, ask.u))
        out.parts = parts
        return out

    def _wanted(self, c: Context, ask: Request) -> Bytes:
        """Branches (k,) that the points are to take.

        For a first guess points that were closed stay so and stick, and what just touches resists: the kink's other slope
        would leave a resting body free. On a foundation, which resists by itself, it is for the contact step to decide that.
        """
        s = c.surfaces[self.number]
        if ask.active_sets is not None and ask.active_sets.contacts:
            return ask.active_sets.contacts[self.number].wanted
        if ask.guess and ask.foundation is None:
            return np.where(c.committed[self.number].closed, STUCK, DECIDE | NEARBY).astype(np.int8)
        want = np.full(len(s.X), DECIDE, dtype=np.int8)
        if ask.stick is not None:
            want[ask.stick[s.rows]] |= HOLD
        return want

    def _round_off(self, x: Stencils, u: Array) -> Array:
        """Round-off of the gaps (k,): ε × the coordinates whose differences they are."""
        return ROUND * EPS * self.system.masters[self.surface.against].coordinates(self.surface, x, self.system, u)

    def _held_in_space(
        self, c: Context, x: Stencils, round_off: Array, active_sets: ActiveSets | None
    ) -> RedundantPoints | None:
        """In space, points whose gap or way supports prescribe, or those of ``active_sets`` if given; None if there are none."""
        s, supports = c.surfaces[self.number], c.supports[self.number]
        if x.s.shape[1] == 1 or supports is None:
            return None
        if active_sets is not None and active_sets.contacts:
            return active_sets.contacts[self.number].redundant
        slipped = x.s - c.committed[self.number].coordinate
        normal, along = hold_in_space(supports, x.g, x.dg, x.ds, slipped, s.points.depth, round_off)
        tangential = np.asarray(along.any(axis=(1, 2)))
        if not (normal | tangential).any():
            return None
        return RedundantPoints(normal, tangential, np.zeros_like(normal), along)

    def _keeping(self, c: Context, f: ContactForces, held: RedundantPoints) -> ContactForces:
        """Forces in space whose multipliers were those that points ``held`` keep, with what that does to their derivatives."""
        along, t, nothing = held.along, f.t.shape[1], np.zeros(len(f.p))
        assert along is not None
        held = held._replace(normal=held.normal & (f.dp[:, 0] > 0))
        f.dt[:, :, 1 : 1 + t] -= f.dt[:, :, 1 : 1 + t] @ along
        redundant = RedundantMultipliers(held, c.state.lam[self.surface.rows, 0], nothing, nothing, nothing)
        # what the bound cuts off kept tractions is no slip
        before = c.committed[self.number]
        slid = before.slip + magnitude(f.s - before.coordinate)
        return f._replace(redundant=redundant, kappa=np.where(held.tangential & f.slip, slid, f.kappa))

    def _redundant(
        self, c: Context, f: ContactForces, round_off: Array, active_sets: ActiveSets | None
    ) -> RedundantMultipliers | None:
        """Multipliers that supports leave undetermined, at the points of ``active_sets`` if given; None if there are none."""
        s, k = c.surfaces[self.number], self.number
        if active_sets is None or not active_sets.contacts:
            held = self._held(c, f, round_off)
        else:
            held = active_sets.contacts[k].redundant
        if held is None:
            return None
        p, t, law, nothing = c.state.lam[s.rows, 0], c.committed[k].traction[:, 0], c.laws[k], np.zeros(len(f.p))
        if not (t * held.tangential).any():  # nothing to be cut down
            return RedundantMultipliers(held, p, t, nothing, nothing)
        share, bound, by_p = f.weight / f.area, nothing, nothing
        pressure = np.maximum(f.p, 0.0) * share
        if law is not None:
            bound, by_p, _ = bounded(law, pressure, c.committed[k].slip, c.law_at[k])
        if active_sets is None:
            held = held._replace(bounded=held.tangential & (np.abs(t) > bound))
        slope, cut = np.where(held.bounded, np.sign(t) * by_p, 0.0), np.where(held.bounded, np.sign(t) * bound, t)
        return RedundantMultipliers(held, p, cut, nothing if c.picard_friction else slope * share, -slope * pressure)

    def _held(self, c: Context, f: ContactForces, round_off: Array) -> RedundantPoints | None:
        """Closed points whose gap and way are zero since supports prescribe them; None if there are none."""
        s, supports = c.surfaces[self.number], c.supports[self.number]
        if supports is None or f.t.shape[1] > 1:
            return None
        out = np.zeros((3, len(f.p)), dtype=np.bool_)
        hold(
            supports.at, supports.free, f.stencils.dg, f.stencils.ds[:, 0], f.dp[:, 0] > 0,
            f.g, f.s[:, 0], c.committed[self.number].coordinate[:, 0], s.points.depth, round_off, out,
        )  # fmt: skip
        return RedundantPoints(*out) if out.any() else None

    def _violation(self, f: ContactForces, rows: Array, scale: Scale, reach: float) -> float:
        """Largest residual of the multipliers' equations as a length over the element depth, beyond round-off."""
        system = self.system
        lengths = np.abs(rows).max(axis=1, initial=0.0) / (f.weight * scale.unit)
        at = np.abs(system.tool_masters[self.surface.against].at).max()
        size = max(reach, float(np.abs(system.X).max()), float(at))
        return float(((lengths - ROUND * EPS * size) / scale.h).max(initial=0.0))

    def _stretching(self, c: Context, f: ContactForces, scale: Scale, u: Array) -> Part:
        """How the areas of tangential tractions change with the nodes of their edges or faces."""
        system, s = self.system, self.surface
        share = s.points.at(system.share(c.depth))[:, None]
        force, own = by_area(f, scale if s.exact else None)
        K = s.points.stretching(system.positions(u), share * force, share * own)
        return Part(f"stretch {s.name}", s.stretched_dofs(system.dofs), None, K)


def _usual_sum(most: Array) -> float:
    """Sum of the sizes of round-off that terms bounded by ``most`` (k,) usually have: one may reach its bound, many do not."""
    whole = float(most.sum())
    return USUAL * whole + (1.0 - USUAL) * float(most @ most) / whole if whole > 0.0 else 0.0


def _along_axes(vectors: Array) -> Array:
    """Sums of the sizes of the components of vectors (…, d): the residual is summed so, and inclined forces count more in it."""
    return np.asarray(reduce(np.add, np.abs(vectors).T).T)
