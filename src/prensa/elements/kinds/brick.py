"""8-node brick with 2 × 2 × 2 points, with or without F-bar (small strain: B-bar); its kernels are `prensa.elements.h8`."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from prensa.elements import shapes
from prensa.elements.element import Chunk, Element, Failure, Mode, Why, Work, material, workspace
from prensa.layout import SPATIAL, TensorLayout
from prensa.materials.protocol import At, Material
from prensa.types import Array, Flags


class _Brick(Element, abstract=True):
    """What both bricks have in common; case files have no meshes for them yet."""

    layout: ClassVar[TensorLayout] = SPATIAL
    offered: ClassVar[bool] = False
    bar: ClassVar[bool] = False
    table: ClassVar[shapes.Table] = shapes.table(8, shapes.cube(2))

    @property
    def N(self) -> Array:
        """Shape functions at the points (8, 8)."""
        return self.table.N

    def symmetric(self, mode: Mode) -> bool:
        """B-bar derives from an energy, F-bar does not."""
        return not (self.bar and mode.finite)

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, 8) and flags (k,) of folded elements."""
        from prensa.elements import h8

        work = workspace(self, len(X))
        work.flags[:] = False
        h8.kinematics(X, np.zeros_like(X), False, False, work.h, work.w, work.alpha, work.flags)
        return work.w, work.flags

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        from prensa.elements import h8

        work.flags[:] = False
        h8.kinematics(c.x, c.d, self.bar, mode.finite, work.h, work.w, work.alpha, work.flags)
        if work.flags.any():
            return Failure(int(np.argmax(work.flags)), Why.INVERTED)
        if failure := material(c, law, at, work):
            return failure
        h8.integrate(
            c.x, c.d, self.bar, mode.finite, work.w, work.alpha, work.P, work.A, work.size, stiffness, work.r, work.K
        )
        return None


class H8(_Brick):
    """Trilinear brick."""

    type: Literal["h8"] = "h8"


class H8Bar(_Brick):
    """Trilinear brick with F-bar (small strain: B-bar)."""

    type: Literal["h8_fbar"] = "h8_fbar"
    bar: ClassVar[bool] = True
