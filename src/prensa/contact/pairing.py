"""Contact pairs, a point of a body and a rigid tool: gap and slip, with everything their tangent needs.

Generalised coordinates of a pair are q = (body point, motions of the tool): (x, y; x, y, rz) in the plane and
(x, y, z; x, y, z, rx, ry, rz) in space, rotations being components of a rotation vector (see `rotation`). All geometries give
the gap g, the t surface coordinates s, their derivatives with respect to q and the spin of the frame; `Pairs.stencils` makes of
them what forces are assembled from.

Slip is the way of the point along the tool since the last commit. In the plane tools count their surface coordinate exactly. In
space it is the chord from the place on the tool that was touched then, r = x_s − x_n, laid on the surface: with m the normal
there, carried by the tool, and α the angle to n, Δs_a = (α/sin α) e_a·r. The tangents e_a are those of the committed place
carried along the smallest rotation that takes m to n, as the tractions along them are; exact on planes, spheres and cylinders,
of third order elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from prensa.contact.stencil import DIMENSION, Stencils
from prensa.geometry.plane import turned
from prensa.kernels.compiled import njit
from prensa.precision import NEGLIGIBLE
from prensa.tools.analytic import Closest, Tool
from prensa.types import Array, Index

GRAZING = 1e-6  # cosine below which a ray along the surface normal counts as tangent to the tool
LOOK_EVERY = np.pi / 8  # rotation of a tool from one look at where a point is on its surface to the next
SMALL_ANGLE = 1e-3  # 1 − cos of an angle below which α/sin α is taken from its series, exact to round-off there


class Pairs(NamedTuple):
    """k pairs with t tangents, m coordinates q: gap g (k,), surface coordinates s (k, t); normal n (k, d), tangents e (k, t, d).

    dg (k, m); ds (k, t, m). turn (k, w, m): spin of the frame n, e by q (zero where it does not turn), arm (k, d) from the
    tool's reference point, where it is now; moving: whether the arm moves with the body point too. kept (k, t, d): tangents that
    committed tractions are kept along, the tool's own at the place that is touched; None: the tangents e.
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
    kept: Array | None = None

    def stencils(self, N: Array, coef: Array, dofs: Index) -> Stencils:
        """On the nodes that carry the points with N (k, a); coef (k, a + 1): N, and −1 of the tool; dofs (k, d a + m − d)."""
        dg, ds, turn = on_nodes(N, self.dg[:, None], self.ds, self.turn)
        return Stencils(dofs, coef, self.g, self.s, self.n, self.e, dg[:, 0], ds, turn, self.arm, self.moving, kept=self.kept)

    def replaced(self, rows: Index, by: Pairs) -> Pairs:
        """With some rows (j,) those of others (j pairs)."""

        def mixed(mine: Array, other: Array) -> Array:
            out = mine.copy()
            out[rows] = other
            return out

        return self._replace(
            g=mixed(self.g, by.g), s=mixed(self.s, by.s), n=mixed(self.n, by.n), e=mixed(self.e, by.e),
            dg=mixed(self.dg, by.dg), ds=mixed(self.ds, by.ds), turn=mixed(self.turn, by.turn), arm=mixed(self.arm, by.arm),
        )  # fmt: skip


class Closer(Protocol):
    """What has a closest point, a tool or a corner of one."""

    def closest(self, xi: Array) -> Closest:
        """Of points (k, d) in its frame."""


def rotation(turn: Array) -> Array:
    """Rotation (d, d) by an angle (1,) in the plane, by a rotation vector (3,) in space, or by rotations r of a tool (9,).

    The latter are r, the r from which they are counted, and the rotation vector of the orientation there:
    Q = exp(r - r0) exp(θ0) (Ibrahimbegović, Frey & Kožar 1995). r adds up over the steps of a run, and has no largest angle.
    """
    if len(turn) == 1:
        c, s = math.cos(turn[0]), math.sin(turn[0])
        return np.array([[c, -s], [s, c]])
    if len(turn) == 9:
        return np.asarray(rotation(turn[:3] - turn[3:6]) @ rotation(turn[6:]))
    angle = float(np.linalg.norm(turn))
    W = _cross_matrix(turn)
    # Rodrigues' formula; np.sinc holds sin θ/θ and (1 − cos θ)/θ² through θ = 0, where tools that do not turn are.
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * W + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * W @ W)


