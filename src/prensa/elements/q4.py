"""4-node quadrilateral, 2 × 2 Gauss points, with F-bar, in plane strain and axisymmetry, small and finite strain.

Two batch kernels bracket the material: `kinematics` turns nodal increments into h = f − I at the points, `integrate`
turns stresses P and tangents A = ∂P/∂f into nodal forces and stiffnesses. Everything refers to the last committed
configuration x_n (updated Lagrangian); in small strain that is X.

F-bar (de Souza Neto, Perić, Dutko & Owen 1996): f̄ = α f with α = (J₀/J)^(1/m), J₀ at the centroid; m = 3 in
axisymmetry (hoop component included), m = 2 in plane strain (in-plane block). Forces r_a = ∫ c P̄ ∇N_a dV with
c = α^(1−m), which is ∫ σ(f̄) ∇N_a dv. In small strain it is B-bar
(Hughes 1980), symmetric, with the volume average of the dilatation: that of the centroid, the same in plane strain, would fail
the patch test in axisymmetry.

F-bar sees no volume but that of the centroid, so nothing keeps that of a point from vanishing: `unfold` does.
"""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.lanes import (
    EIGHTS_OF_25,
    WIDE,
    five_into_rows,
    four_into_rows,
    four_out_of_rows,
    into_rows,
    out_of_rows,
)
from prensa.kernels.tensor import det_minus_one

_G = 1.0 / math.sqrt(3.0)
_CORNER_XI = np.array([-1.0, 1.0, 1.0, -1.0])
_CORNER_ETA = np.array([-1.0, -1.0, 1.0, 1.0])
# shape functions and their derivatives by ξ and η at the points and, number 4, at the centre: (5, 4) each
_CENTRE = 4
_AT = np.append(np.array([_CORNER_XI, _CORNER_ETA]) * _G, [[0.0], [0.0]], axis=1)
_N = 0.25 * (1.0 + _CORNER_XI * _AT[0][:, None]) * (1.0 + _CORNER_ETA * _AT[1][:, None])
_DX = 0.25 * _CORNER_XI * (1.0 + _CORNER_ETA * _AT[1][:, None])
_DY = 0.25 * _CORNER_ETA * (1.0 + _CORNER_XI * _AT[0][:, None])


# `_increment` and its like are compiled once for each constant that they are called with, and once more for a number: the
# kernels read the number of the centre where no compiler of types sees that it is a constant
@njit(cache=True, error_model="numpy", forceinline=True)
def _centre():
    return _DX.shape[0] - 1


@njit(cache=True, error_model="numpy", forceinline=True)
def _root_minus_one(delta, cubic):
    """(1 + δ)^(1/2), or with ``cubic`` (1 + δ)^(1/3), less one, with all the digits that a small δ has; cubic: −¼ < δ < ½."""
    if not cubic:
        return delta / (math.sqrt(1.0 + delta) + 1.0)
    # two steps of Halley's method leave an error below 1e-17 from within 1 %
    c = _nearer_root(1.0 + delta, _nearer_root(1.0 + delta, 1.0 + delta / 3.0))
    return delta / (c * c + c + 1.0)


@njit(cache=True, error_model="numpy", forceinline=True)
def _nearer_root(rho, c):
    """A step of Halley's method to the cube root of ρ, c ← c (c³ + 2ρ)/(2c³ + ρ)."""
    cube = c * c * c
    return c * ((cube + 2.0 * rho) / (2.0 * cube + rho))


_LEAST_SHARE = (
    1.0 / 3.0
)  # area of a point over that of the centre, both over their initial ones, that F-bar keeps by itself


