"""Closed derivatives of the bodies' forces, histories and energy along many directions: see `prensa.elements.q4_directions`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.elements import q4
from prensa.elements.q4_directions import (
    LANES,
    PER_PLACE,
    PER_POINT,
    WAYS,
    along,
    at_fixed,
    flow_gradients,
    histories,
    in_lanes,
    in_volumes,
    prepare,
)
from prensa.fem.assembly import Block, scatter_forces
from prensa.fem.context import Context
from prensa.fem.system import Evaluation, System
from prensa.materials.begun import PER_BEGUN, slopes_of_begun
from prensa.materials.j2_finite import stresses_at
from prensa.sensitivity.change import Change, Changes

Array = NDArray[np.float64]

SHIFT = 1e-7  # over the size of the bodies, for differences of shapes
NOT_BEGUN = np.empty((0, 4, PER_BEGUN))
KEPT = 6
"""Arrays of histories that a block remembers to give out again."""


def _references(arrays: Sequence[Array]) -> list[int]:
    """How many there are to each, those of the sequence and of this function among them."""
    return [sys.getrefcount(a) for a in arrays]


UNUSED = _references([np.empty(0)])[0]


class Histories:
    """Arrays for histories along directions, given out again when nobody refers to them or to a part of them any more.

    Fresh ones are the largest part of what an increment asks the system for, which fills them with zeros first.
    """

    def __init__(self) -> None:
        self._owners: list[Array] = []

    def like(self, old: Array) -> Array:
        """One (e, 4, h, d) of the shape of another, with whatever numbers it has."""
        for owner, count in zip(self._owners, _references(self._owners)):
            if count == UNUSED and len(owner) == old.size + LANES:
                return owner[: old.size].reshape(old.shape)
        new = histories(old.shape[:-1], old.shape[-1])
        assert isinstance(new.base, np.ndarray)
        self._owners = [*self._owners[1 - KEPT :], new.base]
        return new


class Room(NamedTuple):
    """Arrays for what `Elements` find, which those of the next increment write over: new ones would cost as much as the work.

    See `prepare` for ``geometry`` and ``point``, `slopes_of_begun` for ``begun``, `flow_gradients` for ``slopes`` (m: `WAYS`),
    `stresses_at` for ``stresses``: after the increment, where it begins and where the last one ended. ``histories``: for those of
    directions.
    """

    geometry: Array
    point: Array
    begun: Array
    slopes: Array
    stresses: Array
    histories: Histories


@dataclass(frozen=True)
class Elements:
    """A block in an increment, as its directions need it: see `prepare` for ``geometry`` and ``point``.

    Histories ``committed``, ``old`` as the increment begins with them and ``new``; ``share``: see `TimeRule`.
    """

    block: Block
    committed: Array
    old: Array
    new: Array
    seconds: float
    geometry: Array
    point: Array
    share: float
    room: Room

    @classmethod
    def of(cls, block: Block, c: Context, x: Array, k: int, new: Array, room: Room | None = None) -> Elements:
        """Of block number k at node positions x (n, 2) and with the history that an increment has led to.

        room: see `room_for`, which is written over; new arrays if None.
        """
        law: Any = block.law
        committed, old, seconds = c.state.history[k], c.history[k], c.rule.seconds(block, c.seconds)
        mode, room = block.mode, room or room_for(block)
        stress = room.stresses
        if law.plastic:
            stresses_at(old[..., 4], new[..., 4], *law.flow, seconds, stress[0])
            stresses_at(old[..., 4], old[..., 4], *law.flow, 0.0, stress[1])
        prepare(
            c.x_n, x, block.cells, old, new, *moduli_of(block), mode.axisymmetric, mode.scale, law.plastic,
            law.plastic and law.yield_on_cauchy, stress[0], stress[1], room.geometry, room.point,
        )  # fmt: skip
        return cls(block, committed, old, new, seconds, room.geometry, room.point, c.rule.share, room)

    @cached_property
    def begun(self) -> Array:
        """What the histories that the increment begins with owe to those committed (see `slopes_of_begun`).

        (e, 4, n), or (0, 4, n) where they are the same.
        """
        law: Any = self.block.law
        if not law.plastic:
            return NOT_BEGUN
        _, after, before = self.room.stresses
        stresses_at(self.committed[..., 4], self.committed[..., 4], *law.flow, 0.0, before)
        slopes_of_begun(self.committed, self.old, self.new, self.share, law.yield_on_cauchy, before, after, self.room.begun)
        return self.room.begun

    def at_fixed(self, changes: Changes, k: int, dxn: Array, dold: Sequence[Array], r: Array) -> tuple[list[Array], Array]:
        """Histories (e, 4, h, s) by group and energies (2, d) of directions, with forces added to r (ndof, d); k: the block.

        The energies are what is stored and the plastic work. dold: of the committed histories; dxn (n, 2, d).
        """
        found, energy = [], np.zeros((2, len(changes.each)))
        ways = max(len(group.flow[k]) for group in changes.groups)
        slopes = self.room.slopes[..., :ways] if ways <= WAYS else np.empty((*self.old.shape[:2], 3, ways))
        if (curves := changes.curves[k]) is not None:
            self.flow_slopes(*curves, slopes)
        for group, old in zip(changes.groups, dold):
            force, spent, new = np.zeros((len(dxn), 2, LANES)), np.zeros((2, LANES)), self.room.histories.like(old)
            flow = group.flow[k]
            at_fixed(
                self.block.cells, self.geometry, self.point, *moduli_of(self.block), self.block.mode.axisymmetric,
                self.block.volume, in_lanes(dxn, group.first, group.size), group.X, old, group.moduli[k],
                slopes if len(flow) else slopes[..., :0], flow, force, new, spent, self.begun,
            )  # fmt: skip
            own = slice(group.first, group.first + group.size)
            r[: 2 * len(dxn), own] += force.reshape(-1, LANES)[:, : group.size]
            energy[:, own] = spent[:, : group.size]
            found.append(new)
        return found, energy

    def flow_slopes(self, knots: Array, coefficients: Array, out: Array) -> None:
        """See `flow_gradients`."""
        law: Any = self.block.law
        flow_gradients(*law.flow, self.committed, self.old, self.new, self.seconds, knots, coefficients, out)

    def along(self, changes: Changes, dx: Array, new: Sequence[Array], energy: Array) -> None:
        """Add what motions dx (n, 2, d) of the present nodes make of histories (e, 4, h, s) by group and of energies (2, d)."""
        b, G = self.block, moduli_of(self.block)[1]
        for group, own in zip(changes.groups, new):
            spent = np.zeros((2, LANES))
            along(
                b.cells, self.geometry, self.point, G, b.mode.axisymmetric, b.volume,
                in_lanes(dx, group.first, group.size), own, spent,
            )  # fmt: skip
            energy[:, group.first : group.first + group.size] += spent[:, : group.size]

    def in_volumes(self, volumes: Array, energy: Array) -> None:
        """Add what initial volumes that change by (e, 4, d) make of energies (2, d)."""
        in_volumes(self.point, *moduli_of(self.block), self.new, volumes, energy)


def moduli_of(block: Block) -> tuple[float, float]:
    """Bulk and shear modulus of a block's law."""
    law: Any = block.law
    return law.E / (3.0 * (1.0 - 2.0 * law.nu)), law.mu