def spin(turn: Array) -> Array:
    """Spin (w, w) by the rates of a `rotation`'s angle, vector (w,) or rotations r: ω = T dr/dt."""
    if len(turn) == 1:
        return np.eye(1)
    if len(turn) == 9:
        turn = turn[:3] - turn[3:6]
    angle = float(np.linalg.norm(turn))
    W = _cross_matrix(turn)
    # (θ − sin θ)/θ³ cancels for small angles; below 1e-3 the first term that its series leaves out is under round-off.
    third = (1.0 - np.sinc(angle / np.pi)) / angle**2 if angle > 1e-3 else 1.0 / 6.0 - angle**2 / 120.0
    return np.asarray(np.eye(3) + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * W + third * W @ W)


def rotation_vector(Q: Array, near: Array) -> Array:
    """Rotation vector (3,) of a rotation Q (3, 3): of those that differ by whole turns the one next to ``near`` (3,)."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(Q).as_quat()
    axis, size = np.array([x, y, z]), math.sqrt(x * x + y * y + z * z)
    if size == 0.0:  # whole turns have no axis in Q: they go on about the last one
        axis, size = near, float(np.linalg.norm(near)) or 1.0
    angle = 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), w)
    axis = axis / size
    return np.asarray((angle + 2.0 * np.pi * round((float(axis @ near) - angle) / (2.0 * np.pi))) * axis)


def _cross_matrix(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def tangents(n: Array) -> Array:
    """Two unit tangents (k, 2, 3) of a surface with normals n (k, 3), right-handed with them.

    The first is nearest to the coordinate axis that is farthest from the normal; of axes that are alike it is the first, whatever
    round-off says: what is kept along tangents is read along those of the same normal.
    """
    size = np.abs(n)
    axis = np.eye(3)[np.argmax(size <= size.min(axis=1)[:, None] + NEGLIGIBLE, axis=1)]
    t = axis - (axis * n).sum(axis=1)[:, None] * n
    t /= np.linalg.norm(t, axis=1)[:, None]
    return np.stack([t, np.cross(n, t)], axis=1)


def _moment(arm: Array, v: Array) -> Array:
    """Moments (k, w) of forces v (k, d)."""
    if arm.shape[1] == 3:
        return np.cross(arm, v)
    return np.asarray(arm[:, :1] * v[:, 1:] - arm[:, 1:] * v[:, :1])


def current_pairs(shape: Closer, x: Array, at: Array, place: Array) -> Pairs:
    """Moved surface, true tool normal: x (k, 2) current positions, at (2,), place (3,) displacement and rotation."""
    k = len(x)
    c, s = math.cos(place[2]), math.sin(place[2])
    arm, n = x - (at + place[:2]), np.empty((k, 2))
    e, dg, ds, turn = np.empty((k, 1, 2)), np.empty((k, 5)), np.empty((k, 1, 5)), np.empty((k, 1, 5))
    # Rows times the rotation are places turned back, into the frame of the tool.
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
        # A turn θ of the tool moves its surface at the point by θ × arm, and g by −n·(θ × arm).
        dg[k, 4] = arm[k, 1] * n[k, 0] - arm[k, 0] * n[k, 1]
        along[4] = arm[k, 1] * e[k, 0, 0] - arm[k, 0] * e[k, 0, 1]
        for i in range(5):
            # c is the curvature at the point, 1/(R + g) beside a circle: the foot of the projection moves by the share
            # 1 − g c = R/(R + g).
            ds[k, 0, i] = (1.0 - g[k] * c[k]) * along[i]
            turn[k, 0, i] = c[k] * along[i]
        # The frame turns with the tool besides.
        turn[k, 0, 4] += 1.0


class Since(NamedTuple):
    """Where a slip goes on: coordinate s (k, t), displacement of the body point u (k, d), and place of the tool there."""

    s: Array | float
    u: Array | float
    place: Array


def spatial_pairs(shape: Closer, X: Array, u: Array, at: Array, place: Array, since: Since | None = None) -> Pairs:
    """`current_pairs` in space: X, u (k, 3) initial positions and displacements, at (3,), place (6,) or (12,).

    ``since``: where slip goes on; None: here, so that the coordinates are zero.
    """
    Q, k = rotation(place[3:]), len(X)
    arm = X + u - (at + place[:3])
    y = arm @ Q
    close = shape.closest(y)
    touched, m, start = y, close.n, np.zeros((k, 2))
    if since is not None:
        touched = (X + since.u - at - since.place[:3]) @ rotation(since.place[3:])
        then = shape.closest(touched)
        # The chord begins at the foot of the committed point: the penetration or gap that it had is no slip.
        touched, m, start = touched - then.g[:, None] * then.n, then.n, start + since.s
    n, e, kept, s = np.empty((k, 3)), np.empty((k, 2, 3)), np.empty((k, 2, 3)), np.empty((k, 2))
    dg, ds, turn = np.empty((k, 9)), np.empty((k, 2, 9)), np.empty((k, 3, 9))
    _carried_frame(
        Q, Q.T @ spin(place[3:]), y, close.n, close.c, touched, m, start, n, e, kept, s, dg, ds, turn,
        np.empty((2, 3)), np.empty((2, 3)), np.empty((2, 3)), np.empty(3),
    )  # fmt: skip
    return Pairs(close.g, s, n, e, dg, ds, turn, arm, True, kept)


@njit(cache=True, error_model="numpy", forceinline=True)
def _tangents(n, out):
    """`tangents` of one normal (3,)."""
    least = min(abs(n[0]), abs(n[1]), abs(n[2])) + NEGLIGIBLE
    axis = 0
    while abs(n[axis]) > least:
        axis += 1
    size = 0.0
    for i in range(3):
        out[0, i] = (1.0 if i == axis else 0.0) - n[axis] * n[i]
        size += out[0, i] ** 2
    for i in range(3):
        out[0, i] /= math.sqrt(size)
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        out[1, i] = n[i1] * out[0, i2] - n[i2] * out[0, i1]


@njit(cache=True, error_model="numpy")
def _carried_frame(Q, T, y, n_tool, H, touched, m, start, n, e, kept, s, dg, ds, turn, old, now, own, dn):
    """Frame, ways and their derivatives, made in the tool's frame, in which the committed place stands still, and turned by Q.

    y (k, 3) places, normals n_tool there and H = ∂n/∂y (k, 3, 3); places ``touched`` (k, 3), normals m, coordinates start (k, 2)
    at the last commit; T (3, 3) spin by the tool's rotations in its frame. The last arguments are room to work in.
    """
    for k in range(len(y)):
        _tangents(m[k], old)
        _tangents(n_tool[k], own)
        c = 0.0
        for i in range(3):
            c += n_tool[k, i] * m[k, i]
        x = 1.0 - c
        # α/sin α and its derivative by cos α in powers of x = 1 − cos α: arccos loses half of its digits where normals hardly
        # turn.
        if x < SMALL_ANGLE:
            phi = 1.0 + x * (1 / 3 + x * (2 / 15 + x * (2 / 35 + x * 8 / 315)))
            dphi = -(1 / 3 + x * (4 / 15 + x * (6 / 35 + x * 32 / 315)))
        else:
            phi = math.acos(c) / math.sqrt(1.0 - c * c)
            dphi = (c * phi - 1.0) / (1.0 - c * c)
        for a in range(2):
            b, way = 0.0, 0.0
            for i in range(3):
                b += n_tool[k, i] * old[a, i]
            for i in range(3):
                # The smallest rotation from m to n. It is undefined only for n = −m, half a turn within one increment.
                now[a, i] = old[a, i] - b / (1.0 + c) * (m[k, i] + n_tool[k, i])
                way += now[a, i] * (y[k, i] - touched[k, i])
            s[k, a] = start[k, a] + phi * way
        for i in range(3):
            n[k, i] = 0.0
            for l in range(3):
                n[k, i] += Q[i, l] * n_tool[k, l]
            for a in range(2):
                e[k, a, i], kept[k, a, i] = 0.0, 0.0
                for l in range(3):
                    e[k, a, i] += Q[i, l] * now[a, l]
                    kept[k, a, i] += Q[i, l] * own[a, l]
        for col in range(6):  # motions of the point and rotations of the tool; its displacements are those of the point reversed
            if col < 3:
                g0, g1, g2 = Q[col, 0], Q[col, 1], Q[col, 2]
            else:
                w0, w1, w2 = T[0, col - 3], T[1, col - 3], T[2, col - 3]
                g0, g1, g2 = y[k, 1] * w2 - y[k, 2] * w1, y[k, 2] * w0 - y[k, 0] * w2, y[k, 0] * w1 - y[k, 1] * w0
            q = col if col < 3 else col + 3
            dg[k, q] = n_tool[k, 0] * g0 + n_tool[k, 1] * g1 + n_tool[k, 2] * g2
            dc = 0.0
            for i in range(3):
                dn[i] = H[k, i, 0] * g0 + H[k, i, 1] * g1 + H[k, i, 2] * g2
                dc += m[k, i] * dn[i]
            about = 0.0
            for a in range(2):
                b, db, way = 0.0, 0.0, 0.0
                dway = now[a, 0] * g0 + now[a, 1] * g1 + now[a, 2] * g2
                for i in range(3):
                    b += n_tool[k, i] * old[a, i]
                    db += dn[i] * old[a, i]
                for i in range(3):
                    de = -(db - b * dc / (1.0 + c)) / (1.0 + c) * (m[k, i] + n_tool[k, i]) - b / (1.0 + c) * dn[i]
                    r = y[k, i] - touched[k, i]
                    way += now[a, i] * r
                    dway += de * r
                    if a == 0:
                        about += now[1, i] * de
                ds[k, a, q] = dphi * dc * way + phi * dway
            for i in range(3):
                turn[k, i, q] = 0.0
            for l in range(3):
                l1, l2 = (l + 1) % 3, (l + 2) % 3
                # Spin of the frame: n × dn turns the normal, the rest turns the tangents about it.
                spin_l = n_tool[k, l1] * dn[l2] - n_tool[k, l2] * dn[l1] + about * n_tool[k, l]
                if col >= 3:
                    spin_l += T[l, col - 3]
                for i in range(3):
                    turn[k, i, q] += Q[i, l] * spin_l
        for q in range(3):
            dg[k, 3 + q] = -dg[k, q]
            for a in range(2):
                ds[k, a, 3 + q] = -ds[k, a, q]
            for i in range(3):
                turn[k, i, 3 + q] = -turn[k, i, q]


def continued(shape: Tool, s: Array, X: Array, u: Array, at: Array, place: Array, since: Since) -> Array:
    """Coordinates s (k, 1) on a closed surface, counted on from those ``since``: X (k, 2) initial positions, u (k, 2).

    A closed surface has a cut, across which its coordinate jumps by the period: where a point is does not say how often it
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
    shape: Tool, X: Array, normal: Array, u: Array, at: Array, place: Array, limit: float,
    since: Since | None = None,
) -> Pairs:  # fmt: skip
    """Linear Signorini: gap on the undeformed surface along its own normal, X, normal, u (k, d).

    g = h − ν·u with h the distance along ν from X to the tool where it is now; forces act along −ν at X, their moment is
    about the tool's reference point where it is now. The surface has no coordinate on the tool: slip is what the point
    slid ``since`` (None: since the beginning), e·(Δu − Δd) − (a × e)·Δθ with the arm a of half the way, so that no turn of before
    slips when the tool moves along ν.
    """
    d = X.shape[1]
    since = Since(0.0, 0.0, np.zeros_like(place)) if since is None else since
    R, T = rotation(place[d:]), spin(place[d:])
    centre = at + place[:d]
    h = np.empty(len(X))
    N = np.empty_like(X)
    # `along` takes one direction for many points, and a flat side has one.
    for nu in np.unique(normal, axis=0):
        rows = (normal == nu).all(axis=1)
        local = (X[rows] - centre) @ R
        h[rows] = shape.along(local, nu @ R, limit)
        hit = np.where(np.isfinite(h[rows]), h[rows], 0.0)
        N[rows] = shape.closest(local + hit[:, None] * (nu @ R)).n @ R.T
    n = -normal
    e = turned(n)[:, None] if d == 2 else tangents(n)
    slope = (N * normal).sum(axis=1)
    # a ray that grazes the tool (the flank of a fillet, a cylinder's equator) meets it under no pressure
    miss = ~np.isfinite(h) | (slope > -GRAZING)
    # A slope of −1 for those that miss only keeps the divisions below finite: their gap is infinite.
    h, slope = np.where(miss, np.inf, h), np.where(miss, -1.0, slope)
    g = h - (normal * u).sum(axis=1)
    arm = X - centre
    to_hit = arm + np.where(miss, 0.0, h)[:, None] * normal
    # The ray X + h ν meets the tool where N·(X + h ν − x_tool) = 0: h changes by N·dx_tool over N·ν.
    dg = np.concatenate([n, N / slope[:, None], _moment(to_hit, N) @ T / slope[:, None]], axis=1)
    step = place - since.place
    turned_by = step[d : d + len(T)]
    half, slip, ds = arm + 0.5 * step[:d], np.empty((len(X), d - 1)), np.empty((len(X), d - 1, dg.shape[1]))
    for a in range(d - 1):
        about = -_moment(half, e[:, a])
        slip[:, a] = (e[:, a] * (u - since.u - step[:d])).sum(axis=1) + about @ turned_by
        ds[:, a] = np.concatenate([e[:, a], -e[:, a], about], axis=1)
        # the arm of half the way goes half the way of the tool
        ds[:, a, d : 2 * d] += 0.5 * _crossed(e[:, a], turned_by)
    turn = np.zeros((len(X), len(T), dg.shape[1]))
    return Pairs(g, slip + since.s, n, e, dg, ds, turn, arm, False)


