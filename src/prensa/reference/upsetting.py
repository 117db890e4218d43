"""Homogeneous upsetting between frictionless dies, elasticity included: cylinder, ring, plane strain; and necking."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._check import ACCURACY, Array, one_of, poisson, positive, reductions

Flow = Callable[[float], float]
"""Flow curve: equivalent plastic strain (-) -> yield stress (stress)."""

YIELD_ON = ("cauchy", "kirchhoff")


@dataclass(frozen=True)
class Upsetting:
    """State at each height reduction, all arrays of the shape of `reduction`: force, size, stress and plastic strain.

    force: compressive, positive (force; force/thickness in plane problems); lateral_stretch (-): factor on every
    lateral length (radius, width); size (length): radius or width now; stress: compressive Cauchy stress (stress);
    plastic_strain: equivalent (-); J (-): volume ratio.
    """

    reduction: Array
    force: Array
    size: Array
    lateral_stretch: Array
    stress: Array
    plastic_strain: Array
    J: Array


def uniaxial_compression(
    reduction: ArrayLike, *, flow: Flow, E: float, nu: float, yield_on: str = "cauchy"
) -> tuple[Array, Array, Array, Array]:
    """reduction: any shape (-); flow (-) -> (stress) -> stress, lateral stretch, plastic strain, J, each that shape.

    J2 flow with Hencky elasticity (Kirchhoff stress linear in logarithmic strain), free lateral sides. With e the
    elastic and kappa the plastic part of ln(h0/h): tau = E e, J = exp(-(1 - 2 nu) e), tau/J = flow(kappa) (yield on
    the Cauchy stress) or tau = flow(kappa), lateral stretch exp(nu e + kappa/2). One scalar root per reduction; the
    answer does not depend on the path. The stress is Cauchy's, positive in compression. The state of plane stress is
    the same, since its free faces leave the stress uniaxial.

    Raises ValueError for reductions outside [0, 1), E <= 0, nu outside (-1, 0.5], an unknown `yield_on`, or a flow
    curve that is not positive at zero strain.
    Source: Simo (1992), Comput. Methods Appl. Mech. Eng. 99; de Souza Neto, Peric & Owen (2008), ch. 14.
    """
    values = reductions(reduction)
    _check_material(flow, E, nu, yield_on)
    total = -np.log1p(-values)
    e = _uniaxial_elastic(total.ravel(), flow, E, nu, yield_on).reshape(total.shape)
    J = np.exp(-(1.0 - 2.0 * nu) * e)
    kappa = total - e
    return E * e / J, np.exp(nu * e + 0.5 * kappa), kappa, J


def _uniaxial_elastic(total: Array, flow: Flow, E: float, nu: float, yield_on: str) -> Array:
    """(n,) -> (n,): elastic part of each total compressive strain."""
    from scipy.optimize import brentq

    def elastic(strain: float) -> float:
        def overstress(e: float) -> float:
            J = math.exp(-(1.0 - 2.0 * nu) * e) if yield_on == "cauchy" else 1.0
            return E * e - J * float(flow(max(strain - e, 0.0)))

        if overstress(strain) <= 0.0:
            return strain
        return float(brentq(overstress, 0.0, strain, xtol=np.finfo(float).eps * strain))

    return np.array([elastic(float(strain)) for strain in total])


def _check_material(flow: Flow, E: float, nu: float, yield_on: str) -> None:
    """Raise ValueError for constants out of range, an unknown yield_on or a flow curve not positive at zero."""
    positive(E=E)
    poisson(nu)
    one_of("yield_on", yield_on, YIELD_ON)
    if not float(flow(0.0)) > 0.0:
        raise ValueError(f"flow(0) = {flow(0.0)!r}: the yield stress must be above 0; add an initial yield stress")


def upset_cylinder(
    reduction: ArrayLike, *, R: float, flow: Flow, E: float, nu: float, yield_on: str = "cauchy"
) -> Upsetting:
    """reduction: any shape (-), R (length, initial radius), E (stress) -> Upsetting: frictionless, exact.

    force = stress pi R^2 (lateral stretch)^2; the height does not matter.
    Raises ValueError for R <= 0 and as `uniaxial_compression` does.
    Source: `uniaxial_compression`.
    """
    positive(R=R)
    stress, stretch, kappa, J = uniaxial_compression(reduction, flow=flow, E=E, nu=nu, yield_on=yield_on)
    force = stress * math.pi * (R * stretch) ** 2
    return Upsetting(reductions(reduction), force, R * stretch, stretch, stress, kappa, J)


def upset_plane_stress(
    reduction: ArrayLike, *, width: float, flow: Flow, E: float, nu: float, yield_on: str = "cauchy"
) -> Upsetting:
    """reduction: any shape (-), width (length), E (stress) -> Upsetting per unit initial thickness: uniaxial.

    Plane stress with free sides is uniaxial: width and thickness grow alike, force/thickness =
    stress width (lateral stretch)^2.
    Raises ValueError for width <= 0 and as `uniaxial_compression` does.
    Source: `uniaxial_compression`.
    """
    positive(width=width)
    stress, stretch, kappa, J = uniaxial_compression(reduction, flow=flow, E=E, nu=nu, yield_on=yield_on)
    return Upsetting(reductions(reduction), stress * width * stretch**2, width * stretch, stretch, stress, kappa, J)


def upset_plane_strain(
    reduction: ArrayLike, *, width: float, flow: Flow, E: float, nu: float, yield_on: str = "cauchy"
) -> Upsetting:
    """reduction: any shape (-), width (length), E (stress) -> Upsetting per unit thickness: plane strain, frictionless.

    Axes stay fixed, so logarithmic strains add: y compressed, x free (tau_x = 0), z held (total strain zero). The
    out-of-plane stress drifts from nu tau_y to tau_y/2, hence a path: with the equivalent plastic strain kappa as
    clock, d(elastic e_z)/d kappa = -n_z and d(plastic e_y)/d kappa = n_y with n = (3/2) dev(tau)/q, while e_y follows
    from q = J flow(kappa) (Cauchy) or q = flow(kappa) (Kirchhoff). No slope of the flow curve is needed. Integrated
    by an implicit Runge-Kutta method to 1e-10.

    Raises ValueError for width <= 0 and as `uniaxial_compression` does.
    Source: Simo (1992); Hill (1950), The Mathematical Theory of Plasticity, ch. 4 (plastic-elastic plane strain).
    """
    positive(width=width)
    values = reductions(reduction)
    _check_material(flow, E, nu, yield_on)
    total = -np.log1p(-values)
    states = _plane_strain_path(total.ravel(), flow, E, nu, yield_on)  # rows: tau_y, tau_z, plastic e_y, e_z, kappa
    tau_y, tau_z, plastic_y, elastic_z, kappa = (row.reshape(total.shape) for row in states)
    J = np.exp((1.0 - 2.0 * nu) / E * (tau_y + tau_z))
    stretch = np.exp(-nu / E * (tau_y + tau_z) - plastic_y + elastic_z)
    stress = -tau_y / J
    return Upsetting(values, stress * width * stretch, width * stretch, stretch, stress, kappa, J)


def _plane_strain_path(total: Array, flow: Flow, E: float, nu: float, yield_on: str) -> Array:
    """(n,) -> (5, n): tau_y, tau_z, plastic e_y, elastic e_z, kappa at each total strain ln(h0/h)."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    modulus = E / (1.0 - nu * nu)

    def stresses(elastic_z: float, kappa: float) -> tuple[float, float]:
        """Kirchhoff tau_y < 0 and tau_z on the yield surface, given the elastic strain along z."""
        limit, J = flow(kappa), 1.0
        for _ in range(60):
            # tau_z = nu tau_y + E e_z turns tau_y^2 - tau_y tau_z + tau_z^2 = (J limit)^2 into a quadratic.
            A, B = 1.0 - nu + nu * nu, (2.0 * nu - 1.0) * E * elastic_z
            C = (E * elastic_z) ** 2 - (J * limit) ** 2
            tau_y = (-B - math.sqrt(B * B - 4.0 * A * C)) / (2.0 * A)
            tau_z = nu * tau_y + E * elastic_z
            update = math.exp((1.0 - 2.0 * nu) / E * (tau_y + tau_z)) if yield_on == "cauchy" else 1.0
            if abs(update - J) <= np.finfo(float).eps:
                break
            J = update
        return tau_y, tau_z

    def rates(kappa: float, y: Any) -> list[float]:
        tau_y, tau_z = stresses(y[1], kappa)
        q = math.sqrt(tau_y * tau_y - tau_y * tau_z + tau_z * tau_z)
        return [(tau_y - 0.5 * tau_z) / q, -(tau_z - 0.5 * tau_y) / q]

    def strain(kappa: float, y: Any) -> float:
        """Total ln(h0/h) reached at kappa."""
        tau_y, tau_z = stresses(y[1], kappa)
        return -((tau_y - nu * tau_z) / E + y[0])

    result = np.zeros((5, total.size))
    first = strain(0.0, (0.0, 0.0))
    elastic = total <= first
    result[0, elastic] = -modulus * total[elastic]
    result[1, elastic] = nu * result[0, elastic]
    if not elastic.all():
        end = 1.2 * float(total.max())  # d kappa/d(plastic compression) = 1/|n_y| stays below 2/sqrt 3
        eps = np.finfo(float).eps
        path = solve_ivp(rates, (0.0, end), [0.0, 0.0], method="Radau", rtol=ACCURACY, atol=eps, dense_output=True)
        for i in np.flatnonzero(~elastic):
            target = float(total[i])
            kappa = float(brentq(lambda k, t=target: strain(k, path.sol(k)) - t, 0.0, end))
            plastic_y, elastic_z = path.sol(kappa)
            result[:, i] = *stresses(elastic_z, kappa), plastic_y, elastic_z, kappa
    return result


