"""8-node brick with 2 × 2 × 2 points: plain, with F-bar (small strain: B-bar), with B-bar."""

from __future__ import annotations

from typing import ClassVar, Literal

from prensa.elements import shapes
from prensa.elements.kinds.isoparametric import Isoparametric
from prensa.layout import SPATIAL, TensorLayout


class _Brick(Isoparametric, abstract=True):
    """What the bricks have in common."""

    layout: ClassVar[TensorLayout] = SPATIAL
    table: ClassVar[shapes.Table] = shapes.table(8, shapes.cube(2))


class H8(_Brick):
    """Trilinear brick."""

    type: Literal["h8"] = "h8"


class H8Bar(_Brick):
    """Trilinear brick with F-bar (small strain: B-bar)."""

    type: Literal["h8_fbar"] = "h8_fbar"
    bar: ClassVar[bool] = True


class H8Mean(_Brick):
    """Trilinear brick with B-bar in small and in finite strain: forces derive from an energy."""

    type: Literal["h8_bbar"] = "h8_bbar"
    bar: ClassVar[bool] = True
    mean_dilatation: ClassVar[bool] = True
