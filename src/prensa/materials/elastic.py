"""Elastic laws without principal axes, as point functions in plane and space: Hooke, neo-Hooke, St. Venant-Kirchhoff.

Of tensors b the part b − I is kept, of f that of the increment, h; P is the first Piola-Kirchhoff stress per committed volume.
Numbers of a point function may be recorded ones or arrays; tangents are generated from it (`prensa.kernels.differentiate`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from prensa.kernels.algebra import (
    SPACE_AXES,
    UNIT,
    Tensor,
    by_transposed,
    cofactors,
    components,
    det_less_one,
    kept,
    plus,
    product,
    push_forward,
    symmetric,
    tensor,
    times,
    trace,
)
from prensa.kernels.differentiate import forward, units
from prensa.kernels.emit import Kind, Marks, Program, Rows, Shared, puts
from prensa.kernels.functions import half_log1p
from prensa.kernels.machine_code import generated
from prensa.kernels.record import Node, as_found, given, many, sqrt
from prensa.types import Array, Flags


class Answer(NamedTuple):
    """Stress P, the new history, and whether the law has a meaning there: None if everywhere."""

    P: Tensor
    history: Tensor
    good: Node | None = None


PointLaw = Callable[[Tensor, Tensor, Node, Node], Answer]
"""Of h, the committed history, λ and μ."""


def hooke(h: Tensor, old: Tensor, lam: Node, mu: Node) -> Answer:
    """σ = λ tr ε I + 2 μ ε; history: the strain."""
    H, e_n = tensor(h), symmetric(old)
    e = tuple(e_n[3 * i + j] + 0.5 * (H[3 * i + j] + H[3 * j + i]) for i in SPACE_AXES for j in SPACE_AXES)
    sigma = plus(times(lam * trace(e), UNIT), times(2.0 * mu, e))  # type: ignore[arg-type]
    return Answer(components(sigma, h), kept(e, old))


class Motion(NamedTuple):
    """Of a point in finite strain: h, b_n − I, b − I, det f − 1, det b_n − 1, and whether f and b_n are motions."""

    h: Tensor
    was: Tensor
    b: Tensor
    volume: Node
    before: Node
    good: Node


def motion(h: Tensor, old: Tensor) -> Motion:
    """Of an increment on a committed tensor."""
    H, was = tensor(h), symmetric(old)
    volume, before = det_less_one(H), det_less_one(was)
    # det f > 0 alone would let f₃₃ < 0 pass with a plane that is turned inside out.
    good = (volume > -1.0) & (before > -1.0)
    return Motion(H, was, push_forward(H, was), volume, before, good if len(h) == 9 else good & (h[4] > -1.0))


def neo_hooke(h: Tensor, old: Tensor, lam: Node, mu: Node) -> Answer:
    """ψ = μ/2 (I₁ − 3) − μ ln J + λ/2 (ln J)²: P = τ f⁻ᵀ/J_n with τ = μ (b − I) + λ ln J I."""
    m = motion(h, old)
    # J² − 1 without cancellation
    p = lam * half_log1p(m.before + m.volume * (2.0 + m.volume) * (1.0 + m.before))
    f = tuple(x + one for x, one in zip(m.h, UNIT))
    inverse = times(1.0 / (1.0 + m.volume), cofactors(f))
    by = 1.0 / sqrt(1.0 + m.before)
    tau = plus(times(mu, m.b), times(p, UNIT))  # type: ignore[arg-type]
    P = by_transposed(times(by, tau), inverse)
    # the same as μ f b_n + (λ ln J − μ) f⁻ᵀ, which has the shorter derivatives, but cancels where strains are small
    moved, apart = plus(f, product(f, m.was)), p - mu
    other = [by * (mu * moved[3 * i + j] + apart * inverse[3 * j + i]) for i in SPACE_AXES for j in SPACE_AXES]
    return Answer(components([as_found(x, y) for x, y in zip(P, other)], h), kept(m.b, old), m.good)


def st_venant_kirchhoff(h: Tensor, old: Tensor, lam: Node, mu: Node) -> Answer:
    """ψ = λ/2 (tr E)² + μ E : E in Green's strain E: τ = (λ/2 tr(b − I) I + μ (b − I)) b and P = τ f⁻ᵀ/J_n, b f⁻ᵀ = f b_n."""
    m = motion(h, old)
    f = tuple(x + one for x, one in zip(m.h, UNIT))
    second = plus(times(0.5 * lam * trace(m.b), UNIT), times(mu, m.b))  # type: ignore[arg-type]
    P = product(times(1.0 / sqrt(1.0 + m.before), second), plus(f, product(f, m.was)))
    return Answer(components(P, h), kept(m.b, old), m.good)


