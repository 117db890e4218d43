"""Freudenthal's criterion: plastic work.

Freudenthal (1950), The Inelastic Behavior of Engineering Materials and Structures, Wiley.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from prensa.materials.damage_law import DamageLaw, StressState
from prensa.types import Array


class Freudenthal(DamageLaw):
    """Freudenthal's criterion (1950), the plastic work per volume, D = ∫ σ̄ dε̄. ``limit``: a stress."""

    type: Literal["freudenthal"] = "freudenthal"

    of_stress: ClassVar[bool] = True
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)
    title: ClassVar[str] = "Freudenthal"

    def rate(self, at: StressState) -> Array:
        """The equivalent stress."""
        return at.equivalent
