"""Isoparametric elements of a shape table: the textbook's, and reduced quadratic ones; kernels are `prensa.elements.solid`."""

from __future__ import annotations

from functools import cache
from typing import Any, ClassVar, Literal

import numpy as np

from prensa.elements import shapes
from prensa.elements.element import Chunk, Element, Failure, Mode, Why, Work, material
from prensa.elements.form import Form
from prensa.materials.protocol import At, Material
from prensa.types import Array, Flags


@cache
def _kernels() -> Any:
    """The kernels, loaded where an element first responds: every chunk asks for them."""
    from prensa.elements import solid

    return solid


class Isoparametric(Element, abstract=True):
    """An element that interpolates positions and displacements alike, by the shape functions of its ``table``."""

    table: ClassVar[shapes.Table]
    bar: ClassVar[bool] = False
    """Whether the dilatation is that of the whole element: F-bar, in small strain B-bar; for 2 points along each axis."""
    mean_dilatation: ClassVar[bool] = False
    """Whether it is the mean over the element's volume in finite strain too, and forces derive from an energy: B-bar."""

    @property
    def N(self) -> Array:
        """Shape functions at the points (q, a)."""
        return self.table.N

    @property
    def weight(self) -> Array:
        """Weights (q,) of the points."""
        return self.table.weight

    def symmetric(self, mode: Mode) -> bool:
        """B-bar derives from an energy, F-bar does not."""
        return self.mean_dilatation or not (self.bar and mode.finite)

    def common_dilatation(self, mode: Mode) -> Array | None:
        """That of the centre with F-bar."""
        if not (self.bar and mode.finite) or self.mean_dilatation:
            return None
        a, d = self.N.shape[1], self.layout.dimension
        return shapes.centre(a, d)[a:].reshape(d, a).T

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, q) and flags (k,) of folded elements."""
        t = self.table
        # by ξ, η(, ζ), of x, y(, z), summed node by node: no bits of an element depend on its neighbours
        J = np.zeros((*X.shape[2:], X.shape[2], len(X), self.points))
        r = np.zeros((len(X), self.points))
        for a in range(X.shape[1]):
            J += t.dN[:, a].T[:, None, None, :] * X[:, a].T[None, :, :, None]
            r += t.N[:, a] * X[:, a, :1]
        if len(J) == 3:
            det = np.sum([J[0, i] * (J[1, i - 2] * J[2, i - 1] - J[1, i - 1] * J[2, i - 2]) for i in range(3)], axis=0)
        else:
            det = J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0]
        w = mode.scale * t.weight * det * (r if mode.axisymmetric else 1.0)
        failed = ~((det > 0.0) & ((r > 0.0) | (not mode.axisymmetric)))
        return w, np.asarray(failed.any(axis=1))

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        solid, rows = _kernels(), self.table.rows
        points, nodes = self.table.N.shape
        form = Form(nodes, points, self.layout.dimension, mode.axisymmetric, mode.finite, self.bar, self.mean_dilatation)
        solid.kinematics(form, c.X, c.x, c.d, rows, mode.scale, work.h, work.w, work.flags)
        if np.count_nonzero(work.flags):
            return Failure(int(np.argmax(work.flags)), Why.INVERTED)
        if failure := material(c, law, at, work):
            return failure
        solid.integrate(form, c.x, c.d, rows, mode.scale, work.w, work.P, work.A, work.size, stiffness, work.r, work.K)
        return None


class T3(Isoparametric):
    """Linear triangle, one point."""

    type: Literal["t3"] = "t3"
    table: ClassVar[shapes.Table] = shapes.table(3, shapes.triangle(1))


class T6(Isoparametric):
    """Quadratic triangle, three points."""

    type: Literal["t6"] = "t6"
    follows_gradients: ClassVar[bool] = True
    quadratic: ClassVar[bool] = True
    table: ClassVar[shapes.Table] = shapes.table(6, shapes.triangle(3))


class Q4(Isoparametric):
    """Bilinear quadrilateral, 2 × 2 points."""

    type: Literal["q4"] = "q4"
    table: ClassVar[shapes.Table] = shapes.table(4, shapes.square(2))


class Q8(Isoparametric):
    """Quadratic serendipity quadrilateral, 2 × 2 points."""

    type: Literal["q8"] = "q8"
    follows_gradients: ClassVar[bool] = True
    quadratic: ClassVar[bool] = True
    table: ClassVar[shapes.Table] = shapes.table(8, shapes.square(2))


class Q8Full(Isoparametric):
    """Quadratic serendipity quadrilateral, 3 × 3 points."""

    type: Literal["q8_full"] = "q8_full"
    follows_gradients: ClassVar[bool] = True
    quadratic: ClassVar[bool] = True
    table: ClassVar[shapes.Table] = shapes.table(8, shapes.square(3))
