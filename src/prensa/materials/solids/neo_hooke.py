"""Compressible neo-Hooke: rubber-like stretches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field

from prensa.materials.material import Material, PoissonRatio
from prensa.model.units import Pressure

if TYPE_CHECKING:
    from prensa.materials.laws import Material as Law


class NeoHooke(Material):
    """Compressible neo-Hooke, ψ = μ/2 (I₁ − 3) − μ ln J + λ/2 (ln J)² (finite strain only).

    ``E``: Young's modulus, ``nu``: Poisson's ratio.
    """

    E: Annotated[Pressure, Field(gt=0)]
    nu: PoissonRatio
    type: Literal["neo_hooke"] = "neo_hooke"

    kinematics: ClassVar[tuple[str, ...]] = ("finite",)

    def bulk_law(self, finite: bool, **tensors: Any) -> Law:
        """The law of that energy."""
        from prensa.materials.laws import NeoHooke

        return NeoHooke(self.E, self.nu, finite, **tensors)
