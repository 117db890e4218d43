"""Interference: overlaps that are meant, as of a shrink fit; the key ``interference`` of contacts and ties."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from prensa.model.feed import ends_early
from prensa.model.fields import described
from prensa.model.names import Finding, suggest
from prensa.model.not_in_space import words_of
from prensa.model.remeshing import remeshing_of
from prensa.model.units import Length


def _kind(value: Any) -> str:
    if isinstance(value, str) and value == "geometry":
        return "word"
    return "keys" if isinstance(value, dict | Interference) else "length"


@described
class Interference:
    """An intended overlap of two surfaces, which grows from zero over a step and stays.

    ``by``: a length by which surfaces that are drawn in contact overlap, or ``geometry``, the overlap of the geometry as it is
    drawn. ``step``: name of the step over which it grows; default: the first.
    """

    by: Annotated[
        Annotated[Literal["geometry"], Tag("word")] | Annotated[Length, Field(gt=0), Tag("length")], Discriminator(_kind)
    ]
    step: str | None = None


InterferenceValue = Annotated[
    Annotated[Literal["geometry"], Tag("word")]
    | Annotated[Length, Field(gt=0), Tag("length")]
    | Annotated[Interference, Tag("keys")],
    Discriminator(_kind),
]


def interference_of(owner: Any) -> Interference | None:
    """What a contact or a tie says of interference; None if nothing."""
    given = owner.interference
    return given if given is None or isinstance(given, Interference) else Interference(given)


def step_of(p: Any, given: Interference) -> int:
    """Number of the step over which an overlap grows."""
    return 0 if given.step is None else [step.name for step in p.steps].index(given.step)


def interfering(p: Any) -> bool:
    """Whether any overlap of a problem is meant."""
    return any(owner.interference is not None for owner in (*p.contacts, *p.ties))


def findings(p: Any) -> Iterator[Finding]:
    """What cannot go together with interference; parts of ``p`` that could not be read are None."""
    for kind in ("contacts", "ties"):
        for i, owner in enumerate(getattr(p, kind)):
            given = None if owner is None else interference_of(owner)
            if given is not None:
                at: tuple[str | int, ...] = (kind, i, "interference")
                yield from (Finding(at, message) for message in _refused(p, owner, given))


def _refused(p: Any, owner: Any, given: Interference) -> Iterator[str]:
    names = [None if step is None else step.name for step in p.steps]
    if given.step is not None and given.step not in names:
        yield f"unknown step {given.step!r}{suggest(given.step, [name for name in names if name is not None])}"
        return
    number = 0 if given.step is None else names.index(given.step)
    if p.space == "solid":
        yield words_of("interference" if hasattr(owner, "against") else "interference of ties")
    if p.start is not None:
        yield (
            "a case that starts from a run takes its contacts and ties over as they are: describe the fit and what follows "
            "in one case, with more steps"
        )
    if number < len(p.steps) and p.steps[number] is not None and ends_early(p.steps[number]):
        yield f"step {names[number]!r} may end before its time, with a part of the overlap; let it grow in a step of its own"
    if hasattr(owner, "against") and any(step is not None and step.remove_tools for step in p.steps[: number + 1]):
        yield "the tools are removed before the overlap has grown; name a step before that"
    if given.by == "geometry" and remeshing_of(p) is not None:
        yield "the overlap of the drawn surfaces is not known on new meshes; give it as a length, or 'remesh: off'"