def ring_bore_change(
    reduction: ArrayLike,
    *,
    flow: Flow | None = None,
    E: float | None = None,
    nu: float | None = None,
    yield_on: str = "cauchy",
) -> Array:
    """reduction: any shape (-) -> same shape (-): relative change of the bore of a ring upset without friction.

    Without a material the ring is incompressible and every radius grows by sqrt(h0/h). With flow, E (stress) and nu
    the elastic part is included exactly: the same ring is in uniaxial compression, radii grow by its lateral stretch.
    Raises ValueError for reductions outside [0, 1), or if only some of flow, E and nu are given.
    Source: Male & Cockcroft (1964), J. Inst. Metals 93; `uniaxial_compression`.
    """
    if flow is None and E is None and nu is None:
        return np.asarray(1.0 / np.sqrt(1.0 - reductions(reduction)) - 1.0)
    if flow is None or E is None or nu is None:
        raise ValueError(f"flow, E, nu = {flow!r}, {E!r}, {nu!r}: give all three, or none for an incompressible ring")
    return uniaxial_compression(reduction, flow=flow, E=E, nu=nu, yield_on=yield_on)[1] - 1.0


@dataclass(frozen=True)
class Necking:
    """Considere's point: force, elongation (length, of the whole bar), true stress, plastic strain (-)."""

    force: float
    elongation: float
    stress: float
    plastic_strain: float


