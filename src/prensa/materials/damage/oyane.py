"""Oyane's criterion, of pores that grow under mean tension.

Oyane (1972), Bull. JSME 15, 1507-1513; Oyane, Sato, Okimoto & Shima (1980), J. Mech. Work. Technol. 4, 65-81.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from prensa.materials.damage_law import StrainDriven, StressState
from prensa.model.units import Number
from prensa.types import Array


class Oyane(StrainDriven):
    """Oyane's criterion, D = ∫ ⟨σ_m/σ̄ + A⟩ dε̄.

    ``A``: the material's constant; the paper's ∫(1 + σ_m/(A σ̄)) dε̄ is D/A. ``heals``: damage falls where σ_m/σ̄ < −A, as pores
    close; without it nothing grows there. ``limit``: a number.
    """

    A: Number
    heals: bool = False
    type: Literal["oyane"] = "oyane"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({"A": 0.3}, {"A": 0.3, "heals": True})
    title: ClassVar[str] = "Oyane"

    def signed(self, at: StressState) -> Array:
        """σ_m/σ̄ + A."""
        return at.triaxiality + self.A
