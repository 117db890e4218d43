"""Closed forms of metal forming: limit loads, tubes, rough plates, the slab method, drawing and rolling.

Homogeneous upsetting, ring and necking: `upsetting.py`. Strip bending and springback: `bending.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._check import ACCURACY, Array, not_negative, positive, shear_factor

# --- limit loads and tubes ----------------------------------------------------------------------------------------


def prandtl_punch(k: float) -> float:
    """`k` (stress, shear yield) -> mean pressure (stress) = (2 + pi) k of a flat punch on a half-plane, plane strain.

    Raises ValueError for k <= 0.
    Source: Prandtl (1920); Hill (1950), The Mathematical Theory of Plasticity, ch. 9.
    """
    positive(k=k)
    return (2.0 + math.pi) * k


def wedge_indentation(semi_angle: float, k: float) -> tuple[float, float, float]:
    """Semi-angle (rad), shear yield stress k -> (pressure on the flanks, half width of the contact, height of the lip)/depth.

    A smooth rigid wedge in a half space that is rigid, perfectly plastic, in plane strain; pressure (stress), lengths over the
    depth of the tip below the first surface. All stays similar to itself; the lip has the volume that the wedge displaces.
    Source: Hill, Lee and Tupper (1947), The theory of wedge indentation of ductile materials, Proc. R. Soc. A 188.
    Raises ValueError for an angle outside 0 ... pi/2, k <= 0.
    """
    from scipy.optimize import brentq

    positive(k=k)
    if not 0.0 < semi_angle < 0.5 * math.pi:
        raise ValueError(f"semi_angle = {semi_angle!r}: between 0 and pi/2; a flat punch is `prandtl_punch`")
    fan = brentq(lambda a: math.cos(2 * semi_angle - a) - math.cos(a) / (1 + math.sin(a)), 0.0, 0.5 * math.pi)
    flank = 1.0 / (math.cos(semi_angle) - math.sin(semi_angle - fan))
    return 2 * k * (1 + fan), flank * math.sin(semi_angle), flank * math.cos(semi_angle) - 1.0



def tube_pressure(k: float, a: float, b: float, c: float | None = None) -> float:
    """`k` (stress), a, b, c (length) -> internal pressure (stress) with the tube yielded from a out to c (None: b).

    Plane strain, p = k [1 - c^2/b^2 + 2 ln(c/a)]; first yield at c = a, full yield 2 k ln(b/a) at c = b. Exact for
    Tresca, and for von Mises with nu = 1/2 (k = sigma_Y/sqrt 3); at full yield exact for von Mises with any nu.
    Raises ValueError for k or a <= 0, b <= a, or c outside [a, b].
    Source: Hill (1950), ch. 5.
    """
    positive(k=k, a=a, b=b)
    if b <= a:
        raise ValueError(f"b = {b!r}: outer radius not above the inner a = {a!r}; give b > a")
    edge = b if c is None else c
    if not a <= edge <= b:
        raise ValueError(f"c = {c!r}: the elastic-plastic radius lies in [a, b] = [{a!r}, {b!r}]; give one there")
    return k * (1.0 - (edge / b) ** 2 + 2.0 * math.log(edge / a))


def tube_expansion(sigma_y: float, a0: float, b0: float, a: ArrayLike) -> Array:
    """sigma_y (stress), a0, b0 (length, initial radii), a: any shape (length, inner radius) -> pressure, that shape.

    Rigid-perfectly plastic, plane strain, finite: b^2 = b0^2 - a0^2 + a^2 and p = (sigma_y/sqrt 3) ln(b^2/a^2).
    Raises ValueError for sigma_y or a0 <= 0, b0 <= a0, or any a < a0.
    Source: Hill (1950), ch. 5; volume constancy.
    """
    positive(sigma_y=sigma_y, a0=a0, b0=b0)
    inner = np.asarray(a, dtype=float)
    if b0 <= a0:
        raise ValueError(f"b0 = {b0!r}: outer radius not above the inner a0 = {a0!r}; give b0 > a0")
    if bool(np.any(inner < a0)):
        raise ValueError(f"a = {a!r}: the tube expands; give inner radii from a0 = {a0!r} up")
    return np.asarray(sigma_y / math.sqrt(3.0) * np.log((b0 * b0 - a0 * a0 + inner * inner) / (inner * inner)))


# --- compression with friction ------------------------------------------------------------------------------------


def rough_plates_cycloid(b: float, h: float) -> float:
    """`b` (length, half width), h (length, height) -> mean p/(2k) (-) = 3/4 + b/(2h) between perfectly rough plates.

    Plane strain, rigid-perfectly plastic, from the cycloid slip lines; meant for 2b/h well above 1.
    Raises ValueError for b or h <= 0.
    Source: Prandtl (1923); Hill (1950), ch. 8.
    """
    positive(b=b, h=h)
    return 0.75 + b / (2.0 * h)


def rough_plates_slab(b: float, h: float, m: float = 1.0) -> float:
    """`b` (length, half width), h (length, height), m (-, shear factor) -> mean p/(2k) (-) = 1 + m b/(2h), slab method.

    Raises ValueError for b or h <= 0 or m outside [0, 1].
    Source: Siebel (1923), von Karman (1925); Hosford & Caddell (1993), Metal Forming.
    """
    positive(b=b, h=h)
    shear_factor(m)
    return 1.0 + m * b / (2.0 * h)


@dataclass(frozen=True)
class Slab:
    """Slab solution: size (half width or radius), h, sticking (length), sigma, shear_limit, mean (stress), pressure(x).

    Shear limit and mu bound the shear stress; inside |x| < sticking it sits at the limit. sigma is the pressure at
    the free edge, mean the mean pressure.
    """

    size: float
    h: float
    mu: float
    sigma: float
    shear_limit: float
    sticking: float
    axisymmetric: bool

    def pressure(self, x: ArrayLike) -> Array:
        """x: any shape (length, from the centre or axis) -> same shape (stress), zero beyond |x| = size."""
        r = np.abs(np.asarray(x, dtype=float))
        slipping = np.clip(self.size - np.maximum(r, self.sticking), 0.0, None)
        slip = self.sigma * np.exp(2.0 * self.mu * slipping / self.h)
        if self.sticking > 0.0:
            slip = slip + 2.0 * self.shear_limit * np.clip(self.sticking - r, 0.0, None) / self.h
        return np.asarray(np.where(r <= self.size, slip, 0.0))

    @property
    def mean(self) -> float:
        """Mean pressure (stress), by Gauss-Legendre on the sticking and the slipping part."""
        z, w = np.polynomial.legendre.leggauss(64)
        total = 0.0
        for low, high in ((0.0, self.sticking), (self.sticking, self.size)):
            x = low + 0.5 * (high - low) * (z + 1.0)
            area = 2.0 * x / self.size**2 if self.axisymmetric else np.full_like(x, 1.0 / self.size)
            total += 0.5 * (high - low) * float(np.sum(w * area * self.pressure(x)))
        return total


def slab_strip(*, b: float, h: float, mu: float, k: float, m: float | None = None) -> Slab:
    """b, h (length), mu (-), k (stress), m (-) -> Slab: strip of half width b between plates, plane strain, Coulomb.

    p = 2k exp(2 mu (b - x)/h), mean 2k (h/(2 mu b)) (exp(2 mu b/h) - 1). With m the shear stress is capped at m k:
    inside the sticking width p grows linearly, by 2 m k/h.
    Raises ValueError for b, h or k <= 0, mu < 0, m outside [0, 1].
    Source: von Karman (1925), Orowan (1943); Hosford & Caddell (1993).
    """
    positive(b=b, h=h, k=k)
    return _slab(b, h, mu, 2.0 * k, k, m, axisymmetric=False)


def slab_cylinder(*, R: float, h: float, mu: float, Y: float, m: float | None = None) -> Slab:
    """R, h (length), mu (-), Y (stress), m (-) -> Slab: cylinder of radius R and height h upset with Coulomb friction.

    p = Y exp(2 mu (R - r)/h), mean Y (h^2/(2 mu^2 R^2)) (exp(2 mu R/h) - 1 - 2 mu R/h). With m the shear stress is
    capped at m Y/sqrt 3: inside the sticking radius p grows linearly, by 2 m Y/(sqrt 3 h).
    Raises ValueError for R, h or Y <= 0, mu < 0, m outside [0, 1].
    Source: Siebel (1923); Hosford & Caddell (1993).
    """
    positive(R=R, h=h, Y=Y)
    return _slab(R, h, mu, Y, Y / math.sqrt(3.0), m, axisymmetric=True)


def _slab(size: float, h: float, mu: float, sigma: float, k: float, m: float | None, axisymmetric: bool) -> Slab:
    """Find where mu p reaches m k: sigma exp(2 mu (size - x)/h) mu = m k."""
    not_negative(mu=mu)
    limit, sticking = math.inf, 0.0
    if m is not None:
        shear_factor(m)
        limit = m * k
        if limit <= mu * sigma:
            sticking = size
        elif mu > 0.0:
            sticking = max(0.0, size - h / (2.0 * mu) * math.log(limit / (mu * sigma)))
    return Slab(size, h, mu, sigma, limit, sticking, axisymmetric)


# --- drawing and rolling ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Drawing:
    """Half thickness at the exit (length), mean pressure on the die (stress), pull of the half (force per width)."""

    exit: float
    pressure: float
    pull: float


def wedge_drawing(*, alpha: float, H: float, k: float) -> Drawing:
    """H (length, half thickness), alpha (rad, half angle), k (stress) -> Drawing: sheet through a smooth wedge, plane strain.

    Of the reduction r = 2 sin(alpha)/(1 + 2 sin(alpha)) alone, whose slip-line field is one fan between two triangles: exact
    for a rigid, perfectly plastic sheet, pressure 2k (1 + alpha)/(1 + 2 sin(alpha)) on the die and pull = pressure r H.
    Raises ValueError for H or k <= 0 and alpha outside (0, pi/2).
    Source: Hill & Tupper (1948), J. Iron Steel Inst. 159; Hill (1950), ch. 7.
    """
    positive(alpha=alpha, H=H, k=k)
    if alpha >= 0.5 * math.pi:
        raise ValueError(f"alpha = {alpha!r}: half angle of a wedge; give it in radians, below pi/2")
    reduction = 2.0 * math.sin(alpha) / (1.0 + 2.0 * math.sin(alpha))
    pressure = float(2.0 * k * (1.0 + alpha)) / (1.0 + 2.0 * math.sin(alpha))
    return Drawing(H * (1.0 - reduction), pressure, pressure * reduction * H)


@dataclass(frozen=True)
class Rolling:
    """Force (per width) and torque (per width) of one roll, angle of the neutral point from the plane of the rolls (rad)."""

    force: float
    torque: float
    neutral: float


def strip_rolling(
    *, R: float, H: float, h: float, mu: float, k: float, E: float | None = None, nu: float = 0.3
) -> Rolling:
    """R (roll), H, h (half thickness before and in the gap; lengths), mu (-), k, E (stress), nu (-) -> Rolling, no tensions.

    Karman's equation of the slab, d(q y)/dphi = R p (sin phi -+ mu cos phi) with q the mean horizontal and p the roll's
    pressure, vertical stress less q = 2k, integrated on the true arc y = h + R (1 - cos phi) from both ends; they meet at the
    neutral point. Perfectly plastic, plane strain, slipping all along (mu p < k). With a finite E the strip leaves the plane
    of the rolls elastically, p = p0 - E y'/((1 - nu^2) h) over the arc on which it recovers.
    Raises ValueError for lengths, k or E <= 0, mu < 0, H <= h, and where the rolls do not draw the strip in.
    Source: von Karman (1925), ZAMM 5; Bland & Ford (1948), Proc. I.M.E. 159; the recovery after Ford, Ellis & Bland (1951).
    """
    from scipy.integrate import quad, solve_ivp
    from scipy.optimize import brentq

    positive(R=R, H=H, h=h, k=k, E=1.0 if E is None else E)
    not_negative(mu=mu)
    if not h < H:
        raise ValueError(f"H = {H!r}: half thickness before the rolls not above that in the gap, h = {h!r}; give H > h")
    bite = math.acos(1.0 - (H - h) / R)
    # elastic recovery beyond the plane of the rolls, with the pressure at its beginning
    p0, length = 2.0 * k, 0.0
    for _ in range(30):
        length = 0.0 if E is None else math.sqrt(2.0 * R * h * p0 * (1.0 - nu * nu) / E)
        recovery = 2.0 / 3.0 * p0 * length
        q0 = (mu * recovery - 0.25 * p0 * length**2 / R) / h
        p0 = 2.0 * k + q0

    def zone(sign: float, start: float, end: float, q: float) -> Any:
        """q(phi) where friction on the strip points backwards (sign 1, beyond the neutral point) or forwards (-1)."""

        def slope(phi: float, state: Array) -> list[float]:
            p = (2.0 * k + state[0]) / (1.0 + sign * mu * math.tan(phi))
            gain = p * (math.sin(phi) + sign * mu * math.cos(phi)) - state[0] * math.sin(phi)
            return [gain * R / (h + R * (1.0 - math.cos(phi)))]

        return solve_ivp(slope, (start, end), [q], rtol=ACCURACY, atol=ACCURACY * k, dense_output=True).sol

    after, before = zone(1.0, 0.0, bite, q0), zone(-1.0, bite, 0.0, 0.0)
    if not before(0.0)[0] > q0:
        raise ValueError(
            f"mu = {mu!r}: too little friction for the rolls to draw the strip in; give more, or less draft"
        )
    neutral = float(brentq(lambda phi: float(after(phi)[0] - before(phi)[0]), 0.0, bite))

    def pressure(phi: float) -> float:
        sign, q = (1.0, after) if phi < neutral else (-1.0, before)
        return float((2.0 * k + q(phi)[0]) / (1.0 + sign * mu * math.tan(phi)))

    def total(weight: Callable[[float, float], float]) -> float:
        parts = ((0.0, neutral, 1.0), (neutral, bite, -1.0))
        return sum(float(quad(lambda f, s=s: pressure(f) * weight(f, s) * R, a, b)[0]) for a, b, s in parts)

    force = total(lambda f, s: math.cos(f) + s * mu * math.sin(f)) + recovery
    torque = R * (total(lambda f, s: -s * mu) - mu * recovery)
    return Rolling(force, torque, neutral)
