"""Derivatives of what an increment of second order in time begins with: of `J2.begin`, many directions at a time.

With E = ½ ln b_e and D = dev(½ ln b_trial − E) of the committed state, it begins with ½ ln b̃ = E − s D and a plastic strain
ε̃ = ε + s √(⅔ D:D) (see `prensa.kernels.tensor.begin`). Logarithm and exponential of a symmetric tensor are differentiated in its
principal axes: diagonal components go with the derivative of the function, the others with its divided difference
(Daleckiĭ and Kreĭn 1965). Many directions share the matrices of both logarithms and of the exponential at a point; weights go
back through the same maps themselves.
"""

from __future__ import annotations

import math

from prensa.kernels.compiled import njit
from prensa.kernels.tensor import principal

LANES = 8  # directions at a time
PER_BEGUN = 32
"""Numbers a point: slopes (6, and of 33) of the logarithms of b_e and b_trial and of the exponential (7 each), rise of ε̃ by a
change of D (11, 22, 33, 12), share; work by the rise, by the volume, by the plastic strain, by the flow stresses; whether the
increment begins elsewhere than the last one ended, and whether the point flows in it."""
FAR_APART = 0.1  # relative difference of two eigenvalues from which that of their logarithms has all its digits
_MOVED, _FLOWS = 30, 31


@njit(cache=True, error_model="numpy", forceinline=True)
def _in_axes(c, s, d1, d2, d12, a11, a22, a12):
    """Components 11, 22, 12 of a tensor, those in the axes (c, s) multiplied by d1, d2, d12 there."""
    cc, cs, ss = c * c, c * s, s * s
    p1, p2 = d1 * (cc * a11 + 2.0 * cs * a12 + ss * a22), d2 * (ss * a11 - 2.0 * cs * a12 + cc * a22)
    p12 = d12 * (cs * (a22 - a11) + (cc - ss) * a12)
    return cc * p1 + ss * p2 - 2.0 * cs * p12, ss * p1 + cc * p2 + 2.0 * cs * p12, cs * (p1 - p2) + (cc - ss) * p12


@njit(cache=True, error_model="numpy", forceinline=True)
def _put_slopes(c, s, d1, d2, d12, d3, M, k):
    """`_in_axes` as a matrix, rows 11, 22, 12 → its 11, 12, 13, 22, 23, 33 (31, 32: half of 13, 23) and d3, from M[k] on."""
    cc, cs, ss = c * c, c * s, s * s
    M[k], M[k + 1] = cc * cc * d1 + ss * ss * d2 + 2.0 * cs * cs * d12, cs * cs * (d1 + d2 - 2.0 * d12)
    M[k + 2] = 2.0 * cs * (cc * (d1 - d12) - ss * (d2 - d12))
    M[k + 3] = ss * ss * d1 + cc * cc * d2 + 2.0 * cs * cs * d12
    M[k + 4] = 2.0 * cs * (ss * (d1 - d12) - cc * (d2 - d12))
    M[k + 5], M[k + 6] = 2.0 * cs * cs * (d1 + d2) + (cc - ss) * (cc - ss) * d12, d3


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


