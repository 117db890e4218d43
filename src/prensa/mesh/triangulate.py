"""Triangles between given outlines, by MMG2D (Dapogny, Dobrzynski & Frey 2014), with sizes from a field."""

from __future__ import annotations

import importlib
import importlib.util
from itertools import pairwise
from typing import Any

import numpy as np

from prensa.errors import PrensaError
from prensa.mesh import signals
from prensa.mesh.crossing import meeting
from prensa.mesh.mesh import POINTS_AT_ONCE, Mesh, keys, sides
from prensa.mesh.outline import GROWTH, NewOutline, SizeOf
from prensa.precision import NEGLIGIBLE
from prensa.types import Array, Flags, Index

NO_MESHER = "'remesh' needs the mesher MMG, which is not installed: pip install 'prensa[remesh]'"


class TriangulationError(PrensaError):
    """Outlines between which no mesh can be made."""


def has_mesher() -> bool:
    """Whether MMG is installed, and what makes its first triangles where it cannot."""
    return all(importlib.util.find_spec(name) is not None for name in ("mmgpy", "shapely"))


def mesher() -> Any:
    """The class of MMG2D.

    Raises
    ------
    PrensaError
        If it is not installed.

    """
    # Triangles: of quadrilaterals by recombination one in a hundred was nearly folded, and their mesher has a copyleft licence.
    return _library("mmgpy").MmgMesh2D


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise PrensaError(NO_MESHER) from None


def triangulated(outlines: list[NewOutline], size: SizeOf) -> Mesh:
    """Mesh of T6 inside closed outlines (the others are holes), sizes inside from a field; outline nodes as they are given.

    Raises
    ------
    TriangulationError
        If the outlines cross or touch, or MMG finds no mesh.

    """
    points = np.concatenate([o.ends for o in outlines])
    first = np.cumsum([0, *(len(o.ends) for o in outlines)])
    edges = np.concatenate([_closed(a, b) for a, b in pairwise(first)])
    met = meeting(points, edges)  # MMG may look for such a mesh for ever
    if met is not None:
        raise TriangulationError(f"the outline crosses or touches itself, or a hole, near ({met[0]:.4g}, {met[1]:.4g})")
    vertices, triangles = _triangles(points, edges, size)
    middles = np.concatenate([o.middles for o in outlines])
    names = [name for o in outlines for name in o.names]
    return _quadratic(vertices, triangles, edges, middles, names)


def _closed(first: int, last: int) -> Index:
    n = np.arange(first, last)
    return np.stack([n, np.roll(n, -1)], axis=1)


def _triangles(points: Array, edges: Index, size: SizeOf) -> tuple[Array, Index]:
    """Vertices, those of the outline first and in order, and triangles (m, 3) counter-clockwise."""
    n = len(points)
    length = np.hypot(*(points[edges[:, 1]] - points[edges[:, 0]]).T)
    h = np.zeros(n)
    np.add.at(h, edges, 0.5 * length[:, None])
    try:
        # A first mesh with the sizes of the outline gives places at which the field can be asked; the second follows it.
        mesh = _given(points, _between(points, edges), edges, h)
        with signals.kept():
            mesh.remesh(hgrad=1 + GROWTH, verbose=-1, nosurf=1)
        vertices = mesh.get_vertices()
        target, number = size(vertices), _numbers(vertices, points)
        target[number] = h  # at the outline sizes are those of its sides
        mesh["metric"] = np.ascontiguousarray(target[:, None])  # MMG clears megabytes for every mesh: the same one goes on
        with signals.kept():
            mesh.remesh(hgrad=1 + GROWTH, hgradreq=1 + GROWTH, verbose=-1, nosurf=1)
    except RuntimeError as error:
        raise TriangulationError(f"MMG makes no mesh of the outline ({error})") from None
    return _ordered(mesh.get_vertices(), mesh.get_triangles().astype(np.int64), points, edges)


