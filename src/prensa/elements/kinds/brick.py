"""8-node brick with 2 × 2 × 2 points, with or without F-bar (small strain: B-bar)."""

from __future__ import annotations

from typing import ClassVar, Literal

from prensa.elements import shapes
from prensa.elements.kinds.isoparametric import Isoparametric
from prensa.layout import SPATIAL, TensorLayout


class _Brick(Isoparametric, abstract=True):
    """What both bricks have in common."""

    layout: ClassVar[TensorLayout] = SPATIAL
    table: ClassVar[shapes.Table] = shapes.table(8, shapes.cube(2))


class H8(_Brick):
    """Trilinear brick."""

    type: Literal["h8"] = "h8"


class H8Bar(_Brick):
    """Trilinear brick with F-bar (small strain: B-bar)."""

    type: Literal["h8_fbar"] = "h8_fbar"
    bar: ClassVar[bool] = True
