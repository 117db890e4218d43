"""Bending of a strip round a punch into a die that it touches at its shoulders alone: the angle between the legs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ._check import ACCURACY, Array, not_negative, positive
from .bending import bend_strip
from .upsetting import Flow


@dataclass(frozen=True)
class FreeBending:
    """The bent strip.

    ``angle`` between the legs and ``tangents``, that were they straight up to the punch (rad); ``force`` of a shoulder across
    its leg, per unit width; ``released``: angle between the legs when the tools have gone (rad); ``wrap``: the angle over
    which the strip lies on the punch (rad), 0 where it touches no more than its nose.
    """

    angle: float
    tangents: float
    force: float
    released: float
    wrap: float


def free_bending(
    *, punch: float, shoulder: float, apart: float, thickness: float, flow: Flow, E: float, nu: float, mu: float = 0.0
) -> FreeBending:
    """Radii of punch and shoulders (length), their centres level and ``apart``, thickness, flow (-) -> (stress), E (stress),
    Coulomb's mu at the shoulders -> FreeBending in plane strain.

    The strip lies on the punch up to a point P, crosses to the shoulder at Q, and is straight beyond. Between P and Q it
    carries the moment of the shoulder's force, curvature by curvature that of `bend_strip`, which at P is that of the punch;
    the angle at Q and the force are those with which the line from Q arrives at P on the punch and along it. Where no force
    bends it as round as the punch it touches the nose alone, where the line arrives along the middle's tangent. Were it
    straight from P on, cos(angle/2) = (punch + thickness + shoulder)/apart. Inextensible, without shear. Release takes the
    moments off elastically, on the punch too: the legs open by twice the integral of 12 M/(E' t^3).

    Raises ValueError for a length, E or flow out of bounds (see `bend_strip`), mu < 0, or a gap between punch and shoulder
    that is less than the thickness.
    Source: Marciniak, Duncan & Hu (2002), Mechanics of Sheet Metal Forming, ch. 6 and 10 (moment of bending, bending in a die).
    """
    from scipy.interpolate import PchipInterpolator
    from scipy.optimize import root

    positive(punch=punch, shoulder=shoulder, apart=apart, thickness=thickness)
    not_negative(mu=mu)
    if punch + thickness + shoulder >= apart:
        raise ValueError(
            f"apart = {apart!r}: leaves no room for the strip; give more than {punch + thickness + shoulder!r}"
        )
    tangents = math.acos((punch + thickness + shoulder) / apart)
    stiffness = E / (1.0 - nu * nu) * thickness**3 / 12.0
    on_punch, on_shoulder = punch + 0.5 * thickness, shoulder + 0.5 * thickness
    curvature = np.concatenate([np.geomspace(0.01, 1.0, 24), [1.2]]) / on_punch
    moment = bend_strip(curvature, thickness=thickness, flow=flow, E=E, nu=nu).moment
    laid = float(moment[-2])
    bent = PchipInterpolator(np.append(0.0, moment), np.append(0.0, curvature), extrapolate=True)

    def line(z: Array, nose: bool) -> tuple[float, float, Array]:
        """Half the angle, the force and the end of the line from Q; z: angle over ``tangents``, lever over ``apart``."""
        half, push = float(z[0]) * tangents, laid / (abs(float(z[1])) * apart)
        along, across = np.array([math.sin(half), math.cos(half)]), np.array([-math.cos(half), math.sin(half)])
        end = _end(half, push * (across + mu * along), None if nose else laid, bent, math.pi * (on_punch + apart))
        end[:2] += np.array([apart, 0.0]) + on_shoulder * across
        return half, push, end

    def arrival(z: Array, nose: bool) -> Array:
        """How far the line's end is from the punch's nose, or from the punch and from its tangent."""
        x, y, direction = line(z, nose)[2][:3]
        if nose:
            return np.array([x, y + on_punch]) / thickness
        return np.array([math.hypot(x, y) - on_punch, x * math.sin(direction) + y * math.cos(direction)]) / thickness

    for nose, lever in ((False, 6.0 * thickness / apart), (True, 1.0)):
        found = root(arrival, [0.95, lever], args=(nose,)).x
        half, push, end = line(found, nose)
        # a strip that lay on the punch beyond its middle touches the nose; one that there is bent more lies on the punch
        fits = float(end[4]) <= laid if nose else float(end[2]) <= 0.5 * math.pi
        if fits and float(np.abs(arrival(found, nose)).max()) <= 1e-5:
            wrap = 0.0 if nose else 0.5 * math.pi - float(end[2])
            opened = (float(end[3]) + laid * on_punch * wrap) / stiffness
            return FreeBending(2.0 * half, 2.0 * tangents, push, 2.0 * (half + opened), 2.0 * wrap)
    raise ValueError(f"apart = {apart!r}: no strip of this material goes from the punch to the shoulder; widen the die")


def _end(half: float, force: Array, laid: float | None, bent: Callable[[float], Array], way: float) -> Array:
    """Where (x, y from Q) and in what direction (rad from the vertical) the strip has the moment ``laid``, or after a ``way``.

    Without a moment: where it is horizontal. Fourth and fifth number: the integral of the moment up to there, and the moment.
    """
    from scipy.integrate import solve_ivp

    def moment(y: Array) -> float:
        return float(abs(y[0] * force[1] - y[1] * force[0]))

    def arrived(_: float, y: Array) -> float:
        return float(y[2]) - 0.5 * math.pi if laid is None else moment(y) - laid

    def rate(_: float, y: Array) -> list[float]:
        return [-math.sin(y[2]), -math.cos(y[2]), float(bent(moment(y))), moment(y)]

    arrived.terminal = True  # type: ignore[attr-defined]
    y = solve_ivp(rate, (0.0, way), [0.0, 0.0, half, 0.0], events=arrived, rtol=ACCURACY, atol=ACCURACY).y[:, -1]
    return np.append(y, moment(y))
