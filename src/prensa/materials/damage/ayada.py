"""Ayada's criterion.

Ayada, Higashino & Mori (1987), Adv. Technol. Plast. 1, 553-558 (central bursting in extrusion).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from prensa.materials.damage_law import StrainDriven, StressState
from prensa.types import Array


class Ayada(StrainDriven):
    """Ayada's criterion (1987), D = ∫ ⟨σ_m/σ̄⟩ dε̄, for bursting along the axis of extruded and drawn bars.

    ``heals``: damage falls under mean compression; without it nothing grows there. ``limit``: a number.
    """

    heals: bool = False
    type: Literal["ayada"] = "ayada"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({}, {"heals": True})
    title: ClassVar[str] = "Ayada"

    def signed(self, at: StressState) -> Array:
        """σ_m/σ̄."""
        return at.triaxiality
