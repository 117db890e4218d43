"""Rice & Tracey's growth of a spherical void.

Rice & Tracey (1969), J. Mech. Phys. Solids 17, 201-217; the cut-off: Bao & Wierzbicki (2005), Eng. Fract. Mech. 72, 1049-1069.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.materials.damage_law import DamageLaw, StressState
from prensa.model.units import Number
from prensa.precision import ROUND_OFF
from prensa.types import Array


class RiceTracey(DamageLaw):
    """Rice & Tracey's (1969) growth of a void, D = ∫ c exp(1.5 σ_m/σ̄) dε̄.

    ``c``: factor; with 0.283, Rice and Tracey's, D is ln(R/R_0) of a void's radius, with 1 the integral that is often tabled.
    ``cut_off``: stress triaxiality σ_m/σ̄ up to which nothing grows, −1/3 (Bao & Wierzbicki 2005). ``limit``: a number.
    """

    c: Annotated[Number, Field(gt=0)] = 1.0
    cut_off: Number = -1.0 / 3.0
    type: Literal["rice_tracey"] = "rice_tracey"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({}, {"c": 0.283, "cut_off": -1.0})
    title: ClassVar[str] = "Rice-Tracey"

    def rate(self, at: StressState) -> Array:
        """The integrand beyond the cut-off."""
        ratio = at.triaxiality
        # within round-off of it too: compression, at −1/3, is on the default
        beyond = ratio > self.cut_off + ROUND_OFF
        return np.where(beyond, self.c * np.exp(1.5 * np.where(beyond, ratio, 0.0)), 0.0)
