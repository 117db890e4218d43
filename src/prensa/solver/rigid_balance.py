"""Balance of rigid bodies and pushed tools on the springs of their contacts, before anything deforms.

Bodies move as rigid ones, tools along what pushes them, without friction, to where the penalty springs of the contacts between
them balance all forces. Nothing but gaps and forces is asked for: a body that nothing holds yet has no stiffness that could say
where it goes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from prensa.contact.stencil import Stencils
from prensa.contact.surface import Surface
from prensa.geometry.plane import turned
from prensa.linear.rigid_modes import Loose
from prensa.policy import Policy
from prensa.precision import EPS, NEGLIGIBLE, ROUND_OFF
from prensa.system.interaction import Context, Request
from prensa.system.system import System
from prensa.types import Array, Index


def bisected(below: Callable[[float], bool], lo: float, hi: float) -> tuple[float, float]:
    """Bracket of the argument at which the predicate *below* turns false."""
    for _ in range(60):  # halves of a double's 53 binary digits, and some for brackets that begin far from their size
        mid = 0.5 * (lo + hi)
        lo, hi = (mid, hi) if below(mid) else (lo, mid)
    return lo, hi


class RigidBody(NamedTuple):
    """A loose body in the configuration that gaps are taken in: ``arm`` (nodes, 2) from the middle of its nodes."""

    loose: Loose
    arm: Array


@dataclass
class RigidBalance:
    """Loose bodies and pushed tools between the other tools.

    Unknowns z: motions of the bodies (see `Loose`), then lengths of the ways of tools. ``drives``: of each way its degrees of
    freedom (d,), and how far they go (d,) per length. ``base`` (ndof,): from where they start; ``forces`` (ndof,) on them.
    ``room``: gap below which a contact spring acts: 0, or a small gap where no force drives, so that what is not clamped is
    not pressed. ``pushers``: indices of the contacts whose springs act.
    """

    system: System
    c: Context
    base: Array
    bodies: list[RigidBody]
    drives: list[tuple[Index, Array]]
    forces: Array
    room: float
    pushers: Sequence[int]

    @classmethod
    def of_bodies(cls, system: System, c: Context, loose: list[Loose], tools: Index, room: float) -> RigidBalance:
        """Of loose bodies and pushed degrees of freedom of tools, with all that is prescribed where it is at the end."""
        base = c.state.u.copy()
        base[c.plan.fixed] = c.plan.values(c.time)
        base = system.with_slaves(base)
        x = system.positions(base) if system.problem.kinematics == "finite" else system.X
        bodies = [RigidBody(b, x[b.nodes] - x[b.nodes].mean(axis=0)) for b in loose]
        ask, forces = Request(base, system.initial_multipliers(c.state), stiffness=False), np.zeros(system.ndof)
        for interaction in c.interactions[len(c.surfaces) :]:
            answer = interaction.respond(c, ask)
            for part in answer.parts if answer.external else ():
                if part.r is not None:
                    np.add.at(forces, part.dofs, part.r)
        drives = [(tools[k : k + 1], np.ones(1)) for k in range(len(tools))]
        rigid = cls(system, c, base, bodies, drives, forces, 0.0, range(len(c.surfaces)))
        rigid.room = 0.0 if rigid.driving(rigid.start).any() else room
        return rigid

    @classmethod
    def of_tool(cls, system: System, c: Context, base: Array, dofs: Index, force: Array, own: Sequence[int]) -> RigidBalance:
        """Of one tool whose ``dofs`` go along a ``force`` (d,) on them, with its contacts ``own``; bodies stay where they are."""
        direction = force / np.linalg.norm(force)
        if not force[: system.dofs.dimension].any():
            direction = direction / system.length  # an angle: ways of all unknowns are lengths, as gaps and tolerances are
        forces = np.zeros(system.ndof)
        forces[dofs] = force
        return cls(system, c, base, [], [(dofs, direction)], forces, 0.0, own)

    @property
    def start(self) -> Array:
        """The unknowns where nothing has moved."""
        return np.zeros(sum(len(b.loose.motions) for b in self.bodies) + len(self.drives))

    def split(self, z: Array) -> tuple[list[tuple[RigidBody, Array]], Array]:
        """Motions (3,) of each body, along x and y and its turn, and the lengths of the ways of tools."""
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
        for (dofs, direction), way in zip(self.drives, ways):
            u[dofs] += way * direction
        for b, (x, y, turn) in bodies:
            moved[b.loose.nodes] += np.array([x, y]) + self._turned(b.arm, turn) - b.arm
        return u

    def _turned(self, arm: Array, turn: float) -> Array:
        """Arms (k, 2) after a turn."""
        if self.system.problem.kinematics == "small":
            return np.asarray(arm + turn * turned(arm))
        return np.asarray(np.cos(turn) * arm + np.sin(turn) * turned(arm))

    def fields(self, z: Array) -> list[tuple[list[str], Array]]:
        """Of each unknown of the bodies: what moves, and displacements (n, 2) for a unit of it."""
        out = []
        for b, (_, _, turn) in self.split(z)[0]:
            small = self.system.problem.kinematics == "small"
            across = turned(b.arm if small else self._turned(b.arm, turn)) / b.loose.size
            for x, y, about in b.loose.motions:
                field = np.zeros_like(self.system.X)
                field[b.loose.nodes] = [x, y] + about * across
                out.append((b.loose.bodies, field))
        return out

    def driving(self, z: Array) -> Array:
        """Forces along the unknowns."""
        nodal = self.system.displacement(self.forces)
        tools = (self.forces[dofs] @ direction for dofs, direction in self.drives)
        return np.array([*((nodal * field).sum() for _, field in self.fields(z)), *tools])

    def answer(self, z: Array) -> tuple[Array, Array, float]:
        """Residual (k,), stiffness matrix (k, k), and tolerance of the residual.

        The tolerance is a part of all springs' forces, or what the rounding of positions makes of them.
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
        return r, K, max(NEGLIGIBLE * total, self._rounded(stiff))

    def _rounded(self, stiff: float) -> float:
        """What the rounding of positions makes of springs of a stiffness."""
        far = max(self.system.length, float(np.abs(self.base).max()))
        return 16.0 * EPS * far * stiff

    def _slopes(self, s: Surface, x: Stencils, fields: list[tuple[list[str], Array]]) -> Array:
        """Derivatives (points, k) of the gaps by the unknowns."""
        out = np.zeros((len(x.g), len(fields) + len(self.drives)))
        for j, (bodies, field) in enumerate(fields):
            if s.acts_on(bodies):
                way = np.zeros(self.system.ndof)
                self.system.displacement(way)[:] = field
                out[:, j] = (x.dg * way[x.dofs]).sum(axis=1)
        for j, (dofs, direction) in enumerate(self.drives, len(fields)):
            for dof, way in zip(dofs, direction):
                out[:, j] += way * np.where(x.dofs == dof, x.dg, 0.0).sum(axis=1)
        return out

    def balanced(self, policy: Policy) -> Array | None:
        """The unknowns (k,) at which nothing is missing; None if they are not found, as where nothing stops what is pushed.

        Newton's method with an exact search along each step: the energy of the springs is convex but for the curvature of the
        tools, and what nothing resists goes on until something does.
        """
        z = self.start
        for _ in range(policy.max_rigid_steps):
            r, K, nothing = self.answer(z)
            if np.abs(r).max() <= nothing:
                return z
            stiff = max(float(np.trace(K)), float(min(scale.k_n.max() for scale in self.c.scales)))
            # What nothing resists gets a stiffness of round-off, so that the step goes on along it until something does.
            step = np.asarray(np.linalg.solve(K + ROUND_OFF * stiff * np.eye(len(z)), -r), dtype=np.float64)
            share = self._search(z, step, policy.max_displacement_ratio * self.system.length)
            if share is None:
                return None
            z = z + share * step
            if not self.bodies and share * np.abs(step).max() <= EPS * self.system.length:
                return z  # an end of the tool passes a point there: the force jumps, and balance lies between two numbers
        return None

    def through_air(self, policy: Policy) -> Array | None:
        """Way (ndof,) of bodies and pushed tools to where they only just touch; None if that is not found."""
        stiff = sum(float((self.c.weights[i] * self.c.scales[i].k_n).sum()) for i in self.pushers)
        share = max(policy.just_touches_share, 100.0 * self._rounded(stiff) / float(np.abs(self.driving(self.start)).max()))
        z = replace(self, forces=min(share, 1.0) * self.forces).balanced(policy)
        return None if z is None else self.dofs(z) - self.base

    def _search(self, z: Array, step: Array, farthest: float) -> float | None:
        """Step length at which the energy is least along the step (exact line search); None beyond ``farthest``."""

        def driven(share: float) -> bool:
            return float(self.answer(z + share * step)[0] @ step) < 0.0

        size = float(np.abs(step).max())
        low, high = 0.0, min(1.0, 1e-3 * self.system.length / size)
        while driven(high):
            # a longer stride could take a thin tool from one side of a body to the other
            low, high = high, min(2.0 * high, high + self.stride / size)
            if high * size > farthest:
                return None
        return bisected(driven, low, high)[1]

    @cached_property
    def stride(self) -> float:
        """Half the least width of the tools and of the boxes about the bodies that may meet."""
        system, own = self.system, [self.c.surfaces[i] for i in self.pushers]
        names = {body for s in own for body in s.bodies}
        bodies = {body: system.X[system.span(body)] for body in names}
        widths = [float(np.ptp(x, axis=0).min()) for x in bodies.values()]
        tools = [system.tool_masters[s.against].tool for s in own if s.opposite is None]
        widths += [2.0 * tool.shape.cylinder for tool in tools]
        if system.dofs.dimension == 2:
            widths += [tool.thickness for tool in tools]  # of shapes with an end that may be sharp
        return 0.5 * min(widths)
