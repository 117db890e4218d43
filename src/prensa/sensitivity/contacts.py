"""Closed derivatives of contact forces along many directions, for penalty and exact contacts and laws stated for a point.

Points keep their sides: open ones have no force, of those that stick the trial traction λ_T − k_T Δs is the traction, of those
that slip it is the bound of the law. Answers of points follow from what they depend on by the generated derivatives of
`prensa.contact.point`; forces are w p n + a t e on the nodes, and turn with the frame as in the matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from prensa.contact.forces import ContactForces, Scale
from prensa.contact.integration import Points as ContactPoints
from prensa.contact.point import Point, Slopes, slopes
from prensa.contact.redundant import RedundantMultipliers
from prensa.contact.stencil import Response, assemble
from prensa.contact.surface import Surface
from prensa.materials.strength import Strength, strength
from prensa.system.interaction import Context
from prensa.system.system import System
from prensa.types import Array


def slopes_of(c: Context, number: int, f: ContactForces, u: Array) -> Slopes:
    """Derivatives of the points of a contact by what they depend on, after an increment that ended at dofs u (ndof,)."""
    s, scale, was = c.surfaces[number], c.scales[number], c.committed[number]
    lam = s.description.enforcement.initial_multipliers(c.state.lam[s.rows].copy())
    if s.multipliers is not None:
        lam = s.multipliers.of(u) * s.unit[:, None]
    x = Point(
        f.g, f.s - was.coordinate, lam[:, 0], lam[:, 1:], scale.k_n, scale.k_t, f.weight, f.area, was.slip, was.traction,
        was.area, f.dp[:, 0] > 0, f.slip,
    )  # fmt: skip
    return slopes(x, c.laws[number], c.law_at[number], f.stretched is not None)


def strength_behind(system: System, c: Context, s: Surface) -> tuple[int, Strength]:
    """The number of the block behind a contact and the shear yield stresses in the elements there as an increment begins."""
    number = next(i for i, b in enumerate(system.blocks) if b.body == s.body)
    metal: Any = system.blocks[number].law
    history = c.state.history[number][s.behind]
    return number, strength(history.reshape(-1, history.shape[-1]), metal.yield_on_cauchy, metal.flow)


def turning(f: ContactForces) -> Array:
    """Stiffness (k, m, m) of pressures and tractions that stay and turn with the frame."""
    k, t = f.t.shape
    none = np.zeros((k, t))
    still = Response(f.p, f.t, np.zeros(k), none, np.zeros((k, t, t)), np.ones(k), np.ones(k), f.weight, f.area)
    return assemble(f.stencils, still, (f.p, f.t)).K


def area_rates(points: ContactPoints, x: Array, dx: Array) -> Array:
    """Rates (k, d) of the points' areas at node positions x (n, 2) that move by dx (n, 2, d)."""
    shares, out = points.shares, np.zeros((len(points), dx.shape[2]))
    by, moved = points.slopes(x), dx.take(points.edges[shares.edge], axis=0)
    rates = by.reshape(len(by), 1, -1) @ moved.reshape(len(by), by[0].size, -1)
    np.add.at(out, shares.point, rates[:, 0])
    return out


@dataclass(frozen=True)
class Committed:
    """What directions change of the points of a contact before an increment, and of its law; directions d are the last axis.

    ``slip``, ``area``, ``area_was``, ``strength``, ``speed`` (k, d): areas of the increment and of that before, shear yield
    stress of the body, speed of slip; ``coordinate``, ``traction`` (k, 1, d); ``scale`` (3, k, d) of k_n, k_T and the unit of
    multipliers; ``law`` (n, d): numbers of the law; ``place`` (2, d) of the tool; ``X`` (n, 2, d) of the initial places of nodes,
    (0, 2, d) where all stay.
    """

    slip: Array
    area: Array
    area_was: Array
    strength: Array
    speed: Array
    coordinate: Array
    traction: Array
    scale: Array
    law: Array
    place: Array
    X: Array


