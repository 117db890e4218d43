"""Materials: a description that makes its law. One of one's own, isotropic and elastic, states an energy.

It derives from `IsotropicMaterial`; derivatives that it does not give are found by the complex step::

    class Ogden(pr.IsotropicMaterial):
        E: float
        nu: float
        alpha: float

        def energy(self, eps):
            mu, bulk = self.E / (2 * (1 + self.nu)), self.E / (3 * (1 - 2 * self.nu))
            mean = eps.sum(axis=1, keepdims=True) / 3
            stretches = np.exp(self.alpha * (eps - mean)).sum(axis=1) - 3
            return 2 * mu / self.alpha**2 * stretches + 4.5 * bulk * mean[:, 0] ** 2
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from prensa.derivatives import complex_value
from prensa.layout import PLANE, SPATIAL
from prensa.materials.protocol import Material as Law
from prensa.model.doors import Member
from prensa.model.units import Number
from prensa.precision import COMPLEX_STEP, FIRST_DIFFERENCE, SECOND_DIFFERENCE
from prensa.types import Array

PoissonRatio = Annotated[Number, Field(gt=-1.0, lt=0.5)]

PATH_POINTS = np.polynomial.legendre.leggauss(12)


class Material(Member, abstract=True):
    """Base of all materials. A description is frozen; its annotated fields are keys of the case file."""

    door: ClassVar[str] = "material"
    kinematics: ClassVar[tuple[str, ...]] = ("small", "finite")
    """Kinematics in which the law has a meaning."""
    plastic: ClassVar[bool] = False
    """Whether it has a flow stress, to which laws of friction may refer."""

    in_space: ClassVar[bool] = True
    """Whether there is a law in three dimensions."""

    def is_mirrored(self, normal: Array) -> bool:
        """Whether it is its own mirror image across planes of a unit normal (d,); True unless it has directions."""
        return True

    @property
    def modulus(self) -> float:
        """Young's modulus in the undeformed state; the scale of contact. ``E``, unless a material says otherwise."""
        return float(getattr(self, "E"))  # noqa: B009 (a field of the classes that derive from this one)

    @property
    def poisson(self) -> float:
        """Poisson's ratio in the undeformed state. ``nu``, unless a material says otherwise."""
        return float(getattr(self, "nu"))  # noqa: B009

    def law(self, kinematics: str, space: str = "plane strain") -> Law:
        """The law in ``small`` or ``finite`` kinematics.

        ``plane stress``: with its adaptor; ``solid``: with the tensors of three dimensions; else those of the plane.
        """
        from prensa.materials.plane_stress import PlaneStress

        finite = kinematics == "finite"
        law = self.bulk_law(finite, layout=SPATIAL if space == "solid" else PLANE)
        return PlaneStress(law, finite) if space == "plane stress" else law

    def bulk_law(self, finite: bool, **tensors: Any) -> Law:
        """The law of the bulk; ``tensors`` (``layout``, a `TensorLayout`) are handed on to it."""
        raise NotImplementedError(f"{type(self).__name__} has no law: define bulk_law(self, finite)")


class IsotropicMaterial(Material, abstract=True):
    """Base of isotropic elastic materials of one's own: `energy` or `stress`, or both, in principal strains.

    The strains are logarithmic in finite kinematics, ln of the principal stretches, and those of small strain in small. The
    moduli are the fields ``E`` and ``nu``, or properties ``modulus`` and ``poisson``.
    """

    symmetric: ClassVar[bool] = True
    """Whether the stress derives from an energy, so that the tangent is symmetric."""

    def energy(self, eps: Array) -> Any:
        """Stored energy per initial volume ψ (k,) at principal strains eps (k, 3). Without one: the work of `stress`."""
        # along the straight path from rest; exact where ψ is a polynomial of degree 24
        x, w = 0.5 * (1.0 + PATH_POINTS[0]), 0.5 * PATH_POINTS[1]
        return sum(wi * (principal_stress(self, xi * eps) * eps).sum(axis=1) for xi, wi in zip(x, w))

    def stress(self, eps: Array) -> Any:
        """Principal Kirchhoff stresses τ_i = ∂ψ/∂ε_i (k, 3), or (τ, ∂τ_i/∂ε_j (k, 3, 3)). Without it: from `energy`.

        Then by the complex step, exact to round-off, and the tangent by central differences of that, right to some 1e-10 of
        the modulus. An energy that takes real numbers only is differentiated by central differences: stresses are right
        to some 1e-10 and the tangent to some 1e-7 of the modulus.
        """
        return None

    def answer(self, eps: Array, tangent: bool) -> tuple[Array, Array | None]:
        """Principal stresses (k, 3) and, if asked for, their derivatives (k, 3, 3): what is stated, and else what is found."""
        return principal_stress(self, eps), principal_tangent(self, eps) if tangent else None

    def bulk_law(self, finite: bool, **tensors: Any) -> Law:
        """The law that takes its stresses from here."""
        from prensa.materials.laws import Principal

        return Principal(self.modulus, self.poisson, finite, description=self, **tensors)


