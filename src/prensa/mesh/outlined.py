"""Meshes of triangles within an outline of lines and fillets, made by the mesher that remeshing uses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from prensa.geometry.chain import ChainError, Piece, chain, signed_area
from prensa.mesh.convert import Draft, draft_of
from prensa.mesh.mesh import MeshError
from prensa.mesh.outline import GROWTH, Chain, SizeOf, resampled
from prensa.mesh.triangulate import inside, triangulated
from prensa.model import meshes as model
from prensa.types import Array

ARC = 24  # straight pieces of a quarter of a circle
AT_FILLETS = 4.0  # elements along a quarter of a circle, at least


def outlined(m: model.Outline) -> Draft:
    """Draft of a `prensa.Outline`; its mid-side nodes lie on the fillets.

    Raises
    ------
    MeshError
        If the points make no outline, or a hole is not within it or overlaps another.
    TriangulationError
        If the outlines cross or touch.
    PrensaError
        If the mesher is not installed.

    """
    names = m.sides or ("outline",) * len(m.points)
    loops = [_loop(m.points, m.fillet, names, +1)]
    for number, hole in enumerate(m.holes, start=1):
        loops.append(_loop(hole, 0.0, (f"hole-{number}",) * len(hole), -1))
    size = _sizes(m.size, [p for pieces, _ in loops for p in pieces])
    outlines = [resampled(_chains(pieces, own), size) for pieces, own in loops]
    _check_holes(m, [o.ends for o in outlines])
    mesh = triangulated(outlines, size)
    return draft_of(mesh.points, mesh.cells, mesh.edges, {})


def _check_holes(m: model.Outline, rings: list[Array]) -> None:
    """Holes within the outline and outside of one another; rings: polygons (n, 2) of the outline and of each hole."""
    for number, hole in enumerate(m.holes, start=1):
        x = np.array(hole, dtype=np.float64)
        for other, ring in enumerate(rings):
            if other == number:
                continue
            within = inside(x, ring, np.column_stack([np.arange(len(ring)), np.roll(np.arange(len(ring)), -1)]))
            wrong = np.flatnonzero(within if other else ~within)
            if len(wrong):
                where = f"within hole-{other}" if other else "outside of the outline"
                at = x[wrong[0]].tolist()
                raise MeshError(f"point {wrong[0]} of hole-{number}, ({at[0]:.4g}, {at[1]:.4g}), lies {where}")


def _loop(
    points: Sequence[tuple[float, float]], fillet: float | tuple[float, ...], names: Sequence[str], way: int
) -> tuple[list[Piece], list[str]]:  # fmt: skip
    """Lines and arcs of a closed outline, body on the left (way +1: around it, −1: around a hole), and their names."""
    try:
        pieces = chain(points, fillet, closed=True)
        if way * signed_area(pieces) < 0:  # side k, from point k on, is side n − 2 − k of the points turned round
            turned = fillet if isinstance(fillet, float | int) else fillet[::-1]
            names = [*names[-2::-1], names[-1]]
            pieces = chain(points[::-1], turned, closed=True)
    except ChainError as error:
        raise MeshError(str(error)) from None
    return pieces, [names[p.point] for p in pieces]


def _chains(pieces: list[Piece], names: list[str]) -> list[Chain]:
    """Pieces of an outline as chains of short straight edges."""
    out = []
    for p, name in zip(pieces, names):
        n = max(1, round(ARC * p.length / (0.5 * np.pi * p.radius))) if p.radius else 1
        x = np.array([p.at(p.lo + (p.hi - p.lo) * k / n) for k in range(n + 1)])
        edges = np.stack([np.arange(n), np.arange(1, n + 1)], axis=1)
        out.append(Chain(edges, x, frozenset({name})))
    return out


def _sizes(size: float, pieces: list[Piece]) -> SizeOf:
    """Sizes of elements: as asked for, less at fillets that are smaller."""
    small = [p for p in pieces if p.radius and 0.5 * np.pi * p.radius / AT_FILLETS < size]
    if not small:
        return lambda x: np.full(len(x), size)
    places = np.array([p.at(p.lo + (p.hi - p.lo) * k / 8) for p in small for k in range(9)])
    there = np.repeat([0.5 * np.pi * p.radius / AT_FILLETS for p in small], 9)

    def of(x: Array) -> Array:
        way = np.hypot(x[:, None, 0] - places[:, 0], x[:, None, 1] - places[:, 1])
        return np.asarray(np.minimum((there + GROWTH * way).min(axis=1), size))

    return of
