"""Hill's orthotropic yield function of 1948 with isotropic hardening: the law at a point, in plane and space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from prensa.kernels.record import Node, differs, root, sqrt, where
from prensa.layout import PLANE, TensorLayout
from prensa.materials.corotational import Tensor
from prensa.materials.hencky_j2 import NO_STRAIN, ON_SURFACE
from prensa.materials.point_material import PointAt, PointMaterial
from prensa.types import Array


class Coefficients(NamedTuple):
    """Of σ̄² = F (σ22 − σ33)² + G (σ33 − σ11)² + H (σ11 − σ22)² + 2 N σ12² + 2 M σ13² + 2 L σ23².

    Source: Hill 1948, Proc. R. Soc. Lond. A 193, 281-297. Deviators s have the components 11, 22, 12, in space 13, 23 too.
    """

    F: Node
    G: Node
    H: Node
    N: Node
    M: Node
    L: Node

    def equivalent(self, s: Sequence[Node]) -> Node:
        """σ̄ of a deviator."""
        a, b = 2.0 * s[1] + s[0], 2.0 * s[0] + s[1]
        square = self.F * a * a + self.G * b * b + self.H * (s[0] - s[1]) * (s[0] - s[1])
        for of, shear in zip(self[3:], s[2:]):
            square = square + 2.0 * of * shear * shear
        return sqrt(square + NO_STRAIN)

    def returned(self, s: Sequence[Node], k: Node) -> tuple[Node, ...]:
        """The deviator d of d + k ∂(½ σ̄²)/∂σ = s; k: 2G times the plastic strain over σ̄."""
        F, G, H = self[:3]
        a, b, c, d = 2.0 * G + H, G - H, F - H, 2.0 * F + H
        over = 1.0 / (1.0 + k * (a + d) + k * k * (a * d - b * c))
        shears = (shear / (1.0 + k * of) for of, shear in zip(self[3:], s[2:]))
        return (s[0] + k * (d * s[0] - b * s[1])) * over, (s[1] + k * (a * s[1] - c * s[0])) * over, *shears

    def softest(self, shears: int) -> Node:
        """Least eigenvalue of the map from deviators of so many shears to ∂(½ σ̄²)/∂σ; 3/2 of Mises' function."""
        F, G, H = self[:3]
        mean = F + G + H
        least = mean - sqrt(mean * mean - 3.0 * (F * G + G * H + H * F) + NO_STRAIN)
        for of in self[3 : 3 + shears]:
            least = where(least < of, least, of)
        return least


class HillMetal(PointMaterial):
    """The law of `prensa.materials.solids.hill.Hill`, whose fields it has.

    Hencky's elasticity, associated flow, isotropic hardening; ``first`` and ``second`` material axis in space.
    """

    E: float
    nu: float
    flow: Any
    F: float
    G: float
    H: float
    N: float
    M: float
    L: float
    angle: float
    first: tuple[float, float, float]
    second: tuple[float, float, float]

    offered: ClassVar[bool] = False
    plastic: ClassVar[bool] = True
    directed: ClassVar[bool] = True
    variables: ClassVar[tuple[str, ...]] = ("plastic_strain", "plastic_work")

    def axes(self, X: Array) -> Array:
        """The angle everywhere."""
        return np.full(len(X), self.angle)

    def directions(self, X: Array) -> Array:
        """The same everywhere."""
        return np.broadcast_to(np.array([self.first, self.second]), (len(X), 2, 3))

    def shear_strength(self, flow_stress: Array, layout: TensorLayout) -> Array:
        """The least one along its axes: σ_y/√(2N), in space of the largest of N, M, L."""
        most = self.N if layout is PLANE else max(self.N, self.M, self.L)
        return np.asarray(flow_stress / np.sqrt(2.0 * most))

    def _coefficients(self) -> Coefficients:
        return Coefficients(self.F, self.G, self.H, self.N, self.M, self.L)  # type: ignore[arg-type]

    def equivalent(self, stress: Tensor) -> Any:
        """Hill's."""
        return self._coefficients().equivalent(_without_third(stress.deviator))

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
        s, hill = tuple(2.0 * G * x for x in _without_third(d)), self._coefficients()
        q, was, n = hill.equivalent(s), at.flow_stress(strain), len(s)
        # σ̄ of the returned stress is at most q/(1 + k m), m the least eigenvalue: at a rise of q/(2G m) that is below the limit,
        # so that the root is bracketed. With Mises' function it is q/3G, as in J2.
        over, most = q - at.J * was, q / (2.0 * G * hill.softest(trial.shears))
        inside = over < 0.0
        # As in J2, a point inside the surface that is made to flow flows back.
        low, high, start = where(inside, -most, 0.0), where(inside, 0.0, most), over / (6.0 * G)

        def beyond(x: Node, *args: Node) -> Node:
            s, (G, J, strain, dt), own = args[:n], args[n : n + 4], Coefficients(*args[n + 4 : n + 10])
            limit = J * curve._replace(p=args[n + 10 :]).stress(strain + x, x, dt)
            return own.equivalent(own.returned(s, 2.0 * G * x / limit)) - limit

        active = at.flowing(over > ON_SURFACE * q)
        args = *s, G, at.J, strain, at.dt, *hill, *curve.p
        rise = root(beyond, active, start, low, high, q, *args, smooth=False)
        now = at.flow_stress(strain + rise, rise)
        left = hill.returned(s, 2.0 * G * rise / (at.J * now))
        less = [y - x / (2.0 * G) for x, y in zip(left, _without_third(d))]
        # Flow keeps the volume, from which its component along the third axis follows.
        plastic = less[0], less[1], -less[0] - less[1], *less[2:]
        elastic = trial - Tensor(*(where(differs(rise, 0.0), x, 0.0) for x in plastic))
        work = work + 0.5 * (at.J_n * was + at.J * now) * rise
        return elastic, (strain + rise, work)


def _without_third(d: Tensor) -> tuple[Node, ...]:
    """Components of a deviator but for that along the third axis."""
    return d.xx, d.yy, *d.components[3:]
