"""Second-order tensors of plane and axisymmetric problems, five components in the order 11, 12, 21, 22, 33.

Deformation gradients travel as h = f − I, and left Cauchy-Green tensors as B = b − I: strains of 1e-12 keep all their
digits that way, so residuals converge to round-off at any load.
"""

from __future__ import annotations

import math

from prensa.kernels.compiled import njit
from prensa.kernels.series import GROUP, SMALL_LOG, half_log


@njit(cache=True, error_model="numpy", forceinline=True)
def det_minus_one(h11: float, h12: float, h21: float, h22: float, h33: float) -> float:
    """det(I + h) − 1 without cancellation."""
    d = h11 + h22 + h11 * h22 - h12 * h21
    return d + h33 + d * h33


@njit(cache=True, error_model="numpy", forceinline=True)
def principal(b11: float, b22: float, b12: float) -> tuple[float, float, float, float]:
    """Eigenvalues λ₁ ≥ λ₂ of a symmetric 2 × 2 tensor and the direction (cos, sin) of the first."""
    mean = 0.5 * (b11 + b22)
    d = 0.5 * (b11 - b22)
    r = math.sqrt(d * d + b12 * b12)
    if r == 0.0:
        return mean, mean, 1.0, 0.0
    # each branch divides by the larger of cos and sin
    if d >= 0.0:
        c = math.sqrt(0.5 * (1.0 + d / r))
        s = b12 / (2.0 * r * c)
    else:
        s = math.copysign(math.sqrt(0.5 * (1.0 - d / r)), b12)
        c = b12 / (2.0 * r * s)
    return mean + r, mean - r, c, s


@njit(cache=True, error_model="numpy", forceinline=True)
def push_forward(h11, h12, h21, h22, h33, o11, o22, o33, o12):
    """B = f B_n fᵀ + h + hᵀ + h hᵀ with B = b − I: 11, 22, 33, 12 of f = I + h, B_n = I + o."""
    f11, f22, f33 = 1.0 + h11, 1.0 + h22, 1.0 + h33
    a11 = f11 * o11 + h12 * o12
    a12 = f11 * o12 + h12 * o22
    a21 = h21 * o11 + f22 * o12
    a22 = h21 * o12 + f22 * o22
    b11 = a11 * f11 + a12 * h12 + 2.0 * h11 + h11 * h11 + h12 * h12
    b12 = a11 * h21 + a12 * f22 + h12 + h21 + h11 * h21 + h12 * h22
    b22 = a21 * h21 + a22 * f22 + 2.0 * h22 + h21 * h21 + h22 * h22
    b33 = f33 * f33 * o33 + 2.0 * h33 + h33 * h33
    return b11, b22, b33, b12


@njit(cache=True, error_model="numpy")
def trial_finite(h, old, eps, frame, failed):
    """Trial left Cauchy-Green tensor b = f b_n fᵀ and its logarithmic principal strains (Simo 1992, Box 1).

    h (n, 5) = f − I; old (n, ≥4): b_n − I as 11, 22, 33, 12 → eps (n, 3) = ½ ln b; frame (n, 6): cos, sin of the first
    principal direction, b − I principal (3), J_n = √det b_n; failed (n,) is set where f or b has no positive determinant.
    """
    for i in range(h.shape[0]):
        h11, h12, h21, h22, h33 = h[i, 0], h[i, 1], h[i, 2], h[i, 3], h[i, 4]
        f33, o11, o22, o33, o12 = 1.0 + h33, old[i, 0], old[i, 1], old[i, 2], old[i, 3]
        b11, b22, b33, b12 = push_forward(h11, h12, h21, h22, h33, o11, o22, o33, o12)
        l1, l2, c, s = principal(b11, b22, b12)
        jac = det_minus_one(h11, h12, h21, h22, h33)
        d = (1.0 + o11) * (1.0 + o22) - o12 * o12
        if not (jac > -1.0 and f33 > 0.0 and l2 > -1.0 and b33 > -1.0):
            failed[i] = True
            l1 = l2 = b33 = 0.0
        eps[i, 0] = 0.5 * math.log1p(l1)
        eps[i, 1] = 0.5 * math.log1p(l2)
        eps[i, 2] = 0.5 * math.log1p(b33)
        frame[i, 0] = c
        frame[i, 1] = s
        frame[i, 2] = l1
        frame[i, 3] = l2
        frame[i, 4] = b33
        frame[i, 5] = math.sqrt(d * (1.0 + o33))


