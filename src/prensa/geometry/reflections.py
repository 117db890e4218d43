"""Reflections and the groups that they generate: how many images of a part make the whole, and where they lie.

A part between planes of symmetry is the whole divided by the order of the group of its reflections if it is a chamber of that
group: any two planes meet inside of it at an angle π/m, and the reflections generate a finite group (Coxeter 1934: the matrix of
−cos(π/m) is positive definite). Two planes make 2m images, a third across both twice as many; three across one another eight.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.precision import DRAWN, NEGLIGIBLE, ROUND_OFF
from prensa.types import Array


class Plane(NamedTuple):
    """A plane in space, in the plane a line: its unit ``normal`` (d,) and its ``place`` along that.

    ``name``: of a side on it. Of a part that lies on one side of it the normal is the one into the part.
    """

    normal: tuple[float, ...]
    place: float
    name: str = ""

    def __str__(self) -> str:
        if self.axis is not None:
            axis, at = self.line
            return f"{'xyz'[axis]} = {at:g}"
        sign = 1.0 if max(self.normal, key=abs) > 0.0 else -1.0
        return f"({', '.join(f'{sign * n + 0.0:.4g}' for n in self.normal)}) · x = {sign * self.place + 0.0:.4g}"

    @property
    def axis(self) -> int | None:
        """The axis along which the normal lies, either way; None if it is inclined."""
        n = np.abs(self.normal)
        return int(np.argmax(n)) if n.max() == 1.0 else None

    @property
    def line(self) -> tuple[int, float]:
        """Axis of the normal and coordinate along it, of a plane across an axis."""
        axis = self.axis
        assert axis is not None
        return axis, self.place * self.normal[axis] + 0.0

    def distance(self, x: Array) -> Array:
        """Distance (…) of places (…, d) from it, positive on the side to which the normal points."""
        return np.asarray(x @ np.asarray(self.normal) - self.place)

    def image(self, x: Array) -> Array:
        """Mirror images (…, d) of places (…, d) across it."""
        return np.asarray(x - 2.0 * self.distance(x)[..., None] * np.asarray(self.normal))

    def same(self, other: Plane, near: float, turned: float = NEGLIGIBLE) -> bool:
        """Whether it is another one with the same normal, but for a distance ``near`` and an angle ``turned``.

        A place that is not known, nan, is that of the other.
        """
        angle = np.linalg.norm(np.subtract(self.normal, other.normal))
        return not abs(self.place - other.place) > near and bool(angle <= turned)


def upright(plane: Plane) -> Plane:
    """The same plane with the one of its two normals whose largest component is positive, and without a name."""
    sign = 1.0 if max(plane.normal, key=abs) > 0.0 else -1.0
    return Plane(tuple(sign * n + 0.0 for n in plane.normal), sign * plane.place + 0.0)


def axis_plane(axis: int, place: float, dimension: int) -> Plane:
    """The plane across an axis at a coordinate, its normal along the axis."""
    return Plane(tuple(1.0 if k == axis else 0.0 for k in range(dimension)), place)


def plane_through(normal: Array, points: Array) -> Plane:
    """The plane with a normal (d,), its largest component made positive, through points (n, d).

    Without what round-off leaves of components and places that are 0.
    """
    normal = np.where(np.abs(normal) <= ROUND_OFF, 0.0, normal)
    normal = normal / (np.linalg.norm(normal) * np.sign(normal[np.argmax(np.abs(normal))]))
    place = float((points @ normal).mean())
    return Plane(tuple((normal + 0.0).tolist()), 0.0 if abs(place) <= ROUND_OFF * float(np.abs(points).max()) else place)


class NoWhole(PrensaError):
    """Images about some planes go on without an end, or lie in one another."""


def reflection(normal: Sequence[float] | Array) -> Array:
    """Matrix (d, d) of the reflection across a plane through the origin with a unit normal."""
    n = np.asarray(normal, dtype=float)
    return np.asarray(np.eye(len(n)) - 2.0 * np.outer(n, n))


def group(normals: Array) -> Array:
    """Matrices (g, d, d) of the finite group that reflections across planes through the origin generate, the identity first.

    ``normals`` (k, d): as of `chamber`, so that products close.
    """
    normals = np.asarray(normals, dtype=float)
    found = np.eye(normals.shape[-1])[None]
    mirrors, last = [reflection(n) for n in normals], found
    while len(last):
        before = len(found)
        for made in (mirror @ g for g in last for mirror in mirrors):
            if np.abs(found - made).max(axis=(1, 2)).min() > DRAWN:
                found = np.concatenate([found, made[None]])
        last = found[before:]
    return found


def chamber(planes: Sequence[Plane]) -> Array:
    """Normals (k, d) of planes, to round-off those of a finite group whose chamber the part between them is.

    Raises
    ------
    NoWhole
        If there is no such group: two planes are parallel, their angle inside the part is not π/m, or images never close.

    """
    d = len(planes[0].normal) if planes else 3
    N = np.array([p.normal for p in planes], dtype=float).reshape(-1, d)
    G = np.eye(len(N))
    for i, j in combinations(range(len(N)), 2):
        G[i, j] = G[j, i] = -_cosine(planes[i], planes[j])
    names = [p.name for p in planes]
    if len(N) > d or (len(N) and np.linalg.eigvalsh(G).min() < DRAWN):
        raise NoWhole(f"the images of the part across {_listed(names)} never close to a whole: they do not meet in one place")
    if np.array_equal(N @ N.T, G):
        return N
    values, vectors = np.linalg.eigh(G)
    root, inverse = (np.asarray((vectors * values**p) @ vectors.T) for p in (0.5, -0.5))
    u, _, v = np.linalg.svd(inverse @ N, full_matrices=False)  # the nearest frame in which the angles are exact
    return np.asarray(root @ u @ v)


def _cosine(a: Plane, b: Plane) -> float:
    """Cosine of the angle π/m between two planes inside of the part."""
    cosine = float(np.dot(a.normal, b.normal))
    angle = float(np.arctan2(_sine(a, b), -cosine))
    if angle < DRAWN or angle > np.pi - DRAWN:
        raise NoWhole(f"{a.name!r} and {b.name!r} are parallel: the images of the part across both go on without an end")
    m = round(np.pi / angle)
    if abs(angle - np.pi / m) > DRAWN:
        raise NoWhole(
            f"{a.name!r} and {b.name!r} meet at {np.degrees(angle):.6g}°, which is 180° over no whole number (90°, 60°, 45°, …): "
            "the images of the part do not close to a whole"
        )
    return 0.0 if m == 2 else float(np.cos(np.pi / m))


def _sine(a: Plane, b: Plane) -> float:
    """Sine of the angle between two normals, as small as it may be."""
    n, m = np.asarray(a.normal), np.asarray(b.normal)
    return float(np.linalg.norm(m - (n @ m) * n))


def _listed(names: Sequence[str]) -> str:
    quoted = [repr(n) for n in names]
    return ", ".join(quoted[:-1]) + f" and {quoted[-1]}" if len(quoted) > 1 else "".join(quoted)


def distinct(planes: Sequence[Plane], near: float) -> list[Plane]:
    """Planes without those that lie in an earlier one, to a distance ``near``."""
    out: list[Plane] = []
    for p in planes:
        if not any(p.same(q, near, DRAWN) for q in out):
            out.append(p)
    return out
