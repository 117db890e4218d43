"""St. Venant-Kirchhoff: Hooke's law between Green's strain and the second Piola-Kirchhoff stress."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.materials.material import Material, PoissonRatio
from prensa.model.units import Pressure

if TYPE_CHECKING:
    from prensa.materials.laws import Material as Law


class StVenantKirchhoff(Material):
    """St. Venant-Kirchhoff, ψ = λ/2 (tr E)² + μ E:E in Green's strain (finite strain only; it softens in compression).

    ``E``: Young's modulus, ``nu``: Poisson's ratio.
    """

    E: Annotated[Pressure, Field(gt=0)]
    nu: PoissonRatio
    type: Literal["svk"] = "svk"

    kinematics: ClassVar[tuple[str, ...]] = ("finite",)

    def bulk_law(self, finite: bool, **tensors: Any) -> Law:
        """The law of that energy."""
        from prensa.materials.laws import StVenantKirchhoff

        return StVenantKirchhoff(self.E, self.nu, finite, **tensors)
