"""Sides of a mesh by their place: ``bottom``, ``right``, ``top``, ``left``, for meshes whose files name none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from prensa.mesh.faces import area_vectors, normals_at_sides
from prensa.mesh.mesh import boundary_edges, keys
from prensa.mesh.outline import CORNER, stretches
from prensa.precision import DRAWN
from prensa.types import Array, Index

SIDES = {"bottom": (1, -1.0), "right": (0, 1.0), "top": (1, 1.0), "left": (0, -1.0)}
"""Name of a side → its axis and direction."""


SPATIAL_SIDES = {"left": (0, -1.0), "right": (0, 1.0), "bottom": (1, -1.0), "top": (1, 1.0), "back": (2, -1.0), "front": (2, 1.0)}
"""The same in space."""


def faces_by_place(points: Array, faces: Index) -> dict[str, Index]:
    """Sides of the outside, faces (k, 4 | 6) of points (n, 3), by place: name → faces; only those that are unambiguous.

    The outside is cut at its edges, where it turns by more than `CORNER`. A side is made of the pieces that lie flat at the
    outermost coordinate, or else is the one piece that reaches it and looks that way on the average, within 45°.
    """
    x = points[faces]
    area = area_vectors(x)[1].sum(axis=0)
    piece = _pieces(faces, normals_at_sides(x))
    many = int(piece.max()) + 1
    looks = np.stack([np.bincount(piece, a, many) for a in area.T], axis=1)
    size = float(np.ptp(points[faces.ravel()], axis=0).max())
    out = {}
    for name, (axis, sign) in SPATIAL_SIDES.items():
        value = sign * x[..., axis]
        reach = value.max() - DRAWN * size
        off = np.bincount(piece, (value < reach).any(axis=1), many) > 0
        reaching = np.bincount(piece, (value >= reach).any(axis=1), many) > 0
        beside = np.linalg.norm(np.delete(looks, axis, axis=1), axis=1)
        facing = np.flatnonzero(reaching & (sign * looks[:, axis] > beside * (1 + DRAWN) + DRAWN * size**2))
        if not off.all():
            out[name] = faces[~off[piece]]
        elif len(facing) == 1:
            out[name] = faces[piece == facing[0]]
    return out


def _pieces(faces: Index, normal: Array) -> Index:
    """Number (k,) of the piece of each face, of those that meet in edges where the unit normals (k, s, 3) turn little."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    many = normal.shape[1]
    corners = faces[:, :many]
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
    normal = normal.reshape(-1, 3)
    kept = np.flatnonzero(ends[:, 0] != ends[:, 1])
    edge = keys(ends[kept], int(faces.max()) + 1)
    order = np.argsort(edge, kind="stable")
    same = np.flatnonzero(np.diff(edge[order]) == 0)
    i, j = kept[order[same]], kept[order[same + 1]]
    smooth = np.einsum("ki,ki->k", normal[i], normal[j]) > np.cos(CORNER)
    i, j = i[smooth] // many, j[smooth] // many
    return np.asarray(connected_components(coo_matrix((np.ones(len(i)), (i, j)), (len(faces),) * 2), directed=False)[1])


def sides_by_place(points: Array, cells: Index, curves: Mapping[str, Index]) -> dict[str, Index]:
    """Sides by place: name → edges (k, 2|3), body on the left; only those that are unambiguous.

    The outline is cut at its corners. A side is made of the stretches that lie straight at the outermost coordinate, or else is
    the one stretch that reaches it and faces that way (its chord within 45° of the line across). An outline without corners, a
    plate with round ones say, is cut where the ``curves`` of its drawing end, if the file has them.
    """
    pieces = stretches(cells, points)
    edges = boundary_edges(cells)
    outer = points[edges[:, :2]]
    size = float(np.ptp(outer.reshape(-1, 2), axis=0).max())
    if curves and any(_closed(p) and np.ptp(points[p[:, 0]], axis=0).max() >= (1 - DRAWN) * size for p in pieces):
        pieces = list(curves.values())
    out = {}
    for name, (axis, sign) in SIDES.items():
        value = sign * points[:, axis]
        reach = value[edges].max() - DRAWN * size
        flat = [p for p in pieces if (value[p] >= reach).all()]
        facing = [p for p in pieces if (value[p] >= reach).any() and not _closed(p) and _faces(points, p, axis, sign)]
        if flat:
            out[name] = np.concatenate(flat)
        elif len(facing) == 1:
            out[name] = facing[0]
    return out


def _closed(edges: Index) -> bool:
    """Whether a stretch returns to its beginning."""
    return bool(edges[0, 0] == edges[-1, 1])


def _faces(points: Array, edges: Index, axis: int, sign: float) -> bool:
    """Whether the chord of a stretch, body on its left, looks along an axis within 45°."""
    chord = (points[edges[:, 1]] - points[edges[:, 0]]).sum(axis=0)
    normal = np.array([chord[1], -chord[0]])
    return bool(sign * normal[axis] > np.abs(normal[1 - axis]) * (1 + DRAWN))


def corners_between(sides: Mapping[str, Index]) -> dict[str, int]:
    """Points ``bottom-left``, … where two sides by place meet."""
    out = {}
    for y in ("bottom", "top"):
        for x in ("left", "right"):
            if y in sides and x in sides:
                common = np.intersect1d(sides[y][:, :2], sides[x][:, :2])
                if len(common) == 1:
                    out[f"{y}-{x}"] = int(common[0])
    return out
