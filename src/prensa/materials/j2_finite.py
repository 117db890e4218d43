"""J2 plasticity of finite strain in the plane, from displacement gradients to stresses and tangents in one kernel.

What `prensa.kernels.tensor` and `prensa.materials.j2` do one after the other, for a few points at a time, whose numbers stay in
the nearest cache. But for the return map no pass over them has a branch or a function of a library, so that a compiler answers
for as many points at once as the processor has lanes: logarithms and exponentials of small strains are polynomials, large ones
are put right point by point; powers of Ludwik's and Swift's curves are written out.
"""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.lanes import (
    EIGHTS_OF_25,
    WIDE,
    five_into_rows,
    five_out_of_rows,
    four_into_rows,
    into_rows,
    out_of_rows,
    to_be_read,
    to_be_written,
)
from prensa.kernels.series import GROUP, SMALL_EXP, SMALL_LOG, artanh, exp_minus_one
from prensa.kernels.tensor import det_minus_one, push_forward
from prensa.materials.hardening import JOHNSON_COOK, LUDWIK, SWIFT, TINY, flow_gradient, flow_stress, slope_before
from prensa.materials.j2 import ON_SURFACE, ROOT_STEPS, _converged, _start, _steps

# where the rows of the scratch begin: what was committed, the trial state in its principal axes, the answer (a sum for each would
# take a third of the time in which the kernel is compiled)
_O, _O1, _O2, _O3, _A0, _WORK, _T, _T1, _T2, _T3, _C, _C1, _B, _B1, _B2, _JN = range(0, 16 * GROUP, GROUP)
_E, _E1, _E2, _Q, _JAC, _DELTA, _Y0, _Y, _SLOPE, _CURVATURE, _START = range(16 * GROUP, 27 * GROUP, GROUP)
_P, _P1, _P2, _P3, _P4, _H, _H1, _H2, _H3, _H4, _LOW = range(27 * GROUP, 38 * GROUP, GROUP)
_A, _A24, _ROWS = 38 * GROUP, 62 * GROUP, 63 * GROUP
# the history afterwards takes the place of that before, column by column
_NEW, _NEW1, _NEW2, _NEW3, _KEPT, _KEPT1, _KEPT2, _KEPT3 = _O, _O1, _O2, _O3, _T, _T1, _T2, _T3
# of the search for plastic strains, in rows that the answer takes afterwards: whether it goes on, between what, what was found
_OPEN, _HIGH, _FOUND, _FOUND_Y, _FOUND_SLOPE = _P, _P1, _P2, _P3, _P4
# of the answer, in rows that are read no more: 1/q, 3GΔ/q; 1 over det and 33 of the plane's f, 1/J_n
_BY_Q, _LESS, _BY_F, _BY_F33, _BY_JN = _CURVATURE, _START, _Y0, _LOW, _JN
NO_STRESS, NO_DIFFERENCE, _THIRD = 1e-300, 1e-150, 1.0 / 3.0
# of powers: what numbers and exponents of e have to be; ln 2 in two parts; what rounds to whole numbers when it is added, as bits
# too; bits of ½√2; how many bits a mantissa has and what is added to exponents
_NORMAL, _FINITE, _EXPONENT, _LN2, _LN2_REST = 1e-300, 1e300, 700.0, 0.69314718036912381649, 1.9082149292705877e-10
_WHOLE, _WHOLE_BITS, _ROOT, _MANTISSA, _BIAS = 6755399441055744.0, 0x4338000000000000, 0x3FE6A09E667F3BCD, 52, 1023


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _axes(b11, b22, b12):
    """As `prensa.kernels.tensor.principal`, without a branch."""
    half = 0.5 * (b11 - b22)
    r = math.sqrt(half * half + b12 * b12)
    # the larger of cos and sin is √((r + |half|)/2r), the other b12 over 2r times that
    apart = r > NO_DIFFERENCE
    sum_ = r + abs(half) if apart else 1.0
    over = 1.0 / math.sqrt(2.0 * (r if apart else 0.5) * sum_)
    large, less = sum_ * over, b12 * over if apart else 0.0
    up = half >= 0.0
    c, s = large if up else abs(less), less if up else math.copysign(large, b12)
    return 0.5 * (b11 + b22) + r, 0.5 * (b11 + b22) - r, c, s


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _logarithmic_strains(w, m, far):
    """½ ln(1 + b) of the principal b of `_B` → `_E`, those of the first m points by the library if some are ``far`` from 0."""
    for i in range(GROUP):
        x0, x1, x2 = w[_B + i], w[_B1 + i], w[_B2 + i]
        d0, d1, d2 = 2.0 + x0, 2.0 + x1, 2.0 + x2
        inverse = 1.0 / (d0 * d1 * d2)  # divisions are what takes longest here: one does for three
        w[_E + i], w[_E1 + i] = artanh(x0 * (d1 * d2 * inverse)), artanh(x1 * (d0 * d2 * inverse))
        w[_E2 + i] = artanh(x2 * (d0 * d1 * inverse))
    if far:
        for i in range(m):
            for k in range(3):
                w[_E + k * GROUP + i] = 0.5 * math.log1p(w[_B + k * GROUP + i])


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _in_parts(w, bits):
    """Numbers of row `_NEW` as those in ½√2 … √2 of row `_NEW1` times powers of two, whose exponents go to row `_NEW2`."""
    for i in range(GROUP):
        over = (bits[_NEW + i] - _ROOT) >> _MANTISSA
        bits[_NEW1 + i] = bits[_NEW + i] - (over << _MANTISSA)
        w[_NEW2 + i] = float(over)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _logarithm(f, s, k):
    """Logarithm of 2^k (1 + f), s = f/(2 + f), after fdlibm."""
    z, half = s * s, 0.5 * f * f
    tail = 0.2222219843214978396 + z * (0.1818357216161805012 + z * (0.1531383769920937332 + z * 0.1479819860511658591))
    tail = z * (0.6666666666666735130 + z * (0.3999999999940941908 + z * (0.2857142874366239149 + z * tail)))
    return k * _LN2 - ((half - (s * (half + tail) + k * _LN2_REST)) - f)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def power_curve(w, bits, first, factor, shift, n, chord):
    """Flow stresses first + factor (a + shift)^n at a of `_A0` and `_DELTA` → rows `_Y`, `_SLOPE`, `_CURVATURE`.

    Where a + shift < `TINY` it is first + chord (a + shift), unless ``chord`` is 0.

    Powers are exp(n ln x), to a few units of the last digit, without a branch or a function of a library: the logarithm after
    fdlibm (Sun Microsystems 1993, e_log.c), the exponential by its series. bits: w as integers. NaN where numbers are not normal.
    """
    for i in range(GROUP):
        w[_NEW + i] = w[_A0 + i] + w[_DELTA + i] + shift
    _in_parts(w, bits)
    for i in range(GROUP):
        f, x = w[_NEW1 + i] - 1.0, w[_NEW + i]
        inverse = 1.0 / (x * (2.0 + f))
        w[_SLOPE + i] = inverse * (2.0 + f)  # 1/x
        t = n * _logarithm(f, f * (inverse * x), w[_NEW2 + i])
        good = (x >= _NORMAL) & (x <= _FINITE) & (abs(t) <= _EXPONENT)
        t = t if good else 0.0
        whole = t * (1.0 / (_LN2 + _LN2_REST)) + _WHOLE
        w[_NEW1 + i] = whole
        whole -= _WHOLE
        t = (t - whole * _LN2) - whole * _LN2_REST
        tail = 1.0 / 3628800.0 + t * (1.0 / 39916800.0 + t * (1.0 / 479001600.0 + t * (1.0 / 6227020800.0)))
        tail = 1.0 / 720.0 + t * (1.0 / 5040.0 + t * (1.0 / 40320.0 + t * (1.0 / 362880.0 + t * tail)))
        tail = 0.5 + t * (1.0 / 6.0 + t * (1.0 / 24.0 + t * (1.0 / 120.0 + t * tail)))
        w[_NEW2 + i] = 1.0 + (t + t * t * tail) if good else math.nan
    for i in range(GROUP):
        bits[_NEW1 + i] = (bits[_NEW1 + i] - _WHOLE_BITS + _BIAS) << _MANTISSA
    for i in range(GROUP):
        power, inverse = factor * (w[_NEW2 + i] * w[_NEW1 + i]), w[_SLOPE + i]
        slope = n * power * inverse
        below = (chord != 0.0) & (w[_NEW + i] < TINY)
        w[_Y + i] = first + (chord * w[_NEW + i] if below else power)
        w[_SLOPE + i], w[_CURVATURE + i] = chord if below else slope, 0.0 if below else (n - 1.0) * slope * inverse


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _row_of_tangent(w, i, k, r0, r1, r2, r3, p1, p2, p3, p4, q1, q2, q3, q4, M):
    """Row k of A, of the row r of R, and the entry k of its last row; M: 00, 03, 30, 33, 11, 12, 21, 22, 04, 34, 40, 43."""
    m00, m03, m30, m33, m11, m12, m21, m22, m04, m34, m40, m43 = M
    w0, w1, w2, w3 = r0 * m00 + r3 * m30, r1 * m11 + r2 * m21, r1 * m12 + r2 * m22, r0 * m03 + r3 * m33
    a = _A + 5 * k * GROUP + i
    w[a] = w0 * p1 + w1 * p2 - w2 * q1 - w3 * q2
    w[a + GROUP] = w0 * p3 + w1 * p4 - w2 * q3 - w3 * q4
    w[a + 2 * GROUP] = w0 * q1 + w1 * q2 + w2 * p1 + w3 * p2
    w[a + 3 * GROUP] = w0 * q3 + w1 * q4 + w2 * p3 + w3 * p4
    w[a + 4 * GROUP] = r0 * m04 + r3 * m34
    w[_A + (20 + k) * GROUP + i] = r0 * m40 + r3 * m43


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _trial(w, m, G, cauchy):
    """Trial strains of the first m points, their axes, q, J and J_n, NaN where f is no motion."""
    far = 0
    for i in range(GROUP):
        h11, h12, h21 = w[_H + i], w[_H1 + i], w[_H2 + i]
        h22, h33 = w[_H3 + i], w[_H4 + i]
        o11, o22, o33, o12 = w[i], w[_O1 + i], w[_O2 + i], w[_O3 + i]
        b11, b22, b33, b12 = push_forward(h11, h12, h21, h22, h33, o11, o22, o33, o12)
        l1, l2, c, s = _axes(b11, b22, b12)
        jac = det_minus_one(h11, h12, h21, h22, h33)
        good = (jac > -1.0) & (1.0 + h33 > 0.0) & (l2 > -1.0) & (b33 > -1.0)
        l1, l2, b33 = l1 if good else 0.0, l2 if good else 0.0, b33 if good else 0.0
        w[_C + i], w[_C1 + i] = c, s
        w[_B + i], w[_B1 + i], w[_B2 + i] = l1, l2, b33
        J = math.sqrt(((1.0 + o11) * (1.0 + o22) - o12 * o12) * (1.0 + o33)) if good else math.nan
        w[_JN + i], w[_JAC + i] = J, (J + J * jac if good else 1.0) if cauchy else 1.0
        far += 1 if (i < m) & ((l1 > SMALL_LOG) | (l2 < -SMALL_LOG) | (abs(b33) > SMALL_LOG)) else 0
    _logarithmic_strains(w, m, far)
    for i in range(GROUP):
        e0, e1, e2 = w[_E + i], w[_E1 + i], w[_E2 + i]
        third = (e0 + e1 + e2) * _THIRD
        e0, e1, e2 = e0 - third, e1 - third, e2 - third
        w[_Q + i] = 2.0 * G * math.sqrt(1.5 * (e0 * e0 + e1 * e1 + e2 * e2))


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _flow(w, bits, m, first, held, G, kind, p, knots, coefs, dt):
    """Plastic strains of the first m points → `_DELTA` (NaN where none is found), flow stresses at both ends, slope at the last.

    The flow stress at the old strain and a start, then steps of all points that are not done yet, which are those of `_return`
    in `prensa.materials.j2`. held: as there, that of point ``first`` for the first one here.
    """
    power, smooth = (kind == LUDWIK) | (kind == SWIFT), kind < JOHNSON_COOK
    s0, factor, shift = (p[0], p[1], 0.0) if kind == LUDWIK else (0.0, p[0], p[1])
    chord = p[1] * TINY ** (p[2] - 1.0) if kind == LUDWIK else 0.0
    o = w.shape[0] - w.shape[0]  # 0: a function is compiled once for each constant that it is called with
    over = 1.0 / (3.0 * G)
    for i in range(GROUP):
        w[_DELTA + i] = 0.0
    left, turn = m, o
    while left and turn <= ROOT_STEPS:
        alone = left  # points whose flow stress is not answered for with that of all
        if power:
            power_curve(w, bits, s0, factor, shift, p[2], chord)
            alone = o
            for i in range(GROUP):
                alone += 1 if w[_Y + i] != w[_Y + i] else 0
        if alone:
            for i in range(m):
                x = w[_DELTA + i]
                if ((turn == 0) | (w[_OPEN + i] != 0.0)) & ((not power) | math.isnan(w[_Y + i])):
                    w[_Y + i], w[_SLOPE + i], w[_CURVATURE + i] = flow_stress(
                        kind, p, knots, coefs, w[_A0 + i] + x, x, dt
                    )
        left = o
        if turn == 0:
            for i in range(GROUP):
                q, jac, y0 = w[_Q + i], w[_JAC + i], w[_Y + i]
                f = q - jac * y0
                w[_Y0 + i], w[_FOUND_Y + i], w[_FOUND_SLOPE + i] = y0, y0, w[_SLOPE + i]
                w[_START + i] = _start(f, 3.0 * G, jac * w[_SLOPE + i], jac * w[_CURVATURE + i])
                w[_OPEN + i] = 1.0 if (i < m) & (f > ON_SURFACE * q) else 0.0
            if len(held):
                for i in range(m):
                    w[_OPEN + i] = 1.0 if held[first + i] else 0.0
            for i in range(GROUP):
                opens, far_off = w[_OPEN + i] != 0.0, w[_Q + i] * over
                x = w[_START + i] if opens else 0.0
                w[_DELTA + i], w[_FOUND + i] = x, 0.0
                w[_LOW + i], w[_HIGH + i] = -far_off if x <= 0.0 else 0.0, 0.0 if x <= 0.0 else far_off
                left += 1 if opens else 0
        else:
            for i in range(GROUP):
                x, q, jac, opens = w[_DELTA + i], w[_Q + i], w[_JAC + i], w[_OPEN + i] != 0.0
                s, ds, dds = w[_Y + i], w[_SLOPE + i], w[_CURVATURE + i]
                f = q - 3.0 * G * x - jac * s
                newton, step = _steps(f, 3.0 * G + jac * ds, jac * dds)
                done = _converged(x, newton, step, q, jac * ds, jac * dds, smooth & (w[_A0 + i] > TINY))
                low, high = x if f > 0.0 else w[_LOW + i], w[_HIGH + i] if f > 0.0 else x
                ends = done | (abs(f) <= 2e-14 * q) | (high - low <= 4e-16 * max(high, -low))
                last, then = step if done else 0.0, x + step
                w[_FOUND + i] = x + last if opens & ends else w[_FOUND + i]
                w[_FOUND_Y + i] = s + (ds + 0.5 * dds * last) * last if opens & ends else w[_FOUND_Y + i]
                w[_FOUND_SLOPE + i] = ds + dds * last if opens & ends else w[_FOUND_SLOPE + i]
                opens = opens & (not ends)
                then = then if (low < then) & (then < high) else 0.5 * (low + high)
                w[_LOW + i], w[_HIGH + i], w[_DELTA + i] = low, high, then if opens else x
                w[_OPEN + i] = 1.0 if opens else 0.0
                left += 1 if opens else 0
        turn += 1
    for i in range(GROUP):
        w[_DELTA + i] = w[_FOUND + i] if w[_OPEN + i] == 0.0 else math.nan
        w[_Y + i], w[_SLOPE + i] = w[_FOUND_Y + i], w[_FOUND_SLOPE + i]


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _answer(w, m, K, G, cauchy):
    """Elastic tensors, plastic strain and work, P, from trial strains and plastic strains."""
    far = 0
    for i in range(GROUP):
        delta, q = w[_DELTA + i], w[_Q + i]
        e0, e1, e2 = w[_E + i], w[_E1 + i], w[_E2 + i]
        inverse = 1.0 / (q if q > NO_STRESS else NO_STRESS)
        third, less = (e0 + e1 + e2) * _THIRD, 3.0 * G * (delta * inverse)
        w[_BY_Q + i], w[_LESS + i] = inverse, less
        x0, x1, x2 = 2.0 * (e0 - less * (e0 - third)), 2.0 * (e1 - less * (e1 - third)), 2.0 * (e2 - less * (e2 - third))
        w[_NEW + i], w[_NEW1 + i], w[_NEW2 + i] = x0, x1, x2
        far += 1 if (i < m) & ((abs(x0) > SMALL_EXP) | (abs(x1) > SMALL_EXP) | (abs(x2) > SMALL_EXP)) else 0
    if not far:
        for n in range(3 * GROUP):
            w[_NEW + n] = exp_minus_one(w[_NEW + n])
    else:
        for i in range(m):
            for k in range(3):
                w[_NEW + k * GROUP + i] = math.expm1(w[_NEW + k * GROUP + i])
    for i in range(GROUP):
        h11, h12, h21 = w[_H + i], w[_H1 + i], w[_H2 + i]
        h22, h33 = w[_H3 + i], w[_H4 + i]
        delta, jac, jn = w[_DELTA + i], w[_JAC + i], w[_JN + i]
        c, s = w[_C + i], w[_C1 + i]
        b1, b2, b3 = w[_NEW + i], w[_NEW1 + i], w[_NEW2 + i]
        n11, n22, n12 = c * c * b1 + s * s * b2, s * s * b1 + c * c * b2, c * s * (b1 - b2)
        w[_NEW + i], w[_NEW1 + i], w[_NEW3 + i] = n11, n22, n12
        o11, o22, o33, o12 = w[_T + i], w[_T1 + i], w[_T2 + i], w[_T3 + i]
        k11, k22, k33, k12 = push_forward(h11, h12, h21, h22, h33, o11, o22, o33, o12)
        flows = delta != 0.0
        w[_KEPT + i], w[_KEPT1 + i] = k11 if flows else n11, k22 if flows else n22
        w[_KEPT2 + i], w[_KEPT3 + i] = k33 if flows else b3, k12 if flows else n12
        e0, e1, e2 = w[_E + i], w[_E1 + i], w[_E2 + i]
        tr, shear = e0 + e1 + e2, 2.0 * G * (1.0 - w[_LESS + i])
        mean = (K - shear * _THIRD) * tr
        plane, f33 = (1.0 + h11) * (1.0 + h22) - h12 * h21, 1.0 + h33
        inverse = 1.0 / (jn * plane * f33)
        over = inverse * f33
        t1, t2, t3 = shear * e0 + mean, shear * e1 + mean, shear * e2 + mean
        # τ f⁻ᵀ / J_n of the plane, τ in the axes of space
        t11, t22, t12 = c * c * t1 + s * s * t2, s * s * t1 + c * c * t2, c * s * (t1 - t2)
        w[_P + i] = over * (t11 * (1.0 + h22) - t12 * h12)
        w[_P1 + i] = over * (t12 * (1.0 + h11) - t11 * h21)
        w[_P2 + i] = over * (t12 * (1.0 + h22) - t22 * h12)
        w[_P3 + i] = over * (t22 * (1.0 + h11) - t12 * h21)
        w[_P4 + i] = t3 * (inverse * plane)
        before = jn if cauchy else 1.0
        w[_WORK + i] += 0.5 * (before * w[_Y0 + i] + jac * w[_Y + i]) * delta
        w[_A0 + i] += delta
        w[_BY_F + i], w[_BY_F33 + i], w[_BY_JN + i] = jn * over, jn * (inverse * plane), over * plane


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _tangents(w, K, G, cauchy, secant):
    """∂P/∂f → `_A`; formulas as in `prensa.materials.j2` and `prensa.kernels.tensor`."""
    o = w.shape[0] - w.shape[0]  # as in `_flow`
    for i in range(GROUP):
        h11, h12, h21 = w[_H + i], w[_H1 + i], w[_H2 + i]
        h22 = w[_H3 + i]
        delta, jac, y1 = w[_DELTA + i], w[_JAC + i], w[_Y + i]
        c, s = w[_C + i], w[_C1 + i]
        l1, l2 = w[_B + i], w[_B1 + i]
        e0, e1, e2 = w[_E + i], w[_E1 + i], w[_E2 + i]
        tr, inverse = e0 + e1 + e2, w[_BY_Q + i]
        share, unit = delta * inverse, 3.0 * G * inverse if delta != 0.0 else 0.0
        mean, shear = tr * _THIRD, 2.0 * G * (1.0 - w[_LESS + i])
        e0, e1, e2, pressure = e0 - mean, e1 - mean, e2 - mean, K * tr
        n0, n1, n2 = unit * e0, unit * e1, unit * e2
        t1, t2, t3 = pressure + shear * e0, pressure + shear * e1, pressure + shear * e2
        # ds = θ ds_tr − 3G (dΔ/q − Δ dq/q²) s_tr,  dq = 2G n·dε,  dΔ = (dq − J σ_y tr dε)/(3G + J σ_y′)
        b1, b2 = 1.0 + l1, 1.0 + l2
        alike = abs(l1 - l2) <= 1e-7 * (abs(l1) + abs(l2)) + 1e-14
        stiff, apart = 3.0 * G + jac * w[_SLOPE + i], 2.0 * b1 if alike else l1 - l2
        inverse = 1.0 / (stiff * apart)
        soft = inverse * apart
        volume = jac * y1 if cauchy else 0.0
        part = (1.0 - secant) * 2.0 * G
        dq0, dq1, dq2 = 2.0 * G * n0, 2.0 * G * n1, 2.0 * G * n2
        g0, g1 = part * ((dq0 - volume) * soft - share * dq0), part * ((dq1 - volume) * soft - share * dq1)
        g2 = part * ((dq2 - volume) * soft - share * dq2)
        off, on = K - shear * _THIRD, K + shear * (2.0 * _THIRD)
        d00, d01, d02 = on - n0 * g0, off - n0 * g1, off - n0 * g2
        d10, d11, d12 = off - n1 * g0, on - n1 * g1, off - n1 * g2
        d20, d21, d22 = off - n2 * g0, off - n2 * g1, on - n2 * g2
        sh = (d00 - d01 if alike else t1 - t2) * (inverse * stiff)
        jn, g33, inverse = w[_BY_JN + i], w[_BY_F33 + i], w[_BY_F + i]
        M = (
            jn * (d00 - t1), jn * d01, jn * d10, jn * (d11 - t2),
            jn * sh * b2, jn * (sh * b1 - t1), jn * (sh * b2 - t2), jn * sh * b1,
            jn * g33 * d02, jn * g33 * d12, jn * g33 * d20, jn * g33 * d21,
        )  # fmt: skip
        f11, f12, f21, f22 = (1.0 + h22) * inverse, -h12 * inverse, -h21 * inverse, (1.0 + h11) * inverse
        T11, T12, T21, T22 = f11 * c + f12 * s, -f11 * s + f12 * c, f21 * c + f22 * s, -f21 * s + f22 * c
        # R[(iJ)][(ab)] = Q_ia T_Jb, rows and columns 11, 12, 21, 22
        p1, p2, p3, p4 = c * T11, c * T12, c * T21, c * T22
        q1, q2, q3, q4 = s * T11, s * T12, s * T21, s * T22
        _row_of_tangent(w, i, o, p1, p2, -q1, -q2, p1, p2, p3, p4, q1, q2, q3, q4, M)
        _row_of_tangent(w, i, o + 1, p3, p4, -q3, -q4, p1, p2, p3, p4, q1, q2, q3, q4, M)
        _row_of_tangent(w, i, o + 2, q1, q2, p1, p2, p1, p2, p3, p4, q1, q2, q3, q4, M)
        _row_of_tangent(w, i, o + 3, q3, q4, p3, p4, p1, p2, p3, p4, q1, q2, q3, q4, M)
        w[_A24 + i] = jn * g33 * g33 * (d22 - t3)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def j2_finite(
    h, old, kept, K, G, cauchy, kind, p, knots, coefs, dt, P, A, new, failed, tangent, held, secant
):  # fmt: skip
    """Gradients h (n, 5) = f − I, old (n, ≥10) → P (n, 5), A (n, 25) if ``tangent``, new (n, ≥10), failed (n,).

    Histories as in `prensa.materials.laws.J2`; ``kept``: first column of the tensor in old that goes on as if nothing flowed.
    All else as in `prensa.materials.j2.j2`.
    """
    curve, size, wide = (p[0], p[1], p[2], p[3], p[4]), old.shape[1], new.shape[1]
    w = np.zeros(_ROWS)
    bits = w.view(np.int64)
    for first in range(0, old.shape[0], GROUP):
        m = min(GROUP, old.shape[0] - first)
        for i in range(0, m, WIDE):
            n, last = first + i, m - 1 - i
            # what the next points have comes from memory while these are answered for
            to_be_read(old, (n + GROUP) * size, size)
            to_be_read(old, (n + GROUP) * size + 8, size)
            to_be_read(h, 5 * (n + GROUP), 5)
            to_be_written(new, (n + GROUP) * wide, wide)
            to_be_written(new, (n + GROUP) * wide + 8, wide)
            to_be_written(P, 5 * (n + GROUP), 5)
            into_rows(old, n * size, size, last, w, _O + i, GROUP)
            four_into_rows(old, n * size + kept, size, last, w, _T + i, GROUP)
            five_into_rows(h, 5 * n, 5, last, w, _H + i, GROUP)
        _trial(w, m, G, cauchy)
        _flow(w, bits, m, first, held, G, kind, curve, knots, coefs, dt)
        for i in range(m):
            if math.isnan(w[_DELTA + i]) or math.isnan(w[_JN + i]):
                failed[first + i] = True
                w[_DELTA + i] = 0.0
        _answer(w, m, K, G, cauchy)
        if tangent:
            _tangents(w, K, G, cauchy, secant)
        for i in range(0, m, WIDE):
            n, last = first + i, m - 1 - i
            out_of_rows(new, n * wide, wide, last, w, _NEW + i, GROUP)
            out_of_rows(new, n * wide + 2, wide, last, w, _NEW2 + i, GROUP)
            five_out_of_rows(P, 5 * n, 5, last, w, _P + i, GROUP)
            if tangent:
                for k in EIGHTS_OF_25:
                    out_of_rows(A, 25 * n + k, 25, last, w, _A + k * GROUP + i, GROUP)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def begin_finite(history, share, cauchy, kind, p, knots, coefs, out):
    """Histories (n, 10) → out (n, 10), those after a ``share`` of the last plastic strain more.

    As `prensa.kernels.tensor.begin`, with the plastic work of that strain; all else as in `j2_finite`.
    """
    curve = (p[0], p[1], p[2], p[3], p[4])
    w = np.zeros(_ROWS)
    bits, power = w.view(np.int64), (kind == LUDWIK) | (kind == SWIFT)
    s0, factor, shift = (p[0], p[1], 0.0) if kind == LUDWIK else (0.0, p[0], p[1])
    chord = p[1] * TINY ** (p[2] - 1.0) if kind == LUDWIK else 0.0
    for first in range(0, history.shape[0], GROUP):
        m, flowed = min(GROUP, history.shape[0] - first), 0
        for i in range(m):
            same = True
            for k in range(4):
                w[_O + k * GROUP + i], w[_T + k * GROUP + i] = history[first + i, k], history[first + i, 6 + k]
                same = same and history[first + i, k] == history[first + i, 6 + k]
                out[first + i, k] = out[first + i, 6 + k] = history[first + i, k]
            out[first + i, 4], out[first + i, 5] = history[first + i, 4], history[first + i, 5]
            w[_A0 + i], w[_WORK + i], w[_START + i] = history[first + i, 4], history[first + i, 5], 0.0 if same else 1.0
            flowed += 0 if same else 1
        if not flowed:
            continue
        # logarithmic strains of the elastic tensor and of the one that goes on as if nothing flowed, in their places
        for which in range(2):
            base, far = _O + which * (_T - _O), 0
            for i in range(GROUP):
                l1, l2, c, s = _axes(w[base + i], w[base + GROUP + i], w[base + 3 * GROUP + i])
                l3 = w[base + 2 * GROUP + i]
                w[_C + i], w[_C1 + i], w[_B + i], w[_B1 + i], w[_B2 + i] = c, s, l1, l2, l3
                J = math.sqrt((1.0 + l1) * (1.0 + l2) * (1.0 + l3)) if cauchy else 1.0
                w[_JAC + i] = J if which == 0 else w[_JAC + i]
                far += 1 if (i < m) & ((l1 > SMALL_LOG) | (l2 < -SMALL_LOG) | (abs(l3) > SMALL_LOG)) else 0
            _logarithmic_strains(w, m, far)
            for i in range(GROUP):
                c, s, e1, e2 = w[_C + i], w[_C1 + i], w[_E + i], w[_E1 + i]
                w[base + i], w[base + GROUP + i] = c * c * e1 + s * s * e2, s * s * e1 + c * c * e2
                w[base + 2 * GROUP + i], w[base + 3 * GROUP + i] = w[_E2 + i], c * s * (e1 - e2)
        far = 0
        for i in range(GROUP):
            e11, e22, e33, e12 = w[_O + i], w[_O1 + i], w[_O2 + i], w[_O3 + i]
            d11, d22, d33, d12 = w[_T + i] - e11, w[_T1 + i] - e22, w[_T2 + i] - e33, w[_T3 + i] - e12
            third = (d11 + d22 + d33) / 3.0
            d11, d22, d33 = d11 - third, d22 - third, d33 - third
            w[_DELTA + i] = share * math.sqrt((d11 * d11 + d22 * d22 + d33 * d33 + 2.0 * d12 * d12) / 1.5)
            x1, x2, c, s = _axes(e11 - share * d11, e22 - share * d22, e12 - share * d12)
            x1, x2, x3 = 2.0 * x1, 2.0 * x2, 2.0 * (e33 - share * d33)
            w[_C + i], w[_C1 + i], w[_B + i], w[_B1 + i], w[_B2 + i] = c, s, x1, x2, x3
            far += 1 if (i < m) & ((abs(x1) > SMALL_EXP) | (abs(x2) > SMALL_EXP) | (abs(x3) > SMALL_EXP)) else 0
        for n in range(3 * GROUP):
            w[_E + n] = exp_minus_one(w[_B + n])
        if far:
            for i in range(m):
                for k in range(3):
                    w[_E + k * GROUP + i] = math.expm1(w[_B + k * GROUP + i])
        # flow stress at the end of that strain, and at its beginning
        for turn in range(2):
            if power:
                power_curve(w, bits, s0, factor, shift, p[2], chord)
            for i in range(m):
                a = w[_A0 + i] + w[_DELTA + i]
                if (w[_START + i] != 0.0) & ((not power) | math.isnan(w[_Y + i])):
                    w[_Y + i] = flow_stress(kind, curve, knots, coefs, a, 0.0, 0.0)[0]
            if turn == 0:
                for i in range(GROUP):
                    w[_Y0 + i], w[_Q + i], w[_DELTA + i] = w[_Y + i], w[_DELTA + i], 0.0
        for i in range(m):
            if w[_START + i] == 0.0:
                continue
            c, s, b1, b2, more = w[_C + i], w[_C1 + i], w[_E + i], w[_E1 + i], w[_Q + i]
            out[first + i, 0], out[first + i, 1] = c * c * b1 + s * s * b2, s * s * b1 + c * c * b2
            out[first + i, 2], out[first + i, 3] = w[_E2 + i], c * s * (b1 - b2)
            out[first + i, 4] = w[_A0 + i] + more
            out[first + i, 5] = w[_WORK + i] + 0.5 * w[_JAC + i] * (w[_Y0 + i] + w[_Y + i]) * more


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def stresses_at(before, after, kind, p, knots, coefs, dt, out):
    """Plastic strains before and after (e, q) → flow stresses after, their slopes, those by the strain before: out (e, q, 3)."""
    curve, count = (p[0], p[1], p[2], p[3], p[4]), after.shape[1]
    w = np.zeros(_ROWS)
    bits, power = w.view(np.int64), (kind == LUDWIK) | (kind == SWIFT)
    s0, factor, shift = (p[0], p[1], 0.0) if kind == LUDWIK else (0.0, p[0], p[1])
    chord = p[1] * TINY ** (p[2] - 1.0) if kind == LUDWIK else 0.0
    for first in range(0, after.size, GROUP):
        m = min(GROUP, after.size - first)
        for i in range(m):
            n = first + i
            w[_A0 + i] = after[n // count, n % count]
        if power:
            power_curve(w, bits, s0, factor, shift, p[2], chord)
        for i in range(m):
            n, a = first + i, w[_A0 + i]
            e, q = n // count, n % count
            y, slope = w[_Y + i], w[_SLOPE + i]
            by = slope
            if (not power) | math.isnan(y):
                da = a - before[e, q]
                y, slope, _ = flow_stress(kind, curve, knots, coefs, a, da, dt)
                by = slope_before(kind, curve, a, da, dt, slope)
            out[e, q, 0], out[e, q, 1], out[e, q, 2] = y, slope, by


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def power_gradients(kind, p, committed, old, new, out):
    """Derivatives of Ludwik's and Swift's flow stresses by their scalars → out (e, q, 3, 5).

    After an increment, as it begins and as committed, where those differ, else 0: plastic strains are column 4 of the histories
    (e, q, h). `GROUP` points go abreast.
    """
    curve, ludwik, count = (p[0], p[1], p[2], p[3], p[4]), kind == LUDWIK, new.shape[1]
    K, shift, n = p[1] if ludwik else p[0], 0.0 if ludwik else p[1], p[2]
    w, points = np.zeros(_ROWS), out.reshape(-1)
    bits, strains = w.view(np.int64), np.zeros((3, GROUP))
    for first in range(0, new.shape[0] * count, GROUP):
        m = min(GROUP, new.shape[0] * count - first)
        for i in range(m):
            e, q = (first + i) // count, (first + i) % count
            strains[0, i], strains[1, i], strains[2, i] = new[e, q, 4], old[e, q, 4], committed[e, q, 4]
        for turn in range(3):
            row, then = _A + 5 * turn * GROUP, 0 if turn < 2 else 1
            for i in range(GROUP):
                w[_A0 + i] = strains[turn, i]
            power_curve(w, bits, 0.0, 1.0, shift, n, 0.0)
            _in_parts(w, bits)
            for i in range(GROUP):
                f, power = w[_NEW1 + i] - 1.0, w[_Y + i]
                by_n, by_shift = K * power * _logarithm(f, f / (2.0 + f), w[_NEW2 + i]), n * K * power / w[_NEW + i]
                on = (strains[then, i] != strains[then + 1, i]) | ((turn == 1) & (strains[1, i] != strains[2, i]))
                w[row + i] = (1.0 if ludwik else power) if on else 0.0
                w[row + GROUP + i] = (power if ludwik else by_shift) if on else 0.0
                w[row + 2 * GROUP + i] = by_n if on else 0.0
                w[row + 3 * GROUP + i] = w[row + 4 * GROUP + i] = 0.0
            for i in range(m):
                chord = ludwik and w[row + i] != 0.0 and strains[turn, i] < TINY
                if chord or math.isnan(w[row + 2 * GROUP + i]):
                    by = flow_gradient(kind, curve, strains[turn, i], 0.0, 0.0)
                    w[row + i], w[row + GROUP + i], w[row + 2 * GROUP + i] = by[0], by[1], by[2]
        for i in range(0, m, WIDE):
            at, last = 15 * (first + i), m - 1 - i
            out_of_rows(points, at, 15, last, w, _A + i, GROUP)
            out_of_rows(points, at + 7, 15, last, w, _A + 7 * GROUP + i, GROUP)
