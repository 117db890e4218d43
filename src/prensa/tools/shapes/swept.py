"""Rigid tools in space that a tool of the plane makes: extruded along an axis, revolved about one, swept around a plan."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

import numpy as np

from prensa.geometry.sections import section_axes
from prensa.model.doors import union
from prensa.model.fields import Axis
from prensa.model.names import Finding
from prensa.precision import NEGLIGIBLE
from prensa.tools.analytic import Tool

# A section is a tool of the plane: those of the package have to be known before their union is made.
from prensa.tools.shapes import circle, ellipse, plane, polygon, profile, ring, stamp  # noqa: F401
from prensa.tools.swept import (
    Moulding,
    Prism,
    Revolution,
    extruded_facets,
    half,
    joined,
    revolved_facets,
    swept_facets,
    thinned,
)
from prensa.tools.tool import ToolShape
from prensa.types import Array, Index

__all__ = ["Extruded", "Revolved", "Swept"]

if TYPE_CHECKING:
    Section: TypeAlias = Any
else:
    Section = union("tool", lambda cls: 2 in cls.dimensions)


class _SweptShape(ToolShape, abstract=True):
    """What they have in common."""

    dimensions: ClassVar[tuple[int, ...]] = (3,)
    section: Any
    axis: Any

    @property
    def _unit(self) -> Array:
        return np.array(self.axis, dtype=np.float64) / np.linalg.norm(self.axis)

    def _section_looks(self, outward: Array) -> Array:
        """Where the section looks (2,), before a boundary with the outward normal (2,), if that says anything."""
        length = float(np.linalg.norm(outward))
        return np.asarray(self.section.looks(outward / length if length > 0.5 else np.array([0.0, 1.0])))

    def _swept(self, kind: type[Prism] | type[Revolution], looks: Array, rounding: float) -> Tool:
        at = (0.0, 0.0) if self.section.at is None else tuple(map(float, self.section.at))
        return kind(self.section.shape(looks, rounding), at, tuple(self._unit.tolist()))

    def findings(self, p: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
        """An axis that has a direction; a section of the plane that is not placed by itself."""
        inside = (*path, "section")
        if not any(self.axis):
            words = "the axis [0, 0, 0] has no direction; write 'x', 'y', 'z' or a vector such as [0, 1, 0]"
            yield Finding((*path, "axis"), words)
        for key in ("touching", "above", "below", "spring"):
            if getattr(self.section, key, None) is not None:
                words = f"{key!r} belongs to the {getattr(self, 'type', '')} tool, not to its section"
                yield Finding((*inside, key), words, at_key=True)
        for key in ("at", self.section.direction_key):
            given = getattr(self.section, key, None) if key else None
            if given is not None and len(given) != 2:
                yield Finding((*inside, key), f"a section lies in a plane: {key} has two components")
        yield from self.section.findings(p, inside)

    def face(self) -> tuple[float, str]:
        """That of the section."""
        size, key = self.section.face()
        return size, f"section.{key}" if key else ""

    def details(self, shape: Tool, direction: Array) -> str:
        """What is swept, and how."""
        x, y, z = self._unit + 0.0
        return f", section {self.section.type}, axis ({x:.4g}, {y:.4g}, {z:.4g})"

    def outline(self, depth: float) -> list[Array]:
        """That of the section."""
        return self.section.outline(depth)

    def _polygons(self, looks: Array, depth: float) -> list[Array]:
        """The section's outline in its plane, turned to where it looks."""
        at = np.zeros(2) if self.section.at is None else np.array(self.section.at)
        x, y = looks if self.section.direction_key else (0.0, -1.0)
        return [p @ np.array([[-y, x], [-x, -y]]) + at for p in self.section.outline(depth)]


class Extruded(_SweptShape):
    """A tool of the plane, ``section``, extruded endlessly along ``axis``: a roll is an extruded circle.

    The section lies across the axis: its second coordinate is y (z where the axis is y), its first one x (z where the axis is
    x). ``at`` of the section is a place in that plane.
    """

    section: Section
    axis: Axis = (0.0, 0.0, 1.0)
    type: Literal["extruded"] = "extruded"

    def shape(self, direction: Array, rounding: float) -> Tool:
        """See `prensa.tools.swept`."""
        return self._swept(Prism, self._section_looks(-(direction @ section_axes(self._unit))), rounding)

    def goes_on(self, shape: Tool) -> bool:
        """As its section does."""
        section = shape.section if isinstance(shape, Prism) else shape
        return not shape.extent or self.section.goes_on(section)

    def facets(self, direction: Array, depth: float) -> tuple[Array, Index]:
        """The outline of the section, extruded."""
        looks = self._section_looks(-(direction @ section_axes(self._unit)))
        return joined([extruded_facets(p, self._unit, depth) for p in self._polygons(looks, depth)])