@njit(cache=True, error_model="numpy")
def trial_small(h, old, eps, frame, failed):
    """Trial elastic strain ε_n + sym h of small strain and its principal values; arrays as in `trial_finite`.

    failed is never set: an infinitesimal strain of any size is admissible.
    """
    for i in range(h.shape[0]):
        l1, l2, c, s = principal(old[i, 0] + h[i, 0], old[i, 1] + h[i, 3], old[i, 3] + 0.5 * (h[i, 1] + h[i, 2]))
        eps[i, 0] = l1
        eps[i, 1] = l2
        eps[i, 2] = old[i, 2] + h[i, 4]
        frame[i, 0] = c
        frame[i, 1] = s
        frame[i, 2] = l1
        frame[i, 3] = l2
        frame[i, 4] = eps[i, 2]
        frame[i, 5] = 1.0


@njit(cache=True, error_model="numpy")
def elastic_strains(history, finite, eps):
    """Principal strains eps (n, 3) of histories (n, ≥4), b_e − I as 11, 22, 33, 12 (``finite``, logarithmic) or ε_e."""
    flat = eps.reshape(eps.size)
    for first in range(0, history.shape[0], GROUP):
        last, far = min(first + GROUP, history.shape[0]), 0
        for i in range(first, last):
            b11, b22, b33, b12 = history[i, 0], history[i, 1], history[i, 2], history[i, 3]
            mean, half = 0.5 * (b11 + b22), 0.5 * (b11 - b22)
            r = math.sqrt(half * half + b12 * b12)
            eps[i, 0], eps[i, 1], eps[i, 2] = mean + r, mean - r, b33
            near = (abs(mean) + r <= SMALL_LOG) & (abs(b33) <= SMALL_LOG)
            far += 0 if near else 1
        part = flat[3 * first : 3 * last]
        if finite and not far:
            for k in range(len(part)):
                part[k] = half_log(part[k])
        elif finite:
            for k in range(len(part)):
                part[k] = 0.5 * math.log1p(part[k])


@njit(cache=True, error_model="numpy", forceinline=True)
def _shear_slope(t1: float, t2: float, b1: float, b2: float, limit: float) -> float:
    """(τ₁ − τ₂)/(b₁ − b₂), by its limit where the eigenvalues coincide."""
    if abs(b1 - b2) <= 1e-7 * (abs(b1) + abs(b2)) + 1e-14:
        return limit
    return (t1 - t2) / (b1 - b2)


