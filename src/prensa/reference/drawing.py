"""Steady drawing and extrusion of perfectly plastic metals by the slab method and upper bounds, and the drawing of cups.

Drawing stresses are over the area of the exit; an extrusion pressure over that of the entry has the same value.
"""

from __future__ import annotations

import math

from ._check import ACCURACY, not_negative, positive, shear_factor


def _check_reduction(before: float, after: float, alpha: float) -> None:
    positive(before=before, after=after, alpha=alpha)
    if not after < before:
        raise ValueError(f"after = {after!r}: not thinner than before = {before!r}; give the size behind the die")
    if alpha >= 0.5 * math.pi:
        raise ValueError(f"alpha = {alpha!r}: half angle of a die; give it in radians, below pi/2")


def slab_drawing(*, before: float, after: float, alpha: float, Y: float, m: float = 0.0, axisymmetric: bool = True) -> float:
    """before, after (radius, or half thickness of a strip), alpha (rad), Y (stress), m (-) -> drawing stress, slab method.

    Homogeneous deformation and friction m Y/sqrt 3 on the die, no work for turning the flow: a wire needs
    2 Y ln(R/r) (1 + m cot(alpha)/sqrt 3), a strip (2/sqrt 3) Y ln(H/h) (1 + m cot(alpha)/2).
    Raises ValueError for sizes, Y or alpha <= 0, after >= before, m outside [0, 1].
    Source: Sachs (1927), ZAMM 7, with shear-factor friction; Avitzur (1968), Metal Forming, ch. 8.
    """
    _check_reduction(before, after, alpha)
    shear_factor(m)
    positive(Y=Y)
    strain = math.log(before / after)
    if axisymmetric:
        return 2.0 * Y * strain * (1.0 + m / (math.tan(alpha) * math.sqrt(3.0)))
    return 2.0 / math.sqrt(3.0) * Y * strain * (1.0 + 0.5 * m / math.tan(alpha))


def wire_upper_bound(*, before: float, after: float, alpha: float, Y: float, m: float = 0.0) -> float:
    """before, after (radius), alpha (rad), Y (stress), m (-) -> upper bound of the drawing stress of a wire.

    Flow towards the apex of the cone between two spheres, at which the velocity jumps; no land.
    Raises ValueError as `slab_drawing`.
    Source: Avitzur (1968), Metal Forming: Processes and Analysis, ch. 8.
    """
    _check_reduction(before, after, alpha)
    shear_factor(m)
    positive(Y=Y)
    strain, s, c = math.log(before / after), math.sin(alpha), math.cos(alpha)
    ratio = math.sqrt(11.0 / 12.0)
    root = math.sqrt(1.0 - 11.0 / 12.0 * s * s)
    f = (1.0 - c * root + math.log((1.0 + ratio) / (ratio * c + root)) / math.sqrt(132.0)) / s**2
    turning = alpha / s**2 - 1.0 / math.tan(alpha)
    return Y * (2.0 * f * strain + 2.0 / math.sqrt(3.0) * (turning + m / math.tan(alpha) * strain))


def strip_upper_bound(*, before: float, after: float, alpha: float, k: float, m: float = 0.0) -> float:
    """before, after (half thickness), alpha (rad), k (stress), m (-) -> upper bound of the drawing stress of a strip.

    One rigid triangle between the die and a point of the centre line, the best of all: k times the jumps of velocity on its
    sides times their lengths, m k on the die.
    Raises ValueError as `slab_drawing`.
    Source: Johnson and Mellor (1973), Engineering Plasticity, ch. 13.
    """
    from scipy.optimize import minimize_scalar

    _check_reduction(before, after, alpha)
    shear_factor(m)
    positive(k=k)
    reach = (before - after) / math.tan(alpha)

    def power(point: float) -> float:
        """Power over speed of entry and half thickness before the die, for the triangle's point at that distance."""
        a, b, c = (0.0, before), (reach, after), (point, 0.0)
        # along the die with u, so that what is normal to the side a-c goes on: (1, 0) - u (cos, -sin) is along a-c
        side = (c[0] - a[0], c[1] - a[1])
        u = side[1] / (side[1] * math.cos(alpha) + side[0] * math.sin(alpha))
        inside = (u * math.cos(alpha), -u * math.sin(alpha))
        out = before / after
        jumps = (
            (math.hypot(1.0 - inside[0], inside[1]), math.hypot(*side), 1.0),
            (math.hypot(out - inside[0], inside[1]), math.hypot(b[0] - c[0], b[1] - c[1]), 1.0),
            (u, math.hypot(b[0] - a[0], b[1] - a[1]), m),
        )
        return sum(v * size * share for v, size, share in jumps) * k / before

    low = -2.0 * before
    found = minimize_scalar(power, bounds=(low, reach + 2.0 * before), method="bounded", options={"xatol": ACCURACY})
    return float(found.fun)


def cup_force(
    *, punch: float, blank: float, thickness: float, flow: float, binder: float = 0.0, mu: float = 0.0
) -> float:
    """punch, blank (diameters), thickness (length), flow (mean stress), binder (force), mu (-) -> drawing force at that blank.

    The flange, pi (punch + thickness) t 1.1 flow ln(blank/punch), and friction under the binder, 2 mu binder, over a die
    shoulder of a quarter of a turn, exp(mu pi/2); no bending. An estimate within some 15 %.
    Raises ValueError for sizes or flow <= 0, binder or mu < 0.
    Source: Siebel (1955), Stahl und Eisen 75, in the form of Lange (1985), Handbook of Metal Forming, ch. 20.
    """
    positive(punch=punch, blank=blank, thickness=thickness, flow=flow)
    not_negative(binder=binder, mu=mu)
    wall = math.pi * (punch + thickness) * thickness
    return (wall * 1.1 * flow * math.log(blank / punch) + 2.0 * mu * binder) * math.exp(0.5 * math.pi * mu)
