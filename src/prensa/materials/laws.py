"""Materials as the solver sees them: batch laws of h = f − I and their own history, pure, with exact tangents.

An isotropic law is written in principal strains only; the spectral kernels of `prensa.kernels.tensor`, in three dimensions
of `prensa.kernels.spatial`, wrap it for small and finite strain. Tensors have the c components, and histories begin with the
k symmetric ones, of the law's `TensorLayout`: 5 and 4 in the plane, 9 and 6 in space. Adding one: a kernel, a class here, a
line in `material_of`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from prensa.kernels import spatial, tensor
from prensa.layout import PLANE, SPATIAL, TensorLayout
from prensa.materials import elastic
from prensa.materials.hardening import FlowParameters, flow_parameters, flow_stresses
from prensa.materials.j2 import j2
from prensa.materials.plane_stress import PlaneStress
from prensa.model import problem as model

Array = NDArray[np.float64]


class At(NamedTuple):
    """Context of an update: duration ``dt`` of the increment, ``time`` at its end, whether the ``tangent`` is wanted."""

    dt: float
    time: float
    tangent: bool = True


class Out(NamedTuple):
    """Receives P (n, c) per committed volume, A (n, c, c) = ∂P/∂f if asked for, new history (n, h), failed (n,) flags."""

    P: Array
    A: Array
    new: Array
    failed: NDArray[np.bool_]


class Material(Protocol):
    """A pure law. Laws of isotropic elasticity use history 0 … k−1 for b_e − I (finite) or the elastic strain (small)."""

    @property
    def layout(self) -> TensorLayout:
        """Components of its tensors."""

    @property
    def size(self) -> int:
        """Length h of the history; it starts as zeros."""

    @property
    def plastic(self) -> bool:
        """Whether history k and k + 1 are the equivalent plastic strain and the plastic work per initial volume."""

    @property
    def symmetric(self) -> bool:
        """Whether A (n, c, c) is symmetric at every state."""

    @property
    def E(self) -> float:
        """Young's modulus."""

    @property
    def nu(self) -> float:
        """Poisson's ratio."""

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, h) committed history → out."""

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""

    def cauchy(self, history: Array) -> Array:
        """Cauchy stress xx, yy, zz, xy (in space xz, yz too) from a committed history, (n, h) → (n, k)."""

    def modulus(self) -> float:
        """Elastic modulus E* = E/(1 − ν²) (plane stress: E), the stiffness scale of contact."""

    def thickness(self, history: Array) -> Array | None:
        """Thickness over the initial one in plane stress, (..., h) → (...); None where it does not change."""


_KERNELS: dict[TensorLayout, Any] = {PLANE: tensor, SPATIAL: spatial}
"""Modules of the same functions for each layout."""


@dataclass(frozen=True)
class _Isotropic:
    """Spectral wrapping of a law in principal strains."""

    E: float
    nu: float
    finite: bool
    plastic: bool = field(default=False, init=False)
    layout: TensorLayout = field(default=PLANE, kw_only=True)

    @property
    def size(self) -> int:
        """Columns of the history: b_e − I or the elastic strain."""
        return self.layout.kept

    @property
    def symmetric(self) -> bool:
        """True: stresses derive from an energy."""
        return True

    def thickness(self, history: Array) -> Array | None:
        """None: the law does not change the thickness that the element integrates over."""
        return None

    @property
    def lam(self) -> float:
        return self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))

    @property
    def mu(self) -> float:
        return self.E / (2 * (1 + self.nu))

    def modulus(self) -> float:
        """Plane-strain modulus E/(1 − ν²)."""
        return self.E / (1 - self.nu**2)

    def principal(
        self, eps: Array, frame: Array, old: Array, at: At, tau: Array, dtau: Array, eps_e: Array, out: Out
    ) -> None:
        """The law itself: trial principal strains (n, 3) → stresses, slopes, elastic strains."""
        elastic.hencky(eps, self.lam, self.mu, tau, dtau, eps_e)

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, h) → out; see `Material`."""
        n, kernels = len(h), _KERNELS[self.layout]
        eps, tau, eps_e = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
        frame, dtau = np.empty((n, kernels.FRAME)), np.empty((n, 3, 3))
        trial = kernels.trial_finite if self.finite else kernels.trial_small
        trial(h, old, eps, frame, out.failed)
        self.principal(eps, frame, old, at, tau, dtau, eps_e, out)
        stress = kernels.stress_finite if self.finite else kernels.stress_small
        stress(h, frame, tau, dtau, eps_e, out.P, out.A, out.new, at.tangent)

    def elastic_strains(self, history: Array) -> Array:
        """Principal elastic strains (..., 3) of a committed history."""
        out = np.empty((*history.shape[:-1], 3))
        strains = _KERNELS[self.layout].elastic_strains
        strains(history.reshape(-1, history.shape[-1]), self.finite, out.reshape(-1, 3))
        return out

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""
        return elastic.quadratic_energy(self.elastic_strains(history), self.lam, self.mu)

    def cauchy(self, history: Array) -> Array:
        """Cauchy stress (n, k) xx, yy, zz, xy[, xz, yz]: the law at rest (h = 0) on the committed history."""
        n, c = len(history), self.layout.components
        out = Out(np.empty((n, c)), np.empty((n, c, c)), np.empty_like(history), np.zeros(n, dtype=np.bool_))
        self.update(np.zeros((n, c)), history, At(1.0, 0.0, tangent=False), out)
        return out.P[:, self.layout.cauchy]


