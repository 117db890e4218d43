"""Hertz contact of a rigid parabola, line and point, with an elastic half-space."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ._check import Array, plane_strain_modulus, positive


@dataclass(frozen=True)
class HertzLine:
    """Line contact: half-width a (length), force P (force/length), peak pressure p0 (stress), radius R, modulus E_star.

    There is no indentation here: a half-plane has no P(delta), its surface sinks without bound.
    """

    a: float
    P: float
    p0: float
    R: float
    E_star: float

    def pressure(self, x: ArrayLike) -> Array:
        """x: any shape (length) -> same shape (stress); p0 sqrt(1 - x^2/a^2) within |x| < a, zero outside."""
        return _semi_elliptic(np.asarray(x, dtype=float) / self.a, self.p0)


@dataclass(frozen=True)
class HertzSphere:
    """Point contact: radius a, indentation delta, tool radius R (length), force P, pressure p0, E_star (stress)."""

    a: float
    delta: float
    P: float
    p0: float
    R: float
    E_star: float

    def pressure(self, r: ArrayLike) -> Array:
        """r: any shape (length) -> same shape (stress); p0 sqrt(1 - r^2/a^2) within r < a, zero outside."""
        return _semi_elliptic(np.asarray(r, dtype=float) / self.a, self.p0)


def _semi_elliptic(s: Array, p0: float) -> Array:
    """Pressure at distances s over the half-width: an ellipse with its peak p0 in the middle, zero outside."""
    return np.asarray(p0 * np.sqrt(np.clip(1.0 - s * s, 0.0, None)))


def hertz_line(P: float, R: float, E: float, nu: float) -> HertzLine:
    """P (force/length), R (length), E (stress), nu (-) -> HertzLine: rigid cylinder on a half-plane, plane strain.

    a = sqrt(4 P R / (pi E*)), p0 = 2 P/(pi a), with E* = E/(1 - nu^2).
    Raises ValueError for P, R or E not above 0, nu outside (-1, 0.5].
    Source: Johnson (1985), Contact Mechanics, eqs. 4.43 and 4.45.
    """
    positive(P=P, R=R)
    E_star = plane_strain_modulus(E, nu)
    a = math.sqrt(4.0 * P * R / (math.pi * E_star))
    return HertzLine(a=a, P=P, p0=2.0 * P / (math.pi * a), R=R, E_star=E_star)


def hertz_line_from_a(a: float, R: float, E: float, nu: float) -> HertzLine:
    """`a` (length), R (length), E (stress), nu (-) -> HertzLine: the inverse of `hertz_line`.

    P = pi E* a^2/(4 R), p0 = E* a/(2 R).
    Raises ValueError for a, R or E not above 0, nu outside (-1, 0.5].
    Source: Johnson (1985), eqs. 4.43 and 4.45.
    """
    positive(a=a, R=R)
    E_star = plane_strain_modulus(E, nu)
    return HertzLine(a=a, P=math.pi * E_star * a * a / (4.0 * R), p0=E_star * a / (2.0 * R), R=R, E_star=E_star)


def hertz_sphere(P: float, R: float, E: float, nu: float) -> HertzSphere:
    """P (force), R (length), E (stress), nu (-) -> HertzSphere: rigid sphere on a half-space.

    a = (3 P R/(4 E*))^(1/3), delta = a^2/R, p0 = 3 P/(2 pi a^2).
    Raises ValueError for P, R or E not above 0, nu outside (-1, 0.5].
    Source: Johnson (1985), eqs. 4.22 to 4.24.
    """
    positive(P=P, R=R)
    E_star = plane_strain_modulus(E, nu)
    return hertz_sphere_from_a((3.0 * P * R / (4.0 * E_star)) ** (1.0 / 3.0), R, E, nu)


def hertz_sphere_from_a(a: float, R: float, E: float, nu: float) -> HertzSphere:
    """`a` (length), R (length), E (stress), nu (-) -> HertzSphere: from the contact radius.

    P = 4 E* a^3/(3 R), delta = a^2/R, p0 = 2 E* a/(pi R).
    Raises ValueError for a, R or E not above 0, nu outside (-1, 0.5].
    Source: Johnson (1985), eqs. 4.22 to 4.24.
    """
    positive(a=a, R=R)
    E_star = plane_strain_modulus(E, nu)
    return HertzSphere(
        a=a,
        delta=a * a / R,
        P=4.0 * E_star * a**3 / (3.0 * R),
        p0=2.0 * E_star * a / (math.pi * R),
        R=R,
        E_star=E_star,
    )


def hertz_sphere_from_delta(delta: float, R: float, E: float, nu: float) -> HertzSphere:
    """`delta` (length), R (length), E (stress), nu (-) -> HertzSphere: from the indentation, a = sqrt(R delta).

    Raises ValueError for delta, R or E not above 0, nu outside (-1, 0.5].
    Source: Johnson (1985), eq. 4.23.
    """
    positive(delta=delta, R=R)
    return hertz_sphere_from_a(math.sqrt(R * delta), R, E, nu)