@njit(cache=True, error_model="numpy")
def stress_finite(h, frame, tau, dtau, eps_e, P, A, new, tangent):
    """First Piola-Kirchhoff stress per committed volume and, if ``tangent``, its exact derivative, from principal stresses.

    h (n, 5); frame (n, 6) of `trial_finite`; tau (n, 3), dtau (n, 3, 3) = ∂τ/∂ε_trial, eps_e (n, 3) the elastic
    logarithmic strains after the return → P (n, 5) = τ f⁻ᵀ/J_n, A (n, 5, 5) = ∂P/∂f, new (n, ≥4): b_e − I.

    In principal axes dτ_ii = Σ_j D_ij l_jj, dτ_12 = s (b₂ l_12 + b₁ l_21) with l = df f⁻¹ and
    s = (τ₁ − τ₂)/(b₁ − b₂), and dP = (dτ − τ lᵀ) f⁻ᵀ/J_n (Miehe 1998; de Souza Neto, Perić & Owen 2008, ch. 14).
    """
    for i in range(h.shape[0]):
        h11, h12, h21, h22, h33 = h[i, 0], h[i, 1], h[i, 2], h[i, 3], h[i, 4]
        c, s = frame[i, 0], frame[i, 1]
        l1, l2 = frame[i, 2], frame[i, 3]
        b1, b2 = 1.0 + l1, 1.0 + l2
        t1, t2, t3 = tau[i, 0], tau[i, 1], tau[i, 2]
        jn = 1.0 / frame[i, 5]
        inverse = 1.0 / ((1.0 + h11) * (1.0 + h22) - h12 * h21)
        g11, g12, g21, g22 = (1.0 + h22) * inverse, -h12 * inverse, -h21 * inverse, (1.0 + h11) * inverse
        g33 = 1.0 / (1.0 + h33)
        # T = f⁻¹ Q with Q = [n₁ n₂]
        T11, T12 = g11 * c + g12 * s, -g11 * s + g12 * c
        T21, T22 = g21 * c + g22 * s, -g21 * s + g22 * c
        # R[(iJ)][(ab)] = Q_ia T_Jb, rows and columns 11, 12, 21, 22; tuples, because what is stored in an array would have to
        # be read again after every store into another
        R = (
            (c * T11, c * T12, -s * T11, -s * T12),
            (c * T21, c * T22, -s * T21, -s * T22),
            (s * T11, s * T12, c * T11, c * T12),
            (s * T21, s * T22, c * T21, c * T22),
        )
        for k in range(4):
            P[i, k] = jn * (R[k][0] * t1 + R[k][3] * t2)
        P[i, 4] = jn * t3 * g33
        e1, e2 = math.expm1(2.0 * eps_e[i, 0]), math.expm1(2.0 * eps_e[i, 1])
        new[i, 0] = c * c * e1 + s * s * e2
        new[i, 1] = s * s * e1 + c * c * e2
        new[i, 2] = math.expm1(2.0 * eps_e[i, 2])
        new[i, 3] = c * s * (e1 - e2)
        if not tangent:
            continue
        sh = _shear_slope(t1, t2, l1, l2, (dtau[i, 0, 0] - dtau[i, 0, 1]) / (2.0 * b1))
        m00, m03 = jn * (dtau[i, 0, 0] - t1), jn * dtau[i, 0, 1]
        m30, m33 = jn * dtau[i, 1, 0], jn * (dtau[i, 1, 1] - t2)
        m11, m12 = jn * sh * b2, jn * (sh * b1 - t1)
        m21, m22 = jn * (sh * b2 - t2), jn * sh * b1
        m04, m34 = jn * g33 * dtau[i, 0, 2], jn * g33 * dtau[i, 1, 2]
        m40, m43 = jn * g33 * dtau[i, 2, 0], jn * g33 * dtau[i, 2, 1]
        m44 = jn * g33 * g33 * (dtau[i, 2, 2] - t3)
        for k in range(4):
            r0, r1, r2, r3 = R[k]
            w0, w1 = r0 * m00 + r3 * m30, r1 * m11 + r2 * m21
            w2, w3 = r1 * m12 + r2 * m22, r0 * m03 + r3 * m33
            for m in range(4):
                A[i, k, m] = w0 * R[m][0] + w1 * R[m][1] + w2 * R[m][2] + w3 * R[m][3]
            A[i, k, 4] = r0 * m04 + r3 * m34
            A[i, 4, k] = r0 * m40 + r3 * m43
        A[i, 4, 4] = m44


@njit(cache=True, error_model="numpy")
def stress_small(h, frame, sigma, dsigma, eps_e, P, A, new, tangent):
    """Stress and, if ``tangent``, its derivative in small strain from principal values; arrays as in `stress_finite` (P = σ)."""
    for i in range(h.shape[0]):
        c, s = frame[i, 0], frame[i, 1]
        t1, t2, t3 = sigma[i, 0], sigma[i, 1], sigma[i, 2]
        R = (  # as in `stress_finite`
            (c * c, -c * s, -s * c, s * s),
            (c * s, c * c, -s * s, -s * c),
            (s * c, -s * s, c * c, -c * s),
            (s * s, s * c, c * s, c * c),
        )
        P[i, 0] = c * c * t1 + s * s * t2
        P[i, 1] = P[i, 2] = c * s * (t1 - t2)
        P[i, 3] = s * s * t1 + c * c * t2
        P[i, 4] = t3
        e1, e2 = eps_e[i, 0], eps_e[i, 1]
        new[i, 0] = c * c * e1 + s * s * e2
        new[i, 1] = s * s * e1 + c * c * e2
        new[i, 2] = eps_e[i, 2]
        new[i, 3] = c * s * (e1 - e2)
        if not tangent:
            continue
        sh = 0.5 * _shear_slope(t1, t2, frame[i, 2], frame[i, 3], dsigma[i, 0, 0] - dsigma[i, 0, 1])
        m00, m03, m04 = dsigma[i, 0, 0], dsigma[i, 0, 1], dsigma[i, 0, 2]
        m30, m33, m34 = dsigma[i, 1, 0], dsigma[i, 1, 1], dsigma[i, 1, 2]
        m40, m43, m44 = dsigma[i, 2, 0], dsigma[i, 2, 1], dsigma[i, 2, 2]
        for k in range(4):
            r0, r1, r2, r3 = R[k]
            w0, w1, w3 = r0 * m00 + r3 * m30, sh * (r1 + r2), r0 * m03 + r3 * m33
            for m in range(4):
                A[i, k, m] = w0 * R[m][0] + w1 * (R[m][1] + R[m][2]) + w3 * R[m][3]
            A[i, k, 4] = r0 * m04 + r3 * m34
            A[i, 4, k] = r0 * m40 + r3 * m43
        A[i, 4, 4] = m44


