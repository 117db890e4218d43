"""4-node quadrilateral with B-bar in small and in finite strain, kept from folding over as `q4_fbar` is."""

from __future__ import annotations

from typing import ClassVar, Literal

from prensa.elements.kinds.q4_fbar import Q4WithBar


class Q4Mean(Q4WithBar):
    """4-node quadrilateral with B-bar: the dilatation is the mean over the element, and forces derive from an energy."""

    type: Literal["q4_bbar"] = "q4_bbar"
    no_plane_stress: ClassVar[str] = (
        "B-bar has no meaning in plane stress, where the thickness is free and nothing locks; leave 'element' out"
    )
    mean_dilatation: ClassVar[bool] = True
