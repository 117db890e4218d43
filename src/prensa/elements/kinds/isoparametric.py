"""Isoparametric elements of a shape table, without a cure for locking: the textbook's, and reduced quadratic ones."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from prensa.elements import shapes
from prensa.elements.element import Chunk, Element, Failure, Mode, Why, Work, material
from prensa.materials.protocol import At, Material
from prensa.types import Array, Flags


class Isoparametric(Element, abstract=True):
    """An element that interpolates positions and displacements alike, by the shape functions of its ``table``."""

    table: ClassVar[shapes.Table]

    @property
    def N(self) -> Array:
        """Shape functions at the points (q, a)."""
        return self.table.N

    @property
    def weight(self) -> Array:
        """Weights (q,) of the points."""
        return self.table.weight

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, q) and flags (k,) of folded elements."""
        t = self.table
        x, y = X[:, :, 0], X[:, :, 1]
        j11 = j12 = j21 = j22 = r = np.zeros((len(X), self.points))
        for a in range(X.shape[1]):  # as `solid.kinematics` has them, which need not be compiled for that
            by_xi, by_eta, of_x, of_y = t.dN[:, a, 0], t.dN[:, a, 1], x[:, a, None], y[:, a, None]
            j11, j12, r = j11 + by_xi * of_x, j12 + by_xi * of_y, r + t.N[:, a] * of_x
            j21, j22 = j21 + by_eta * of_x, j22 + by_eta * of_y
        det = j11 * j22 - j12 * j21
        w = mode.scale * t.weight * det * (r if mode.axisymmetric else 1.0)
        failed = ~((det > 0.0) & ((r > 0.0) | (not mode.axisymmetric)))
        return w, np.asarray(failed.any(axis=1))

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        from prensa.elements import solid

        t = self.table
        work.flags[:] = False
        solid.kinematics(
            c.x, c.d, t.N, t.dN, t.weight, mode.axisymmetric, mode.finite, mode.scale, work.h, work.w, work.flags
        )
        if work.flags.any():
            return Failure(int(np.argmax(work.flags)), Why.INVERTED)
        if failure := material(c, law, at, work):
            return failure
        solid.integrate(c.x, t.N, t.dN, mode.axisymmetric, work.w, work.P, work.A, work.size, stiffness, work.r, work.K)
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
