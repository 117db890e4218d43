"""Contact pairs, a point of a body and a rigid tool: gap and slip, with everything their tangent needs.

Generalised coordinates of a pair are q = (body point, motions of the tool): (x, y; x, y, rz) in the plane, here, and
(x, y, z; x, y, z, rx, ry, rz) in space, `prensa.contact.spatial`. All geometries give the gap g, the t surface coordinates s,
their derivatives with respect to q and the spin of the frame; `Pairs.stencils` makes of them what forces are assembled from.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from prensa.contact.stencil import Stencils, on_nodes
from prensa.kernels.compiled import njit
from prensa.tools.analytic import Closest, Tool, turned

Array = NDArray[np.float64]
Index = NDArray[np.int64]

GRAZING = 1e-6  # cosine below which a ray along the surface normal counts as tangent to the tool
LOOK_EVERY = np.pi / 8  # rotation of a tool from one look at where a point is on its surface to the next


class Pairs(NamedTuple):
    """k pairs with t tangents, m coordinates q: gap g (k,), surface coordinates s (k, t); normal n (k, d), tangents e (k, t, d).

    dg (k, m); ds (k, t, m). turn (k, w, m): spin of the frame n, e by q (zero where it does not turn), arm (k, d) from the
    tool's reference point, where it is now; moving: whether the arm moves with the body point too.
    """

    g: Array
    s: Array
    n: Array
    e: Array
    dg: Array
    ds: Array
    turn: Array
    arm: Array
    moving: bool

    def stencils(self, N: Array, coef: Array, dofs: Index) -> Stencils:
        """On the nodes that carry the points with N (k, a); coef (k, a + 1): N, and −1 of the tool; dofs (k, d a + m − d)."""
        dg = on_nodes(N, self.dg[:, None])[:, 0]
        ds, turn = on_nodes(N, self.ds), on_nodes(N, self.turn)
        return Stencils(dofs, coef, self.g, self.s, self.n, self.e, dg, ds, turn, self.arm, self.moving)

    def replaced(self, rows: Index, by: Pairs) -> Pairs:
        """With some rows (j,) those of others (j pairs)."""

        def mixed(mine: Array, other: Array) -> Array:
            out = mine.copy()
            out[rows] = other
            return out

        columns = {name: mixed(getattr(self, name), getattr(by, name)) for name in self._fields if name != "moving"}
        return Pairs(**columns, moving=self.moving)


class Closer(Protocol):
    """What has a closest point, a tool or a corner of one."""

    def closest(self, xi: Array) -> Closest:
        """Of points (k, 2) in its frame."""


def _generalised(v: Array, arm: Array) -> Array:
    """Action (k, 5) of unit forces v (k, 2) on the body points and their opposites on the tool."""
    moment = arm[:, 0] * v[:, 1] - arm[:, 1] * v[:, 0]
    return np.concatenate([v, -v, -moment[:, None]], axis=1)


def current_pairs(shape: Closer, x: Array, at: Array, place: Array) -> Pairs:
    """Moved surface, true tool normal: x (k, 2) current positions, at (2,), place (3,) displacement and rotation."""
    k = len(x)
    c, s = math.cos(place[2]), math.sin(place[2])
    arm, n = x - (at + place[:2]), np.empty((k, 2))
    e, dg, ds, turn = np.empty((k, 1, 2)), np.empty((k, 5)), np.empty((k, 1, 5)), np.empty((k, 1, 5))
    close = shape.closest(arm @ np.array([[c, -s], [s, c]]) if s else arm)
    _turn_into_space(close.g, close.c, close.n, place, arm, n, e, dg, ds, turn)
    return Pairs(close.g, close.s[:, None], n, e, dg, ds, turn, arm, True)


@njit(cache=True)
def _turn_into_space(g, c, n_tool, place, arm, n, e, dg, ds, turn):
    """Normals in the tool frame → the frame in space, and what changes g and s and turns the frame."""
    along = np.empty(5)
    cos, sin = math.cos(place[2]), math.sin(place[2])
    for k in range(len(g)):
        n[k, 0], n[k, 1] = cos * n_tool[k, 0] - sin * n_tool[k, 1], sin * n_tool[k, 0] + cos * n_tool[k, 1]
        e[k, 0, 0], e[k, 0, 1] = -n[k, 1], n[k, 0]
        for i in range(2):
            dg[k, i], along[i] = n[k, i], e[k, 0, i]
            dg[k, 2 + i], along[2 + i] = -n[k, i], -e[k, 0, i]
        dg[k, 4] = arm[k, 1] * n[k, 0] - arm[k, 0] * n[k, 1]
        along[4] = arm[k, 1] * e[k, 0, 0] - arm[k, 0] * e[k, 0, 1]
        for i in range(5):
            ds[k, 0, i] = (1.0 - g[k] * c[k]) * along[i]
            turn[k, 0, i] = c[k] * along[i]
        turn[k, 0, 4] += 1.0


class Since(NamedTuple):
    """Where a slip goes on: coordinate s (k, 1) and displacement of the body point u (k, 2), that of the tool (3,) there."""

    s: Array | float
    u: Array | float
    place: Array


UNMOVED = Since(0.0, 0.0, np.zeros(3))


def continued(shape: Tool, s: Array, X: Array, u: Array, at: Array, place: Array, since: Since) -> Array:
    """Coordinates s (k, 1) on a closed surface, counted on from those ``since``: X (k, 2) initial positions, u (k, 2).

    A closed surface has a cut, across which its coordinate jumps by the period: where a point is does not tell how often it
    went round. Half a period and less is the shorter way. A tool that turns by more is followed in turns of no more than
    `LOOK_EVERY`, points and tool on straight ways, so that a whole turn slips by the circumference.
    """
    looks = int(np.ceil(min(abs(place[2] - since.place[2]) / LOOK_EVERY, 1e4)))
    now = np.asarray(since.s)
    for share in np.arange(1, looks) / max(looks, 1):
        turn = since.place[2] + share * (place[2] - since.place[2])
        c, d = np.cos(turn), np.sin(turn)
        x = X + since.u + share * (u - since.u) - at - since.place[:2] - share * (place[:2] - since.place[:2])
        now = _next(shape.closest(x @ np.array([[c, -d], [d, c]])).s[:, None], now, shape.period)
    return _next(s, now, shape.period)


def _next(s: Array, before: Array, period: float) -> Array:
    """Coordinates (k, 1) with as many periods as bring them next to those before."""
    return s - period * np.round((s - before) / period)


def reference_pairs(
    shape: Tool, X: Array, normal: Array, u: Array, at: Array, place: Array, limit: float, since: Since = UNMOVED
) -> Pairs:
    """Linear Signorini: gap on the undeformed surface along its own normal, X, normal, u (k, 2).

    g = h − ν·u with h the distance along ν from X to the tool where it is now; forces act along −ν at X, their moment is
    about the tool's reference point where it is now. The surface has no coordinate on the tool: slip is what the point
    slid ``since``, e·(Δu − Δd) − (a × e) Δθ with the arm a of half the way, so that no turn of before slips when the tool
    moves along ν.
    """
    c, s = np.cos(place[2]), np.sin(place[2])
    R = np.array([[c, -s], [s, c]])
    centre = at + place[:2]
    h = np.empty(len(X))
    N = np.empty_like(X)
    for nu in np.unique(normal, axis=0):
        rows = (normal == nu).all(axis=1)
        local = (X[rows] - centre) @ R
        h[rows] = shape.along(local, nu @ R, limit)
        hit = np.where(np.isfinite(h[rows]), h[rows], 0.0)
        N[rows] = shape.closest(local + hit[:, None] * (nu @ R)).n @ R.T
    n = -normal
    e = turned(n)
    slope = (N * normal).sum(axis=1)
    # a ray that grazes the tool (the flank of a fillet, a cylinder's equator) meets it under no pressure
    miss = ~np.isfinite(h) | (slope > -GRAZING)
    h, slope = np.where(miss, np.inf, h), np.where(miss, -1.0, slope)
    g = h - (normal * u).sum(axis=1)
    arm = X - centre
    to_hit = arm + np.where(miss, 0.0, h)[:, None] * normal
    dg = np.zeros((len(X), 5))
    dg[:, :2] = n
    dg[:, 2:4] = N / slope[:, None]
    dg[:, 4] = (to_hit[:, 0] * N[:, 1] - to_hit[:, 1] * N[:, 0]) / slope
    step = place - since.place
    ds = _generalised(e, arm + 0.5 * step[:2])
    slip = since.s + ((e * (u - since.u - step[:2])).sum(axis=1) + ds[:, 4] * step[2])[:, None]
    # the arm of half the way goes half the way of the tool
    ds[:, 2] += 0.5 * step[2] * e[:, 1]
    ds[:, 3] -= 0.5 * step[2] * e[:, 0]
    return Pairs(g, slip, n, e[:, None], dg, ds[:, None], np.zeros((len(X), 1, 5)), arm, False)
