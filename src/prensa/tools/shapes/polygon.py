"""Rigid polygon."""

from __future__ import annotations

from typing import Literal

from prensa.geometry.chain import Piece, chain, signed_area
from prensa.model.fields import Fillets
from prensa.model.units import Length
from prensa.tools.shapes.profile import Chained

__all__ = ["Polygon"]


class Polygon(Chained):
    """Rigid polygon with corners ``points`` in the frame of the tool, in any direction around; ``fillet`` as in `Profile`."""

    points: tuple[tuple[Length, Length], ...]
    fillet: Fillets | None = None
    type: Literal["polygon"] = "polygon"

    def pieces(self, rounding: float) -> tuple[list[Piece], bool]:
        """As `Chained.pieces`, turned so that the tool is inside."""
        out = chain(self.points, self.fillet, True, rounding)
        if signed_area(out) < 0:
            fillet = self.fillet[::-1] if isinstance(self.fillet, list | tuple) else self.fillet
            out = chain(self.points[::-1], fillet, True, rounding)
        return out, True
