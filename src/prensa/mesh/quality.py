"""Shape of the elements of a mesh in numbers: scaled Jacobians and aspect ratios, and where the worst one is.

Scaled Jacobian (P. Knupp 2000): at each corner the sine of the angle between the two sides (the tangents of curved ones),
of a triangle over that of 60°, of a brick the volume spanned by the directions of its three edges; of an element the least of
its corners: 1 is a rectangle, a box or an equilateral triangle, 0 a corner of 0° or 180°, negative one that is turned over.
Corners at which a wedge is collapsed, which are as sharp as the wedge is thin, count where they are turned over.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from prensa.geometry.plane import cross
from prensa.mesh.brick_checks import EDGE_ENDS, TETRAHEDRON_ENDS, corner_edges
from prensa.mesh.bricks import wedges
from prensa.mesh.mesh import CELL_NAMES, CORNERS, Mesh, corner_cells, sides
from prensa.precision import SMALLEST
from prensa.types import Array, Flags, Index

POOR = 0.2  # scaled Jacobian below which an element is out of shape, and its stresses are poor
_MIDDLES = np.array([(4, 6, 7), (5, 4, 8), (6, 5, 9), (8, 7, 9)])
"""Nodes of a tetrahedron in the middle of its sides to `TETRAHEDRON_ENDS`."""
MAX_ASPECT = 50.0  # longest over shortest side above which there is a warning


@dataclass(frozen=True)
class Quality:
    """``jacobian``, ``aspect`` and longest side ``longest`` (m,) of the elements; ``centre`` (m, d)."""

    kind: str
    jacobian: Array
    aspect: Array
    longest: Array
    centre: Array

    @property
    def worst(self) -> int:
        """The element with the least scaled Jacobian."""
        return int(np.argmin(self.jacobian))

    def where(self, e: int) -> str:
        """An element by its number and place."""
        return f"element {e} near ({', '.join(f'{c:.4g}' for c in self.centre[e])})"

    def line(self) -> str:
        """All of it in one line."""
        return (
            f"{self.kind}: scaled Jacobian {self.jacobian.min():.3g} … {self.jacobian.max():.3g}, aspect ratio "
            f"{self.aspect.min():.3g} … {self.aspect.max():.3g}; worst: {self.where(self.worst)}"
        )

    @property
    def needles(self) -> Index:
        """Elements that are so much longer than wide that they lock where they bend."""
        return np.flatnonzero(self.aspect > MAX_ASPECT)

    def warnings(self, even: float, quiet: Array | None = None) -> list[str]:
        """Elements likely to spoil results, each with a remedy.

        Needles spoil nothing whose stresses vary over at least twice their length: ``even`` is the least extent of the body,
        over which it bends, ``quiet`` (k,) how far the `needles` are from what disturbs it.
        """
        messages = []
        bad = int((self.jacobian < POOR).sum())
        if bad:
            least = self.jacobian[self.worst]
            messages.append(
                f"{bad} of {len(self.jacobian)} elements have a scaled Jacobian below {POOR}, the least {least:.2g} is that of "
                f"{self.where(self.worst)}: stresses are poor there; mesh it again with better angles"
            )
        needles = self.needles
        if quiet is not None:
            needles = needles[2.0 * self.longest[needles] > np.minimum(even, quiet)]
        if len(needles):
            k = int(needles[np.argmax(self.aspect[needles])])
            messages.append(
                f"{self.where(k)} is {self.aspect[k]:.3g} times longer than wide: it bends and locks like a needle; use more "
                "elements along its long side or a smaller grading ratio"
            )
        return messages


def quality(mesh: Mesh) -> Quality:
    """Quality of every element of a mesh."""
    if mesh.points.shape[1] == 3:
        x = mesh.points[mesh.cells]
        return _of_tetrahedra(x) if x.shape[1] == 10 else _of_bricks(x, wedges(mesh.cells))
    cells = corner_cells(mesh.cells)
    x, c = mesh.points[cells], CORNERS[mesh.cells.shape[1]]
    after, before = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    length = np.hypot(after[..., 0], after[..., 1])
    if mesh.cells.shape[1] > c:
        middle = mesh.points[sides(mesh.cells)[..., 2]]  # half the tangents at the ends: 4 m − 3 a − b
        after, before = 4 * (middle - x) - after, 4 * (np.roll(middle, 1, axis=1) - x) - before
    sine = cross(after, before) / np.maximum(np.linalg.norm(after, axis=2) * np.linalg.norm(before, axis=2), SMALLEST)
    jacobian = sine.min(axis=1) * (2 / np.sqrt(3.0) if c == 3 else 1.0)
    longest = length.max(axis=1)
    return Quality(CELL_NAMES[mesh.cells.shape[1]], jacobian, longest / length.min(axis=1), longest, x.mean(axis=1))


def _of_tetrahedra(x: Array) -> Quality:
    """Of tetrahedra x (m, 10, 3), over the regular one's, which curved ones may exceed."""
    corners = x[:, :4, None]
    straight, middle = x[:, TETRAHEDRON_ENDS] - corners, x[:, _MIDDLES] - corners
    edges = 4.0 * middle - straight  # tangents at the corner
    length = np.linalg.norm(straight, axis=3)
    corner = np.sqrt(2.0) * np.linalg.det(edges / np.maximum(np.linalg.norm(edges, axis=3), SMALLEST)[..., None])
    longest = length.max(axis=(1, 2))
    return Quality("T10", np.minimum(corner.min(axis=1), 1.0), longest / length.min(axis=(1, 2)), longest, x[:, :4].mean(axis=1))


def _of_bricks(x: Array, wedge: Flags) -> Quality:
    """Of bricks x (m, 8, 3), some of which are collapsed."""
    edges = x[:, EDGE_ENDS] - x[:, :, None]
    length = np.linalg.norm(edges, axis=3)
    there = length > 0.0
    ways = corner_edges(x)
    corner = np.linalg.det(ways / np.maximum(np.linalg.norm(ways, axis=3), SMALLEST)[..., None])
    corner[~there.all(axis=2) & (corner >= 0.0)] = np.inf
    longest = length.max(axis=(1, 2))
    least = np.where(there, length, np.inf).min(axis=(1, 2))
    kind = f"H8, {np.count_nonzero(wedge)} of them wedges" if wedge.any() else "H8"
    return Quality(kind, corner.min(axis=1), longest / least, longest, x.mean(axis=1))
