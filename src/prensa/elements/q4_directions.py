"""Derivatives of F-bar quadrilaterals of isotropic metal along directions: of forces, history and energy, for many at once.

Finite strain, plane strain and axisymmetry, Hencky's elasticity and J2 plasticity with compiled flow curves; which points flow
is that of the increment. Everything is linear in a direction: motions of the committed and of the present nodes x_n′ and x′, the
history before h_n′, moduli and the flow curve. With l = ∇x′ − f ∇x_n′ f⁻¹ + I (ln α)′ the trial tensor b = f b_n fᵀ changes by
l b + b lᵀ + f b_n′ fᵀ, its principal strains by b′_ii/2b_i, and the return map linearised there gives the rest (Michaleris,
Tortorelli and Vidal 1994; de Souza Neto, Perić and Owen 2008, ch. 14). Forces are r_a = Σ V τ ∇N_a with the present gradients
and V = V_n/(α^m J_n), J_n = √det b_n.

`prepare` computes what all directions share; `at_fixed` is a direction with x′ as given, `along` adds what further x′ make of
the history. All are of backward Euler, which increments of second order are too, from histories of their own
(`prensa.materials.begun`). Directions are the last axis of all arrays and go through the kernels `LANES` at a time, each group
of them with histories of its own, in arrays of a size that the compiler knows: one instruction then serves several of them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from prensa.elements.q4 import _DX, _DY, _N
from prensa.kernels.compiled import njit
from prensa.kernels.lanes import WIDE, add_eight, eight, out_of_rows
from prensa.kernels.series import GROUP, SMALL_EXP, SMALL_LOG, exp_minus_one, half_log
from prensa.materials.begun import LANES, begun_along
from prensa.materials.hardening import LUDWIK, SWIFT, TABLE, flow_gradient, table_gradient
from prensa.materials.j2_finite import _axes, power_gradients

# where rows of so many begin in the array for the work on them: motions x_n′ and x′ (8 rows each), forces (8), history before
# and after (10 each), what else a parameter changes, energy and plastic work, traces of l, gradients of x′ and l (5 each), flow
# stresses before
_1, _2, _3, _4, _5, _6, _7, _8, _9 = (k * LANES for k in range(1, 10))
_OLD, _PRESENT, _FORCE, _BEFORE, _AFTER, _NOW, _WAS, _LAME, _SHEAR, _ENERGY, _TRACE, _MIDDLE_TRACE, _GRADIENT, _RATE = (
    k * LANES for k in (0, 8, 16, 24, 34, 44, 45, 46, 47, 48, 50, 51, 52, 57)
)
_COMMITTED, _END = 62 * LANES, 63 * LANES
PER_PLACE = 17  # numbers a point: ∂N/∂x, ∂N/∂y, N/r (4 each) in the present places, F = ∂x/∂x_n (5: 11, 12, 21, 22, 33)
PER_POINT = 48  # numbers a point of `prepare`, in the order in which it writes them
_MIDDLE = 4
# of `prepare`, rows of points: tensors before, α^m, α, principal values of b less one, logarithms, plastic strain, flow stresses
# with their slopes, and from `_OF_POINT` on its numbers, among them the volume
_WAS_B, _WAS_B1, _WAS_B2, _WAS_B3, _STRETCH, _ALPHA_OF, _L, _L1, _L2, _LOG, _LOG1, _LOG2 = range(0, 12 * GROUP, GROUP)
_INCREASE, _STRESS, _HARDENING, _BY_OLD, _STRESS_WAS, _HARDENING_WAS, _OF_POINT = range(12 * GROUP, 19 * GROUP, GROUP)
_V, _ONWARDS, _WORK_END = _OF_POINT + 43 * GROUP, _OF_POINT + 44 * GROUP, _OF_POINT + 48 * GROUP
_ONWARDS1, _ONWARDS2, _ONWARDS3 = _ONWARDS + GROUP, _ONWARDS + 2 * GROUP, _ONWARDS + 3 * GROUP
(
    _POINT0, _POINT1, _POINT2, _POINT3, _POINT4, _POINT5, _POINT6, _POINT7, _POINT8, _POINT9,
    _POINT10, _POINT11, _POINT12, _POINT13, _POINT14, _POINT15, _POINT16, _POINT17, _POINT18, _POINT19,
    _POINT20, _POINT21, _POINT22, _POINT23, _POINT24, _POINT25, _POINT26, _POINT27, _POINT28, _POINT29,
    _POINT30, _POINT31, _POINT32, _POINT33, _POINT34, _POINT35, _POINT36, _POINT37, _POINT38, _POINT39,
    _POINT40, _POINT41, _POINT42,
) = range(_OF_POINT, _V, GROUP)  # fmt: skip
WAYS = 5  # in which a flow curve changes, that are added up at a time: as many as its scalars


def histories(points: tuple[int, ...], count: int) -> NDArray[np.float64]:
    """Room for the derivatives (e, 4, h, d) of histories (e, 4, h) along d directions, with whatever numbers there are.

    The kernels go over all `LANES` from each number's first direction on, and so beyond the last one's end.
    """
    shape = (*points, count)
    size = int(np.prod(shape))
    return np.empty(size + LANES)[:size].reshape(shape)


def in_lanes(a: NDArray[np.float64], first: int, size: int = LANES) -> NDArray[np.float64]:
    """So many directions of an array (…, d) from one on in `LANES`, of which those that there are not are zero."""
    out = np.zeros((*a.shape[:-1], LANES))
    some = a[..., first : first + size]
    out[..., : some.shape[-1]] = some
    return out


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def prepare(x_n, x, cells, old, new, bulk, G, axisymmetric, scale, plastic, cauchy, after, before, geometry, point):
    """Node positions x_n, x (n, 2), histories old, new (e, 4, h) → geometry (e, 5, 17), point (e, 4, 48).

    Flow stresses after and before the increment (e, 4, 3) as `stresses_at` has them. As `prensa.materials.j2_finite` goes through
    points: `GROUP` of them abreast.
    """
    w, J, points = np.zeros(_WORK_END), np.empty(5), point.reshape(-1)
    for first in range(0, cells.shape[0], GROUP // 4):
        m = 4 * min(GROUP // 4, cells.shape[0] - first)
        for at in range(0, m, 4):
            e = first + at // 4
            g = geometry[e]
            for q in range(5):
                a11 = a12 = a21 = a22 = c11 = c12 = c21 = c22 = rn = r = 0.0
                for k in range(4):
                    node = cells[e, k]
                    X, Y, x1, y1 = x_n[node, 0], x_n[node, 1], x[node, 0], x[node, 1]
                    d1, d2, N = _DX[q, k], _DY[q, k], _N[q, k]
                    a11 += X * d1
                    a12 += X * d2
                    a21 += Y * d1
                    a22 += Y * d2
                    rn += N * X
                    c11 += x1 * d1
                    c12 += x1 * d2
                    c21 += y1 * d1
                    c22 += y1 * d2
                    r += N * x1
                dn, dc = a11 * a22 - a12 * a21, c11 * c22 - c12 * c21
                by_dn, by_dc, by_r = 1.0 / dn, 1.0 / dc, 1.0 / r if axisymmetric else 0.0
                for k in range(4):
                    d1, d2 = _DX[q, k], _DY[q, k]
                    g[q, k], g[q, 4 + k] = (c22 * d1 - c21 * d2) * by_dc, (c11 * d2 - c12 * d1) * by_dc
                    g[q, 8 + k] = _N[q, k] * by_r
                g[q, 12], g[q, 13] = (c11 * a22 - c12 * a21) * by_dn, (c12 * a11 - c11 * a12) * by_dn
                g[q, 14], g[q, 15] = (c21 * a22 - c22 * a21) * by_dn, (c22 * a11 - c21 * a12) * by_dn
                g[q, 16] = r / rn if axisymmetric else 1.0
                J[q] = dc * by_dn * g[q, 16]
                if q < 4:
                    w[_V + at + q] = scale * dn * (rn if axisymmetric else 1.0)
                    for k in range(5):
                        w[_OF_POINT + k * GROUP + at + q] = g[q, 12 + k]
            for q in range(4):
                w[_STRETCH + at + q] = J[4] / J[q]
                w[_V + at + q] /= w[_STRETCH + at + q]
        for i in range(m):
            e, q = first + i // 4, i % 4
            for k in range(4):
                w[_WAS_B + k * GROUP + i] = old[e, q, k]
            if plastic:
                w[_INCREASE + i] = new[e, q, 4] - old[e, q, 4]
                w[_STRESS + i], w[_HARDENING + i], w[_BY_OLD + i] = after[e, q, 0], after[e, q, 1], after[e, q, 2]
                w[_STRESS_WAS + i], w[_HARDENING_WAS + i] = before[e, q, 0], before[e, q, 1]
        by, far = 2.0 / (3.0 if axisymmetric else 2.0), 0
        for i in range(GROUP):
            more = w[_STRETCH + i] - 1.0
            w[_ALPHA_OF + i] = 1.0 + exp_minus_one(by * half_log(more))
            far += 1 if (i < m) & (abs(more) > SMALL_EXP) else 0
        if far:
            for i in range(m):
                w[_ALPHA_OF + i] = math.exp(0.5 * by * math.log(w[_STRETCH + i]))
        far = 0
        for i in range(GROUP):
            alpha = w[_ALPHA_OF + i]
            hoop = alpha if axisymmetric else 1.0
            f0, f1, f2, f3 = alpha * w[_POINT0 + i], alpha * w[_POINT1 + i], alpha * w[_POINT2 + i], alpha * w[_POINT3 + i]
            f4 = hoop * w[_POINT4 + i]
            o1, o2, o3, o12 = 1.0 + w[_WAS_B + i], 1.0 + w[_WAS_B1 + i], 1.0 + w[_WAS_B2 + i], w[_WAS_B3 + i]
            w11, w12, w21, w22 = f0 * o1 + f1 * o12, f0 * o12 + f1 * o2, f2 * o1 + f3 * o12, f2 * o12 + f3 * o2
            b11, b12, b22, b33 = w11 * f0 + w12 * f1, w11 * f2 + w12 * f3, w21 * f2 + w22 * f3, f4 * f4 * o3
            l1, l2, c, s = _axes(b11 - 1.0, b22 - 1.0, b12)
            w[_POINT0 + i], w[_POINT1 + i], w[_POINT2 + i], w[_POINT3 + i], w[_POINT4 + i] = f0, f1, f2, f3, f4
            w[_POINT5 + i], w[_POINT6 + i], w[_POINT7 + i], w[_POINT8 + i] = b11, b12, b22, b33
            # what b_e of the last commit would be if nothing flowed; of backward Euler that is b
            w[_ONWARDS + i], w[_ONWARDS1 + i], w[_ONWARDS2 + i], w[_ONWARDS3 + i] = b11, b12, b22, b33
            w[_POINT11 + i], w[_POINT12 + i] = c, s
            l3 = b33 - 1.0
            w[_L + i], w[_L1 + i], w[_L2 + i] = l1, l2, l3
            far += 1 if (i < m) & ((l1 > SMALL_LOG) | (l2 < -SMALL_LOG) | (abs(l3) > SMALL_LOG)) else 0
        for n in range(3 * GROUP):
            w[_LOG + n] = half_log(w[_L + n])
        if far:
            for i in range(m):
                for k in range(3):
                    w[_LOG + k * GROUP + i] = 0.5 * math.log1p(w[_L + k * GROUP + i])
        if plastic:
            for i in range(m):
                h = new[first + i // 4, i % 4]
                w[_ONWARDS + i], w[_ONWARDS1 + i], w[_ONWARDS2 + i], w[_ONWARDS3 + i] = 1.0 + h[6], h[9], 1.0 + h[7], 1.0 + h[8]
        lame, far = bulk - 2.0 * G / 3.0, 0
        for i in range(GROUP):
            delta = w[_INCREASE + i]
            flows = delta != 0.0
            B1, B2, b33 = 1.0 + w[_L + i], 1.0 + w[_L1 + i], 1.0 + w[_L2 + i]
            e1, e2, e3 = w[_LOG + i], w[_LOG1 + i], w[_LOG2 + i]
            trace = e1 + e2 + e3
            third = trace / 3.0
            e1, e2, e3 = e1 - third, e2 - third, e3 - third
            size = math.sqrt(1.5 * (e1 * e1 + e2 * e2 + e3 * e3))
            o1, o2, o3, o12 = 1.0 + w[_WAS_B + i], 1.0 + w[_WAS_B1 + i], 1.0 + w[_WAS_B2 + i], w[_WAS_B3 + i]
            by_det = 1.0 / (o1 * o2 - o12 * o12)
            Jn = math.sqrt((o1 * o2 - o12 * o12) * o3)
            by_size = 1.0 / size if flows else 0.0
            n1, n2, n3, ratio = 1.5 * e1 * by_size, 1.5 * e2 * by_size, 1.5 * e3 * by_size, delta * by_size
            y, dy, by_old, y0, dy0 = w[_STRESS + i], w[_HARDENING + i], w[_BY_OLD + i], w[_STRESS_WAS + i], w[_HARDENING_WAS + i]
            j, jn, finite = (math.sqrt(B1 * B2 * b33), Jn, 1.0) if cauchy else (1.0, 1.0, 0.0)
            soft, half = 1.0 / (3.0 * G + j * dy) if flows else 0.0, 0.5 * delta
            on = 1.0 if flows else 0.0
            x1, x2, x3 = e1 + third - delta * n1, e2 + third - delta * n2, e3 + third - delta * n3
            w[_POINT9 + i], w[_POINT10 + i] = 0.5 / B1, 0.5 / B2
            w[_POINT13 + i], w[_POINT14 + i], w[_POINT15 + i], w[_POINT16 + i] = n1, n2, n3, ratio
            w[_POINT17 + i], w[_POINT18 + i], w[_POINT19 + i] = soft, finite * j * y * soft, j * by_old * soft
            w[_POINT20 + i], w[_POINT21 + i] = j * soft, (2.0 * size - 3.0 * delta) * soft
            w[_POINT22 + i], w[_POINT23 + i], w[_POINT24 + i] = x1, x2, x3
            w[_POINT27 + i], w[_POINT28 + i], w[_POINT29 + i] = (
                lame * trace + 2.0 * G * x1, lame * trace + 2.0 * G * x2, lame * trace + 2.0 * G * x3
            )  # fmt: skip
            w[_POINT33 + i], w[_POINT34 + i] = on * (0.5 * (jn * y0 + j * y) + half * j * dy), half * (jn * dy0 + j * by_old)
            w[_POINT35 + i], w[_POINT36 + i] = finite * half * j * y, finite * half * jn * y0
            w[_POINT37 + i], w[_POINT38 + i] = half * j, half * jn
            w[_POINT39 + i], w[_POINT40 + i] = 0.5 * o2 * by_det, 0.5 * o1 * by_det  # (ln J_n)′ of b_n′
            w[_POINT41 + i], w[_POINT42 + i] = -o12 * by_det, 0.5 / o3
            w[_V + i] /= Jn
            x1, x2, x3 = 2.0 * x1, 2.0 * x2, 2.0 * x3
            w[_LOG + i], w[_LOG1 + i], w[_LOG2 + i] = x1, x2, x3
            far += 1 if (i < m) & ((abs(x1) > SMALL_EXP) | (abs(x2) > SMALL_EXP) | (abs(x3) > SMALL_EXP)) else 0
        if not far:
            for n in range(3 * GROUP):
                w[_LOG + n] = exp_minus_one(w[_LOG + n])
        else:
            for i in range(m):
                for k in range(3):
                    w[_LOG + k * GROUP + i] = math.expm1(w[_LOG + k * GROUP + i])
        for i in range(GROUP):
            l1, l2 = w[_L + i], w[_L1 + i]
            E1, E2, E3, by_B1 = w[_LOG + i], w[_LOG1 + i], w[_LOG2 + i], 2.0 * w[_POINT9 + i]
            theta = 1.0 - 1.5 * w[_POINT16 + i]
            apart = abs(l1 - l2) > 1e-7 * (abs(l1) + abs(l2)) + 1e-14
            by = 1.0 / ((l1 - l2) if apart else 1.0)
            w[_POINT25 + i] = (w[_POINT27 + i] - w[_POINT28 + i]) * by if apart else G * theta * by_B1
            w[_POINT26 + i] = (E1 - E2) * by if apart else (1.0 + E1) * theta * by_B1
            w[_POINT30 + i], w[_POINT31 + i], w[_POINT32 + i] = 2.0 * (1.0 + E1), 2.0 * (1.0 + E2), 2.0 * (1.0 + E3)
        for i in range(0, m, WIDE):
            n, last = 4 * first + i, m - 1 - i
            for k in range(0, PER_POINT, WIDE):
                out_of_rows(points, n * PER_POINT + k, PER_POINT, last, w, _OF_POINT + k * GROUP + i, GROUP)


@njit(cache=True, error_model="numpy", forceinline=True)
def _curve_gradient(kind, curve, knots, coefs, a, da, dt, dknots, dcoefs, out, first):
    """Derivatives of a flow stress → numbers of out from *first* on: five, or one for each that changes a table."""
    if kind == TABLE:
        for k in range(len(dknots)):
            out[first + k] = table_gradient(knots, coefs, a, dknots[k], dcoefs[k])
    else:
        by = flow_gradient(kind, curve, a, da, dt)
        out[first], out[first + 1], out[first + 2], out[first + 3], out[first + 4] = by


@njit(cache=True, error_model="numpy")
def flow_gradients(kind, p, knots, coefs, committed, old, new, dt, dknots, dcoefs, out):
    """Derivatives of a flow stress → out (e, 4, 3, m): after the increment, as it begins and as committed, where those differ.

    By its scalars p (5,), or of a table by what at most m changes dknots (…, k), dcoefs (…, k − 1, 4) make of it. Plastic strains
    are column 4 of the histories (e, 4, h).
    """
    curve, kinds = (p[0], p[1], p[2], p[3], p[4]), out.shape[3]
    if (kind == LUDWIK) | (kind == SWIFT):
        power_gradients(kind, p, committed, old, new, out)
        return
    rows = out.reshape((out.shape[0], out.shape[1], 3 * kinds))
    for e in range(old.shape[0]):
        for q in range(old.shape[1]):
            before, was, now, o = committed[e, q, 4], old[e, q, 4], new[e, q, 4], rows[e, q]
            for k in range(3 * kinds):
                o[k] = 0.0
            if now != was:
                _curve_gradient(kind, curve, knots, coefs, now, now - was, dt, dknots, dcoefs, o, 0)
            if now != was or was != before:
                _curve_gradient(kind, curve, knots, coefs, was, 0.0, dt, dknots, dcoefs, o, kinds)
            if was != before:
                _curve_gradient(kind, curve, knots, coefs, before, 0.0, dt, dknots, dcoefs, o, 2 * kinds)


@njit(cache=True, error_model="numpy", forceinline=True)
def _motions(u, cells, e, w, row):
    """Motions u (2 n LANES,) of the nodes of element e → eight rows of w."""
    for k in range(4):
        at = 2 * LANES * cells[e, k]
        eight(u, at, w, row + 2 * k * LANES)
        eight(u, at + LANES, w, row + (2 * k + 1) * LANES)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _gradients(w, row, B, out):
    """Gradients 11, 12, 21, 22, 33 of motions, eight rows of w, with the ∂N of a point → five rows."""
    x0, x1, x2, x3, y0, y1, y2, y3 = B[0], B[1], B[2], B[3], B[4], B[5], B[6], B[7]
    h0, h1, h2, h3 = B[8], B[9], B[10], B[11]
    for d in range(LANES):
        u0, u1, u2, u3 = w[row + d], w[row + _2 + d], w[row + _4 + d], w[row + _6 + d]
        v0, v1, v2, v3 = w[row + _1 + d], w[row + _3 + d], w[row + _5 + d], w[row + _7 + d]
        w[out + d] = u0 * x0 + u1 * x1 + u2 * x2 + u3 * x3
        w[out + _1 + d] = u0 * y0 + u1 * y1 + u2 * y2 + u3 * y3
        w[out + _2 + d] = v0 * x0 + v1 * x1 + v2 * x2 + v3 * x3
        w[out + _3 + d] = v0 * y0 + v1 * y1 + v2 * y2 + v3 * y3
        w[out + _4 + d] = u0 * h0 + u1 * h1 + u2 * h2 + u3 * h3


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _rates(w, B):
    """Rates l = ∇x′ − f (∂x_n′/∂x) at a point, and its trace: ∇x_n′ in the present places takes an f from the left."""
    x0, x1, x2, x3, y0, y1, y2, y3 = B[0], B[1], B[2], B[3], B[4], B[5], B[6], B[7]
    g0, g1, g2, g3 = B[8], B[9], B[10], B[11]
    f0, f1, f2, f3, f4 = B[12], B[13], B[14], B[15], B[16]
    for d in range(LANES):
        u0, u1, u2, u3 = w[_OLD + d], w[_OLD + _2 + d], w[_OLD + _4 + d], w[_OLD + _6 + d]
        v0, v1, v2, v3 = w[_OLD + _1 + d], w[_OLD + _3 + d], w[_OLD + _5 + d], w[_OLD + _7 + d]
        h0, h1 = u0 * x0 + u1 * x1 + u2 * x2 + u3 * x3, u0 * y0 + u1 * y1 + u2 * y2 + u3 * y3
        h2, h3 = v0 * x0 + v1 * x1 + v2 * x2 + v3 * x3, v0 * y0 + v1 * y1 + v2 * y2 + v3 * y3
        l0, l3 = w[_GRADIENT + d] - f0 * h0 - f1 * h2, w[_GRADIENT + _3 + d] - f2 * h1 - f3 * h3
        l4 = w[_GRADIENT + _4 + d] - f4 * (u0 * g0 + u1 * g1 + u2 * g2 + u3 * g3)
        w[_RATE + d], w[_RATE + _1 + d] = l0, w[_GRADIENT + _1 + d] - f0 * h1 - f1 * h3
        w[_RATE + _2 + d], w[_RATE + _3 + d], w[_RATE + _4 + d] = w[_GRADIENT + _2 + d] - f2 * h0 - f3 * h2, l3, l4
        w[_TRACE + d] = l0 + l3 + l4


@njit(cache=True, error_model="numpy", forceinline=True)
def _values(p):
    """The numbers p (48,) of a point as values: loads in a loop over lanes would have to be proved to stay the same."""
    return (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10],
        p[11], p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19], p[20], p[21],
        p[22], p[23], p[24], p[25], p[26], p[27], p[28], p[29], p[30], p[31], p[32],
        p[33], p[34], p[35], p[36], p[37], p[38], p[39], p[40], p[41], p[42], p[43],
        p[44], p[45], p[46], p[47],
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _principal(P, b11, b12, b22, b33):
    """Rate of b → of the principal trial strains (3) and its shear in their frame."""
    c, s = P[11], P[12]
    cc, cs, ss = c * c, c * s, s * s
    return (
        P[9] * (cc * b11 + 2.0 * cs * b12 + ss * b22), P[10] * (ss * b11 - 2.0 * cs * b12 + cc * b22),
        0.5 * b33 / P[8], cs * (b22 - b11) + (cc - ss) * b12,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _returned(P, G, d1, d2, d3, own):
    """Rates of the trial strains, ``own`` of the plastic strain besides theirs → of the plastic and elastic strains (3)."""
    n1, n2, n3, ratio = P[13], P[14], P[15], P[16]
    trace = d1 + d2 + d3
    along = n1 * d1 + n2 * d2 + n3 * d3
    plastic = 2.0 * G * P[17] * along - P[18] * trace + own
    turn, h, third = plastic - ratio * along, 1.5 * ratio, trace / 3.0
    return plastic, d1 - n1 * turn - h * (d1 - third), d2 - n2 * turn - h * (d2 - third), d3 - n3 * turn - h * (d3 - third)


@njit(cache=True, error_model="numpy", forceinline=True)
def _rotated(P, t1, t2, t12):
    """Components 11, 12, 22 of a tensor given in the principal frame."""
    c, s = P[11], P[12]
    cc, cs, ss = c * c, c * s, s * s
    return cc * t1 + ss * t2 - 2.0 * cs * t12, cs * (t1 - t2) + (cc - ss) * t12, ss * t1 + cc * t2 + 2.0 * cs * t12


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _keep_trial(w, P, part, hoop):
    """Rates of the tensor T that the committed b_e becomes if nothing flows: l T + T lᵀ + f b_e′ fᵀ."""
    f0, f1, f2, f3, f4, T11, T12, T22, T33 = P[0], P[1], P[2], P[3], P[4], P[44], P[45], P[46], P[47]
    for d in range(LANES):
        lna = w[_MIDDLE_TRACE + d] - w[_TRACE + d]
        l0, l1, l2 = w[_RATE + d] + part * lna, w[_RATE + _1 + d], w[_RATE + _2 + d]
        l3, l4 = w[_RATE + _3 + d] + part * lna, w[_RATE + _4 + d] + hoop * lna
        o1, o2, o3, o12 = w[_BEFORE + _6 + d], w[_BEFORE + _7 + d], w[_BEFORE + _8 + d], w[_BEFORE + _9 + d]
        w11, w12, w21, w22 = f0 * o1 + f1 * o12, f0 * o12 + f1 * o2, f2 * o1 + f3 * o12, f2 * o12 + f3 * o2
        w[_AFTER + _6 + d] = w11 * f0 + w12 * f1 + 2.0 * (l0 * T11 + l1 * T12)
        w[_AFTER + _9 + d] = w11 * f2 + w12 * f3 + l0 * T12 + l1 * T22 + l2 * T11 + l3 * T12
        w[_AFTER + _7 + d] = w21 * f2 + w22 * f3 + 2.0 * (l2 * T12 + l3 * T22)
        w[_AFTER + _8 + d] = f4 * f4 * o3 + 2.0 * l4 * T33


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _answer(w, P, B, bulk, G, part, hoop, volume):
    """Of a point: histories, energies and forces of directions at fixed degrees of freedom, from the other rows of w."""
    lame = bulk - 2.0 * G / 3.0
    f0, f1, f2, f3, f4, b11, b12, b22, b33 = P[0], P[1], P[2], P[3], P[4], P[5], P[6], P[7], P[8]
    s11, s12, s22 = _rotated(P, P[27], P[28], 0.0)
    V, s33, trace = P[43], P[29], P[22] + P[23] + P[24]
    squares = P[22] * P[22] + P[23] * P[23] + P[24] * P[24]
    x0, x1, x2, x3, y0, y1, y2, y3 = B[0], B[1], B[2], B[3], B[4], B[5], B[6], B[7]
    h0, h1, h2, h3 = B[8], B[9], B[10], B[11]
    _keep_trial(w, P, part, hoop)
    for d in range(LANES):
        lna = w[_MIDDLE_TRACE + d] - w[_TRACE + d]
        l0, l1, l2 = w[_RATE + d] + part * lna, w[_RATE + _1 + d], w[_RATE + _2 + d]
        l3, l4 = w[_RATE + _3 + d] + part * lna, w[_RATE + _4 + d] + hoop * lna
        o1, o2, o3, o12 = w[_BEFORE + d], w[_BEFORE + _1 + d], w[_BEFORE + _2 + d], w[_BEFORE + _3 + d]
        w11, w12, w21, w22 = f0 * o1 + f1 * o12, f0 * o12 + f1 * o2, f2 * o1 + f3 * o12, f2 * o12 + f3 * o2
        t11 = w11 * f0 + w12 * f1 + 2.0 * (l0 * b11 + l1 * b12)
        t12 = w11 * f2 + w12 * f3 + l0 * b12 + l1 * b22 + l2 * b11 + l3 * b12
        t22, t33 = w21 * f2 + w22 * f3 + 2.0 * (l2 * b12 + l3 * b22), f4 * f4 * o3 + 2.0 * l4 * b33
        d1, d2, d3, d12 = _principal(P, t11, t12, t22, t33)
        lnJn = P[39] * o1 + P[40] * o2 + P[41] * o12 + P[42] * o3
        dlame, dG, now, strain = w[_LAME + d], w[_SHEAR + d], w[_NOW + d], w[_BEFORE + _4 + d]
        dp, e1, e2, e3 = _returned(P, G, d1, d2, d3, P[21] * dG - P[19] * strain - P[20] * now)
        w[_AFTER + _4 + d] = strain + dp
        w[_AFTER + _5 + d] = (
            w[_BEFORE + _5 + d] + P[33] * dp + P[34] * strain + P[35] * (d1 + d2 + d3) + P[36] * lnJn + P[37] * now
            + P[38] * w[_WAS + d]
        )  # fmt: skip
        w[_ENERGY + _1 + d] += volume * w[_AFTER + _5 + d]
        w[_ENERGY + d] += volume * (P[27] * e1 + P[28] * e2 + P[29] * e3 + 0.5 * dlame * trace * trace + dG * squares)
        w[_AFTER + d], w[_AFTER + _3 + d], w[_AFTER + _1 + d] = _rotated(P, P[30] * e1, P[31] * e2, P[26] * d12)
        w[_AFTER + _2 + d] = P[32] * e3
        # V = V_n/(α^m J_n): its rate is div x_n′ − m (ln α)′ − (ln J_n)′
        g0, g1, g2 = w[_GRADIENT + d], w[_GRADIENT + _1 + d], w[_GRADIENT + _2 + d]
        g3, g4 = w[_GRADIENT + _3 + d], w[_GRADIENT + _4 + d]
        dV = g0 + g3 + g4 - w[_MIDDLE_TRACE + d] - lnJn
        common = dlame * trace + lame * (d1 + d2 + d3)
        r11, r12, r22 = _rotated(
            P, common + 2.0 * (dG * P[22] + G * e1), common + 2.0 * (dG * P[23] + G * e2), P[25] * d12
        )
        r33 = common + 2.0 * (dG * P[24] + G * e3)
        # the gradients of N turn and stretch with the places: (∇N)′ = −(∇x′)ᵀ ∇N
        k12 = dV * s12 + r12
        m11, m12 = V * (dV * s11 + r11 - s11 * g0 - s12 * g1), V * (k12 - s11 * g2 - s12 * g3)
        m21, m22 = V * (k12 - s12 * g0 - s22 * g1), V * (dV * s22 + r22 - s12 * g2 - s22 * g3)
        m33 = V * (dV * s33 + r33 - s33 * g4)
        w[_FORCE + d] += m11 * x0 + m12 * y0 + m33 * h0
        w[_FORCE + _1 + d] += m21 * x0 + m22 * y0
        w[_FORCE + _2 + d] += m11 * x1 + m12 * y1 + m33 * h1
        w[_FORCE + _3 + d] += m21 * x1 + m22 * y1
        w[_FORCE + _4 + d] += m11 * x2 + m12 * y2 + m33 * h2
        w[_FORCE + _5 + d] += m21 * x2 + m22 * y2
        w[_FORCE + _6 + d] += m11 * x3 + m12 * y3 + m33 * h3
        w[_FORCE + _7 + d] += m21 * x3 + m22 * y3


@njit(cache=True, error_model="numpy", forceinline=True)
def _filled(dold, at, fields, count, w):
    """Histories (fields, d) of a point, from ``at`` on in an array, → the rows before; beyond d, lanes mean nothing."""
    for k in range(fields):
        eight(dold, at + k * count, w, _BEFORE + k * LANES)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _ways(s, k, ways, w):
    """What directions change of flow stresses, by their slopes s (3, m) along `WAYS` ways from k on, is added to rows of w.

    ways: the row from which on directions say how far they go along those.
    """
    a0, a1, a2, a3, a4 = s[0, k], s[0, k + 1], s[0, k + 2], s[0, k + 3], s[0, k + 4]
    b0, b1, b2, b3, b4 = s[1, k], s[1, k + 1], s[1, k + 2], s[1, k + 3], s[1, k + 4]
    c0, c1, c2, c3, c4 = s[2, k], s[2, k + 1], s[2, k + 2], s[2, k + 3], s[2, k + 4]
    for d in range(LANES):
        x0, x1, x2, x3, x4 = w[ways + d], w[ways + _1 + d], w[ways + _2 + d], w[ways + _3 + d], w[ways + _4 + d]
        w[_NOW + d] += a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3 + a4 * x4
        w[_WAS + d] += b0 * x0 + b1 * x1 + b2 * x2 + b3 * x3 + b4 * x4
        w[_COMMITTED + d] += c0 * x0 + c1 * x1 + c2 * x2 + c3 * x3 + c4 * x4


@njit(cache=True, error_model="numpy", forceinline=True)
def _put(w, fields, count, dnew, at):
    """The rows after → histories of a point, one after the other: each is put over what the one before wrote beyond its end."""
    for k in range(fields):
        eight(w, _AFTER + k * LANES, dnew, at + k * count)


@njit(cache=True, error_model="numpy", forceinline=True)
def _add(w, fields, count, dnew, at):
    """The rows after are added to histories of a point; what follows in the array stays as it is."""
    eight(dnew, at + fields * count, w, _NOW)
    for k in range(fields):
        add_eight(dnew, at + k * count, w, _AFTER + k * LANES)
    _put(w, fields, count, dnew, at)
    eight(w, _NOW, dnew, at + fields * count)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def at_fixed(
    cells, geometry, point, bulk, G, axisymmetric, volume, dxn, dx, dold, moduli, slopes, dflow, r, dnew, energy, begun
):  # fmt: skip
    """Of `LANES` directions: dxn, dx (n, 2, LANES), dold, moduli (2, LANES): bulk, shear → r (n, 2, LANES), dnew.

    dx is (0, 2, LANES) where no present place moves. dold (e, 4, h, d) of the committed histories, dnew of the new ones, of the
    d of `LANES` directions that there are, see `histories`; begun (e, 4, n) of `slopes_of_begun`, (0, 4, n) where increments
    begin with these. dflow (m, LANES): changes of a flow curve, of which the stress has the slopes (e, 4, 3, m), see
    `flow_gradients`; m is a multiple of `WAYS`. Forces r and energy (2, LANES), ∫ψ dV and plastic work, are added to; volume
    (e, 4).
    """
    moved, moves, fields, kinds = len(begun) > 0, len(dx) > 0, dold.shape[2], dflow.shape[0]
    part = 1.0 / 3.0 if axisymmetric else 0.5
    hoop = part if axisymmetric else 0.0
    w, count = np.zeros(_END + kinds * LANES), dold.shape[3]
    then, now, before, after, forces = dxn.reshape(-1), dx.reshape(-1), dold.reshape(-1), dnew.reshape(-1), r.reshape(-1)
    for d in range(LANES):
        w[_LAME + d] = moduli[0, d] - 2.0 * moduli[1, d] / 3.0
        w[_SHEAR + d] = moduli[1, d]
        for k in range(kinds):
            w[_END + k * LANES + d] = dflow[k, d]
    for e in range(cells.shape[0]):
        _motions(then, cells, e, w, _OLD)
        if moves:
            _motions(now, cells, e, w, _PRESENT)
            _gradients(w, _PRESENT, geometry[e, _MIDDLE], _GRADIENT)
        w[_FORCE:_BEFORE] = 0.0
        _rates(w, geometry[e, _MIDDLE])
        eight(w, _TRACE, w, _MIDDLE_TRACE)
        for q in range(4):
            if moves:
                _gradients(w, _PRESENT, geometry[e, q], _GRADIENT)
            _rates(w, geometry[e, q])
            at = (4 * e + q) * fields * count
            _filled(before, at, fields, count, w)
            w[_NOW:_LAME] = 0.0
            w[_COMMITTED:_END] = 0.0
            for k in range(0, kinds, WAYS):
                _ways(slopes[e, q], k, _END + k * LANES, w)
            if moved:
                add_eight(w, _WAS, w, _COMMITTED)
                begun_along(begun[e, q], w, _BEFORE, _COMMITTED)
            _answer(w, _values(point[e, q]), geometry[e, q], bulk, G, part, hoop, volume[e, q])
            _put(w, fields, count, after, at)
        for k in range(8):
            add_eight(w, _FORCE + k * LANES, forces, (2 * cells[e, k // 2] + k % 2) * LANES)
    for d in range(LANES):
        energy[0, d] += w[_ENERGY + d]
        energy[1, d] += w[_ENERGY + _1 + d]


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _answer_along(w, P, G, part, hoop, volume):
    """Of a point: histories and energies of directions in which the present places alone move, from the other rows of w."""
    b11, b12, b22, b33, T11, T12, T22, T33 = P[5], P[6], P[7], P[8], P[44], P[45], P[46], P[47]
    for d in range(LANES):
        g0, l1, l2 = w[_GRADIENT + d], w[_GRADIENT + _1 + d], w[_GRADIENT + _2 + d]
        g3, g4 = w[_GRADIENT + _3 + d], w[_GRADIENT + _4 + d]
        lna = w[_MIDDLE_TRACE + d] - (g0 + g3 + g4)
        l0, l3, l4 = g0 + part * lna, g3 + part * lna, g4 + hoop * lna
        t11, t12 = 2.0 * (l0 * b11 + l1 * b12), l0 * b12 + l1 * b22 + l2 * b11 + l3 * b12
        t22, t33 = 2.0 * (l2 * b12 + l3 * b22), 2.0 * l4 * b33
        w[_AFTER + _6 + d], w[_AFTER + _7 + d] = 2.0 * (l0 * T11 + l1 * T12), 2.0 * (l2 * T12 + l3 * T22)
        w[_AFTER + _8 + d], w[_AFTER + _9 + d] = 2.0 * l4 * T33, l0 * T12 + l1 * T22 + l2 * T11 + l3 * T12
        d1, d2, d3, d12 = _principal(P, t11, t12, t22, t33)
        dp, e1, e2, e3 = _returned(P, G, d1, d2, d3, 0.0)
        w[_ENERGY + d] += volume * (P[27] * e1 + P[28] * e2 + P[29] * e3)
        w[_AFTER + d], w[_AFTER + _3 + d], w[_AFTER + _1 + d] = _rotated(P, P[30] * e1, P[31] * e2, P[26] * d12)
        w[_AFTER + _2 + d] = P[32] * e3
        w[_AFTER + _4 + d], w[_AFTER + _5 + d] = dp, P[33] * dp + P[35] * (d1 + d2 + d3)
        w[_ENERGY + _1 + d] += volume * w[_AFTER + _5 + d]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def along(cells, geometry, point, G, axisymmetric, volume, dx, dnew, energy):
    """Add what motions dx (n, 2, LANES) of the present nodes make of histories dnew (e, 4, h, d) and of energy (2, LANES)."""
    part = 1.0 / 3.0 if axisymmetric else 0.5
    hoop = part if axisymmetric else 0.0
    fields, count = dnew.shape[2], dnew.shape[3]
    w, now, after = np.zeros(_END), dx.reshape(-1), dnew.reshape(-1)
    for e in range(cells.shape[0]):
        _motions(now, cells, e, w, _PRESENT)
        _gradients(w, _PRESENT, geometry[e, _MIDDLE], _GRADIENT)
        for d in range(LANES):
            w[_MIDDLE_TRACE + d] = w[_GRADIENT + d] + w[_GRADIENT + _3 + d] + w[_GRADIENT + _4 + d]
        for q in range(4):
            _gradients(w, _PRESENT, geometry[e, q], _GRADIENT)
            _answer_along(w, _values(point[e, q]), G, part, hoop, volume[e, q])
            _add(w, fields, count, after, (4 * e + q) * fields * count)
    for d in range(LANES):
        energy[0, d] += w[_ENERGY + d]
        energy[1, d] += w[_ENERGY + _1 + d]


@njit(cache=True, error_model="numpy")
def in_volumes(point, bulk, G, new, dvolume, energy):
    """Add to energy (2, d) what initial volumes that change by dvolume (e, 4, d) hold of it; point: see `prepare`."""
    lame = bulk - 2.0 * G / 3.0
    for e in range(dvolume.shape[0]):
        for q in range(4):
            x1, x2, x3 = point[e, q, 22], point[e, q, 23], point[e, q, 24]
            trace = x1 + x2 + x3
            stored = 0.5 * lame * trace * trace + G * (x1 * x1 + x2 * x2 + x3 * x3)
            plastic = new[e, q, 5] if new.shape[2] > 5 else 0.0
            for d in range(dvolume.shape[2]):
                energy[0, d] += dvolume[e, q, d] * stored
                energy[1, d] += dvolume[e, q, d] * plastic
