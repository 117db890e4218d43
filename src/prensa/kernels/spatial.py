"""Second-order tensors in three dimensions, nine components in the order 11, 12, 13, 21, 22, 23, 31, 32, 33.

The counterparts of `prensa.kernels.tensor`, function by function: deformation gradients travel as h = f − I and left
Cauchy-Green tensors as b − I, so strains of 1e-12 keep all their digits. Symmetric tensors of histories: 11, 22, 33, 12, 13, 23.
"""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit

SWEEPS = 30  # of Jacobi's method, which takes about five


@njit(cache=True, error_model="numpy", forceinline=True)
def det_minus_one(
    h11: float, h12: float, h13: float, h21: float, h22: float, h23: float, h31: float, h32: float, h33: float
) -> float:
    """det(I + h) − 1 without cancellation, by the invariants of h."""
    second = h11 * h22 - h12 * h21 + (h11 * h33 - h13 * h31) + (h22 * h33 - h23 * h32)
    third = h11 * (h22 * h33 - h23 * h32) - h12 * (h21 * h33 - h23 * h31) + h13 * (h21 * h32 - h22 * h31)
    return h11 + h22 + h33 + second + third


@njit(cache=True, error_model="numpy", forceinline=True)
def _rotation(app: float, aqq: float, apq: float) -> tuple[float, float, float]:
    """Tangent, sine, and sine over one plus cosine of the angle that annihilates a_pq (Golub & Van Loan 2013, section 8.5)."""
    theta = (aqq - app) / (2.0 * apq)
    t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
    c = 1.0 / math.sqrt(t * t + 1.0)
    return t, t * c, t * c / (1.0 + c)


@njit(cache=True, error_model="numpy", forceinline=True)
def _turn(Q, p, q, s, tau):
    """Columns p and q of Q (3, 3) after a rotation of `_rotation`."""
    for r in range(3):
        x, y = Q[r, p], Q[r, q]
        Q[r, p], Q[r, q] = x - s * (y + tau * x), y + s * (x - tau * y)


