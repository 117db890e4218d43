"""A strip drawn over radii: the pull that bending, straightening and friction take, and the curl that they leave behind.

Everything is per unit width, in plane strain (held across the strip), small strain, J2 with isotropic hardening.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._check import Array, not_negative, poisson, positive
from .upsetting import _check_material

Flow = Callable[[Any], Any]
"""Stress of an array of plastic strains."""


@dataclass(frozen=True)
class DrawBending:
    """The strip behind the last radius.

    ``tension``: the pull there (force per width); ``tensions``: behind each radius; ``curvature``: of the strip when it has
    been released (1/length), positive in the sense of the first radius; ``moment``: left in the straight strip under the pull,
    in that sense (force per width times length); ``stretch``: mean strain (-).
    """

    tension: float
    tensions: tuple[float, ...]
    curvature: float
    moment: float
    stretch: float


def draw_bending(
    radii: Sequence[float], angles: Sequence[float], *, thickness: float, tension: float, flow: Flow, E: float, nu: float,
    mu: float = 0.0, layers: int = 100, steps: int = 40,
) -> DrawBending:  # fmt: skip
    """Radii (length) of the tools in order, positive on one side and negative on the other, angles (rad) that the strip lies
    on each; thickness, tension (force per width) before the first, flow (n,) -> (n,) (stress), E (stress), mu (-) -> DrawBending.

    At each radius the strip is bent to the curvature of its middle, drawn along and straightened. What bending and
    straightening take is the work of the moment, ∫ M dκ, by which the pull grows at either end of the arc; along the arc it
    grows by exp(mu angle). Each of the ``layers`` follows its whole history of strain in ``steps`` for each change of
    curvature, with the mean strain that gives the pull. Letting go takes pull and moment off elastically: 12 M/(E' t^3).

    Raises ValueError for lengths, flow or E out of bounds, mu < 0, radii and angles of different numbers, or a pull that the
    strip cannot bear.
    Source: Marciniak, Duncan & Hu (2002), Mechanics of Sheet Metal Forming, ch. 10 (bending and unbending under tension); for
    drawbeads Stoughton (1988), Model of drawbead forces in sheet metal forming, 15th IDDRG congress.
    """
    positive(thickness=thickness, layers=layers, steps=steps)
    not_negative(tension=tension, mu=mu)
    positive(E=E)
    poisson(nu)
    _check_material(flow, E, nu, "kirchhoff")
    if len(radii) != len(angles) or not len(radii):
        raise ValueError(f"radii, angles: {len(radii)} and {len(angles)} of them; give one angle for each radius")
    for radius, angle in zip(radii, angles):
        positive(radius=abs(radius), angle=angle)
    strip = _Strip(thickness, flow, E, nu, layers)
    behind, pull = [], tension
    strip.go(0.0, pull, steps)
    for radius, angle in zip(radii, angles):
        bent = 1.0 / (radius + math.copysign(0.5 * thickness, radius))
        pull += strip.go(bent, pull, steps)
        pull *= math.exp(mu * angle)
        strip.go(bent, pull, steps)
        pull += strip.go(0.0, pull, steps)
        strip.go(0.0, pull, steps)
        behind.append(pull)
    sense = math.copysign(1.0, radii[0])
    released = -12.0 * (1.0 - nu * nu) * strip.moment / (E * thickness**3)
    return DrawBending(pull, tuple(behind), sense * released, sense * strip.moment, strip.stretch)


class _Strip:
    """Fibres of a strip at y (n,), their stresses along and across it and plastic strains, all (n,)."""

    def __init__(self, thickness: float, flow: Flow, E: float, nu: float, layers: int) -> None:
        self.y = thickness * ((np.arange(layers) + 0.5) / layers - 0.5)
        self.weight, self.flow, self.E, self.nu = thickness / layers, flow, E, nu
        self.along, self.across, self.plastic = np.zeros((3, layers))
        self.stretch = self.curvature = 0.0

    @property
    def moment(self) -> float:
        return float(self.along @ self.y) * self.weight

    def go(self, curvature: float, pull: float, steps: int) -> float:
        """Bend to a curvature under a pull that goes linearly to ``pull``; the work of the moment (force per width)."""
        first, now = self.curvature, float(self.along.sum()) * self.weight
        work = 0.0
        for k in range(1, steps + 1):
            # where the strip turns back its moment turns too, over a small change of curvature
            share = (k / steps) ** 2
            before, bent = self.moment, first + (curvature - first) * share
            change = bent - self.curvature
            self._balance(bent, now + (pull - now) * share)
            work += 0.5 * (before + self.moment) * change
        return work

    def _balance(self, curvature: float, pull: float) -> None:
        """The state at a curvature whose stresses carry the pull: Newton on the mean strain, bounded by bisection."""
        from scipy.optimize import brentq

        def missing(stretch: float) -> float:
            return float(self._after(stretch, curvature)[0].sum()) * self.weight - pull

        width = 1e-4 + 2.0 * float(np.abs(self.y).max()) * abs(curvature - self.curvature)
        low, high = self.stretch - width, self.stretch + width
        for _ in range(12):
            if missing(low) <= 0.0 <= missing(high):
                break
            low, high = low - width, high + width
            width *= 2.0
        else:
            raise ValueError(f"pull = {pull!r}: more than the strip can bear; lower the tension or the friction")
        stretch = float(brentq(missing, low, high))
        self.along, self.across, self.plastic = self._after(stretch, curvature)
        self.stretch, self.curvature = stretch, curvature

    def _after(self, stretch: float, curvature: float) -> tuple[Array, Array, Array]:
        """Stresses along and across and plastic strains after an increment of strain: backward Euler of J2, σ_y = ε_z = 0.

        In a = (σ_x + σ_z)/√2, b = (σ_x − σ_z)/√2 elasticity and the return are diagonal: σ_eq² = a²/2 + 3b²/2.
        """
        change = (stretch - self.stretch) + (curvature - self.curvature) * self.y
        stiff, soft = self.E / (1.0 - self.nu), self.E / (1.0 + self.nu)
        a = (self.along + self.across + stiff * change) / math.sqrt(2.0)
        b = (self.along - self.across + soft * change) / math.sqrt(2.0)
        size = np.sqrt(0.5 * a * a + 1.5 * b * b)
        yields = size > self.flow(self.plastic)
        low, high = np.zeros_like(size), np.where(yields, size / (soft * self.flow(self.plastic)), 0.0)
        for _ in range(44):  # the plastic strain over the stress, by bisection
            q = 0.5 * (low + high)
            left = np.sqrt(0.5 * (a / (1.0 + 0.5 * stiff * q)) ** 2 + 1.5 * (b / (1.0 + 1.5 * soft * q)) ** 2)
            more = left > self.flow(self.plastic + q * left)
            low, high = np.where(more, q, low), np.where(more, high, q)
        q = 0.5 * (low + high)
        a, b = a / (1.0 + 0.5 * stiff * q), b / (1.0 + 1.5 * soft * q)
        left = np.sqrt(0.5 * a * a + 1.5 * b * b)
        return (a + b) / math.sqrt(2.0), (a - b) / math.sqrt(2.0), self.plastic + q * left
