"""Derivatives of what an increment of second order in time begins with: of `J2.begin`, many directions at a time.

With E = ½ ln b_e and D = dev(½ ln b_trial − E) of the committed state, it begins with ½ ln b̃ = E − s D and a plastic strain
ε̃ = ε + s √(⅔ D:D) (see `prensa.kernels.tensor.begin`). Logarithm and exponential of a symmetric tensor are differentiated in its
principal axes: diagonal components go with the derivative of the function, the others with its divided difference
(Daleckiĭ and Kreĭn 1965). Many directions share the matrices of both logarithms and of the exponential at a point; weights go
back through the same maps themselves.
"""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.lanes import WIDE, four_into_rows, into_rows, out_of_rows
from prensa.kernels.series import GROUP, SMALL_EXP, SMALL_LOG, exp_minus_one, half_log, log_slope
from prensa.kernels.tensor import principal
from prensa.materials.j2_finite import _axes

LANES = 8  # directions at a time
PER_BEGUN = 32
"""Numbers a point: slopes (6, and of 33) of the logarithms of b_e and b_trial and of the exponential (7 each), rise of ε̃ by a
change of D (11, 22, 33, 12), share; work by the rise, by the volume, by the plastic strain, by the flow stresses; whether the
increment begins elsewhere than the last one ended, and whether the point flows in it."""
FAR_APART = 0.1  # relative difference of two eigenvalues from which that of their logarithms has all its digits
_MOVED, _FLOWS = 30, 31
SMALL_TENSOR = 0.3 * SMALL_LOG
"""Components of strains up to which those of their axes, and relative differences of these, are within `SMALL_LOG`."""
# rows of points: tensors, whether increments begin elsewhere and flow, what there is of each tensor, weights
_OLD_B, _TRIAL_B, _BEGUN_B = (k * GROUP for k in (0, 4, 8))
_MOVES, _FLOWING, _OF_COMMITTED, _OF_TRIAL, _OF_BEGUN, _MORE = (k * GROUP for k in (12, 13, 14, 24, 34, 40))
_OWED_W, _OWED_END = (k * GROUP for k in (41, 51))
# of `slopes_of_begun`: trace and determinant, flow stresses and slopes where increments begin and as committed, what is found
_LOG_J, _JACOBIAN, _FLOW, _FLOW_SLOPE, _FLOW_WAS, _FLOW_SLOPE_WAS, _SLOPES, _SLOPES_END = (
    k * GROUP for k in (41, 42, 43, 44, 45, 46, 47, 79)
)
# rows of the slopes d1, d2, d12, d3 of what there is of each tensor
_FOUR_OF_LOG, _FOUR_OF_TRIAL, _FOUR_OF_EXP = (
    (_OF_COMMITTED + 6 * GROUP, _OF_COMMITTED + 7 * GROUP, _OF_COMMITTED + 8 * GROUP, _OF_COMMITTED + 9 * GROUP),
    (_OF_TRIAL + 6 * GROUP, _OF_TRIAL + 7 * GROUP, _OF_TRIAL + 8 * GROUP, _OF_TRIAL + 9 * GROUP),
    (_OF_BEGUN + 2 * GROUP, _OF_BEGUN + 3 * GROUP, _OF_BEGUN + 4 * GROUP, _OF_BEGUN + 5 * GROUP),
)


@njit(cache=True, error_model="numpy", forceinline=True)
def _in_axes(c, s, d1, d2, d12, a11, a22, a12):
    """Components 11, 22, 12 of a tensor, those in the axes (c, s) multiplied by d1, d2, d12 there."""
    cc, cs, ss = c * c, c * s, s * s
    p1, p2 = d1 * (cc * a11 + 2.0 * cs * a12 + ss * a22), d2 * (ss * a11 - 2.0 * cs * a12 + cc * a22)
    p12 = d12 * (cs * (a22 - a11) + (cc - ss) * a12)
    return cc * p1 + ss * p2 - 2.0 * cs * p12, ss * p1 + cc * p2 + 2.0 * cs * p12, cs * (p1 - p2) + (cc - ss) * p12


