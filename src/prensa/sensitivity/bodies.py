"""Closed derivatives of the bodies' forces, histories and energy along many directions: see `prensa.elements.q4_directions`."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
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
from prensa.fem.interaction import Context
from prensa.fem.system import Evaluation, System
from prensa.materials.begun import PER_BEGUN, slopes_of_begun
from prensa.materials.j2_finite import stresses_at
from prensa.sensitivity.change import Change, Changes

Array = NDArray[np.float64]

SHIFT = 1e-7  # over the size of the bodies, for differences of shapes
NOT_BEGUN = np.empty((0, 4, PER_BEGUN))
ELEMENTS_AT_ONCE = 1 << 14
"""Elements whose directions are answered for at a time: of more, what is only passed on would be memory of its own."""
KEPT_ARRAYS = 6
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
        self._owners = [*self._owners[1 - KEPT_ARRAYS :], new.base]
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

    ``x_n``, ``x`` (n, 2): where nodes are as the increment begins and ends. Histories ``committed``, ``old`` as the increment
    begins with them and ``new``; ``share``: see `TimeRule`.
    """

    block: Block
    x_n: Array
    x: Array
    committed: Array
    old: Array
    new: Array
    seconds: float
    share: float
    room: Room

    @classmethod
    def of(cls, block: Block, c: Context, x: Array, k: int, new: Array, room: Room | None = None) -> Elements:
        """Of block number k at node positions x (n, 2) and with the history that an increment has led to, not `prepared` yet.

        room: see `room_for`, which is written over; new arrays if None.
        """
        room = room or room_for(block)
        seconds = c.rule.seconds(block, c.seconds)
        return cls(block, c.x_n, x, c.state.history[k], c.history[k], new, seconds, c.rule.share, room)

    @property
    def geometry(self) -> Array:
        """See `prepare`."""
        return self.room.geometry

    @property
    def point(self) -> Array:
        """See `prepare`."""
        return self.room.point

    def chunks(self) -> Iterator[slice]:
        """Elements that are answered for together."""
        for first in range(0, len(self.block), ELEMENTS_AT_ONCE):
            yield slice(first, min(first + ELEMENTS_AT_ONCE, len(self.block)))

    def prepared(self) -> Elements:
        """The same with ``geometry`` and ``point`` of all elements."""
        for some in self.chunks():
            self._prepare(some)
        return self

    def _prepare(self, some: slice) -> None:
        law: Any = self.block.law
        mode, cells, old, new = self.block.mode, self.block.cells[some], self.old[some], self.new[some]
        after, before = self.room.stresses[:2, : len(cells)]
        if law.plastic:
            stresses_at(old[..., 4], new[..., 4], *law.flow, self.seconds, after)
            stresses_at(old[..., 4], old[..., 4], *law.flow, 0.0, before)
        prepare(
            self.x_n, self.x, cells, old, new, *moduli_of(self.block), mode.axisymmetric, mode.scale, law.plastic,
            law.plastic and law.yield_on_cauchy, after, before, self.geometry[some], self.point[some],
        )  # fmt: skip

    def _begun(self, some: slice) -> Array:
        """What the histories that the increment begins with owe to those committed (see `slopes_of_begun`), once prepared.

        (e, 4, n), or (0, 4, n) where they are the same.
        """
        law: Any = self.block.law
        if not law.plastic:
            return NOT_BEGUN
        committed, size = self.committed[some], some.stop - some.start
        _, after, before = self.room.stresses[:, :size]
        stresses_at(committed[..., 4], committed[..., 4], *law.flow, 0.0, before)
        out = self.room.begun[:size]
        slopes_of_begun(
            committed, self.old[some], self.new[some], self.share, law.yield_on_cauchy, before, after, out
        )
        return out

    def at_fixed(self, changes: Changes, k: int, dxn: Array, dold: Sequence[Array], r: Array) -> tuple[list[Array], Array]:
        """Histories (e, 4, h, s) by group and energies (2, d) of directions, with forces added to r (ndof, d); k: the block.

        The energies are what is stored and the plastic work. dold: of the committed histories; dxn (n, 2, d). Elements are
        prepared on the way.
        """
        b, groups, moduli = self.block, changes.groups, moduli_of(self.block)
        begin, found = [in_lanes(dxn, g.first, g.size) for g in groups], [self.room.histories.like(old) for old in dold]
        force, spent = np.zeros((len(groups), len(dxn), 2, LANES)), np.zeros((len(groups), 2, LANES))
        curves, ways = changes.curves[k], max(len(g.flow[k]) for g in groups)
        for some in self.chunks():
            self._prepare(some)
            begun, slopes = self._begun(some), self._slopes(some, curves, ways)
            for n, g in enumerate(groups):
                at_fixed(
                    b.cells[some], self.geometry[some], self.point[some], *moduli, b.mode.axisymmetric, b.volume[some], begin[n],
                    g.X, dold[n][some], g.moduli[k], slopes if len(g.flow[k]) else slopes[..., :0], g.flow[k], force[n],
                    found[n][some], spent[n], begun,
                )  # fmt: skip
        energy = np.empty((2, len(changes.each)))
        for n, g in enumerate(groups):
            own = slice(g.first, g.first + g.size)
            r[: 2 * len(dxn), own] += force[n].reshape(-1, LANES)[:, : g.size]
            energy[:, own] = spent[n, :, : g.size]
        return found, energy

    def _slopes(self, some: slice, curves: tuple[Array, Array] | None, ways: int) -> Array:
        """Of the flow stresses along so many ways, see `flow_gradients`; of no meaning where no curve changes."""
        size = some.stop - some.start
        out = self.room.slopes[:size, ..., :ways] if ways <= WAYS else np.empty((size, *self.room.slopes.shape[1:3], ways))
        if curves is not None:
            law: Any = self.block.law
            flow_gradients(*law.flow, self.committed[some], self.old[some], self.new[some], self.seconds, *curves, out)
        return out

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
    points, some = len(block), min(len(block), ELEMENTS_AT_ONCE)
    return Room(
        np.empty((points, 5, PER_PLACE)), np.empty((points, 4, PER_POINT)), np.empty((some, 4, PER_BEGUN)),
        np.empty((some, 4, 3, WAYS)), np.zeros((3, some, 4, 3)), Histories(),
    )  # fmt: skip


def elements_of(
    system: System, c: Context, u: Array, e: Evaluation, rooms: Sequence[Room | None] | None = None
) -> list[Elements]:  # fmt: skip
    """All blocks at degrees of freedom u (ndof,), with the histories that an increment has led to, in ``rooms`` (`room_for`).

    They are to be `prepared`.
    """
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
