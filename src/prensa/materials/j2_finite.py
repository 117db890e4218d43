"""J2 plasticity of finite strain in the plane, from displacement gradients to stresses and tangents in one kernel.

What `prensa.kernels.tensor` and `prensa.materials.j2` do one after the other, for a few points at a time, whose numbers stay in
the nearest cache. But for the return map no pass over them has a branch or a function of a library, so that a compiler answers
for as many points at once as the processor has lanes: logarithms and exponentials of small strains are polynomials, large ones
are put right point by point.
"""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.tensor import det_minus_one, push_forward
from prensa.materials.hardening import JOHNSON_COOK, TINY, flow_stress
from prensa.materials.j2 import ON_SURFACE, _converged, _return, _start, _steps

GROUP = 64
"""Points at a time: their scratch is half of the nearest cache."""
# rows of the scratch: what was committed, the trial state in its principal axes, the answer
_O, _T, _A0, _WORK, _C, _B, _JN, _E, _Q, _JAC, _DELTA, _Y0, _Y, _DY = 0, 4, 8, 9, 10, 12, 15, 16, 19, 20, 21, 22, 23, 24
_DDY, _START, _NEW, _KEPT, _P, _H, _A, _ROWS = 25, 26, 27, 31, 35, 40, 45, 70
LEAST = 1e-300
SMALL_LOG, SMALL_EXP = 0.15, 0.12  # up to which the polynomials are right to the last digit


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _half_log(x):
    """½ ln(1 + x) of |x| up to `SMALL_LOG`: artanh of x/(2 + x)."""
    z = x / (2.0 + x)
    s = z * z
    tail = 1.0 / 3.0 + s * (1.0 / 5.0 + s * (1.0 / 7.0 + s * (1.0 / 9.0 + s * (1.0 / 11.0 + s * (1.0 / 13.0)))))
    return z + z * s * tail


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _exp_minus_one(x):
    """exp(x) − 1 of |x| up to `SMALL_EXP`."""
    tail = 1.0 / 40320.0 + x * (1.0 / 362880.0 + x * (1.0 / 3628800.0))
    tail = 1.0 / 24.0 + x * (1.0 / 120.0 + x * (1.0 / 720.0 + x * (1.0 / 5040.0 + x * tail)))
    return x + x * x * (0.5 + x * (1.0 / 6.0 + x * tail))


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _trial(m, w, cauchy, G):
    """Gradients of m points and committed tensors → trial strains, axes, q, J and J_n, NaN where f is no motion."""
    far = 0
    for i in range(m):
        h11, h12, h21 = w[_H * GROUP + i], w[(_H + 1) * GROUP + i], w[(_H + 2) * GROUP + i]
        h22, h33 = w[(_H + 3) * GROUP + i], w[(_H + 4) * GROUP + i]
        o11, o22, o33, o12 = w[i], w[GROUP + i], w[2 * GROUP + i], w[3 * GROUP + i]
        b11, b22, b33, b12 = push_forward(h11, h12, h21, h22, h33, o11, o22, o33, o12)
        half = 0.5 * (b11 - b22)
        r = math.sqrt(half * half + b12 * b12)
        share, over = (abs(half) / r, r) if r > 0.0 else (1.0, 1.0)
        large = math.sqrt(0.5 * (1.0 + share))
        less = b12 / (2.0 * over * large)
        up = half >= 0.0
        l1, l2 = 0.5 * (b11 + b22) + r, 0.5 * (b11 + b22) - r
        jac = det_minus_one(h11, h12, h21, h22, h33)
        good = (jac > -1.0) & (1.0 + h33 > 0.0) & (l2 > -1.0) & (b33 > -1.0)
        l1, l2, b33 = l1 if good else 0.0, l2 if good else 0.0, b33 if good else 0.0
        w[_C * GROUP + i] = large if up else abs(less)
        w[(_C + 1) * GROUP + i] = less if up else math.copysign(large, b12)
        w[_B * GROUP + i], w[(_B + 1) * GROUP + i], w[(_B + 2) * GROUP + i] = l1, l2, b33
        w[_JN * GROUP + i] = math.sqrt(((1.0 + o11) * (1.0 + o22) - o12 * o12) * (1.0 + o33)) if good else math.nan
        far += 1 if (l1 > SMALL_LOG) | (l2 < -SMALL_LOG) | (abs(b33) > SMALL_LOG) else 0
    for n in range(3 * GROUP):
        w[_E * GROUP + n] = _half_log(w[_B * GROUP + n])
    if far:
        for i in range(m):
            for k in range(3):
                w[(_E + k) * GROUP + i] = 0.5 * math.log1p(w[(_B + k) * GROUP + i])
    for i in range(m):
        e0, e1, e2 = w[_E * GROUP + i], w[(_E + 1) * GROUP + i], w[(_E + 2) * GROUP + i]
        third = (e0 + e1 + e2) / 3.0
        e0, e1, e2 = e0 - third, e1 - third, e2 - third
        w[_Q * GROUP + i] = 2.0 * G * math.sqrt(1.5 * (e0 * e0 + e1 * e1 + e2 * e2))
        J = math.sqrt((1.0 + w[_B * GROUP + i]) * (1.0 + w[(_B + 1) * GROUP + i]) * (1.0 + w[(_B + 2) * GROUP + i]))
        w[_JAC * GROUP + i] = J if cauchy else 1.0


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _flow(m, w, G, kind, p, knots, coefs, dt, todo, held, first):
    """Plastic strain of each point, σ_y where it begins and ends, and its slope there, as in `prensa.materials.j2._roots`.

    Nearly all points need one step from their start, which is taken for all of them at once; others go on in `_return`.
    """
    for i in range(m):
        w[_Y0 * GROUP + i], w[_DY * GROUP + i], w[_DDY * GROUP + i] = flow_stress(
            kind, p, knots, coefs, w[_A0 * GROUP + i], 0.0, dt
        )
    for i in range(m):
        q, jac, y0 = w[_Q * GROUP + i], w[_JAC * GROUP + i], w[_Y0 * GROUP + i]
        f = q - jac * y0
        w[_Y * GROUP + i] = y0
        start = _start(f, 3.0 * G, jac * w[_DY * GROUP + i], jac * w[_DDY * GROUP + i])
        w[_START * GROUP + i] = start
        w[_DELTA * GROUP + i] = start if f > ON_SURFACE * q else 0.0
    if len(held):
        for i in range(m):
            w[_DELTA * GROUP + i] = w[_START * GROUP + i] if held[first + i] else 0.0
    for i in range(m):
        x = w[_DELTA * GROUP + i]
        if x != 0.0:
            w[_Y * GROUP + i], w[_DY * GROUP + i], w[_DDY * GROUP + i] = flow_stress(
                kind, p, knots, coefs, w[_A0 * GROUP + i] + x, x, dt
            )
    left, smooth = 0, kind < JOHNSON_COOK
    for i in range(m):
        x, q, jac = w[_DELTA * GROUP + i], w[_Q * GROUP + i], w[_JAC * GROUP + i]
        s, ds, dds = w[_Y * GROUP + i], w[_DY * GROUP + i], w[_DDY * GROUP + i]
        newton, step = _steps(q - 3.0 * G * x - jac * s, 3.0 * G + jac * ds, jac * dds)
        done = _converged(x, newton, step, q, jac * ds, jac * dds, smooth & (w[_A0 * GROUP + i] > TINY))
        flows = x != 0.0
        left += 1 if flows & (not done) else 0
        w[_START * GROUP + i] = math.nan if flows & (not done) else x
        step = step if flows & done else 0.0
        w[_DELTA * GROUP + i] = x + step
        w[_Y * GROUP + i], w[_DY * GROUP + i] = s + (ds + 0.5 * dds * step) * step, ds + dds * step
    if left:
        left = 0
        for i in range(m):
            if math.isnan(w[_START * GROUP + i]):
                todo[left] = i
                left += 1
        _return(
            todo, left, w[_Q * GROUP : _Q * GROUP + m], w[_JAC * GROUP : _JAC * GROUP + m], G, kind, p, knots, coefs,
            w[_A0 * GROUP : _A0 * GROUP + m], dt, w[_DELTA * GROUP : _DELTA * GROUP + m], w[_Y * GROUP : _Y * GROUP + m],
            w[_DY * GROUP : _DY * GROUP + m],
        )  # fmt: skip


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _stresses(m, w, K, G, cauchy):
    """Trial strains and plastic strains of m points → elastic tensors, plastic strain and work, P."""
    far = 0
    for i in range(m):
        delta, q = w[_DELTA * GROUP + i], w[_Q * GROUP + i]
        e0, e1, e2 = w[_E * GROUP + i], w[(_E + 1) * GROUP + i], w[(_E + 2) * GROUP + i]
        third, less = (e0 + e1 + e2) / 3.0, 3.0 * G * delta / (q if q > LEAST else LEAST)
        x0, x1, x2 = 2.0 * (e0 - less * (e0 - third)), 2.0 * (e1 - less * (e1 - third)), 2.0 * (e2 - less * (e2 - third))
        w[_NEW * GROUP + i], w[(_NEW + 1) * GROUP + i], w[(_NEW + 2) * GROUP + i] = x0, x1, x2
        far += 1 if (abs(x0) > SMALL_EXP) | (abs(x1) > SMALL_EXP) | (abs(x2) > SMALL_EXP) else 0
    if not far:
        for n in range(3 * GROUP):
            w[_NEW * GROUP + n] = _exp_minus_one(w[_NEW * GROUP + n])
    else:
        for i in range(m):
            for k in range(3):
                w[(_NEW + k) * GROUP + i] = math.expm1(w[(_NEW + k) * GROUP + i])
    for i in range(m):
        h11, h12, h21 = w[_H * GROUP + i], w[(_H + 1) * GROUP + i], w[(_H + 2) * GROUP + i]
        h22, h33 = w[(_H + 3) * GROUP + i], w[(_H + 4) * GROUP + i]
        delta, q, jac, jn = w[_DELTA * GROUP + i], w[_Q * GROUP + i], w[_JAC * GROUP + i], w[_JN * GROUP + i]
        c, s = w[_C * GROUP + i], w[(_C + 1) * GROUP + i]
        b1, b2, b3 = w[_NEW * GROUP + i], w[(_NEW + 1) * GROUP + i], w[(_NEW + 2) * GROUP + i]
        n11, n22, n12 = c * c * b1 + s * s * b2, s * s * b1 + c * c * b2, c * s * (b1 - b2)
        w[_NEW * GROUP + i], w[(_NEW + 1) * GROUP + i], w[(_NEW + 3) * GROUP + i] = n11, n22, n12
        o11, o22, o33, o12 = w[_T * GROUP + i], w[(_T + 1) * GROUP + i], w[(_T + 2) * GROUP + i], w[(_T + 3) * GROUP + i]
        k11, k22, k33, k12 = push_forward(h11, h12, h21, h22, h33, o11, o22, o33, o12)
        flows = delta != 0.0
        w[_KEPT * GROUP + i], w[(_KEPT + 1) * GROUP + i] = k11 if flows else n11, k22 if flows else n22
        w[(_KEPT + 2) * GROUP + i], w[(_KEPT + 3) * GROUP + i] = k33 if flows else b3, k12 if flows else n12
        theta = 1.0 - 3.0 * G * delta / (q if q > LEAST else LEAST)
        e0, e1, e2 = w[_E * GROUP + i], w[(_E + 1) * GROUP + i], w[(_E + 2) * GROUP + i]
        tr = e0 + e1 + e2
        shear, mean = 2.0 * G * theta, K * tr - 2.0 * G * theta * tr / 3.0
        over = 1.0 / (jn * ((1.0 + h11) * (1.0 + h22) - h12 * h21))
        t1, t2, t3 = shear * e0 + mean, shear * e1 + mean, shear * e2 + mean
        # τ f⁻ᵀ / J_n of the plane, τ in the axes of space
        t11, t22, t12 = c * c * t1 + s * s * t2, s * s * t1 + c * c * t2, c * s * (t1 - t2)
        w[_P * GROUP + i] = over * (t11 * (1.0 + h22) - t12 * h12)
        w[(_P + 1) * GROUP + i] = over * (t12 * (1.0 + h11) - t11 * h21)
        w[(_P + 2) * GROUP + i] = over * (t12 * (1.0 + h22) - t22 * h12)
        w[(_P + 3) * GROUP + i] = over * (t22 * (1.0 + h11) - t12 * h21)
        w[(_P + 4) * GROUP + i] = t3 / (jn * (1.0 + h33))
        before = jn if cauchy else 1.0
        w[_WORK * GROUP + i] += 0.5 * (before * w[_Y0 * GROUP + i] + jac * w[_Y * GROUP + i]) * delta
        w[_A0 * GROUP + i] += delta


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _row_of_tangent(w, i, k, r0, r1, r2, r3, p1, p2, p3, p4, q1, q2, q3, q4, M):
    """Row k of A, of the row r of R, and the entry k of its last row; M: 00, 03, 30, 33, 11, 12, 21, 22, 04, 34, 40, 43."""
    m00, m03, m30, m33, m11, m12, m21, m22, m04, m34, m40, m43 = M
    w0, w1, w2, w3 = r0 * m00 + r3 * m30, r1 * m11 + r2 * m21, r1 * m12 + r2 * m22, r0 * m03 + r3 * m33
    a = (_A + 5 * k) * GROUP + i
    w[a] = w0 * p1 + w1 * p2 - w2 * q1 - w3 * q2
    w[a + GROUP] = w0 * p3 + w1 * p4 - w2 * q3 - w3 * q4
    w[a + 2 * GROUP] = w0 * q1 + w1 * q2 + w2 * p1 + w3 * p2
    w[a + 3 * GROUP] = w0 * q3 + w1 * q4 + w2 * p3 + w3 * p4
    w[a + 4 * GROUP] = r0 * m04 + r3 * m34
    w[(_A + 20 + k) * GROUP + i] = r0 * m40 + r3 * m43


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _tangents(m, w, K, G, cauchy, secant):
    """∂P/∂f of m points; formulas as in `prensa.materials.j2` and `prensa.kernels.tensor`."""
    for i in range(m):
        h11, h12, h21 = w[_H * GROUP + i], w[(_H + 1) * GROUP + i], w[(_H + 2) * GROUP + i]
        h22, h33 = w[(_H + 3) * GROUP + i], w[(_H + 4) * GROUP + i]
        delta, q, jac, y1 = w[_DELTA * GROUP + i], w[_Q * GROUP + i], w[_JAC * GROUP + i], w[_Y * GROUP + i]
        c, s = w[_C * GROUP + i], w[(_C + 1) * GROUP + i]
        l1, l2 = w[_B * GROUP + i], w[(_B + 1) * GROUP + i]
        e0, e1, e2 = w[_E * GROUP + i], w[(_E + 1) * GROUP + i], w[(_E + 2) * GROUP + i]
        tr, inverse = e0 + e1 + e2, 1.0 / (q if q > LEAST else LEAST)
        unit = 3.0 * G * inverse
        share, unit = delta * inverse, unit if delta != 0.0 else 0.0
        theta = 1.0 - 3.0 * G * share
        n0, n1, n2 = unit * (e0 - tr / 3.0), unit * (e1 - tr / 3.0), unit * (e2 - tr / 3.0)
        t1, t2 = K * tr + 2.0 * G * theta * (e0 - tr / 3.0), K * tr + 2.0 * G * theta * (e1 - tr / 3.0)
        t3 = K * tr + 2.0 * G * theta * (e2 - tr / 3.0)
        # ds = θ ds_tr − 3G (dΔ/q − Δ dq/q²) s_tr,  dq = 2G n·dε,  dΔ = (dq − J σ_y tr dε)/(3G + J σ_y′)
        soft = 1.0 / (3.0 * G + jac * w[_DY * GROUP + i])
        volume = jac * y1 if cauchy else 0.0
        part = (1.0 - secant) * 2.0 * G
        dq0, dq1, dq2 = 2.0 * G * n0, 2.0 * G * n1, 2.0 * G * n2
        g0, g1 = part * ((dq0 - volume) * soft - share * dq0), part * ((dq1 - volume) * soft - share * dq1)
        g2 = part * ((dq2 - volume) * soft - share * dq2)
        off, on = K - 2.0 * G * theta / 3.0, K + 4.0 * G * theta / 3.0
        d00, d01, d02 = on - n0 * g0, off - n0 * g1, off - n0 * g2
        d10, d11, d12 = off - n1 * g0, on - n1 * g1, off - n1 * g2
        d20, d21, d22 = off - n2 * g0, off - n2 * g1, on - n2 * g2
        b1, b2 = 1.0 + l1, 1.0 + l2
        alike = abs(l1 - l2) <= 1e-7 * (abs(l1) + abs(l2)) + 1e-14
        limit, apart = (d00 - d01) / (2.0 * b1), (t1 - t2) / (1.0 if alike else l1 - l2)
        sh = limit if alike else apart
        jn, g33 = 1.0 / w[_JN * GROUP + i], 1.0 / (1.0 + h33)
        M = (
            jn * (d00 - t1), jn * d01, jn * d10, jn * (d11 - t2),
            jn * sh * b2, jn * (sh * b1 - t1), jn * (sh * b2 - t2), jn * sh * b1,
            jn * g33 * d02, jn * g33 * d12, jn * g33 * d20, jn * g33 * d21,
        )  # fmt: skip
        inverse = 1.0 / ((1.0 + h11) * (1.0 + h22) - h12 * h21)
        f11, f12, f21, f22 = (1.0 + h22) * inverse, -h12 * inverse, -h21 * inverse, (1.0 + h11) * inverse
        T11, T12, T21, T22 = f11 * c + f12 * s, -f11 * s + f12 * c, f21 * c + f22 * s, -f21 * s + f22 * c
        # R[(iJ)][(ab)] = Q_ia T_Jb, rows and columns 11, 12, 21, 22
        p1, p2, p3, p4 = c * T11, c * T12, c * T21, c * T22
        q1, q2, q3, q4 = s * T11, s * T12, s * T21, s * T22
        _row_of_tangent(w, i, 0, p1, p2, -q1, -q2, p1, p2, p3, p4, q1, q2, q3, q4, M)
        _row_of_tangent(w, i, 1, p3, p4, -q3, -q4, p1, p2, p3, p4, q1, q2, q3, q4, M)
        _row_of_tangent(w, i, 2, q1, q2, p1, p2, p1, p2, p3, p4, q1, q2, q3, q4, M)
        _row_of_tangent(w, i, 3, q3, q4, p3, p4, p1, p2, p3, p4, q1, q2, q3, q4, M)
        w[(_A + 24) * GROUP + i] = jn * g33 * g33 * (d22 - t3)


