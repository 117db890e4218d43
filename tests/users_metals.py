"""A metal and a flow curve as users write them, point by point: of tests, and of a benchmark of what they cost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import prensa as pr
from prensa.kernels.record import sqrt, where
from prensa.materials.corotational import Tensor
from prensa.materials.point_material import PointAt


class Metal(pr.PointMaterial):
    """J2 plasticity, linear hardening of the Cauchy stress, which temperature lowers."""

    E: float
    nu: float
    s0: float
    H: float
    softening: float = 0.0
    plastic = True
    variables = ("plastic_strain", "plastic_work")

    def stress(self, strain: Tensor) -> Tensor:
        """Kirchhoff stress of an elastic strain."""
        return self.E / (1 + self.nu) * strain.deviator + Tensor.spherical(self.E / (3 - 6 * self.nu) * strain.trace)

    def energy(self, strain: Tensor) -> Any:
        """Stored energy of an elastic strain."""
        return 0.5 * self.stress(strain).dot(strain)

    def flow_stress(self, strain: Any) -> Any:
        """Flow stress, of Cauchy stresses, at a plastic strain."""
        return self.s0 + self.H * strain

    def respond(self, trial: Tensor, old: Sequence[Any], at: PointAt) -> tuple[Tensor, Sequence[Any]]:
        """Elastic strain and variables after a trial strain."""
        G, d, was = self.E / (2 + 2 * self.nu), trial.deviator, self.flow_stress(old[0])
        if at.temperature is not None:
            was = was * (1 - self.softening * at.temperature)
        q = 2 * G * sqrt(1.5 * d.dot(d) + 1e-60)
        over = q - at.J * was
        rise = where(at.flowing(over > 1e-11 * q), over / (3 * G + at.J * self.H), 0.0)
        work = 0.5 * (at.J_n * was + at.J * (was + self.H * rise)) * rise
        return trial - 3 * G * rise / q * d, (old[0] + rise, old[1] + work)


class Power(pr.PointCurve):
    """Ludwik's curve."""

    s0: float
    K: float
    n: float

    def stress(self, strain: Any, rate: Any) -> Any:
        """Flow stress at a plastic strain."""
        return self.s0 + self.K * strain**self.n
