"""Derivatives of F-bar quadrilaterals of isotropic metal along directions: of forces, history and energy, for many at once.

Finite strain, plane strain and axisymmetry, Hencky's elasticity and J2 plasticity with compiled flow curves; which points flow
is that of the increment. Everything is linear in a direction: motions of the committed and of the present nodes x_n′ and x′, the
history before h_n′, moduli and the flow curve. With l = ∇x′ − f ∇x_n′ f⁻¹ + I (ln α)′ the trial tensor b = f b_n fᵀ changes by
l b + b lᵀ + f b_n′ fᵀ, its principal strains by b′_ii/2b_i, and the return map linearised there gives the rest (Michaleris,
Tortorelli and Vidal 1994; de Souza Neto, Perić and Owen 2008, ch. 14). Forces are r_a = Σ V τ ∇N_a with the present gradients
and V = V_n/(α^m J_n), J_n = √det b_n.

`prepare` computes what all directions share; `at_fixed` is a direction with x′ as given, `along` adds what further x′ make of
the history. `begin` comes before: what a direction makes of the histories that the increment begins with, see
`prensa.materials.laws.J2`.
"""

from __future__ import annotations

import math

import numpy as np

from prensa.elements.q4 import _DX, _DY, _N
from prensa.kernels.compiled import njit
from prensa.kernels.tensor import principal
from prensa.materials.hardening import flow_gradient, flow_stress, slope_before

PER_PLACE = 17  # numbers a point: ∂N/∂x, ∂N/∂y, N/r (4 each) in the present places, F = ∂x/∂x_n (5: 11, 12, 21, 22, 33)
PER_POINT = 48  # numbers a point of `prepare`, in the order in which it writes them
_MIDDLE = 4


