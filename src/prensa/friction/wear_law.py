"""Wear laws: how fast a tool wears under the pressure and the slip of the moment. The worn shape is not fed back.

A law of one's own derives from `WearLaw` and states the depth worn per unit time in NumPy, of all places at once::

    class Threshold(pr.WearLaw):
        c: float
        least: float

        def rate(self, at):
            return self.c * np.maximum(at.pressure - self.least, 0.0) * at.speed

Depths are its integral over the time of each increment, volumes over the area that each node of a contact stands for.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from prensa.model.doors import Member, add_common_fields, fault
from prensa.model.units import Length
from prensa.types import Array

PERMITTED_DEPTH: Any = Annotated[Length, Field(gt=0)] | None


class Sliding(NamedTuple):
    """What rubs at n places of a tool: ``pressure`` (n,), and ``speed`` (n,) of the slip, length per second, not negative."""

    pressure: Array
    speed: Array


class WearLaw(Member, abstract=True):
    """Base of all wear laws. A law is pure and frozen; its annotated fields are keys of the case file, ``depth`` besides.

    ``depth``: permitted depth, of which follows how many parts the tool makes; None: nothing is said of parts.
    """

    door: ClassVar[str] = "wear"

    if TYPE_CHECKING:  # added to each class behind its own fields, so that these come first
        depth: float | None = field(default=None, kw_only=True)

    def __init_subclass__(cls, abstract: bool = False, **options: Any) -> None:
        if not abstract:
            add_common_fields(cls, {"depth": PERMITTED_DEPTH})
        super().__init_subclass__(abstract=abstract, **options)

    @property
    def relative(self) -> bool:
        """Whether its depths are no lengths, to be compared between places and designs only."""
        return False

    def rate(self, at: Sliding) -> Array:
        """Depth worn per second (n,), not negative."""
        raise NotImplementedError(f"{type(self).__name__} states no wear: define rate(self, at)")

    def fault(self) -> str:
        """What is wrong with the form of its answer at places without pressure, tried before a run; empty if nothing."""
        none = np.zeros(5)
        points = f"for {len(none)} places an array of shape {none.shape}, a number each,"
        with np.errstate(all="ignore"):
            return fault(
                "rate", lambda: self.rate(Sliding(none, none)),
                lambda found: np.asarray(found, dtype=np.float64).shape == none.shape, points,
            )  # fmt: skip