class Revolved(_SweptShape):
    """A tool of the plane, ``section``, revolved about ``axis`` through the reference point: a torus is a revolved circle off it.

    The section is drawn as in axisymmetry: its first coordinate is the radius, the second runs along the axis. Of a section
    that crosses the axis the half with positive radii counts. ``at`` of the section is a place in that plane.
    """

    section: Section
    axis: Axis = (0.0, 1.0, 0.0)
    type: Literal["revolved"] = "revolved"

    def shape(self, direction: Array, rounding: float) -> Tool:
        """See `prensa.tools.swept`."""
        return self._swept(Revolution, self._section_looks(np.array([0.0, -(direction @ self._unit)])), rounding)

    def facets(self, direction: Array, depth: float) -> tuple[Array, Index]:
        """The outline of the section, what has positive radii of it, revolved."""
        looks = self._section_looks(np.array([0.0, -(direction @ self._unit)]))
        lines = [line for p in self._polygons(looks, depth) for line in half(p)]
        return joined([revolved_facets(line, self._unit) for line in lines])


class Swept(_SweptShape):
    """A tool of the plane, ``section``, swept around a ``plan``, a closed outline: punches, dies and holders of any outline.

    The plan is a circle, an ellipse, a polygon or a closed profile across ``axis`` through the reference point; its second
    coordinate is y (z where the axis is y), its first one x (z where the axis is x). The first coordinate of the section is the
    distance from the plan, negative inside it, the second runs along the axis. ``at`` of section and plan are places there.
    """

    section: Section
    plan: Section  # type: ignore[misc]
    axis: Axis = (0.0, 1.0, 0.0)
    type: Literal["swept"] = "swept"

    def findings(self, p: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
        """As of other sections; and a plan that is closed, with the inside inside."""
        yield from super().findings(p, path)
        wrong = list(self.plan.findings(p, (*path, "plan")))
        yield from wrong
        for key in ("touching", "above", "below", "spring"):
            if getattr(self.plan, key, None) is not None:
                yield Finding((*path, "plan", key), f"{key!r} belongs to the swept tool, not to its plan", at_key=True)
        if not wrong and (not np.isfinite(self._plan.period) or self._plan.cavity):
            words = "the plan is a closed outline with its inside inside: a circle, an ellipse, a polygon, a closed profile"
            yield Finding((*path, "plan"), words)

    @property
    def _plan(self) -> Tool:
        shape: Tool = self.plan.shape(np.array([0.0, -1.0]), 0.0)
        return shape

    @property
    def _plan_at(self) -> tuple[float, ...]:
        return (0.0, 0.0) if self.plan.at is None else tuple(map(float, self.plan.at))

    def doubts(self) -> Iterator[tuple[str, str]]:
        """A section that is not flat yet where the corners of the plan, moved inwards, have no radius left."""
        pieces = getattr(self.section.shape(np.array([0.0, -1.0]), 0.0), "pieces", ())
        start = 0.0 if self.section.at is None else float(self.section.at[0])
        curved = [start + p.at(float(t))[0] for p in pieces if p.radius for t in np.linspace(p.lo, p.hi, 9)]
        radius = self._plan.radius
        if min(curved, default=0.0) < -radius * (1.0 + NEGLIGIBLE):
            words = f"the section is round {-min(curved):.4g} inside the plan, whose corners have a radius of {radius:.4g}"
            yield "section", f"{words}: the surface has creases there"

    def shape(self, direction: Array, rounding: float) -> Tool:
        """See `prensa.tools.swept`."""
        section = self.section.shape(self._section_looks(np.array([0.0, -(direction @ self._unit)])), rounding)
        at = (0.0, 0.0) if self.section.at is None else tuple(map(float, self.section.at))
        return Moulding(section, at, tuple(self._unit.tolist()), self._plan, self._plan_at)

    def facets(self, direction: Array, depth: float) -> tuple[Array, Index]:
        """The outline of the section around that of the plan, as far inside as the corners of the plan go; flat within."""
        plan, at = self._plan, np.array(self._plan_at)
        inside = min(plan.radius, plan.extent)
        looks = self._section_looks(np.array([0.0, -(direction @ self._unit)]))
        shift = np.array([inside, 0.0])
        lines = [line - shift for p in self._polygons(looks, depth) for line in half(p + shift)]
        (outline,) = self.plan.outline(depth)
        outline = thinned(np.vstack([outline, outline[:1]]))[:-1]
        return joined([swept_facets(line, outline + at, plan.closest(outline).n, self._unit) for line in lines])