ABREAST = 16
"""Elements at a time in the kernels: their scratch lies in the nearest cache."""
# where the rows of the scratch of `kinematics` begin: positions and increments of the nodes; of the points volumes, α, h; of one
# what its α follows from, of the element the dilatation, the volume, whether it failed
_V, _D_V, _VOLUME, _ALPHA, _H, _RISE, _C, _TOTAL, _BAD, _KINEMATIC = (
    ABREAST * k for k in (0, 8, 16, 20, 24, 44, 45, 46, 47, 48)
)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _increment(s, i, q, axisymmetric):
    """Jacobian times radius (or 1) and displacement gradient 11, 12, 21, 22, 33 of lane i at point q."""
    x1 = x2 = y1 = y2 = u1 = u2 = v1 = v2 = radius = u = 0.0
    for a in range(4):
        dx, dy, n, at = _DX[q, a], _DY[q, a], _N[q, a], 2 * a * ABREAST + i
        x, y, ux, uy = s[_V + at], s[_V + at + ABREAST], s[_D_V + at], s[_D_V + at + ABREAST]
        x1, x2, y1, y2 = x1 + dx * x, x2 + dy * x, y1 + dx * y, y2 + dy * y
        u1, u2, v1, v2 = u1 + dx * ux, u2 + dy * ux, v1 + dx * uy, v2 + dy * uy
        radius, u = radius + n * x, u + n * ux
    det = x1 * y2 - y1 * x2
    inverse = 1.0 / det
    h11, h12 = (u1 * y2 - u2 * y1) * inverse, (u2 * x1 - u1 * x2) * inverse
    h21, h22 = (v1 * y2 - v2 * y1) * inverse, (v2 * x1 - v1 * x2) * inverse
    return det * (radius if axisymmetric else 1.0), h11, h12, h21, h22, u / radius if axisymmetric else 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _narrow(x1, y1, x2, y2, x3, y3):
    """Whether a point of the element with these corners and 0 has so little area that `unfold` has to look.

    That of a point is linear in ξ and η.
    """
    # along ξ and η at the centre, and what changes along both, each four times
    ax, ay, bx, by, cx, cy = x1 + x2 - x3, y1 + y2 - y3, x3 + x2 - x1, y3 + y2 - y1, x2 - x3 - x1, y2 - y3 - y1
    centre = ax * by - ay * bx
    least = centre - _G * (abs(ax * cy - ay * cx) + abs(cx * by - cy * bx))
    # points of convex shapes have 0.42 to 1.58 of the area of their centre, initial ones too: most elements end here
    return not least > 1.6 * _LEAST_SHARE * centre


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def kinematics(x, du, axisymmetric, finite, scale, h, w, alpha, failed):
    """X (e, 4, 2) committed positions, du (e, 4, 2) increments → h (e, 4, 5), w (e, 4) volumes, alpha (e, 4), failed (e,).

    ``scale`` multiplies the volumes (thickness, or 2π in axisymmetry). h is that of f̄ and alpha − 1 is what F-bar
    added. failed marks elements with det f ≤ 0 (or an inverted committed shape) at a point. `ABREAST` elements are answered for
    at a time, as in `integrate`. In finite strain the answer is how many elements `unfold` has to look at.
    """
    s, narrow = np.zeros(_KINEMATIC), 0
    middle = _centre()
    share, third = (1.0 / 3.0, 1.0) if axisymmetric else (0.5, 0.0)
    for first in range(0, x.shape[0], ABREAST):
        lanes = min(ABREAST, x.shape[0] - first)
        for i in range(0, lanes, WIDE):
            into_rows(x, 8 * (first + i), 8, lanes - 1 - i, s, _V + i, ABREAST)
            into_rows(du, 8 * (first + i), 8, lanes - 1 - i, s, _D_V + i, ABREAST)
        # finite strain: det f − 1 at the centre; small strain: the mean dilatation, by the volumes of the points
        if finite:
            for i in range(ABREAST):
                _, h11, h12, h21, h22, h33 = _increment(s, i, middle, axisymmetric)
                centre = det_minus_one(h11, h12, h21, h22, h33)
                s[_C + i], s[_BAD + i] = centre, 0.0 if centre > -1.0 else 1.0
            for i in range(ABREAST):
                x0, y0 = s[_V + i] + s[_D_V + i], s[_V + ABREAST + i] + s[_D_V + ABREAST + i]
                x1, y1 = s[_V + 2 * ABREAST + i] + s[_D_V + 2 * ABREAST + i], s[_V + 3 * ABREAST + i] + s[_D_V + 3 * ABREAST + i]
                x2, y2 = s[_V + 4 * ABREAST + i] + s[_D_V + 4 * ABREAST + i], s[_V + 5 * ABREAST + i] + s[_D_V + 5 * ABREAST + i]
                x3, y3 = s[_V + 6 * ABREAST + i] + s[_D_V + 6 * ABREAST + i], s[_V + 7 * ABREAST + i] + s[_D_V + 7 * ABREAST + i]
                narrow += 1 if (i < lanes) & _narrow(x1 - x0, y1 - y0, x2 - x0, y2 - y0, x3 - x0, y3 - y0) else 0
        else:
            for i in range(ABREAST):
                s[_C + i], s[_TOTAL + i], s[_BAD + i] = 0.0, 0.0, 0.0
            for q in range(4):
                for i in range(ABREAST):
                    volume, h11, h12, h21, h22, h33 = _increment(s, i, q, axisymmetric)
                    s[_C + i] += volume * (h11 + h22 + h33)
                    s[_TOTAL + i] += volume
            for i in range(ABREAST):
                s[_C + i] /= s[_TOTAL + i]
        for q in range(4):
            far, here_alpha, here_h = 0, _ALPHA + q * ABREAST, _H + 5 * q * ABREAST
            for i in range(ABREAST):
                volume, h11, h12, h21, h22, h33 = _increment(s, i, q, axisymmetric)
                here = det_minus_one(h11, h12, h21, h22, h33) if finite else h11 + h22 + h33
                good = (volume * scale > 0.0) & ((not finite) | ((here > -1.0) & (h33 > -1.0)))
                s[_BAD + i] = s[_BAD + i] if good else 1.0
                delta = (s[_C + i] - here) / (1.0 + here) if finite else (s[_C + i] - here) * share
                far += 1 if (i < lanes) & (not ((delta > -0.25) & (delta < 0.5))) else 0
                s[_RISE + i], s[here_alpha + i] = delta, _root_minus_one(delta, axisymmetric) if finite else delta
                to = here_h + i
                s[_VOLUME + q * ABREAST + i], s[to], s[to + ABREAST] = volume * scale, h11, h12
                s[to + 2 * ABREAST], s[to + 3 * ABREAST], s[to + 4 * ABREAST] = h21, h22, h33
            if far and finite and axisymmetric:
                for i in range(lanes):
                    delta = s[_RISE + i]
                    if not -0.25 < delta < 0.5:
                        c = _nearer_root(1.0 + delta, (1.0 + delta) ** (1.0 / 3.0))
                        s[here_alpha + i] = delta / (c * c + c + 1.0)
            for i in range(ABREAST):
                to = here_h + i
                a1, h11, h12 = s[here_alpha + i], s[to], s[to + ABREAST]
                h21, h22, h33 = s[to + 2 * ABREAST], s[to + 3 * ABREAST], s[to + 4 * ABREAST]
                one = 1.0 if finite else 0.0  # small strain: what is added does not stretch
                s[to], s[to + 3 * ABREAST] = h11 + a1 * (1.0 + one * h11), h22 + a1 * (1.0 + one * h22)
                s[to + ABREAST], s[to + 2 * ABREAST] = h12 * (1.0 + one * a1), h21 * (1.0 + one * a1)
                s[to + 4 * ABREAST], s[here_alpha + i] = h33 + third * a1 * (1.0 + one * h33), 1.0 + a1
        for i in range(0, lanes, WIDE):
            e, last = first + i, lanes - 1 - i
            four_out_of_rows(w, 4 * e, 4, last, s, _VOLUME + i, ABREAST)
            four_out_of_rows(alpha, 4 * e, 4, last, s, _ALPHA + i, ABREAST)
            for k in _EIGHTS_OF_20:
                out_of_rows(h, 20 * e + k, 20, last, s, _H + k * ABREAST + i, ABREAST)
        for i in range(lanes):
            if s[_BAD + i] != 0.0:
                failed[first + i] = True
    return narrow


