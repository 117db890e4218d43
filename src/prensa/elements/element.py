"""Elements as a sweep sees them: nodes, points, shape values, and the response of a chunk of elements to its increments.

A response is kinematics → material → integration; an element with internal dofs repeats the first two until they are
solved. An element is one file in `prensa.elements.kinds`; its kernels, which it reaches when it first responds, stand beside.
"""

from __future__ import annotations

from enum import Enum
from typing import Any, ClassVar, NamedTuple

import numpy as np

from prensa.layout import PLANE, TensorLayout
from prensa.materials.protocol import At, Material, Out
from prensa.model.doors import Member
from prensa.registry import DOORS
from prensa.types import Array, Flags


class Why(Enum):
    """Why an element could not be evaluated: a clause that follows its name."""

    INVERTED = "turned inside out"
    LAW = "found no answer in its material law"
    SOFT = "lost the stiffness of its enhanced modes; use 'q4_fbar' (in space 'h8_fbar'), which withstands large compression"


class Mode(NamedTuple):
    """Axisymmetric or not, finite or small strain; ``scale`` of volumes: thickness, 2π in axisymmetry, 1 in space."""

    axisymmetric: bool
    finite: bool
    scale: float


class Chunk(NamedTuple):
    """k elements with a nodes: initial positions X, committed ones x (small strain: X) and increments d (k, a, dim).

    old, new (k, q, h): committed and trial history, the law's columns first, then the element's.
    """

    X: Array
    x: Array
    d: Array
    old: Array
    new: Array


class Work(NamedTuple):
    """Scratch and results of a chunk: r (k, dim a) forces, K (k, dim a, dim a), size (k,) Σ |r| before points cancel."""

    h: Array
    w: Array
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
    """An element of the chunk that could not be evaluated, and why."""

    element: int
    why: Why


class Element(Member, abstract=True):
    """Base of the elements; one without fields is named in a case file by its ``type`` alone."""

    door: ClassVar[str] = "element"
    layout: ClassVar[TensorLayout] = PLANE
    """Which components its tensors have."""
    quadratic: ClassVar[bool] = False
    """Whether its edges have a node in the middle."""
    offered: ClassVar[bool] = True
    """Whether a case file may name it."""
    no_plane_stress: ClassVar[str] = ""
    """Why it has no meaning in plane stress; '' where it has."""
    like_neo_hooke: ClassVar[bool] = False
    """Whether its forces derive from an energy for laws that say so (`fbar_has_energy`), though it is not symmetric itself."""

    follows_gradients: ClassVar[bool] = False
    """Whether its points have the stress of where they are when it is bent, so that it can be carried on to the skin."""

    even_along_itself: ClassVar[bool] = False
    """Whether its stress along ξ or η does not vary in that direction, so that only its mean is that of its middle."""

    for_sheets: ClassVar[bool] = False
    """Whether η has to be the direction in which the body is thin; the nodes of its cells are then counted so."""

    @property
    def nodes(self) -> int:
        """Nodes a."""
        return int(self.N.shape[1])

    @property
    def points(self) -> int:
        """Integration points q."""
        return int(self.N.shape[0])

    @property
    def N(self) -> Array:
        """Shape functions at the points (q, a)."""
        raise NotImplementedError(f"{self.type!r} has no shape functions: define N")

    @property
    def weight(self) -> Array:
        """Weights (q,) of the points in a mean over the square or triangle."""
        raise NotImplementedError(f"{self.type!r} has no weights of its points: define weight")

    def extra(self, mode: Mode) -> int:
        """History columns of the element itself, which follow the law's."""
        return 0

    def symmetric(self, mode: Mode) -> bool:
        """Whether its stiffness is symmetric when that of the law is."""
        return True

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, q) of the points and flags (k,) of folded elements."""
        raise NotImplementedError(f"{self.type!r} has no volumes: define volumes(self, X, mode)")

    def common_dilatation(self, mode: Mode) -> Array | None:
        """Slopes (a, dim) of shape functions where all points have their dilatation from; None where stiffness is symmetric."""
        return None

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """Forces, with ``stiffness`` their exact derivative, and the new history of a chunk. Pure."""
        raise NotImplementedError(f"{self.type!r} does not respond: define respond(...)")


def element_of(name: str) -> Any:
    """The element of a description by its name.

    Raises
    ------
    ValueError
        For an unknown name.

    """
    return DOORS["element"].find(name)()


def workspace(element: Element, k: int) -> Work:
    """Arrays for chunks of up to k elements."""
    q, c, m = element.points, element.layout.components, element.layout.dimension * element.nodes
    return Work(
        np.empty((k, q, c)), np.empty((k, q)), np.empty((k, q, c)), np.empty((k, q, c, c)),
        np.empty((k, m)), np.empty((k, m, m)), np.empty(k), np.empty(k, dtype=np.bool_), np.empty((k, q), dtype=np.bool_),
    )  # fmt: skip


def material(c: Chunk, law: Material, at: At, work: Work) -> Failure | None:
    """The law at all points of a chunk, from work.h to work.P, work.A and c.new."""
    n, m = work.points.size, work.h.shape[-1]
    # Laws set the flags of points that fail and clear none.
    work.points[:] = False
    out = Out(work.P.reshape(n, m), work.A.reshape(n, m, m), c.new.reshape(n, -1), work.points.reshape(n))
    law.update(work.h.reshape(n, m), c.old.reshape(n, -1), at, out)
    if np.count_nonzero(work.points):
        return Failure(int(np.argmax(work.points.any(axis=1))), Why.LAW)
    return None
