"""Von Mises plasticity with a flow curve. The return map is in `prensa.materials.j2` and `prensa.materials.return_map`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, ValidationInfo, model_validator

from prensa.materials.material import Material, PoissonRatio
from prensa.materials.metals import Flow, of_a_metal
from prensa.model.metals import Metal
from prensa.model.units import Pressure

if TYPE_CHECKING:
    from prensa.materials.laws import Material as Law

__all__ = ["J2", "Metal"]


class J2(Material):
    """Elastic-plastic, von Mises yield, isotropic hardening; logarithmic strain in finite kinematics.

    ``E``: Young's modulus, ``nu``: Poisson's ratio, ``flow``: the flow curve. ``yield_on``: the stress that the flow curve
    limits, ``cauchy`` (true stress of a tensile test) or ``kirchhoff``. ``of``: a metal of the library, or your own file, that
    gives the other three; in Python in N/mm².
    """

    E: Annotated[Pressure, Field(gt=0)]
    nu: PoissonRatio
    flow: Flow
    yield_on: Literal["cauchy", "kirchhoff"] = "cauchy"
    of: Metal | None = None
    type: Literal["j2"] = "j2"

    plastic: ClassVar[bool] = True
    filled: ClassVar[tuple[str, ...]] = ("E", "nu", "flow")
    """Fields that ``of`` gives."""

    @model_validator(mode="before")
    @classmethod
    def _of_a_metal(cls, data: Any, info: ValidationInfo) -> Any:
        return of_a_metal(cls, data, info)

    def bulk_law(self, finite: bool, **tensors: Any) -> Law:
        """The law with the compiled return map where the flow curve has a kernel, else with that of any curve."""
        from prensa.materials.laws import J2

        return J2(self.E, self.nu, finite, self.flow.kernel(), self.yield_on == "cauchy", curve=self.flow, **tensors)