# where those of `integrate` begin: positions, increments; of a point gradients (x, y, hoop), f, weighted stress, tangent,
# divergence; divergence of the centre; tangent times gradients, volumes and α of the points, weight of a tangent, forces, their
# sum, stiffness
_X, _U, _GX, _GY, _GR, _F, _P, _A, _D = (ABREAST * k for k in (0, 8, 16, 20, 24, 28, 33, 38, 63))
_D0, _AG, _W, _AL, _WC, _R, _SUM, _K, _SCRATCH = (ABREAST * k for k in (71, 79, 119, 123, 127, 128, 136, 137, 201))
_EIGHTS_OF_20 = (0, 8, 12)  # as `EIGHTS_OF_25`


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, forceinline=True)
def _at_point(s, i, q, axisymmetric):
    """Gradients of lane i at point q → their rows; Jacobian times radius (or 1), displacement gradient 11, 12, 21, 22, 33."""
    j11 = j12 = j21 = j22 = r = 0.0
    for a in range(4):
        x, y = s[_X + 2 * a * ABREAST + i], s[_X + (2 * a + 1) * ABREAST + i]
        j11 += _DX[q, a] * x
        j12 += _DX[q, a] * y
        j21 += _DY[q, a] * x
        j22 += _DY[q, a] * y
        r += _N[q, a] * x
    det = j11 * j22 - j12 * j21
    inverse = 1.0 / det
    j11, j12, j21, j22 = j11 * inverse, j12 * inverse, j21 * inverse, j22 * inverse
    r = r if axisymmetric else 1.0
    hoop = 1.0 / r if axisymmetric else 0.0
    h11 = h12 = h21 = h22 = h33 = 0.0
    for a in range(4):
        dx, dy, dr = j22 * _DX[q, a] - j12 * _DY[q, a], j11 * _DY[q, a] - j21 * _DX[q, a], _N[q, a] * hoop
        ux, uy = s[_U + 2 * a * ABREAST + i], s[_U + (2 * a + 1) * ABREAST + i]
        s[_GX + a * ABREAST + i], s[_GY + a * ABREAST + i], s[_GR + a * ABREAST + i] = dx, dy, dr
        h11 += ux * dx
        h12 += ux * dy
        h21 += uy * dx
        h22 += uy * dy
        h33 += ux * dr
    return det * r, h11, h12, h21, h22, h33


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, forceinline=True)
def _into_rows(s, i, to, h11, h12, h21, h22, h33):
    """G = f⁻ᵀ : ∂f/∂u of lane i at the point of its rows → rows from ``to`` on, two a node.

    The derivative of ln det f with respect to the nodal increments (of the trace at h = 0).
    """
    inverse = 1.0 / ((1.0 + h11) * (1.0 + h22) - h12 * h21)
    i11, i12, i21, i22 = (1.0 + h22) * inverse, -h12 * inverse, -h21 * inverse, (1.0 + h11) * inverse
    i33 = 1.0 / (1.0 + h33)
    for a in range(4):
        dx, dy = s[_GX + a * ABREAST + i], s[_GY + a * ABREAST + i]
        s[to + 2 * a * ABREAST + i] = i11 * dx + i21 * dy + i33 * s[_GR + a * ABREAST + i]
        s[to + (2 * a + 1) * ABREAST + i] = i12 * dx + i22 * dy


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, forceinline=True)
def _tangent_row(s, i, k, less):
    """Row k of the tangent times the gradients of lane i, G + f ⊗ g; ``less``: 1 − m of F-bar, 0 in small strain."""
    row = _A + 5 * k * ABREAST + i
    c = s[_WC + i]
    a0, a1, a2, a3 = s[row] * c, s[row + ABREAST] * c, s[row + 2 * ABREAST] * c, s[row + 3 * ABREAST] * c
    a4 = s[row + 4 * ABREAST] * c
    t = a0 * s[_F + i] + a1 * s[_F + ABREAST + i] + a2 * s[_F + 2 * ABREAST + i] + a3 * s[_F + 3 * ABREAST + i]
    t += a4 * s[_F + 4 * ABREAST + i] + less * s[_P + k * ABREAST + i]
    to = _AG + 8 * k * ABREAST + i
    for a in range(4):
        dx, dy = s[_GX + a * ABREAST + i], s[_GY + a * ABREAST + i]
        s[to + 2 * a * ABREAST] = a0 * dx + a1 * dy + a4 * s[_GR + a * ABREAST + i] + t * s[_D + 2 * a * ABREAST + i]
        s[to + (2 * a + 1) * ABREAST] = a2 * dx + a3 * dy + t * s[_D + (2 * a + 1) * ABREAST + i]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def integrate(x, du, axisymmetric, finite, w, alpha, P, A, forces, stiffness, r_out, K_out):
    """P (e, 4, 5), A (e, 4, 5, 5) → r_out (e, 8) internal forces, and with ``stiffness`` K_out (e, 8, 8), exact.

    forces (e,) receives Σ |r| before the points cancel each other: the scale against which a residual is small.

    With f̄ = α f, ∂f̄/∂u = α (G + f ⊗ g) and ∂c/∂u = c (1 − m) g, g = ∂ ln α/∂u (8,); rows of the virtual gradients G are
    sparse (node a: 11, 12, 33 with u_x and 21, 22 with u_y), which the products use. B-bar is variational: its virtual
    gradients carry g too; F-bar integrates the true virtual work.

    `ABREAST` elements are answered for at a time, row by row of one array, in loops that a compiler makes into instructions for
    several of them.
    """
    s = np.zeros(_SCRATCH)
    o = s.shape[0] - s.shape[0]  # 0: a function is compiled once for each constant that it is called with
    part, third = (1.0 / 3.0, 1.0) if axisymmetric else (0.5, 0.0)
    less = 0.0 if not finite else -2.0 if axisymmetric else -1.0
    slopes = stiffness or not finite
    for first in range(0, x.shape[0], ABREAST):
        lanes = min(ABREAST, x.shape[0] - first)
        for i in range(0, lanes, WIDE):
            e, last = first + i, lanes - 1 - i
            into_rows(x, 8 * e, 8, last, s, _X + i, ABREAST)
            into_rows(du, 8 * e, 8, last, s, _U + i, ABREAST)
            four_into_rows(w, 4 * e, 4, last, s, _W + i, ABREAST)
            four_into_rows(alpha, 4 * e, 4, last, s, _AL + i, ABREAST)
        for n in range(_R, _SCRATCH):
            s[n] = 0.0
        # the divergence whose rise over that of a point α follows: of the centre; in small strain the mean of the points
        if slopes:
            for i in range(8 * ABREAST):
                s[_D0 + i] = 0.0
            for q in range(4 if finite else 0, 5 if finite else 4):
                for i in range(ABREAST):
                    volume, h11, h12, h21, h22, h33 = _at_point(s, i, q, axisymmetric)
                    if not finite:
                        h11, h12, h21, h22, h33 = 0.0, 0.0, 0.0, 0.0, 0.0
                    volume = 1.0 if finite else volume
                    _into_rows(s, i, _D, h11, h12, h21, h22, h33)
                    s[_SUM + i] += volume
                    for j in range(8):
                        s[_D0 + j * ABREAST + i] += volume * s[_D + j * ABREAST + i]
            for i in range(ABREAST):
                inverse = 1.0 / s[_SUM + i]
                s[_SUM + i] = 0.0
                for j in range(8):
                    s[_D0 + j * ABREAST + i] *= inverse
        for q in range(4):
            for i in range(0, lanes, WIDE):
                e, last = first + i, lanes - 1 - i
                five_into_rows(P, 20 * e + 5 * q, 20, last, s, _P + i, ABREAST)
                if stiffness:
                    for k in EIGHTS_OF_25:
                        into_rows(A, 100 * e + 25 * q + k, 100, last, s, _A + k * ABREAST + i, ABREAST)
            for i in range(ABREAST):
                al = s[_AL + q * ABREAST + i] if finite else 1.0
                wc = s[_W + q * ABREAST + i] / (al * al if axisymmetric else al)
                s[_WC + i] = wc * al
                for k in range(5):
                    s[_P + k * ABREAST + i] *= wc
            for i in range(ABREAST):
                _, h11, h12, h21, h22, h33 = _at_point(s, i, q, axisymmetric)
                if not finite:
                    h11, h12, h21, h22, h33 = 0.0, 0.0, 0.0, 0.0, 0.0
                s[_F + i], s[_F + ABREAST + i], s[_F + 2 * ABREAST + i] = 1.0 + h11, h12, h21
                s[_F + 3 * ABREAST + i], s[_F + 4 * ABREAST + i] = 1.0 + h22, third * (1.0 + h33)
                if slopes:
                    _into_rows(s, i, _D, h11, h12, h21, h22, h33)
                p0, p1, p2 = s[_P + i], s[_P + ABREAST + i], s[_P + 2 * ABREAST + i]
                p3, p4 = s[_P + 3 * ABREAST + i], s[_P + 4 * ABREAST + i]
                trace = 0.0 if finite else p0 + p3 + third * p4
                for a in range(4):
                    dx, dy = s[_GX + a * ABREAST + i], s[_GY + a * ABREAST + i]
                    rx = dx * p0 + dy * p1 + s[_GR + a * ABREAST + i] * p4
                    ry = dx * p2 + dy * p3
                    if slopes:
                        gx, gy = _D + 2 * a * ABREAST + i, _D + (2 * a + 1) * ABREAST + i
                        s[gx] = (s[_D0 + 2 * a * ABREAST + i] - s[gx]) * part
                        s[gy] = (s[_D0 + (2 * a + 1) * ABREAST + i] - s[gy]) * part
                        rx += s[gx] * trace
                        ry += s[gy] * trace
                    s[_R + 2 * a * ABREAST + i] += rx
                    s[_R + (2 * a + 1) * ABREAST + i] += ry
                    s[_SUM + i] += abs(rx) + abs(ry)
            if not stiffness:
                continue
            for i in range(ABREAST):
                _tangent_row(s, i, o, less)
                _tangent_row(s, i, o + 1, less)
                _tangent_row(s, i, o + 2, less)
                _tangent_row(s, i, o + 3, less)
                _tangent_row(s, i, o + 4, less)
            for b in range(0, 8, 4):
                for i in range(ABREAST):
                    for j in range(4):
                        row = _AG + (b + j) * ABREAST + i
                        a0, a1, a2 = s[row], s[row + 8 * ABREAST], s[row + 16 * ABREAST]
                        a3, a4 = s[row + 24 * ABREAST], s[row + 32 * ABREAST]
                        for a in range(4):
                            at, to = a * ABREAST + i, _K + (16 * a + b + j) * ABREAST + i
                            dx, dy = s[_GX + at], s[_GY + at]
                            s[to] += dx * a0 + dy * a1 + s[_GR + at] * a4
                            s[to + 8 * ABREAST] += dx * a2 + dy * a3
            if not finite:
                for m in range(8):
                    for i in range(ABREAST):
                        g = s[_D + m * ABREAST + i]
                        for j in range(8):
                            row = _AG + j * ABREAST + i
                            t = s[row] + s[row + 24 * ABREAST] + third * s[row + 32 * ABREAST]
                            s[_K + (8 * m + j) * ABREAST + i] += g * t
        for i in range(lanes):
            forces[first + i] = s[_SUM + i]
        for i in range(0, lanes, WIDE):
            e, last = first + i, lanes - 1 - i
            out_of_rows(r_out, 8 * e, 8, last, s, _R + i, ABREAST)
            if stiffness:
                for m in range(8):
                    out_of_rows(K_out, 64 * e + 8 * m, 64, last, s, _K + 8 * m * ABREAST + i, ABREAST)


