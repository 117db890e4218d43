"""Closed derivatives of contact forces along many directions, for penalty and exact contacts with Coulomb's friction.

Points keep their sides: open ones have no force, of those that stick the trial traction λ_T − k_T Δs is the traction, of those
that slip it is ± μ p. What changes with the places of body and tool the matrix knows; the rest is λ′, k′, μ′, the area and the
committed coordinate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from prensa.contact.directions import along, energies, grown, jvp_explicit
from prensa.contact.forces import ContactForces, Scale
from prensa.contact.record import ContactRecord
from prensa.contact.redundant import RedundantMultipliers
from prensa.contact.surface import Surface
from prensa.system.interaction import Context
from prensa.types import Array


@dataclass(frozen=True)
class Committed:
    """What directions change of the points of a contact before an increment, and of its laws; directions d are the last axis.

    ``slip``, ``area``, ``area_was`` (k, d), the areas of the increment and of that before; ``coordinate``, ``traction``
    (k, 1, d); ``scale`` (3, k, d) of k_n, k_T and the unit of multipliers; ``mu`` (d,); ``place`` (2, d) of the tool;
    ``X`` (n, 2, d) of the initial places of nodes, (0, 2, d) where all stay.
    """

    slip: Array
    area: Array
    area_was: Array
    coordinate: Array
    traction: Array
    scale: Array
    mu: Array
    place: Array
    X: Array


@dataclass
class Points:
    """A contact in an increment and its directions: the rates at fixed dofs, then those along a solution too (`follow`).

    ``way``, ``slid`` (k,): along the tool in the increment, and of that the slip. ``p``, ``t``, ``s``, ``kappa`` (k, d);
    ``F`` (k, m, d) forces on the unknowns of the stencils; ``lam`` (k, 2, d) multipliers.
    """

    surface: Surface
    f: ContactForces
    scale: Scale
    way: Array
    slid: Array
    before: Committed
    p: Array
    t: Array
    s: Array
    F: Array
    kappa: Array
    lam: Array
    Fn: Array
    Ft: Array

    @classmethod
    def of(cls, c: Context, number: int, f: ContactForces, before: Committed, lam: Array, u: Array, r: Array) -> Points:
        """At fixed degrees of freedom u (ndof,), with their forces taken off residuals r (ndof, d).

        lam (k, 2, d): of the committed multipliers, to be changed.
        """
        s, scale = c.surfaces[number], c.scales[number]
        way = f.s[:, 0] - c.committed[number].coordinate[:, 0]
        p, t, moved, kappa = np.empty((4, *before.area.shape))
        F = np.empty((*f.F.shape, before.area.shape[1]))
        Fn, Ft = (f.stencils.act(v) for v in (f.stencils.n, f.stencils.e[:, 0]))
        pressure = lam[:, 0].copy()
        own, first = (np.empty((0, 2)), -1) if s.multipliers is None else (s.multipliers.of(u), s.unknowns.start)
        jvp_explicit(
            f.p, f.t, f.g, f.slip, way, f.dp, f.dt, f.stencils.ds, Fn, Ft, f.K, f.weight,
            scale.k_n, scale.k_t, scale.unit, own, s.points.support, s.dofs, first,
            before.area, lam, before.coordinate, before.scale, before.mu, before.X, before.place, p, t, moved, F, r,
        )  # fmt: skip
        out = cls(s, f, scale, way, f.kappa - c.committed[number].slip, before, p, t, moved, F, kappa, lam, Fn, Ft)
        if f.redundant is not None:
            out._keep(f.redundant, pressure, r)
        return out

    def _keep(self, redundant: RedundantMultipliers, pressure: Array, r: Array) -> None:
        """Put into r (ndof, d) the equations of multipliers that supports leave undetermined; pressure (k, d): committed."""
        f, first = self.f, self.surface.unknowns.start
        n, t, cut = (np.flatnonzero(which) for which in redundant.points)
        size = (f.weight * self.scale.unit)[:, None]
        r[first + 2 * n] += (size / self.scale.k_n[:, None])[n] * (pressure - self.p)[n]
        traction = self.before.traction[:, 0].copy()
        traction[cut] = (
            redundant.by_p[cut, None] * self.p[cut] + np.sign(redundant.t[cut])[:, None] * f.p[cut, None] * self.before.mu
        )
        r[first + 2 * t + 1] += (size / self.scale.k_t[:, None])[t] * (traction - self.t)[t]

    def unmet(self) -> Array:
        """What conditions that supports prescribe move apart (d,), as forces: points that slide or open from a state of rest."""
        if self.f.redundant is None:
            return np.zeros(self.p.shape[1])
        size = (self.f.weight * self.scale.unit)[:, None]
        gaps, ways = (self.lam[:, 0] - self.p) / self.scale.k_n[:, None], self.s - self.before.coordinate[:, 0]
        return self.f.redundant.points.moved_apart(size * gaps, size * ways)

    @staticmethod
    def grown(c: Context, number: int, dxn: Array) -> Array:
        """Rates (k, d) of the areas of contact ``number`` as an increment begins, from motions dxn (n, 2, d) of nodes."""
        points = c.surfaces[number].points
        out = np.empty((len(points), dxn.shape[2]))
        share = points.shares
        grown(
            c.x_n, points.edges, share.point, share.edge, share.factor, share.at, points.axisymmetric, points.thickness, dxn, out
        )
        return out

    def follow(self, x: Array) -> None:
        """Add what motions x (ndof, d) of the degrees of freedom make."""
        f, s, b = self.f, self.surface, self.before
        along(
            f.p, f.t, f.slip, self.way, self.slid, f.dp, f.dt, f.stencils.ds, self.Fn, self.Ft, f.K, f.weight,
            self.scale.k_t, self.scale.unit, s.dofs, -1 if s.multipliers is None else s.unknowns.start, x,
            self.lam, b.slip, b.coordinate, b.scale, self.p, self.t, self.s, self.F, self.kappa,
        )  # fmt: skip

    def add_energies(self, was: ContactRecord, friction: Array, stored: Array) -> None:
        """Add derivatives of the work of friction and of the energy in springs, (d,); ``was``: the committed points."""
        f, b = self.f, self.before
        energies(
            f.p, f.t, was.traction, self.slid, f.weight, self.scale.k_n, self.scale.k_t, self.surface.exact, b.area, b.scale,
            self.p, self.t, b.traction, b.slip, was.area, b.area_was, self.kappa, friction, stored,
        )  # fmt: skip