@njit(cache=True, error_model="numpy", forceinline=True)
def _logarithm(b11, b22, b33, b12):
    """½ ln of I + b: components 11, 22, 33, 12, then axes and slopes c, s, d1, d2, d12, d3."""
    l1, l2, c, s = principal(b11, b22, b12)
    e1, e2, d1, d2 = 0.5 * math.log1p(l1), 0.5 * math.log1p(l2), 0.5 / (1.0 + l1), 0.5 / (1.0 + l2)
    apart = 2.0 * d2 * (l1 - l2)
    d12 = d1
    if apart > FAR_APART:
        d12 = (e1 - e2) / (l1 - l2)
    elif apart > 0.0:
        d12 = d2 * math.log1p(apart) / apart
    cc, ss = c * c, s * s
    return (
        cc * e1 + ss * e2, ss * e1 + cc * e2, 0.5 * math.log1p(b33), c * s * (e1 - e2), c, s, d1, d2, d12, 0.5 / (1.0 + b33),
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _exponential(b11, b22, b33, b12):
    """Axes c, s of I + b, and slopes x1, x2, x12, x3 there of exp(2 E) = I + b."""
    l1, l2, c, s = principal(b11, b22, b12)
    x1, x2 = 2.0 * (1.0 + l1), 2.0 * (1.0 + l2)
    apart = (l1 - l2) / (1.0 + l2)
    return c, s, x1, x2, x2 * apart / math.log1p(apart) if apart > 0.0 else x1, 2.0 * (1.0 + b33)


@njit(cache=True, error_model="numpy", forceinline=True)
def _values(M):
    """The numbers M (PER_BEGUN,) of a point that multiply derivatives, as values: see `prensa.elements.q4_directions`."""
    return (
        M[0], M[1], M[2], M[3], M[4], M[5], M[6], M[7], M[8], M[9], M[10], M[11], M[12], M[13], M[14], M[15],
        M[16], M[17], M[18], M[19], M[20], M[21], M[22], M[23], M[24], M[25], M[26], M[27], M[28], M[29],
    )  # fmt: skip


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _sloped(V, k, a11, a22, a33, a12):
    """Components 11, 22, 33, 12 of what slopes from V[k] on make of a tensor (see `_put_slopes`)."""
    return (
        V[k] * a11 + V[k + 1] * a22 + V[k + 2] * a12, V[k + 1] * a11 + V[k + 3] * a22 + V[k + 4] * a12, V[k + 6] * a33,
        0.5 * (V[k + 2] * a11 + V[k + 4] * a22) + V[k + 5] * a12,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def begun_along(M, w, first, stress):
    """Derivatives of a committed history, ten rows from ``first`` in w on → in place, of what the increment begins with.

    M (PER_BEGUN,) of the point. ``stress``: where the row is that says what directions change of the flow stress where the
    increment begins, and of that as committed, together.
    """
    if M[_MOVED] == 0.0:
        for d in range(4 * LANES):
            w[first + 6 * LANES + d] = w[first + d]
        return
    V, flows = _values(M), M[_FLOWS] != 0.0
    for d in range(LANES):
        at = first + d
        h0, h1, h2, h3 = w[at], w[at + LANES], w[at + 2 * LANES], w[at + 3 * LANES]
        h6, h7, h8, h9 = w[at + 6 * LANES], w[at + 7 * LANES], w[at + 8 * LANES], w[at + 9 * LANES]
        strain = w[at + 4 * LANES]
        r11, r22, r33, r12 = _sloped(V, 0, h0, h1, h2, h3)
        q11, q22, q33, q12 = _sloped(V, 7, h6, h7, h8, h9)
        q11, q22, q33, q12 = q11 - r11, q22 - r22, q33 - r33, q12 - r12
        third, share = (q11 + q22 + q33) / 3.0, V[25]
        rise = V[21] * q11 + V[22] * q22 + V[23] * q33 + V[24] * q12
        b0, b1, b2, b3 = _sloped(
            V, 14, r11 - share * (q11 - third), r22 - share * (q22 - third), r33 - share * (q33 - third), r12 - share * q12
        )
        w[at], w[at + LANES], w[at + 2 * LANES], w[at + 3 * LANES] = b0, b1, b2, b3
        w[at + 4 * LANES] = strain + rise
        w[at + 5 * LANES] += V[26] * rise + V[27] * (r11 + r22 + r33) + V[28] * strain + V[29] * w[stress + d]
        # what it would be if nothing flowed goes on from the last commit where something flows
        w[at + 6 * LANES], w[at + 7 * LANES] = h0 if flows else b0, h1 if flows else b1
        w[at + 8 * LANES], w[at + 9 * LANES] = h2 if flows else b2, h3 if flows else b3


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _logarithms(w, tensor, to):
    """Rows of tensors b (11, 22, 33, 12) → of ½ ln of I + b (11, 22, 33, 12), axes and slopes c, s, d1, d2, d12, d3.

    Of small strains: as `_logarithm`, for `GROUP` points.
    """
    for i in range(GROUP):
        n, k = tensor + i, to + i
        l1, l2, c, s = _axes(w[n], w[n + GROUP], w[n + 3 * GROUP])
        e1, e2, b33 = half_log(l1), half_log(l2), w[n + 2 * GROUP]
        d2 = 0.5 / (1.0 + l2)
        w[k], w[k + GROUP] = c * c * e1 + s * s * e2, s * s * e1 + c * c * e2
        w[k + 2 * GROUP], w[k + 3 * GROUP] = half_log(b33), c * s * (e1 - e2)
        w[k + 4 * GROUP], w[k + 5 * GROUP] = c, s
        w[k + 6 * GROUP], w[k + 7 * GROUP] = 0.5 / (1.0 + l1), d2
        w[k + 8 * GROUP], w[k + 9 * GROUP] = d2 * log_slope(2.0 * d2 * (l1 - l2)), 0.5 / (1.0 + b33)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _exponentials(w, tensor, to):
    """Rows of tensors b → of axes c, s of I + b and slopes x1, x2, x12, x3 there, as `_exponential`, of small strains."""
    for i in range(GROUP):
        n, k = tensor + i, to + i
        l1, l2, c, s = _axes(w[n], w[n + GROUP], w[n + 3 * GROUP])
        x2 = 2.0 * (1.0 + l2)
        w[k], w[k + GROUP], w[k + 2 * GROUP], w[k + 3 * GROUP] = c, s, 2.0 * (1.0 + l1), x2
        w[k + 4 * GROUP], w[k + 5 * GROUP] = x2 / log_slope(2.0 * (l1 - l2) / x2), 2.0 * (1.0 + w[n + 2 * GROUP])


@njit(cache=True, error_model="numpy")
def _exactly(w, i):
    """As `_logarithms` and `_exponentials`, of point i and of strains of any size."""
    for tensor, to in ((_OLD_B, _OF_COMMITTED), (_TRIAL_B, _OF_TRIAL)):
        b11, b22, b33, b12 = w[tensor + i], w[tensor + GROUP + i], w[tensor + 2 * GROUP + i], w[tensor + 3 * GROUP + i]
        e11, e22, e33, e12, c, s, d1, d2, d12, d3 = _logarithm(b11, b22, b33, b12)
        k = to + i
        w[k], w[k + GROUP], w[k + 2 * GROUP], w[k + 3 * GROUP], w[k + 4 * GROUP] = e11, e22, e33, e12, c
        w[k + 5 * GROUP], w[k + 6 * GROUP], w[k + 7 * GROUP], w[k + 8 * GROUP], w[k + 9 * GROUP] = s, d1, d2, d12, d3
    k = _BEGUN_B + i
    c, s, x1, x2, x12, x3 = _exponential(w[k], w[k + GROUP], w[k + 2 * GROUP], w[k + 3 * GROUP])
    k = _OF_BEGUN + i
    w[k], w[k + GROUP], w[k + 2 * GROUP], w[k + 3 * GROUP], w[k + 4 * GROUP], w[k + 5 * GROUP] = c, s, x1, x2, x12, x3


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _put_slopes(w, axes, d1, d2, d12, d3, to):
    """Rows of axes c, s and of slopes there → seven rows of `_in_axes` as a matrix, those of 11, 22, 12.

    Its 11, 12, 13, 22, 23, 33 (31, 32: half of 13, 23), and d3.
    """
    for i in range(GROUP):
        c, s = w[axes + i], w[axes + GROUP + i]
        e1, e2, e12, k = w[d1 + i], w[d2 + i], w[d12 + i], to + i
        cc, cs, ss = c * c, c * s, s * s
        w[k], w[k + GROUP] = cc * cc * e1 + ss * ss * e2 + 2.0 * cs * cs * e12, cs * cs * (e1 + e2 - 2.0 * e12)
        w[k + 2 * GROUP] = 2.0 * cs * (cc * (e1 - e12) - ss * (e2 - e12))
        w[k + 3 * GROUP] = ss * ss * e1 + cc * cc * e2 + 2.0 * cs * cs * e12
        w[k + 4 * GROUP] = 2.0 * cs * (ss * (e1 - e12) - cc * (e2 - e12))
        w[k + 5 * GROUP] = 2.0 * cs * cs * (e1 + e2) + (cc - ss) * (cc - ss) * e12
        w[k + 6 * GROUP] = w[d3 + i]


@njit(cache=True, error_model="numpy")
def _tensors(history, begun, new, first, m, w):
    """Of m points from the ``first`` on, histories (e, q, 10) → the rows of tensors, of what there is of each, of flags."""
    far, wide = 0, history.shape[2]
    committed, starts, ends = history.reshape(-1), begun.reshape(-1), new.reshape(-1)
    for i in range(0, m, WIDE):
        at, last = (first + i) * wide, m - 1 - i
        four_into_rows(committed, at, wide, last, w, _OLD_B + i, GROUP)
        four_into_rows(committed, at + 6, wide, last, w, _TRIAL_B + i, GROUP)
        four_into_rows(starts, at, wide, last, w, _BEGUN_B + i, GROUP)
    for i in range(m):
        strain = (first + i) * wide + 4
        w[_MOVES + i] = 1.0 if starts[strain] != committed[strain] else 0.0
        w[_FLOWING + i] = 1.0 if ends[strain] != starts[strain] else 0.0
        w[_MORE + i] = starts[strain] - committed[strain]
    for n in range(_OLD_B, _MOVES):
        far += 1 if abs(w[n]) > SMALL_TENSOR else 0
    _logarithms(w, _OLD_B, _OF_COMMITTED)
    _logarithms(w, _TRIAL_B, _OF_TRIAL)
    _exponentials(w, _BEGUN_B, _OF_BEGUN)
    if far:
        for i in range(m):
            _exactly(w, i)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _apart(w, i):
    """D of point i, by the rows of both logarithms: components 11, 22, 33, 12, and √(⅔ D:D)."""
    a, b = _OF_COMMITTED + i, _OF_TRIAL + i
    D11, D22, D33 = w[b] - w[a], w[b + GROUP] - w[a + GROUP], w[b + 2 * GROUP] - w[a + 2 * GROUP]
    D12, third = w[b + 3 * GROUP] - w[a + 3 * GROUP], (D11 + D22 + D33) / 3.0
    D11, D22, D33 = D11 - third, D22 - third, D33 - third
    return D11, D22, D33, D12, math.sqrt((D11 * D11 + D22 * D22 + D33 * D33 + 2.0 * D12 * D12) / 1.5)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def slopes_of_begun(history, begun, new, share, cauchy, before, after, out):
    """Histories as committed, as an increment begins with them and as it leads to (e, q, 10) → out (e, q, PER_BEGUN).

    ``share`` of the last plastic strain; ``before``, ``after`` (e, q, 3): flow stresses and slopes of the first two, see
    `prensa.materials.j2_finite.stresses_at`; ``cauchy``: they limit the Cauchy stress. `GROUP` points go abreast.
    """
    w, count = np.zeros(_SLOPES_END), history.shape[1]
    points, y0, y1 = out.reshape(-1), before.reshape(-1), after.reshape(-1)
    for first in range(0, history.shape[0] * count, GROUP):
        m = min(GROUP, history.shape[0] * count - first)
        _tensors(history, begun, new, first, m, w)
        for i in range(m):
            n = 3 * (first + i)
            w[_FLOW_WAS + i], w[_FLOW_SLOPE_WAS + i], w[_FLOW + i], w[_FLOW_SLOPE + i] = y0[n], y0[n + 1], y1[n], y1[n + 1]
        _put_slopes(w, _OF_COMMITTED + 4 * GROUP, *_FOUR_OF_LOG, _SLOPES)
        _put_slopes(w, _OF_TRIAL + 4 * GROUP, *_FOUR_OF_TRIAL, _SLOPES + 7 * GROUP)
        _put_slopes(w, _OF_BEGUN, *_FOUR_OF_EXP, _SLOPES + 14 * GROUP)
        for i in range(GROUP):
            a, k = _OF_COMMITTED + i, _SLOPES + 21 * GROUP + i
            D11, D22, D33, D12, size = _apart(w, i)
            rise = share / (1.5 * (size if w[_MOVES + i] != 0.0 else 1.0))
            w[k], w[k + GROUP], w[k + 2 * GROUP] = rise * D11, rise * D22, rise * D33
            w[k + 3 * GROUP], w[k + 4 * GROUP] = 2.0 * rise * D12, share
            w[_LOG_J + i] = w[a] + w[a + GROUP] + w[a + 2 * GROUP]
        far = 0
        for i in range(GROUP):
            far += 1 if abs(w[_LOG_J + i]) > SMALL_EXP else 0
        for i in range(GROUP):
            w[_JACOBIAN + i] = 1.0 + exp_minus_one(w[_LOG_J + i])
        if far:
            for i in range(m):
                w[_JACOBIAN + i] = math.exp(w[_LOG_J + i])
        for i in range(GROUP):
            k, more = _SLOPES + 26 * GROUP + i, w[_MORE + i]
            half = 0.5 * (w[_JACOBIAN + i] if cauchy else 1.0)
            y = w[_FLOW_WAS + i] + w[_FLOW + i]
            w[k], w[k + GROUP] = half * (y + more * w[_FLOW_SLOPE + i]), half * y * more if cauchy else 0.0
            w[k + 2 * GROUP], w[k + 3 * GROUP] = half * more * (w[_FLOW_SLOPE_WAS + i] + w[_FLOW_SLOPE + i]), half * more
            w[k + 4 * GROUP], w[k + 5 * GROUP] = w[_MOVES + i], w[_FLOWING + i]
        for i in range(0, m, WIDE):
            n, last = first + i, m - 1 - i
            for k in range(0, PER_BEGUN, WIDE):
                out_of_rows(points, n * PER_BEGUN + k, PER_BEGUN, last, w, _SLOPES + k * GROUP + i, GROUP)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _owed(w, share):
    """Rows of weights of what an increment begins with → in place, of what was committed, by what `_logarithms` and such left."""
    for i in range(GROUP):
        moved, flows, k = w[_MOVES + i] != 0.0, w[_FLOWING + i] != 0.0, _OWED_W + i
        w0, w1, w2, w3, w4 = w[k], w[k + GROUP], w[k + 2 * GROUP], w[k + 3 * GROUP], w[k + 4 * GROUP]
        t0, t1, t2, t3 = w[k + 6 * GROUP], w[k + 7 * GROUP], w[k + 8 * GROUP], w[k + 9 * GROUP]
        # what it would be if nothing flowed goes on from the last commit where something flows, else from the beginning
        w0, w1 = w0 + (0.0 if flows else t0), w1 + (0.0 if flows else t1)
        w2, w3 = w2 + (0.0 if flows else t2), w3 + (0.0 if flows else t3)
        t0, t1, t2, t3 = t0 if flows else 0.0, t1 if flows else 0.0, t2 if flows else 0.0, t3 if flows else 0.0
        a, b, x = _OF_COMMITTED + i, _OF_TRIAL + i, _OF_BEGUN + i
        D11, D22, D33, D12, size = _apart(w, i)
        along = share / (1.5 * (size if moved else 1.0)) * w4
        g11, g22, g12 = _in_axes(
            w[x], w[x + GROUP], w[x + 2 * GROUP], w[x + 3 * GROUP], w[x + 4 * GROUP], w0, w1, 0.5 * w3
        )  # fmt: skip
        g33 = w[x + 5 * GROUP] * w2
        third = (g11 + g22 + g33) / 3.0
        r11, r22 = along * D11 - share * (g11 - third), along * D22 - share * (g22 - third)
        r33, r12 = along * D33 - share * (g33 - third), along * D12 - share * g12
        v6, v7, v9 = _in_axes(
            w[b + 4 * GROUP], w[b + 5 * GROUP], w[b + 6 * GROUP], w[b + 7 * GROUP], w[b + 8 * GROUP], r11, r22, r12
        )
        v0, v1, v3 = _in_axes(
            w[a + 4 * GROUP], w[a + 5 * GROUP], w[a + 6 * GROUP], w[a + 7 * GROUP], w[a + 8 * GROUP],
            g11 - r11, g22 - r22, g12 - r12,
        )  # fmt: skip
        v2, v8 = w[a + 9 * GROUP] * (g33 - r33), w[b + 9 * GROUP] * r33
        w[k], w[k + GROUP] = (v0 if moved else w0) + t0, (v1 if moved else w1) + t1
        w[k + 2 * GROUP], w[k + 3 * GROUP] = (v2 if moved else w2) + t2, (2.0 * v3 if moved else w3) + t3
        w[k + 5 * GROUP], w[k + 6 * GROUP], w[k + 7 * GROUP] = 0.0, v6 if moved else 0.0, v7 if moved else 0.0
        w[k + 8 * GROUP], w[k + 9 * GROUP] = v8 if moved else 0.0, 2.0 * v9 if moved else 0.0


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def begun_owed(history, begun, new, share, weights):
    """Weights (m, e, q, 10) of what an increment begins with → in place, those of the committed histories; work has none.

    Histories (e, q, 10) and ``share`` as for `slopes_of_begun`. In a tensor's axes weights go as tensors do if those of its
    shear, which stands for two components, are halved. `GROUP` points go abreast.
    """
    w, count, flat = np.zeros(_OWED_END), history.shape[1], weights.reshape(-1)
    for first in range(0, history.shape[0] * count, GROUP):
        m = min(GROUP, history.shape[0] * count - first)
        _tensors(history, begun, new, first, m, w)
        for d in range(weights.shape[0]):
            own = (d * history.shape[0] * count + first) * 10
            for i in range(0, m, WIDE):
                into_rows(flat, own + 10 * i, 10, m - 1 - i, w, _OWED_W + i, GROUP)
                into_rows(flat, own + 10 * i + 2, 10, m - 1 - i, w, _OWED_W + 2 * GROUP + i, GROUP)
            _owed(w, share)
            for i in range(0, m, WIDE):
                out_of_rows(flat, own + 10 * i, 10, m - 1 - i, w, _OWED_W + i, GROUP)
                out_of_rows(flat, own + 10 * i + 2, 10, m - 1 - i, w, _OWED_W + 2 * GROUP + i, GROUP)