@njit(cache=True, error_model="numpy", forceinline=True)
def _shape_gradients(v, e, q, out):
    """∂N_a/∂v_i of element e at point q in node positions v (e, 4, 2) → out[q] (8,), by x and y of node after node; Jacobian."""
    j11 = j12 = j21 = j22 = 0.0
    for a in range(4):
        dx, dy = _DX[q, a], _DY[q, a]
        j11 += dx * v[e, a, 0]
        j12 += dx * v[e, a, 1]
        j21 += dy * v[e, a, 0]
        j22 += dy * v[e, a, 1]
    det = j11 * j22 - j12 * j21
    for a in range(4):
        dx, dy = _DX[q, a], _DY[q, a]
        out[q, 2 * a] = (j22 * dx - j12 * dy) / det
        out[q, 2 * a + 1] = (j11 * dy - j21 * dx) / det
    return det


@njit(cache=True, error_model="numpy")
def folding(x, d):
    """Whether the area of some point is so much less than that of its centre that `unfold` has to look; x, d as there.

    Nearly always it is not: then `unfold` need not be compiled, and run.
    """
    for e in range(x.shape[0]):  # noqa: SIM110 (kernels have no generators)
        if _folds(x, d, e):
            return True
    return False


@njit(cache=True, error_model="numpy", forceinline=True)
def _folds(x, d, e):
    """Whether element e in node positions x + d (e, 4, 2) has such a point."""
    x0, y0 = x[e, 0, 0] + d[e, 0, 0], x[e, 0, 1] + d[e, 0, 1]
    x1, y1 = x[e, 1, 0] + d[e, 1, 0] - x0, x[e, 1, 1] + d[e, 1, 1] - y0
    x2, y2 = x[e, 2, 0] + d[e, 2, 0] - x0, x[e, 2, 1] + d[e, 2, 1] - y0
    x3, y3 = x[e, 3, 0] + d[e, 3, 0] - x0, x[e, 3, 1] + d[e, 3, 1] - y0
    return _narrow(x1, y1, x2, y2, x3, y3)