@njit(cache=True, error_model="numpy")
def prepare(x_n, x, cells, old, new, bulk, G, axisymmetric, scale, plastic, cauchy, kind, p, knots, coefs, dt, geometry, point):
    """Node positions x_n, x (n, 2), histories old, new (e, 4, h) → geometry (e, 5, 17), point (e, 4, 48)."""
    curve = (p[0], p[1], p[2], p[3], p[4])
    J, m = np.empty(5), 3.0 if axisymmetric else 2.0
    for e in range(cells.shape[0]):
        for q in range(5):
            g = geometry[e, q]
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
            for k in range(4):
                d1, d2 = _DX[q, k], _DY[q, k]
                g[k], g[4 + k] = (c22 * d1 - c21 * d2) / dc, (c11 * d2 - c12 * d1) / dc
                g[8 + k] = _N[q, k] / r if axisymmetric else 0.0
            g[12], g[13] = (c11 * a22 - c12 * a21) / dn, (c12 * a11 - c11 * a12) / dn
            g[14], g[15] = (c21 * a22 - c22 * a21) / dn, (c22 * a11 - c21 * a12) / dn
            g[16] = r / rn if axisymmetric else 1.0
            J[q] = dc / dn * g[16]
            if q < 4:
                point[e, q, 43] = scale * dn * (rn if axisymmetric else 1.0)
        for q in range(4):
            g, P = geometry[e, q], point[e, q]
            alpha = (J[4] / J[q]) ** (1.0 / m)
            f0, f1, f2, f3 = alpha * g[12], alpha * g[13], alpha * g[14], alpha * g[15]
            f4 = alpha * g[16] if axisymmetric else 1.0
            o1, o2, o3, o12 = 1.0 + old[e, q, 0], 1.0 + old[e, q, 1], 1.0 + old[e, q, 2], old[e, q, 3]
            w11, w12, w21, w22 = f0 * o1 + f1 * o12, f0 * o12 + f1 * o2, f2 * o1 + f3 * o12, f2 * o12 + f3 * o2
            b11, b12, b22, b33 = w11 * f0 + w12 * f1, w11 * f2 + w12 * f3, w21 * f2 + w22 * f3, f4 * f4 * o3
            B1, B2, c, s = principal(b11, b22, b12)
            e1, e2, e3 = 0.5 * math.log(B1), 0.5 * math.log(B2), 0.5 * math.log(b33)
            trace = e1 + e2 + e3
            third = trace / 3.0
            e1, e2, e3 = e1 - third, e2 - third, e3 - third
            size = math.sqrt(1.5 * (e1 * e1 + e2 * e2 + e3 * e3))
            det = o1 * o2 - o12 * o12
            Jn = math.sqrt(det * o3)
            delta = n1 = n2 = n3 = soft = volume = before = explicit = shear = ratio = 0.0
            work, work_before, work_trace, work_Jn, work_new, work_old = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            if plastic:
                delta = new[e, q, 4] - old[e, q, 4]
            if delta != 0.0:
                n1, n2, n3 = 1.5 * e1 / size, 1.5 * e2 / size, 1.5 * e3 / size
                ratio = delta / size
                was, now = old[e, q, 4], new[e, q, 4]
                y, dy, _ = flow_stress(kind, curve, knots, coefs, now, delta, dt)
                by_old = slope_before(kind, curve, now, delta, dt, dy)
                y0, dy0, _ = flow_stress(kind, curve, knots, coefs, was, 0.0, dt)
                j, jn = (math.exp(trace), Jn) if cauchy else (1.0, 1.0)
                soft = 1.0 / (3.0 * G + j * dy)
                volume, before, explicit = (j * y * soft if cauchy else 0.0), j * by_old * soft, j * soft
                shear = (2.0 * size - 3.0 * delta) * soft
                half = 0.5 * delta
                work = 0.5 * (jn * y0 + j * y) + half * j * dy
                work_before, work_new, work_old = half * (jn * dy0 + j * by_old), half * j, half * jn
                work_trace, work_Jn = (half * j * y, half * jn * y0) if cauchy else (0.0, 0.0)
            x1, x2, x3 = e1 + third - delta * n1, e2 + third - delta * n2, e3 + third - delta * n3
            lame = bulk - 2.0 * G / 3.0
            t1, t2, t3 = lame * trace + 2.0 * G * x1, lame * trace + 2.0 * G * x2, lame * trace + 2.0 * G * x3
            E1, E2, E3 = math.exp(2.0 * x1), math.exp(2.0 * x2), math.exp(2.0 * x3)
            if abs(B1 - B2) > 1e-7 * (abs(B1 - 1.0) + abs(B2 - 1.0)) + 1e-14:
                s_tau, s_b = (t1 - t2) / (B1 - B2), (E1 - E2) / (B1 - B2)
            else:
                theta = 1.0 - 1.5 * ratio
                s_tau, s_b = G * theta / B1, E1 * theta / B1
            P[0], P[1], P[2], P[3], P[4] = f0, f1, f2, f3, f4
            P[5], P[6], P[7], P[8] = b11, b12, b22, b33
            P[9], P[10], P[11], P[12] = 0.5 / B1, 0.5 / B2, c, s
            P[13], P[14], P[15], P[16] = n1, n2, n3, ratio
            P[17], P[18], P[19], P[20], P[21] = soft, volume, before, explicit, shear
            P[22], P[23], P[24], P[25], P[26] = x1, x2, x3, s_tau, s_b
            P[27], P[28], P[29] = t1, t2, t3
            P[30], P[31], P[32] = 2.0 * E1, 2.0 * E2, 2.0 * E3
            P[33], P[34], P[35], P[36], P[37], P[38] = work, work_before, work_trace, work_Jn, work_new, work_old
            P[39], P[40], P[41], P[42] = 0.5 * o2 / det, 0.5 * o1 / det, -o12 / det, 0.5 / o3  # (ln J_n)′ of b_n′
            P[43] /= alpha**m * Jn
            if plastic:
                P[44], P[45] = 1.0 + new[e, q, 6], new[e, q, 9]  # the trial tensor
                P[46], P[47] = 1.0 + new[e, q, 7], 1.0 + new[e, q, 8]


@njit(cache=True, error_model="numpy")
def flow_gradients(kind, p, knots, coefs, old, new, dt, dknots, dcoefs, out, tabled):
    """Derivatives of a flow stress by its scalars p (5,) at the points now and before → out (e, 4, 2, 5), 0 where nothing flows.

    tabled (e, 4, 2): what changes dknots (k,), dcoefs (k − 1, 4) of a table make of it.
    """
    curve = (p[0], p[1], p[2], p[3], p[4])
    for e in range(old.shape[0]):
        for q in range(old.shape[1]):
            was, now = old[e, q, 4], new[e, q, 4]
            tabled[e, q, 0] = tabled[e, q, 1] = 0.0
            if was == now:
                out[e, q] = 0.0
                continue
            tabled[e, q, 0] = flow_gradient(kind, curve, knots, coefs, now, now - was, dt, dknots, dcoefs, out[e, q, 0])
            tabled[e, q, 1] = flow_gradient(kind, curve, knots, coefs, was, 0.0, dt, dknots, dcoefs, out[e, q, 1])


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
def _history(P, x1, x2, x3, d12, out):
    """Rates of the principal elastic strains and the shear of b → of b_e − I (11, 22, 33, 12), added to out."""
    b11, b12, b22 = _rotated(P, P[30] * x1, P[31] * x2, P[26] * d12)
    out[0] += b11
    out[1] += b22
    out[2] += P[32] * x3
    out[3] += b12


