"""Hill's orthotropic yield function of 1948 with isotropic hardening, in the plane; from Python alone so far."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple, TypeAlias

import numpy as np
from pydantic import Field

from prensa.kernels.record import Node, differs, root, sqrt, where
from prensa.materials.corotational import Tensor
from prensa.materials.flow_curve import FlowCurve
from prensa.materials.hencky_j2 import NO_STRAIN, ON_SURFACE
from prensa.materials.material import PoissonRatio
from prensa.materials.point_material import PointAt, PointMaterial
from prensa.model.doors import union
from prensa.model.units import Number, Pressure
from prensa.types import Array

if TYPE_CHECKING:  # members are known when the program runs
    Flow: TypeAlias = FlowCurve
else:
    Flow = union("flow")

Positive = Annotated[Number, Field(gt=0)]


class Coefficients(NamedTuple):
    """Of σ̄² = F (σ22 − σ33)² + G (σ33 − σ11)² + H (σ11 − σ22)² + 2 N σ12² (Hill 1948, Proc. R. Soc. Lond. A 193, 281-297)."""

    F: Node
    G: Node
    H: Node
    N: Node

    def equivalent(self, s: tuple[Node, Node, Node]) -> Node:
        """σ̄ of a deviator with the components 11, 22, 12."""
        a, b = 2.0 * s[1] + s[0], 2.0 * s[0] + s[1]
        square = self.F * a * a + self.G * b * b + self.H * (s[0] - s[1]) * (s[0] - s[1]) + 2.0 * self.N * s[2] * s[2]
        return sqrt(square + NO_STRAIN)

    def returned(self, s: tuple[Node, Node, Node], k: Node) -> tuple[Node, Node, Node]:
        """The deviator d of d + k ∂(½ σ̄²)/∂σ = s; k: 2G times the plastic strain over σ̄."""
        F, G, H, N = self
        a, b, c, d = 2.0 * G + H, G - H, F - H, 2.0 * F + H
        over = 1.0 / (1.0 + k * (a + d) + k * k * (a * d - b * c))
        return (s[0] + k * (d * s[0] - b * s[1])) * over, (s[1] + k * (a * s[1] - c * s[0])) * over, s[2] / (1.0 + k * N)

    def softest(self) -> Node:
        """Least eigenvalue of the map from deviators to ∂(½ σ̄²)/∂σ; 3/2 of Mises' function."""
        F, G, H, N = self
        mean = F + G + H
        least = mean - sqrt(mean * mean - 3.0 * (F * G + G * H + H * F) + NO_STRAIN)
        return where(least < N, least, N)


class Hill(PointMaterial):
    """Hencky's elasticity, Hill's yield function of 1948 in axes that turn with the material, isotropic hardening.

    ``E``: Young's modulus, ``nu``: Poisson's ratio, ``flow``: the flow curve, which limits the Cauchy stress. ``F`` to ``N``: see
    `Coefficients`; 0.5, 0.5, 0.5, 1.5 is von Mises. ``angle``: of the first axis (rolling direction) to x, in degrees.
    """

    E: Annotated[Pressure, Field(gt=0)]
    nu: PoissonRatio
    flow: Flow
    F: Positive = 0.5
    G: Positive = 0.5
    H: Positive = 0.5
    N: Positive = 1.5
    angle: Number = 0.0

    offered: ClassVar[bool] = False
    plastic: ClassVar[bool] = True
    directed: ClassVar[bool] = True
    variables: ClassVar[tuple[str, ...]] = ("plastic_strain", "plastic_work")

    @staticmethod
    def coefficients(r0: float, r45: float, r90: float) -> dict[str, float]:
        """F, G, H, N from the ratios of width to thickness strain at 0, 45, 90°; the flow curve is then that at 0°."""
        G, F = 1.0 / (1.0 + r0), r0 / (r90 * (1.0 + r0))
        return {"F": F, "G": G, "H": r0 * G, "N": (r0 + r90) * (1.0 + 2.0 * r45) / (2.0 * r90 * (1.0 + r0))}

    def axes(self, X: Array) -> Array:
        """The angle everywhere."""
        return np.full(len(X), np.radians(self.angle))

    def equivalent(self, stress: Tensor) -> Any:
        """Hill's."""
        d = stress.deviator
        return Coefficients(self.F, self.G, self.H, self.N).equivalent((d.xx, d.yy, d.xy))  # type: ignore[arg-type]

    def _shear(self) -> Any:
        return self.E / (2.0 + 2.0 * self.nu)

    def stress(self, strain: Tensor) -> Tensor:
        """Hooke's law."""
        return 2.0 * self._shear() * strain.deviator + Tensor.spherical(self.E / (3.0 - 6.0 * self.nu) * strain.trace)

    def energy(self, strain: Tensor) -> Any:
        """Quadratic in the strain."""
        return 0.5 * self.stress(strain).dot(strain)

    def respond(self, trial: Tensor, old: Sequence[Any], at: PointAt) -> tuple[Tensor, Sequence[Any]]:
        """Backward Euler with associated flow: plastic strain Δε̄ ∂σ̄/∂σ, σ̄ = J σ_y (ε̄ + Δε̄)."""
        G, d, (strain, work), curve = self._shear(), trial.deviator, old, at.curve
        assert curve is not None
        s, hill = (2.0 * G * d.xx, 2.0 * G * d.yy, 2.0 * G * d.xy), Coefficients(self.F, self.G, self.H, self.N)  # type: ignore[arg-type]
        q, was = hill.equivalent(s), at.flow_stress(strain)
        # σ̄ of the returned stress is at most q/(1 + k m), m the least eigenvalue: at a rise of q/(2G m) that is below the limit,
        # so that the root is bracketed. With Mises' function it is q/3G, as in J2.
        over, most = q - at.J * was, q / (2.0 * G * hill.softest())
        inside = over < 0.0
        # As in J2, a point inside the surface that is made to flow flows back.
        low, high, start = where(inside, -most, 0.0), where(inside, 0.0, most), over / (6.0 * G)

        def beyond(x: Node, *args: Node) -> Node:
            s, (G, J, strain, dt), own = args[:3], args[3:7], Coefficients(*args[7:11])
            limit = J * curve._replace(p=args[11:]).stress(strain + x, x, dt)
            return own.equivalent(own.returned(s, 2.0 * G * x / limit)) - limit  # type: ignore[arg-type]

        active = at.flowing(over > ON_SURFACE * q)
        args = *s, G, at.J, strain, at.dt, *hill, *curve.p
        rise = root(beyond, active, start, low, high, q, *args, smooth=False)
        now = at.flow_stress(strain + rise, rise)
        left = hill.returned(s, 2.0 * G * rise / (at.J * now))
        less = [x / (2.0 * G) - y for x, y in zip(left, (d.xx, d.yy, d.xy))]
        # Flow keeps the volume, from which its component across the plane follows.
        plastic = Tensor(-less[0], -less[1], less[0] + less[1], -less[2])
        elastic = trial - Tensor(*(where(differs(rise, 0.0), x, 0.0) for x in plastic))
        work = work + 0.5 * (at.J_n * was + at.J * now) * rise
        return elastic, (strain + rise, work)
