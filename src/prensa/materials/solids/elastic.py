"""Isotropic linear elasticity: Hooke's law, and Hencky's in finite strain."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from prensa.materials.material import Material, PoissonRatio
from prensa.model.units import Pressure

if TYPE_CHECKING:
    from prensa.materials.laws import Material as Law


class Elastic(Material):
    """Isotropic elasticity: Hooke in small strain, Hencky (quadratic in logarithmic strain) in finite strain.

    ``E``: Young's modulus, ``nu``: Poisson's ratio.
    """

    E: Annotated[Pressure, Field(gt=0)]
    nu: PoissonRatio
    type: Literal["elastic"] = "elastic"

    def bulk_law(self, finite: bool, **tensors: Any) -> Law:
        """Hooke's law or Hencky's."""
        from prensa.materials.laws import Hencky

        return Hencky(self.E, self.nu, finite, **tensors)
