"""Sections of bent metal: bending moments of layers of the default element and of the material, in the plane.

Beyond yield the error of few layers is another than that of the elastic stiffness (`bending.stiffness_errors`): their points are
not at the skin, so that they yield later, and the parasitic shear strain yields with them. Strains are those of a beam whose
section stays plane; stresses follow from the total strain by the secant modulus (Hencky's deformation theory), with the effective
Poisson's ratio ν_s = ½ − (½ − ν) E_s/E. Bending is taken to be monotonic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from prensa.types import Array

PLASTIC_STRAINS = np.concatenate([[0.0], np.logspace(-7.0, 1.0, 400)])
"""Plastic strains at which a flow curve is tabulated."""
SECTION = (np.arange(100) + 0.5) / 200
"""Points across half a section of the material, of a thickness of 1: the moment is right to 1e-4."""


@dataclass(frozen=True)
class BentMetal:
    """A metal of Young's modulus E and Poisson's ratio ν with a flow stress ``flow`` (k,) at plastic strains (k,).

    ``stress_free``: whether the material is free to move along its width (plane stress), else that is held (plane strain).
    """

    E: float
    nu: float
    flow: Callable[[Array], Array]
    stress_free: bool

    @cached_property
    def _total(self) -> Array:
        """Strains of the tensile test at the plastic strains `PLASTIC_STRAINS`."""
        return PLASTIC_STRAINS + self.flow(PLASTIC_STRAINS) / self.E

    def moments(self, bend: Array) -> Array:
        """Moment (s,) over the square of the thickness, of sections of relative curvature ``bend`` = κ t ≥ 0 (s,)."""
        shares = np.broadcast_to(SECTION**2, (len(bend), len(SECTION)))
        return self._moments(bend, lambda nu: shares)

    def moments_of_layers(self, bend: Array, layers: Array, length: Array) -> Array:
        """The same of ``layers`` (s,) of the default element, ``length`` (s,) long over the thickness.

        A point at x along its element and y' from the middle y of its layer has, for κ = 1, the strain energy of the strain c:
        c² = y² + 2 k y y' + q y'² + g x². The shear strain x has the part g = G/E' of it. Of the bending y' of the layer
        F-bar keeps the deviatoric part, q = (1 − ν)/2, which does the work k = ½ with the stress of y; `q4` in plane stress,
        held along y, keeps all.
        """
        out = np.empty(len(bend))
        for n in np.unique(layers):
            own = np.flatnonzero(layers == n)
            at = 0.5 / np.sqrt(3.0)
            y = np.repeat((np.arange(int(n)) + 0.5) / n - 0.5, 2)
            inner, x2 = np.tile([at / n, -at / n], int(n)), (at * length[own, None]) ** 2

            def squared(nu: Array, y: Array = y, inner: Array = inner, x2: Array = x2) -> Array:
                kept, with_y = (1.0 / (1.0 - nu**2), 1.0) if self.stress_free else ((1.0 - nu) / 2.0, 0.5)
                shear = 1.0 / (2.0 * (1.0 + nu)) if self.stress_free else (1.0 - nu) / 2.0
                return np.maximum(y**2 + 2.0 * with_y * y * inner + kept * inner**2 + shear * x2, 0.0)

            out[own] = self._moments(bend[own], squared)
        return out

    def _moments(self, bend: Array, squared: Callable[[Array], Array]) -> Array:
        """Mean of E_s' c² κ t over p points; ``squared``: c² (s, p), of strains for κ t = 1, for ν_s (s, 1|p)."""
        nu, last = np.full((len(bend), 1), self.nu), np.full((len(bend), 1), np.inf)
        while not np.allclose(nu, last, equal_nan=True):  # modulus and ν_s change each other by a tenth at most
            c2, last = squared(nu), nu
            modulus, nu = self._secant(bend[:, None] * np.sqrt(c2), nu)
        return np.asarray((modulus * squared(nu)).mean(axis=1) * bend)

    def _secant(self, strain: Array, nu: Array) -> tuple[Array, Array]:
        """Secant modulus along a bent section and ν_s (s, p) at its strains ≥ 0, for ν_s of the last iteration."""
        total = self._total
        uniaxial = strain if self.stress_free else strain * np.sqrt(1.0 - nu + nu**2) / (1.0 - nu**2)
        yields = uniaxial > total[0]
        stress = np.interp(uniaxial, total, (total - PLASTIC_STRAINS) * self.E)
        modulus = np.where(yields, stress / np.where(yields, uniaxial, 1.0), self.E)
        effective = 0.5 - (0.5 - self.nu) * modulus / self.E
        return (modulus if self.stress_free else modulus / (1.0 - effective**2)), effective
