"""Tools from descriptions: shape, direction and initial place, including 'touching', 'above' and 'below' a boundary."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from prensa.errors import PrensaError, along, coordinates
from prensa.geometry.plane import ONE_NORMAL
from prensa.geometry.sections import section_axes
from prensa.mesh.faces import area_normals, first_met
from prensa.mesh.mesh import Mesh
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.tools.analytic import Tool
from prensa.tools.tool import ToolShape
from prensa.types import Array, Index

DIRECTIONS = 36  # in which the width of a tool is taken
FACING = 0.5  # cosine of the angle between the mean normal and a tool's way up to which the tool goes towards the boundary


class ToolError(PrensaError):
    """A tool that cannot be placed; the message names it."""


@dataclass(frozen=True)
class PlacedTool:
    """A rigid body: its shape in the tool frame, initial reference point ``at`` (d,), and the face ``direction`` (d,)."""

    name: str
    shape: Tool
    at: Array
    direction: Array
    description: ToolShape

    @cached_property
    def thickness(self) -> float:
        """Least width of what the tool's surface spans, in any direction; infinite where it has no end that may be sharp."""
        angles = np.linspace(0.0, np.pi, DIRECTIONS, endpoint=False)
        return min(self.shape.across(np.array([np.cos(a), np.sin(a)]), 0.0)[1] for a in angles)


def surface_normal(points: Array, sides: Index) -> Array:
    """Mean outward unit normal (d,) of oriented edges (k, 2) or faces (k, 4); see `area_normals`."""
    n = area_normals(points, sides).sum(axis=0)
    return np.asarray(n / np.linalg.norm(n))


def side_of(name: str, target: str, points: Array, edges: Index) -> Array:
    """`surface_normal` of the boundary that tool *name* is to touch; `ToolError` if it ends where it begins and has none."""
    n = area_normals(points, edges)
    if np.linalg.norm(n.sum(axis=0)) <= NEGLIGIBLE * np.linalg.norm(n, axis=1).sum():
        raise ToolError(
            f"tools.{name}: 'touching: {target}' does not say on which side: that boundary runs all around and has no mean "
            f"normal; give 'above: {target}', 'below: {target}' or 'at'"
        )
    return surface_normal(points, edges)


def against(points: Array, edges: Index, mean: Array, way: Array | None) -> Array:
    """Where a tool stands that is to touch a boundary: along its normal, or against the tool's ``way`` where it is curved.

    A curved or kinked boundary has no one normal. ``way`` (d,): unit vector of the tool's first travel; None: it is not known.
    """
    normals = area_normals(points, edges)
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    straight = (normals @ mean >= ONE_NORMAL).all()
    return mean if straight or way is None or -(way @ mean) < FACING else -way


def _endwise(d: ToolShape, outward: Array) -> str:
    """What to say of a tool whose axis points at the boundary, where it has no end."""
    axis = np.array(getattr(d, "axis", np.zeros(len(outward))), dtype=np.float64)
    length = float(np.linalg.norm(axis))
    if d.type != "extruded" or abs(axis @ outward) < (1.0 - NEGLIGIBLE) * length:
        return ""
    return "its 'axis' points at the boundary, and along it the tool has no end that could press: lay 'axis' along the boundary"


def _to_fit(d: ToolShape, way: Array) -> str:
    """What to change of a tool, moved along ``way`` (d,), that a boundary does not fit into."""
    drawn = getattr(d, "section", d)
    if getattr(drawn, "concave", False):
        return "change its shape or 'at', or leave 'concave' out of a tool that is to press from outside"
    if hasattr(drawn, "points"):
        return "change its shape, 'at', or the order of its points (walk along them with the tool on the left)"
    return f"change its shape or 'at'{d.hint(way)}"


