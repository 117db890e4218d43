"""Bending of a wide or narrow strip by pure moment, small strain, and its elastic release (springback).

Everything is per unit width. In "plane strain" the elastic modulus along the strip is E/(1 - nu^2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ._check import ACCURACY, Array, one_of, plane_strain_modulus, poisson, positive
from .upsetting import Flow, _check_material, _plane_strain_path, _uniaxial_elastic

PLANE_SPACES = ("plane strain", "plane stress")


@dataclass(frozen=True)
class Bending:
    """Arrays of one shape: curvature (1/length), moment (force) per unit width, released_curvature (1/length)."""

    curvature: Array
    moment: Array
    released_curvature: Array

    @property
    def radius_ratio(self) -> Array:
        """R_f/R_0 (-): radius after release over radius before it (infinite where the strip springs back flat)."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.curvature / self.released_curvature)


def bend_strip(
    curvature: ArrayLike, *, thickness: float, flow: Flow, E: float, nu: float, space: str = "plane strain"
) -> Bending:
    """curvature: any shape (1/length), > 0; thickness (length), flow (-) -> (stress), E (stress) -> Bending: exact J2.

    Each fibre at height y carries strain curvature * y under plane strain (held across the strip) or uniaxial stress,
    J2 flow, small strain, no stress through the thickness; M = (2/curvature^2) int sigma(eps) eps d eps over half the
    thickness, elastic core in closed form, the rest by Gauss-Legendre on graded panels. Release is elastic:
    d(curvature) = 12 M/(E' t^3). This is what a finite-element strip must converge to; the textbook forms below
    replace the drift of the out-of-plane stress by its limit.

    Raises ValueError for a curvature or thickness not above 0, E <= 0, nu outside (-1, 0.5], an unknown space, or a
    flow curve not positive at zero strain.
    Source: Hill (1950), ch. 4 (bending); Hosford & Caddell (1993), Metal Forming (release).
    """
    value, modulus = _checked(curvature, thickness, E, nu, space)
    _check_material(flow, E, nu, "kirchhoff")
    edge = 0.5 * thickness * value  # outer strain
    ratio = nu if space == "plane strain" else 0.0
    first = float(flow(0.0)) / math.sqrt(1.0 - ratio + ratio * ratio) / modulus  # strain at first yield
    z, w = np.polynomial.legendre.leggauss(12)
    moment = np.empty_like(edge)
    for i, outer in enumerate(edge.flat):
        core = min(float(outer), first)
        integral = modulus * core**3 / 3.0
        if outer > first:
            grades = first + (outer - first) * np.concatenate([[0.0], 2.0 ** np.arange(-24.0, 1.0)])
            half = 0.5 * np.diff(grades)[:, None]
            strain = (grades[:-1, None] + half * (z + 1.0)).ravel()
            integral += float(np.sum((half * w).ravel() * strain * _stress(strain, flow, E, nu, space)))
        moment.flat[i] = 2.0 * integral / value.flat[i] ** 2
    return _released(value, moment, modulus, thickness)


def _stress(strain: Array, flow: Flow, E: float, nu: float, space: str) -> Array:
    """(n,) -> (n,): stress along the strip at these strains, loaded proportionally in small strain."""
    if space == "plane strain":
        return np.asarray(-_plane_strain_path(strain, flow, E, nu, "kirchhoff")[0])
    return E * _uniaxial_elastic(strain, flow, E, nu, "kirchhoff")