def considere(
    flow: Flow, *, area: float, length: float, E: float | None = None, nu: float | None = None, yield_on: str = "cauchy"
) -> Necking:
    """`flow` (-) -> (stress); area (length^2), length (length), E (stress), nu (-) -> Necking: largest force on a bar.

    Homogeneous tension: F(kappa) = sigma A0 exp(-2 nu e - kappa) with e = tau/E, elongation L0 (exp(e + kappa) - 1);
    rigid-plastic (e = 0) without E. Its maximum, d sigma/d epsilon = sigma, is where necking begins. The elastic
    terms shift the force by about sigma/E.
    Raises ValueError for area or length <= 0, only one of E and nu, a flow curve not positive at zero strain, or a
    force still growing at kappa = 5 (the curve never saturates).
    Source: Considere (1885); Hill (1950), ch. 1.
    """
    from scipy.optimize import minimize_scalar

    positive(area=area, length=length)
    if (E is None) != (nu is None):
        raise ValueError(f"E, nu = {E!r}, {nu!r}: give both, or neither for a rigid-plastic bar")
    _check_material(flow, 1.0 if E is None else E, 0.0 if nu is None else nu, yield_on)

    def state(kappa: float) -> tuple[float, float, float]:
        """Log force over area, elastic strain, Cauchy stress."""
        limit = float(flow(kappa))
        if E is None or nu is None:
            return math.log(limit) - kappa, 0.0, limit
        e = limit / E
        if yield_on == "cauchy":
            for _ in range(60):
                e = limit / E * math.exp((1.0 - 2.0 * nu) * e)
        return math.log(E * e) - (1.0 - 2.0 * nu) * e - 2.0 * nu * e - kappa, e, E * e * math.exp((2.0 * nu - 1.0) * e)

    top = 5.0
    coarse = np.concatenate([[0.0], np.geomspace(1e-6, top, 400)])
    best = int(np.argmax([state(float(k))[0] for k in coarse]))
    if best == coarse.size - 1:
        raise ValueError(f"flow({top}) = {flow(top)!r}: the force still grows there; give a flow curve that saturates")
    kappa = 0.0
    if best > 0:
        bounds = (float(coarse[best - 1]), float(coarse[best + 1]))
        found = minimize_scalar(lambda k: -state(k)[0], bounds=bounds, method="bounded", options={"xatol": ACCURACY})
        kappa = float(found.x)
    log_force, e, stress = state(kappa)
    return Necking(area * math.exp(log_force), length * math.expm1(e + kappa), stress, kappa)
