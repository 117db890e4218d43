"""Tool bounded by a chain of lines and arcs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    Discriminator,
    Field,
    Tag,
    TypeAdapter,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from prensa.geometry.chain import ChainError, Piece, chain
from prensa.geometry.outline import of_chain
from prensa.model.fields import Fillets, described
from prensa.model.names import Finding
from prensa.model.units import Length, LengthUnit, Whole
from prensa.tools.analytic import Tool
from prensa.tools.tool import ToolShape
from prensa.types import Array

__all__ = ["Arc", "Drawing", "Profile"]


@described
class Arc:
    """Arc of a profile from the point before it ``through`` a point to its end ``to``."""

    through: tuple[Length, Length]
    to: tuple[Length, Length]


def _vertex_kind(value: Any) -> str:
    return "arc" if isinstance(value, dict | Arc) else "point"


Vertex = Annotated[
    Annotated[tuple[Length, Length], Tag("point")] | Annotated[Arc, Tag("arc")], Discriminator(_vertex_kind)
]


@described
class Drawing:
    """Points of a profile from a ``file``: a chain of lines, arcs, polylines, splines, ellipses of a DXF drawing, or a CSV table.

    The chain is walked from its left end, a closed one counter-clockwise; ``reverse`` turns that round (for a die, or a cavity).
    Of several chains in a drawing one is chosen: the one on a ``layer``, the one nearest to a place, ``near``, or by the number
    of the ``part``, counted from the left. ``unit``: the drawing's unit of length (default: the one that it states, else the
    case's). ``origin``: the place in the drawing that is the tool's reference point; like ``near`` in the drawing's axes, as a
    length of the case. ``tolerance``: largest distance of arcs from the splines and ellipses that they stand for, and largest gap
    between two ends that is closed (default: 1e-6 and 1e-3 of the drawing's size).
    """

    file: str
    layer: str | None = None
    part: Annotated[Whole, Field(ge=1)] | None = None
    near: tuple[Length, Length] | None = None
    unit: LengthUnit | None = None
    origin: tuple[Length, Length] = (0.0, 0.0)
    reverse: bool = False
    tolerance: Annotated[Length, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _check(self) -> Drawing:
        if self.part is not None and self.near is not None:
            raise ValueError("'part' and 'near' both choose a chain; give one of them")
        return self


class DrawnPoints(tuple[Any, ...]):
    """Points that were read from a file: a tuple, with ``notes`` on what was read and ``warnings`` of what was mended."""

    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def _drawn(value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
    """The points of a file, where one is named in their place."""
    if isinstance(value, str):
        value = {"file": value}
    if isinstance(value, dict):
        value = TypeAdapter(Drawing).validate_python(value, context=info.context)
    if not isinstance(value, Drawing):
        return value if isinstance(value, DrawnPoints) else handler(value)
    from prensa.importers.drawings import drawn

    read = drawn(value, info.context)
    points = DrawnPoints(handler(read.points))
    points.notes, points.warnings = read.notes, read.warnings
    return points


Points = Annotated[tuple[Vertex, ...], WrapValidator(_drawn)]




class Chained(ToolShape, abstract=True):
    """What tools bounded by a chain have in common: points in the tool's frame, and fillets."""

    points: tuple[Any, ...]
    fillet: Any

    def pieces(self, rounding: float) -> tuple[list[Piece], bool]:
        """Lines and arcs with the tool on the left, and whether they close; ``rounding``: radius of automatic fillets.

        Raises
        ------
        ChainError
            As `chain`, with the index of the point in the description.

        """
        raise NotImplementedError

    def findings(self, p: Any, path: tuple[str | int, ...]) -> Iterator[Finding]:
        """Points and fillets that make no chain."""
        try:
            self.pieces(0.0)
        except ChainError as error:
            where: tuple[str | int, ...] = (*path, error.key)
            if error.point is not None and (error.key == "points" or isinstance(self.fillet, tuple)):
                where = (*where, error.point)
            yield Finding(where, str(error))

    def looks(self, outward: Array) -> Array:
        """Its points say where it looks."""
        return np.array([0.0, -1.0])

    def shape(self, direction: Array, rounding: float) -> Tool:
        """The chain."""
        from prensa.tools.chain import Chain

        return Chain(*self.pieces(rounding))

    def tip(self) -> str:
        """What makes an end sharp: the fillet, or the points without one."""
        return "fillet" if self.fillet is not None else "points"

    def details(self, shape: Tool, direction: Array) -> str:
        """How round it is."""
        return f", convex radii from {shape.radius:.4g} up"

    def notes(self) -> tuple[str, ...]:
        """What was read from a file."""
        return getattr(self.points, "notes", ())

    def doubts(self) -> Iterator[tuple[str, str]]:
        """What was mended in a file."""
        yield from (("points", words) for words in getattr(self.points, "warnings", ()))

    def goes_on(self, shape: Tool) -> bool:
        """An open chain does, beyond both ends."""
        return shape.half_space or not np.isfinite(shape.period)

    def outline(self, depth: float) -> list[Array]:
        """The chain; the ends of an open one are closed far inside the tool."""
        return [of_chain(*self.pieces(0.0), depth)]


class Profile(Chained):
    """Rigid tool bounded by a chain of lines and arcs: walk along ``points`` with the tool on the left.

    ``points`` are corners in the frame of the tool (its reference point is the origin), or arcs to the next corner. An open
    profile continues straight beyond both ends; a ``closed`` one returns to its first point, and is a cavity (bodies inside) if
    walked clockwise. ``fillet``: radius of the rounding of its corners, one for all or one for each point; 0 is sharp. Not
    given, a convex corner that moves on a surface is rounded with a quarter of an element. Instead of points, give the name of a
    DXF or CSV file, or a `Drawing`.
    """

    points: Points
    fillet: Fillets | None = None
    closed: bool = False
    type: Literal["profile"] = "profile"

    def pieces(self, rounding: float) -> tuple[list[Piece], bool]:
        """As `Chained.pieces`."""
        points, fillet = self.points, self.fillet
        returns = len(points) > 2 and points[0] == getattr(points[-1], "to", points[-1])
        if returns and not self.closed:
            raise ChainError("the points return to the first one: say 'closed: true' as well", None, "closed")
        if returns and not isinstance(points[-1], Arc):
            points = points[:-1]
            fillet = fillet[: len(points)] if isinstance(fillet, tuple) else fillet
        return chain(points, fillet, self.closed, rounding), self.closed

    def hint(self, way: Array | None = None) -> str:
        """Which way to walk."""
        return (
            "; or its points are in the wrong order: walk along them with the tool on the left (reverse them; those "
            "of a file with 'points: {file: …, reverse: true}')"
        )
