"""Figures that notebooks show without further words; a module of its own, because it imports matplotlib."""

from __future__ import annotations

import io

from matplotlib.figure import Figure

from prensa.output import style


class Picture(Figure):
    """A figure that belongs to its caller: no window, no global state. ``savefig`` writes it; notebooks show it."""

    def _repr_png_(self) -> bytes:
        with style.styled():
            self.savefig(buffer := io.BytesIO(), format="png", dpi=110, bbox_inches="tight", pad_inches=0.06)
        return buffer.getvalue()