@njit(cache=True, error_model="numpy")
def slopes_of_begun(history, begun, new, share, cauchy, before, after, out):
    """Histories as committed, as an increment begins with them and as it leads to (e, q, 10) → out (e, q, PER_BEGUN).

    ``share`` of the last plastic strain; ``before``, ``after`` (e, q, 3): flow stresses and slopes of the first two, see
    `prensa.materials.j2_finite.stresses_at`; ``cauchy``: they limit the Cauchy stress.
    """
    for e in range(history.shape[0]):
        for q in range(history.shape[1]):
            h, M = history[e, q], out[e, q]
            M[_FLOWS] = 1.0 if new[e, q, 4] != begun[e, q, 4] else 0.0
            more = begun[e, q, 4] - h[4]
            M[_MOVED] = 1.0 if more != 0.0 else 0.0
            if more == 0.0:
                continue
            e11, e22, e33, e12, c, s, d1, d2, d12, d3 = _logarithm(h[0], h[1], h[2], h[3])
            t11, t22, t33, t12, ct, st, u1, u2, u12, u3 = _logarithm(h[6], h[7], h[8], h[9])
            D11, D22, D33, D12 = t11 - e11, t22 - e22, t33 - e33, t12 - e12
            third = (D11 + D22 + D33) / 3.0
            D11, D22, D33 = D11 - third, D22 - third, D33 - third
            rise = share / (1.5 * math.sqrt((D11 * D11 + D22 * D22 + D33 * D33 + 2.0 * D12 * D12) / 1.5))
            jac = math.exp(e11 + e22 + e33) if cauchy else 1.0
            y0, dy0, y1, dy1 = before[e, q, 0], before[e, q, 1], after[e, q, 0], after[e, q, 1]
            _put_slopes(c, s, d1, d2, d12, d3, M, 0)
            _put_slopes(ct, st, u1, u2, u12, u3, M, 7)
            cb, sb, x1, x2, x12, x3 = _exponential(begun[e, q, 0], begun[e, q, 1], begun[e, q, 2], begun[e, q, 3])
            _put_slopes(cb, sb, x1, x2, x12, x3, M, 14)
            M[21], M[22], M[23], M[24], M[25] = rise * D11, rise * D22, rise * D33, 2.0 * rise * D12, share
            M[26] = 0.5 * jac * (y0 + y1 + more * dy1)
            M[27] = 0.5 * jac * (y0 + y1) * more if cauchy else 0.0
            M[28], M[29] = 0.5 * jac * more * (dy0 + dy1), 0.5 * jac * more


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


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def begun_owed(history, begun, new, share, weights):
    """Weights (m, e, q, 10) of what an increment begins with → in place, those of the committed histories; work has none.

    Histories (e, q, 10) and ``share`` as for `slopes_of_begun`. In a tensor's axes weights go as tensors do if those of its
    shear, which stands for two components, are halved.
    """
    for e in range(history.shape[0]):
        for q in range(history.shape[1]):
            h, b = history[e, q], begun[e, q]
            moved, flows = b[4] != h[4], new[e, q, 4] != b[4]
            if moved:
                e11, e22, e33, e12, c, s, d1, d2, d12, d3 = _logarithm(h[0], h[1], h[2], h[3])
                t11, t22, t33, t12, ct, st, u1, u2, u12, u3 = _logarithm(h[6], h[7], h[8], h[9])
                D11, D22, D33, D12 = t11 - e11, t22 - e22, t33 - e33, t12 - e12
                third = (D11 + D22 + D33) / 3.0
                D11, D22, D33 = D11 - third, D22 - third, D33 - third
                rise = share / (1.5 * math.sqrt((D11 * D11 + D22 * D22 + D33 * D33 + 2.0 * D12 * D12) / 1.5))
                cb, sb, x1, x2, x12, x3 = _exponential(b[0], b[1], b[2], b[3])
            for m in range(weights.shape[0]):
                w = weights[m, e, q]
                t0, t1, t2, t3 = w[6], w[7], w[8], w[9]
                w[5] = w[6] = w[7] = w[8] = w[9] = 0.0
                if not flows:
                    w[0], w[1], w[2], w[3] = w[0] + t0, w[1] + t1, w[2] + t2, w[3] + t3
                    t0 = t1 = t2 = t3 = 0.0
                if moved:
                    g11, g22, g12 = _in_axes(cb, sb, x1, x2, x12, w[0], w[1], 0.5 * w[3])
                    g33, along = x3 * w[2], rise * w[4]
                    third = (g11 + g22 + g33) / 3.0
                    r11, r22 = along * D11 - share * (g11 - third), along * D22 - share * (g22 - third)
                    r33, r12 = along * D33 - share * (g33 - third), along * D12 - share * g12
                    w[6], w[7], half = _in_axes(ct, st, u1, u2, u12, r11, r22, r12)
                    w[8], w[9] = u3 * r33, 2.0 * half
                    w[0], w[1], half = _in_axes(c, s, d1, d2, d12, g11 - r11, g22 - r22, g12 - r12)
                    w[2], w[3] = d3 * (g33 - r33), 2.0 * half
                w[0], w[1], w[2], w[3] = w[0] + t0, w[1] + t1, w[2] + t2, w[3] + t3