@njit(cache=True, error_model="numpy")
def principal(
    b11: float, b22: float, b33: float, b12: float, b13: float, b23: float, Q: np.ndarray
) -> tuple[float, float, float]:
    """Eigenvalues of a symmetric 3 × 3 tensor, in no order, and unit eigenvectors → columns of Q (3, 3).

    Cyclic Jacobi (1846): eigenvalues within round-off of ‖b‖ and orthogonal directions however close they lie, which the
    trigonometric formula does not give.
    """
    for i in range(3):
        for j in range(3):
            Q[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        # convergence is quadratic: the sweep that follows a small remainder makes it smaller than any rounding
        if abs(b12) + abs(b13) + abs(b23) <= 1e-18 * (abs(b11) + abs(b22) + abs(b33)):
            break
        if b12 != 0.0:
            t, s, tau = _rotation(b11, b22, b12)
            b11, b22, b12 = b11 - t * b12, b22 + t * b12, 0.0
            b13, b23 = b13 - s * (b23 + tau * b13), b23 + s * (b13 - tau * b23)
            _turn(Q, 0, 1, s, tau)
        if b13 != 0.0:
            t, s, tau = _rotation(b11, b33, b13)
            b11, b33, b13 = b11 - t * b13, b33 + t * b13, 0.0
            b12, b23 = b12 - s * (b23 + tau * b12), b23 + s * (b12 - tau * b23)
            _turn(Q, 0, 2, s, tau)
        if b23 != 0.0:
            t, s, tau = _rotation(b22, b33, b23)
            b22, b33, b23 = b22 - t * b23, b33 + t * b23, 0.0
            b12, b13 = b12 - s * (b13 + tau * b12), b13 + s * (b12 - tau * b13)
            _turn(Q, 1, 2, s, tau)
    return b11, b22, b33


@njit(cache=True, error_model="numpy", forceinline=True)
def push_forward(h, old, i):
    """B = f B_n fᵀ + h + hᵀ + h hᵀ with B = b − I: 11, 22, 33, 12, 13, 23 at point i of h (n, 9), old (n, ≥6)."""
    h11, h12, h13 = h[i, 0], h[i, 1], h[i, 2]
    h21, h22, h23 = h[i, 3], h[i, 4], h[i, 5]
    h31, h32, h33 = h[i, 6], h[i, 7], h[i, 8]
    o11, o22, o33, o12, o13, o23 = old[i, 0], old[i, 1], old[i, 2], old[i, 3], old[i, 4], old[i, 5]
    f11, f22, f33 = 1.0 + h11, 1.0 + h22, 1.0 + h33
    a11, a12, a13 = (
        f11 * o11 + h12 * o12 + h13 * o13,
        f11 * o12 + h12 * o22 + h13 * o23,
        f11 * o13 + h12 * o23 + h13 * o33,
    )
    a21, a22, a23 = (
        h21 * o11 + f22 * o12 + h23 * o13,
        h21 * o12 + f22 * o22 + h23 * o23,
        h21 * o13 + f22 * o23 + h23 * o33,
    )
    a31, a32, a33 = (
        h31 * o11 + h32 * o12 + f33 * o13,
        h31 * o12 + h32 * o22 + f33 * o23,
        h31 * o13 + h32 * o23 + f33 * o33,
    )
    b11 = a11 * f11 + a12 * h12 + a13 * h13 + 2.0 * h11 + (h11 * h11 + h12 * h12 + h13 * h13)
    b22 = a21 * h21 + a22 * f22 + a23 * h23 + 2.0 * h22 + (h21 * h21 + h22 * h22 + h23 * h23)
    b33 = a31 * h31 + a32 * h32 + a33 * f33 + 2.0 * h33 + (h31 * h31 + h32 * h32 + h33 * h33)
    b12 = a11 * h21 + a12 * f22 + a13 * h23 + (h12 + h21) + (h11 * h21 + h12 * h22 + h13 * h23)
    b13 = a11 * h31 + a12 * h32 + a13 * f33 + (h13 + h31) + (h11 * h31 + h12 * h32 + h13 * h33)
    b23 = a21 * h31 + a22 * h32 + a23 * f33 + (h23 + h32) + (h21 * h31 + h22 * h32 + h23 * h33)
    return b11, b22, b33, b12, b13, b23


@njit(cache=True, error_model="numpy", forceinline=True)
def det_of(h, i):
    """Determinant of I + h, less one, at point i of h (n, 9)."""
    return det_minus_one(h[i, 0], h[i, 1], h[i, 2], h[i, 3], h[i, 4], h[i, 5], h[i, 6], h[i, 7], h[i, 8])


@njit(cache=True, error_model="numpy", forceinline=True)
def det_of_kept(old, i):
    """Determinant of b_n, less one, at point i of histories (n, ≥6) b_n − I."""
    o12, o13, o23 = old[i, 3], old[i, 4], old[i, 5]
    return det_minus_one(old[i, 0], o12, o13, o12, old[i, 1], o23, o13, o23, old[i, 2])


@njit(cache=True, error_model="numpy", forceinline=True)
def inverse_of(h, i, g):
    """(I + h)⁻¹ at point i of h (n, 9) → g (3, 3)."""
    f11, f12, f13 = 1.0 + h[i, 0], h[i, 1], h[i, 2]
    f21, f22, f23 = h[i, 3], 1.0 + h[i, 4], h[i, 5]
    f31, f32, f33 = h[i, 6], h[i, 7], 1.0 + h[i, 8]
    c11, c21, c31 = f22 * f33 - f23 * f32, f23 * f31 - f21 * f33, f21 * f32 - f22 * f31
    inverse = 1.0 / (f11 * c11 + f12 * c21 + f13 * c31)
    g[0, 0], g[1, 0], g[2, 0] = c11 * inverse, c21 * inverse, c31 * inverse
    g[0, 1] = (f13 * f32 - f12 * f33) * inverse
    g[1, 1] = (f11 * f33 - f13 * f31) * inverse
    g[2, 1] = (f12 * f31 - f11 * f32) * inverse
    g[0, 2] = (f12 * f23 - f13 * f22) * inverse
    g[1, 2] = (f13 * f21 - f11 * f23) * inverse
    g[2, 2] = (f11 * f22 - f12 * f21) * inverse


@njit(cache=True, error_model="numpy", forceinline=True)
def _keep_frame(Q, l1, l2, l3, jn, frame, i):
    """Columns of frame (n, 13) of point i."""
    for r in range(3):
        for c in range(3):
            frame[i, 3 * r + c] = Q[r, c]
    frame[i, 9] = l1
    frame[i, 10] = l2
    frame[i, 11] = l3
    frame[i, 12] = jn


@njit(cache=True, error_model="numpy")
def trial_finite(h, old, eps, frame, failed):
    """Trial left Cauchy-Green tensor b = f b_n fᵀ and its logarithmic principal strains (Simo 1992, Box 1).

    h (n, 9) = f − I; old (n, ≥6): b_n − I → eps (n, 3) = ½ ln b; frame (n, 13): see
    `prensa.layout.TensorLayout.frame`; failed (n,) is set where f or b
    has no positive determinant.
    """
    Q = np.empty((3, 3))
    for i in range(h.shape[0]):
        b11, b22, b33, b12, b13, b23 = push_forward(h, old, i)
        l1, l2, l3 = principal(b11, b22, b33, b12, b13, b23, Q)
        if not (det_of(h, i) > -1.0 and l1 > -1.0 and l2 > -1.0 and l3 > -1.0):
            failed[i] = True
            l1 = l2 = l3 = 0.0
        eps[i, 0] = 0.5 * math.log1p(l1)
        eps[i, 1] = 0.5 * math.log1p(l2)
        eps[i, 2] = 0.5 * math.log1p(l3)
        _keep_frame(Q, l1, l2, l3, math.sqrt(1.0 + det_of_kept(old, i)), frame, i)


@njit(cache=True, error_model="numpy")
def trial_small(h, old, eps, frame, failed):
    """Trial elastic strain ε_n + sym h of small strain and its principal values; arrays as in `trial_finite`.

    failed is never set: an infinitesimal strain of any size is admissible.
    """
    Q = np.empty((3, 3))
    for i in range(h.shape[0]):
        l1, l2, l3 = principal(
            old[i, 0] + h[i, 0], old[i, 1] + h[i, 4], old[i, 2] + h[i, 8],
            old[i, 3] + 0.5 * (h[i, 1] + h[i, 3]), old[i, 4] + 0.5 * (h[i, 2] + h[i, 6]),
            old[i, 5] + 0.5 * (h[i, 5] + h[i, 7]), Q,
        )  # fmt: skip
        eps[i, 0], eps[i, 1], eps[i, 2] = l1, l2, l3
        _keep_frame(Q, l1, l2, l3, 1.0, frame, i)


@njit(cache=True, error_model="numpy")
def elastic_strains(history, finite, eps):
    """Principal strains eps (n, 3) of histories (n, ≥6), b_e − I (``finite``, logarithmic) or ε_e."""
    Q = np.empty((3, 3))
    for i in range(history.shape[0]):
        l1, l2, l3 = principal(
            history[i, 0], history[i, 1], history[i, 2], history[i, 3], history[i, 4], history[i, 5], Q
        )
        if finite:
            l1, l2, l3 = 0.5 * math.log1p(l1), 0.5 * math.log1p(l2), 0.5 * math.log1p(l3)
        eps[i, 0], eps[i, 1], eps[i, 2] = l1, l2, l3


@njit(cache=True, error_model="numpy", forceinline=True)
def _shear_slope(tau, dtau, frame, i, a, b, rate):
    """(τ_a − τ_b)/(b_a − b_b), by its limit where the eigenvalues coincide; ``rate`` = ∂(b_a − b_b)/∂(ε_a − ε_b) there.

    The limit ½ (D_aa − D_ab − D_ba + D_bb)/rate is symmetric in a and b, so that it errs by the square of the difference
    b_a − b_b; the quotient errs by the round-off of the eigenvalues, which is that of the largest, over the difference.
    """
    la, lb = frame[i, 9 + a], frame[i, 9 + b]
    size = abs(frame[i, 9]) + abs(frame[i, 10]) + abs(frame[i, 11])
    if abs(la - lb) <= 1e-6 * size + 1e-14:
        return 0.5 * (dtau[i, a, a] - dtau[i, a, b] - dtau[i, b, a] + dtau[i, b, b]) / rate
    return (tau[i, a] - tau[i, b]) / (la - lb)


@njit(cache=True, error_model="numpy", forceinline=True)
def _compose(i, values, Q, out):
    """Σ_a values_a n_a ⊗ n_a → out[i, :6] as 11, 22, 33, 12, 13, 23."""
    v0, v1, v2 = values
    out[i, 0] = v0 * Q[0, 0] * Q[0, 0] + v1 * Q[0, 1] * Q[0, 1] + v2 * Q[0, 2] * Q[0, 2]
    out[i, 1] = v0 * Q[1, 0] * Q[1, 0] + v1 * Q[1, 1] * Q[1, 1] + v2 * Q[1, 2] * Q[1, 2]
    out[i, 2] = v0 * Q[2, 0] * Q[2, 0] + v1 * Q[2, 1] * Q[2, 1] + v2 * Q[2, 2] * Q[2, 2]
    out[i, 3] = v0 * Q[0, 0] * Q[1, 0] + v1 * Q[0, 1] * Q[1, 1] + v2 * Q[0, 2] * Q[1, 2]
    out[i, 4] = v0 * Q[0, 0] * Q[2, 0] + v1 * Q[0, 1] * Q[2, 1] + v2 * Q[0, 2] * Q[2, 2]
    out[i, 5] = v0 * Q[1, 0] * Q[2, 0] + v1 * Q[1, 1] * Q[2, 1] + v2 * Q[1, 2] * Q[2, 2]


@njit(cache=True, error_model="numpy", forceinline=True)
def _turn_tangent(i, Q, T, D, S, X, V, A):
    """A[(iJ)(kL)] = Q_ia T_Jb M_abcd Q_kc T_Ld → A[i] (9, 9).

    M in principal axes has D_ab in (aa)(bb), S_ab in (ab)(ab) and X_ab in (ab)(ba).
    Q, T, D, S, X and the scratch V are (3, 3); the diagonals of S and X are not read.
    """
    for k in range(3):
        for L in range(3):
            for a in range(3):
                # V_ab = Σ_cd M_abcd Q_kc T_Ld
                V[a, a] = D[a, 0] * Q[k, 0] * T[L, 0] + D[a, 1] * Q[k, 1] * T[L, 1] + D[a, 2] * Q[k, 2] * T[L, 2]
                for b in range(3):
                    if a != b:
                        V[a, b] = S[a, b] * Q[k, a] * T[L, b] + X[a, b] * Q[k, b] * T[L, a]
            for m in range(3):
                w0 = Q[m, 0] * V[0, 0] + Q[m, 1] * V[1, 0] + Q[m, 2] * V[2, 0]
                w1 = Q[m, 0] * V[0, 1] + Q[m, 1] * V[1, 1] + Q[m, 2] * V[2, 1]
                w2 = Q[m, 0] * V[0, 2] + Q[m, 1] * V[1, 2] + Q[m, 2] * V[2, 2]
                for J in range(3):
                    A[i, 3 * m + J, 3 * k + L] = w0 * T[J, 0] + w1 * T[J, 1] + w2 * T[J, 2]


@njit(cache=True, error_model="numpy")
def stress_finite(h, frame, tau, dtau, eps_e, P, A, new, tangent):
    """First Piola-Kirchhoff stress per committed volume and, if ``tangent``, its exact derivative, from principal stresses.

    h (n, 9); frame (n, 13) of `trial_finite`; tau (n, 3), dtau (n, 3, 3) = ∂τ/∂ε_trial, eps_e (n, 3) the elastic
    logarithmic strains after the return → P (n, 9) = τ f⁻ᵀ/J_n, A (n, 9, 9) = ∂P/∂f, new (n, ≥6): b_e − I.

    In principal axes dτ_aa = Σ_b D_ab l_bb, dτ_ab = s_ab (b_b l_ab + b_a l_ba) with l = df f⁻¹ and
    s_ab = (τ_a − τ_b)/(b_a − b_b), and dP = (dτ − τ lᵀ) f⁻ᵀ/J_n (Simo 1992; Miehe 1998; de Souza Neto, Perić & Owen 2008,
    ch. 14 and appendix A).
    """
    g, Q, T = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    D, S, X, V = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for i in range(h.shape[0]):
        inverse_of(h, i, g)
        for r in range(3):
            for c in range(3):
                Q[r, c] = frame[i, 3 * r + c]
        for J in range(3):
            for a in range(3):  # T = f⁻¹ Q
                T[J, a] = g[J, 0] * Q[0, a] + g[J, 1] * Q[1, a] + g[J, 2] * Q[2, a]
        jn = 1.0 / frame[i, 12]
        t0, t1, t2 = jn * tau[i, 0], jn * tau[i, 1], jn * tau[i, 2]
        for m in range(3):
            for J in range(3):
                P[i, 3 * m + J] = t0 * Q[m, 0] * T[J, 0] + t1 * Q[m, 1] * T[J, 1] + t2 * Q[m, 2] * T[J, 2]
        strains = math.expm1(2.0 * eps_e[i, 0]), math.expm1(2.0 * eps_e[i, 1]), math.expm1(2.0 * eps_e[i, 2])
        _compose(i, strains, Q, new)
        if not tangent:
            continue
        for a in range(3):
            for b in range(3):
                D[a, b] = jn * dtau[i, a, b]
            D[a, a] -= jn * tau[i, a]
            for b in range(a):
                ba, bb = 1.0 + frame[i, 9 + a], 1.0 + frame[i, 9 + b]
                s = _shear_slope(tau, dtau, frame, i, a, b, ba + bb)
                S[a, b], X[a, b] = jn * s * bb, jn * (s * ba - tau[i, a])
                S[b, a], X[b, a] = jn * s * ba, jn * (s * bb - tau[i, b])
        _turn_tangent(i, Q, T, D, S, X, V, A)


@njit(cache=True, error_model="numpy")
def stress_small(h, frame, sigma, dsigma, eps_e, P, A, new, tangent):
    """Stress and, if ``tangent``, its derivative in small strain from principal values; arrays as in `stress_finite` (P = σ)."""
    Q, D, S, V = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for i in range(h.shape[0]):
        for r in range(3):
            for c in range(3):
                Q[r, c] = frame[i, 3 * r + c]
        t0, t1, t2 = sigma[i, 0], sigma[i, 1], sigma[i, 2]
        for m in range(3):
            for J in range(m + 1):
                value = t0 * Q[m, 0] * Q[J, 0] + t1 * Q[m, 1] * Q[J, 1] + t2 * Q[m, 2] * Q[J, 2]
                P[i, 3 * m + J] = P[i, 3 * J + m] = value
        _compose(i, (eps_e[i, 0], eps_e[i, 1], eps_e[i, 2]), Q, new)
        if not tangent:
            continue
        for a in range(3):
            for b in range(3):
                D[a, b] = dsigma[i, a, b]
            for b in range(a):
                S[a, b] = S[b, a] = 0.5 * _shear_slope(sigma, dsigma, frame, i, a, b, 1.0)
        # dσ_ab = ½ s_ab (l_ab + l_ba)
        _turn_tangent(i, Q, Q, D, S, S, V, A)


@njit(cache=True, error_model="numpy")
def keep_trial(h, old, first, new, finite):
    """Elastic tensor that old tensors (columns ``first`` …) would have become if nothing had flowed → columns 8 … 13 of new.

    h (n, 9); old, new (n, ≥14) as in `prensa.materials.laws.J2`. Points whose plastic strain (column 6) stayed keep what they
    are: in them nothing has flowed, and round-off is not to say otherwise.
    """
    for i in range(h.shape[0]):
        if new[i, 6] == old[i, 6]:
            for k in range(6):
                new[i, 8 + k] = new[i, k]
        elif finite:
            b11, b22, b33, b12, b13, b23 = push_forward(h, old[:, first:], i)
            new[i, 8], new[i, 9], new[i, 10], new[i, 11], new[i, 12], new[i, 13] = b11, b22, b33, b12, b13, b23
        else:
            was = old[i, first:]
            new[i, 8], new[i, 9], new[i, 10] = was[0] + h[i, 0], was[1] + h[i, 4], was[2] + h[i, 8]
            new[i, 11] = was[3] + 0.5 * (h[i, 1] + h[i, 3])
            new[i, 12] = was[4] + 0.5 * (h[i, 2] + h[i, 6])
            new[i, 13] = was[5] + 0.5 * (h[i, 5] + h[i, 7])


@njit(cache=True, error_model="numpy")
def _strain(history, first, finite, Q, i, out):
    """Components 11, 22, 33, 12, 13, 23 of the (logarithmic) strain of b − I in columns from ``first`` on → out[0] (6,)."""
    if not finite:
        for k in range(6):
            out[0, k] = history[i, first + k]
        return
    l1, l2, l3 = principal(
        history[i, first], history[i, first + 1], history[i, first + 2],
        history[i, first + 3], history[i, first + 4], history[i, first + 5], Q,
    )  # fmt: skip
    _compose(0, (0.5 * math.log1p(l1), 0.5 * math.log1p(l2), 0.5 * math.log1p(l3)), Q, out)


@njit(cache=True, error_model="numpy")
def begin(history, finite, share, out):
    """Elastic strains and plastic strain (columns 0 … 6) after a ``share`` of the last increment's plastic strain more → out.

    history, out (n, ≥14) as in `prensa.materials.laws.J2`: that strain is what elastic and trial tensor differ by. The trial
    tensor of out is the elastic one of history. Of out no other column is written, and of points that did not flow that alone.
    """
    Q, e, d = np.empty((3, 3)), np.empty((1, 6)), np.empty((1, 6))
    for i in range(history.shape[0]):
        same = True
        for k in range(6):
            same = same and history[i, k] == history[i, 8 + k]
            out[i, 8 + k] = history[i, k]
        if same or share == 0.0:
            continue
        _strain(history, 0, finite, Q, i, e)
        _strain(history, 8, finite, Q, i, d)
        third = (d[0, 0] + d[0, 1] + d[0, 2] - e[0, 0] - e[0, 1] - e[0, 2]) / 3.0
        size = 0.0
        for k in range(6):
            d[0, k] -= e[0, k] + (third if k < 3 else 0.0)
            size += d[0, k] * d[0, k] * (1.0 if k < 3 else 2.0)
            e[0, k] -= share * d[0, k]
        out[i, 6] = history[i, 6] + share * math.sqrt(size / 1.5)
        if finite:
            l1, l2, l3 = principal(e[0, 0], e[0, 1], e[0, 2], e[0, 3], e[0, 4], e[0, 5], Q)
            _compose(0, (math.expm1(2.0 * l1), math.expm1(2.0 * l2), math.expm1(2.0 * l3)), Q, e)
        for k in range(6):
            out[i, k] = e[0, k]
