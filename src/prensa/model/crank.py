"""The drive of a mechanical press: the slider-crank mechanism, its way and the time that it takes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from prensa.model.fields import described
from prensa.model.names import Finding, suggest
from prensa.model.units import Angle, Length, Number
from prensa.precision import NEGLIGIBLE

AXIS = {
    "down": ("y", -1.0), "up": ("y", 1.0), "left": ("x", -1.0), "right": ("x", 1.0), "back": ("z", -1.0), "front": ("z", 1.0),
}  # fmt: skip


@described
class Crank:
    """A tool that the slide of a mechanical press carries: crank and connecting rod, turning at a uniform speed.

    ``stroke``: of the slide, twice the radius of the crank; ``ratio``: of that radius to the length of the connecting rod (0: a
    rod so long that the motion is harmonic). The crank turns from ``start``, its angle before bottom dead centre, to ``end``
    (0: bottom dead centre; after it angles are negative); ``height`` in place of ``start``: how high the slide is above bottom
    dead centre when the step begins, on its way down. The tool goes from where it is when the step begins, ``toward`` where
    the press closes (``back`` and ``front`` in space). ``strokes_per_minute`` is how fast the crank turns, and so gives the step
    its duration.
    """

    stroke: Annotated[Length, Field(gt=0)]
    ratio: Annotated[Number, Field(ge=0, lt=1)] = 0.0
    start: Annotated[Angle, Field(gt=-math.tau, lt=math.tau)] | None = None
    height: Annotated[Length, Field(gt=0)] | None = None
    end: Annotated[Angle, Field(gt=-math.tau, lt=math.tau)] = 0.0
    strokes_per_minute: Annotated[Number, Field(gt=0)] | None = None
    toward: Literal["down", "up", "left", "right", "back", "front"] = "down"

    @model_validator(mode="after")
    def _check(self) -> Crank:
        if (self.start is None) == (self.height is None):
            raise ValueError("give either 'start', the angle before bottom dead centre, or 'height' above it")
        if self.height is not None and self.height > self.stroke:
            raise ValueError(f"the slide is never {self.height:g} above bottom dead centre: its stroke is {self.stroke:g}")
        if not 0.0 < self.first - self.end <= math.tau * (1 + NEGLIGIBLE):
            raise ValueError(
                f"the crank turns from {math.degrees(self.first):.6g} to {math.degrees(self.end):.6g} degrees before bottom dead "
                "centre; angles fall as it turns, by a turn at most, and are negative beyond bottom dead centre"
            )
        return self

    @property
    def first(self) -> float:
        """Angle before bottom dead centre at which the step begins."""
        if self.start is not None:
            return self.start
        assert self.height is not None
        if not self.ratio:
            return math.acos(1.0 - 2.0 * self.height / self.stroke)
        r, rod = 0.5 * self.stroke, 0.5 * self.stroke / self.ratio
        d = r + rod - self.height  # from the axis of the crank to the slide
        # Law of cosines in the triangle of crank, rod and slide; round-off at the dead centres would leave the range of acos.
        return math.acos(max(-1.0, min(1.0, (d * d + r * r - rod * rod) / (2.0 * d * r))))

    @property
    def seconds(self) -> float | None:
        """Duration of the turn; None where no speed is given."""
        if self.strokes_per_minute is None:
            return None
        return (self.first - self.end) / math.tau * 60.0 / self.strokes_per_minute

    @property
    def x(self) -> Crank | None:
        """What drives the tool along x."""
        return self if AXIS[self.toward][0] == "x" else None

    @property
    def y(self) -> Crank | None:
        """What drives the tool along y."""
        return self if AXIS[self.toward][0] == "y" else None

    @property
    def z(self) -> Crank | None:
        """What drives the tool along z."""
        return self if AXIS[self.toward][0] == "z" else None

    @property
    def dead_centre(self) -> float | None:
        """Share of the turn, inside it, at which the slide is at bottom dead centre; None if it is not."""
        share = self.first / (self.first - self.end)
        return share if 0.0 < share < 1.0 else None

    def above(self, angle: float) -> float:
        """Height of the slide above bottom dead centre at an angle of the crank from there."""
        r, s = 0.5 * self.stroke, math.sin(angle)
        rise = 2.0 * r * math.sin(0.5 * angle) ** 2  # r (1 − cos), without its cancellation
        if not self.ratio:
            return rise
        # rod − √(rod² − r² sin²), multiplied out for the same reason
        return rise + r * self.ratio * s * s / (1.0 + math.sqrt(1.0 - (self.ratio * s) ** 2))

    def lever(self, angle: float) -> float:
        """Way of the slide per angle of the crank (length per rad), at an angle from bottom dead centre; zero there."""
        s, c = math.sin(angle), math.cos(angle)
        return 0.5 * self.stroke * s * (1.0 + self.ratio * c / math.sqrt(1.0 - (self.ratio * s) ** 2))

    def way(self, share: float) -> float:
        """Displacement along the tool's axis, with its sign, after that share of the turn."""
        here = self.first + share * (self.end - self.first)
        return AXIS[self.toward][1] * (self.above(self.first) - self.above(here))


def findings(p: Any, step: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
    """What is wrong with the cranks of a step of a problem: their tools, and durations that differ."""
    durations: dict[str, float] = {}
    for name, crank in step.crank.items():
        here = (*path, "crank", name)
        if name not in p.tools:
            yield Finding(here, f"unknown tool {name!r}{suggest(name, p.tools)}", at_key=True)
        if crank is None:
            continue
        if p.space == "axisymmetric" and crank.x is not None:
            yield Finding((*here, "toward"), "in axisymmetry a tool moves along y only")
        if p.space not in (None, "solid") and crank.z is not None:
            message = f"{crank.toward!r} is a direction of 'space: solid'; in the plane write down, up, left or right"
            yield Finding((*here, "toward"), message)
        if crank.seconds is None:
            continue
        if step.duration is not None:
            message = (
                f"the turn of the crank of {name!r} takes {crank.seconds:.6g} s, which is the duration of the step: leave out "
                "'duration', or 'strokes_per_minute'"
            )
            yield Finding((*here, "strokes_per_minute"), message)
        for other, seconds in durations.items():
            if abs(seconds - crank.seconds) > NEGLIGIBLE * seconds:
                message = (
                    f"the crank of {name!r} takes {crank.seconds:.6g} s for its turn, the crank of {other!r} {seconds:.6g} s: a "
                    "step has one duration; leave out one of the speeds"
                )
                yield Finding((*here, "strokes_per_minute"), message)
        durations[name] = crank.seconds
