"""Equations of multipliers that supports leave undetermined: what Newton's matrix gets instead of a zero.

With exact enforcement a closed point says g = 0 and a sticking one Δg_T = 0. Supports may already prescribe what these
equations are about: the node on a symmetry line under a tool that moves along it, the corner of a block on an incline.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.contact.redundant import MET, Supports, left_by
from prensa.contact.surface import Surface
from prensa.policy import DEFAULT, Policy
from prensa.system.failure import Blocked
from prensa.system.system import Evaluation
from prensa.types import Array, Flags, Ints


class BlockedError(ArithmeticError):
    """A tool and a support prescribe the same displacement differently; ``failure`` says where."""

    def __init__(self, failure: Blocked) -> None:
        super().__init__(failure)
        self.failure = failure


class Equations(NamedTuple):
    """Of exact contact ``number``: places (k, 1 + t, m) of its equations in the matrix, ``free`` (k, m) dofs.

    ``supports``: what supports leave of the points of which some dofs are not free.
    """

    number: int
    surface: Surface
    slots: Ints
    free: Flags
    supports: Supports | None


def determined(e: Evaluation, b: Array, equations: list[Equations], policy: Policy = DEFAULT) -> Array:
    """Matrix values of an evaluation with a diagonal in the equations of closed and of sticking points; b right-hand side.

    Where supports hold the node along the normal, the equation must be met (else `BlockedError`). Where they hold it
    along a tangent, or along it while the normal takes the one dof left, a node that moves against the tool cannot
    stick: its multiplier is put beyond the bound. (What one that does not move keeps, its equation says itself: see
    `prensa.contact.redundant`.) Everywhere else the diagonal is small and only shares what redundant constraints carry together;
    Newton's order does not feel it.
    """
    assert e.data is not None
    data = e.data.copy()
    for eq in equations:
        f, s = e.contacts[eq.number], eq.surface
        rows = data[eq.slots]
        unit, t = s.unit, rows.shape[1] - 1
        size = np.sqrt((rows**2).sum(axis=2))
        # round a corner of the tool a point that sticks goes without any way: its equation has no slope, not even by itself
        size = np.where(size > 0.0, size, (f.weight * unit)[:, None])
        moved = (rows * eq.free[:, None, :])[:, :, : -1 - t]
        if eq.supports is not None and eq.supports.ways is not None:
            moved[eq.supports.at] = eq.supports.moved(rows[eq.supports.at, :, : -1 - t])
        # What of the equations the free unknowns of the point can still move, the tangential ones beside the gap.
        left, directions = left_by(moved)
        # An open or sliding point's equation has the multiplier itself on its diagonal; a closed or sticking one's has none.
        block = np.einsum("kat,kts->kas", directions, rows[:, 1:, -t:])
        own = np.column_stack([np.abs(rows[:, 0, -1 - t]), np.sqrt((block**2).sum(axis=2))])
        constraint = own <= policy.weak_multiplier_share * size
        held = constraint & (left <= policy.weak_multiplier_share * size)
        assert s.multipliers is not None
        asked = s.multipliers.of(b).copy()
        asked[:, 1:] = held[:, 1:] * np.einsum("kat,kt->ka", directions, asked[:, 1:])
        asked = np.column_stack([np.abs(asked[:, 0]), np.sqrt((asked[:, 1:] ** 2).sum(axis=1))])
        unmet = asked > (MET * s.points.depth * f.weight * unit)[:, None]
        unmet = held & np.column_stack([unmet[:, 0], np.repeat(unmet[:, 1:], t, axis=1)])
        # No multiplier closes a gap that supports hold. An open one lets the point open; a tool that is driven in has no exact
        # answer.
        inside = unmet[:, 0] & (f.g < -MET * s.points.depth)
        if inside.any():
            raise BlockedError(Blocked(s.name, *s.X[int(np.argmax(inside))].tolist()))
        beyond = (policy.beyond_bound_ratio * f.p / unit)[:, None]
        leap = np.divide(asked[:, 1:], beyond, out=size[:, 1:].copy(), where=beyond > 0)
        # A diagonal of the size of its row leaves a redundant multiplier as it is. The small one lets two tools share the load
        # on a node.
        shift = np.where(held, size, np.where(constraint, policy.redundant_shift_ratio * size, 0.0))
        shift[:, 1:] = np.where(unmet[:, 1:], leap, shift[:, 1:])
        data[eq.slots[:, 0, -1 - t]] -= shift[:, 0]
        data[eq.slots[:, 1:, -t:]] -= np.einsum("kat,ka,kas->kts", directions, shift[:, 1:], directions)
    return data
