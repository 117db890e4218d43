"""What a die has not filled: the region that tools and lines of symmetry enclose, less the body in it, and closed pockets.

Sections are polygons (of curved sides and fillets as they are drawn), and their areas are turned about the axis where the bodies
are. What is narrower than the shortest side of an element is shut: no mesh flows through it.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from prensa.geometry.plane import cross
from prensa.measures.measure import MeasureError
from prensa.measures.tool_outlines import outlines
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import boundary_edges, edges_between
from prensa.mesh.surfaces import edge_areas, slopes_at
from prensa.precision import NEGLIGIBLE

if TYPE_CHECKING:
    from prensa.model.problem import Problem
    from prensa.result.increment import Increment, ToolState
    from prensa.types import Array, Index

FILL = ("fill", "missing_volume", "die_volume")
"""Measures of a closed die."""
POCKETS = ("pockets", "trapped_volume")
"""Measures of any tools."""
NO_SHAPELY = "what a die has not filled needs shapely: pip install 'prensa[remesh]'"


class Wall(NamedTuple):
    """A straight support or line of symmetry: bodies lie at values of axis 0 or 1 that are on its ``side`` of ``at``."""

    axis: int
    at: float
    side: float


class Pocket(NamedTuple):
    """A place (x, y) that is not filled, and its volume (of the thickness, or of the whole ring)."""

    x: float
    y: float
    volume: float


class Filling(NamedTuple):
    """How far a die is filled: volumes of the ``die`` and of what is ``missing`` in it, by place, the largest first.

    ``closed``: whether tools enclose the body; without it the die has no volume. ``pockets``: places that the body and tools
    enclose between two contacts.
    """

    closed: bool
    die: float
    missing: float
    places: tuple[Pocket, ...]
    pockets: tuple[Pocket, ...]


def walls(problem: Problem, step: int = 0) -> list[Wall]:
    """Straight sides that supports hold along their normal where they were made, from the beginning to a step (from 0).

    Those that supports move, as what draws a wire, are no walls of a die: what they leave behind is open.
    """
    found = []
    for name, axis in _at_rest(problem, step):
        body, _, side = name.partition(".")
        if body not in problem.bodies:
            continue
        mesh = _mesh(problem, body)
        if side not in mesh.edges:
            continue
        X = mesh.points[np.unique(mesh.edges[side])]
        if np.ptp(X[:, axis]) <= NEGLIGIBLE * np.ptp(mesh.points):
            at = float(X[0, axis])
            found.append(Wall(axis, at, float(np.sign(mesh.points[:, axis].mean() - at))))
    return found


def _at_rest(problem: Problem, step: int) -> list[tuple[str, int]]:
    """Sides and the axes along which supports hold them up to a step (from 0) without having moved or released them."""
    steps = problem.steps[: step + 1]
    held: dict[tuple[str, int], bool] = {}  # whether it was held there all the time, in the order of the description
    for fixed in (problem.fixed, *(s.fixed for s in steps)):
        for name, support in fixed.items():
            for axis, value in enumerate((support.x, support.y)):
                rests = value is not None and (value == "held" or not np.any(np.atleast_2d(np.array(value))[:, -1]))
                if value is not None or support.free:
                    held[name, axis] = rests and held.get((name, axis), True)
    ways = [(name, (way.x, way.y)) for s in steps for given in (s.by, s.feed) for name, way in given.items()]
    moved = {(name, axis) for name, way in ways for axis in (0, 1) if way[axis] not in (None, 0.0)}
    return [key for key, rests in held.items() if rests and key not in moved]


def _mesh(problem: Problem, body: str) -> Any:
    description = problem.bodies[body]
    return mesh_of(description.mesh, problem.element_name(body), problem.units.length)


def shapely() -> Any:
    """The library of plane geometry; `MeasureError` without it."""
    try:
        return importlib.import_module("shapely")
    except ImportError:
        raise MeasureError(NO_SHAPELY) from None


class Section(NamedTuple):
    """Bodies by name: nodes x (n, 2), cells, and nodes (k,) that are in contact."""

    x: Mapping[str, Array]
    cells: Mapping[str, Index]
    touching: Mapping[str, Index]


def section_of(increment: Increment, stored: bool = False) -> Section:
    """The section of an increment; of one that was ``stored`` by the fields that were kept of it."""
    bodies: Mapping[str, Any] = increment.bodies if stored else increment.shapes
    touching = {b: [np.zeros(0, dtype=np.int64)] for b in bodies}
    for c in increment.contacts.values():
        touching[c.body].append(c.node[c.status > 0])
    return Section(
        {b: s.x for b, s in bodies.items()}, {b: s.cells for b, s in bodies.items()},
        {b: np.concatenate(nodes) for b, nodes in touching.items()},
    )  # fmt: skip


def filling(
    problem: Problem, tools: Mapping[str, ToolState], section: Section, body: str, around: list[Wall]
) -> Filling:  # fmt: skip
    """How far the tools around a body are filled; ``around``: supports that stand for the rest of a die.

    Raises
    ------
    MeasureError
        Without shapely.

    """
    geometry = shapely()
    own = {name: _polygon(x, section.cells[name]) for name, x in section.x.items()}
    bodies = geometry.union_all(list(own.values()))
    low, high = np.array(bodies.bounds[:2]), np.array(bodies.bounds[2:])
    size = float((high - low).max())
    window = geometry.box(*(low - 4.0 * size), *(high + 4.0 * size))
    x, cells = section.x[body], section.cells[body]
    edges = boundary_edges(cells)
    opening = float(edge_areas(x, edges, False).min())
    solid = _solid(problem, tools, around, 4.0 * np.hypot(*(high - low + 4.0 * size)), geometry)
    solid = solid.buffer(0.5 * opening, join_style="mitre", mitre_limit=size / opening)
    solid = solid.buffer(-0.5 * opening, join_style="mitre", mitre_limit=size / opening)
    rim, revolved = window.exterior, problem.space == "axisymmetric"
    depth = 1.0 if revolved else problem.thickness

    def place(part: Any) -> Pocket:
        x, y = geometry.maximum_inscribed_circle(part).coords[0]
        return Pocket(float(x), float(y), depth * _volume(part, revolved))

    cavity = max(_parts(window.difference(solid)), key=lambda part: part.intersection(own[body]).area, default=geometry.Polygon())
    closed = bool(cavity.distance(rim) > opening)  # not a number where tools leave no room at all
    free = cavity.difference(bodies) if closed else window.difference(solid).difference(bodies)
    # Chords of the sides of elements leave slivers at curved tools: sides with both ends in contact are shut.
    sides = edges_between(edges, section.touching[body])
    shut = [_line(x, side).buffer(0.25 * opening) for side in sides if np.isin(side[:2], section.touching[body]).all()]
    near = own[body].buffer(0.5 * opening)
    found = [part for part in _parts(free.difference(geometry.union_all(shut))) if part.intersects(near)]
    enclosed = [part for part in found if part.distance(rim) > opening and not part.buffer(-0.25 * opening).is_empty]
    whole = [part.buffer(0.5 * opening).intersection(free) for part in enclosed]
    pockets = tuple(sorted(map(place, whole), key=lambda p: -p.volume))
    if not closed:
        return Filling(False, 0.0, 0.0, (), pockets)
    rest = max(_parts(free), key=lambda part: part.area, default=None)
    places = pockets or (() if rest is None else (place(rest),))  # what is too narrow for a pocket is missing all the same
    return Filling(True, depth * _volume(cavity, revolved), depth * _volume(free, revolved), places, pockets)


def _parts(shape: Any) -> Iterator[Any]:
    """Polygons of a shape."""
    if shape.geom_type == "Polygon":
        yield from () if shape.is_empty else (shape,)
    for part in getattr(shape, "geoms", ()):
        yield from _parts(part)


def _volume(shape: Any, revolved: bool) -> float:
    """Area of a shape, or the volume that it sweeps about the axis (Pappus)."""
    return float(sum(part.area * (2.0 * np.pi * part.centroid.x if revolved else 1.0) for part in _parts(shape)))


def _line(x: Array, side: Index) -> Any:
    """A side of an element as a line of straight pieces."""
    s = np.linspace(-1.0, 1.0, 2 if len(side) == 2 else 9)
    return shapely().LineString([slopes_at(float(v), len(side))[0] @ x[side] for v in s])


def _polygon(x: Array, cells: Index) -> Any:
    """The section of a body by its curved sides."""
    geometry = shapely()
    lines = geometry.union_all([_line(x, side) for side in boundary_edges(cells)])
    rings = sorted(_parts(geometry.polygonize([lines])), key=lambda ring: -ring.area)
    # Between two rings within one another there is body, hole, body …: what an odd number of them surrounds.
    out = geometry.Polygon()
    for ring in rings:
        out = out.union(geometry.Polygon(ring.exterior))
    holes = [ring for ring in rings if not _inside(ring.representative_point(), x, cells)]
    return out.difference(geometry.union_all(holes)) if holes else out


def _inside(point: Any, x: Array, cells: Index) -> bool:
    """Whether a place lies in an element, by its corners."""
    corners = x[cells[:, : 3 if cells.shape[1] in (3, 6) else 4]]
    way = np.roll(corners, -1, axis=1) - corners
    to = np.array([point.x, point.y]) - corners
    return bool((cross(way, to) >= 0.0).all(axis=1).any())


def _solid(problem: Problem, tools: Mapping[str, ToolState], around: list[Wall], depth: float, geometry: Any) -> Any:
    """Tools and walls as one shape."""
    pieces = []
    for name, state in tools.items():
        if name in problem.tools:
            made = (geometry.Polygon(p) for p in outlines(problem.tools[name], state, depth))
            pieces += [geometry.make_valid(p) for p in made]
    axis = [Wall(0, 0.0, 1.0)] if problem.space == "axisymmetric" else []
    for wall in [*around, *axis]:
        far = wall.at - wall.side * depth
        a, b = sorted((far, wall.at))
        box = (a, -depth, b, depth) if wall.axis == 0 else (-depth, a, depth, b)
        pieces.append(geometry.box(*box))
    return geometry.union_all(pieces)


def found_at_end(increment: Increment) -> dict[str, Filling]:
    """By body, how far the tools around it are filled in an increment that was read back; nothing where that is not known."""
    problem = increment.problem
    if importlib.util.find_spec("shapely") is None or problem.space == "solid":
        return {}
    section, around = section_of(increment, stored=True), walls(problem, increment.step_number - 1)
    found = {body: filling(problem, increment.tools, section, body, around) for body in problem.bodies}
    return {body: f for body, f in found.items() if f.closed or f.pockets}


# ------------------------------------------------------------------------------------------------------------- measures
def refuse(problem: Problem, text: str) -> None:
    """Raise `MeasureError` for a measure of a die in a problem that has none."""
    shapely()
    if not problem.tools:
        raise MeasureError(f"{text!r} needs a die, and the problem has no tools; describe the tools that enclose the body")


def closed_around(problem: Problem, text: str) -> Iterator[str]:
    """Bodies around which a die has to be closed for the measure of a text, or of a name that the problem gives one, to exist."""
    written = problem.measures.get(text, text)
    yield from (b for b in problem.bodies if re.search(rf"(?<![\w.]){re.escape(b)}\.({'|'.join(FILL)})\b", written))


def measured(problem: Problem, body: str, quantity: str) -> Callable[[Increment], float]:
    """Value of one of `FILL` or `POCKETS`."""
    around = cache(lambda step: walls(problem, step))

    def value(increment: Increment) -> float:
        found = filling(problem, increment.tools, section_of(increment), body, around(increment.step_number - 1))
        if quantity == "pockets":
            return float(len(found.pockets))
        if quantity == "trapped_volume":
            return float(sum(p.volume for p in found.pockets))
        if not found.closed:
            raise MeasureError(
                f"the tools leave an opening, so that no closed die surrounds {body!r} here; add the tool that closes it, or "
                f"take '{body}.trapped_volume', which needs none"
            )
        return {"die_volume": found.die, "missing_volume": found.missing}.get(quantity, 1.0 - found.missing / found.die)

    return value
