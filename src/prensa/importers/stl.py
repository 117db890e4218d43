"""Triangulated surfaces of STL files: read, points of neighbours joined, triangles turned to look the same way."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from prensa.errors import coordinates
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.types import Array, Flags, Index

TEXT = frozenset((*range(9, 14), *range(32, 127)))
"""Bytes of which a text is made."""
BINARY_HEADER, BINARY_TRIANGLE = 84, 50
"""Bytes of a binary file before its triangles, the last four of them their number, and of each triangle."""


@dataclass(frozen=True)
class Surface:
    """A triangulated surface in the lengths of its file.

    ``points`` (n, 3); ``triangles`` (m, 3), counter-clockwise seen from outside. ``edges`` (k, 2): pairs of points; ``sides``
    (k, 2): the two triangles at each edge, the second −1 at an open border. ``turned``: triangles that looked the other way than
    most of their neighbours; ``left_out``: those without an area; ``doubled``: those that were there twice; ``parts``: pieces
    that share no edge.
    """

    points: Array
    triangles: Index
    edges: Index
    sides: Index
    turned: int
    left_out: int
    doubled: int
    parts: int

    @property
    def closed(self) -> bool:
        """Whether it has no open border."""
        return bool((self.sides[:, 1] >= 0).all())

    @property
    def volume(self) -> float:
        """What it encloses, negative where its normals look inwards."""
        a, b, c = (self.points[self.triangles[:, i]] for i in range(3))
        return float(np.einsum("mi,mi->", a, np.cross(b, c))) / 6.0

    def reversed(self) -> Surface:
        """With all normals the other way."""
        return Surface(
            self.points, self.triangles[:, ::-1].copy(), self.edges, self.sides, self.turned, self.left_out, self.doubled,
            self.parts,
        )  # fmt: skip


@lru_cache(maxsize=8)
def read(path: str, digest: str) -> Surface:
    """The surface of an STL file, text or binary; ``digest`` of its contents.

    Raises
    ------
    ValueError
        If it cannot be read, has no triangles, or edges of more than two, or cannot be turned to look one way.

    """
    import meshio

    name = Path(path).name
    _refuse_cut_off(name, Path(path))
    try:
        with np.errstate(over="ignore"):  # of a number of triangles that it finds in the middle of a text
            mesh = meshio.stl.read(path)
        points, triangles = np.array(mesh.points, dtype=np.float64), np.array(mesh.get_cells_type("triangle"))
    except Exception:  # of a damaged file it may be any
        raise ValueError(
            f"{name!r} is not an STL file that can be read, neither as text nor as binary; export it again"
        ) from None
    if not len(triangles):
        raise ValueError(f"{name!r} has no triangles; is it an STL file of a surface or body?")
    if not np.isfinite(points).all():
        raise ValueError(f"{name!r} has coordinates that are not finite numbers; export it again")
    return joined(name, points, triangles.astype(np.int64))


def _refuse_cut_off(name: str, path: Path) -> None:
    """Refuse a binary file that ends before the triangles whose number is in its header (84 bytes, then 50 for each).

    Raises
    ------
    ValueError
        If it does.

    """
    with path.open("rb") as file:
        head = file.read(2048)
    if len(head) < BINARY_HEADER or not set(head) - TEXT:
        return
    said = int.from_bytes(head[BINARY_HEADER - 4 : BINARY_HEADER], "little")
    there = (path.stat().st_size - BINARY_HEADER) // BINARY_TRIANGLE
    if there < said:
        raise ValueError(f"{name!r} is cut off: its header says {said} triangles, and {there} are in it; export or copy it again")


def text(s: Surface, name: str) -> str:
    """The surface as an STL file in text."""
    rows = [f"solid {name}"]
    for corners in s.points[s.triangles]:
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal = normal / np.linalg.norm(normal)
        rows.append(f"facet normal {' '.join(f'{c:.9g}' for c in normal)}\nouter loop")
        rows += (f"vertex {' '.join(f'{c:.12g}' for c in x)}" for x in corners)
        rows.append("endloop\nendfacet")
    return "\n".join([*rows, f"endsolid {name}", ""])


def joined(name: str, points: Array, triangles: Index) -> Surface:
    """The surface of triangles (m, 3) on points (n, 3), those at one place joined, turned to look one way.

    Raises
    ------
    ValueError
        If they have no area, more than two meet in an edge, or they cannot be turned to look one way.

    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    size = float(np.ptp(points, axis=0).max())
    near = cKDTree(points).query_pairs(DRAWN * size, output_type="ndarray")
    graph = coo_array((np.ones(len(near)), near.T), shape=(len(points),) * 2)
    group = connected_components(graph, directed=False)[1]
    _, first, group = np.unique(group, return_index=True, return_inverse=True)
    points, triangles = points[first], group.ravel()[triangles]
    a = points[triangles]
    area = np.linalg.norm(np.cross(a[:, 1] - a[:, 0], a[:, 2] - a[:, 0]), axis=1)
    good = area > NEGLIGIBLE * DRAWN * size**2
    good &= (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    left_out, triangles = int((~good).sum()), triangles[good]
    if not len(triangles):
        raise ValueError(f"the triangles of {name!r} have no area; export it again")
    single = np.sort(np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)[1])
    doubled, triangles = len(triangles) - len(single), triangles[single]
    edges, sides, way = _edges(name, points, triangles)
    flip, parts = _orientation(name, points, len(triangles), edges, sides, way)
    triangles = np.where(flip[:, None], triangles[:, ::-1], triangles)
    return Surface(points, triangles, edges, sides, int(flip.sum()), left_out, doubled, parts)


