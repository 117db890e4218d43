"""Tools: keys that place them, checks, a shape, an outline for pictures.

A tool of one's own derives from `ToolShape` and gives its signed distance in NumPy; normal, curvature, surface coordinate,
rays and pictures are derived from it::

    class Roll(pr.ToolShape):
        radius: float

        def distance(self, x):
            return np.hypot(x[:, 0], x[:, 1]) - self.radius
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from prensa.model.doors import Member, add_common_fields
from prensa.model.fields import Position, Springs
from prensa.model.names import Finding
from prensa.model.press import Press, PressValue
from prensa.tools.implicit import Implicit
from prensa.types import Array, Index

if TYPE_CHECKING:
    from prensa.tools.analytic import Tool


COMMON: dict[str, Any] = {
    "at": Position | None,
    "touching": str | None,
    "above": str | None,
    "below": str | None,
    "spring": Springs | None,
    "press": PressValue | None,
}
"""Keys that all tools have, after their own."""


def rotation_of(turn: Sequence[float]) -> Array:
    """Rotation (3, 3) of a vector along its axis, as long as its angle (Rodrigues's formula)."""
    w = np.array(turn, dtype=np.float64)
    angle = float(np.linalg.norm(w))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = w / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


class Touched(NamedTuple):
    """Of triangles that are touched: largest height of their chords (length) and angle between them; ``beyond`` open borders."""

    chord: float
    angle: float
    beyond: bool


class ToolShape(Member, abstract=True):
    """Base of all tools: a frozen description whose annotated fields are keys of the case file, besides those of place.

    A tool states ``distance`` (or ``closest``), or makes its own ``shape``; the rest has answers that hold for any tool.
    The frame of a tool has its origin at the reference point and turns with the tool.

    Optional attributes of tools that state a ``distance`` or ``closest``: ``reach``, half the side (length) of the square
    about the reference point in which the surface is traced and beyond which it goes on straight (needed where it has no
    end, and where details are smaller than a hundredth of it).
    """

    door: ClassVar[str] = "tool"
    dimensions: ClassVar[tuple[int, ...]] = (2,)
    """Dimensions of the spaces in which it has a shape."""
    offered: ClassVar[bool] = True
    """Whether a case file may name it."""
    direction_key: ClassVar[str] = ""
    """Key that says where the face looks; empty where the tool's frame never turns to look at a boundary."""

    if TYPE_CHECKING:  # added to each class behind its own fields, so that these come first
        at: Position | None = field(default=None, kw_only=True)
        touching: str | None = field(default=None, kw_only=True)
        above: str | None = field(default=None, kw_only=True)
        below: str | None = field(default=None, kw_only=True)
        spring: Springs | None = field(default=None, kw_only=True)
        press: Press | None = field(default=None, kw_only=True)

    def __init_subclass__(cls, abstract: bool = False, **options: Any) -> None:
        if not abstract:
            add_common_fields(cls, COMMON)
        super().__init_subclass__(abstract=abstract, **options)

    # ----------------------------------------------------------------------------------------------------- geometry
    def distance(self, x: Array) -> Any:
        """Signed distance (k,) of points x (k, 2) in the tool's frame, negative inside; |∇g| = 1."""
        raise NotImplementedError(f"{type(self).__name__} has no shape: define distance(self, x) or closest(self, x)")

    def closest(self, x: Array) -> Any:
        """Signed distance, normal, curvature and surface coordinate of points x (k, 2): see `prensa.tools.analytic`.

        Derived from `distance` where a tool does not state it.
        """
        raise NotImplementedError

    def shape(self, direction: Array, rounding: float) -> Tool:
        """The shape in the tool's frame.

        Parameters
        ----------
        direction
            Unit vector (d,) in which the face looks.
        rounding
            Radius (length) of corners that the description leaves to the program.

        """
        return self._implicit()

    def looks(self, outward: Array) -> Array:
        """Unit vector (d,) in which the face looks, before a boundary with the outward normal (d,)."""
        given = getattr(self, self.direction_key, None) if self.direction_key else None
        direction = np.array(given, dtype=np.float64) if given is not None else -outward
        return np.asarray(direction / np.linalg.norm(direction))

    # ------------------------------------------------------------------------------------------------------- checks
    def findings(self, p: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
        """What is wrong with the tool in the problem p, at a path of the description; `prensa.model.checks` asks."""
        yield from self._no_length(path)

    def _no_length(self, path: tuple[str | int, ...]) -> Iterator[Finding]:
        key = self.direction_key
        given = getattr(self, key, None) if key else None
        if given is not None and not any(given):
            yield Finding((*path, key), f"the direction (0, 0) of '{key}' has no length; give a vector such as [0, 1]")

    def _along_axis(self, p: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
        """A flat tool in axisymmetry faces along the axis and is centred on it."""
        kind, key = getattr(self, "type", ""), self.direction_key
        given = getattr(self, key)
        if given is not None and given[0] == 0 and given[1] == 0:
            yield from self._no_length(path)
        elif p.space == "axisymmetric" and given is not None and given[0] != 0:
            yield Finding((*path, key), f"in axisymmetry a {kind} faces along the axis; write [0, 1] or [0, -1]")
        if p.space == "axisymmetric" and self.at is not None and self.at[0] != 0:
            yield Finding((*path, "at"), f"in axisymmetry a {kind} is centred on the axis; its x is 0")

    # ---------------------------------------------------------------------------------------- questions of the checks
    def face(self) -> tuple[float, str]:
        """Size of the part that presses, to be compared with the elements, and its key; infinite where there is none."""
        return np.inf, ""

    def tip(self) -> str:
        """Key of what makes the end towards a surface sharp, '' where `face` says enough; needs ``across`` of the shape."""
        return ""

    def hint(self, way: Array | None = None) -> str:
        """What to add to the message that the tool cannot be placed, on a ``way`` (d,) if given, or starts inside a body."""
        return ""

    def touched(self, shape: Tool, xi: Array) -> Touched | None:
        """How coarse the surface is where points (k, 3) in its frame touch it; None of what has no triangles."""
        return None

    def presented(self, shape: Tool) -> Array | None:
        """Unit vector (d,) along which an open surface looks as a whole; None of a closed one, and of other tools."""
        return None

    # ----------------------------------------------------------------------------------------------- words and pictures
    def details(self, shape: Tool, direction: Array) -> str:
        """What ``prensa check`` says of the placed tool besides its place."""
        if not self.direction_key:
            return ""
        return f", facing ({', '.join(f'{c:.4g}' for c in direction + 0.0)})"  # no minus before a zero

    def notes(self) -> tuple[str, ...]:
        """What ``prensa check`` says of how the description was read, a line each."""
        return ()

    def doubts(self) -> Iterator[tuple[str, str]]:
        """Keys of the description, each with what is allowed there but may matter; reported as warnings."""
        return iter(())

    def outline(self, depth: float) -> list[Array]:
        """Closed polygons, each (n, 2), about the reference point; a tool that looks somewhere looks along −y.

        ``depth``: extent (length) to draw of what has none.
        """
        return self._implicit().outline(depth)

    def facets(self, direction: Array, depth: float) -> tuple[Array, Index]:
        """Triangles of the surface in space about the reference point, for pictures: points (n, 3), and three for each (m, 3).

        ``direction`` (3,): where its face looks; ``depth``: extent (length) to draw of what has none.
        """
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)

    def _implicit(self) -> Implicit:
        """The shape that follows from what the tool states."""
        stated = type(self).closest is not ToolShape.closest
        if not stated and type(self).distance is ToolShape.distance:
            self.distance(np.zeros((1, 2)))  # says what to define
        return Implicit(self, stated)

    def mirrored(self, on_axis: bool, direction: Array) -> bool:
        """Whether the section is its own mirror image in axisymmetry, with the reference point on the axis or not."""
        return False
