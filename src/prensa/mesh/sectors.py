"""Sectors of bodies of revolution: their axis and the flat sides in which they are cut, however the mesh was made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from prensa.mesh.bricks import BrickMesh
from prensa.mesh.faces import area_vectors
from prensa.precision import DRAWN, NEGLIGIBLE, SMALLEST
from prensa.types import Array, Index


class Axis(NamedTuple):
    """A line through a ``place`` (3,) along a unit vector ``way`` (3,)."""

    place: Array
    way: Array

    def radial(self, x: Array) -> tuple[Array, Array]:
        """Distances (k,) of places x (k, 3) from it, and unit vectors (k, 3) from it to them; 0 on it."""
        off = x - self.place
        off = off - (off @ self.way)[:, None] * self.way
        far = np.linalg.norm(off, axis=1)
        return far, off / np.maximum(far, SMALLEST)[:, None]


class Sector(NamedTuple):
    """The ``axis`` of a sector of at most half a turn, and unit normals (3,) of the flat sides by name that contain it."""

    axis: Axis
    cuts: Mapping[str, Array]


class _Faces(NamedTuple):
    """Corners x (m, a, 3) of faces, their middles (m, 3), unit normals (m, 3) and areas (m,); of those with an area."""

    x: Array
    middle: Array
    normal: Array
    area: Array

    @classmethod
    def of(cls, mesh: BrickMesh, faces: Index) -> _Faces:
        x = mesh.points[faces]
        area = area_vectors(x)[1].sum(axis=0)
        size = np.linalg.norm(area, axis=1)
        own = size > NEGLIGIBLE * size.max(initial=0.0)
        return cls(x[own], x[own].mean(axis=1), area[own] / size[own, None], size[own])


def sector_of(mesh: BrickMesh) -> Sector | None:
    """The sector that a body is: flat sides end it that contain an axis about which all others are surfaces of revolution.

    None of others, and of sectors of more than half a turn, which are parts of no whole. The axis is where two flat sides meet,
    or what normals of all other faces come closest to in the plane of one: as lines in space they meet it (H. Pottmann and
    T. Randrup, Computing 60, 1998).
    """
    near = DRAWN * float(np.ptp(mesh.points, axis=0).max())
    flat = {side: plane for side in mesh.edges if (plane := _flat(mesh, side, near)) is not None}
    outside = _Faces.of(mesh, mesh.boundary)
    for axis in _axes(flat, outside, near):
        cuts = {side: n for side, (n, at) in flat.items() if abs(n @ axis.way) < DRAWN and abs(n @ (axis.place - at)) < near}
        if cuts and _revolved(outside, axis, list(cuts.values()), near) and _at_its_ends(mesh, axis, cuts, near):
            return Sector(axis, cuts)
    return None


def _flat(mesh: BrickMesh, side: str, near: float) -> tuple[Array, Array] | None:
    """The outward unit normal (3,) of a flat side, and a place in it; None of others."""
    faces = _Faces.of(mesh, mesh.edges[side])
    if not len(faces.area):
        return None
    n = faces.area @ faces.normal
    size = float(np.linalg.norm(n))
    if size < NEGLIGIBLE * faces.area.sum():
        return None
    n, at = n / size, faces.middle[0]
    return (n, at) if np.abs((faces.x.reshape(-1, 3) - at) @ n).max() <= near else None


def _axes(flat: Mapping[str, tuple[Array, Array]], outside: _Faces, near: float) -> Iterator[Axis]:
    """Lines that may be the axis: in which two flat sides meet, then those in single ones."""
    for (n, at), (other, there) in combinations(flat.values(), 2):
        way = np.cross(n, other)
        if (size := float(np.linalg.norm(way))) > DRAWN:
            rows = np.stack([n, other, way / size])
            yield Axis(np.linalg.solve(rows, np.array([n @ at, other @ there, way @ at / size])), way / size)
    for n, at in flat.values():
        rest = (np.abs((outside.x - at) @ n) > near).any(axis=1)
        if not rest.any():
            continue
        e = np.linalg.svd(n[None])[2][1:]
        moment = np.cross(outside.middle[rest] - at, outside.normal[rest])
        scale = float(np.abs(moment).max())
        weight = np.sqrt(outside.area[rest])[:, None]
        c = np.linalg.svd(weight * np.column_stack([moment @ e.T, scale * outside.normal[rest] @ n]))[2][-1]
        if (size := float(np.linalg.norm(c[:2]))) > DRAWN:
            way = c[:2] @ e / size
            yield Axis(at + np.cross(way, c[2] * scale / size * n), way)


def _revolved(faces: _Faces, axis: Axis, cuts: list[Array], near: float) -> bool:
    """Whether all faces but those in flat sides with normals ``cuts`` (3,) through an axis are parts of surfaces of revolution.

    A chord of a circle has its normal along the radius in its middle: the middle of a face is not further from that than half of
    the angle to its farthest corner.
    """
    rest = np.ones(len(faces.area), dtype=bool)
    for n in cuts:
        rest &= (np.abs((faces.x - axis.place) @ n) > near).any(axis=1)
    far, radial = axis.radial(faces.middle[rest])
    if not len(far) or (far <= near).any():
        return False
    corners = axis.radial(faces.x[rest].reshape(-1, 3))[1].reshape(faces.x[rest].shape)
    hoop = np.cross(axis.way, radial)
    within = np.abs(np.einsum("mad,md->ma", corners, hoop)).max(axis=1)
    return bool((np.abs((faces.normal[rest] * hoop).sum(axis=1)) <= 0.5 * within + DRAWN).all())


def _at_its_ends(mesh: BrickMesh, axis: Axis, cuts: Mapping[str, Array], near: float) -> bool:
    """Whether a body lies inside of all of the flat sides, as one of half a turn or less does."""
    return all(bool(((mesh.points - axis.place) @ n <= near).all()) for n in cuts.values())
