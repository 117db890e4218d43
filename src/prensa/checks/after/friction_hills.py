"""Metal pressed thin between rough tools: what elements that are long against its thickness make of the friction hill.

In a strip of thickness h the stress along it balances friction: h dp/dx = τ, with τ the sum of both sides, for a metal that flows
keeps the difference of its two stresses (von Kármán's slab, 1925). Where τ grows with the pressure, by m, both grow along x as
exp(m x/h). Elements of length L balance the friction of their nodes: from one side to the other it grows by (1 + a)/(1 − a),
a = m L/2h, for e^{2a}, and the mean pressure of an element is that of its ends. Both are too large.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from prensa.checks.after.beyond_shear import shear_yield
from prensa.checks.check import Committed, warning
from prensa.contact.faces import FacePoints
from prensa.contact.passage import WORTH_SAYING
from prensa.contact.record import magnitude
from prensa.errors import Finding
from prensa.materials.solids.j2 import J2
from prensa.precision import EPS, SMALLEST
from prensa.system.bending import BentStrips
from prensa.system.system import System
from prensa.types import Array, Flags, Index


@dataclass(frozen=True)
class Slab:
    """The strips (s,) through the thickness of a body that tools press at both of their sections, from low to high friction.

    ``sections`` (s, 2): numbers of these; ``length`` (s,), ``thickness`` (s,); ``width`` (s,): that on which the pressure acts,
    2πr in axisymmetry; ``pressure``, ``friction`` (s, 2) at the sections: the mean of the pressed ends, the sum along the strip;
    ``beyond`` (s, 2): of this what exceeds the shear yield stress where one layer of elements lies between two rough tools.
    """

    sections: Index
    length: Array
    thickness: Array
    width: Array
    pressure: Array
    friction: Array
    beyond: Array | None = None

    @property
    def force(self) -> float:
        """That of the tools, on strips that they press at both sections."""
        return float((self.length * self.width * self.pressure.mean(axis=1)).sum())

    @property
    def edge(self) -> Flags:
        """Strips (s,) whose low section is at an edge: no other strip leads in."""
        return ~np.isin(self.sections[:, 0], self.sections[:, 1])

    @property
    def grows(self) -> Flags:
        """Strips (s,) along which pressure and friction grow."""
        (tau, more), (p, top) = self.friction.T, self.pressure.T
        return (tau > 0.0) & (more > tau) & (top > p)

    def exponents(self) -> tuple[Array, Array]:
        """Half of the exponent 2a of each strip (s,), by the slope of friction and by how it grows: in a slab these are the same.

        At an edge the node has the stress of its one element, which is 1/(1 − a) of that at its place, and elsewhere the mean of
        two: 1/(1 − a²). Nothing that balances reaches a = 1.
        """
        on, (tau, more), (p, top) = self.grows, self.friction.T, self.pressure.T
        tau, more = np.where(on, tau, 1.0), np.where(on, more, 1.0)
        slope = (more - tau) / np.where(on, top - p, 1.0) * self.length / (2.0 * self.thickness)
        growth = np.where(self.edge, 1.0 - tau / more, (more - tau) / (more + tau))
        return np.minimum(slope, 1.0 - EPS), growth

    def excess(self, a: Array) -> float:
        """By how much the force is too large for the exponents 2a (s,) of strips.

        Where friction does not grow, what is too much at one section stays so up to the next.
        """
        on, edge, (low, high) = self.grows, self.edge, self.sections.T
        a = np.where(on, a, SMALLEST)
        mean = np.expm1(2.0 * a) / (2.0 * a)
        start = self.friction[:, 0] * (1.0 - a) * np.where(edge, 1.0, 1.0 + a)  # friction at the place of the low section
        # over its slope by the pressure: the part of this that grows as the friction does
        scale = np.where(on, start * self.length / (2.0 * np.where(on, a, 1.0) * self.thickness), 0.0)
        own = scale * 2.0 * a * (1.0 / (1.0 - a) - mean)
        at = np.zeros(int(self.sections.max()) + 1)
        for _ in range(len(low)):
            last, at = at, np.zeros_like(at)
            at[high] = last[low] * np.exp(2.0 * a) + own
            if (at == last).all():
                break
        above = at[low] * mean + scale * (1.0 / (1.0 - a) - mean)
        return float((self.length * self.width * above).sum())

    def share_beyond(self) -> float:
        """The share by which friction ``beyond`` the shear yield stress makes the force too large, of slabs: ∫∫ τ/h dx dA.

        By the lesser one of what it adds to the pressure and what the pressure grows, as each strip has it.
        """
        if self.beyond is None or not self.beyond.any():
            return 0.0
        low, high = self.sections.T
        tau = self.friction.sum(axis=1)
        part = self.beyond.sum(axis=1) / np.where(tau > 0.0, tau, 1.0)
        grows = np.minimum(0.5 * tau * self.length / self.thickness, np.maximum(self.pressure[:, 1] - self.pressure[:, 0], 0.0))
        own, at = np.where(tau > 0.0, part, 0.0) * grows, np.zeros(int(self.sections.max()) + 1)
        for _ in range(len(low)):
            last, at = at, np.zeros_like(at)
            at[high] = last[low] + own
            if (at == last).all():
                break
        excess = float((self.length * self.width * (at[low] + 0.5 * own)).sum())
        return excess / (self.force - excess) if excess < self.force else np.inf

    def share(self) -> tuple[float, float]:
        """The share by which the force is too large, of the lesser exponents, and by how much those of both differ.

        An excess that is more than the force is no estimate.
        """
        slope, growth = self.exponents()
        found = np.array([self.excess(a) for a in (np.minimum(slope, growth), slope, growth)])
        if (found >= self.force).any():
            return 0.0, np.inf
        shares = found / (self.force - found)
        return float(shares[0]), float(abs(shares[1] - shares[2]))


class FrictionHills:
    """Bodies of metal in the plane between rough tools: by how much forces are off at the end of a step.

    Of contacts whose points are nodes, and of bodies of quadrilaterals with linear sides.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        # Points of other rules are not nodes, and cut edges share what a corner covers.
        at_nodes = {s.body: True for s in system.tool_contacts}
        for s in system.tool_contacts:
            at_nodes[s.body] &= not (s.sharp or isinstance(s.points, FacePoints)) and s.points.N.shape[1] == 1
        metals = {n for n, b in system.problem.bodies.items() if isinstance(b.material, J2)}
        self.open = {n for n in metals if at_nodes.get(n) and system.meshes[n].cells.shape[1] == 4 and system.dofs.dimension == 2}
        self.reported: set[str] = set()
        self.strips: dict[str, BentStrips] = {}

    def __call__(self, given: Committed) -> Iterator[Finding]:
        """What there is to say of each body, once."""
        for body in sorted(self.open):
            slab = self._slab(body, given)
            if slab is None:
                continue
            if (beyond := slab.share_beyond()) > WORTH_SAYING:
                self.open.discard(body)
                self.reported.add(body)
                yield warning(_words_beyond(body, beyond))
                continue
            share, apart = slab.share()
            # two ways to find the same are as uncertain as they differ
            if share - apart > WORTH_SAYING:
                self.open.discard(body)
                self.reported.add(body)
                yield warning(self._words(body, slab, share))

    def _slab(self, body: str, given: Committed) -> Slab | None:
        """The strips of a body that are pressed; None: none with friction."""
        s, span = self.system, self.system.span(body)
        p, t, more, closed = (v[span] for v in self._at_nodes(body, given))
        if not t.any():
            return None
        if body not in self.strips:
            self.strips[body] = BentStrips.of(s.meshes[body])
        sides = self.strips[body].sides[:, 0, :, :, 0]
        pressed_through = np.asarray(closed[sides].any(axis=2)).all(axis=1)
        ends, layers = sides[pressed_through], self.strips[body].layers[pressed_through]
        if not len(ends):
            return None
        x, pressed = s.positions(given.state.u)[span][ends], closed[ends]
        middle = x.mean(axis=2)
        along = middle[:, 1] - middle[:, 0]
        length = np.hypot(*along.T)
        along /= length[:, None]
        across = (x[:, :, 1] - x[:, :, 0]).mean(axis=1)
        thickness = np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])
        friction, pressure = np.einsum("scei,si->sc", t[ends], along), p[ends].sum(axis=2) / pressed.sum(axis=2)
        # one layer between two rough tools carries whatever there is: elsewhere metal shears below, if not enough
        single = (layers == 1.0) & np.asarray(t[ends].any(axis=(1, 3))).all(axis=1)
        beyond = np.where(single[:, None], np.einsum("scei,si->sc", more[ends], along), 0.0)
        sections = np.unique(np.sort(ends, axis=2).reshape(-1, 2), axis=0, return_inverse=True)[1].reshape(-1, 2)
        back = friction.sum(axis=1) < 0.0
        sections, pressure, friction, beyond = (
            np.where(back[:, None], v[:, ::-1], v) for v in (sections, pressure, friction, beyond)
        )
        axisymmetric = s.problem.space == "axisymmetric"
        width = 2.0 * np.pi * middle[:, :, 0].mean(axis=1) if axisymmetric else np.full(len(length), s.problem.thickness)
        friction, beyond = (np.where(back[:, None], -v, v) for v in (friction, beyond))
        return Slab(sections, length, thickness, width, pressure, friction, beyond)

    def _at_nodes(self, body: str, given: Committed) -> tuple[Array, Array, Array, Flags]:
        """Pressures (n,) and tractions (n, 2) along the tools at the nodes, these beyond k (n, 2), and which are pressed (n,)."""
        n = len(self.system.X)
        p, t, more, closed = np.zeros(n), np.zeros((n, 2)), np.zeros((n, 2)), np.zeros(n, dtype=bool)
        for i, (s, f) in enumerate(zip(self.system.tool_contacts, given.evaluation.contacts)):
            if s.body == body:
                on = f.p > 0.0
                node = s.points.support[on, 0]
                np.maximum.at(p, node, f.p[on])
                traction = (f.t[:, :, None] * f.stencils.e).sum(axis=1)[on]
                np.add.at(t, node, traction)
                if traction.any():
                    size, k = magnitude(f.t)[on], shear_yield(self.system, i, given)[on]
                    part = np.maximum(1.0 - k / np.where(size > 0.0, size, k), 0.0)
                    np.add.at(more, node, part[:, None] * traction)
                closed[node] = True
        return p, t, more, closed

    def _words(self, body: str, slab: Slab, share: float) -> str:
        times = float((slab.length / slab.thickness).max())
        return (
            f"{body!r} is pressed thin under friction, in elements {times:.2g} times as long as it is thick there: along such "
            f"elements the pressure grows too fast (the friction hill), and forces are too large by an estimated "
            f"{100.0 * share:.2g} %; shorten the elements along the contact"
        )


def _words_beyond(body: str, share: float) -> str:
    """What there is to say of a single layer under friction beyond the shear yield stress."""
    return (
        f"{body!r} is pressed thin under friction beyond its shear yield stress: its one layer of elements carries it, metal "
        f"does not, and forces are too large by more than an estimated {100.0 * min(share, 1.0):.0f} %; limit friction by the "
        "shear strength ('type: capped'), or take more layers"
    )