def bend_strip_perfect(
    curvature: ArrayLike, *, thickness: float, sigma_y: float, E: float, nu: float, space: str = "plane strain"
) -> Bending:
    """curvature: any shape (1/length), > 0; thickness (length), sigma_y, E (stress) -> Bending: textbook, no hardening.

    M/M_y = 3/2 - (c_y/c)^2/2 beyond c_y = 2 Y'/(E' t), M_y = Y' t^2/6; R_0/R_f = 4 z^3 - 3 z + 1 with
    z = Y' R_0/(E' t). In plane strain Y' = 2 sigma_y/sqrt 3, E' = E/(1 - nu^2): exact for nu = 1/2, otherwise first
    yield comes earlier (see `bend_strip`).
    Raises ValueError for a curvature, thickness, sigma_y or E not above 0, nu outside (-1, 0.5], an unknown space.
    Source: Gardiner (1957), Trans. ASME 79; Hosford & Caddell (1993), Metal Forming.
    """
    value, modulus = _checked(curvature, thickness, E, nu, space)
    positive(sigma_y=sigma_y)
    limit = sigma_y * (2.0 / math.sqrt(3.0) if space == "plane strain" else 1.0)
    at_yield = 2.0 * limit / (modulus * thickness)
    x = value / at_yield
    moment = limit * thickness**2 / 6.0 * np.where(x <= 1.0, x, 1.5 - 0.5 / np.maximum(x, 1.0) ** 2)
    return _released(value, moment, modulus, thickness)


def bend_strip_power(
    curvature: ArrayLike, *, thickness: float, K: float, n: float, E: float, nu: float, space: str = "plane strain"
) -> Bending:
    """curvature: any shape (1/length), > 0; thickness (length), K, E (stress), n (-) -> Bending: sigma = K' eps^n.

    Elastic below the strain where E' eps meets K' eps^n, eps_y = (K'/E')^(1/(1 - n)); with y_e = min(eps_y/c, t/2)
    M = 2 [E' c y_e^3/3 + K' c^n ((t/2)^(n+2) - y_e^(n+2))/(n + 2)]. In plane strain K' = (2/sqrt 3)^(n+1) K. Here eps
    is the total strain, as in deformation theory.
    Raises ValueError for a curvature, thickness, K or E not above 0, n outside (0, 1), nu outside (-1, 0.5], an
    unknown space, or K' >= E' (no elastic range below eps = 1).
    Source: Hosford & Caddell (1993), Metal Forming; Marciniak, Duncan & Hu (2002), Mechanics of Sheet Metal Forming.
    """
    value, modulus = _checked(curvature, thickness, E, nu, space)
    positive(K=K)
    if not 0.0 < n < 1.0:
        raise ValueError(f"n = {n!r}: hardening exponent in (0, 1); for n = 0 use bend_strip_perfect")
    strength = K * ((2.0 / math.sqrt(3.0)) ** (n + 1.0) if space == "plane strain" else 1.0)
    if strength >= modulus:
        raise ValueError(f"K = {K!r}: gives K' = {strength!r} not below E' = {modulus!r}; lower K")
    half = 0.5 * thickness
    core = np.minimum((strength / modulus) ** (1.0 / (1.0 - n)) / value, half)
    plastic = strength * value**n * (half ** (n + 2.0) - core ** (n + 2.0)) / (n + 2.0)
    return _released(value, 2.0 * (modulus * value * core**3 / 3.0 + plastic), modulus, thickness)


def _checked(curvature: ArrayLike, thickness: float, E: float, nu: float, space: str) -> tuple[Array, float]:
    """Return the curvature as an array and the modulus along the strip."""
    value = np.asarray(curvature, dtype=float)
    if not bool(np.all(value > 0.0)):
        raise ValueError(f"curvature = {curvature!r}: 1/radius, must be above 0; give its absolute value")
    positive(thickness=thickness, E=E)
    poisson(nu)
    one_of("space", space, PLANE_SPACES)
    return value, plane_strain_modulus(E, nu) if space == "plane strain" else E


def _released(curvature: Array, moment: Array, modulus: float, thickness: float) -> Bending:
    """Take the moment off elastically; round-off below zero counts as flat."""
    left = np.maximum(curvature - 12.0 * moment / (modulus * thickness**3), 0.0)
    return Bending(curvature, np.asarray(moment), np.where(left < ACCURACY * curvature, 0.0, left))
