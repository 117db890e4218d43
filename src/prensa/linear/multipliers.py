"""Equations of multipliers that supports leave undetermined: what Newton's matrix gets instead of a zero.

With exact enforcement a closed point says g = 0 and a sticking one Δg_T = 0. Supports may already prescribe what these
equations are about: the node on a symmetry line under a tool that moves along it, the corner of a block on an incline.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.contact.redundant import MET
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
    """Of exact contact ``number``: places (k, 2, m) of its equations in the matrix, ``free`` (k, m) dofs."""

    number: int
    surface: Surface
    slots: Ints
    free: Flags


def determined(e: Evaluation, b: Array, equations: list[Equations], policy: Policy = DEFAULT) -> Array:
    """Matrix values of an evaluation with a diagonal in the equations of closed and of sticking points; b right-hand side.

    Where supports hold the node along the normal, the equation must be met (else `BlockedError`). Where they hold it
    along the tangent, or along both while the normal takes the one dof left, a node that moves against the tool cannot
    stick: its multiplier is put beyond the bound. (What one that does not move keeps, its equation says itself: see
    `prensa.contact.redundant`.) Everywhere else the diagonal is small and only shares what redundant constraints carry together;
    Newton's order does not feel it.
    """
    assert e.data is not None
    data = e.data.copy()
    for eq in equations:
        f, s = e.contacts[eq.number], eq.surface
        rows = data[eq.slots]
        unit = s.unit
        size = np.sqrt((rows**2).sum(axis=2))
        # round a corner of the tool a point that sticks goes without any way: its equation has no slope, not even by itself
        size = np.where(size > 0.0, size, (f.weight * unit)[:, None])
        # An open or sliding point's equation has the multiplier itself on its diagonal; a closed or sticking one's has none.
        own = np.abs(np.stack([rows[:, 0, -2], rows[:, 1, -1]], axis=1))
        n, t = ((rows * eq.free[:, None, :])[:, k, :-2] for k in range(2))
        n2 = (n**2).sum(axis=1)
        along = np.divide((n * t).sum(axis=1), n2, out=np.zeros_like(n2), where=n2 > 0)
        # What of either equation the free unknowns of the point can still move, the tangential one beside the gap.
        left = np.stack([np.sqrt(n2), np.sqrt(((t - along[:, None] * n) ** 2).sum(axis=1))], axis=1)
        constraint = own <= policy.weak_multiplier_share * size
        held = constraint & (left <= policy.weak_multiplier_share * size)
        assert s.multipliers is not None
        asked = np.abs(s.multipliers.of(b))
        unmet = held & (asked > (MET * s.points.depth * f.weight * unit)[:, None])
        # No multiplier closes a gap that supports hold. An open one lets the point open; a tool that is driven in has no exact
        # answer.
        inside = unmet[:, 0] & (f.g < -MET * s.points.depth)
        if inside.any():
            x, y = s.X[int(np.argmax(inside))].tolist()
            raise BlockedError(Blocked(s.name, x, y))
        beyond = policy.beyond_bound_ratio * f.p / unit
        leap = np.divide(asked[:, 1], beyond, out=size[:, 1].copy(), where=beyond > 0)
        # A diagonal of the size of its row leaves a redundant multiplier as it is. The small one lets two tools share the load
        # on a node.
        shift = np.where(held, size, np.where(constraint, policy.redundant_shift_ratio * size, 0.0))
        shift[:, 1] = np.where(unmet[:, 1], leap, shift[:, 1])
        data[eq.slots[:, [0, 1], [-2, -1]]] -= shift
    return data
