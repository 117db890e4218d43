"""The elements of bodies that name none."""

from __future__ import annotations

from typing import Any

from prensa.model.remeshing import remeshing_of


def element_name(p: Any, body: str) -> str:
    """Name of the element of a body of a problem, the default filled in; its mesh or material may be None, if not readable."""
    b = p.bodies[body]
    if b.element is not None:
        return str(b.element)
    mesh = getattr(b.mesh, "type", "")
    if p.space == "solid":
        return "t10" if mesh == "tetrahedra" else "h8_fbar"
    if mesh == "outline" or (getattr(b.material, "plastic", False) and remeshing_of(p) is not None):
        return "t6"
    return "q4" if p.space == "plane stress" else "q4_fbar"