@dataclass
class Points:
    """A contact in an increment and its directions: the rates at fixed dofs, then those along a solution too (`follow`).

    ``p``, ``t``, ``s``, ``kappa`` (k, d); ``F`` (k, m, d) forces on the unknowns of the stencils; ``lam`` (k, 2, d) multipliers;
    ``area`` (k, d) of tractions; ``bound`` (k, d) of friction at the committed slip; ``friction``, ``stored`` (d,): work of
    friction, energy in springs. ``q`` (k, m, d): motions of the unknowns; ``x`` (n, 2): where nodes are. ``paths`` (k, 2, m): of
    these motions, gap and way; ``effects`` (k, m, 2 + m): of normal force, of traction and of motions that turn both, forces F.
    """

    surface: Surface
    f: ContactForces
    scale: Scale
    before: Committed
    by: Slopes
    paths: Array
    effects: Array
    q: Array
    lam: Array
    area: Array
    x: Array

    @classmethod
    def of(
        cls, c: Context, number: int, f: ContactForces, before: Committed, lam: Array, u: Array, x: Array, r: Array
    ) -> Points:  # fmt: skip
        """At fixed degrees of freedom u (ndof,) and places x (n, 2), with their forces taken off residuals r (ndof, d).

        lam (k, 2, d): of the committed multipliers, to be changed.
        """
        s, scale = c.surfaces[number], c.scales[number]
        a, q = s.points.support.shape[1], np.zeros((*s.dofs.shape, before.area.shape[1]))
        if len(before.X):
            q[:, : 2 * a] = before.X[s.points.support].reshape(len(q), 2 * a, -1)
        q[:, 2 * a : 2 * a + 2] = before.place
        # Penalties start from λ_n = 0 whatever pressure is committed; its derivative is only needed for multipliers that are
        # kept.
        committed = lam[:, 0].copy()
        lam[:, 0] = 0.0
        if s.multipliers is not None:
            lam[:] = before.scale[2][:, None] * s.multipliers.of(u)[:, :, None]
        stencils = f.stencils
        paths = np.stack([stencils.dg, stencils.ds[:, 0]], axis=1)
        forces = [stencils.act(stencils.n)[..., None], stencils.act(stencils.e[:, 0])[..., None]]
        effects = np.concatenate([*forces, -turning(f)], axis=2)
        out = cls(s, f, scale, before, slopes_of(c, number, f, u), paths, effects, q, lam, before.area, x)
        if f.stretched is not None:
            out.area = area_rates(s.points, x, before.X) if len(before.X) else np.zeros_like(before.area)
        out._answer()
        np.subtract.at(r, s.dofs, out.F)
        if s.multipliers is not None:
            out._multipliers(r)
        if f.redundant is not None:
            out._keep(f.redundant, committed, r)
        return out

    def _answer(self) -> None:
        """What the points answer to the motions, multipliers and areas up to now."""
        b, ways = self.before, self.paths @ self.q
        gap, self.s = ways[:, 0], ways[:, 1]
        found = self.by.along({
            "g": gap[:, None], "way": self.s[:, None] - b.coordinate, "lam_n": self.lam[:, :1], "lam": self.lam[:, 1:],
            "k_n": b.scale[0][:, None], "k_t": b.scale[1][:, None], "weight": b.area[:, None], "area": self.area[:, None],
            "slip": b.slip[:, None], "traction": b.traction, "area_was": b.area_was[:, None], "k": b.strength[:, None],
            "speed": b.speed[:, None], "numbers": b.law,
        })  # fmt: skip
        self.p, self.t, self.kappa, self.bound = (found[name][:, 0] for name in ("p", "t", "slip", "bound"))
        self.friction, self.stored = (found[name].sum(axis=(0, 1)) for name in ("friction", "stored"))
        self.F = self.effects @ np.concatenate([found["P"], found["T"], self.q], axis=1)

    def _multipliers(self, r: Array) -> None:
        """Add to r (ndof, d) the equations of multipliers, whose factors change what is zero."""
        first, size = self.surface.unknowns.start, (self.f.weight * self.scale.unit)[:, None]
        k = 2 * np.arange(len(self.p)) + first
        r[k] += size * (self.p - self.lam[:, 0]) / self.scale.k_n[:, None]
        r[k + 1] += size * (self.t - self.lam[:, 1]) / self.scale.k_t[:, None]

    def _keep(self, redundant: RedundantMultipliers, pressure: Array, r: Array) -> None:
        """Put into r (ndof, d) the equations of multipliers that supports leave undetermined; pressure (k, d): committed."""
        f, first = self.f, self.surface.unknowns.start
        n, t, cut = (np.flatnonzero(which) for which in redundant.points[:3])
        size = (f.weight * self.scale.unit)[:, None]
        r[first + 2 * n] += (size / self.scale.k_n[:, None])[n] * (pressure - self.p)[n]
        traction = self.before.traction[:, 0].copy()
        traction[cut] = np.sign(redundant.t[cut])[:, None] * self.bound[cut]
        r[first + 2 * t + 1] += (size / self.scale.k_t[:, None])[t] * (traction - self.t)[t]

    def unmet(self) -> Array:
        """What conditions that supports prescribe move apart (d,), as forces: points that slide or open from a state of rest."""
        if self.f.redundant is None:
            return np.zeros(self.p.shape[1])
        size = (self.f.weight * self.scale.unit)[:, None]
        gaps, ways = (self.lam[:, 0] - self.p) / self.scale.k_n[:, None], self.s - self.before.coordinate[:, 0]
        return self.f.redundant.points.moved_apart(size * gaps, (size * ways)[:, None])

    def follow(self, x: Array, moved: Array) -> None:
        """Add what motions x (ndof, d) of the degrees of freedom make, of which those of nodes are ``moved`` (n, 2, d)."""
        s = self.surface
        self.q += x[s.dofs]
        if s.multipliers is not None:
            self.lam += self.scale.unit[:, None, None] * x[s.unknowns].reshape(len(self.p), 2, -1)
        if self.f.stretched is not None:
            self.area = self.area + area_rates(s.points, self.x, moved)
        self._answer()
