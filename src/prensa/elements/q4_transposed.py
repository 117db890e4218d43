"""Transposes of the maps of `prensa.elements.q4_directions`: what forces and histories of an increment owe to what made them.

Where a direction takes motions, histories and moduli to forces and histories, here weights of the forces r̄ and of the histories
h̄ come back as weights of those (the reverse of the same lines, last one first; Griewank and Walther 2008, ch. 3). Plastic work
has no weight: nothing that is measured here depends on it.
"""

from __future__ import annotations

import numpy as np

from prensa.kernels.compiled import njit
from prensa.materials.hardening import flow_gradient

_MIDDLE = 4


@njit(cache=True, error_model="numpy", forceinline=True)
def _turned_back(P, b11, b12, b22):
    """Weights of the components 11, 12, 22 → of those in the principal frame, 11, 22, 12."""
    c, s = P[11], P[12]
    cc, cs, ss = c * c, c * s, s * s
    return cc * b11 + cs * b12 + ss * b22, ss * b11 - cs * b12 + cc * b22, (cc - ss) * b12 + 2.0 * cs * (b22 - b11)


@njit(cache=True, error_model="numpy", forceinline=True)
def _trial(P, G, x1, x2, x3, plastic):
    """Weights of the elastic strains (3) and of the plastic strain → of the trial strains (3) and of the plastic strain's own."""
    n1, n2, n3, ratio = P[13], P[14], P[15], P[16]
    h = 1.5 * ratio
    turn = -(n1 * x1 + n2 * x2 + n3 * x3)
    own = plastic + turn
    along = 2.0 * G * P[17] * own - ratio * turn
    trace = (x1 + x2 + x3) * h / 3.0 - P[18] * own
    rest = 1.0 - h
    return rest * x1 + n1 * along + trace, rest * x2 + n2 * along + trace, rest * x3 + n3 * along + trace, own


