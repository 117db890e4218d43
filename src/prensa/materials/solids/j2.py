"""Von Mises plasticity with a flow curve. The return map is in `prensa.materials.j2` and `prensa.materials.return_map`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Field

from prensa.materials.flow_curve import FlowCurve
from prensa.materials.material import Material, PoissonRatio
from prensa.model.doors import union
from prensa.model.units import Pressure

if TYPE_CHECKING:  # members are known when the program runs
    from prensa.materials.laws import Material as Law

    Flow: TypeAlias = FlowCurve
else:
    Flow = union("flow")


class J2(Material):
    """Elastic-plastic, von Mises yield, isotropic hardening; logarithmic strain in finite kinematics.

    ``E``: Young's modulus, ``nu``: Poisson's ratio, ``flow``: the flow curve.
    ``yield_on``: the stress that the flow curve limits, ``cauchy`` (true stress of a tensile test) or ``kirchhoff``.
    """

    E: Annotated[Pressure, Field(gt=0)]
    nu: PoissonRatio
    flow: Flow
    yield_on: Literal["cauchy", "kirchhoff"] = "cauchy"
    type: Literal["j2"] = "j2"

    plastic: ClassVar[bool] = True

    def bulk_law(self, finite: bool, **tensors: Any) -> Law:
        """The law with the compiled return map where the flow curve has a kernel, else with that of any curve."""
        from prensa.materials.laws import J2

        return J2(self.E, self.nu, finite, self.flow.kernel(), self.yield_on == "cauchy", curve=self.flow, **tensors)
