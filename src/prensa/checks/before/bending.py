"""Bodies that may bend, of elements that do not do so well."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.errors import Finding
from prensa.system.bending import FOR_BENDING, bendings
from prensa.system.system import System


def stiff_in_bending(system: System) -> Iterator[Finding]:
    """Bodies that flow and are not pressed across their thickness, by how much the default element errs in bending them."""
    open_ = (n for n, b in system.problem.bodies.items() if b.material.plastic and (b.element is None or n in system.chosen))
    for body, b in bendings(system, open_).items():
        if b.bent and not b.pressed:
            default = system.problem.element_name(body)
            way = "stiff" if b.error > 0 else "soft"
            remedy = "'element: q4_enhanced', or 'q4_sheet' for springback"
            if system.dofs.dimension == 3:
                remedy = f"'element: {FOR_BENDING[3]}'"
            yield Finding(
                f"bodies.{body}",
                f"if {body!r} bends, its elements, {default!r}, are too {way} by {100 * abs(b.error):.2g} %: give it "
                f"{remedy}; 'element: {default}' if it does not bend",
            )
