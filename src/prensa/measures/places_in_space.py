"""Places of bodies in space: on their sides where two coordinates have values, inside where all three have, nodes, cuts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from prensa.measures.bodies import Place
from prensa.measures.measure import MeasureError
from prensa.measures.outline import Spot
from prensa.mesh.bricks import around_faces, every_face
from prensa.mesh.faces import located, shapes
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.types import Array, Index

if TYPE_CHECKING:
    from prensa.result.increment import Shape


@dataclass(frozen=True)
class PlaceInSpace(Place):
    """A place of a body in space; ``levels``: coordinates (axis, value) of the deformed or, in capitals, the undeformed body.

    Two of them on a side, or on the whole outside, are places on its faces; three of a body are a place inside, in the
    element that contains it; one is a cut through a side, at the edges of whose elements places are.
    """

    levels: tuple[tuple[str, float], ...] = ()

    def __str__(self) -> str:
        if self.near is not None:
            return f"{self.outline} near ({', '.join(f'{c:g}' for c in self.near)})"
        return f"{self.outline.body}.{self.point}" if self.point else f"{self.outline} at {self._level}"

    @property
    def _level(self) -> str:
        return ", ".join(f"{axis}={value:g}" for axis, value in self.levels)

    @property
    def inside(self) -> bool:
        """Whether it is a place in the body, not on its outside."""
        return len(self.levels) == 3

    def along(self, shape: Shape, x: Array | None = None) -> str:
        """Never: see `spots`, which say of sides on which the coordinates name no place."""
        return ""

    def spots(self, shape: Shape, x: Array) -> list[Spot]:
        """All the places of the description."""
        if self.point or self.near is not None:
            return super().spots(shape, x)
        material = self.axis.isupper()
        axes = ["xyz".index(axis.lower()) for axis, _ in self.levels]
        values, level = (shape.X if material else x)[:, axes], np.array([value for _, value in self.levels])
        if len(axes) == 1:
            return self._cut(shape, x, values[:, 0], axes[0], material)
        cells = shape.cells if self.inside else self.outline.edges(shape)
        found = _distinct(x, _spots(cells, *located(values[cells], level)))
        if not found:
            ends = zip(self.levels, values[cells].min(axis=(0, 1)), values[cells].max(axis=(0, 1)))
            lies = ", ".join(f"{axis} = {low:.6g} … {high:.6g}" for (axis, _), low, high in ends)
            raise MeasureError(f"no place of {self.outline} is at {self._level}: it lies at {lies}{self._in}{self._remedy}")
        return found

    @property
    def _remedy(self) -> str:
        return "" if self.inside else "; on a side give the two coordinates that change along it"

    def _cut(self, shape: Shape, x: Array, values: Array, axis: int, material: bool) -> list[Spot]:
        """Where edges of the elements of a side meet the level of one coordinate."""
        faces = self.outline.edges(shape)
        edges, N = crossed(_edges(faces), values, self.levels[0][1])
        if not len(edges):
            low, high = values[faces].min(), values[faces].max()
            raise MeasureError(f"{self.outline} does not reach {self._level}: it lies at {low:.6g} … {high:.6g}{self._in}")
        zero, slide = np.zeros(2), np.zeros((2, 3))
        return [Spot(nodes, n, zero, zero, slide) for nodes, n in zip(edges, N)]

    def through(self, shape: Shape, x: Array) -> tuple[Index, Array]:
        """Nodes (k, a) and weights (k, a) of places all over a cut: of a side, or of the body, where it is a plane or a line.

        They are where the edges of the elements pass the plane, and where the line passes their faces.
        """
        material = self.axis.isupper()
        axes = ["xyz".index(axis.lower()) for axis, _ in self.levels]
        values, level = (shape.X if material else x)[:, axes], np.array([value for _, value in self.levels])
        sides = self.outline.edges(shape) if self.outline.boundary else every_face(shape.cells)
        if len(axes) == 1:
            nodes, N = crossed(_edges(sides), values[:, 0], float(level[0]))
        else:
            elements, at = located(values[sides], level)
            nodes, N = sides[elements], shapes(at, sides.shape[1])[0]
        if not len(nodes):
            raise MeasureError(f"{self.outline} does not reach {self._level}")
        return nodes, N

    def spot(self, shape: Shape, x: Array) -> Spot:
        """The one place of the description."""
        found = self.spots(shape, x)
        if len(found) > 1:
            there = "; ".join(", ".join(f"{c:.6g}" for c in p.of(x)) for p in found[:3])
            raise MeasureError(
                f"{self.outline} is at {self._level} in {len(found)} places, ({there}){self._in}; name a side and the two "
                "coordinates that change along it, or the one that is meant: 'max.y' or 'min.y'"
            )
        return found[0]


def _edges(faces: Index) -> Index:
    """Edges (k, 2) of faces (m, 4), each once; of six nodes (m, 6) the halves between neighbours."""
    ring = around_faces(faces)
    pairs = np.stack([ring, np.roll(ring, -1, axis=1)], axis=-1).reshape(-1, 2)
    return np.unique(np.sort(pairs, axis=1), axis=0)


def crossed(edges: Index, values: Array, level: float) -> tuple[Index, Array]:
    """Of edges (k, 2) those on which nodal values (n,) take the ``level``, and the shares of their ends there."""
    first, last = (values[edges] - level).T
    close = NEGLIGIBLE * float(np.ptp(values))
    on = (np.abs(first) <= close) & (np.abs(last) <= close)
    passes = ~on & (np.minimum(first, last) <= close) & (np.maximum(first, last) >= -close)
    share = np.clip(first[passes] / (first - last)[passes], 0.0, 1.0)
    ends = [np.tile(end, (int(on.sum()), 1)) for end in ([1.0, 0.0], [0.0, 1.0])]  # an edge on the level is there with both
    N = np.concatenate([np.stack([1.0 - share, share], axis=1), *ends])
    return np.concatenate([edges[passes], edges[on], edges[on]]), N


def _spots(cells: Index, elements: Index, at: Array) -> list[Spot]:
    """Places (k, d) in elements (k,) of cells."""
    N, zero = shapes(at, cells.shape[1])[0], np.zeros(cells.shape[1])
    return [Spot(cells[e], n, zero, zero, np.zeros((cells.shape[1], 3))) for e, n in zip(elements, N)]


def _distinct(x: Array, spots: list[Spot]) -> list[Spot]:
    """Those that are not at the same place as one before."""
    size = DRAWN * float(np.ptp(x, axis=0).max())
    out: list[Spot] = []
    for s in spots:
        if all(np.abs(s.of(x) - other.of(x)).max() > size for other in out):
            out.append(s)
    return out
