"""Cockcroft & Latham's criterion, not normalised.

Cockcroft & Latham (1968), J. Inst. Metals 96, 33-39.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from prensa.materials.damage_law import DamageLaw, StressState
from prensa.types import Array


class CockcroftLathamPlain(DamageLaw):
    """Cockcroft & Latham's (1968) criterion, the work of the greatest tensile stress per volume, D = ∫ ⟨σ_1⟩ dε̄.

    ``limit``: a stress.
    """

    type: Literal["cockcroft_latham_plain"] = "cockcroft_latham_plain"

    of_stress: ClassVar[bool] = True
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)
    title: ClassVar[str] = "Cockcroft-Latham"

    def rate(self, at: StressState) -> Array:
        """⟨σ_1⟩."""
        return np.maximum(at.first, 0.0)