@njit(cache=True, error_model="numpy", forceinline=True)
def _trial(P, l0, l1, l2, l3, l4, out):
    """Add l b + b lᵀ of the trial tensor b to its columns in out."""
    b11, b12, b22, b33 = P[44], P[45], P[46], P[47]
    out[6] += 2.0 * (l0 * b11 + l1 * b12)
    out[7] += 2.0 * (l2 * b12 + l3 * b22)
    out[8] += 2.0 * l4 * b33
    out[9] += l0 * b12 + l1 * b22 + l2 * b11 + l3 * b12


@njit(cache=True, error_model="numpy", forceinline=True)
def _rotated(P, t1, t2, t12):
    """Components 11, 12, 22 of a tensor given in the principal frame."""
    c, s = P[11], P[12]
    cc, cs, ss = c * c, c * s, s * s
    return cc * t1 + ss * t2 - 2.0 * cs * t12, cs * (t1 - t2) + (cc - ss) * t12, ss * t1 + cc * t2 + 2.0 * cs * t12


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def at_fixed(
    cells, geometry, point, bulk, G, axisymmetric, plastic, volume, dxn, dx, dold, dbulk, dG, flow, dflow, r, dnew, energy
):  # fmt: skip
    """Of directions d: dxn, dx (d, n, 2), dold (d, e, 4, h), moduli dbulk, dG (d,) → forces r (d, ndof), histories dnew.

    flow (d,): row of dflow (·, e, 4, 2), the flow stress's own change, or −1. r and energy (d,), ∫ψ dV, are added to;
    volume (e, 4). Without rows dx (0, n, 2) no present place moves.
    """
    moves = len(dx) > 0
    part = 1.0 / 3.0 if axisymmetric else 0.5
    g, L, traces = np.empty((4, 5)), np.empty((4, 5)), np.empty((5, 2))
    for e in range(cells.shape[0]):
        for d in range(dxn.shape[0]):
            for q in range(5):
                B = geometry[e, q]
                g0 = g1 = g2 = g3 = g4 = h0 = h1 = h2 = h3 = h4 = 0.0
                if moves:
                    for k in range(4):
                        node = cells[e, k]
                        u1, u2, b0, b1 = dx[d, node, 0], dx[d, node, 1], B[k], B[4 + k]
                        g0 += u1 * b0
                        g1 += u1 * b1
                        g2 += u2 * b0
                        g3 += u2 * b1
                        g4 += u1 * B[8 + k]
                for k in range(4):
                    node = cells[e, k]
                    v1, v2 = dxn[d, node, 0], dxn[d, node, 1]
                    b0, b1, b2 = B[k], B[4 + k], B[8 + k]
                    h0 += v1 * b0
                    h1 += v1 * b1
                    h2 += v2 * b0
                    h3 += v2 * b1
                    h4 += v1 * b2
                # ∇x_n′ in the present places takes an f from the left: l = ∇x′ − f (∂x_n′/∂x)
                f0, f1, f2, f3, f4 = B[12], B[13], B[14], B[15], B[16]
                l0, l1, l2, l3 = g0 - f0 * h0 - f1 * h2, g1 - f0 * h1 - f1 * h3, g2 - f2 * h0 - f3 * h2, g3 - f2 * h1 - f3 * h3
                l4 = g4 - f4 * h4
                traces[q, 0], traces[q, 1] = g0 + g3 + g4, l0 + l3 + l4
                if q < 4:
                    g[q, 0], g[q, 1], g[q, 2], g[q, 3], g[q, 4] = g0, g1, g2, g3, g4
                    L[q, 0], L[q, 1], L[q, 2], L[q, 3], L[q, 4] = l0, l1, l2, l3, l4
            for q in range(4):
                P, B, o = point[e, q], geometry[e, q], dold[d, e, q]
                lna = part * (traces[_MIDDLE, 1] - traces[q, 1])
                l0, l1, l2, l3, l4 = L[q, 0] + lna, L[q, 1], L[q, 2], L[q, 3] + lna, L[q, 4]
                if axisymmetric:
                    l4 += lna
                f0, f1, f2, f3, f4, b11, b12, b22, b33 = P[0], P[1], P[2], P[3], P[4], P[5], P[6], P[7], P[8]
                o1, o2, o3, o12 = o[0], o[1], o[2], o[3]
                w11, w12, w21, w22 = f0 * o1 + f1 * o12, f0 * o12 + f1 * o2, f2 * o1 + f3 * o12, f2 * o12 + f3 * o2
                d1, d2, d3, d12 = _principal(
                    P, w11 * f0 + w12 * f1 + 2.0 * (l0 * b11 + l1 * b12),
                    w11 * f2 + w12 * f3 + l0 * b12 + l1 * b22 + l2 * b11 + l3 * b12,
                    w21 * f2 + w22 * f3 + 2.0 * (l2 * b12 + l3 * b22), f4 * f4 * o3 + 2.0 * l4 * b33,
                )  # fmt: skip
                lnJn = P[39] * o1 + P[40] * o2 + P[41] * o12 + P[42] * o3
                own = now = was = 0.0
                if plastic:
                    if flow[d] >= 0:
                        now, was = dflow[flow[d], e, q, 0], dflow[flow[d], e, q, 1]
                    own = P[21] * dG[d] - P[19] * o[4] - P[20] * now
                dp, x1, x2, x3 = _returned(P, G, d1, d2, d3, own)
                if plastic:
                    dnew[d, e, q, 4] = o[4] + dp
                    dnew[d, e, q, 5] = (
                        o[5] + P[33] * dp + P[34] * o[4] + P[35] * (d1 + d2 + d3) + P[36] * lnJn + P[37] * now + P[38] * was
                    )
                trace, dlame = P[22] + P[23] + P[24], dbulk[d] - 2.0 * dG[d] / 3.0
                energy[d] += volume[e, q] * (
                    P[27] * x1 + P[28] * x2 + P[29] * x3
                    + 0.5 * dlame * trace * trace + dG[d] * (P[22] * P[22] + P[23] * P[23] + P[24] * P[24])
                )  # fmt: skip
                dnew[d, e, q, :4] = 0.0
                _history(P, x1, x2, x3, d12, dnew[d, e, q])
                if plastic and P[17] == 0.0:
                    dnew[d, e, q, 6:10] = dnew[d, e, q, :4]
                elif plastic:
                    t11, t22, t33, t12 = o[6], o[7], o[8], o[9]
                    w11, w12, w21, w22 = f0 * t11 + f1 * t12, f0 * t12 + f1 * t22, f2 * t11 + f3 * t12, f2 * t12 + f3 * t22
                    dnew[d, e, q, 6], dnew[d, e, q, 7] = w11 * f0 + w12 * f1, w21 * f2 + w22 * f3
                    dnew[d, e, q, 8], dnew[d, e, q, 9] = f4 * f4 * t33, w11 * f2 + w12 * f3
                    _trial(P, l0, l1, l2, l3, l4, dnew[d, e, q])
                # V = V_n/(α^m J_n): its rate is div x_n′ − m (ln α)′ − (ln J_n)′
                V = P[43]
                dV = V * (traces[q, 0] - traces[_MIDDLE, 1] - lnJn)
                common = dlame * trace + (bulk - 2.0 * G / 3.0) * (d1 + d2 + d3)
                t1 = common + 2.0 * (dG[d] * P[22] + G * x1)
                t2 = common + 2.0 * (dG[d] * P[23] + G * x2)
                t3 = common + 2.0 * (dG[d] * P[24] + G * x3)
                s11, s12, s22 = _rotated(P, P[27], P[28], 0.0)
                r11, r12, r22 = _rotated(P, t1, t2, P[25] * d12)
                k11, k12, k22, k33 = dV * s11 + V * r11, dV * s12 + V * r12, dV * s22 + V * r22, dV * P[29] + V * t3
                s11, s12, s22, s33 = V * s11, V * s12, V * s22, V * P[29]
                # the gradients of N turn and stretch with the places: (∇N)′ = −(∇x′)ᵀ ∇N
                g0, g1, g2, g3, g4 = g[q, 0], g[q, 1], g[q, 2], g[q, 3], g[q, 4]
                m11, m12 = k11 - s11 * g0 - s12 * g1, k12 - s11 * g2 - s12 * g3
                m21, m22 = k12 - s12 * g0 - s22 * g1, k22 - s12 * g2 - s22 * g3
                m33 = k33 - s33 * g4
                for k in range(4):
                    node = cells[e, k]
                    r[d, 2 * node] += m11 * B[k] + m12 * B[4 + k] + m33 * B[8 + k]
                    r[d, 2 * node + 1] += m21 * B[k] + m22 * B[4 + k]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def along(cells, geometry, point, G, axisymmetric, plastic, volume, dx, dnew, energy):
    """What motions dx (d, n, 2) of the present nodes add to histories dnew (d, e, 4, h) and to ∫ψ dV, energy (d,)."""
    part = 1.0 / 3.0 if axisymmetric else 0.5
    L = np.empty((5, 5))
    for e in range(cells.shape[0]):
        for d in range(dx.shape[0]):
            for q in range(5):
                B = geometry[e, q]
                g0 = g1 = g2 = g3 = g4 = 0.0
                for k in range(4):
                    node = cells[e, k]
                    u1, u2 = dx[d, node, 0], dx[d, node, 1]
                    b0, b1 = B[k], B[4 + k]
                    g0 += u1 * b0
                    g1 += u1 * b1
                    g2 += u2 * b0
                    g3 += u2 * b1
                    g4 += u1 * B[8 + k]
                L[q, 0], L[q, 1], L[q, 2], L[q, 3], L[q, 4] = g0, g1, g2, g3, g4
            middle = L[_MIDDLE, 0] + L[_MIDDLE, 3] + L[_MIDDLE, 4]
            for q in range(4):
                P, out = point[e, q], dnew[d, e, q]
                lna = part * (middle - (L[q, 0] + L[q, 3] + L[q, 4]))
                l0, l1, l2, l3, l4 = L[q, 0] + lna, L[q, 1], L[q, 2], L[q, 3] + lna, L[q, 4]
                if axisymmetric:
                    l4 += lna
                b11, b12, b22, b33 = P[5], P[6], P[7], P[8]
                d1, d2, d3, d12 = _principal(
                    P, 2.0 * (l0 * b11 + l1 * b12), l0 * b12 + l1 * b22 + l2 * b11 + l3 * b12,
                    2.0 * (l2 * b12 + l3 * b22), 2.0 * l4 * b33,
                )  # fmt: skip
                dp, x1, x2, x3 = _returned(P, G, d1, d2, d3, 0.0)
                if plastic:
                    out[4] += dp
                    out[5] += P[33] * dp + P[35] * (d1 + d2 + d3)
                energy[d] += volume[e, q] * (P[27] * x1 + P[28] * x2 + P[29] * x3)
                _history(P, x1, x2, x3, d12, out)
                if plastic and P[17] == 0.0:
                    out[6:10] = out[:4]
                elif plastic:
                    _trial(P, l0, l1, l2, l3, l4, out)


