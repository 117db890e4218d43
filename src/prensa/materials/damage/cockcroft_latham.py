"""Cockcroft & Latham's criterion, normalised.

Oh, Chen & Kobayashi (1979), J. Eng. Ind. 101, 36-44, after Cockcroft & Latham (1968), J. Inst. Metals 96, 33-39.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from prensa.materials.damage_law import DamageLaw, StressState
from prensa.types import Array


class CockcroftLatham(DamageLaw):
    """Cockcroft & Latham's criterion normalised by the equivalent stress (Oh et al. 1979), D = ∫ ⟨σ_1⟩/σ̄ dε̄.

    σ_1: greatest principal stress, of which only tension counts. ``limit``: a number.
    """

    type: Literal["cockcroft_latham"] = "cockcroft_latham"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)
    title: ClassVar[str] = "Cockcroft-Latham, normalised"

    def rate(self, at: StressState) -> Array:
        """⟨σ_1⟩/σ̄."""
        return np.asarray(np.maximum(at.first, 0.0) / at.equivalent)
