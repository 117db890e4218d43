"""Rigid convex polyhedra in space."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.model.fields import Turn
from prensa.model.names import Finding
from prensa.model.units import Length, Number
from prensa.tools.analytic import Tool
from prensa.tools.convex import Convex, PolyhedronError, planes_of, polyhedron
from prensa.tools.tool import ToolShape, rotation_of
from prensa.types import Array, Index

__all__ = ["Polyhedron"]


class Polyhedron(ToolShape):
    """Rigid convex polyhedron in space: the hull of its corners, ``points``, or what lies behind its ``planes``.

    Each plane is [n_x, n_y, n_z, d] with a normal that looks outwards, of any length, and its distance d along it from the
    reference point. ``radius``: of edges and corners, which are rounded inside the faces; by default with a quarter of an
    element if it moves on a surface. ``turn``: rotation at the start.
    """

    points: tuple[tuple[Length, Length, Length], ...] = ()
    planes: tuple[tuple[Number, Number, Number, Length], ...] = ()
    radius: Annotated[Length, Field(ge=0)] | None = None
    turn: Turn = (0.0, 0.0, 0.0)
    type: Literal["polyhedron"] = "polyhedron"

    dimensions: ClassVar[tuple[int, ...]] = (3,)

    def findings(self, p: object, path: tuple[str | int, ...]) -> Iterator[Finding]:
        """Points or planes that enclose a body, and a radius that fits into it."""
        if bool(self.points) == bool(self.planes):
            yield Finding(path, "give the corners of the polyhedron, 'points', or its 'planes'")
            return
        for k, plane in enumerate(self.planes):
            if not any(plane[:3]):
                yield Finding((*path, "planes", k), "the normal (0, 0, 0) has no length; give one such as [0, -1, 0, 5]")
                return
        try:
            self._made(self.radius or 0.0)
        except PolyhedronError as error:
            key = "radius" if "radius" in str(error) else "points" if self.points else "planes"
            yield Finding((*path, key), str(error))

    def shape(self, direction: Array, rounding: float) -> Tool:
        """See `prensa.tools.convex`."""
        return self._made(rounding if self.radius is None else self.radius)

    def _made(self, radius: float) -> Convex:
        if self.points:
            normals, offsets = planes_of(np.array(self.points))
        else:
            rows = np.array(self.planes)
            normals, offsets = rows[:, :3] / np.linalg.norm(rows[:, :3], axis=1, keepdims=True), rows[:, 3]
        return polyhedron(normals @ rotation_of(self.turn).T, offsets, radius)

    def facets(self, direction: Array, depth: float) -> tuple[Array, Index]:
        """All of it."""
        return self._made(self.radius or 0.0).facets(depth)

    def details(self, shape: Tool, direction: Array) -> str:
        """How many faces and edges it has, and how round these are."""
        faces = f"{len(shape.normals)} planes, {len(shape.pairs)} edges" if isinstance(shape, Convex) else ""
        return f", {faces}, rounded with {shape.radius:.4g}"
