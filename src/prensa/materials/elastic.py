"""Elastic laws: Hooke in small strain; Hencky, neo-Hooke, St. Venant-Kirchhoff in principal strains in finite strain."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def hooke(h, old, lam, mu, P, A, new):
    """H (n, 5), old (n, 4) strain 11, 22, 33, 12 → P = σ (n, 5), A (n, 5, 5) constant, new (n, 4) strain."""
    for i in range(h.shape[0]):
        e11, e22, e33 = old[i, 0] + h[i, 0], old[i, 1] + h[i, 3], old[i, 2] + h[i, 4]
        e12 = old[i, 3] + 0.5 * (h[i, 1] + h[i, 2])
        p = lam * (e11 + e22 + e33)
        P[i, 0] = p + 2.0 * mu * e11
        P[i, 1] = P[i, 2] = 2.0 * mu * e12
        P[i, 3] = p + 2.0 * mu * e22
        P[i, 4] = p + 2.0 * mu * e33
        new[i, 0], new[i, 1], new[i, 2], new[i, 3] = e11, e22, e33, e12
        for k in range(5):
            for m in range(5):
                A[i, k, m] = 0.0
        for k in (0, 3, 4):
            for m in (0, 3, 4):
                A[i, k, m] = lam
            A[i, k, k] += 2.0 * mu
        A[i, 1, 1] = A[i, 1, 2] = A[i, 2, 1] = A[i, 2, 2] = mu


@njit(cache=True, error_model="numpy")
def hencky(eps, lam, mu, tau, dtau, eps_e):
    """Eps (n, 3) principal logarithmic strains → τ_i = λ tr ε + 2μ ε_i (Hencky 1928), dtau (n, 3, 3), eps_e = eps."""
    for i in range(eps.shape[0]):
        p = lam * (eps[i, 0] + eps[i, 1] + eps[i, 2])
        for k in range(3):
            tau[i, k] = p + 2.0 * mu * eps[i, k]
            eps_e[i, k] = eps[i, k]
            for m in range(3):
                dtau[i, k, m] = lam
            dtau[i, k, k] += 2.0 * mu


@njit(cache=True, error_model="numpy")
def neo_hooke(eps, lam, mu, tau, dtau, eps_e):
    """ψ = μ/2 (I₁ − 3) − μ ln J + λ/2 (ln J)²: τ_i = μ (e^{2ε_i} − 1) + λ tr ε; arrays as in `hencky`."""
    for i in range(eps.shape[0]):
        p = lam * (eps[i, 0] + eps[i, 1] + eps[i, 2])
        for k in range(3):
            tau[i, k] = p + mu * math.expm1(2.0 * eps[i, k])
            eps_e[i, k] = eps[i, k]
            for m in range(3):
                dtau[i, k, m] = lam
            dtau[i, k, k] += 2.0 * mu * math.exp(2.0 * eps[i, k])


@njit(cache=True)
def st_venant_kirchhoff(eps, lam, mu, tau, dtau, eps_e):
    """ψ = λ/2 (tr E)² + μ E:E in Green's strain E_i = (b_i − 1)/2, b_i = e^{2ε_i}: τ_i = b_i (λ tr E + 2μ E_i); as `hencky`."""
    for i in range(eps.shape[0]):
        trace = 0.0
        for k in range(3):
            trace += 0.5 * math.expm1(2.0 * eps[i, k])
        for k in range(3):
            b = math.exp(2.0 * eps[i, k])
            tau[i, k] = b * (lam * trace + mu * math.expm1(2.0 * eps[i, k]))
            eps_e[i, k] = eps[i, k]
            for m in range(3):
                dtau[i, k, m] = lam * b * math.exp(2.0 * eps[i, m])
            dtau[i, k, k] += 2.0 * tau[i, k] + 2.0 * mu * b * b


def quadratic_energy(eps: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """ψ = λ/2 (tr ε)² + μ ε:ε per initial volume; eps (..., 3) principal elastic strains → (...)."""
    return np.asarray(0.5 * lam * eps.sum(-1) ** 2 + mu * (eps**2).sum(-1))


def neo_hooke_energy(eps: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """ψ of `neo_hooke` per initial volume; eps (..., 3) → (...)."""
    ln_j = eps.sum(-1)
    return np.asarray(0.5 * mu * np.expm1(2.0 * eps).sum(-1) - mu * ln_j + 0.5 * lam * ln_j**2)
