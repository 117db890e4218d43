"""4-node quadrilateral with F-bar in finite strain, B-bar in small strain, by its own fast kernels (`prensa.elements.q4`)."""

from __future__ import annotations

from functools import cache
from typing import Any, ClassVar, Literal

import numpy as np

from prensa.elements.element import Chunk, Failure, Mode, Why, Work, material
from prensa.elements.kinds.isoparametric import Q4, Isoparametric
from prensa.elements.shapes import Table
from prensa.materials.protocol import At, Material


@cache
def _kernels() -> Any:
    """The kernels, loaded where the element first responds: every chunk asks for them."""
    from prensa.elements import q4

    return q4


class Q4Bar(Isoparametric):
    """4-node quadrilateral with F-bar (small strain: B-bar)."""

    type: Literal["q4_fbar"] = "q4_fbar"
    table: ClassVar[Table] = Q4.table
    no_plane_stress: ClassVar[str] = (
        "F-bar has no meaning in plane stress, where the thickness is free and nothing locks; leave 'element' out"
    )
    like_neo_hooke: ClassVar[bool] = True

    def symmetric(self, mode: Mode) -> bool:
        """B-bar derives from an energy, F-bar does not."""
        return not mode.finite

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        q4 = _kernels()
        axi, finite, scale = mode
        work.flags[:] = False
        folds = q4.kinematics(c.x, c.d, axi, finite, scale, work.h, work.w, work.flags)
        if np.count_nonzero(work.flags):
            return Failure(int(np.argmax(work.flags)), Why.INVERTED)
        if failure := material(c, law, at, work):
            return failure
        q4.integrate(c.x, c.d, axi, finite, scale, work.w, work.P, work.A, work.size, stiffness, work.r, work.K)
        if folds.any():
            q4.unfold(c.X, c.x, c.d, axi, law.modulus() * scale, work.size, stiffness, work.r, work.K)
        return None
