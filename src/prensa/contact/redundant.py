"""Multipliers that their own equations leave undetermined, because supports prescribe what these are about.

With exact enforcement a closed point says g = 0 and a sticking one Δg_T = 0. Where no free degree of freedom moves the point,
that says nothing about the multiplier: the corner of a side that a support slid along a tool and now holds still there. Such
points keep what they had, as springs of any stiffness would: the committed pressure, and the committed traction as far as
friction carries it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.kernels.compiled import njit
from prensa.types import Array, Flags, Index

NO_SLOPE = 1e-6  # share of a slope in the free degrees of freedom that is none
MET = 1e-11  # gap or slip over the element depth that is none: the equation of a multiplier is met


class Supports(NamedTuple):
    """Points ``at`` (m,) some of whose degrees of freedom are prescribed, and which of theirs are ``free`` (m, k)."""

    at: Index
    free: Flags


class RedundantPoints(NamedTuple):
    """Points (k,) that keep their pressure, their traction, and of the latter those whose traction the bound cuts down."""

    normal: Flags
    tangential: Flags
    bounded: Flags

    def moved_apart(self, gaps: Array, ways: Array) -> Array:
        """Sum (…) of the gaps and ways (k, …), as forces, that have no free degree of freedom to close them.

        What directions make of them, by which points slide or open from a state of rest.
        """
        return np.asarray(np.abs(gaps[self.normal]).sum(axis=0) + np.abs(ways[self.tangential]).sum(axis=0))


class RedundantMultipliers(NamedTuple):
    """What multipliers of the ``points`` are: p, t (k,), with t's derivative by the pressure, by_p (k,).

    ``falls`` (k,): a ∂t/∂a, what the traction gains where the current area a of the point grows under a given force.
    """

    points: RedundantPoints
    p: Array
    t: Array
    by_p: Array
    falls: Array

    def put(self, values: Array, slopes: Array) -> None:
        """Put them in the place of pressures and tractions (k, 2), whose slopes are (k, 2, 2 + m)."""
        n, t = self.points.normal, self.points.tangential
        # First the traction: its bound follows the pressure λ_n − k_n g, whose slopes the last line empties where the pressure
        # is kept.
        slopes[t, 1] = self.by_p[t, None] * slopes[t, 0]
        values[t, 1], values[n, 0] = self.t[t], self.p[n]
        slopes[n, 0] = 0.0


@njit(cache=True, error_model="numpy")
def hold(at, free, normal, tangential, closed, g, s, coordinate, depth, round_off, out):
    """Sets out (3, k): closed points ``at`` (m,) with no gap, and with none by which they moved, since supports prescribe it.

    ``free`` (m, j): which degrees of freedom of the points are; slopes normal, tangential (k, j) of gaps g and of surface
    coordinates s by them; ``coordinate`` (k,): s at the last commit; element ``depth`` and ``round_off`` of gaps (k,).
    """
    for i in range(len(at)):
        k = at[i]
        # Only an equation that is met may be left out. A gap that supports hold open or drive in has no exact answer, and has
        # to reach the factorisation, which refuses it with its place.
        least = max(MET * depth[k], 4.0 * round_off[k])
        if not closed[k]:
            continue
        nn, nf, nt, tt = 0.0, 0.0, 0.0, 0.0
        for j in range(free.shape[1]):
            nn += normal[k, j] ** 2
            tt += tangential[k, j] ** 2
            if free[i, j]:
                nf += normal[k, j] ** 2
                nt += normal[k, j] * tangential[k, j]
        stands = nf <= NO_SLOPE**2 * nn
        along, left = 0.0 if stands else nt / nf, 0.0  # beside the gap, which the normal multiplier closes
        for j in range(free.shape[1]):
            if free[i, j]:
                left += (tangential[k, j] - along * normal[k, j]) ** 2
        out[0, k] = stands and abs(g[k]) <= least
        out[1, k] = left <= NO_SLOPE**2 * tt and abs(s[k] - coordinate[k]) <= least


def closed_slopes(free: Flags, normal: Array, tangential: Array) -> Array:
    """Slopes (k, m) of surface coordinates where free degrees of freedom keep gaps closed; arguments (k, m) as of `hold`."""
    n = np.where(_size(normal * free)[:, None] > NO_SLOPE * _size(normal)[:, None], normal * free, 0.0)
    n2 = (n**2).sum(axis=1)
    along = np.divide((n * tangential).sum(axis=1), n2, out=np.zeros_like(n2), where=n2 > 0.0)
    return tangential - along[:, None] * normal


def _size(rows: Array) -> Array:
    return np.asarray(np.sqrt((rows**2).sum(axis=1)))
