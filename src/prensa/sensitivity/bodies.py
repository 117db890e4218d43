"""Closed derivatives of the bodies' forces, histories and energy: see `prensa.elements.derivatives`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from prensa.elements import derivatives, q4
from prensa.elements.derivatives import Along, At, Variant
from prensa.elements.kinds.q4_fbar import Q4WithBar
from prensa.materials.point_form import PointLaw
from prensa.sensitivity.change import Change, Changes, Group
from prensa.system.assembly import Block, scatter_forces
from prensa.system.interaction import Context
from prensa.system.system import Evaluation, System
from prensa.types import Array

SHIFT = 1e-7  # over the size of the bodies, for differences of shapes
ELEMENTS_AT_ONCE = 1 << 12
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
        """One (e, q, h, d) of the shape of another, with whatever numbers it has."""
        for owner, count in zip(self._owners, _references(self._owners)):
            if count == UNUSED and len(owner) == old.size:
                return owner.reshape(old.shape)
        new = np.empty(old.size)
        self._owners = [*self._owners[1 - KEPT_ARRAYS :], new]
        return new.reshape(old.shape)


@dataclass(frozen=True)
class Elements:
    """A block in an increment, as its directions need it.

    ``x_n``, ``x`` (n, 2): where nodes are as the increment begins and ends. Histories ``committed``, ``old`` as the increment
    begins with them and ``new``; ``share``: see `TimeRule`. ``histories``: for those of directions.
    """

    block: Block
    x_n: Array
    x: Array
    committed: Array
    old: Array
    new: Array
    seconds: float
    share: float
    histories: Histories

    @classmethod
    def of(cls, block: Block, c: Context, x: Array, k: int, new: Array, histories: Histories | None = None) -> Elements:
        """Of block number k at node positions x (n, 2) and with the history that an increment has led to."""
        seconds = c.rule.seconds(block, c.seconds)
        return cls(block, c.x_n, x, c.state.history[k], c.history[k], new, seconds, c.rule.share, histories or Histories())

    @cached_property
    def chunks(self) -> list[tuple[slice, At]]:
        """Elements that are answered for together, for the kernels."""
        ends = range(0, len(self.block), ELEMENTS_AT_ONCE)
        chunks = [slice(first, min(first + ELEMENTS_AT_ONCE, len(self.block))) for first in ends]
        return [(some, self._at(some)) for some in chunks]

    def _at(self, some: slice) -> At:
        law, cells, mode = point_law(self.block, self.seconds), self.block.cells[some], self.block.mode
        element: Any = self.block.element
        shifted = bool(self.block.law.plastic and self.share)
        bars = element.bar, mode.axisymmetric, law.form, shifted, element.mean_dilatation
        variant = Variant(element.nodes, element.points, *bars)
        return At(
            variant, element.table.rows, self.block.X[some], self.x_n.take(cells, axis=0), self.x.take(cells, axis=0),
            self.committed[some], self.old[some], self.new[some], law, self.share, mode.scale,
        )  # fmt: skip

    def _along(self, some: slice, g: Group, k: int, changes: Changes, dxn: Array, dx: Array | None, dold: Array) -> Along:
        """The directions of a group for some elements, committed histories (e, q, h, s); k: the block.

        dxn, dx (n, 2, d): motions of nodes as the increment begins, and at its end beyond those of initial places; None: none.
        """
        cells, own = self.block.cells[some], slice(g.first, g.first + g.size)
        initial = changes.X[..., own].take(cells, axis=0) if len(changes.X) else _still(*cells.shape, g.size)
        end = initial if dx is None else dx[..., own].take(cells, axis=0)
        if dx is not None and len(changes.X):
            end += initial
        return Along(initial, dxn[..., own].take(cells, axis=0), end, dold[some], g.p[k], *g.tables[k])

    def forces_along(self, changes: Changes, k: int, dxn: Array, dold: Sequence[Array], r: Array) -> None:
        """Add to r (ndof, d) what directions change of forces at fixed degrees of freedom; k: the block.

        dold: of the committed histories (e, q, h, s) by group; dxn (n, 2, d).
        """
        for g, old in zip(changes.groups, dold):
            force = np.zeros((len(dxn), 2, g.size))
            for some, at in self.chunks:
                found = derivatives.forces_along(at, self._along(some, g, k, changes, dxn, None, old))
                scatter_forces(found.reshape(len(found), -1), self.block.cells[some], force.reshape(-1))
            r[: 2 * len(dxn), g.first : g.first + g.size] += force.reshape(-1, g.size)

    def histories_along(
        self, changes: Changes, k: int, dxn: Array, dx: Array, dold: Sequence[Array]
    ) -> tuple[list[Array], Array]:  # fmt: skip
        """Histories (e, q, h, s) by group and energies (2, d) of directions in which the present nodes move by dx (n, 2, d).

        The energies are what is stored and the plastic work; all else as in `forces_along`.
        """
        found, energy, volume = [self.histories.like(old) for old in dold], np.zeros((2, dxn.shape[-1])), self.block.volume
        for g, old, new in zip(changes.groups, dold, found):
            for some, at in self.chunks:
                along = self._along(some, g, k, changes, dxn, dx, old)
                energy[:, g.first : g.first + g.size] += derivatives.history_along(at, along, volume[some], new[some])
        return found, energy

    def in_volumes(self, volumes: Array, energy: Array) -> None:
        """Add what initial volumes that change by (e, q, d) make of energies (2, d)."""
        if volumes.shape[-1]:
            of_points = volumes.reshape(-1, volumes.shape[-1])
            energy[0] += self.block.law.energy(self.new).ravel() @ of_points
            if self.block.law.plastic:
                energy[1] += self.block.field(self.new, "plastic_work").ravel() @ of_points


@cache
def _still(elements: int, nodes: int, size: int) -> Array:
    """Motions (e, a, 2, s) of nodes that stay: one row of zeros stands for all elements."""
    return np.broadcast_to(np.zeros((1, nodes, 2, size)), (elements, nodes, 2, size))


def point_law(block: Block, seconds: float) -> PointLaw:
    """The point law of a block that is known to have one."""
    law: Any = block.law
    found = law.point_law(seconds)
    assert isinstance(found, PointLaw)
    return found


def elements_of(
    system: System, c: Context, u: Array, e: Evaluation, histories: Sequence[Histories | None] | None = None
) -> list[Elements]:  # fmt: skip
    """All blocks at degrees of freedom u (ndof,), with the histories that an increment has led to."""
    x, room = system.positions(u), histories or [None] * len(system.blocks)
    return [Elements.of(b, c, x, k, new, own) for k, (b, new, own) in enumerate(zip(system.blocks, e.history, room))]


def unfolding(system: System, c: Context, u: Array, changes: Sequence[Change], r: Array) -> None:
    """Add to r (ndof, d) what directions make of the forces that unfold elements, at fixed degrees of freedom u (ndof,).

    They go with the modulus, and where bodies begin elsewhere with the initial shapes, along which they are differenced.
    """
    du = system.displacement(u - c.state.u)
    for k, b in enumerate(system.blocks):
        if not isinstance(b.element, Q4WithBar) or not q4.folding(c.x_n.take(b.cells, axis=0), du.take(b.cells, axis=0)).any():
            continue
        forces = _unfolding(system, b, c.x_n, du, system.X)
        for out, ch in zip(r.T, changes):
            out += ch.modulus[k] * forces
            if ch.X is not None:
                # By differences: these forces act in few elements of few increments.
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