@dataclass(frozen=True)
class Hencky(_Isotropic):
    """Linear elasticity: Hooke's law in small strain, Hencky's in finite strain."""

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, k) → out; see `Material`."""
        if self.finite:
            super().update(h, old, at, out)
        else:
            hooke = elastic.hooke_spatial if self.layout.dimension == 3 else elastic.hooke
            hooke(h, old, self.lam, self.mu, out.P, out.A, out.new)


@dataclass(frozen=True)
class NeoHooke(_Isotropic):
    """Compressible neo-Hooke."""

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, k) → out; see `Material`."""
        neo_hooke = elastic.neo_hooke_spatial if self.layout.dimension == 3 else elastic.neo_hooke
        neo_hooke(h, old, self.lam, self.mu, out.P, out.A, out.new, out.failed, at.tangent)

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""
        return elastic.neo_hooke_energy(self.elastic_strains(history), self.lam, self.mu)


@dataclass(frozen=True)
class StVenantKirchhoff(_Isotropic):
    """St. Venant-Kirchhoff."""

    def principal(
        self, eps: Array, frame: Array, old: Array, at: At, tau: Array, dtau: Array, eps_e: Array, out: Out
    ) -> None:
        """Trial principal strains (n, 3) → stresses, slopes, elastic strains."""
        elastic.st_venant_kirchhoff(eps, self.lam, self.mu, tau, dtau, eps_e)

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""
        return elastic.quadratic_energy(0.5 * np.expm1(2.0 * self.elastic_strains(history)), self.lam, self.mu)


@dataclass(frozen=True)
class J2(_Isotropic):
    """Von Mises plasticity; history columns k, k + 1: equivalent plastic strain, plastic work per initial volume."""

    flow: FlowParameters = field(default=None, repr=False)  # type: ignore[assignment]
    yield_on_cauchy: bool = True
    plastic: bool = field(default=True, init=False)

    @property
    def size(self) -> int:
        """Columns of the history: b_e − I or the elastic strain, plastic strain, plastic work."""
        return self.layout.kept + 2

    @property
    def symmetric(self) -> bool:
        """Unless the limit is one of the Cauchy stress in finite strain, which makes flow depend on the volume."""
        return not (self.finite and self.yield_on_cauchy)

    def principal(
        self, eps: Array, frame: Array, old: Array, at: At, tau: Array, dtau: Array, eps_e: Array, out: Out
    ) -> None:
        """Trial principal strains (n, 3) → stresses, slopes, elastic strains, plastic strain and work."""
        f = self.flow
        bulk = self.E / (3 * (1 - 2 * self.nu))
        j2(
            eps, frame[:, -1], old, self.layout.kept, bulk, self.mu, self.finite and self.yield_on_cauchy,
            f.kind, f.p, f.knots, f.coefficients, at.dt, tau, dtau, eps_e, out.new, out.failed, at.tangent,
        )  # fmt: skip

    def shear_strength(self, history: Array) -> Array:
        """Shear yield stress k = σ_y/√3 (n,), a Cauchy stress, of a committed history (n, h) at rest."""
        f, out = self.flow, np.empty(len(history))
        flow_stresses(f.kind, f.p, f.knots, f.coefficients, np.ascontiguousarray(history[:, self.layout.kept]), out)
        if self.finite and not self.yield_on_cauchy:
            out /= np.exp(self.elastic_strains(history).sum(axis=-1))  # plastic flow is isochoric
        return out / np.sqrt(3.0)

    def cauchy(self, history: Array) -> Array:
        """Cauchy stress (n, k) from the elastic strains alone (a rate-dependent law at rest would flow)."""
        elastic_part = np.ascontiguousarray(history[:, : self.layout.kept])
        return Hencky(self.E, self.nu, self.finite, layout=self.layout).cauchy(elastic_part)


def material_of(description: Any, kinematics: str, space: str = "plane strain") -> Material:
    """The law of a material description in ``small`` or ``finite`` kinematics.

    ``plane stress``: with its adaptor; ``3d``: with the tensors of three dimensions; else those of the plane.
    """
    finite, layout = kinematics == "finite", SPATIAL if space == "3d" else PLANE
    law: Material
    match description:
        case model.Elastic():
            law = Hencky(description.E, description.nu, finite, layout=layout)
        case model.NeoHooke():
            law = NeoHooke(description.E, description.nu, finite, layout=layout)
        case model.StVenantKirchhoff():
            law = StVenantKirchhoff(description.E, description.nu, finite, layout=layout)
        case model.J2():
            flow = flow_parameters(description.flow)
            on_cauchy = description.yield_on == "cauchy"
            law = J2(description.E, description.nu, finite, flow, on_cauchy, layout=layout)
        case _:
            raise TypeError(f"unknown material {description!r}")
    return PlaneStress(law, finite) if space == "plane stress" else law
