"""Sections of bent metal: bending moments of layers of the default element and of the material.

Beyond yield the error of few layers is another than that of the elastic stiffness (`bending.stiffness_errors`): their points are
not at the skin, so that they yield later, and the parasitic shear strain yields with them. Strains are those of a beam whose
section stays plane; stresses follow from the total strain by the secant modulus (Hencky's deformation theory), with the effective
Poisson's ratio ν_s = ½ − (½ − ν) E_s/E. Bending is taken to be monotonic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from prensa.types import Array

PLASTIC_STRAINS = np.concatenate([[0.0], np.logspace(-7.0, 1.0, 400)])
"""Plastic strains at which a flow curve is tabulated."""
SECTION = (np.arange(100) + 0.5) / 200
"""Points across half a section of the material, of a thickness of 1: the moment is right to 1e-4."""


class Ways(NamedTuple):
    """How layers of the default element bend, as coefficients (s, 1) of the strain energy c² of a strain for κ = 1.

    c² = ``own`` y² + 2 ``both`` y y' + ``kept`` y'² + ``shear`` x² at a distance y' from the middle y of a layer, x along it;
    ``uniaxial`` c is the strain of a tensile test of the same von Mises stress.
    """

    own: Array
    both: Array
    kept: Array
    shear: Array
    uniaxial: Array


@dataclass(frozen=True)
class BentMetal:
    """A metal of Young's modulus E and Poisson's ratio ν with a flow stress ``flow`` (k,) at plastic strains (k,).

    ``space``: that of a problem: plane stress, in which the material is free to move along its width, plane strain, in which that
    is held, axisymmetric or solid, where a plate bends along two ways.
    """

    E: float
    nu: float
    flow: Callable[[Array], Array]
    space: str

    @cached_property
    def _total(self) -> Array:
        """Strains of the tensile test at the plastic strains `PLASTIC_STRAINS`."""
        return PLASTIC_STRAINS + self.flow(PLASTIC_STRAINS) / self.E

    def moments(self, bend: Array, ways: Array) -> Array:
        """Moment (s,) over the square of the thickness, of sections of relative curvature ``bend`` = κ t ≥ 0 (s,).

        ``ways`` (s, w): shares of κ along each way, whose squares add up to 1.
        """
        return self._moments(bend, ways, lambda w: w.own * SECTION**2)

    def moments_of_layers(self, bend: Array, ways: Array, layers: Array, lengths: Array) -> Array:
        """The same of ``layers`` (s,) of the default element, ``lengths`` (s, w) long over the thickness; 0 along a hoop."""
        out = np.empty(len(bend))
        for n in np.unique(layers):
            own = np.flatnonzero(layers == n)
            at = 0.5 / np.sqrt(3.0)
            y = np.repeat((np.arange(int(n)) + 0.5) / n - 0.5, 2)
            inner, x2 = np.tile([at / n, -at / n], int(n)), ((at * ways[own] * lengths[own]) ** 2).sum(axis=1)[:, None]

            def squared(w: Ways, y: Array = y, inner: Array = inner, x2: Array = x2) -> Array:
                return np.maximum(w.own * y**2 + 2.0 * w.both * y * inner + w.kept * inner**2 + w.shear * x2, 0.0)

            out[own] = self._moments(bend[own], ways[own], squared)
        return out

    def _moments(self, bend: Array, ways: Array, squared: Callable[[Ways], Array]) -> Array:
        """Mean of E_s' c² κ t over p points; ``squared``: c² (s, p), of strains for κ t = 1."""
        nu, last = np.full((len(bend), 1), self.nu), np.full((len(bend), 1), np.inf)
        while not np.allclose(nu, last, equal_nan=True):  # modulus and ν_s change each other by a tenth at most
            w, last = self._ways(ways, nu), nu
            modulus, nu = self._secant(bend[:, None] * np.sqrt(squared(w)) * w.uniaxial, nu)
        return np.asarray((modulus * squared(self._ways(ways, nu))).mean(axis=1) * bend)

    def _ways(self, ways: Array, nu: Array) -> Ways:
        """Of curvatures along ``ways`` (s, w), for ν_s (s, 1|p).

        The shear strain x has the part G/E' of the energy. Of the bending y' of a layer F-bar keeps the part without the mean of
        its strains along the axes of the problem, which does its work with the stress of y; `q4` in plane stress, held along y,
        keeps all.
        """
        if self.space == "plane stress":
            one = np.ones_like(nu)
            return Ways(one, one, 1.0 / (1.0 - nu**2), 0.5 / (1.0 + nu), one)
        first, second = ways[:, :1], ways[:, 1:] if ways.shape[1] == 2 else np.zeros_like(ways)
        mean = (first + second) / (ways.shape[1] + 1)
        left = first - mean, second - (mean if ways.shape[1] == 2 else 0.0)  # and −mean along the thickness
        stress = first + nu * second, second + nu * first  # over E' = E/(1 − ν²)
        own = first * stress[0] + second * stress[1]
        mises = stress[0] ** 2 - stress[0] * stress[1] + stress[1] ** 2
        return Ways(
            own, left[0] * stress[0] + left[1] * stress[1], (1.0 - nu) * (left[0] ** 2 + left[1] ** 2 + mean**2),
            0.5 * (1.0 - nu) + 0.0 * own, np.sqrt(mises / own) / (1.0 - nu**2),
        )  # fmt: skip

    def _secant(self, strain: Array, nu: Array) -> tuple[Array, Array]:
        """Secant modulus E_s' and ν_s (s, p) at strains ≥ 0 of the tensile test, for ν_s of the last iteration."""
        total = self._total
        yields = strain > total[0]
        stress = np.interp(strain, total, (total - PLASTIC_STRAINS) * self.E)
        modulus = np.where(yields, stress / np.where(yields, strain, 1.0), self.E)
        effective = 0.5 - (0.5 - self.nu) * modulus / self.E
        return (modulus if self.space == "plane stress" else modulus / (1.0 - effective**2)), effective