def room_for(block: Block) -> Room:
    """Arrays for a block's `Elements`."""
    points = len(block), 4
    return Room(
        np.empty((len(block), 5, PER_PLACE)), np.empty((*points, PER_POINT)), np.empty((*points, PER_BEGUN)),
        np.empty((*points, 3, WAYS)), np.zeros((3, *points, 3)), Histories(),
    )  # fmt: skip


def elements_of(
    system: System, c: Context, u: Array, e: Evaluation, rooms: Sequence[Room | None] | None = None
) -> list[Elements]:  # fmt: skip
    """All blocks at degrees of freedom u (ndof,), with the histories that an increment has led to, in ``rooms`` (`room_for`)."""
    x, rooms = system.positions(u), rooms or [None] * len(system.blocks)
    return [Elements.of(b, c, x, k, new, room) for k, (b, new, room) in enumerate(zip(system.blocks, e.history, rooms))]


def unfolding(system: System, c: Context, u: Array, changes: Sequence[Change], r: Array) -> None:
    """Add to r (ndof, d) what directions make of the forces that unfold elements, at fixed degrees of freedom u (ndof,).

    They go with the modulus, and where bodies begin elsewhere with the initial shapes, along which they are differenced.
    """
    du = system.displacement(u - c.state.u)
    for k, b in enumerate(system.blocks):
        if not q4.folding(c.x_n.take(b.cells, axis=0), du.take(b.cells, axis=0)):
            continue
        forces = _unfolding(system, b, c.x_n, du, system.X)
        for out, ch in zip(r.T, changes):
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
    bulk, G = moduli_of(b)
    lower = 3.0 * bulk + 4.0 * G
    by_bulk = 36.0 * G * G / lower**2
    by_G = 4.0 * (3.0 * bulk + 2.0 * G) / lower - 16.0 * G * (3.0 * bulk + G) / lower**2
    return float(by_bulk * ch.bulk[k] + by_G * ch.G[k])
