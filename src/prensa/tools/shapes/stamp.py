"""Flat stamp."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from prensa.geometry.outline import block
from prensa.model.names import Finding
from prensa.model.units import Length, Number
from prensa.precision import NEGLIGIBLE
from prensa.tools.flat import Flat
from prensa.tools.tool import ToolShape
from prensa.types import Array

__all__ = ["Stamp"]


class Stamp(ToolShape):
    """Flat stamp of total ``width`` (a strip, or a disc of that diameter), edges rounded with ``fillet``.

    ``facing``: direction in which its face looks (default: at the boundary it touches, else down).
    """

    width: Annotated[Length, Field(gt=0)]
    fillet: Annotated[Length, Field(ge=0)] = 0.0
    facing: tuple[Number, Number] | None = None
    type: Literal["stamp"] = "stamp"

    direction_key: ClassVar[str] = "facing"

    @model_validator(mode="after")
    def _check(self) -> Stamp:
        if 2 * self.fillet > self.width:
            raise ValueError(f"fillet {self.fillet:g} is larger than half the width {self.width:g}")
        return self

    def findings(self, p: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
        """In axisymmetry it faces along the axis, on which it is centred."""
        yield from self._along_axis(p, path)

    def shape(self, direction: Array, rounding: float) -> Flat:
        """Flat face about the reference point."""
        nx, ny = direction
        return Flat(nx, ny, -0.5 * self.width, 0.5 * self.width, self.fillet)

    def face(self) -> tuple[float, str]:
        """The width."""
        return self.width, "width"

    def outline(self, depth: float) -> list[Array]:
        """Rectangle with two rounded corners."""
        return [block(-self.width / 2, self.width / 2, depth, self.fillet)]

    def mirrored(self, on_axis: bool, direction: Array) -> bool:
        """Whether it looks along the axis."""
        return abs(direction[0]) < NEGLIGIBLE
