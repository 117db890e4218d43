"""Closed derivatives of the bodies' forces, histories and energy along many directions: see `prensa.elements.q4_directions`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.elements import q4
from prensa.elements.q4_directions import PER_PLACE, PER_POINT, along, at_fixed, begin, flow_gradients, prepare
from prensa.fem.assembly import Block, scatter_forces
from prensa.fem.context import Context
from prensa.fem.system import Evaluation, System
from prensa.fem.time_rule import TimeRule
from prensa.materials.hardening import TABLE
from prensa.sensitivity.change import Change, FlowChange

Array = NDArray[np.float64]

SHIFT = 1e-7  # over the size of the bodies, for differences of shapes
NO_FLOW = (0, np.zeros(5), np.zeros(2), np.zeros((1, 4)))  # of a curve that nobody asks for


@dataclass(frozen=True)
class Elements:
    """A block in an increment, as its directions need it: see `prepare` for ``geometry`` and ``point``.

    ``history``: committed, ``old``: what the increment begins with by the time ``rule``; ``seconds`` of flow from there.
    """

    block: Block
    history: Array
    old: Array
    new: Array
    rule: TimeRule
    seconds: float
    geometry: Array
    point: Array

    @classmethod
    def of(cls, block: Block, c: Context, x: Array, new: Array, old: Array, history: Array) -> Elements:
        """At node positions x (n, 2) and with the history ``new`` that an increment has led to."""
        law: Any = block.law
        m, mode, seconds = len(block), block.mode, c.rule.seconds(block, c.seconds)
        geometry, point = np.empty((m, 5, PER_PLACE)), np.empty((m, 4, PER_POINT))
        flow = law.flow if law.plastic else None
        prepare(
            c.x_n, x, block.cells, old, new, *_moduli(block), mode.axisymmetric, mode.scale, law.plastic,
            law.plastic and law.yield_on_cauchy, *(NO_FLOW if flow is None else flow), seconds, geometry, point,
        )  # fmt: skip
        return cls(block, history, old, new, c.rule, seconds, geometry, point)

    def at_fixed(self, changes: Sequence[Change], k: int, dxn: Array, dx: Array, dold: Array, r: Array) -> tuple[Array, Array]:
        """Histories (d, e, 4, h) and energies (d,) of directions, with their forces added to r (d, ndof); k: the block."""
        dnew, energy = np.empty_like(dold), np.zeros(len(changes))
        own = [ch.flow[k] for ch in changes]
        rows = np.cumsum([f is not None for f in own]) - 1
        number = np.where([f is not None for f in own], rows, -1)
        curves = [f for f in own if f is not None]
        dflow = self._flow(curves, self.old, self.new, self.seconds)
        dold = self._begun(dold, number, curves)
        at_fixed(
            self.block.cells, self.geometry, self.point, *_moduli(self.block), self.block.mode.axisymmetric,
            self.block.law.plastic, self.block.volume, dxn, dx, dold, np.array([ch.bulk[k] for ch in changes]),
            np.array([ch.G[k] for ch in changes]), number, dflow, r, dnew, energy,
        )  # fmt: skip
        return dnew, energy

    def _begun(self, dhistory: Array, number: NDArray[np.int64], curves: Sequence[FlowChange]) -> Array:
        """Directions of the committed history (d, e, 4, h) → of that which the increment begins with."""
        law: Any = self.block.law
        if not law.plastic:
            return dhistory
        out, dflow = np.empty_like(dhistory), self._flow(curves, self.history, self.old, 0.0)
        cauchy = law.yield_on_cauchy
        begin(self.history, self.old, self.rule.share, cauchy, *law.flow, dhistory, number, dflow, out)
        return out

    def _flow(self, changes: Sequence[FlowChange], old: Array, new: Array, seconds: float) -> Array:
        """What changes of the flow curve make of the stress at the points (rows, e, 4, 2), with new histories and with old."""
        shape = (*old.shape[:2], 2)
        if not changes:
            return np.empty((0, *shape))
        law: Any = self.block.law
        flow = law.flow
        slopes, tabled = np.empty((*shape, 5)), np.empty((len(changes), *shape))
        for f, out in zip(changes if flow.kind == TABLE else changes[:1], tabled):
            flow_gradients(*flow, old, new, seconds, f.knots, f.coefficients, slopes, out)
        if flow.kind == TABLE:
            return tabled
        return np.ascontiguousarray((slopes.reshape(-1, 5) @ np.stack([f.p for f in changes], axis=1)).T).reshape(-1, *shape)

    def along(self, dx: Array, dnew: Array, energy: Array) -> None:
        """Add what motions dx (d, n, 2) of the present nodes make of histories and energies."""
        b = self.block
        along(
            b.cells, self.geometry, self.point, _moduli(b)[1], b.mode.axisymmetric, b.law.plastic, b.volume, dx, dnew, energy
        )


def _moduli(block: Block) -> tuple[float, float]:
    law: Any = block.law
    return law.E / (3.0 * (1.0 - 2.0 * law.nu)), law.mu


def elements_of(system: System, c: Context, u: Array, e: Evaluation) -> list[Elements]:
    """All blocks at degrees of freedom u (ndof,), with the histories that an increment has led to."""
    x = system.positions(u)
    histories = zip(system.blocks, e.history, c.history, c.state.history)
    return [Elements.of(b, c, x, new, old, history) for b, new, old, history in histories]


def unfolding(system: System, c: Context, u: Array, changes: Sequence[Change], r: Array) -> None:
    """Add to r (d, ndof) what directions make of the forces that unfold elements, at fixed degrees of freedom u (ndof,).

    They go with the modulus, and where bodies begin elsewhere with the initial shapes, along which they are differenced.
    """
    du = system.displacement(u - c.state.u)
    for k, b in enumerate(system.blocks):
        if not q4.folding(c.x_n[b.cells], du[b.cells]):
            continue
        forces = _unfolding(system, b, c.x_n, du, system.X)
        for out, ch in zip(r, changes):
            # E/(1 − ν²) in bulk and shear moduli
            out += _modulus_change(b, ch, k) * forces
            if ch.X is not None:
                step = SHIFT * system.length / float(np.abs(ch.X).max())
                beside = [_unfolding(system, b, c.x_n + s * ch.X, du, system.X + s * ch.X) for s in (step, -step)]
                out += b.law.modulus() * (beside[0] - beside[1]) / (2.0 * step)


def _unfolding(system: System, b: Block, x: Array, du: Array, X: Array) -> Array:
    """Forces (ndof,) that unfold elements of a modulus of one."""
    m, out = len(b), np.zeros(system.ndof)
    forces, size, K = np.zeros((m, 8)), np.zeros(m), np.empty((0, 8, 8))
    q4.unfold(X[b.cells], x[b.cells], du[b.cells], b.mode.axisymmetric, b.mode.scale, size, False, forces, K)
    scatter_forces(forces, b.cells, out)
    return out


def _modulus_change(b: Block, ch: Change, k: int) -> float:
    """Derivative of E* = E/(1 − ν²) = 4 G (3 κ + G)/(3 κ + 4 G)."""
    bulk, G = _moduli(b)
    lower = 3.0 * bulk + 4.0 * G
    by_bulk = 36.0 * G * G / lower**2
    by_G = 4.0 * (3.0 * bulk + 2.0 * G) / lower - 16.0 * G * (3.0 * bulk + G) / lower**2
    return float(by_bulk * ch.bulk[k] + by_G * ch.G[k])
