"""Archard's law of wear.

Archard (1953), J. Appl. Phys. 24, 981, eq. 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from prensa.friction.wear_law import Sliding, WearLaw
from prensa.model.units import Length, Number, Pressure
from prensa.types import Array


class Archard(WearLaw):
    """Wear of a tool by Archard's law (1953), a depth of (k/H) ∫ p ds: his coefficient ``k`` and the ``hardness`` H of the tool.

    ``depth``: permitted depth, from which the number of parts follows. Without ``k`` and ``hardness`` (``relative``) wear is ∫ p
    ds, to be compared between places and designs.
    """

    k: Annotated[Number, Field(gt=0)] | None = None
    hardness: Annotated[Pressure, Field(gt=0)] | None = None
    depth: Annotated[Length, Field(gt=0)] | None = None
    type: Literal["archard"] = "archard"

    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({}, {"k": 1e-5, "hardness": 6000.0, "depth": 0.05})

    @model_validator(mode="after")
    def _check(self) -> Archard:
        if (self.k is None) != (self.hardness is None):
            raise ValueError("give both 'k' and 'hardness', or neither for relative wear")
        if self.depth is not None and self.k is None:
            raise ValueError("'depth' needs 'k' and 'hardness': relative wear says nothing of depths")
        return self

    @property
    def relative(self) -> bool:
        """Whether wear is ∫ p ds, without k/H."""
        return self.k is None

    def rate(self, at: Sliding) -> Array:
        """(k/H) p v."""
        return (1.0 if self.k is None or self.hardness is None else self.k / self.hardness) * at.pressure * at.speed
