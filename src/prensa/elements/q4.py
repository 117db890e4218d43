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
    """(1 + δ)^(1/2), or with ``cubic`` (1 + δ)^(1/3), less one, with all the digits that a small δ has."""
    rho = 1.0 + delta
    if not cubic:
        return delta / (math.sqrt(rho) + 1.0)
    if -0.25 < delta < 0.5:
        # two steps of Halley's method, c ← c (c³ + 2ρ)/(2c³ + ρ), leave an error below 1e-17 from within 1 %
        c = 1.0 + delta / 3.0
        cube = c * c * c
        c *= (cube + 2.0 * rho) / (2.0 * cube + rho)
    else:
        c = rho ** (1.0 / 3.0)
    cube = c * c * c
    c *= (cube + 2.0 * rho) / (2.0 * cube + rho)
    return delta / (c * c + c + 1.0)


# the derivative by ξ changes only with η and the other way round: number of their values at the points and at the centre
_ROW, _COLUMN = np.array([0, 0, 1, 1, 2]), np.array([0, 1, 1, 0, 2])
_LEAST_SHARE = (
    1.0 / 3.0
)  # area of a point over that of the centre, both over their initial ones, that F-bar keeps by itself
_FAR, _NEAR = 0.25 * (1.0 + _G), 0.25 * (1.0 - _G)


@njit(cache=True, error_model="numpy", forceinline=True)
def _slopes(v, e, i, S):
    """Derivatives of component i of v (e, 4, 2) by ξ at η = −g, g, 0 → S[0] (3,), and by η at ξ = −g, g, 0 → S[1], g = 1/√3."""
    v0, v1, v2, v3 = v[e, 0, i], v[e, 1, i], v[e, 2, i], v[e, 3, i]
    for k in range(2):
        a, b = (v1 - v0, v2 - v3) if k == 0 else (v3 - v0, v2 - v1)
        S[k, 0], S[k, 1], S[k, 2] = _FAR * a + _NEAR * b, _NEAR * a + _FAR * b, 0.25 * (a + b)


@njit(cache=True, error_model="numpy", forceinline=True)
def _increment(x, du, e, q, axisymmetric, S):
    """Jacobian times radius (or 1) and displacement gradient 11, 12, 21, 22, 33 of element e at point q.

    S (4, 2, 3): `_slopes` of x, y and of their increments.
    """
    r, c = _ROW[q], _COLUMN[q]
    x1, x2, y1, y2 = S[0, 0, r], S[0, 1, c], S[1, 0, r], S[1, 1, c]
    u1, u2, v1, v2 = S[2, 0, r], S[2, 1, c], S[3, 0, r], S[3, 1, c]
    det = x1 * y2 - y1 * x2
    inverse = 1.0 / det
    h11, h12 = (u1 * y2 - u2 * y1) * inverse, (u2 * x1 - u1 * x2) * inverse
    h21, h22 = (v1 * y2 - v2 * y1) * inverse, (v2 * x1 - v1 * x2) * inverse
    if not axisymmetric:
        return det, h11, h12, h21, h22, 0.0
    radius = u = 0.0
    for a in range(4):
        radius += _N[q, a] * x[e, a, 0]
        u += _N[q, a] * du[e, a, 0]
    return det * radius, h11, h12, h21, h22, u / radius


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def kinematics(x, du, axisymmetric, finite, scale, h, w, alpha, failed):
    """X (e, 4, 2) committed positions, du (e, 4, 2) increments → h (e, 4, 5), w (e, 4) volumes, alpha (e, 4), failed (e,).

    ``scale`` multiplies the volumes (thickness, or 2π in axisymmetry). h is that of f̄ and alpha − 1 is what F-bar
    added. failed marks elements with det f ≤ 0 (or an inverted committed shape) at a point.
    """
    S = np.empty((4, 2, 3))
    middle = _centre()
    for e in range(x.shape[0]):
        for i in range(2):
            _slopes(x, e, i, S[i])
            _slopes(du, e, i, S[2 + i])
        # finite strain: det f − 1 at the centre; small strain: the mean dilatation, by the volumes of the points
        centre, total, bad = 0.0, 0.0, False
        for q in range(middle if finite else 0, middle + 1 if finite else 4):
            volume, h11, h12, h21, h22, h33 = _increment(x, du, e, q, axisymmetric, S)
            if finite:
                centre = det_minus_one(h11, h12, h21, h22, h33)
                bad = not centre > -1.0
            else:
                centre += volume * (h11 + h22 + h33)
                total += volume
        if not finite:
            centre /= total
        for q in range(4):
            volume, h11, h12, h21, h22, h33 = _increment(x, du, e, q, axisymmetric, S)
            volume *= scale
            w[e, q] = volume
            bad |= not volume > 0.0
            if finite:
                here = det_minus_one(h11, h12, h21, h22, h33)
                bad |= not (here > -1.0 and h33 > -1.0)
                a1 = _root_minus_one((centre - here) / (1.0 + here), axisymmetric)
                h11, h12, h21, h22 = (
                    h11 + a1 * (1.0 + h11),
                    h12 * (1.0 + a1),
                    h21 * (1.0 + a1),
                    h22 + a1 * (1.0 + h22),
                )
                if axisymmetric:
                    h33 += a1 * (1.0 + h33)
            else:
                a1 = (centre - (h11 + h22 + h33)) / (3.0 if axisymmetric else 2.0)
                h11 += a1
                h22 += a1
                if axisymmetric:
                    h33 += a1
            h[e, q, 0], h[e, q, 1], h[e, q, 2], h[e, q, 3], h[e, q, 4] = h11, h12, h21, h22, h33
            alpha[e, q] = 1.0 + a1
        if bad:
            failed[e] = True


