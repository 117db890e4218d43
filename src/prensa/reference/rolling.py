"""Flat rolling after Orowan: the slab method with shear across the strip, sticking where friction reaches the shear strength."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from scipy.special import spherical_jn

from ._check import ACCURACY, Array, not_negative, positive

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_SHARES = 0.5 * (_POINTS + 1.0)


@dataclass(frozen=True)
class OrowanRolling:
    """Force and torque (per width) of one roll, angle of the neutral point (rad), pressures (n,) at angles (n,) on the arc."""

    force: float
    torque: float
    neutral: float
    angle: Array
    pressure: Array


def orowan_rolling(
    *, R: float, H: float, h: float, mu: float, k: float | Callable[[float], float], E: float | None = None, nu: float = 0.3
) -> OrowanRolling:
    """R (roll), H, h (half thickness before and in the gap; lengths), mu (-), k, E (stress), nu -> OrowanRolling, no tensions.

    On cylindrical surfaces across the strip the shear grows linearly from the middle to the roll, so that the horizontal
    force of a half is f = y [s -+ mu s (1/phi - cot phi) - 2k w], w = (1/sin phi) int_0^phi sqrt(1 - a^2 (t/phi)^2) cos t dt and
    a = mu s/k <= 1: friction is Coulomb's up to sticking. df/dphi = R s (sin phi +- mu cos phi) is integrated on the true
    arc from both ends. ``k``: shear yield stress, or a function of the half thickness for a metal that hardens. With a finite E
    the strip leaves the plane of the rolls elastically over the arc on which it recovers.
    Raises ValueError for lengths or k <= 0, mu < 0, H <= h, and where the rolls do not draw the strip in.
    Source: Orowan (1943), Proc. I.M.E. 150, 140-167; the recovery after Ford, Ellis & Bland (1951).
    """
    positive(R=R, H=H, h=h, E=1.0 if E is None else E)
    not_negative(mu=mu)
    if not h < H:
        raise ValueError(f"H = {H!r}: half thickness before the rolls not above that in the gap, h = {h!r}; give H > h")
    arc = _Arc(R, h, mu, k if callable(k) else lambda _: float(k))
    bite = math.acos(1.0 - (H - h) / R)
    p0, length, begin = 2.0 * arc.k(h), 0.0, 0.0
    for _ in range(30):  # elastic recovery, with the pressure at its beginning
        length = 0.0 if E is None else math.sqrt(2.0 * R * h * p0 * (1.0 - nu * nu) / E)
        begin = mu * 2.0 / 3.0 * p0 * length - 0.25 * p0 * length**2 / R
        p0 = 2.0 * arc.k(h) + begin / h
    recovery = 2.0 / 3.0 * p0 * length
    after, before = arc.zone(1.0, 0.0, bite, begin), arc.zone(-1.0, bite, 0.0, 0.0)
    if not before(0.0)[0] > begin:
        raise ValueError(f"mu = {mu!r}: too little friction for the rolls to draw the strip in; give more, or less draft")
    neutral = float(brentq(lambda phi: float(after(phi)[0] - before(phi)[0]), 0.0, bite))

    def at(phi: float) -> tuple[float, float]:
        """Pressure and signed friction."""
        sign, f = (1.0, after) if phi < neutral else (-1.0, before)
        s = arc.pressure(float(f(phi)[0]), phi, sign)
        return s, sign * arc.friction(s, phi)

    def total(weight: Callable[[float, float, float], float]) -> float:
        parts = ((0.0, neutral), (neutral, bite))
        return sum(float(quad(lambda phi: weight(phi, *at(phi)) * R, a, b)[0]) for a, b in parts)

    force = total(lambda phi, s, t: s * math.cos(phi) + t * math.sin(phi)) + recovery
    torque = R * (total(lambda phi, s, t: -t) - mu * recovery)
    angle = np.linspace(0.0, bite, 101)
    return OrowanRolling(force, torque, neutral, angle, np.array([at(float(phi))[0] for phi in angle]))


@dataclass(frozen=True)
class _Arc:
    """Orowan's relations on the arc of contact: roll R, half thickness h in the gap, friction mu, strength k(half thickness)."""

    R: float
    h: float
    mu: float
    k: Callable[[float], float]

    def half(self, phi: float) -> float:
        """Half thickness at an angle."""
        return self.h + self.R * (1.0 - math.cos(phi))

    def friction(self, s: float, phi: float) -> float:
        """Coulomb's friction, at most the shear strength."""
        return min(self.mu * s, self.k(self.half(phi)))

    def horizontal(self, s: float, phi: float, sign: float) -> float:
        """Horizontal force of a half for a roll pressure s; sign 1 between the neutral point and the exit, -1 before."""
        own = self.k(self.half(phi))
        a = self.friction(s, phi) / own
        root = np.sqrt(np.maximum(1.0 - (a * _SHARES) ** 2, 0.0))
        shrunk = 1.0 / float(np.sinc(phi / math.pi))
        w = 0.5 * shrunk * float(_WEIGHTS @ (root * np.cos(_SHARES * phi)))
        bent = float(spherical_jn(1, phi) / spherical_jn(0, phi))  # 1/phi - cot phi
        return self.half(phi) * (s - 2.0 * own * w + sign * self.friction(s, phi) * bent)

    def pressure(self, f: float, phi: float, sign: float) -> float:
        """Roll pressure for a horizontal force."""
        guess = f / self.half(phi) + 2.0 * self.k(self.half(phi))
        return float(brentq(lambda s: self.horizontal(s, phi, sign) - f, 0.0, 1.5 * guess))

    def zone(self, sign: float, start: float, end: float, f0: float) -> Any:
        """Horizontal force (1,) as a function of the angle, from f0 at the start."""

        def slope(phi: float, state: Array) -> list[float]:
            s = self.pressure(float(state[0]), phi, sign)
            return [self.R * (s * math.sin(phi) + sign * self.friction(s, phi) * math.cos(phi))]

        scale = self.k(self.h) * self.h
        return solve_ivp(slope, (start, end), [f0], rtol=ACCURACY, atol=ACCURACY * scale, dense_output=True).sol
