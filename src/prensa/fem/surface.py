"""Contacts as data: candidate points of a surface against a tool, and as an interaction: what they do to a residual."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prensa.contact.cut import Corners
from prensa.contact.forces import (
    NEARBY,
    ContactForces,
    Scale,
    forces,
    multiplier_rows,
    stretching,
    with_stretched_bounds,
)
from prensa.contact.integration import Points
from prensa.contact.kept import Held, Kept, Supports, hold
from prensa.contact.stencil import Stencils
from prensa.fem.context import Context
from prensa.fem.failure import FrictionTooSoft
from prensa.fem.interaction import Branches, Part, Request, Response
from prensa.friction.law import bounded
from prensa.friction.return_map import DECIDE, HOLD, STUCK
from prensa.layout import DofMap, Field
from prensa.model import problem as model

if TYPE_CHECKING:
    from prensa.fem.system import System

Array = NDArray[np.float64]
Index = NDArray[np.int64]

EPS = float(np.finfo(np.float64).eps)
ROUND = 1.0  # round-off of a gap or slip over ε × size, at most
USUAL = (
    0.4  # share of that which gaps and slips of many points have: 0.1 to 0.35 measured under planes, 0.2 under rolls
)


@dataclass(frozen=True)
class Surface:
    """One contact: candidate points against a master. ``first`` is the row of its first point in the state's arrays.

    ``X`` (k, d) initial positions of the points, ``dofs`` (k, m) unknowns of their stencils: displacements of each supporting
    node, then those of the master; ``normal`` (k, d) of the undeformed surface at the points, ``node_normal`` (n, d) at
    its nodes;
    ``behind`` (m,): elements of the body behind the edges.
    ``multipliers``: their field, normal and tangential of each point; None if they are no degrees of freedom.
    ``corners``: those of the tool that hold points in this increment.
    """

    name: str
    description: model.Contact
    body: str
    points: Points
    first: int
    X: Array
    dofs: Index
    normal: Array
    node_normal: Array
    modulus: float
    behind: Index
    multipliers: Field | None = None
    corners: Corners | None = None

    @property
    def against(self) -> str:
        """Name of its master."""
        return self.description.against

    @property
    def sharp(self) -> bool:
        """Whether edges may be cut at sharp corners of the tool, anew in each increment."""
        return self.points.with_neighbours

    @property
    def exact(self) -> bool:
        """Whether its multipliers are degrees of freedom."""
        return self.multipliers is not None

    @property
    def unknowns(self) -> slice:
        """Places of its multipliers in the vector of degrees of freedom."""
        assert self.multipliers is not None
        return self.multipliers.slice

    @cached_property
    def rows(self) -> slice:
        """Rows of this contact in `State.contact` and `State.lam`."""
        return slice(self.first, self.first + len(self.points))

    @property
    def of_master(self) -> slice:
        """Which of the unknowns of a stencil are the master's."""
        return slice(self.X.shape[1] * self.points.N.shape[1], None)

    @property
    def coupled(self) -> Index:
        """Unknowns of the stencils (k, d a + m), followed by the multipliers where these are dofs (k, d a + m + 1 + t)."""
        if self.multipliers is None:
            return self.dofs
        return np.hstack([self.dofs, self.multipliers.dofs(np.arange(len(self.points)))])

    def stretched_dofs(self, dofs: DofMap) -> Index:
        """Degrees of freedom (shares, m + 4) of the stencils of the shares' points, and of the nodes of their edges.

        Followed by the tangential multiplier of the point where that is a degree of freedom.
        """
        part = self.points.shares
        ends = dofs.displacement.dofs(self.points.edges[part.edge]).reshape(len(part.edge), -1)
        both = np.hstack([self.dofs[part.point], ends])
        return both if self.multipliers is None else np.hstack([both, self.multipliers.dofs(part.point)[:, 1:]])

    @property
    def unit(self) -> Array:
        """E*/h (k,) of the points: what β multiplies, h what they press in; of multipliers the unit, h the depth there."""
        return self.modulus / (self.points.depth if self.exact else self.points.pressed_length)

    def supports(self, fixed: Index) -> Supports | None:
        """Of exact contacts in the plane: the points with ``fixed`` degrees of freedom of the body; None if there are none."""
        if not self.exact or self.X.shape[1] > 2:
            return None
        free = ~np.isin(self.dofs, fixed)
        at = np.flatnonzero(~free[:, : self.of_master.start].all(axis=1))
        return Supports(at, free[at]) if len(at) else None

    def scale(self, k_t_least: Array) -> Scale:
        """Penalty stiffnesses of the points: k_n = β E*/h, k_T = β_T E*/h, not below ``k_t_least`` (k,)."""
        unit = self.unit
        k_n, k_t = self.description.enforcement.stiffness(unit)
        return Scale(k_n, np.maximum(k_t, k_t_least), self.points.depth, unit)


