"""What contact between bodies cannot do yet: all of it, in words; what finds it out later takes its words from here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from prensa.model.default_elements import element_name
from prensa.model.names import Finding
from prensa.model.not_in_space import words_of
from prensa.model.remeshing import remeshing_of
from prensa.registry import DOORS

DERIVATIVES = "those of contact between bodies are not available yet"
CONDENSED = "contact between bodies acts on nodes that would be condensed"

Boundary = Callable[[Any, str, tuple[str | int, ...]], Iterator[Finding]]


def findings(p: Any, boundary: Boundary) -> Iterator[Finding]:
    """What a description asks for and is refused; ``boundary`` finds names that no body has."""
    names: set[str] = set()
    for i, c in enumerate(p.body_contacts):
        yield from _findings_of(p, c, ("body_contacts", i), boundary)
        if c.name in names:
            yield Finding(("body_contacts", i), f"contact {c.name!r} appears twice; keep one")
        names.add(c.name)
    if not p.body_contacts:
        return
    if p.space != "plane strain":
        words = "contact between bodies is so far available only in plane strain"
        yield Finding(("body_contacts",), words_of("body_contacts") if p.space == "solid" else words)
    if p.contact_geometry == "reference":
        yield Finding(("contact_geometry",), "contact between bodies is on moved sides; use 'current'")
    for i, step in enumerate(p.steps):
        if step is not None and step.remove_tools:
            yield Finding(("steps", i, "remove_tools"), "bodies in contact with one another cannot be freed of all supports yet")
    if remeshing_of(p) is not None:
        yield Finding(("remesh",), "sides in contact with other bodies are not carried over; use 'remesh: off'")


def _findings_of(p: Any, c: Any, path: tuple[str | int, ...], boundary: Boundary) -> Iterator[Finding]:
    """What is refused of one contact."""
    for key in ("slave", "master"):
        yield from boundary(p, getattr(c, key), (*path, key))
    owners = [name.partition(".")[0] for name in (c.slave, c.master)]
    if owners[0] == owners[1]:
        yield Finding((*path, "master"), "it joins two bodies; contact of a body with itself is not available yet")
    kinds: Any = DOORS["element"]
    quadratic = [b for b in owners if b in p.bodies and kinds.find(element_name(p, b)).quadratic]
    if quadratic:
        yield Finding(path, f"sides of {quadratic[0]!r} have quadratic edges; contact between bodies needs straight ones")
    if c.enforcement.type != "penalty":
        yield Finding((*path, "enforcement"), "contact between bodies is enforced by 'penalty'")