@generated
def _kernel(law: PointLaw, full: int, tangent: bool) -> Program:
    size = 6 if full == 9 else 4
    h, flag = many("h", full), given("failed", 0)
    found = law(h, many("old", size), given("moduli", 0), given("moduli", 1))
    written = [*puts("P", found.P), *puts("new", found.history)]
    if found.good is not None:
        written += puts("failed", [flag | ~found.good])
    if tangent:
        written += puts("A", [x for row in forward(found.P, units(h), full) for x in row])
    arrays: dict[str, Kind] = {
        "h": Rows(full), "old": Rows(size), "moduli": Shared(), "P": Rows(full), "A": Rows(full**2), "new": Rows(size),
        "failed": Marks(),
    }  # fmt: skip
    return Program(arrays, written)


def update(
    law: PointLaw, h: Array, old: Array, lam: float, mu: float, P: Array, A: Array, new: Array, failed: Flags, tangent: bool
) -> None:  # fmt: skip
    """H (n, c) = f − I, old (n, ≥k) → P (n, c), new (n, ≥k), failed (n,), and if ``tangent`` A (n, c, c) = ∂P/∂f."""
    _kernel(law, h.shape[1], tangent)(len(h), h, old, np.array([lam, mu]), P, A, new, failed)


def quadratic_energy(eps: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """ψ = λ/2 (tr ε)² + μ ε:ε per initial volume; eps (..., 3) principal elastic strains → (...)."""
    a, b, c = eps[..., 0], eps[..., 1], eps[..., 2]
    return np.asarray(0.5 * lam * (a + b + c) ** 2 + mu * (a * a + b * b + c * c))


def neo_hooke_energy(eps: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """ψ of `neo_hooke` per initial volume; eps (..., 3) → (...)."""
    ln_j = eps @ np.ones(3)
    return np.asarray(0.5 * mu * np.expm1(2.0 * eps) @ np.ones(3) - mu * ln_j + 0.5 * lam * ln_j**2)


def hencky_at_rest(b: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """Cauchy stresses (n, 4) xx, yy, zz, xy of Hencky's law for b_e − I (n, 4) as 11, 22, 33, 12."""
    b11, b22, b33, b12 = b.T
    half = 0.5 * (b11 - b22)
    r = np.hypot(half, b12)
    low = 0.5 * (b11 + b22) - r
    # logarithmic strains ½ ln b: that of the lower principal value, what the upper one has more, and that out of the plane
    # The difference of both logarithms as one: where principal values are alike it keeps its digits.
    e, more, e3 = 0.5 * np.log1p(low), 0.5 * np.log1p(2.0 * r / (1.0 + low)), 0.5 * np.log1p(b33)
    trace = 2.0 * e + more + e3
    J = np.exp(trace)
    mean, apart = (lam * trace + mu * (2.0 * e + more)) / J, mu * more / J
    over = np.where(r > 0.0, apart / np.where(r > 0.0, r, 1.0), 0.0)
    return np.stack([mean + over * half, mean - over * half, (lam * trace + 2.0 * mu * e3) / J, over * b12], axis=1)
