"""Flat rolling after Orowan: the slab method with shear across the strip, sticking where friction reaches the shear strength."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from ._check import Array, not_negative, positive


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
    strength = k if callable(k) else (lambda _: float(k))  # type: ignore[arg-type, misc]
    bite = math.acos(1.0 - (H - h) / R)
    p0, length, begin = 2.0 * strength(h), 0.0, 0.0
    for _ in range(30):  # elastic recovery, with the pressure at its beginning
        length = 0.0 if E is None else math.sqrt(2.0 * R * h * p0 * (1.0 - nu * nu) / E)
        begin = mu * 2.0 / 3.0 * p0 * length - 0.25 * p0 * length**2 / R
        p0 = 2.0 * strength(h) + begin / h
    recovery = 2.0 / 3.0 * p0 * length
    points, weights = np.polynomial.legendre.leggauss(16)
    share = 0.5 * (points + 1.0)

    def half(phi: float) -> float:
        return h + R * (1.0 - math.cos(phi))

    def friction(s: float, phi: float) -> float:
        return min(mu * s, strength(half(phi)))

    def horizontal(s: float, phi: float, sign: float) -> float:
        """Horizontal force f of a half for a roll pressure s; sign 1 between the neutral point and the exit, -1 before."""
        own = strength(half(phi))
        a = friction(s, phi) / own
        w = 0.5 * float(weights @ np.sqrt(np.maximum(1.0 - (a * share) ** 2, 0.0)))
        if phi > 1e-9:
            w = 0.5 * phi * float(weights @ (np.sqrt(np.maximum(1 - (a * share) ** 2, 0)) * np.cos(share * phi))) / math.sin(phi)
        bent = 1.0 / phi - 1.0 / math.tan(phi) if phi > 1e-4 else phi / 3.0
        return half(phi) * (s - 2.0 * own * w + sign * friction(s, phi) * bent)

    def pressure(f: float, phi: float, sign: float) -> float:
        own = strength(half(phi))
        guess = f / half(phi) + 2.0 * own
        return float(brentq(lambda s: horizontal(s, phi, sign) - f, 0.2 * guess, 1.5 * guess, rtol=1e-13))

    def zone(sign: float, start: float, end: float, f0: float) -> Any:
        def slope(phi: float, state: Array) -> list[float]:
            s = pressure(float(state[0]), phi, sign)
            return [R * (s * math.sin(phi) + sign * friction(s, phi) * math.cos(phi))]

        return solve_ivp(slope, (start, end), [f0], rtol=1e-8, atol=1e-8 * strength(h) * h, dense_output=True).sol

    after, before = zone(1.0, 0.0, bite, begin), zone(-1.0, bite, 0.0, 0.0)
    if not before(0.0)[0] > begin:
        raise ValueError(f"mu = {mu!r}: too little friction for the rolls to draw the strip in; give more, or less draft")
    neutral = float(brentq(lambda phi: float(after(phi)[0] - before(phi)[0]), 0.0, bite))

    def at(phi: float) -> tuple[float, float]:
        """Pressure and signed friction."""
        sign, f = (1.0, after) if phi < neutral else (-1.0, before)
        s = pressure(float(f(phi)[0]), phi, sign)
        return s, sign * friction(s, phi)

    def total(weight: Callable[[float, float, float], float]) -> float:
        parts = ((0.0, neutral), (neutral, bite))
        return sum(float(quad(lambda phi: weight(phi, *at(phi)) * R, a, b, epsrel=1e-6)[0]) for a, b in parts)

    force = total(lambda phi, s, t: s * math.cos(phi) + t * math.sin(phi)) + recovery
    torque = R * (total(lambda phi, s, t: -t) - mu * recovery)
    angle = np.linspace(0.0, bite, 101)
    return OrowanRolling(force, torque, neutral, angle, np.array([at(float(phi))[0] for phi in angle]))