@njit(cache=True, error_model="numpy", forceinline=True)
def _logarithm(b11, b22, b33, b12):
    """Of b − I: ½ ln b as 11, 22, 33, 12, and what `_log_rate` needs: frame, 1/(2 b_i), divided difference."""
    l1, l2, c, s = principal(b11, b22, b12)
    e1, e2, e3 = 0.5 * math.log1p(l1), 0.5 * math.log1p(l2), 0.5 * math.log1p(b33)
    apart = abs(l1 - l2) > 1e-7 * (abs(l1) + abs(l2)) + 1e-14
    shear = (e1 - e2) / (l1 - l2) if apart else 1.0 / (2.0 + l1 + l2)
    return (
        (c * c * e1 + s * s * e2, s * s * e1 + c * c * e2, e3, c * s * (e1 - e2)),
        (c, s, 0.5 / (1.0 + l1), 0.5 / (1.0 + l2), 0.5 / (1.0 + b33), shear),
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _isotropic_rate(at, r11, r22, r33, r12):
    """Rate of an isotropic function by that of its argument; at: frame, slopes of the principal values, divided difference."""
    c, s, a1, a2, a3, shear = at
    cc, cs, ss = c * c, c * s, s * s
    p1, p2 = a1 * (cc * r11 + 2.0 * cs * r12 + ss * r22), a2 * (ss * r11 - 2.0 * cs * r12 + cc * r22)
    p12 = shear * (cs * (r22 - r11) + (cc - ss) * r12)
    return cc * p1 + ss * p2 - 2.0 * cs * p12, ss * p1 + cc * p2 + 2.0 * cs * p12, a3 * r33, cs * (p1 - p2) + (cc - ss) * p12


@njit(cache=True, error_model="numpy")
def begin(history, begun, share, cauchy, kind, p, knots, coefs, dhistory, flow, dflow, out):
    """Directions dhistory (d, e, 4, h) of committed histories → of those that the increment begins with, out (d, e, 4, h).

    history, begun (e, 4, h): before and after `prensa.materials.laws.J2.begin`; flow (d,) and dflow as in `at_fixed`, of the
    plastic strains of begun and of history.
    """
    curve = (p[0], p[1], p[2], p[3], p[4])
    for e in range(history.shape[0]):
        for q in range(history.shape[1]):
            h, now, was = history[e, q], begun[e, q, 4], history[e, q, 4]
            if now == was:
                for d in range(dhistory.shape[0]):
                    out[d, e, q] = dhistory[d, e, q]
                    out[d, e, q, 6:10] = dhistory[d, e, q, :4]
                continue
            (e11, e22, e33, e12), elastic = _logarithm(h[0], h[1], h[2], h[3])
            (d11, d22, d33, d12), trial = _logarithm(h[6], h[7], h[8], h[9])
            d11, d22, d33, d12 = d11 - e11, d22 - e22, d33 - e33, d12 - e12
            third = (d11 + d22 + d33) / 3.0
            d11, d22, d33 = d11 - third, d22 - third, d33 - third
            size = math.sqrt((d11 * d11 + d22 * d22 + d33 * d33 + 2.0 * d12 * d12) / 1.5)
            x1, x2, c, s = principal(e11 - share * d11, e22 - share * d22, e12 - share * d12)
            E1, E2, E3 = math.exp(2.0 * x1), math.exp(2.0 * x2), math.exp(2.0 * (e33 - share * d33))
            apart = abs(x1 - x2) > 1e-7 * (abs(x1) + abs(x2)) + 1e-14
            after = (c, s, 2.0 * E1, 2.0 * E2, 2.0 * E3, (E1 - E2) / (x1 - x2) if apart else E1 + E2)
            y0, dy0, _ = flow_stress(kind, curve, knots, coefs, was, 0.0, 1.0)
            y1, dy1, _ = flow_stress(kind, curve, knots, coefs, now, 0.0, 1.0)
            j, more = (math.exp(e11 + e22 + e33) if cauchy else 1.0), now - was
            for d in range(dhistory.shape[0]):
                o, r = dhistory[d, e, q], out[d, e, q]
                r11, r22, r33, r12 = _isotropic_rate(elastic, o[0], o[1], o[2], o[3])
                s11, s22, s33, s12 = _isotropic_rate(trial, o[6], o[7], o[8], o[9])
                s11, s22, s33, s12 = s11 - r11, s22 - r22, s33 - r33, s12 - r12
                part = (s11 + s22 + s33) / 3.0
                s11, s22, s33 = s11 - part, s22 - part, s33 - part
                grown = share * (d11 * s11 + d22 * s22 + d33 * s33 + 2.0 * d12 * s12) / (1.5 * size)
                own = 0.0
                if flow[d] >= 0:
                    own = dflow[flow[d], e, q, 0] + dflow[flow[d], e, q, 1]
                r[6], r[7], r[8], r[9] = o[0], o[1], o[2], o[3]
                r[4] = o[4] + grown
                change = (dy0 + dy1) * o[4] + dy1 * grown + own
                if cauchy:
                    change += (y0 + y1) * (r11 + r22 + r33)
                r[5] = o[5] + 0.5 * j * (change * more + (y0 + y1) * grown)
                r[0], r[1], r[2], r[3] = _isotropic_rate(
                    after, r11 - share * s11, r22 - share * s22, r33 - share * s33, r12 - share * s12
                )
