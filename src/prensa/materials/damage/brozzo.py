"""Brozzo's criterion.

Brozzo, de Luca & Rendina (1972), Proc. 7th Biennial Conf. IDDRG, Amsterdam.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from prensa.materials.damage_law import DamageLaw, StressState
from prensa.types import Array


class Brozzo(DamageLaw):
    """Brozzo, de Luca & Rendina's criterion (1972), D = ∫ 2 ⟨σ_1⟩/(3 (σ_1 − σ_m)) dε̄, for sheets.

    In uniaxial tension D is the strain. ``limit``: a number.
    """

    type: Literal["brozzo"] = "brozzo"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)
    title: ClassVar[str] = "Brozzo"

    def rate(self, at: StressState) -> Array:
        """2 ⟨σ_1⟩/(3 (σ_1 − σ_m)); the divisor is at least σ̄/3 in plastic flow."""
        return np.asarray(2.0 * np.maximum(at.first, 0.0) / (3.0 * (at.first - at.mean)))
