"""Bodies that are brought to rolls or dies by a boundary of theirs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import model_validator

from prensa.model.fields import described
from prensa.model.names import Finding
from prensa.model.units import Displacement


@described
class Feed:
    """The longest way, ``x``, ``y`` or in space ``z``, by which a boundary pushes its body to the tools; to the side it is free.

    The step ends before that as soon as the tools grip: when the boundary would have to hold the body back, because rolls draw
    it in by friction. In the steps that follow the boundary is free. A body that touches nothing is fed all the way.
    """

    x: Displacement | None = None
    y: Displacement | None = None
    z: Displacement | None = None

    @model_validator(mode="after")
    def _check(self) -> Feed:
        ways = [way for way in (self.x, self.y, self.z) if way is not None]
        if len(ways) != 1 or ways[0] == 0.0:
            raise ValueError("give the way along x or along y, other than 0, like {x: 8}")
        return self

    @property
    def axis(self) -> str:
        """Direction of the way."""
        return next(axis for axis in "xyz" if getattr(self, axis) is not None)

    @property
    def way(self) -> float:
        """The way, with its sign."""
        return float(getattr(self, self.axis))


def findings(p: Any, step: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
    """What is wrong with the boundaries that a step of a problem feeds, all of which exist."""
    for name, feed in step.feed.items():
        here = (*path, "feed", name)
        if feed is None:
            continue
        if p.space == "axisymmetric" and feed.axis == "x":
            yield Finding((*here, "x"), "in axisymmetry a wire is fed along y, its axis", at_key=True)
        for kind in ("fixed", "by"):
            if getattr(getattr(step, kind).get(name), feed.axis, None) is not None:
                message = f"{feed.axis} of {name!r} is given by '{kind}' and by 'feed'; keep one"
                yield Finding((*here, feed.axis), message, at_key=True)


def ends_early(step: Any) -> bool:
    """Whether a step may end before its time: by what it waits for, or because what it feeds is gripped."""
    return step.until is not None or bool(step.feed)
