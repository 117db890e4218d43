"""Isotropic functions of symmetric tensors in space as point functions, without principal axes.

A function of a tensor is a polynomial in it whose coefficients depend on its invariants alone (Cayley and Hamilton). These are
sums here, analytic in the components: nothing is divided by differences of eigenvalues, so that all derivatives, second ones
too, are there where eigenvalues coincide. Tensors have the components 11, 22, 33, 12, 13, 23, b less one.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from math import factorial

import numpy as np

from prensa.kernels.algebra import SPACE_AXES, Tensor, det_less_one, invariants, kept, product, symmetric, total, trace
from prensa.kernels.functions import expm1, half_log1p
from prensa.kernels.record import Node, absolute, local, one_like, where
from prensa.precision import NEGLIGIBLE

TENSOR_TERMS = 40
"""Places of Gauss's rule for logarithms, terms of the series: right to the last digit up to stretches of 4.5, and to ten digits
up to 7. With 10 terms, enough for elastic strains of metals, a point of Hill's law takes 450 ns for 530.
"""


def _means(first: Node, second: Node, third: Node) -> list[Node]:
    """∫₀¹ tᵖ/det (I + t y) dt for p = 0, 1, 2, of the invariants of y."""
    x, w = np.polynomial.legendre.leggauss(TENSOR_TERMS)
    places = [(float(t), float(a)) for t, a in zip(0.5 * (x + 1.0), 0.5 * w)]
    shares = [a / (1.0 + t * (first + t * (second + t * third))) for t, a in places]
    return [total(t**p * share for (t, _), share in zip(places, shares)) for p in SPACE_AXES]


def logarithm(b: Sequence[Node]) -> tuple[Node, ...]:
    """½ ln b: with b = e^(2m) (I + y), det (I + y) = 1, it is m + ½ ∫₀¹ y (I + t y)⁻¹ dt, the inverse by its adjoint."""
    full = symmetric(b)
    middle = half_log1p(det_less_one(full)) / 3.0
    grown = expm1(2.0 * middle)
    y = tuple((x - grown * one) / (1.0 + grown) for x, one in zip(full, _unit(full)))
    first, second, third = invariants(y)
    q, yy = local(_means(first, second, third), (first, second, third)), product(y, y)
    out = [
        0.5 * (q[0] * a + q[1] * (first * a - aa) + q[2] * third * one) + middle * one
        for a, aa, one in zip(y, yy, _unit(full))
    ]
    return kept(out, b)


def _series(second: Node, third: Node) -> list[Node]:
    """Coefficients of I, A and A² in e^A − I, of a deviator A with A³ = second A + third I."""
    # e^A − I = A (1 + A/2 (1 + A/3 (…))), from inside
    unit, once, twice = one_like(second), 0.0 * second, 0.0 * second
    for n in range(TENSOR_TERMS, 1, -1):
        unit, once, twice = 1.0 + third * twice / n, (unit + second * twice) / n, once / n
    return [third * twice, unit + second * twice, once]


def exponential(e: Sequence[Node]) -> tuple[Node, ...]:
    """Exp 2e − I."""
    full = symmetric(e)
    middle = trace(full) / 3.0
    A = tuple(2.0 * (x - middle * one) for x, one in zip(full, _unit(full)))
    second, third = 0.5 * total(x * x for x in A), invariants(A)[2]
    p = local(_series(second, third), (second, third))
    grown = expm1(2.0 * middle)
    AA = product(A, A)
    out = [(p[0] * one + p[1] * a + p[2] * aa) * (1.0 + grown) + grown * one for a, aa, one in zip(A, AA, _unit(full))]
    return kept(out, e)


@cache
def _over_sinh() -> list[float]:
    """Coefficients of δ/sinh δ in powers of δ²."""
    c = [Fraction(1)]
    for n in range(1, TENSOR_TERMS):
        c.append(-sum((c[n - k] * Fraction(1, factorial(2 * k + 1)) for k in range(1, n + 1)), Fraction(0)))
    return [float(x) for x in c]


def _of_commutators(s1: Node, s2: Node, s3: Node) -> list[Node]:
    """Coefficients of Z, Z² and Z³ in the series of δ/sinh δ in Z, see `conjugate`; Z⁴ = s₁ Z³ − s₂ Z² + s₃ Z."""
    one, two, three = 0.0 * s1, 0.0 * s1, 0.0 * s1
    for c in reversed(_over_sinh()[1:]):
        one, two, three = c + three * s3, one - three * s2, two + three * s1
    return [one, two, three]


def conjugate(stress: Sequence[Node], strain: Sequence[Node]) -> tuple[Node, ...]:
    """Rₑᵀ τ Rₑ of a stress whose power is of the logarithmic strain ½ ln Cₑ (Hoger 1987).

    Components along the principal axes of the strain become δ/sinh δ of themselves, δ the difference of the principal strains:
    a series in Z = [e, [e, ·]], whose eigenvalues are the δ². It converges for δ < π, and is right to the last
    digit up to 2; from 2.4 on there is no answer, which is NaN.
    """
    e, T = symmetric(strain), symmetric(stress)
    middle = trace(e) / 3.0
    d = tuple(x - middle * one for x, one in zip(e, _unit(e)))
    second, third = 0.5 * total(x * x for x in d), invariants(d)[2]
    s1, s2, s3 = 6.0 * second, 9.0 * second * second, 4.0 * second * second * second - 27.0 * third * third
    out = list(T)
    for by in local(_of_commutators(s1, s2, s3), (s1, s2, s3)):
        T = _commutator(d, _commutator(d, T))
        out = [x + by * y for x, y in zip(out, T)]
    # NaN where the series has not come to its end
    last = _over_sinh()[-1] * (4.0 * second) ** (TENSOR_TERMS - 1)
    known = where(absolute(last) > NEGLIGIBLE, np.nan, 1.0)
    return kept([known * x for x in out], stress)


def _commutator(a: Tensor, b: Tensor) -> Tensor:
    """A b − b a."""
    return tuple(x - y for x, y in zip(product(a, b), product(b, a)))


def _unit(like: Tensor) -> Tensor:
    """The unit tensor."""
    return tuple(one_like(like[0]) if k % 4 == 0 else 0.0 for k in range(9))  # type: ignore[misc]