ABREAST = 16
"""Elements at a time in `integrate`: their scratch lies in the nearest cache."""
# where the rows of the scratch begin: positions, increments; of a point gradients (x, y, hoop), f, weighted stress, tangent,
# divergence; divergence of the centre; tangent times gradients, forces, their sum, stiffness
_X, _U, _GX, _GY, _GR, _F, _P, _A, _D = (ABREAST * k for k in (0, 8, 16, 20, 24, 28, 33, 38, 63))
_D0, _AG, _R, _SUM, _K, _SCRATCH = (ABREAST * k for k in (71, 79, 119, 127, 128, 192))


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
    a0, a1, a2, a3, a4 = s[row], s[row + ABREAST], s[row + 2 * ABREAST], s[row + 3 * ABREAST], s[row + 4 * ABREAST]
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
        for i in range(lanes):
            for a in range(4):
                for k in range(2):
                    row = (2 * a + k) * ABREAST + i
                    s[_X + row], s[_U + row] = x[first + i, a, k], du[first + i, a, k]
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
            for i in range(lanes):
                e = first + i
                al = alpha[e, q] if finite else 1.0
                wc = w[e, q] / (al * al if axisymmetric else al)
                for k in range(5):
                    s[_P + k * ABREAST + i] = wc * P[e, q, k]
                if stiffness:
                    for k in range(5):
                        for m in range(5):
                            s[_A + (5 * k + m) * ABREAST + i] = wc * al * A[e, q, k, m]
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
            for a in range(4):
                for i in range(ABREAST):
                    dx, dy, dr = s[_GX + a * ABREAST + i], s[_GY + a * ABREAST + i], s[_GR + a * ABREAST + i]
                    for j in range(8):
                        row, to = _AG + j * ABREAST + i, _K + (16 * a + j) * ABREAST + i
                        s[to] += dx * s[row] + dy * s[row + 8 * ABREAST] + dr * s[row + 32 * ABREAST]
                        s[to + 8 * ABREAST] += dx * s[row + 16 * ABREAST] + dy * s[row + 24 * ABREAST]
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
            for j in range(8):
                r_out[first + i, j] = s[_R + j * ABREAST + i]
            if stiffness:
                for m in range(8):
                    for j in range(8):
                        K_out[first + i, m, j] = s[_K + (8 * m + j) * ABREAST + i]


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

    Nearly always it is not: then nothing but this has to be compiled, and run.
    """
    for e in range(x.shape[0]):  # noqa: SIM110 (kernels have no generators)
        if _folds(x, d, e):
            return True
    return False


@njit(cache=True, error_model="numpy", forceinline=True)
def _folds(x, d, e):
    """Whether element e in node positions x + d (e, 4, 2) has such a point: its area is linear in ξ and η."""
    x0, y0 = x[e, 0, 0] + d[e, 0, 0], x[e, 0, 1] + d[e, 0, 1]
    x1, y1 = x[e, 1, 0] + d[e, 1, 0] - x0, x[e, 1, 1] + d[e, 1, 1] - y0
    x2, y2 = x[e, 2, 0] + d[e, 2, 0] - x0, x[e, 2, 1] + d[e, 2, 1] - y0
    x3, y3 = x[e, 3, 0] + d[e, 3, 0] - x0, x[e, 3, 1] + d[e, 3, 1] - y0
    # along ξ and η at the centre, and what changes along both, each four times
    ax, ay, bx, by, cx, cy = x1 + x2 - x3, y1 + y2 - y3, x3 + x2 - x1, y3 + y2 - y1, x2 - x3 - x1, y2 - y3 - y1
    centre = ax * by - ay * bx
    least = centre - _G * (abs(ax * cy - ay * cx) + abs(cx * by - cy * bx))
    # points of convex shapes have 0.42 to 1.58 of the area of their centre, initial ones too: most elements end here
    return not least > 1.6 * _LEAST_SHARE * centre


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
