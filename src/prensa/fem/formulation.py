"""Elements as a sweep sees them: nodes, points, shape values, and the response of a chunk of elements to its increments.

A response is kinematics → material → integration; an element with internal unknowns repeats the first two until they are
solved. Adding an element: its kernels, a class here, a line in `element_of`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from prensa.elements import q4, shapes, solid
from prensa.materials.laws import At, Material, Out

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Mode(NamedTuple):
    """Axisymmetric or plane, finite or small strain; ``scale`` of volumes: thickness, or 2π in axisymmetry."""

    axisymmetric: bool
    finite: bool
    scale: float


class Chunk(NamedTuple):
    """k elements with a nodes: initial positions X, committed ones x (small strain: X) and increments d (k, a, 2).

    old, new (k, q, h): committed and trial history, the law's columns first, then the element's.
    """

    X: Array
    x: Array
    d: Array
    old: Array
    new: Array


class Work(NamedTuple):
    """Scratch and results of a chunk: r (k, 2a) forces, K (k, 2a, 2a), size (k,) Σ |r| before points cancel."""

    h: Array
    w: Array
    alpha: Array
    P: Array
    A: Array
    r: Array
    K: Array
    size: Array
    flags: Flags
    points: Flags

    def first(self, k: int) -> Work:
        """The rows of the first k elements."""
        return Work._make(a[:k] for a in self)


class Failure(NamedTuple):
    """An element of the chunk that could not be evaluated, and why (a clause that follows its name)."""

    element: int
    why: str


INVERTED = "turned inside out"
LAW = "found no answer in its material law"


class Element(Protocol):
    """A formulation. ``N`` (q, a): shape values at the points; ``extra``: columns it adds to the law's history."""

    @property
    def nodes(self) -> int:
        """Nodes a."""

    @property
    def points(self) -> int:
        """Integration points q."""

    @property
    def N(self) -> Array:
        """Shape functions at the points (q, a)."""

    def extra(self, mode: Mode) -> int:
        """History columns of the element itself."""

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, q) of the points and flags (k,) of folded elements."""

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """Forces, with ``stiffness`` their exact derivative, and the new history of a chunk. Pure."""


def workspace(element: Element, k: int) -> Work:
    """Arrays for chunks of up to k elements."""
    q, m = element.points, 2 * element.nodes
    return Work(
        np.empty((k, q, 5)), np.empty((k, q)), np.empty((k, q)), np.empty((k, q, 5)), np.empty((k, q, 5, 5)),
        np.empty((k, m)), np.empty((k, m, m)), np.empty(k), np.empty(k, dtype=np.bool_), np.empty((k, q), dtype=np.bool_),
    )  # fmt: skip


def material(c: Chunk, law: Material, at: At, work: Work) -> Failure | None:
    """The law at all points of a chunk, from work.h to work.P, work.A and c.new."""
    n = work.points.size
    work.points[:] = False
    out = Out(work.P.reshape(n, 5), work.A.reshape(n, 5, 5), c.new.reshape(n, -1), work.points.reshape(n))
    law.update(work.h.reshape(n, 5), c.old.reshape(n, -1), at, out)
    bad = work.points.any(axis=1)
    return Failure(int(np.argmax(bad)), LAW) if bad.any() else None


@dataclass(frozen=True)
class Q4Bar:
    """4-node quadrilateral with F-bar (small strain: B-bar), by its own fast kernels."""

    nodes: int = 4
    points: int = 4

    @property
    def N(self) -> Array:
        """Shape functions at the points (4, 4)."""
        return _TABLES["q4"].N

    def extra(self, mode: Mode) -> int:
        """No history of its own."""
        return 0

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, 4) and flags (k,) of folded elements."""
        return Solid("q4").volumes(X, mode)

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        axi, finite, scale = mode
        work.flags[:] = False
        q4.kinematics(c.x, c.d, axi, finite, True, scale, work.h, work.w, work.alpha, work.flags)
        if work.flags.any():
            return Failure(int(np.argmax(work.flags)), INVERTED)
        if failure := material(c, law, at, work):
            return failure
        q4.integrate(
            c.x, c.d, axi, finite, True, work.w, work.alpha, work.P, work.A, work.size, stiffness, work.r, work.K
        )
        return None


_TABLES = {
    "t3": shapes.table(3, shapes.triangle(1)),
    "t6": shapes.table(6, shapes.triangle(3)),
    "q4": shapes.table(4, shapes.square(2)),
    "q8": shapes.table(8, shapes.square(2)),
    "q8_full": shapes.table(8, shapes.square(3)),
}


@dataclass(frozen=True)
class Solid:
    """Isoparametric element of a shape table: ``t3``, ``t6``, ``q4``, ``q8`` (2 × 2 points), ``q8_full`` (3 × 3)."""

    name: str

    @property
    def nodes(self) -> int:
        """Nodes a."""
        return self.N.shape[1]

    @property
    def points(self) -> int:
        """Integration points q."""
        return self.N.shape[0]

    @property
    def N(self) -> Array:
        """Shape functions at the points (q, a)."""
        return _TABLES[self.name].N

    def extra(self, mode: Mode) -> int:
        """No history of its own."""
        return 0

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, q) and flags (k,) of folded elements."""
        h, w = np.empty((len(X), self.points, 5)), np.empty((len(X), self.points))
        failed = np.zeros(len(X), dtype=np.bool_)
        t = _TABLES[self.name]
        solid.kinematics(X, np.zeros_like(X), t.N, t.dN, t.weight, mode.axisymmetric, False, mode.scale, h, w, failed)
        return w, failed

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        t = _TABLES[self.name]
        work.flags[:] = False
        solid.kinematics(
            c.x, c.d, t.N, t.dN, t.weight, mode.axisymmetric, mode.finite, mode.scale, work.h, work.w, work.flags
        )
        if work.flags.any():
            return Failure(int(np.argmax(work.flags)), INVERTED)
        if failure := material(c, law, at, work):
            return failure
        solid.integrate(c.x, t.N, t.dN, mode.axisymmetric, work.w, work.P, work.A, work.size, stiffness, work.r, work.K)
        return None


@cache
def element_of(name: str) -> Element:
    """The element of a description by its name.

    Raises
    ------
    KeyError
        For an unknown name.

    """
    if name == "q4_fbar":
        return Q4Bar()
    if name not in _TABLES:
        raise KeyError(name)
    return Solid(name)