@njit(cache=True, error_model="numpy")
def j2_finite(
    h, old, kept, K, G, cauchy, kind, p, knots, coefs, dt, P, A, new, failed, tangent, held, secant
):  # fmt: skip
    """Gradients h (n, 5) = f − I, old (n, ≥10) → P (n, 5), A (n, 25) if ``tangent``, new (n, ≥10), failed (n,).

    Histories as in `prensa.materials.laws.J2`; ``kept``: first column of the tensor in old that goes on as if nothing flowed.
    All else as in `prensa.materials.j2.j2`.
    """
    curve = (p[0], p[1], p[2], p[3], p[4])
    w, todo = np.zeros(_ROWS * GROUP), np.empty(GROUP, dtype=np.int64)
    for first in range(0, old.shape[0], GROUP):
        m = min(GROUP, old.shape[0] - first)
        for i in range(m):
            for k in range(4):
                w[(_O + k) * GROUP + i], w[(_T + k) * GROUP + i] = old[first + i, k], old[first + i, kept + k]
            w[_A0 * GROUP + i], w[_WORK * GROUP + i] = old[first + i, 4], old[first + i, 5]
            for k in range(5):
                w[(_H + k) * GROUP + i] = h[first + i, k]
        _trial(m, w, cauchy, G)
        _flow(m, w, G, kind, curve, knots, coefs, dt, todo, held, first)
        for i in range(m):
            if math.isnan(w[_DELTA * GROUP + i]) or math.isnan(w[_JN * GROUP + i]):
                failed[first + i] = True
                w[_DELTA * GROUP + i] = 0.0
        _stresses(m, w, K, G, cauchy)
        if tangent:
            _tangents(m, w, K, G, cauchy, secant)
        for i in range(m):
            for k in range(4):
                new[first + i, k], new[first + i, 6 + k] = w[(_NEW + k) * GROUP + i], w[(_KEPT + k) * GROUP + i]
            new[first + i, 4], new[first + i, 5] = w[_A0 * GROUP + i], w[_WORK * GROUP + i]
            for k in range(5):
                P[first + i, k] = w[(_P + k) * GROUP + i]
        if tangent:
            for i in range(m):
                for k in range(25):
                    A[first + i, k] = w[(_A + k) * GROUP + i]