def _crossed(e: Array, turn: Array) -> Array:
    """Products e × θ (k, d), e (k, d), θ (w,)."""
    if e.shape[1] == 3:
        return np.cross(e, turn)
    return np.stack([e[:, 1], -e[:, 0]], axis=1) * turn


@njit(cache=True, error_model="numpy")
def _on_nodes(dim, N, rows, out):
    """Derivatives rows (k, t, d + r) by the motion of a point and of the rest → out (k, t, d a + r) by those of its a nodes."""
    d, a = len(dim), N.shape[1]
    rest = rows.shape[2] - d
    for k in range(rows.shape[0]):
        for t in range(rows.shape[1]):
            for b in range(a):
                for i in range(d):
                    out[k, t, d * b + i] = N[k, b] * rows[k, t, i]
            for r in range(rest):
                out[k, t, d * a + r] = rows[k, t, d + r]


def on_nodes(N: Array, *derivatives: Array) -> Sequence[Array]:
    """Derivatives (k, t, d + r) by the motion of points and of the rest → (k, t, d a + r), of their nodes, N (k, a), of each."""
    a = N.shape[1]
    if a == 1:
        return derivatives
    out = []
    for rows in derivatives:
        d = {5: 2, 9: 3}[rows.shape[2]]
        out.append(np.empty((len(rows), rows.shape[1], rows.shape[2] + d * (a - 1))))
        _on_nodes(DIMENSION[d], N, rows, out[-1])
    return out