def _between(points: Array, edges: Index) -> Index | None:
    """Triangles between the nodes of outlines alone, where those that MMG begins with lack sides of the outlines; else None.

    MMG (to 5.8) exchanges edges at random until the sides are there, for ever in long narrow corners.
    """
    from scipy.spatial import Delaunay

    given = sides(Delaunay(points).simplices.astype(np.int64)).reshape(-1, 2)
    n = len(points)
    if np.isin(keys(edges, n), keys(given, n)).all():
        return None
    shapely = _library("shapely")
    first = np.concatenate([[0], np.flatnonzero(edges[:, 1] < edges[:, 0]) + 1])
    rings = sorted(
        (shapely.LinearRing(points[edges[a:b, 0]]) for a, b in pairwise(first)),
        key=lambda ring: -shapely.area(shapely.Polygon(ring)),
    )
    whole = shapely.Polygon(rings[0], rings[1:])
    corners = shapely.get_coordinates(shapely.constrained_delaunay_triangles(whole)).reshape(-1, 4, 2)[:, :3]
    number = {(x, y): k for k, (x, y) in enumerate(points.tolist())}
    return np.array([[number[x, y] for x, y in corner] for corner in corners.tolist()], dtype=np.int64)


def _given(vertices: Array, triangles: Index | None, edges: Index, h: Array) -> Any:
    """A mesh of MMG with the edges of the outline to be kept, and sizes h at the vertices."""
    mesh = mesher()()
    mesh.set_mesh_size(vertices=len(vertices), triangles=0 if triangles is None else len(triangles), edges=len(edges))
    mesh.set_vertices(np.ascontiguousarray(vertices))
    if triangles is not None:
        mesh.set_triangles(triangles.astype(np.int32))
    mesh.set_edges(edges.astype(np.int32), np.arange(1, len(edges) + 1))
    mesh.set_required_edges(np.arange(len(edges), dtype=np.int32))
    mesh.set_required_vertices(np.unique(edges).astype(np.int32))
    mesh["metric"] = np.ascontiguousarray(h[:, None])
    return mesh


def _numbers(vertices: Array, points: Array) -> Index:
    """Numbers (k,) of the vertices at points (k, 2)."""
    from scipy.spatial import cKDTree

    distance, number = cKDTree(vertices).query(points)
    if not distance.max() < NEGLIGIBLE * np.ptp(points):
        raise TriangulationError("MMG moved nodes of the outline: it crosses or touches itself")
    return np.asarray(number, dtype=np.int64)


def _ordered(vertices: Array, triangles: Index, points: Array, edges: Index) -> tuple[Array, Index]:
    # Holes have been meshed too.
    triangles = triangles[inside(vertices[triangles].mean(axis=1), points, edges)]
    own = _numbers(vertices, points)
    number = np.full(len(vertices), -1)
    number[own] = np.arange(len(points))
    rest = np.setdiff1d(np.unique(triangles), own)
    number[rest] = len(points) + np.arange(len(rest))
    triangles = number[triangles]
    x = np.concatenate([points, vertices[rest]])
    a, b, c = (x[triangles[:, k]] for k in range(3))
    clockwise = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) < (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    triangles[clockwise] = triangles[clockwise][:, [0, 2, 1]]
    return x, triangles


def inside(x: Array, points: Array, edges: Index) -> Flags:
    """Whether places x (n, 2) are inside the outlines and outside of their holes: crossings of a ray along +x."""
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    out = np.empty(len(x), dtype=bool)
    step = max(POINTS_AT_ONCE // max(len(edges), 1), 1)
    for k in range(0, len(x), step):
        y = x[k : k + step, 1:2]
        # Half-open, so that a ray through a node crosses one of its two edges and not both.
        spans = (a[:, 1] <= y) != (b[:, 1] <= y)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
        out[k : k + step] = (spans & (at > x[k : k + step, 0:1])).sum(axis=1) % 2 == 1
    return out


def _quadratic(x: Array, triangles: Index, edges: Index, middles: Array, names: list[frozenset[str]]) -> Mesh:
    """T6 of triangles; sides on the outline have their middles on it."""
    n = len(x)
    pairs = sides(triangles)
    every = np.unique(keys(pairs, n))
    between = x[np.stack([every // n, every % n], axis=1)].mean(axis=1)
    here = np.searchsorted(every, keys(edges, n))
    if (here >= len(every)).any() or (every[np.minimum(here, len(every) - 1)] != keys(edges, n)).any():
        raise TriangulationError("MMG lost sides of the outline: it crosses or touches itself")
    between[here] = middles
    cells = np.concatenate([triangles, n + np.searchsorted(every, keys(pairs, n))], axis=1)
    along = np.concatenate([edges, (n + here)[:, None]], axis=1)
    wanted = sorted(set().union(*names))
    return Mesh(np.concatenate([x, between]), cells, {name: along[[name in own for own in names]] for name in wanted})
