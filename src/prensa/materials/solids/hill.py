"""Hill's orthotropic yield function of 1948: rolled sheet. The law is in `prensa.materials.hill`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from prensa.materials.material import Material, PoissonRatio
from prensa.materials.metals import Flow, of_a_metal
from prensa.model.metals import Metal
from prensa.model.units import Angle, Number, Pressure
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.types import Array

if TYPE_CHECKING:
    from prensa.materials.laws import Material as Law

__all__ = ["Hill", "Metal"]

Positive = Annotated[Number, Field(gt=0)]
Direction = tuple[Number, Number, Number]
Strains = Annotated[tuple[Positive, Positive, Positive], Field(description="ratios at 0, 45 and 90 degrees")]


class Hill(Material):
    """Elastic-plastic, Hill's yield function of 1948 in axes that turn with the material, isotropic hardening.

    ``E``: Young's modulus, ``nu``: Poisson's ratio, ``flow``: the flow curve, which limits the Cauchy stress; with ``r`` that of
    tension along the rolling direction. ``r``: ratios of width to thickness strain in tension at 0, 45 and 90° to the rolling
    direction; or ``F``, ``G``, ``H``, ``N``, and in space ``M`` and ``L``, of σ̄² = F (σ22 − σ33)² + G (σ33 − σ11)² +
    H (σ11 − σ22)² + 2 N σ12² + 2 M σ13² + 2 L σ23² (Hill 1948, Proc. R. Soc. Lond. A 193, 281-297); 0.5 and, of the shears, 1.5
    is von Mises. ``angle``: of the rolling direction to x, where the sheet's normal is z; ``rolling``, ``normal``:
    these directions in space where they lie otherwise. ``of``: a metal that gives E, nu and flow, see J2.
    """

    E: Annotated[Pressure, Field(gt=0)]
    nu: PoissonRatio
    flow: Flow
    F: Positive | None = None
    G: Positive | None = None
    H: Positive | None = None
    N: Positive | None = None
    M: Positive = 1.5
    L: Positive = 1.5
    angle: Angle = 0.0
    r: Strains | None = None
    rolling: Direction | None = None
    normal: Direction | None = None
    of: Metal | None = None
    type: Literal["hill"] = "hill"

    plastic: ClassVar[bool] = True
    filled: ClassVar[tuple[str, ...]] = ("E", "nu", "flow")
    """Fields that ``of`` gives."""

    @model_validator(mode="before")
    @classmethod
    def _of_a_metal(cls, data: Any, info: ValidationInfo) -> Any:
        return of_a_metal(cls, data, info)

    @model_validator(mode="after")
    def _one_way(self) -> Hill:
        given = [k for k in "FGHN" if getattr(self, k) is not None]
        if self.r is not None and given:
            raise ValueError(f"'r' and {', '.join(map(repr, given))} say the same thing twice; leave one of them out")
        if self.r is None and given and len(given) < 4:
            missing = [k for k in "FGHN" if k not in given]
            raise ValueError(f"{', '.join(map(repr, missing))} missing beside {', '.join(map(repr, given))}; or give 'r' instead")
        if (self.rolling is None) != (self.normal is None):
            raise ValueError("'rolling' and 'normal' belong together: the rolling direction and the normal of the sheet")
        if self.rolling is not None and self.angle:
            raise ValueError("'angle' and 'rolling' both say where the rolling direction lies; leave one of them out")
        self._directions()
        return self

    def coefficients(self) -> dict[str, float]:
        """F, G, H, N; those of ``r`` make the flow curve that of tension along the rolling direction."""
        if self.r is not None:
            r0, r45, r90 = self.r
            G, F = 1.0 / (1.0 + r0), r0 / (r90 * (1.0 + r0))
            return {"F": F, "G": G, "H": r0 * G, "N": (r0 + r90) * (1.0 + 2.0 * r45) / (2.0 * r90 * (1.0 + r0))}
        mises = {"F": 0.5, "G": 0.5, "H": 0.5, "N": 1.5}
        return {k: getattr(self, k) if getattr(self, k) is not None else value for k, value in mises.items()}

    def _directions(self) -> Array:
        """First and second axis (2, 3) in space."""
        if self.rolling is None or self.normal is None:
            c, s = np.cos(self.angle), np.sin(self.angle)
            return np.array([[c, s, 0.0], [-s, c, 0.0]])
        first, third = np.array(self.rolling), np.array(self.normal)
        size = np.linalg.norm(first) * np.linalg.norm(third)
        if not abs(first @ third) < NEGLIGIBLE * size:
            raise ValueError(f"'rolling' {list(self.rolling)} and 'normal' {list(self.normal)} are not at right angles")
        second = np.cross(third, first)
        return np.array([a / np.linalg.norm(a) for a in (first, second)])

    def is_mirrored(self, normal: Array) -> bool:
        """Across planes at right angles to one of its axes."""
        first, second = self._directions()
        n = np.append(normal, np.zeros(3 - len(normal)))
        return bool(np.abs(np.stack([first, second, np.cross(first, second)]) @ n).max() >= 1.0 - DRAWN)

    def bulk_law(self, finite: bool, **tensors: Any) -> Law:
        """The law at a point, with all that follows from it generated."""
        from prensa.materials.hill import HillMetal

        first, second = self._directions().tolist()
        own = self.coefficients() | {"M": self.M, "L": self.L, "angle": self.angle, "first": first, "second": second}
        return HillMetal(self.E, self.nu, self.flow, **own).bulk_law(finite, **tensors)