@dataclass(frozen=True)
class ContactInteraction:
    """A contact in the residual: p and t_T on stencils, and the equations of multipliers that are degrees of freedom."""

    system: System
    surface: Surface
    number: int

    def couplings(self) -> list[Index]:
        """Of each stencil, and of both nodes of an edge where areas change with them."""
        s = self.surface
        return [s.coupled, s.stretched_dofs(self.system.dofs)]

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        system, s, k = self.system, c.surfaces[self.number], self.number
        scale, weight, law, own = c.scales[k], c.weights[k], c.laws[k], s.rows
        # the first guess has the tools deep in the bodies: what those overlaps would turn with the frame outweighs the bodies
        turning = (c.state.lam[own, 0].copy(), c.committed[k].traction) if ask.guess else None
        follows = law is not None and not law.proportional and system.problem.kinematics == "finite" and not s.sharp
        area = system.weights(s, system.positions(ask.u), c.depth) if follows else None
        stencils, lam = system.stencils(s, ask.u, c.state), ask.lam[own]
        round_off = self._round_off(stencils, ask.u)
        f = forces(
            stencils,
            weight,
            scale,
            lam,
            c.committed[k],
            law,
            c.law_at[k],
            round_off,
            self._wanted(c, ask),
            area,
            c.lagged,
            turning,
            None if ask.foundation is None else ask.foundation[own],
            s.points,
        )
        if (kept := self._kept(c, f, round_off, ask.like)) is not None:
            f = f._replace(kept=kept)
        # points that just touch are closed or open by the round-off of their gaps; those that stick have that of their slips
        stiff = weight * scale.k_n * (f.rests | (f.dp[:, 0] > 0)) + f.area * scale.k_t * f.resists
        out = Response(floor=_usual_sum(stiff * round_off), trial=f)
        if not (np.isfinite(f.K.sum()) or np.isfinite(f.K).all()):  # most need no flags
            out.failed = FrictionTooSoft(s.name)
            return out
        out.scale = float(np.abs(f.vectors).sum())
        r, K = -f.F, f.K
        if s.exact:
            rows, K = multiplier_rows(f, lam, scale)
            r = np.hstack([r, rows])
            out.violation = self._violation(f, rows, scale, ask.reach)
        parts = [Part(s.name, s.coupled, r, K if ask.stiffness else None)]
        if f.stretched is not None and ask.stiffness and not c.lagged:
            parts.append(self._stretching(c, f, scale, ask.u))
        out.parts = parts
        return out

    def _wanted(self, c: Context, ask: Request) -> NDArray[np.int8]:
        """Branches (k,) that the points are to take.

        For a first guess points that were closed stay so and stick, and what just touches resists: the kink's other slope
        would leave a resting body free.
        """
        s = c.surfaces[self.number]
        if ask.like is not None and ask.like.contacts:
            return ask.like.contacts[self.number].wanted
        if ask.guess:
            return np.where(c.committed[self.number].closed, STUCK, DECIDE | NEARBY).astype(np.int8)
        want = np.full(len(s.points), DECIDE, dtype=np.int8)
        if ask.landed is not None:
            want[ask.landed[s.rows]] |= NEARBY
        if ask.stick is not None:
            want[ask.stick[s.rows]] |= HOLD
        return want

    def _round_off(self, x: Stencils, u: Array) -> Array:
        """Round-off of the gaps (k,): ε × the coordinates whose differences they are."""
        master = self.system.master(self.surface)
        place = master.place(u)[: master.dimension]
        centre = max(map(abs, master.at.tolist())) + max(map(abs, place.tolist()))
        return ROUND * EPS * (reduce(np.maximum, np.abs(x.arm).T) + centre)

    def _kept(self, c: Context, f: ContactForces, round_off: Array, like: Branches | None) -> Kept | None:
        """What multipliers are that supports leave undetermined, ``like`` another evaluation has them; None if there are none."""
        s, k = c.surfaces[self.number], self.number
        held = like.contacts[k].held if like is not None and like.contacts else self._held(c, f, round_off)
        if held is None:
            return None
        p, t, law, nothing = c.state.lam[s.rows, 0], c.committed[k].traction[:, 0], c.laws[k], np.zeros(len(f.p))
        if not (t * held.tangential).any():  # nothing to be cut down
            return Kept(held, p, t, nothing, nothing)
        share, bound, by_p = f.weight / f.area, nothing, nothing
        pressure = np.maximum(f.p, 0.0) * share
        if law is not None:
            bound, by_p, _ = bounded(law, pressure, c.committed[k].slip, c.law_at[k])
        if like is None:
            held = held._replace(bounded=held.tangential & (np.abs(t) > bound))
        slope, cut = np.where(held.bounded, np.sign(t) * by_p, 0.0), np.where(held.bounded, np.sign(t) * bound, t)
        return Kept(held, p, cut, nothing if c.lagged else slope * share, -slope * pressure)

    def _held(self, c: Context, f: ContactForces, round_off: Array) -> Held | None:
        """Closed points whose gap and way are zero since supports prescribe them; None if there are none."""
        s, supports = c.surfaces[self.number], c.supports[self.number]
        if supports is None:
            return None
        out = np.zeros((3, len(f.p)), dtype=np.bool_)
        hold(
            supports.at, supports.free, f.stencils.dg, f.stencils.ds[:, 0], f.dp[:, 0] > 0,
            f.g, f.s[:, 0], c.committed[self.number].coordinate[:, 0], s.points.depth, round_off, out,
        )  # fmt: skip
        return Held(*out) if out.any() else None

    def _violation(self, f: ContactForces, rows: Array, scale: Scale, reach: float) -> float:
        """Largest residual of the multipliers' equations as a length over the element depth, beyond round-off."""
        system = self.system
        lengths = np.abs(rows).max(axis=1, initial=0.0) / (f.weight * scale.unit)
        at = np.abs(system.master(self.surface).at).max()
        size = max(reach, float(np.abs(system.X).max()), float(at))
        return float(((lengths - ROUND * EPS * size) / scale.h).max(initial=0.0))

    def _stretching(self, c: Context, f: ContactForces, scale: Scale, u: Array) -> Part:
        """How the areas of tangential tractions change with both nodes of their edges."""
        system, s = self.system, self.surface
        share, slopes = s.points.at(system.share(c.depth)), s.points.slopes(system.positions(u))
        K = stretching(f, s.points, share, slopes)
        if s.exact:
            K = with_stretched_bounds(K, f, s.points, share, slopes, scale)
        return Part(f"stretch {s.name}", s.stretched_dofs(system.dofs), None, K)


def _usual_sum(most: Array) -> float:
    """Sum of the sizes of round-off that terms bounded by ``most`` (k,) usually have: one may reach its bound, many do not."""
    whole = float(most.sum())
    return USUAL * whole + (1.0 - USUAL) * float(most @ most) / whole if whole > 0.0 else 0.0
