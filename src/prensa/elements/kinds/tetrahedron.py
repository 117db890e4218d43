"""10-node tetrahedron: what `t6` is in the plane."""

from __future__ import annotations

from typing import ClassVar, Literal

from prensa.elements import shapes
from prensa.elements.kinds.isoparametric import Isoparametric
from prensa.layout import SPATIAL, TensorLayout


class T10(Isoparametric):
    """Quadratic tetrahedron, four points: as of `t6`, as few as leave the volume free to be kept at each."""

    type: Literal["t10"] = "t10"
    layout: ClassVar[TensorLayout] = SPATIAL
    follows_gradients: ClassVar[bool] = True
    quadratic: ClassVar[bool] = True
    table: ClassVar[shapes.Table] = shapes.table(10, shapes.tetrahedron())
