"""McClintock's growth of cylindrical holes.

McClintock (1968), J. Appl. Mech. 35, 363-371.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.materials.damage_law import StrainDriven, StressState
from prensa.model.units import Number
from prensa.types import Array


class McClintock(StrainDriven):
    """McClintock's (1968) growth of cylindrical holes across the two greatest principal stresses.

    D = ∫ ⟨√3/(2 (1 − n)) sinh(√3 (1 − n)/2 · (σ_1 + σ_2)/σ̄) + ¾ (σ_1 − σ_2)/σ̄⟩ dε̄, the growth of the longer axis of their
    section. ``n``: hardening exponent of σ̄ = K ε̄ⁿ. ``heals``: damage falls where the integrand is negative, as holes close;
    without it nothing grows there. ``limit``: a number.
    """

    n: Annotated[Number, Field(ge=0, lt=1)]
    heals: bool = False
    type: Literal["mcclintock"] = "mcclintock"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({"n": 0.2}, {"n": 0.2, "heals": True})
    title: ClassVar[str] = "McClintock"

    def signed(self, at: StressState) -> Array:
        """The rate at which holes grow."""
        half = 0.5 * np.sqrt(3.0) * (1.0 - self.n)
        opening = 0.75 / half * np.sinh(half * (at.first + at.second) / at.equivalent)
        return np.asarray(opening + 0.75 * (at.first - at.second) / at.equivalent)
