"""A rigid flat ring pressed without friction into a half-space or a layer (axisymmetric)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ._check import Array, one_of, plane_strain_modulus, positive
from .layer import BASES, _panels, layer_kernel_defect


@dataclass(frozen=True)
class RingStamp:
    """Flat ring from radius `inner` to `outer` (length): stiffness P/delta (force/length), E_star, pressure(r).

    `coefficients` (n,) (stress/length): p/delta = sum_j b_j T_j(s)/sqrt(1 - s^2), s from -1 to 1 across the ring.
    """

    inner: float
    outer: float
    stiffness: float
    E_star: float
    coefficients: Array = field(repr=False)

    def pressure(self, r: ArrayLike, delta: float = 1.0) -> Array:
        """r: any shape (length), delta (length) -> same shape (stress); zero off the ring, infinite on its edges."""
        s = (2.0 * np.asarray(r, dtype=float) - self.inner - self.outer) / (self.outer - self.inner)
        inside = np.abs(s) <= 1.0
        series = np.polynomial.chebyshev.chebval(np.clip(s, -1.0, 1.0), self.coefficients)
        with np.errstate(divide="ignore"):
            value = delta * series / np.sqrt(np.clip(1.0 - s * s, 0.0, None))
        return np.asarray(np.where(inside, value, 0.0))

    @property
    def mean_pressure(self) -> float:
        """Mean pressure per unit indentation (stress/length): P/(delta pi (outer^2 - inner^2))."""
        return self.stiffness / (math.pi * (self.outer**2 - self.inner**2))


def flat_punch_stiffness(R: float, E: float, nu: float) -> float:
    """R (length), E (stress), nu (-) -> P/delta (force/length) = 2 E* R of a flat circular punch on a half-space.

    Raises ValueError for R or E not above 0, nu outside (-1, 0.5].
    Source: Boussinesq; Johnson (1985), ch. 3.
    """
    positive(R=R)
    return 2.0 * plane_strain_modulus(E, nu) * R


def ring_stamp(
    *, inner: float, outer: float, E: float, nu: float, H: float | None = None, base: str = "smooth", n: int = 48
) -> RingStamp:
    """inner, outer, H (length), E (stress), nu (-) -> RingStamp: frictionless rigid flat ring, H None for a half-space.

    With H the body is an infinite layer of that thickness on a "smooth" (no shear, no lift-off) or "bonded" base.
    Nystroem's method at n Gauss-Chebyshev points with both edge singularities taken out: the ring kernel
    4 K(m)/(pi E* (r + s)) is split as K(m) = -K(m1)/pi (ln m1 + analytic), m1 = ((r - s)/(r + s))^2, the logarithm is
    integrated exactly, and the layer adds -2/E* int (1 - L(kH)) J0(kr) J0(ks) dk. Convergence is geometric; a narrow
    hole (inner/outer below 0.1) wants a larger n.

    Raises ValueError for inner or outer not above 0, inner >= outer, H <= 0, an unknown base or n < 4.
    Source: Gladwell (1980); Shibuya, Koizumi & Nakahara (1974), Int. J. Eng. Sci. 12; for the elliptic split,
    Abramowitz & Stegun 17.3.17 and 17.3.21.
    """
    positive(inner=inner, outer=outer)
    if inner >= outer:
        raise ValueError(f"inner = {inner!r}: not below outer = {outer!r}; give inner < outer")
    if n < 4:
        raise ValueError(f"n = {n!r}: number of points across the ring; give n >= 4")
    one_of("base", base, BASES)
    E_star = plane_strain_modulus(E, nu)
    half = 0.5 * (outer - inner)
    theta = np.pi * (np.arange(n) + 0.5) / n
    x = np.cos(theta)
    r = 0.5 * (outer + inner) + half * x
    compliance = _half_space(r, x, theta, half)
    if H is not None:
        positive(H=H)
        compliance = compliance - 2.0 * np.pi / n * half * _layer_defect(r, H, base, nu) * r
    phi = np.linalg.solve(compliance / E_star, np.ones(n))
    modes = np.cos(np.outer(np.arange(n), theta))
    coefficients = modes @ phi * (2.0 / n)
    coefficients[0] *= 0.5
    stiffness = 2.0 * np.pi * half * np.pi / n * float(phi @ r)
    return RingStamp(inner=inner, outer=outer, stiffness=stiffness, E_star=E_star, coefficients=coefficients)


def _half_space(r: Array, x: Array, theta: Array, half: float) -> Array:
    """(n,), (n,), (n,) -> (n, n): E* u(r_i) from phi(r_j), where p = phi/sqrt(1 - s^2)."""
    from scipy.special import ellipk, ellipkm1

    n = x.size
    total = r[:, None] + r
    m1 = ((r[:, None] - r) / total) ** 2
    off = ~np.eye(n, dtype=bool)
    k1 = ellipk(m1)
    rest = np.full((n, n), -math.log(16.0))  # ln of the nome of m1, less ln m1: its limit on the diagonal
    rest[off] = -np.pi * ellipkm1(m1[off]) / k1[off] - np.log(m1[off])
    order = np.arange(1, n)
    modes = np.cos(np.outer(theta, order))
    logarithm = np.pi / n * (-math.log(2.0) - 2.0 * (modes / order) @ modes.T)  # int ln|x_i - s| l_j(s)/sqrt(1 - s^2)
    bracket = 2.0 * logarithm + np.pi / n * (rest - 2.0 * np.log(total / half))
    return np.asarray(-4.0 * half / np.pi**2 * r / total * k1 * bracket)


def _layer_defect(r: Array, H: float, base: str, nu: float) -> Array:
    """(n,) -> (n, n): int_0^inf (1 - L(kH)) J0(k r_i) J0(k r_j) dk (1/length)."""
    from scipy.special import j0

    w, weight = _panels(float(r.max()) / H)
    bessel = j0(np.outer(r / H, w))
    return np.asarray((bessel * (weight * layer_kernel_defect(w, base, nu) / H)) @ bessel.T)