def _stated(material: IsotropicMaterial, name: str) -> bool:
    return getattr(type(material), name) is not getattr(IsotropicMaterial, name)


def _spread(f: Any, eps: Array, steps: Any) -> Any:
    """Values of f at eps (k, 3) moved by each of the steps (m, 3), in one call → (m, k, …)."""
    moved = (eps[None] + np.asarray(steps)[:, None]).reshape(-1, 3)
    out = np.asarray(f(moved))
    return out.reshape(len(steps), len(eps), *out.shape[1:])


def _energy(material: IsotropicMaterial) -> Any:
    if not _stated(material, "energy"):
        raise NotImplementedError(
            f"{type(material).__name__} states neither: define energy(self, eps) or stress(self, eps)"
        )
    return material.energy


def principal_stress(material: IsotropicMaterial, eps: Array) -> Array:
    """Principal Kirchhoff stresses (k, 3) at principal strains (k, 3): the material's own, or those of its energy."""
    if _stated(material, "stress"):
        out = material.stress(eps)
        return np.asarray(out[0] if isinstance(out, tuple) else out, dtype=np.float64)
    energy = _energy(material)
    steps = np.eye(3)
    psi = complex_value(lambda s: _spread(energy, eps, s), 1j * COMPLEX_STEP * steps)
    if psi is not None:
        return np.ascontiguousarray(psi.imag.T / COMPLEX_STEP)
    psi = _spread(energy, eps, FIRST_DIFFERENCE * np.concatenate([steps, -steps]))
    return np.ascontiguousarray((psi[:3] - psi[3:]).T / (2 * FIRST_DIFFERENCE))


def principal_tangent(material: IsotropicMaterial, eps: Array) -> Array:
    """∂τ_i/∂ε_j (k, 3, 3) at principal strains (k, 3)."""
    steps = np.eye(3)
    if _stated(material, "stress"):
        out = material.stress(eps)
        if isinstance(out, tuple):
            return np.asarray(out[1], dtype=np.float64)
        tau = complex_value(lambda s: _spread(material.stress, eps, s), 1j * COMPLEX_STEP * steps)
        if tau is not None:
            return np.ascontiguousarray(tau.imag.transpose(1, 2, 0) / COMPLEX_STEP)
        tau = _spread(material.stress, eps, FIRST_DIFFERENCE * np.concatenate([steps, -steps]))
        return np.ascontiguousarray((tau[:3] - tau[3:]).transpose(1, 2, 0) / (2 * FIRST_DIFFERENCE))
    energy = _energy(material)
    shifts = FIRST_DIFFERENCE * np.concatenate([steps, -steps])
    # One step is complex and one real: hyper-dual numbers would be exact, but users' functions would have to support them.
    pairs = (shifts[:, None] + 1j * COMPLEX_STEP * steps[None]).reshape(-1, 3)
    psi = complex_value(lambda s: _spread(energy, eps, s), pairs)
    if psi is not None:
        tau = psi.imag.reshape(6, 3, len(eps)) / COMPLEX_STEP
        slope = ((tau[:3] - tau[3:]) / (2 * FIRST_DIFFERENCE)).transpose(2, 1, 0)
    else:
        both = SECOND_DIFFERENCE * np.concatenate([steps, -steps])
        psi = _spread(energy, eps, (both[:, None] + both[None]).reshape(-1, 3)).reshape(2, 3, 2, 3, len(eps))
        mixed = psi[0, :, 0] - psi[0, :, 1] - psi[1, :, 0] + psi[1, :, 1]
        slope = mixed.transpose(2, 0, 1) / (4 * SECOND_DIFFERENCE**2)
    # Differences are symmetric only up to their error, the tangent of an energy is so exactly, and LDLᵀ relies on it.
    return np.asarray(0.5 * (slope + slope.transpose(0, 2, 1)))


def material_of(description: Material, kinematics: str, space: str = "plane strain") -> Law:
    """The law of a material description, see its `law`."""
    return description.law(kinematics, space)
