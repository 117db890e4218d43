"""Remeshing options: when bodies are remeshed, and how large their elements are then; the keys of ``remesh``."""

from __future__ import annotations

from dataclasses import field
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from prensa.model.fields import described
from prensa.model.units import Length, Number, Whole

Size = Annotated[Length, Field(gt=0)]


@described
class Sizes:
    """Sizes (sides) of the elements of a new mesh.

    ``far``: away from everything, the largest (default: a twelfth of the square root of the section's area);
    ``near_tools``: at tools (default: 0.6 of that); ``per_radius``: elements along a quarter of a circle of the radius of a
    tool; ``across``: elements at least across a thin wall or web; ``per_strain``: elements, no smaller than ``near_tools``, along
    a way on which the equivalent plastic strain changes by one; ``least``: the smallest (default: an eighth of ``near_tools``).
    """

    far: Size | None = None
    near_tools: Size | None = None
    per_radius: Annotated[Number, Field(ge=1, le=100)] = 8.0
    across: Annotated[Number, Field(ge=1, le=100)] = 4.0
    per_strain: Annotated[Number, Field(ge=0, le=100)] = 4.0
    least: Size | None = None

    @model_validator(mode="after")
    def _check(self) -> Sizes:
        given = [(name, v) for name in ("far", "near_tools", "least") if (v := getattr(self, name)) is not None]
        for (larger, most), (smaller, value) in pairwise(given):
            if value > most:
                raise ValueError(
                    f"{smaller!r} is {value:g}, more than {larger!r}, {most:g}: 'far' is the size of the largest elements, "
                    "'near_tools' of those at tools, 'least' of the smallest"
                )
        return self


def _travel_kind(value: Any) -> str:
    return "word" if isinstance(value, str) and value == "auto" else "length"  # arrays are equal to a word in each item


Travel = Annotated[
    Annotated[Literal["auto"], Tag("word")] | Annotated[Size, Tag("length")],
    Discriminator(_travel_kind),
]


@described
class When:
    """What makes a new mesh due.

    ``quality``: a shape measure (1: equilateral, 0: folded) of the worst element below this; ``travel``: of a tool since the
    last mesh (``auto``: after each 2.5 of the smallest elements, if shapes or sizes leave something to gain); ``failure``: an
    increment that fails is tried again with a new mesh.
    """

    quality: Annotated[Number, Field(ge=0, le=0.5)] = 0.35
    travel: Travel = "auto"
    failure: bool = True


@described
class Remesh:
    """Bodies that flow plastically get new meshes while they deform; their element is ``t6``.

    ``size``: of the elements; ``when`` a new mesh is made; ``at_most``: so many in a run, after which it ends.
    """

    size: Sizes = field(default_factory=Sizes)
    when: When = field(default_factory=When)
    at_most: Annotated[Whole, Field(ge=0)] = 200


def _switched_off(value: Any) -> Any:
    """'off', which older YAML reads as false."""
    if value is True:
        raise ValueError("true does not say how; write 'auto', 'off' or a mapping with size, when and at_most")
    return "off" if value is False else value


def _remesh_kind(value: Any) -> str:
    return "word" if isinstance(value, str) else "keys"


RemeshValue = Annotated[
    Annotated[Literal["auto", "off"], Tag("word")] | Annotated[Remesh, Tag("keys")],
    Discriminator(_remesh_kind),
    BeforeValidator(_switched_off),
]


def remeshing_of(p: Any) -> Remesh | None:
    """How the bodies of a problem are remeshed; None if they are not."""
    return None if p.remesh in ("off", None) else Remesh() if p.remesh == "auto" else p.remesh
