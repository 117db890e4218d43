"""Triangulated surfaces of STL files: read, points of neighbours joined, triangles turned to look the same way."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from prensa.errors import coordinates
from prensa.importers import stl_files
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.types import Array, Flags, Index


@dataclass(frozen=True)
class Surface:
    """A triangulated surface in the lengths of its file.

    ``points`` (n, 3); ``triangles`` (m, 3), counter-clockwise seen from outside. ``edges`` (k, 2): pairs of points; ``sides``
    (k, 2): the two triangles at each edge, the second −1 at an open border. ``turned``: triangles that looked the other way than
    most of the others; ``left_out``: those without an area; ``doubled``: those that were there twice; ``parts``: pieces
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
    def holes(self) -> Index:
        """Edges (h,) at the borders of a surface that looks all ways, and that triangles like those there would close."""
        x = self.points[self.triangles]
        areas = 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        border = np.flatnonzero(self.sides[:, 1] < 0)
        missing, each = float(np.linalg.norm(areas.sum(axis=0))), np.linalg.norm(areas, axis=1)
        small = missing < min(each[np.unique(self.sides[border, 0])].sum(), 0.5 * each.sum())
        return border if small else border[:0]

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
        If it cannot be read, has no triangles, or they do not hang together, more than two meet in an edge, or they cannot be
        turned to look one way.

    """
    name = Path(path).name
    corners = stl_files.corners(Path(path)).reshape(-1, 3)
    if not len(corners):
        raise ValueError(f"{name!r} has no triangles; is it an STL file of a surface or body?")
    points, triangles = np.unique(corners, axis=0, return_inverse=True)
    return joined(name, points, triangles.reshape(-1, 3))


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
    if left_out > len(triangles):
        raise ValueError(
            f"{left_out} of {len(good)} triangles of {name!r} have no area beside its size of {size:.3g}: export it again, "
            "without points that are far away"
        )
    single = np.sort(np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)[1])
    doubled, triangles = len(triangles) - len(single), triangles[single]
    edges, sides, way = _edges(name, points, triangles)
    flip, part = _orientation(name, points, len(triangles), edges, sides, way)
    parts = len(np.unique(part))
    if 2 * parts > max(len(triangles), 2):
        raise ValueError(
            f"the {len(triangles)} triangles of {name!r} are in {parts} parts that share no edge: it is not a surface; export it "
            "again with its vertices merged, or with more digits"
        )
    triangles = np.where(flip[:, None], triangles[:, ::-1], triangles)
    other = _inside_out(points, triangles, part, sides)
    triangles = np.where(other[:, None], triangles[:, ::-1], triangles)
    surface = Surface(points, triangles, edges, sides, int((flip != other).sum()), left_out, doubled, parts)
    if surface.closed and 2.0 * abs(surface.volume) < DRAWN * size * area[good].sum():
        raise ValueError(
            f"the closed surface of {name!r} encloses nothing beside its size of {size:.3g}: its sides lie on each other; export "
            "the one side that presses, or the body with its thickness"
        )
    return surface


def _inside_out(points: Array, triangles: Index, part: Index, sides: Index) -> Flags:
    """Triangles (m,) of closed parts (m,) that are not oriented as the largest one, and are no cavity in another one.

    Of two that are as large it is the one that looks outwards.
    """
    _, part = np.unique(part, return_inverse=True)
    count = part.max() + 1
    is_open = np.bincount(part[sides[sides[:, 1] < 0, 0]], minlength=count) > 0
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    x = points[triangles]
    np.minimum.at(low, part, x.min(axis=1))
    np.maximum.at(high, part, x.max(axis=1))
    x = x - low[part][:, None]
    volume = np.bincount(part, weights=np.einsum("mi,mi->m", x[:, 0], np.cross(x[:, 1], x[:, 2])))
    size = np.where(is_open, 0.0, np.abs(volume))
    wrong = (volume * volume[np.argmax(size * np.where(volume > 0.0, 1.0 + DRAWN, 1.0))] < 0.0) & ~is_open
    for k in np.flatnonzero(wrong):
        around = (size > size[k]) & (low < low[k]).all(axis=1) & (high > high[k]).all(axis=1)
        wrong[k] = not around.any()
    return np.asarray(wrong[part])


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
) -> tuple[Flags, Index]:
    """Which triangles (m,) to turn so that neighbours walk along their edges in opposite ways, the fewer of each part.

    And the part (m,) of each: an integer that its triangles share.
    """
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
    return mine != keep[part], part