class _Way(NamedTuple):
    """A tool on its way from ``start`` (d,) along -outward (d,) to the nodes of a boundary, with its ``faces`` (k, 2 | 4)."""

    shape: Tool
    start: Array
    outward: Array
    faces: Index
    reach: float

    def gaps(self, points: Array, back: bool = False) -> Array:
        """How far the tool goes until it touches points (k, d), infinite if it does not; ``back``: from the far side."""
        start = self.start - 2.0 * back * self.reach * self.outward
        return self.shape.along(points - start, -self.outward if back else self.outward, 10.0 * self.reach)

    def why_missed(self, d: ToolShape, direction: Array, points: Array, mesh: Mesh) -> str:
        """Why a tool in space that is no plane misses all points (k, 3) of the boundary; '' if that is not known."""
        if len(self.outward) == 2 or self.shape.half_space:
            return ""
        looks = d.presented(self.shape)
        # What looks the other way would be met from the far side, what looks aside from neither.
        if (looks is not None and abs(looks @ self.outward) < FACING) or np.isfinite(self.gaps(points, back=True)).any():
            return ""
        x = d.facets(direction, self.reach)[0] + self.start
        corners = mesh.points[self.faces[:, [(0, 1, 2), (0, 2, 3)]].reshape(-1, 3)]
        met, far = first_met(x, np.broadcast_to(-self.outward, x.shape), corners)
        if (met >= 0).any():
            place = coordinates((x - far[:, None] * self.outward)[np.argmax(met >= 0)])
            return f": it goes in between its nodes, as at ({place}), where elements are to be shorter"
        for axis in section_axes(self.outward).T if len(x) else ():
            (a, b), (low, high) = ((float((v @ axis).min()), float((v @ axis).max())) for v in (x, points))
            if a > high or b < low:
                there = f"from {a:.4g} to {b:.4g} along {along(axis)} where that is from {low:.4g} to {high:.4g}"
                return f": it passes beside it, {there}"
        return ""


def _never_met(name: str, d: ToolShape, target: str, why: str, outward: Array) -> ToolError:
    change = _endwise(d, outward) or f"change 'at' (its position across that direction) or its direction{d.hint(-outward)}"
    return ToolError(f"tools.{name}: moving along {along(-outward)} the {d.type} tool never meets {target!r}{why}; {change}")


def _misfit(name: str, d: ToolShape, target: str, points: Array, g: Array, shape: Tool, outward: Array) -> ToolError:
    """Of a tool with gaps g (k,) from points (k, d) of the boundary that it touches."""
    k, looks = int(np.argmin(g)), d.presented(shape)
    change = _to_fit(d, -outward)
    if looks is not None and looks @ outward < -FACING:
        change += ", or export the whole tool if it is an open border that presses there"
    return ToolError(
        f"tools.{name}: moved along {along(-outward)} until it touches {target!r}, the {d.type} tool has the node at "
        f"({', '.join(f'{v:g}' for v in points[k])}) inside by {-g[k]:.3g}: the boundary does not fit into it; {change}"
    )


def place(
    name: str, d: ToolShape, meshes: dict[str, Mesh], rounding: float = 0.0, way: Array | None = None
) -> PlacedTool:  # fmt: skip
    """Place the tool *d*; see `prensa.Plane` and the others for the meaning of the keys.

    ``rounding``: radius of the corners of a profile or polygon that has no fillets of its own. ``way``: see `against`.

    Raises
    ------
    ToolError
        If the tool can never touch the boundary it is to be placed at, or stands in it when it does.

    """
    target = d.touching or d.above or d.below
    dimension = next((mesh.points.shape[1] for mesh in meshes.values()), 2 if d.at is None else len(d.at))
    outward = np.eye(dimension)[1]
    if target:
        body, _, edge = target.partition(".")
        mesh = meshes[body]
        mesh.nodes(edge)
        if d.above:
            outward = np.eye(dimension)[1]
        elif d.below:
            outward = -np.eye(dimension)[1]
        elif edge in mesh.corners:
            raise ToolError(f"tools.{name}: 'touching' needs a boundary; {target!r} is a point")
        else:
            edges = mesh.edges[edge][:, : 2 * (dimension - 1)]
            outward = against(mesh.points, edges, side_of(name, target, mesh.points, edges), way)
    direction = d.looks(outward)
    at = np.array(d.at if d.at is not None else np.zeros(dimension), dtype=np.float64)
    shape = d.shape(direction, rounding)
    if not target:
        return PlacedTool(name, shape, at, direction, d)
    points = mesh.points[mesh.nodes(edge)]
    size = float(mesh.extent.max()) + 2.0 * shape.extent
    reach = 10.0 * size + float(np.abs(points - at).max())
    if shape.cavity:
        # around the boundary, until the first node touches the far wall
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        start = at + ((middle - at - shape.centre) @ outward) * outward
    else:
        # from far outside, move in along −outward until the first node touches
        start = at + (reach - at @ outward + (points @ outward).max()) * outward
    moved = _Way(shape, start, outward, mesh.edges.get(edge, np.zeros((0, 4), dtype=np.int64)), reach)
    gaps = moved.gaps(points)
    endwise = _endwise(d, outward) != ""
    if endwise or not np.isfinite(gaps).any():
        raise _never_met(name, d, target, "" if endwise else moved.why_missed(d, direction, points, mesh), outward)
    where = start - gaps.min() * outward
    g = shape.closest(points - where).g
    if g.min() < -DRAWN * size:
        raise _misfit(name, d, target, points, g, shape, outward)
    return PlacedTool(name, shape, where, direction, d)
