"""Bodies that may bend, of elements that do not do so well."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.errors import Finding
from prensa.system.bending import FOR_BENDING, Bending, bendings, looked_at, percent
from prensa.system.system import System


def stiff_in_bending(system: System) -> Iterator[Finding]:
    """Bodies that flow and are not pressed across their thickness, by how much the default element errs in bending them.

    That is of the elastic stiffness in pure bending: a sheet that is stretched or yields may be right all the same. A run finds
    out what comes of it (`prensa.checks.after.bent_metal`).
    """
    open_ = (n for n, b in system.problem.bodies.items() if b.material.plastic and (b.element is None or n in system.chosen))
    for body, b in bendings(system, open_).items():
        if b.bent and not b.pressed:
            default = system.problem.element_name(body)
            remedy = "'element: q4_enhanced', or 'q4_sheet' for springback"
            if system.dofs.dimension == 3:
                remedy = f"'element: {FOR_BENDING[3]}'"
            yield Finding(
                f"bodies.{body}",
                f"if {body!r} bends, its elements, {default!r}, are {_by_how_much(b)}: give it "
                f"{remedy}; 'element: {default}' if it does not bend",
                seen_in_run=looked_at(system, body),
            )


def _by_how_much(b: Bending) -> str:
    """The range of errors, or the one that there is."""
    small, large = sorted((b.softest, b.stiffest), key=abs)
    way = "stiff" if large > 0.0 else "soft"
    if small == large:
        return f"too {way} by {percent(large)} %"
    if small * large >= 0.0:
        return f"too {way} by {percent(small)} to {percent(large)} %, by the shape that it takes"
    return f"between {percent(b.softest)} % too soft and {percent(b.stiffest)} % too stiff, by the shape that it takes"
