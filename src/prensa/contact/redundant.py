"""Multipliers that their own equations leave undetermined, because supports prescribe what these are about.

With exact enforcement a closed point says g = 0 and a sticking one Δg_T = 0. Where no free degree of freedom moves the point,
that says nothing about the multiplier: the corner of a side that a support slid along a tool and now holds still there. Such
points keep what they had, as springs of any stiffness would: the committed pressure, and the committed traction as far as
friction carries it. In space supports may leave one direction of the tangent plane: along the other the multiplier is that of the
last commit, before the return map bounds both together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.kernels.compiled import njit
from prensa.types import Array, Flags, Index

NO_SLOPE = 1e-6  # share of a slope in the free degrees of freedom that is none
MET = 1e-11  # gap or slip over the element depth that is none: the equation of a multiplier is met


class Supports(NamedTuple):
    """Points ``at`` (m,) some of whose degrees of freedom are prescribed, and which of theirs are ``free`` (m, k).

    ``ways`` (m, k, k): projections on the motions of these that supports leave, where some follow others (sides that are held
    along inclined normals); None: the free ones are those motions.
    """

    at: Index
    free: Flags
    ways: Array | None = None

    def moved(self, slopes: Array) -> Array:
        """Slopes (m, …, k) by the points' degrees of freedom on the motions that supports leave."""
        if self.ways is not None:
            return np.asarray(np.einsum("m...k,mkl->m...l", slopes, self.ways))
        return slopes * self.free.reshape(len(self.at), *(1,) * (slopes.ndim - 2), -1)


class RedundantPoints(NamedTuple):
    """Points (k,) that keep their pressure, their traction, and of the latter those whose traction the bound cuts down.

    ``along`` (k, t, t): in space, projections on the tangential directions along which points keep theirs; whether bounds cut it
    down, the return map decides there. None in the plane.
    """

    normal: Flags
    tangential: Flags
    bounded: Flags
    along: Array | None = None

    def kept(self, lam: Array, committed: Array) -> Array:
        """Tangential multipliers lam (k, t), along kept directions the ``committed`` tractions (k, t)."""
        if self.along is None:
            return lam
        return np.asarray(lam - np.einsum("kab,kb->ka", self.along, lam - committed))

    def moved_apart(self, gaps: Array, ways: Array) -> Array:
        """Sum (…) of the gaps (k, …) and ways (k, t, …), as forces, that have no free degree of freedom to close them.

        What directions make of them, by which points slide or open from a state of rest.
        """
        ways = ways[:, 0] if self.along is None else np.abs(np.einsum("kab,kb...->ka...", self.along, ways)).sum(axis=1)
        return np.asarray(np.abs(gaps[self.normal]).sum(axis=0) + np.abs(ways[self.tangential]).sum(axis=0))


class RedundantMultipliers(NamedTuple):
    """What multipliers of the ``points`` are: p, t (k,), with t's derivative by the pressure, by_p (k,).

    ``falls`` (k,): a ∂t/∂a, what the traction gains where the current area a of the point grows under a given force. In space
    the return map has t, of the multipliers that are kept (see `RedundantPoints.kept`).
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
        if self.points.along is None:
            slopes[t, 1] = self.by_p[t, None] * slopes[t, 0]
            values[t, 1] = self.t[t]
        values[n, 0] = self.p[n]
        slopes[n, 0] = 0.0

    def follow(self, by_pressure: Array) -> None:
        """Put what follows a pressure, and the traction from it, in the place of (k, 1 + t) derivatives."""
        n, t = self.points.normal, self.points.tangential
        if self.points.along is None:
            by_pressure[t, 1] = self.by_p[t]
        by_pressure[n, 0] = 0.0


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


def hold_in_space(
    supports: Supports, g: Array, dg: Array, ds: Array, slipped: Array, depth: Array, round_off: Array
) -> tuple[Flags, Array]:  # fmt: skip
    """As `hold`, with two tangents: points (k,) whose gap is none since supports prescribe it, and projections (k, 2, 2) on the
    directions along which they have not ``slipped`` (k, 2) for the same reason.

    Slopes dg (k, j), ds (k, 2, j). Which points are closed is not asked here.
    """
    at = supports.at
    least = np.maximum(MET * depth[at], 4.0 * round_off[at])
    rows = np.concatenate([dg[at, None], ds[at]], axis=1)
    size = np.sqrt((rows**2).sum(axis=2))
    left, directions = left_by(supports.moved(rows), NO_SLOPE * size[:, 0])
    normal, along = np.zeros(len(g), dtype=bool), np.zeros((len(g), 2, 2))
    normal[at] = (left[:, 0] <= NO_SLOPE * size[:, 0]) & (np.abs(g[at]) <= least)
    stands = left[:, 1:] <= NO_SLOPE * size[:, 1:].max(axis=1, initial=0.0)[:, None]
    way = np.sqrt(((np.einsum("mat,mt->ma", directions, slipped[at]) * stands) ** 2).sum(axis=1))
    stands &= (way <= least)[:, None]
    along[at] = np.einsum("mat,ma,mab->mtb", directions, stands.astype(np.float64), directions)
    return normal, along


def left_by(moved: Array, none: Array | float = 0.0) -> tuple[Array, Array]:
    """What motions can still change of a gap and of ways along the tangents beside it.

    moved (k, 1 + t, m): slopes of gap and ways on the motions that are left; ``none`` (k,): of the gap, what counts as nothing.
    Returns their sizes (k, 1 + t), of the gap and then along the ``directions`` (k, t, t), unit vectors in rows.
    """
    n, t = moved[:, 0], moved[:, 1:]
    n2 = (n**2).sum(axis=1)
    # what the gap takes to be closed, nothing is left of for the tangents
    share = np.divide((n[:, None] * t).sum(axis=2), n2[:, None], out=np.zeros(t.shape[:2]), where=(n2 > none**2)[:, None])
    beside = t - share[:, :, None] * n[:, None]
    _, vectors = np.linalg.eigh(np.einsum("ktm,ksm->kts", beside, beside))
    directions = vectors.transpose(0, 2, 1)
    # of the rows themselves: a root of an eigenvalue has half of the digits
    left = np.sqrt((np.einsum("kat,ktm->kam", directions, beside) ** 2).sum(axis=2))
    return np.concatenate([np.sqrt(n2)[:, None], left], axis=1), directions


def closed_slopes(free: Flags, normal: Array, tangential: Array) -> Array:
    """Slopes (k, m) of surface coordinates where free degrees of freedom keep gaps closed; arguments (k, m) as of `hold`."""
    n = np.where(_size(normal * free)[:, None] > NO_SLOPE * _size(normal)[:, None], normal * free, 0.0)
    n2 = (n**2).sum(axis=1)
    along = np.divide((n * tangential).sum(axis=1), n2, out=np.zeros_like(n2), where=n2 > 0.0)
    return tangential - along[:, None] * normal


def _size(rows: Array) -> Array:
    return np.asarray(np.sqrt((rows**2).sum(axis=1)))
