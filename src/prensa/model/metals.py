"""Where the numbers of a material come from, and the range in which they were measured."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from prensa.model.fields import described
from prensa.model.units import Number, Rate, Strain
from prensa.precision import NEGLIGIBLE


def _rising(pair: tuple[float, float]) -> tuple[float, float]:
    if not 0.0 <= pair[0] <= pair[1]:
        raise ValueError("it must be a range [from, to] of numbers from zero on")
    return pair


def _ordered(pair: tuple[float, float]) -> tuple[float, float]:
    if not pair[0] <= pair[1]:
        raise ValueError("it must be a range [from, to]")
    return pair


StrainRange = Annotated[tuple[Strain, Strain], AfterValidator(_rising)]
RateRange = Annotated[tuple[Rate, Rate], AfterValidator(_rising)]
TemperatureRange = Annotated[tuple[Number, Number], AfterValidator(_ordered)]


@described
class Metal:
    """Where the numbers of a metal come from: its ``name``, the ``source``, and the range in which it was measured.

    In a case file, write the name of a metal of the library (``prensa materials`` lists them) or your own file instead, ``of:
    DC04`` or ``of: steel.yaml``, from which elastic constants and flow curve are taken; numbers that the case states as well, as
    in ``flow: {n: 0.2}``, replace those of the metal and are listed in ``changed``. ``strain``, ``rate`` (per second) and
    ``temperature`` (°C): ranges [from, to] of the plastic strains, their rates and the temperatures of the tests; ``holds``:
    temperatures (°C) at which a flow curve with a parameter ``T`` is valid, where they are more than those of the tests;
    ``MPa``: one in the unit of stress in which the metal was read.
    """

    name: str
    source: str
    strain: StrainRange
    rate: RateRange | None = None
    temperature: TemperatureRange | None = None
    holds: TemperatureRange | None = None
    changed: tuple[str, ...] = ()
    MPa: Annotated[Number, Field(gt=0)] | None = None

    def altered(self, keys: Iterable[str]) -> Metal:
        """The same, of a material in which other numbers of the metal have been put in at keys such as ``flow.K`` too."""
        return replace(self, changed=tuple(dict.fromkeys([*self.changed, *keys])))

    def beyond_temperatures(self, least: float, most: float) -> str:
        """What there is to say of a run between two temperatures, where they are beyond those of the tests; else nothing."""
        low, high = self.temperature or (-math.inf, math.inf)
        slack = NEGLIGIBLE * max(abs(least), abs(most))
        if low - slack <= least and most <= high + slack:
            return ""
        return (
            f"{self.name}, was measured at {_span(low, high)} and the run has {least:.4g} to {most:.4g} °C; stresses do not "
            "follow the temperature: give a curve that was measured there"
        )

    def refuses(self, T: float) -> str:
        """What there is to say of a flow curve of the metal that a case puts at a temperature outside its range; else nothing."""
        low, high = self.holds or self.temperature or (-math.inf, math.inf)
        if low <= T <= high:
            return ""
        why = "is stated for" if self.holds else "was measured at"
        return (
            f"T is {T:g} °C, and the flow curve of {self.name!r} {why} {_span(low, high)}; take a temperature in that "
            "range, or a metal that was measured at this one"
        )

    def words(self) -> str:
        """Name, range and source in one sentence."""
        ranges = [f"plastic strain {self.strain[0]:g} to {self.strain[1]:g}"]
        ranges += [f"rate {self.rate[0]:g} to {self.rate[1]:g} /s"] if self.rate else []
        if self.temperature:
            ranges.append(_span(*self.temperature))
        changed = f"; {', '.join(self.changed)} of the case" if self.changed else ""
        return f"{self.name} ({', '.join(ranges)}{changed}): {self.source}"


def _span(low: float, high: float) -> str:
    return f"{low:g} °C" if low == high else f"{low:g} to {high:g} °C"


def metals_of(problem: Any) -> Iterator[tuple[str, Metal]]:
    """Bodies of a problem whose material was taken from a metal, with it."""
    for name, body in problem.bodies.items():
        metal = getattr(body.material, "of", None)
        if isinstance(metal, Metal):
            yield name, metal
