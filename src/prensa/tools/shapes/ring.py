"""Flat ring stamp of axisymmetric problems."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from prensa.geometry.outline import block
from prensa.model.names import Finding
from prensa.model.units import Length, Number
from prensa.tools.flat import Flat
from prensa.tools.tool import ToolShape
from prensa.types import Array

__all__ = ["Ring"]


class Ring(ToolShape):
    """Flat ring stamp between radii ``inner`` and ``outer`` (axisymmetric), edges rounded with ``fillet``.

    ``facing``: as in a `Stamp`.
    """

    inner: Annotated[Length, Field(gt=0)]
    outer: Annotated[Length, Field(gt=0)]
    fillet: Annotated[Length, Field(ge=0)] = 0.0
    facing: tuple[Number, Number] | None = None
    type: Literal["ring"] = "ring"

    direction_key: ClassVar[str] = "facing"

    @model_validator(mode="after")
    def _check(self) -> Ring:
        if self.outer <= self.inner:
            raise ValueError(f"outer radius {self.outer:g} must exceed inner radius {self.inner:g}")
        if 2 * self.fillet > self.outer - self.inner:
            raise ValueError(f"fillet {self.fillet:g} is larger than half the face {self.outer - self.inner:g}")
        return self

    def findings(self, p: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
        """It is axisymmetric, faces along the axis and is centred on it."""
        if p.space not in ("axisymmetric", None):
            yield Finding((*path, "type"), "a ring stamp needs 'space: axisymmetric'; use stamps in plane problems")
        yield from self._along_axis(p, path)

    def shape(self, direction: Array, rounding: float) -> Flat:
        """Flat face beside the axis."""
        nx, ny = direction
        # e = n turned: facing down e = +x, facing up e = −x
        a, b = (self.inner, self.outer) if ny < 0 else (-self.outer, -self.inner)
        return Flat(nx, ny, a, b, self.fillet)

    def face(self) -> tuple[float, str]:
        """Width of the face."""
        return self.outer - self.inner, "inner"

    def outline(self, depth: float) -> list[Array]:
        """The section at the right of the axis."""
        return [block(self.inner, self.outer, depth, self.fillet)]
