"""8-node brick with enhanced strains, for bodies in space that bend; its kernels are `prensa.elements.enhanced`."""

from __future__ import annotations

from typing import ClassVar, Literal

from prensa.elements.kinds.brick import H8
from prensa.elements.kinds.q4_enhanced import Enhanced
from prensa.elements.shapes import Table
from prensa.layout import SPATIAL, TensorLayout


class H8Enhanced(Enhanced):
    """8-node brick with nine enhanced modes, 2 × 2 × 2 points."""

    type: Literal["h8_enhanced"] = "h8_enhanced"
    layout: ClassVar[TensorLayout] = SPATIAL
    even_along_itself: ClassVar[bool] = False
    table: ClassVar[Table] = H8.table