@njit(cache=True, error_model="numpy")
def unfold(X, x, d, axisymmetric, modulus, forces, stiffness, r_out, K_out):
    """Add forces and stiffness of the energy V E*/2 ln²(ρ/3) of the points whose ρ, centre over point, exceeds 3.

    ρ is the ratio of the areas of centre and point over that of the initial shape X (e, 4, 2), V the point's initial volume
    over the thickness (or over 2π) and ``modulus`` E* times that; x + d are the present positions. With F-bar the energy
    of a point does not depend on its own volume, so that it stays finite while that goes to zero and the element through
    itself (of neo-Hooke in plane strain this is exact: see `prensa.fem.symmetry`). A corner of 180° has ρ = 2.37.
    """
    v = np.empty((1, 4, 2))
    B, B0 = np.empty((2, 5, 8))
    slope = np.empty(8)
    only, middle = np.int64(0), _centre()
    for e in range(X.shape[0]):
        if not _folds(x, d, e):
            continue
        for a in range(4):
            for i in range(2):
                v[0, a, i] = x[e, a, i] + d[e, a, i]
        j0, J0 = _shape_gradients(v, only, middle, B), _shape_gradients(X, e, middle, B0)
        for q in range(4):
            j, J = _shape_gradients(v, only, q, B), _shape_gradients(X, e, q, B0)
            excess = math.log(j0 / j * J / J0 * _LEAST_SHARE)
            if not excess > 0.0:
                continue
            W = modulus * J
            if axisymmetric:
                radius = 0.0
                for a in range(4):
                    radius += _N[q, a] * X[e, a, 0]
                W *= radius
            for i in range(8):
                slope[i] = B[_CENTRE, i] - B[q, i]
                r_out[e, i] += W * excess * slope[i]
                forces[e] += abs(W * excess * slope[i])
            if not stiffness:
                continue
            for a in range(4):
                for i in range(2):
                    for b in range(4):
                        for k in range(2):
                            turn = B[q, 2 * a + k] * B[q, 2 * b + i] - B[_CENTRE, 2 * a + k] * B[_CENTRE, 2 * b + i]
                            K_out[e, 2 * a + i, 2 * b + k] += W * (slope[2 * a + i] * slope[2 * b + k] + excess * turn)
