"""The greatest principal stress over a strength."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.materials.damage_law import DamageLaw, StressState
from prensa.model.units import Pressure
from prensa.types import Array


class StressRatio(DamageLaw):
    """The largest that the greatest principal stress over a ``strength`` has been, D = max(σ_1, 0)/strength over time.

    Elastic states count too. ``limit``: a number, by default 1.
    """

    strength: Annotated[Pressure, Field(gt=0)]
    type: Literal["stress_ratio"] = "stress_ratio"

    usual_limit: ClassVar[float | None] = 1.0
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({"strength": 600.0},)
    title: ClassVar[str] = "σ_1 over strength"

    def grown(self, before: Array, start: StressState, end: StressState) -> Array:
        """The larger of what was and what is at the end of the increment."""
        return np.maximum(before, end.first / self.strength)
