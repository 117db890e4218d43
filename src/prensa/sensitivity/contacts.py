"""Closed derivatives of contact forces along many directions, for penalty and exact contacts with Coulomb's friction.

Points keep their sides: open ones have no force, of those that stick the trial traction λ_T − k_T Δs is the traction, of those
that slip it is ± μ p. What changes with the places of body and tool the matrix knows; the rest is λ′, k′, μ′, the area and the
committed coordinate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prensa.contact.forces import ContactForces, Scale
from prensa.fem.context import Context
from prensa.fem.surface import Surface
from prensa.fem.system import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Committed:
    """What directions change of the points of a contact before an increment, and of its laws, each (d, k).

    ``lam`` (d, k, 2) multipliers at fixed degrees of freedom; ``kappa`` slip and ``s`` coordinate as committed; ``area``;
    ``k_n``, ``k_t``; ``mu`` (d,); ``q`` (d, k, 5) motions of body points and tool at fixed degrees of freedom, or None.
    """

    lam: Array
    kappa: Array
    s: Array
    area: Array
    k_n: Array
    k_t: Array
    mu: Array
    q: Array | None


@dataclass
class Points:
    """A contact in an increment and its directions: the rates at fixed dofs, then those along a solution too (`follow`).

    ``way``, ``slid`` (k,): along the tool in the increment, and of that the slip. ``p``, ``t``, ``s``, ``kappa`` (d, k);
    ``F`` (d, k, 5) forces on the pairs; ``rows`` (d, k, 2) equations of its multipliers, ``lam`` (d, k, 2) these.
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
    rows: Array | None
    kappa: Array
    lam: Array

    @classmethod
    def of(cls, c: Context, number: int, f: ContactForces, before: Committed) -> Points:
        """At fixed degrees of freedom."""
        s, scale = c.surfaces[number], c.scales[number]
        way = f.s[:, 0] - c.committed[number].coordinate[:, 0]
        p = f.dp[:, 0] * (before.lam[:, :, 0] - before.k_n * f.g)
        trial = before.lam[:, :, 1] - before.k_t * way + scale.k_t * before.s
        slides = f.slip * np.sign(f.t[:, 0]) * f.p
        t = f.dt[:, 0, 0] * p + f.dt[:, 0, 1] * trial + before.mu[:, None] * slides
        P, T = before.area * f.p + f.weight * p, before.area * f.t[:, 0] + f.weight * t
        F = P[:, :, None] * f.pairs.Fn + T[:, :, None] * f.pairs.Ft[:, 0]
        slid = f.kappa - c.committed[number].slip
        out = cls(s, f, scale, way, slid, before, p, t, np.zeros_like(p), F, None, np.zeros_like(p), before.lam)
        if before.q is not None:
            out._move(before.q)
        if s.exact:
            gaps = np.stack([(out.p - out.lam[:, :, 0]) / scale.k_n, (out.t - out.lam[:, :, 1]) / scale.k_t], axis=2)
            out.rows = (f.weight * scale.unit)[:, None] * gaps  # what the rows' factors change multiplies zero
        return out

    def _move(self, q: Array) -> None:
        """Add what motions q (d, k, 5) of the pairs make."""
        f = self.f
        self.p = self.p + (f.dp[:, 2:] * q).sum(axis=2)
        self.t = self.t + (f.dt[:, 0, 2:] * q).sum(axis=2)
        self.s = self.s + (f.pairs.ds[:, 0] * q).sum(axis=2)
        self.F = self.F - (f.K @ q[..., None])[..., 0]

    def add_to(self, r: Array) -> None:
        """Take the forces off residuals r (ndof, d), and add the equations of the multipliers."""
        s = self.surface
        forces = self.F if s.points.N.shape[1] == 1 else np.stack([s.points.on_dofs(F) for F in self.F])
        np.subtract.at(r, s.dofs, np.moveaxis(forces, 0, -1))
        if self.rows is not None:
            r[s.unknowns] += self.rows.reshape(r.shape[1], -1).T

    def follow(self, system: System, x: Array) -> None:
        """Add what motions x (ndof, d) of the degrees of freedom make."""
        x = x.T
        f, s = self.f, self.surface
        q = np.empty((len(x), len(f.p), 5))
        nodal = x[:, system.dofs.displacement.slice].reshape(len(x), -1, 2)
        at = nodal[:, s.points.support]
        q[:, :, :2] = at[:, :, 0] if at.shape[2] == 1 else (s.points.N[:, :, None] * at).sum(axis=2)
        q[:, :, 2:] = x[:, None, system.dofs.tool.dofs(s.tool)]
        self._move(q)
        if s.multipliers is not None:
            lam = x[:, s.unknowns].reshape(len(x), -1, 2) * self.scale.unit[:, None]
            p, t = (f.dp[:, :2] * lam).sum(axis=2), (f.dt[:, 0, :2] * lam).sum(axis=2)
            self.p, self.t, self.lam = self.p + p, self.t + t, self.lam + lam
            self.F = self.F + (f.weight * p)[:, :, None] * f.pairs.Fn + (f.weight * t)[:, :, None] * f.pairs.Ft[:, 0]
        self.kappa = self._slip()

    def _slip(self) -> Array:
        """Of the accumulated slip (d, k): κ_n + (|t_tr| − |t|)/k_T where a point slips."""
        f, k_t, b = self.f, self.scale.k_t, self.before
        sign = np.sign(f.t[:, 0])
        trial = self.lam[:, :, 1] - b.k_t * self.way - k_t * (self.s - b.s)
        return b.kappa + f.slip * (sign * (trial - self.t) - self.slid * b.k_t) / k_t
