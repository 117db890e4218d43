"""4-node quadrilateral with F-bar in finite strain, kept from folding over (`prensa.elements.q4`), B-bar in small strain."""

from __future__ import annotations

from functools import cache
from typing import Any, ClassVar, Literal

from prensa.elements.element import Chunk, Failure, Mode, Work
from prensa.elements.kinds.isoparametric import Q4, Isoparametric
from prensa.elements.shapes import Table
from prensa.materials.protocol import At, Material


@cache
def _guard() -> Any:
    """What keeps points from folding over, loaded where the element first responds: every chunk asks for it."""
    from prensa.elements import q4

    return q4


class Q4WithBar(Isoparametric, abstract=True):
    """4-node quadrilateral with one dilatation, that of F-bar or of B-bar, whose points are kept from folding over."""

    table: ClassVar[Table] = Q4.table
    bar: ClassVar[bool] = True

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        failure = super().respond(c, law, at, mode, work, stiffness)
        if failure is None and mode.finite:
            q4 = _guard()
            # In almost no chunk: the test is a small fraction of the energy's kernel.
            if q4.folding(c.x, c.d).any():
                modulus = law.modulus() * mode.scale
                q4.unfold(c.X, c.x, c.d, mode.axisymmetric, modulus, work.size, stiffness, work.r, work.K)
        return failure


class Q4Bar(Q4WithBar):
    """4-node quadrilateral with F-bar (small strain: B-bar)."""

    type: Literal["q4_fbar"] = "q4_fbar"
    no_plane_stress: ClassVar[str] = (
        "F-bar has no meaning in plane stress, where the thickness is free and nothing locks; leave 'element' out"
    )
    like_neo_hooke: ClassVar[bool] = True
