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


@njit(cache=True, error_model="numpy", forceinline=True)
def _gradients(x, e, q, axisymmetric, G):
    """∂N/∂x, ∂N/∂y and N/r (zero in plane problems) of element e at point q → G[q] (3, 4); Jacobian times radius (or 1)."""
    j11 = j12 = j21 = j22 = r = 0.0
    for a in range(4):
        dx, dy = _DX[q, a], _DY[q, a]
        xa, ya = x[e, a, 0], x[e, a, 1]
        j11 += dx * xa
        j12 += dx * ya
        j21 += dy * xa
        j22 += dy * ya
        r += _N[q, a] * xa
    det = j11 * j22 - j12 * j21
    inverse = 1.0 / det
    j11, j12, j21, j22 = j11 * inverse, j12 * inverse, j21 * inverse, j22 * inverse
    hoop = 1.0 / r if axisymmetric else 0.0
    for a in range(4):
        dx, dy = _DX[q, a], _DY[q, a]
        G[q, 0, a] = j22 * dx - j12 * dy
        G[q, 1, a] = j11 * dy - j21 * dx
        G[q, 2, a] = _N[q, a] * hoop
    return det * r if axisymmetric else det


@njit(cache=True, error_model="numpy", forceinline=True)
def _gradient_of(e, du, q, G):
    """Components 11, 12, 21, 22, 33 of the displacement gradient of element e at point q."""
    h11 = h12 = h21 = h22 = h33 = 0.0
    for a in range(4):
        ux, uy = du[e, a, 0], du[e, a, 1]
        h11 += ux * G[q, 0, a]
        h12 += ux * G[q, 1, a]
        h21 += uy * G[q, 0, a]
        h22 += uy * G[q, 1, a]
        h33 += ux * G[q, 2, a]
    return h11, h12, h21, h22, h33


@njit(cache=True, error_model="numpy", forceinline=True)
def _divergence(h11, h12, h21, h22, h33, q, G, g):
    """G[q] = f⁻ᵀ : ∂f/∂u → g[q] (8,), the derivative of ln det f with respect to the nodal increments (of the trace at h = 0)."""
    inverse = 1.0 / ((1.0 + h11) * (1.0 + h22) - h12 * h21)
    i11, i12, i21, i22 = (1.0 + h22) * inverse, -h12 * inverse, -h21 * inverse, (1.0 + h11) * inverse
    i33 = 1.0 / (1.0 + h33)
    for a in range(4):
        dx, dy, hoop = G[q, 0, a], G[q, 1, a], G[q, 2, a]
        g[q, 2 * a] = i11 * dx + i21 * dy + i33 * hoop
        g[q, 2 * a + 1] = i12 * dx + i22 * dy


# `_gradients` and its like are compiled once for each constant that they are called with, and once more for a number: the
# kernels read the number of the centre where no compiler of types sees that it is a constant
@njit(cache=True, error_model="numpy", forceinline=True)
def _centre():
    return _DX.shape[0] - 1


