"""Bodies that nothing holds yet approach as rigid bodies with the tools that touch them, until others stop them.

A billet with room to the die under it, a sheet between binder and die: before it is clamped its stiffness says nothing of where
it is, and the linear systems of a body that only one tool touches are singular. What moves it is no deformation: it goes as a
rigid body, without friction, to where the springs of the tools against it balance the forces on it and on pushed tools.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from prensa.contact.stencil import Stencils
from prensa.contact.surface import Surface
from prensa.linear.rigid_modes import Loose
from prensa.policy import DEFAULT, Policy
from prensa.solver.approach import bisected
from prensa.system.contacts import were_closed
from prensa.system.interaction import Context, Request
from prensa.system.system import System
from prensa.types import Array, Index


class RigidApproach(NamedTuple):
    """Where loose ``bodies`` have been carried: all degrees of freedom ``u`` (ndof,); None where they have nowhere to go.

    ``floating``: no tool presses them there. Otherwise they are clamped, and what forces have moved went ``through_air`` (ndof,)
    to where it only just touched.
    """

    u: Array | None
    bodies: list[str]
    floating: bool
    through_air: Array | None = None


def rigid_approach(system: System, c: Context, loose: list[Loose], policy: Policy = DEFAULT) -> RigidApproach | None:
    """Where the bodies that nothing holds go in an increment; None if there are none, or what happens to them is not known.

    loose: bodies that supports leave free to move (see `loose_bodies`). Those that tools press already are held by these. What
    already touches another tool than those that push it is held by that as far as friction bears it, which is not for here.
    """
    unheld = [] if c.plan.control is not None else [body for body in loose if not _pressed(system, c, body, policy)]
    if not unheld:
        return None
    names, clear = [name for b in unheld for name in b.bodies], policy.approach_gap_ratio * system.length
    rigid = _Rigid.of(system, c, unheld, clear)
    before = [float(system.stencils(s, rigid.base).g.min()) if s.body in names else np.inf for s in c.surfaces]
    if not rigid.room:
        z = rigid.balanced(policy.max_rigid_steps)
        u = None if z is None else rigid.dofs(z)
        if u is None or not _near(system, c, unheld, u, policy):
            return None
        brought = any(float(system.stencils(s, u).g.min()) < 0.0 and g > 0.1 * clear for s, g in zip(c.surfaces, before))
        return RigidApproach(u, names, False, rigid.through_air(policy)) if brought else None
    rigid.pushers = [i for i, g in enumerate(before) if g < -0.1 * clear]
    if not rigid.pushers:
        return RigidApproach(None, names, True)
    z = rigid.balanced(policy.max_rigid_steps) if all(abs(g) > 0.1 * clear for g in before) else None
    u = None if z is None else rigid.dofs(z)
    if u is None or not _near(system, c, unheld, u, policy):
        return None
    stops = [s for i, s in enumerate(c.surfaces) if s.body in names and i not in rigid.pushers]
    return RigidApproach(u, names, all(float(system.stencils(s, u).g.min()) > -clear for s in stops))


class Met(NamedTuple):
    """When bodies that approach as rigid bodies first meet what stops them, and where they are then."""

    time: float
    there: RigidApproach


def first_clamped(system: System, c: Context, loose: list[Loose], policy: Policy = DEFAULT) -> Met | None:
    """When the bodies that are clamped at the end of an increment are so first; None if that is no earlier, or at once.

    Those that forces press, whatever these are, are clamped at once.
    """
    if c.plan.push:
        return None
    now, end, length = c.state.clock.time, c.time, c.plan.t1 - c.plan.t0

    def at(t: float) -> RigidApproach | None:
        return rigid_approach(system, replace(c, time=t), loose, policy)

    _, time = bisected(lambda t: (to := at(t)) is None or to.floating, now, end)
    there = at(time)
    apart = time - now > policy.min_share_before_touch * (end - now) and end - time > policy.min_share_left * length
    return Met(time, there) if apart and there is not None and there.u is not None else None


def _near(system: System, c: Context, loose: list[Loose], u: Array, policy: Policy) -> bool:
    """Whether bodies have gone as far as what carries them, levers counted, and have not been squeezed out sideways."""
    way = u - c.state.u
    tools = np.abs(system.dofs.tool.of(way)[:, :2]).max()
    return all(np.abs(system.displacement(way)[b.nodes]).max() <= policy.max_approach_ratio * tools for b in loose)


def _pressed(system: System, c: Context, body: Loose, policy: Policy) -> bool:
    """Whether tools press a body in the committed state, by more than what rounded positions make of their springs."""
    nothing = policy.approach_depth_ratio * system.length
    own = [(s, scale) for s, scale in zip(c.surfaces, c.scales) if s.body in body.bodies]
    return any((c.state.lam[s.rows, 0] > nothing * scale.k_n).any() for s, scale in own)


class _Body(NamedTuple):
    """A loose body in the configuration that gaps are taken in: ``arm`` (nodes, 2) from the middle of its nodes."""

    loose: Loose
    arm: Array


@dataclass
class _Rigid:
    """Loose bodies and pushed tools that touched nothing, between the other tools at the end of an increment.

    Unknowns z: motions of the bodies (see `Loose`), then of the tools' degrees of freedom ``tools`` (t,). ``base`` (ndof,):
    from where they start; ``forces`` (ndof,) on them. ``room``: gap at which a tool begins to press: nothing, or a little if
    there are no forces, so that what is not clamped is not pressed. ``pushers``: numbers of the contacts that count.
    """

    system: System
    c: Context
    base: Array
    bodies: list[_Body]
    tools: Index
    forces: Array
    room: float
    pushers: Sequence[int]

    @classmethod
    def of(cls, system: System, c: Context, loose: list[Loose], room: float) -> _Rigid:
        """With the tools and supports of the end of the increment."""
        base = c.state.u.copy()
        base[c.plan.fixed] = c.plan.values(c.time)
        base = system.with_slaves(base)
        x = system.positions(base) if system.problem.kinematics == "finite" else system.X
        bodies = [_Body(b, x[b.nodes] - x[b.nodes].mean(axis=0)) for b in loose]
        tools = np.array(sorted(_brought(system, c)), dtype=np.int64)
        ask, forces = Request(base, system.initial_multipliers(c.state), stiffness=False), np.zeros(system.ndof)
        for interaction in c.interactions[len(c.surfaces) :]:
            answer = interaction.respond(c, ask)
            for part in answer.parts if answer.external else ():
                if part.r is not None:
                    np.add.at(forces, part.dofs, part.r)
        rigid = cls(system, c, base, bodies, tools, forces, 0.0, range(len(c.surfaces)))
        rigid.room = 0.0 if rigid.driving(rigid.start).any() else room
        return rigid

    @property
    def start(self) -> Array:
        """The unknowns where nothing has moved."""
        return np.zeros(sum(len(b.loose.motions) for b in self.bodies) + len(self.tools))

    def split(self, z: Array) -> tuple[list[tuple[_Body, Array]], Array]:
        """Motions (3,) of each body, along x and y and its turn, and those of the tools (t,)."""
        out, first = [], 0
        for b in self.bodies:
            last = first + len(b.loose.motions)
            motion = z[first:last] @ b.loose.motions
            out.append((b, motion / [1.0, 1.0, b.loose.size]))
            first = last
        return out, z[first:]

    def dofs(self, z: Array) -> Array:
        """All degrees of freedom (ndof,): distances within a body stay, in small strain to first order."""
        u = self.base.copy()
        moved = self.system.displacement(u)
        bodies, ways = self.split(z)
        u[self.tools] += ways
        for b, (x, y, turn) in bodies:
            moved[b.loose.nodes] += np.array([x, y]) + self._turned(b.arm, turn) - b.arm
        return u

    def _turned(self, arm: Array, turn: float) -> Array:
        """Arms (k, 2) after a turn."""
        if self.system.problem.kinematics == "small":
            return np.asarray(arm + turn * _across(arm))
        return np.asarray(np.cos(turn) * arm + np.sin(turn) * _across(arm))

    def fields(self, z: Array) -> list[tuple[list[str], Array]]:
        """Of each unknown of the bodies: what moves, and displacements (n, 2) for a unit of it."""
        out = []
        for b, (_, _, turn) in self.split(z)[0]:
            small = self.system.problem.kinematics == "small"
            across = _across(b.arm if small else self._turned(b.arm, turn)) / b.loose.size
            for x, y, about in b.loose.motions:
                field = np.zeros_like(self.system.X)
                field[b.loose.nodes] = [x, y] + about * across
                out.append((b.loose.bodies, field))
        return out

    def driving(self, z: Array) -> Array:
        """Forces along the unknowns."""
        nodal = self.system.displacement(self.forces)
        return np.array([*((nodal * field).sum() for _, field in self.fields(z)), *self.forces[self.tools]])

    def answer(self, z: Array) -> tuple[Array, Array, float]:
        """Forces (k,) that are missing along the unknowns, their matrix (k, k), and the force that counts as nothing.

        That is a part of all springs' forces, or what the rounding of positions makes of them.
        """
        u, fields = self.dofs(z), self.fields(z)
        r, K = -self.driving(z), np.zeros((len(z), len(z)))
        total, stiff = float(np.abs(r).max()), 0.0
        for i in self.pushers:
            s, w, scale = self.c.surfaces[i], self.c.weights[i], self.c.scales[i]
            x = self.system.stencils(s, u)
            inside = np.flatnonzero(x.g < self.room)
            if not len(inside):
                continue
            slopes, k = self._slopes(s, x, fields)[inside], (w * scale.k_n)[inside]
            force = k * (self.room - x.g[inside])
            r, K = r - slopes.T @ force, K + slopes.T @ (k[:, None] * slopes)
            total, stiff = total + float(force.sum()), stiff + float(k.sum())
        return r, K, max(1e-9 * total, self._rounded(stiff))

    def _rounded(self, stiff: float) -> float:
        """What the rounding of positions makes of springs of a stiffness."""
        return 16.0 * float(np.finfo(np.float64).eps) * self.system.length * stiff

    def _slopes(self, s: Surface, x: Stencils, fields: list[tuple[list[str], Array]]) -> Array:
        """Derivatives (points, k) of the gaps by the unknowns."""
        out = np.zeros((len(x.g), len(fields) + len(self.tools)))
        for j, (bodies, field) in enumerate(fields):
            if s.body in bodies:
                way = np.zeros(self.system.ndof)
                self.system.displacement(way)[:] = field
                out[:, j] = (x.dg * way[x.dofs]).sum(axis=1)
        for j, dof in enumerate(self.tools.tolist(), len(fields)):
            out[:, j] = np.where(x.dofs == dof, x.dg, 0.0).sum(axis=1)
        return out

    def balanced(self, most: int) -> Array | None:
        """The unknowns (k,) at which nothing is missing; None if they are not found, as where nothing stops what is pushed.

        Newton's method with an exact search along each step: the energy of the springs is convex but for the curvature of the
        tools, and what nothing resists goes on until something does.
        """
        z = self.start
        for _ in range(most):
            r, K, nothing = self.answer(z)
            if np.abs(r).max() <= nothing:
                return z
            stiff = max(float(np.trace(K)), float(min(scale.k_n.max() for scale in self.c.scales)))
            step = np.asarray(np.linalg.solve(K + 1e-12 * stiff * np.eye(len(z)), -r), dtype=np.float64)
            share = self._search(z, step)
            if share is None:
                return None
            z = z + share * step
        return None

    def through_air(self, policy: Policy) -> Array | None:
        """Way (ndof,) of bodies and pushed tools to where they only just touch; None if that is not found."""
        stiff = sum(float((self.c.weights[i] * self.c.scales[i].k_n).sum()) for i in self.pushers)
        share = max(policy.just_touches_share, 100.0 * self._rounded(stiff) / float(np.abs(self.driving(self.start)).max()))
        z = replace(self, forces=min(share, 1.0) * self.forces).balanced(policy.max_rigid_steps)
        return None if z is None else self.dofs(z) - self.base

    def _search(self, z: Array, step: Array) -> float | None:
        """Share of a step at which it is no longer driven on; None if that is farther away than bodies are long."""

        def driven(share: float) -> bool:
            return float(self.answer(z + share * step)[0] @ step) < 0.0

        size = float(np.abs(step).max())
        low, high = 0.0, min(1.0, 1e-3 * self.system.length / size)
        while driven(high):
            low, high = high, 2.0 * high
            if high * size > 10.0 * self.system.length:
                return None
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if driven(middle) else (low, middle)
        return high


def _across(arm: Array) -> Array:
    """Where arms (k, 2) go in a turn, per angle."""
    return np.stack([-arm[:, 1], arm[:, 0]], axis=1)


def _brought(system: System, c: Context) -> Iterator[int]:
    """Degrees of freedom along which tools are pushed that touched nothing."""
    for master in system.masters.values():
        own = system.against(master.name)
        if own and not any(were_closed(c.state, s) for s in own):
            yield from (dof for dof in master.dofs[:2].tolist() if dof in c.plan.push)