def _edges(name: str, points: Array, triangles: Index) -> tuple[Index, Index, Flags]:
    """Edges (k, 2), triangles at them (k, 2), and whether both walk along them the same way."""
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(triangles)), 3)
    edges, inverse, count = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    if count.max() > 2:
        at = coordinates(points[edges[np.argmax(count)]].mean(axis=0))
        raise ValueError(
            f"{count.max()} triangles of {name!r} meet in one edge, near ({at}) of the file: it is not a surface of a body; "
            "export the one body or side that is the tool"
        )
    order = np.argsort(inverse.ravel(), kind="stable")
    start = np.cumsum(count) - count
    first, second = order[start], order[np.minimum(start + 1, len(order) - 1)]
    two = count == 2
    sides = np.stack([owner[first], np.where(two, owner[second], -1)], axis=1)
    return edges, sides, two & (ends[first, 0] == ends[second, 0])


def _orientation(
    name: str, points: Array, m: int, edges: Index, sides: Index, same_way: Flags
) -> tuple[Flags, int]:
    """Which triangles (m,) to turn so that neighbours walk along their edges in opposite ways, the fewer of each part; parts."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    inner = sides[:, 1] >= 0
    a, b, turns = sides[inner, 0], sides[inner, 1], same_way[inner]
    # Two copies of each triangle, as it is and turned: what must go together is connected.
    rows = np.concatenate([a, a + m])
    columns = np.concatenate([np.where(turns, b + m, b), np.where(turns, b, b + m)])
    found = connected_components(coo_array((np.ones(len(rows)), (rows, columns)), shape=(2 * m, 2 * m)), directed=False)[1]
    if (bad := np.flatnonzero(found[:m] == found[m:])).size:
        at = coordinates(points[edges[inner][np.isin(a, bad)][0]].mean(axis=0))
        raise ValueError(f"the surface of {name!r} has one side only (near ({at}) of the file): it bounds no tool")
    part = np.minimum(found[:m], found[m:])
    mine = found[:m] == part
    # Of the two ways the one of more triangles.
    keep = np.bincount(part, weights=np.where(mine, 1.0, -1.0)) >= 0.0
    return mine != keep[part], len(np.unique(part))