@njit(cache=True, error_model="numpy", forceinline=True)
def _tensor(P, d1, d2, d3, d12):
    """Weights of the principal trial strains (3) and the shear → of b (11, 12, 22, 33)."""
    c, s = P[11], P[12]
    cc, cs, ss = c * c, c * s, s * s
    a1, a2 = P[9] * d1, P[10] * d2
    return (
        cc * a1 + ss * a2 - cs * d12, 2.0 * cs * (a1 - a2) + (cc - ss) * d12, ss * a1 + cc * a2 + cs * d12, 0.5 * d3 / P[8],
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _gradients(B11, B12, B22, B33, b11, b12, b22, b33, out):
    """Weights of b, a tensor B that goes with the motion, → added to those of its gradients l (11, 12, 21, 22, 33), out."""
    out[0] += 2.0 * B11 * b11 + B12 * b12
    out[1] += 2.0 * B12 * b11 + B22 * b12
    out[2] += B11 * b12 + 2.0 * B12 * b22
    out[3] += B12 * b12 + 2.0 * B22 * b22
    out[4] += 2.0 * B33 * b33


@njit(cache=True, error_model="numpy", forceinline=True)
def _back(P, b11, b12, b22, b33):
    """Weights of f b fᵀ (11, 12, 22, 33) → of b, in the order of histories 11, 22, 33, 12."""
    f0, f1, f2, f3, f4 = P[0], P[1], P[2], P[3], P[4]
    return (
        f0 * f0 * b11 + f0 * f2 * b12 + f2 * f2 * b22, f1 * f1 * b11 + f1 * f3 * b12 + f3 * f3 * b22, f4 * f4 * b33,
        2.0 * (f0 * f1 * b11 + f2 * f3 * b22) + (f0 * f3 + f1 * f2) * b12,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _to_nodes(nodes, B, g0, g1, g2, g3, g4, out):
    """Weights of gradients of motions → added to those of the nodes' motions, out (n, 2)."""
    for k in range(4):
        out[nodes[k], 0] += g0 * B[k] + g1 * B[4 + k] + g4 * B[8 + k]
        out[nodes[k], 1] += g2 * B[k] + g3 * B[4 + k]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def along(cells, geometry, point, G, axisymmetric, new, x):
    """Weights new (d, e, 4, h) of the histories after an increment → added to those of the motions in it, x (d, n, 2)."""
    part = 1.0 / 3.0 if axisymmetric else 0.5
    L, own = np.empty((4, 5)), np.empty(4)
    for e in range(cells.shape[0]):
        for d in range(new.shape[0]):
            middle = 0.0
            for q in range(4):
                P, w = point[e, q], new[d, e, q]
                x1, x2, d12 = _turned_back(P, w[0], w[3], w[1])
                d1, d2, d3, _ = _trial(P, G, P[30] * x1, P[31] * x2, P[32] * w[2], w[4] if w.shape[0] > 4 else 0.0)
                b11, b12, b22, b33 = _tensor(P, d1, d2, d3, P[26] * d12)
                L[q] = 0.0
                _gradients(P[5], P[6], P[7], P[8], b11, b12, b22, b33, L[q])
                if w.shape[0] > 4:
                    _gradients(P[44], P[45], P[46], P[47], w[6], w[9], w[7], w[8], L[q])
                own[q] = part * (L[q, 0] + L[q, 3] + (L[q, 4] if axisymmetric else 0.0))
                middle += own[q]
            for q in range(4):
                g = L[q]
                _to_nodes(cells[e], geometry[e, q], g[0] - own[q], g[1], g[2], g[3] - own[q], g[4] - own[q], x[d])
            _to_nodes(cells[e], geometry[e, _MIDDLE], middle, 0.0, 0.0, middle, middle, x[d])


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def at_fixed(cells, geometry, point, bulk, G, axisymmetric, plastic, r, new, x_n, x, old, by_bulk, by_G, flow):
    """Weights r (d, ndof) of the forces and new (d, e, 4, h) of the histories → of what they depend on at fixed motions.

    Added to: x_n, x (d, n, 2) of the committed and the present places, by_bulk, by_G (d,) of the moduli. Written: old
    (d, e, 4, h) of the histories that the increment begins with, flow (d, e, 4) of the flow stress after the increment.
    """
    part = 1.0 / 3.0 if axisymmetric else 0.5
    g, L, own, size = np.empty((4, 5)), np.empty((4, 5)), np.empty(4), np.empty(4)
    lame = bulk - 2.0 * G / 3.0
    for e in range(cells.shape[0]):
        for d in range(r.shape[0]):
            middle = 0.0  # of l there: what the volumes and α take from it
            for q in range(4):
                P, B, w, o = point[e, q], geometry[e, q], new[d, e, q], old[d, e, q]
                # of the forces r_a = m · ∇N_a
                m11 = m12 = m21 = m22 = m33 = 0.0
                for k in range(4):
                    a, b = r[d, 2 * cells[e, k]], r[d, 2 * cells[e, k] + 1]
                    m11 += a * B[k]
                    m12 += a * B[4 + k]
                    m33 += a * B[8 + k]
                    m21 += b * B[k]
                    m22 += b * B[4 + k]
                k12, V = m12 + m21, P[43]
                c, s = P[11], P[12]
                s11, s12, s22 = c * c * P[27] + s * s * P[28], c * s * (P[27] - P[28]), s * s * P[27] + c * c * P[28]
                v = V * (s11 * m11 + s12 * k12 + s22 * m22 + P[29] * m33)
                s11, s12, s22, s33 = V * s11, V * s12, V * s22, V * P[29]
                g[q, 0], g[q, 1] = -s11 * m11 - s12 * m21, -s12 * m11 - s22 * m21
                g[q, 2], g[q, 3], g[q, 4] = -s11 * m12 - s12 * m22, -s12 * m12 - s22 * m22, -s33 * m33
                # of the stress
                t1, t2, t12 = _turned_back(P, V * m11, V * k12, V * m22)
                t3 = V * m33
                common = t1 + t2 + t3
                trace = (P[22] + P[23] + P[24]) * common
                by_bulk[d] += trace
                by_G[d] += 2.0 * (P[22] * t1 + P[23] * t2 + P[24] * t3 - trace / 3.0)
                # of the history
                y1, y2, y12 = _turned_back(P, w[0], w[3], w[1])
                strain = w[4] if plastic else 0.0
                d1, d2, d3, slope = _trial(
                    P, G, P[30] * y1 + 2.0 * G * t1, P[31] * y2 + 2.0 * G * t2, P[32] * w[2] + 2.0 * G * t3, strain
                )
                b11, b12, b22, b33 = _tensor(
                    P, d1 + lame * common, d2 + lame * common, d3 + lame * common, P[25] * t12 + P[26] * y12
                )
                o[0], o[1], o[2], o[3] = _back(P, b11, b12, b22, b33)
                o[0], o[1], o[2], o[3] = o[0] - v * P[39], o[1] - v * P[40], o[2] - v * P[42], o[3] - v * P[41]
                L[q] = 0.0
                _gradients(P[5], P[6], P[7], P[8], b11, b12, b22, b33, L[q])
                if plastic:
                    by_G[d] += P[21] * slope
                    o[4], o[5] = strain - P[19] * slope, 0.0
                    flow[d, e, q] = -P[20] * slope
                    _gradients(P[44], P[45], P[46], P[47], w[6], w[9], w[7], w[8], L[q])
                    o[6], o[7], o[8], o[9] = _back(P, w[6], w[9], w[7], w[8])
                own[q] = part * (L[q, 0] + L[q, 3] + (L[q, 4] if axisymmetric else 0.0))
                middle += own[q] - v
                size[q] = v
            for q in range(5):
                B = geometry[e, q]
                f0, f1, f2, f3, f4 = B[12], B[13], B[14], B[15], B[16]
                if q == _MIDDLE:
                    l0 = l3 = l4 = middle
                    l1 = l2 = g0 = g1 = g2 = g3 = g4 = v = 0.0
                else:
                    l0, l1, l2, l3, l4 = L[q, 0] - own[q], L[q, 1], L[q, 2], L[q, 3] - own[q], L[q, 4] - own[q]
                    g0, g1, g2, g3, g4, v = g[q, 0], g[q, 1], g[q, 2], g[q, 3], g[q, 4], size[q]
                _to_nodes(cells[e], B, g0 + l0 + v, g1 + l1, g2 + l2, g3 + l3 + v, g4 + l4 + v, x[d])
                _to_nodes(
                    cells[e], B, -f0 * l0 - f2 * l2, -f0 * l1 - f2 * l3, -f1 * l0 - f3 * l2, -f1 * l1 - f3 * l3, -f4 * l4, x_n[d]
                )


@njit(cache=True, error_model="numpy")
def flow_owed(kind, p, old, new, dt, weights, out):
    """Weights (d, e, 4) of the flow stress after an increment → added to those of the scalars p (5,) of its curve, out (d, 5).

    Not of a table; plastic strains are column 4 of the histories (e, 4, h) that the increment begins with and leads to.
    """
    curve = (p[0], p[1], p[2], p[3], p[4])
    for e in range(new.shape[0]):
        for q in range(4):
            was, now = old[e, q, 4], new[e, q, 4]
            if now == was:
                continue
            b0, b1, b2, b3, b4 = flow_gradient(kind, curve, now, now - was, dt)
            for d in range(weights.shape[0]):
                w, o = weights[d, e, q], out[d]
                o[0], o[1], o[2], o[3], o[4] = o[0] + w * b0, o[1] + w * b1, o[2] + w * b2, o[3] + w * b3, o[4] + w * b4