@njit(cache=True, error_model="numpy")
def keep_trial(h, old, first, new, finite):
    """Elastic tensor that old tensors (columns ``first`` …) would have become if nothing had flowed → columns 6 … 9 of new.

    h (n, 5); old, new (n, ≥10) as in `prensa.materials.laws.J2`. Points whose plastic strain (column 4) stayed keep what they
    are: in them nothing has flowed, and round-off is not to say otherwise.
    """
    for i in range(h.shape[0]):
        if new[i, 4] == old[i, 4]:
            for k in range(4):
                new[i, 6 + k] = new[i, k]
            continue
        if finite:
            new[i, 6], new[i, 7], new[i, 8], new[i, 9] = push_forward(
                h[i, 0], h[i, 1], h[i, 2], h[i, 3], h[i, 4],
                old[i, first], old[i, first + 1], old[i, first + 2], old[i, first + 3],
            )  # fmt: skip
        else:
            new[i, 6], new[i, 7] = old[i, first] + h[i, 0], old[i, first + 1] + h[i, 3]
            new[i, 8], new[i, 9] = old[i, first + 2] + h[i, 4], old[i, first + 3] + 0.5 * (h[i, 1] + h[i, 2])


@njit(cache=True, error_model="numpy", forceinline=True)
def _strain(b11, b22, b33, b12, finite):
    """Components of the (logarithmic) strain of b − I; of a small strain itself."""
    if not finite:
        return b11, b22, b33, b12
    l1, l2, c, s = principal(b11, b22, b12)
    e1, e2 = 0.5 * math.log1p(l1), 0.5 * math.log1p(l2)
    return c * c * e1 + s * s * e2, s * s * e1 + c * c * e2, 0.5 * math.log1p(b33), c * s * (e1 - e2)


@njit(cache=True, error_model="numpy")
def begin(history, finite, share, out):
    """Elastic strains and plastic strain (columns 0 … 4) after a ``share`` of the last increment's plastic strain more → out.

    history, out (n, ≥10) as in `prensa.materials.laws.J2`: that strain is what elastic and trial tensor differ by. The trial
    tensor of out is the elastic one of history. Of out no other column is written, and of points that did not flow that alone.
    """
    for i in range(history.shape[0]):
        same = True
        for k in range(4):
            same = same and history[i, k] == history[i, 6 + k]
            out[i, 6 + k] = history[i, k]
        if same or share == 0.0:
            continue
        e11, e22, e33, e12 = _strain(history[i, 0], history[i, 1], history[i, 2], history[i, 3], finite)
        d11, d22, d33, d12 = _strain(history[i, 6], history[i, 7], history[i, 8], history[i, 9], finite)
        d11, d22, d33, d12 = d11 - e11, d22 - e22, d33 - e33, d12 - e12
        third = (d11 + d22 + d33) / 3.0
        d11, d22, d33 = d11 - third, d22 - third, d33 - third
        out[i, 4] = history[i, 4] + share * math.sqrt((d11 * d11 + d22 * d22 + d33 * d33 + 2.0 * d12 * d12) / 1.5)
        e11, e22, e33, e12 = e11 - share * d11, e22 - share * d22, e33 - share * d33, e12 - share * d12
        if finite:
            e1, e2, c, s = principal(e11, e22, e12)
            b1, b2 = math.expm1(2.0 * e1), math.expm1(2.0 * e2)
            e11, e22, e33, e12 = c * c * b1 + s * s * b2, s * s * b1 + c * c * b2, math.expm1(2.0 * e33), c * s * (b1 - b2)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = e11, e22, e33, e12
