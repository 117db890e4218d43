"""Measures of bodies: places on outlines, extremes, angles, curvatures, thickness, fields.

Everything geometric is a function of a body's `Shape` and of positions x (n, 2) of its nodes, so that it can be asked of the
start of a step as well as of its end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as attribute
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from prensa.measures.measure import Gradient, MeasureError
from prensa.measures.outline import (
    Spot,
    between,
    circle_curvature,
    crossings,
    extreme,
    in_order,
    nearest,
    node,
    on_level,
)
from prensa.mesh.bricks import outside
from prensa.mesh.faces import enclosed_volume, face_expansion
from prensa.mesh.mesh import boundary_edges
from prensa.mesh.surfaces import section_volume, surface_areas, surface_expansion
from prensa.types import Array, Index

if TYPE_CHECKING:
    from prensa.model.problem import Problem
    from prensa.result.increment import BodyState, Increment, Shape


AXIS_NUMBER = {"x": 0, "y": 1, "z": 2}
STRESS_PARTS = ("xx", "yy", "zz", "xy", "yz", "xz")


class Linear(NamedTuple):
    """A number with its derivative with respect to node positions: ``nodes`` (k,) and ``slopes`` (k, 2)."""

    value: float
    nodes: Index
    slopes: Array


@dataclass(frozen=True)
class Outline:
    """The outline of a body, or a boundary of it."""

    body: str
    boundary: str = ""

    def __str__(self) -> str:
        return f"{self.body}.{self.boundary}" if self.boundary else self.body

    def edges(self, shape: Shape) -> Index:
        """Edges (k, 2|3) in walking order; of a body in space faces (k, 4)."""
        if self.boundary and self.boundary not in shape.edges:
            raise MeasureError(f"the mesh of {self.body!r} has no boundary {self.boundary!r}; it has {_listed(shape.edges)}")
        if shape.X.shape[1] == 3:
            return shape.edges[self.boundary] if self.boundary else outside(shape.cells)
        return in_order(shape.edges[self.boundary] if self.boundary else boundary_edges(shape.cells))


def _listed(names: Mapping[str, object]) -> str:
    return ", ".join(map(repr, names)) or "none"


@dataclass(frozen=True)
class Place:
    """A place on the outline of a body: a named point, the node nearest to where it began, or where a coordinate has a value.

    ``axis`` of a coordinate ('x', 'y' of the deformed, 'X', 'Y' of the undeformed body) and its ``level``; ``near`` (x, y);
    ``unit`` of lengths, for messages.
    """

    outline: Outline
    point: str = ""
    axis: str = ""
    level: float = 0.0
    near: tuple[float, ...] | None = None
    unit: str = attribute(default="", compare=False)

    def __str__(self) -> str:
        if self.near is not None:
            return f"{self.outline} near ({self.near[0]:g}, {self.near[1]:g})"
        return f"{self.outline.body}.{self.point}" if self.point else f"{self.outline} at {self.axis}={self.level:g}"

    def spots(self, shape: Shape, x: Array) -> list[Spot]:
        """All the places of the description."""
        if self.point:
            if self.point not in shape.corners:
                raise MeasureError(
                    f"the mesh of {self.outline.body!r} has no point {self.point!r}; it has {_listed(shape.corners)}"
                )
            return [node(shape.corners[self.point], shape.X.shape[1])]
        if self.near is not None:
            some = np.unique(self.outline.edges(shape)) if self.outline.boundary else np.arange(len(shape.X))
            return [node(int(some[np.argmin(np.hypot.reduce(shape.X[some] - self.near, axis=1))]), shape.X.shape[1])]
        material = self.axis.isupper()
        k = AXIS_NUMBER[self.axis.lower()]
        values = (shape.X if material else x)[:, k]
        edges = self.outline.edges(shape)
        if everywhere := self.along(shape, x):
            raise MeasureError(everywhere)
        found = crossings(x, edges, values, self.level, k, material)
        if not found:
            low, high = values[edges].min(), values[edges].max()
            raise MeasureError(
                f"{self.outline} does not reach {self._level}: it lies at {self.axis} = {low:.6g} … {high:.6g}{self._in}"
            )
        return found

    def through(self, shape: Shape, x: Array) -> tuple[Index, Array]:
        """Of bodies in space: nodes and weights of places all over a cut."""
        raise MeasureError(f"{self} is a place, which has one value")

    @property
    def _in(self) -> str:
        return f" {self.unit}" if self.unit else ""

    @property
    def _level(self) -> str:
        return f"{self.axis} = {self.level:g}"

    def along(self, shape: Shape, x: Array | None = None) -> str:
        """What to say of an outline that runs along the level, with nodes at x (n, 2) or undeformed; '' if it does not.

        Of a deformed side that lies on the level in part, as a pressed one may for a while, the ends of that part are meant.
        """
        material = self.axis.isupper()
        X = shape.X if material or x is None else x
        k = AXIS_NUMBER[self.axis.lower()]
        edges = self.outline.edges(shape)
        on = on_level(edges, X[:, k], self.level)
        if not on.all() and not (material and on.any()):
            return ""
        other = "XY"[1 - k] if material else "xy"[1 - k]
        low, high = (float(v) for v in (X[edges[on], 1 - k].min(), X[edges[on], 1 - k].max()))
        what = f"all of {self.outline} is at" if on.all() else f"{self.outline} runs along"
        side = self.outline if on.all() else f"{self.outline.body}.<boundary>"
        return (
            f"{what} {self._level}, which names no place on it; give {other}, as in '{side} at {other}={0.5 * (low + high):.6g}' "
            f"({other} is {low:.6g} … {high:.6g}{self._in} there)"
        )

    def spot(self, shape: Shape, x: Array) -> Spot:
        """The one place of the description."""
        found = self.spots(shape, x)
        if len(found) > 1:
            k = 1 - AXIS_NUMBER[self.axis.lower()]
            there = ", ".join(f"{p.of(x)[k]:.6g}" for p in found[:5])
            other = "xy"[k]
            raise MeasureError(
                f"{self.outline} is at {self._level} in {len(found)} places, {other} = {there}{self._in}; "
                f"name a boundary, or the one that is meant: 'max.{other}' or 'min.{other}'"
            )
        return found[0]


Geometry = Callable[["Shape", Array], Linear]


def coordinate(place: Place, axis: str, displacement: bool = False, choose: str = "") -> Geometry:
    """Coordinate or displacement of a place; *choose* 'max' or 'min' of several."""
    k = AXIS_NUMBER[axis]

    def value(shape: Shape, x: Array) -> Linear:
        if choose:
            found = place.spots(shape, x)
            spot = (max if choose == "max" else min)(found, key=lambda p: float(p.of(x)[k]))
        else:
            spot = place.spot(shape, x)
        at = float(spot.of(x)[k])
        slopes = spot.slopes(x)[k]
        if displacement:
            at -= float(spot.of(shape.X)[k])
            # Where the place slides along its edge, another particle of the body is there, with another initial place.
            slopes = slopes - np.einsum("i,kj->ikj", spot.dN @ shape.X[spot.nodes], spot.slide)[k]
        return Linear(at, spot.nodes, slopes)

    return value


def end(outline: Outline, axis: str, sign: float, displacement: bool = False) -> Geometry:
    """Largest (sign 1) or smallest (−1) coordinate or displacement along an outline."""
    k = AXIS_NUMBER[axis]

    def value(shape: Shape, x: Array) -> Linear:
        values = (x - shape.X if displacement else x)[:, k]
        spot = extreme(outline.edges(shape), values, sign)
        slopes = np.zeros((len(spot.nodes), x.shape[1]))
        slopes[:, k] = spot.N
        return Linear(float(spot.of(values)), spot.nodes, slopes)

    return value


def extent(outline: Outline, axis: str) -> Geometry:
    """Largest minus smallest coordinate along an outline."""
    high, low = end(outline, axis, 1.0), end(outline, axis, -1.0)
    return lambda shape, x: _combined(high(shape, x), low(shape, x))


def _combined(a: Linear, b: Linear) -> Linear:
    """The difference a − b."""
    return Linear(a.value - b.value, np.concatenate([a.nodes, b.nodes]), np.concatenate([a.slopes, -b.slopes]))


def barrel(outline: Outline) -> Geometry:
    """Largest distance of a boundary from the chord between its ends, positive outwards: the rise of a barrelled side."""

    def value(shape: Shape, x: Array) -> Linear:
        edges = outline.edges(shape)
        first, last = int(edges[0, 0]), int(edges[-1, 1])
        way = x[last] - x[first]
        chord = float(np.hypot(*way))
        if first == last or chord == 0.0:
            raise MeasureError(f"{outline} is closed and has no chord; name a boundary with two ends")
        out = np.array([way[1], -way[0]]) / chord  # the body is on the left
        spot = extreme(edges, (x - x[first]) @ out, 1.0)
        rise = spot.of(x) - x[first]
        # h = (p − a) · R (b − a)/|b − a|, p stationary along the outline
        along = float(rise @ way) / chord**2
        nodes = np.concatenate([spot.nodes, [first, last]])
        slopes = np.concatenate([spot.N[:, None] * out, [(along - 1.0) * out, -along * out]])
        return Linear(float(rise @ out), nodes, slopes)

    return value


# ------------------------------------------------------------------------------------------- two places, and directions
def _two(a: Place, b: Place, shape: Shape, x: Array) -> tuple[Array, Index, Array, Array]:
    """Way (2,) from a to b, nodes (k,), and derivatives (2, k, 2) of the way."""
    p, q = a.spot(shape, x), b.spot(shape, x)
    way = q.of(x) - p.of(x)
    if not np.hypot.reduce(way) > 0.0:
        raise MeasureError(f"{a} and {b} are the same place")
    return way, np.concatenate([p.nodes, q.nodes]), np.concatenate([-p.slopes(x), q.slopes(x)], axis=1), p.of(x)


def distance(a: Place, b: Place) -> Geometry:
    """Distance of two places."""

    def value(shape: Shape, x: Array) -> Linear:
        way, nodes, slopes, _ = _two(a, b, shape, x)
        size = float(np.hypot.reduce(way))
        return Linear(size, nodes, np.einsum("i,ikj->kj", way / size, slopes))

    return value


def angle(a: Place, b: Place) -> Geometry:
    """Direction of the way from a to b, in degrees from +x, −180 … 180."""

    def value(shape: Shape, x: Array) -> Linear:
        way, nodes, slopes, _ = _two(a, b, shape, x)
        turn = np.array([-way[1], way[0]]) / float(way @ way)
        return Linear(
            math.degrees(math.atan2(way[1], way[0])), nodes, np.degrees(np.einsum("i,ikj->kj", turn, slopes))
        )

    return value


def inclination(place: Place) -> Geometry:
    """Direction of an outline at a place, in degrees from the x axis, −90 … 90."""

    def value(shape: Shape, x: Array) -> Linear:
        spot = place.spot(shape, x)
        t, slopes = spot.tangent(x)
        turn = np.array([-t[1], t[0]]) / float(t @ t)
        at = math.degrees(math.atan2(t[1], t[0]))
        at -= 180.0 * math.floor(at / 180.0 + 0.5)  # a line has no sense
        return Linear(at or 0.0, spot.nodes, np.degrees(np.einsum("i,ikj->kj", turn, slopes)))

    return value


Plain = Callable[["Shape", Array], float]


def curvature(a: Place, b: Place) -> Plain:
    """Curvature of the circle fitted to a boundary between two places, positive where the body is convex."""

    def value(shape: Shape, x: Array) -> float:
        edges = a.outline.edges(shape)
        return circle_curvature(between(x, edges, a.spot(shape, x), b.spot(shape, x)))

    return value


def thickness(a: Outline | Place, b: Outline) -> Plain:
    """Distance of a place from an outline, or least distance of two outlines (from the nodes of either)."""

    def value(shape: Shape, x: Array) -> float:
        other = b.edges(shape)
        if isinstance(a, Place):
            return float(nearest(a.spot(shape, x).of(x)[None], x, other)[0])
        own = a.edges(shape)
        there, back = (nearest(x[np.unique(s)], x, e) for s, e in ((own, other), (other, own)))
        return float(min(there.min(), back.min()))

    return value


def thinning(a: Outline | Place, b: Outline) -> Plain:
    """1 − t/t₀ of a place, or the largest one along an outline (at its nodes)."""

    def value(shape: Shape, x: Array) -> float:
        other = b.edges(shape)
        if isinstance(a, Place):
            spot = a.spot(shape, x)
            now, before = (nearest(spot.of(p)[None], p, other)[0] for p in (x, shape.X))
            return float(1.0 - now / before)
        own = np.unique(a.edges(shape))
        return float((1.0 - nearest(x[own], x, other) / nearest(shape.X[own], shape.X, other)).max())

    return value


def thickest(a: Outline | Place, b: Outline) -> Plain:
    """Distance of a place from an outline, or the largest one of the nodes of an outline from another."""

    def value(shape: Shape, x: Array) -> float:
        points = a.spot(shape, x).of(x)[None] if isinstance(a, Place) else x[np.unique(a.edges(shape))]
        return float(nearest(points, x, b.edges(shape)).max())

    return value


def thickening(a: Outline | Place, b: Outline) -> Plain:
    """t/t₀ − 1 of a place, or the largest one along an outline (at its nodes)."""

    def value(shape: Shape, x: Array) -> float:
        other = b.edges(shape)
        if isinstance(a, Place):
            return -thinning(a, b)(shape, x)
        own = np.unique(a.edges(shape))
        return float((nearest(x[own], x, other) / nearest(shape.X[own], shape.X, other)).max() - 1.0)

    return value


OF_SHEETS: dict[str, Callable[[Outline | Place, Outline], Plain]] = {
    "thickness": thickness, "thinning": thinning, "thickest": thickest, "thickening": thickening,
}  # fmt: skip
"""What is measured from a boundary, or a place on one, to the boundary opposite, by name."""


# --------------------------------------------------------------------------------------------------------------- values
def geometric(body: str, geometry: Geometry) -> tuple[Callable[[Increment], float], Callable[[Increment], Gradient]]:
    """Value and gradient of a geometric measure with a derivative."""

    def slope(increment: Increment) -> Gradient:
        shape = increment.shapes[body]
        linear = geometry(shape, shape.x)
        return Gradient(nodes={body: (linear.nodes, linear.slopes)})

    def value(increment: Increment) -> float:
        shape = increment.shapes[body]
        return geometry(shape, shape.x).value

    return value, slope


def plain(body: str, geometry: Plain) -> Callable[[Increment], float]:
    """Value of a geometric measure without one."""
    return lambda increment: geometry(increment.shapes[body], increment.shapes[body].x)


def change(body: str, geometry: Plain, turn: float = math.inf) -> Callable[[Increment], float]:
    """What a geometric measure has changed by since the start of the step; of directions the least turn."""

    def value(increment: Increment) -> float:
        shape = increment.shapes[body]
        by = geometry(shape, shape.x) - geometry(shape, shape.start)
        # From 179° to −179° a line turns by 2°. The remainder by infinity is the number itself.
        return math.remainder(by, turn)

    return value


def field(body: BodyState, name: str) -> Array:
    """Nodal values (n,) of a field."""
    kind, _, component = name.partition(".")
    if kind == "stress":
        return body.stress[:, STRESS_PARTS.index(component)]
    if kind == "displacement":
        return np.asarray(np.hypot.reduce(body.displacement, axis=1))
    if kind == "damage":
        return body.damage[component or next(iter(body.damage))]
    values: Any = getattr(body, kind)
    if values is None:
        raise MeasureError(f"{kind.replace('_', ' ')} is not known of this increment; solve the case")
    return np.asarray(values)


def expansion(outline: Outline, revolved: bool) -> Plain:
    """Area of a boundary now over that at the beginning; lengths in the plane."""

    def value(shape: Shape, x: Array) -> float:
        edges = outline.edges(shape)
        now, then = (float(surface_areas(p, edges, revolved).sum()) for p in (x, shape.X))
        if not then > 0.0:
            raise MeasureError(f"{outline} lies on the axis and has no surface")
        return now / then

    return value


def volume(body: str, problem: Problem) -> Plain:
    """Volume of a body by its outline: in plane strain of the thickness, in axisymmetry of the whole circumference."""
    outline = Outline(body)

    def value(shape: Shape, x: Array) -> float:
        edges = outline.edges(shape)
        if x.shape[1] == 3:
            return enclosed_volume(x, edges)
        if problem.space == "axisymmetric":
            return section_volume(x, edges, True)
        return problem.thickness * section_volume(x, edges, False)

    return value


def _on_outline(increment: Increment, outline: Outline, name: str) -> Array:
    """Nodal values (n,) of a field; the growth of a surface where two sides meet is that of the one that is asked for."""
    if name != "surface_expansion" or not outline.boundary:
        return field(increment.bodies[outline.body], name)
    shape = increment.shapes[outline.body]
    faces = outline.edges(shape)
    if shape.X.shape[1] == 3:
        return face_expansion(shape.X, shape.x, faces)
    return surface_expansion(shape.X, shape.x, faces, increment.problem.space == "axisymmetric")


def field_at(place: Place, name: str) -> Callable[[Increment], float]:
    """A field at a place, interpolated along the edge."""

    def value(increment: Increment) -> float:
        shape = increment.shapes[place.outline.body]
        return float(place.spot(shape, shape.x).of(_on_outline(increment, place.outline, name)))

    return value


def field_on_cut(place: Place, name: str, sign: float) -> Callable[[Increment], float]:
    """Largest (sign 1) or smallest (−1) value of a field over a cut through a body in space, or through a side of it."""

    def value(increment: Increment) -> float:
        shape = increment.shapes[place.outline.body]
        nodes, N = place.through(shape, shape.x)
        return sign * float((sign * (N * _on_outline(increment, place.outline, name)[nodes]).sum(axis=1)).max())

    return value


def field_extreme(outline: Outline, name: str, sign: float) -> Callable[[Increment], float]:
    """Largest (sign 1) or smallest (−1) nodal value of a field in a body, or along a boundary of it."""

    def value(increment: Increment) -> float:
        values = sign * _on_outline(increment, outline, name)
        if outline.boundary:
            values = values[np.unique(outline.edges(increment.shapes[outline.body]))]
        if name == "surface_expansion":
            values = values[np.isfinite(values)]  # inside of the body there is none
        return sign * float(values.max())

    return value


def extreme_place(outline: Outline, name: str, sign: float, axis: str) -> Callable[[Increment], float]:
    """Present coordinate x or y of the node at which `field_extreme` is found."""

    def value(increment: Increment) -> float:
        body = increment.bodies[outline.body]
        values, nodes = sign * field(body, name), np.arange(len(body.x))
        if outline.boundary:
            nodes = np.unique(outline.edges(increment.shapes[outline.body]))
        return float(body.x[nodes[np.argmax(values[nodes])], AXIS_NUMBER[axis]])

    return value
