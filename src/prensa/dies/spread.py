"""Nodal contact forces onto intervals of a tool's coordinate, without losing any.

The force of a node acts on the tool as the traction of its tributary part of the surface: a hat between its neighbours, about an
axis weighted with the radius. A hat is integrated over each interval in closed form, so the intervals' forces sum to the nodes'.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from prensa.dies.surface import feet, joined
from prensa.errors import PrensaError
from prensa.model.problem import Problem
from prensa.precision import NEGLIGIBLE
from prensa.result.increment import ContactState, ToolState
from prensa.tools.place import PlacedTool
from prensa.types import Array, Flags, Index

QUADRATIC = ("q8", "q8_full", "t6")


@dataclass(frozen=True)
class Touch:
    """A contact on its tool: k nodes at coordinates ``s`` that press with ``normal`` and ``shear`` (along e, on the tool).

    ``left``, ``right`` (k,): how far the node's part reaches along s, ``r`` (k, 3): radii at its left end, itself and its right
    end (ones in the plane), ``slid`` (k,): way that it slid in the increment, ``force`` (k, 2): on the tool.
    """

    s: Array
    normal: Array
    shear: Array
    left: Array
    right: Array
    r: Array
    slid: Array
    force: Array

    def shares(self, borders: Array, period: float, shift: float | Array = 0.0) -> Array:
        """Share (k, m) of each node's part in the intervals between m + 1 borders, of parts moved along s by ``shift``."""
        at = self.s + shift
        turns = (0.0,) if np.isinf(period) else (-period, 0.0, period)
        total = np.zeros((len(at), len(borders)))
        for turn in turns:
            total += self._up_to(borders[None, :] - (at + turn)[:, None])
        return np.asarray(np.diff(total, axis=1))

    @property
    def width(self) -> Array:
        """Integral (k,) of each node's hat along s, about an axis times the radius."""
        rl, ra, rr = self.r.T
        return np.asarray(self.left * _half(1.0, ra, rl) + self.right * _half(1.0, ra, rr))

    def _up_to(self, d: Array) -> Array:
        """Share (k, m) of each hat up to distances d (k, m) from its node."""
        (rl, ra, rr), a, b = self.r.T[:, :, None], self.left[:, None], self.right[:, None]
        u = np.clip(-d / np.where(a > 0, a, 1.0), 0.0, 1.0)
        v = np.clip(d / np.where(b > 0, b, 1.0), 0.0, 1.0)
        below = a * (_half(1.0, ra, rl) - _half(u, ra, rl))
        whole = a * _half(1.0, ra, rl) + b * _half(1.0, ra, rr)
        return np.asarray((below + b * _half(v, ra, rr)) / whole)


def _half(u: Array | float, here: Array, there: Array) -> Array:
    """∫₀ᵘ (1 − u) (here + (there − here) u) du."""
    return np.asarray(here * (u - 0.5 * u**2) + (there - here) * (0.5 * u**2 - u**3 / 3.0))


def touch(problem: Problem, tool: PlacedTool, state: ToolState, contact: ContactState, seconds: float) -> Touch | None:
    """How a contact touches its tool at the end of an increment of some seconds; None where no node carries a force.

    Raises
    ------
    PrensaError
        If the nodal forces are not known, as of a run of an older version.

    """
    if not np.isfinite(contact.force).all():
        raise PrensaError(f"contact {contact.surface} on {contact.tool}: its nodal forces were not saved; run the case again")
    if not contact.force.any():
        return None
    close, n, e = feet(tool, state, contact.x)
    finite = problem.kinematics == "finite"
    where = contact.x if finite else contact.X
    axis = problem.space == "axisymmetric"
    depth = 2 * np.pi * where[:, 0] if axis else np.full(len(where), problem.thickness)
    next_to = joined(where, contact.weight, depth)
    force = _trapezoid(contact.force, next_to) if problem.bodies[contact.body].element in QUADRATIC else contact.force
    on = np.asarray(force.any(axis=1))
    s = _together(np.asarray(close.s), np.hypot(*force.T), tool.shape.period)
    left, right, radii = _reach(s, contact.x, on, next_to, tool.shape.period, axis)
    speed = np.zeros(len(where)) if contact.speed is None else contact.speed
    return Touch(
        s[on], (force * n).sum(axis=1)[on], -(force * e).sum(axis=1)[on], left[on], right[on], radii[on],
        np.nan_to_num(speed)[on] * seconds, -force[on],
    )  # fmt: skip


def _together(s: Array, size: Array, period: float) -> Array:
    """Coordinates (k,) on a closed tool without a leap where forces of some sizes (k,) act: about the middle of these."""
    if np.isinf(period):
        return s
    turn = 2.0 * np.pi / period
    middle = float(np.angle((size * np.exp(1j * turn * s)).sum())) / turn
    return np.asarray(middle + (s - middle) - period * np.round((s - middle) / period))


def _trapezoid(force: Array, next_to: Index) -> Array:
    """Forces (k, 2) of quadratic edges as those of twice as many straight ones, each with the middle of an edge between.

    ∫N of a quadratic edge, 1/6 and 2/3 of it, becomes the trapezoid's 1/4 and 1/2: a middle gives an eighth to each end.
    """
    out = force.copy()
    runs = np.split(next_to, np.flatnonzero(np.diff(next_to) > 1) + 1)
    for run in runs:
        middles = run[::2] + 1
        for k in middles[middles + 1 < len(force)]:
            out[k - 1] += 0.125 * force[k]
            out[k + 1] += 0.125 * force[k]
            out[k] -= 0.25 * force[k]
    return out


def _reach(s: Array, x: Array, loaded: Flags, next_to: Index, period: float, axis: bool) -> tuple[Array, Array, Array]:
    """How far the parts of k nodes reach to either side along s, and radii (k, 3) at their ends and middles."""
    k = len(s)
    left, right = np.zeros(k), np.zeros(k)
    r = np.repeat(x[:, :1], 3, axis=1) if axis else np.ones((k, 3))
    way = s[next_to + 1] - s[next_to]
    if np.isfinite(period):
        way = way - period * np.round(way / period)
    chord = np.hypot(*(x[next_to + 1] - x[next_to]).T)
    both = loaded[next_to] & loaded[next_to + 1]
    way = np.where(both, way, np.sign(way) * np.minimum(np.abs(way), chord))
    for here, there, d in ((next_to, next_to + 1, way), (next_to + 1, next_to, -way)):
        for ends, column, out in ((left, 0, -d), (right, 2, d)):
            new = out > ends[here]
            ends[here[new]] = out[new]
            if axis:
                r[here[new], column] = x[there[new], 0]
    bare = left + right <= 0.0
    right[bare] = NEGLIGIBLE * max(float(np.ptp(s)), 1.0)  # a node without an edge: all of it in one place
    if axis:
        r = np.maximum(r, 0.0)
        r[(r.max(axis=1) <= 0.0)] = 1.0
    return left, right, r
