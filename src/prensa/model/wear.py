"""Wear of tools by Archard's law, as cases ask for it."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from prensa.model.fields import described
from prensa.model.units import Length, Number, Pressure


@described
class Archard:
    """Wear of a tool by Archard's law, a depth of (k/H) ∫ p ds: his coefficient ``k`` and the ``hardness`` H of the tool.

    ``depth``: permitted, of which follows how many parts the tool makes. Without ``k`` and ``hardness`` (``relative``) wear is
    ∫ p ds, to be compared between places and designs.
    """

    k: Annotated[Number, Field(gt=0)] | None = None
    hardness: Annotated[Pressure, Field(gt=0)] | None = None
    depth: Annotated[Length, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _check(self) -> Archard:
        if (self.k is None) != (self.hardness is None):
            raise ValueError("give both 'k' and 'hardness', or neither for relative wear")
        if self.depth is not None and self.k is None:
            raise ValueError("'depth' needs 'k' and 'hardness': relative wear says nothing of depths")
        return self

    @property
    def relative(self) -> bool:
        """Whether wear is ∫ p ds, without a rate."""
        return self.k is None

    @property
    def rate(self) -> float:
        """k/H, 1 of relative wear."""
        return 1.0 if self.k is None or self.hardness is None else self.k / self.hardness


def _relative(value: Any) -> Any:
    """'relative' is a law without numbers."""
    return {} if value == "relative" else value


WearValue = Annotated[Archard, BeforeValidator(_relative)]
