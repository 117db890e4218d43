"""Buckling of columns: the elastica."""

from __future__ import annotations

import math

from ._check import positive


def euler_clamped(*, E: float, length: float, thickness: float) -> float:
    """E (stress), length, thickness (length) -> force per unit width: P = 4 pi^2 E I / length^2 of a column clamped at both ends.

    E is the modulus along the column, E/(1 - nu^2) in plane strain; I = thickness^3/12. Both ends may move along the column.
    Raises ValueError for values not above 0. Source: Timoshenko & Gere (1961), Theory of Elastic Stability, 2.2.
    """
    positive(E=E, length=length, thickness=thickness)
    return 4.0 * math.pi**2 * E * thickness**3 / 12.0 / length**2


def elastica_clamped(shortening: float, *, E: float, length: float, thickness: float) -> float:
    """Shortening (length), 0 < shortening < length -> force per unit width of a buckled column clamped at both ends.

    With the modulus k of the elliptic integrals P = Pcr (2 K/pi)^2, and the ends approach by length (2 - 2 E/K) by bending,
    by P length/(E thickness) by compression, which the elastica leaves out and which is added here. Below the buckling load
    it is the compression alone. Raises ValueError for a shortening outside these bounds or values not above 0.
    Source: Timoshenko & Gere (1961), Theory of Elastic Stability, 2.7.
    """
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    critical = euler_clamped(E=E, length=length, thickness=thickness)
    positive(shortening=shortening)
    if shortening >= length:
        raise ValueError(f"shortening must be below the length {length:g}, got {shortening:g}")
    axial = E * thickness / length
    if shortening * axial <= critical:
        return shortening * axial

    def excess(m: float) -> float:
        force = critical * (2.0 * ellipk(m) / math.pi) ** 2
        return float(length * (2.0 - 2.0 * ellipe(m) / ellipk(m)) + force / axial - shortening)

    m = brentq(excess, 0.0, math.nextafter(1.0, 0.0))
    return float(critical * (2.0 * ellipk(m) / math.pi) ** 2)
