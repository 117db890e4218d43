"""A rigid cylinder on an elastic layer: an integral equation with the exact layer kernel, solved spectrally.

The surface of a layer of thickness H under the pressure p(k) cos kx sinks by u(k) cos kx with

    u(k) = 2 L(kH)/(E* k) p(k),

L -> 1 for a deep layer. (The same L serves the axisymmetric problem, with Bessel instead of Fourier transforms.)
On a smooth base L = (cosh 2w - 1)/(sinh 2w + 2w); on a bonded base
L = ((3 - 4 nu) sinh 2w - 2w)/((3 - 4 nu) cosh 2w + 2 w^2 + 5 - 12 nu + 8 nu^2).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ._check import ACCURACY, Array, one_of, plane_strain_modulus, poisson, positive

BASES = ("smooth", "bonded")


def layer_kernel(w: ArrayLike, base: str = "smooth", nu: float = 0.3) -> Array:
    """`w` = kH >= 0: any shape (-) -> same shape (-): surface compliance of a layer relative to a half-space.

    `base` "smooth" (no shear, no lift-off) or "bonded"; nu matters only for "bonded". Written in exp(-2w), so large
    w do not overflow.
    Raises ValueError for an unknown base, nu outside (-1, 0.5], or a negative w.
    Source: Johnson (1985), section 5.8; Bentall & Johnson (1968), Int. J. Mech. Sci. 10; rederived in the tests.
    """
    w, d, q, den = _kernel_parts(w, base, nu)
    num = d * d if base == "smooth" else (3.0 - 4.0 * nu) * d * (1.0 + q) / 2.0 - 2.0 * w * q
    return np.divide(num, den, out=np.zeros_like(w), where=den > 0.0)


def layer_kernel_defect(w: ArrayLike, base: str = "smooth", nu: float = 0.3) -> Array:
    """`w` = kH >= 0: any shape (-) -> same shape (-): 1 - L(w), without cancellation for large w.

    It decays like w exp(-2w) (smooth) or w^2 exp(-2w) (bonded), which is what makes the quadratures spectral.
    Raises ValueError as `layer_kernel` does. Source: the same.
    """
    w, d, q, den = _kernel_parts(w, base, nu)
    if base == "smooth":
        num = 2.0 * q * (d + 2.0 * w)
    else:
        num = q * ((3.0 - 4.0 * nu) * q + 2.0 * w * w + 2.0 * w + 5.0 - 12.0 * nu + 8.0 * nu * nu)
    return np.divide(num, den, out=np.ones_like(w), where=den > 0.0)


def _kernel_parts(w: ArrayLike, base: str, nu: float) -> tuple[Array, Array, Array, Array]:
    """Return w, d = 1 - exp(-2w), q = exp(-2w) and the denominator of L times q (times 2 q for "smooth")."""
    one_of("base", base, BASES)
    poisson(nu)
    w = np.asarray(w, dtype=float)
    if bool(np.any(w < 0.0)):
        raise ValueError(f"w = {w.min()!r}: the wave number times the thickness is not negative; give |k| H")
    q = np.exp(-2.0 * w)
    d = -np.expm1(-2.0 * w)
    if base == "smooth":
        den = d * (1.0 + q) + 4.0 * w * q
    else:
        den = (3.0 - 4.0 * nu) * (1.0 + q * q) / 2.0 + q * (2.0 * w * w + 5.0 - 12.0 * nu + 8.0 * nu * nu)
    return w, d, q, np.asarray(den)


def _panels(ratio: float) -> tuple[Array, Array]:
    """Gauss-Legendre points and weights on equal panels of (0, 40), where kernels have died out, for J_0 or cos of ratio * w."""
    x, w = np.polynomial.legendre.leggauss(16)
    upper = 40.0
    count = max(40, math.ceil(20.0 * ratio))
    width = upper / count
    points = (np.arange(count)[:, None] + 0.5 * (x + 1.0)) * width
    return points.ravel(), np.tile(0.5 * width * w, count)


@dataclass(frozen=True)
class LayerLine:
    """Half-width a, indentation delta (length), force P (force/length), peak pressure p0 (stress), and what made them.

    `coefficients` (n,) (stress): p = sum_j c_j sin((2j + 1) arccos(x/a)).
    """

    a: float
    delta: float
    P: float
    p0: float
    R: float
    H: float
    E_star: float
    base: str
    coefficients: Array = field(repr=False)

    def pressure(self, x: ArrayLike) -> Array:
        """x: any shape (length, from the centre) -> same shape (stress), zero outside |x| < a."""
        s = np.asarray(x, dtype=float) / self.a
        theta = np.arccos(np.clip(s, -1.0, 1.0))
        odd = 2.0 * np.arange(self.coefficients.size) + 1.0
        return np.asarray(np.where(np.abs(s) < 1.0, np.sin(theta[..., None] * odd) @ self.coefficients, 0.0))


def layer_line(
    *,
    R: float,
    H: float,
    E: float,
    nu: float,
    delta: float | None = None,
    a: float | None = None,
    P: float | None = None,
    base: str = "smooth",
    profile: str = "circle",
    n: int = 24,
) -> LayerLine:
    """R, H, delta, a (length), E (stress), P (force/length) -> LayerLine: rigid cylinder on a layer, frictionless.

    Plane strain, infinite width, thickness H, linear elasticity, contact measured on the undeformed surface along its
    own normal (the linear Signorini problem). Give exactly one of delta (indentation of the layer at x = 0), a or P.
    `profile` "circle" is the exact arc R - sqrt(R^2 - x^2), "parabola" x^2/2R; `n` terms of the pressure series: 24
    give round-off for a < H and a < R/2; take more on thin layers or where a nears R.

    With p = sum c_j sqrt(1 - s^2) U_2j(s) the logarithm of the kernel integrates in closed form, the smooth rest by
    Gauss-Chebyshev (in s) and Gauss-Legendre (in k); collocation at n + 1 points gives c and delta for a given a, and
    a root search gives a for a given delta or P.

    Raises ValueError for a non-positive dimension, an unknown base or profile, more or fewer than one of delta, a, P,
    a >= R on a circle, or a load that no contact narrower than the circle carries.
    Source: Gladwell (1980), Contact Problems in the Classical Theory of Elasticity; Johnson (1985), section 5.8.
    """
    positive(R=R, H=H)
    E_star = plane_strain_modulus(E, nu)
    one_of("base", base, BASES)
    one_of("profile", profile, ("circle", "parabola"))
    if n < 2:
        raise ValueError(f"n = {n!r}: number of terms of the pressure series; give n >= 2")
    given = {k: v for k, v in {"delta": delta, "a": a, "P": P}.items() if v is not None}
    if len(given) != 1:
        raise ValueError(f"delta, a, P = {delta!r}, {a!r}, {P!r}: give exactly one of the three")
    positive(**given)

    def solved(half_width: float) -> LayerLine:
        return _solve_for_half_width(half_width, R, H, E_star, nu, base, profile, n)

    if a is not None:
        if profile == "circle" and a >= R:
            raise ValueError(f"a = {a!r}: the contact half-width stays below the radius R = {R!r}; give a < R")
        return solved(a)
    name, target = next(iter(given.items()))
    start = math.sqrt(target * R if name == "delta" else 4.0 * target * R / (math.pi * E_star))  # Hertz, roughly
    return solved(_half_width(lambda value: getattr(solved(value), name) - target, start, R, profile, name, target))


def _half_width(
    misfit: Callable[[float], float], start: float, R: float, profile: str, name: str, target: float
) -> float:
    """Root of the increasing function misfit(a), bracketed by doubling from a guess."""
    from scipy.optimize import brentq

    limit = R * (1.0 - ACCURACY) if profile == "circle" else math.inf
    low = high = min(start, 0.5 * limit)
    while misfit(low) > 0.0:
        low /= 2.0
    while misfit(high) < 0.0:
        if high >= limit:
            raise ValueError(f"{name} = {target!r}: the circle is pressed in beyond its radius R = {R!r}; lower {name}")
        high = min(1.5 * high, limit)
    return float(low if low == high else brentq(misfit, low, high, xtol=np.finfo(float).eps * high))


def _solve_for_half_width(
    a: float, R: float, H: float, E_star: float, nu: float, base: str, profile: str, n: int
) -> LayerLine:
    """Collocate u(x) + f(x) = delta at n + 1 points for the n pressure coefficients and delta; see `layer_line`."""
    ratio = a / H
    x = np.cos(np.pi * (2.0 * np.arange(1, n + 2) - 1.0) / (4.0 * (n + 1)))  # (n+1,)
    m = 4 * n + 16
    theta = np.pi * np.arange(1, m + 1) / (m + 1)
    s = np.cos(theta)
    order = 2.0 * np.arange(n)  # degrees of U
    weighted = np.sin(np.outer(theta, order + 1.0)) * (np.pi / (m + 1) * np.sin(theta))[:, None]  # (m, n)

    # -ln|x - s| against sqrt(1 - s^2) U_k = (T_k - T_k+2) / (2 sqrt(1 - s^2)); Gladwell (1980), Chebyshev pairs.
    phi = np.arccos(x)[:, None]
    first = np.where(order == 0.0, math.log(2.0), np.cos(phi * order) / np.where(order == 0.0, 1.0, order))
    logarithm = 0.5 * np.pi * (first - np.cos(phi * (order + 2.0)) / (order + 2.0))
    logarithm[:, 0] -= 0.5 * np.pi * math.log(ratio)

    # Rest of the kernel: int_0^inf (1 - e^-w) cos(wt)/w dw = -ln t + ln(1 + t^2)/2, and (L - 1 + e^-w) by quadrature.
    near = 0.5 * np.log1p((ratio * (x[:, None] - s)) ** 2) @ weighted
    w, weight = _panels(ratio)
    density = weight * (np.exp(-w) - layer_kernel_defect(w, base, nu)) / w
    far = (np.cos(np.outer(ratio * x, w)) * density) @ (np.cos(np.outer(w, ratio * s)) @ weighted)

    shape = a * x * (a * x) / (2.0 * R) if profile == "parabola" else (a * x) ** 2 / (R + np.sqrt(R * R - (a * x) ** 2))
    # Unknown c scaled by E* a/R and delta by a^2/R, so that the system is dimensionless.
    scale = a * a / R
    matrix = np.hstack([2.0 / np.pi * (logarithm + near + far), -np.ones((n + 1, 1))])
    solution = np.linalg.solve(matrix, -shape / scale)
    c = solution[:n] * E_star * a / R
    return LayerLine(
        a=a,
        delta=float(solution[n]) * scale,
        P=0.5 * math.pi * a * float(c[0]),
        p0=float(np.sum(c * (-1.0) ** np.arange(n))),
        R=R,
        H=H,
        E_star=E_star,
        base=base,
        coefficients=c,
    )
