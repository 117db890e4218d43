"""Rigid pyramids in space, those of indentation tests among them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.errors import along
from prensa.model.fields import Turn
from prensa.model.names import Finding
from prensa.model.units import Angle, Length, Whole
from prensa.tools.analytic import Tool
from prensa.tools.convex import Convex, pyramid, turned_by
from prensa.tools.tool import ToolShape, rotation_of
from prensa.types import Array, Index

__all__ = ["Pyramid"]

INDENTERS = {"vickers": (4, 68.0), "berkovich": (3, 65.27), "cube corner": (3, 35.26)}
"""Sides, and degrees between axis and faces: ISO 6507-1, and ISO 14577-2 (Berkovich modified)."""


class Pyramid(ToolShape):
    """Rigid regular pyramid in space, endless behind its tip; the reference point is the sharp tip, which looks along −y.

    ``of``: an indenter by name, Vickers (136° between opposite faces), Berkovich (modified, 65.27° between axis and faces) or
    cube corner; or give ``sides`` and the ``angle`` between axis and faces. One face looks towards +x: the planes x = 0 and z =
    0 are planes of symmetry of a Vickers pyramid, z = 0 is one of a Berkovich pyramid. ``radius``: of tip and edges; by default
    a quarter of an element if it moves on a surface. ``turn``: rotation at the start.
    """

    of: Literal["vickers", "berkovich", "cube corner"] | None = None
    sides: Annotated[Whole, Field(ge=3)] | None = None
    angle: Annotated[Angle, Field(gt=0, lt=math.pi / 2)] | None = None
    radius: Annotated[Length, Field(ge=0)] | None = None
    turn: Turn = (0.0, 0.0, 0.0)
    type: Literal["pyramid"] = "pyramid"

    dimensions: ClassVar[tuple[int, ...]] = (3,)

    def findings(self, p: object, path: tuple[str | int, ...]) -> Iterator[Finding]:
        """A name, or sides and angle."""
        given = self.sides is not None, self.angle is not None
        if self.of is not None and any(given):
            yield Finding((*path, "of"), f"{self.of!r} says 'sides' and 'angle': leave these out, or the name")
        elif self.of is None and not all(given):
            names = ", ".join(INDENTERS)
            yield Finding(path, f"a pyramid needs a name, 'of' ({names}), or both 'sides' and 'angle' (between axis and faces)")

    def shape(self, direction: Array, rounding: float) -> Tool:
        """See `prensa.tools.convex`."""
        return self._made(rounding if self.radius is None else self.radius)

    def _made(self, radius: float) -> Convex:
        sides, angle = self.sides or 4, self.angle or 1.0
        if self.of is not None:
            sides, degrees = INDENTERS[self.of]
            angle = math.radians(degrees)
        return turned_by(pyramid(sides, angle, radius), rotation_of(self.turn))

    def facets(self, direction: Array, depth: float) -> tuple[Array, Index]:
        """Up to a depth along its edges."""
        return self._made(self.radius or 0.0).facets(depth)

    def into_image(self, shape: Tool, normals: Sequence[Array], nothing: float) -> str:
        """The least turn about its axis: of n faces each has a plane of symmetry, all of them at 180°/n."""
        axis = rotation_of(self.turn) @ np.array([0.0, 1.0, 0.0])
        if not isinstance(shape, Convex) or any(abs(axis @ n) > nothing for n in normals):
            return ""
        faces, face = len(shape.normals), shape.normals[0] - (shape.normals[0] @ axis) * axis
        part, angles = math.pi / faces, []
        for n in normals:
            angle = math.atan2(float(axis @ np.cross(face, n)), float(face @ n))  # from the face to the plane's normal
            angle += 0.5 * math.pi * (faces % 2)  # opposite a face is an edge then: the planes go through faces
            angles.append(angle - part * round(angle / part))
        if not angles or max(abs(math.remainder(angle - angles[0], part)) for angle in angles) > nothing:
            return ""
        return f"turn it by {math.degrees(angles[0]):.4g}° about {along(axis)} ('turn')"

    def details(self, shape: Tool, direction: Array) -> str:
        """Its angle and radius, and where it is turned to."""
        axis = rotation_of(self.turn) @ np.array([0.0, -1.0, 0.0]) + 0.0
        name = self.of or f"{self.sides} sides, {math.degrees(self.angle or 0.0):.4g}° between axis and faces"
        looks = "" if not any(self.turn) else f", looking along ({', '.join(f'{v:.4g}' for v in axis)})"
        return f", {name}, tip and edges of radius {shape.radius:.4g}{looks}"
