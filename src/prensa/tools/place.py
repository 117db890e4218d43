"""Tools from descriptions: shape, direction and initial place, including 'touching', 'above' and 'below' a boundary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError
from prensa.mesh.mesh import Mesh
from prensa.tools.analytic import Circle, Flat, Plane, Tool

Array = NDArray[np.float64]


class ToolError(PrensaError):
    """A tool that cannot be placed; the message names it."""


@dataclass(frozen=True)
class PlacedTool:
    """Shape in the tool frame, initial reference point ``at`` (2,), and the face ``direction`` (2,)."""

    name: str
    shape: Tool
    at: Array
    direction: Array
    description: Any


def surface_normal(points: Array, edges: NDArray[np.int64]) -> Array:
    """Mean outward unit normal of oriented edges (k, 2), body on the left."""
    t = points[edges[:, 1]] - points[edges[:, 0]]
    n = np.array([t[:, 1].sum(), -t[:, 0].sum()])
    return n / np.linalg.norm(n)


def _shape(d: Any, direction: Array) -> Tool:
    nx, ny = direction
    match d.type:
        case "plane":
            return Plane(nx, ny)
        case "circle":
            return Circle(d.radius)
        case "stamp":
            return Flat(nx, ny, -0.5 * d.width, 0.5 * d.width, d.fillet)
        case "ring":
            # e = n turned: facing down e = +x, facing up e = −x
            a, b = (d.inner, d.outer) if ny < 0 else (-d.outer, -d.inner)
            return Flat(nx, ny, a, b, d.fillet)
    raise TypeError(f"unknown tool {d!r}")


def gap_along(shape: Tool, at: Array, points: Array, direction: Array, limit: float) -> Array:
    """Distance h (k,) from each point along the unit direction to the tool's surface; inf where the ray misses it.

    Newton on the signed distance along the ray: exact in one step on flats, monotone and quadratic on convex arcs.
    """
    h = np.zeros(len(points))
    miss = np.zeros(len(points), dtype=bool)
    for _ in range(60):
        close = shape.closest(points + h[:, None] * direction - at)
        slope = close.n @ direction
        step = np.where(slope < -1e-9, close.g / np.where(slope < -1e-9, -slope, 1.0), 0.0)
        miss |= (slope >= -1e-9) & (np.abs(close.g) > 1e-12 * limit)
        h = np.where(miss, h, h + step)
        miss |= h > limit
        if (miss | (np.abs(step) <= 1e-15 * limit)).all():
            break
    return np.where(miss, np.inf, h)


def place(name: str, d: Any, meshes: dict[str, Mesh]) -> PlacedTool:
    """Place the tool *d*; see `prensa.Plane` and the others for the meaning of the keys.

    Raises
    ------
    ToolError
        If the tool can never touch the boundary it is to be placed at.

    """
    target = d.touching or d.above or d.below
    outward = np.array([0.0, 1.0])
    if target:
        body, _, edge = target.partition(".")
        mesh = meshes[body]
        mesh.nodes(edge)
        if d.above:
            outward = np.array([0.0, 1.0])
        elif d.below:
            outward = np.array([0.0, -1.0])
        elif edge in mesh.corners:
            raise ToolError(f"tools.{name}: 'touching' needs a boundary; {target!r} is a point")
        else:
            outward = surface_normal(mesh.points, mesh.edges[edge])
    given = getattr(d, "normal", None) if d.type == "plane" else getattr(d, "facing", None)
    direction = np.array(given, dtype=np.float64) if given is not None else -outward
    direction = direction / np.linalg.norm(direction)
    at = np.array(d.at if d.at is not None else (0.0, 0.0), dtype=np.float64)
    shape = _shape(d, direction)
    if not target:
        return PlacedTool(name, shape, at, direction, d)
    points = mesh.points[mesh.nodes(edge)]
    # from far outside, move in along −outward until the first node touches
    size = float(np.ptp(mesh.points, axis=0).max()) + 2.0 * (d.radius if d.type == "circle" else 0.0)
    reach = 10.0 * size + float(np.abs(points - at).max())
    far = at + (reach - at @ outward + (points @ outward).max()) * outward
    gaps = gap_along(shape, far, points, outward, 10.0 * reach)
    if not np.isfinite(gaps).any():
        raise ToolError(
            f"tools.{name}: moving along {(-outward).tolist()} the {d.type} never meets {target!r}; "
            "change 'at' (its position across that direction) or its direction"
        )
    return PlacedTool(name, shape, far - gaps.min() * outward, direction, d)