# inlined by force: else the process that compiles the kernels rounds otherwise than those that find them in the cache
@njit(cache=True, error_model="numpy", forceinline=True)
def _mean_divergence(x, e, axisymmetric, G, g):
    """Volume average of the virtual divergence of small strain → g[4] (8,), of the points → g[:4]; G (5, 3, 4) of the points."""
    for i in range(8):
        g[_CENTRE, i] = 0.0
    total = 0.0
    for q in range(4):
        volume = _gradients(x, e, q, axisymmetric, G)
        _divergence(0.0, 0.0, 0.0, 0.0, 0.0, q, G, g)
        total += volume
        for i in range(8):
            g[_CENTRE, i] += volume * g[q, i]
    for i in range(8):
        g[_CENTRE, i] /= total


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
    G = np.empty((5, 3, 4))
    g = np.empty((5, 8))
    S = np.empty((4, 2, 3))
    middle = _centre()
    for e in range(x.shape[0]):
        for i in range(2):
            _slopes(x, e, i, S[i])
            _slopes(du, e, i, S[2 + i])
        # finite strain: det f − 1 at the centre; small strain: the mean dilatation
        centre, bad = 0.0, False
        if finite:
            _, h11, h12, h21, h22, h33 = _increment(x, du, e, middle, axisymmetric, S)
            centre = det_minus_one(h11, h12, h21, h22, h33)
            bad = not centre > -1.0
        else:
            _mean_divergence(x, e, axisymmetric, G, g)
            for a in range(4):
                centre += g[_CENTRE, 2 * a] * du[e, a, 0] + g[_CENTRE, 2 * a + 1] * du[e, a, 1]
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


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def integrate(x, du, axisymmetric, finite, w, alpha, P, A, forces, stiffness, r_out, K_out):
    """P (e, 4, 5), A (e, 4, 5, 5) → r_out (e, 8) internal forces, and with ``stiffness`` K_out (e, 8, 8), exact.

    forces (e,) receives Σ |r| before the points cancel each other: the scale against which a residual is small.

    With f̄ = α f, ∂f̄/∂u = α (G + f ⊗ g) and ∂c/∂u = c (1 − m) g, g = ∂ ln α/∂u (8,); rows of the virtual gradients G are
    sparse (node a: 11, 12, 33 with u_x and 21, 22 with u_y), which the products use.

    Products are written out over the nodes on numbers read before: as far as a compiler knows, what is stored in one array
    may be in another, and in a loop every number would be read again after every store.
    """
    G = np.empty((5, 3, 4))
    g = np.empty((5, 8))
    AG = np.empty((4, 5, 8))
    middle = _centre()
    part = 1.0 / 3.0 if axisymmetric else 0.5
    one_less_m = -2.0 if axisymmetric else -1.0
    for e in range(x.shape[0]):
        if not finite:
            _mean_divergence(x, e, axisymmetric, G, g)
        elif stiffness:
            _gradients(x, e, middle, axisymmetric, G)
            h11, h12, h21, h22, h33 = _gradient_of(e, du, middle, G)
            _divergence(h11, h12, h21, h22, h33, middle, G, g)
        for i in range(8):
            r_out[e, i] = 0.0
        total = 0.0
        for q in range(4):
            f0, f1, f2, f3, f4 = 1.0, 0.0, 0.0, 1.0, 1.0 if axisymmetric else 0.0
            al, wc = 1.0, w[e, q]
            if finite:
                _gradients(x, e, q, axisymmetric, G)
                al = alpha[e, q]
                wc /= al * al if axisymmetric else al
            if finite and stiffness:
                h11, h12, h21, h22, h33 = _gradient_of(e, du, q, G)
                _divergence(h11, h12, h21, h22, h33, q, G, g)
                f0, f1, f2, f3 = 1.0 + h11, h12, h21, 1.0 + h22
                if axisymmetric:
                    f4 = 1.0 + h33
            if stiffness or not finite:
                for i in range(8):
                    g[q, i] = (g[_CENTRE, i] - g[q, i]) * part
            p = (wc * P[e, q, 0], wc * P[e, q, 1], wc * P[e, q, 2], wc * P[e, q, 3], wc * P[e, q, 4])
            # B-bar is variational: its virtual gradients carry g too; F-bar integrates the true virtual work
            trace = 0.0 if finite else p[0] + p[3] + (p[4] if axisymmetric else 0.0)
            for a in range(4):
                dx, dy, hoop = G[q, 0, a], G[q, 1, a], G[q, 2, a]
                rx = dx * p[0] + dy * p[1] + hoop * p[4]
                ry = dx * p[2] + dy * p[3]
                if not finite:
                    rx += g[q, 2 * a] * trace
                    ry += g[q, 2 * a + 1] * trace
                r_out[e, 2 * a] += rx
                r_out[e, 2 * a + 1] += ry
                total += abs(rx) + abs(ry)
            if not stiffness:
                continue
            wa = wc * al
            x0, x1, x2, x3 = G[q, 0, 0], G[q, 0, 1], G[q, 0, 2], G[q, 0, 3]
            y0, y1, y2, y3 = G[q, 1, 0], G[q, 1, 1], G[q, 1, 2], G[q, 1, 3]
            r0, r1, r2, r3 = G[q, 2, 0], G[q, 2, 1], G[q, 2, 2], G[q, 2, 3]
            g0, g1, g2, g3, g4, g5, g6, g7 = g[q, 0], g[q, 1], g[q, 2], g[q, 3], g[q, 4], g[q, 5], g[q, 6], g[q, 7]
            for k in range(5):
                a0, a1, a2, a3, a4 = (
                    wa * A[e, q, k, 0], wa * A[e, q, k, 1], wa * A[e, q, k, 2], wa * A[e, q, k, 3], wa * A[e, q, k, 4],
                )  # fmt: skip
                s = a0 * f0 + a1 * f1 + a2 * f2 + a3 * f3 + a4 * f4
                if finite:
                    s += one_less_m * p[k]
                AG[q, k, 0] = a0 * x0 + a1 * y0 + a4 * r0 + s * g0
                AG[q, k, 1] = a2 * x0 + a3 * y0 + s * g1
                AG[q, k, 2] = a0 * x1 + a1 * y1 + a4 * r1 + s * g2
                AG[q, k, 3] = a2 * x1 + a3 * y1 + s * g3
                AG[q, k, 4] = a0 * x2 + a1 * y2 + a4 * r2 + s * g4
                AG[q, k, 5] = a2 * x2 + a3 * y2 + s * g5
                AG[q, k, 6] = a0 * x3 + a1 * y3 + a4 * r3 + s * g6
                AG[q, k, 7] = a2 * x3 + a3 * y3 + s * g7
        forces[e] = total
        if not stiffness:
            continue
        for a in range(4):
            x0, x1, x2, x3 = G[0, 0, a], G[1, 0, a], G[2, 0, a], G[3, 0, a]
            y0, y1, y2, y3 = G[0, 1, a], G[1, 1, a], G[2, 1, a], G[3, 1, a]
            r0, r1, r2, r3 = G[0, 2, a], G[1, 2, a], G[2, 2, a], G[3, 2, a]
            for j in range(8):
                K_out[e, 2 * a, j] = (
                    (x0 * AG[0, 0, j] + y0 * AG[0, 1, j] + r0 * AG[0, 4, j])
                    + (x1 * AG[1, 0, j] + y1 * AG[1, 1, j] + r1 * AG[1, 4, j])
                    + (x2 * AG[2, 0, j] + y2 * AG[2, 1, j] + r2 * AG[2, 4, j])
                    + (x3 * AG[3, 0, j] + y3 * AG[3, 1, j] + r3 * AG[3, 4, j])
                )
                K_out[e, 2 * a + 1, j] = (
                    (x0 * AG[0, 2, j] + y0 * AG[0, 3, j])
                    + (x1 * AG[1, 2, j] + y1 * AG[1, 3, j])
                    + (x2 * AG[2, 2, j] + y2 * AG[2, 3, j])
                    + (x3 * AG[3, 2, j] + y3 * AG[3, 3, j])
                )
        if not finite:
            for q in range(4):
                for j in range(8):
                    t = AG[q, 0, j] + AG[q, 3, j] + (AG[q, 4, j] if axisymmetric else 0.0)
                    for i in range(8):
                        K_out[e, i, j] += g[q, i] * t


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
