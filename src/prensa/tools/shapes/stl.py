"""Rigid tools in space of triangulated surfaces in files."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from prensa.errors import along, coordinates
from prensa.importers import stl
from prensa.model.fields import Turn
from prensa.model.tables import digest_of, found_file
from prensa.model.units import Angle, Length, Number
from prensa.tools.analytic import Tool
from prensa.tools.facets import CREASE
from prensa.tools.place import FACING
from prensa.tools.tool import ToolShape, Touched, rotation_of
from prensa.types import Array, Flags, Index

if TYPE_CHECKING:
    from prensa.tools.curved import Curved

__all__ = ["Stl"]


def _found(path: Any, info: Any) -> Any:
    if isinstance(path, str) and path.lower().endswith((".step", ".stp")):
        name = Path(path).stem
        raise ValueError(f"{path!r} is a STEP file: make triangles of it, prensa import {path} --out {name}.stl, and name those")
    return found_file(path, info.context, "STL file") if isinstance(path, str) else path


def _one(value: Any) -> Any:
    """A unit by its name alone is one of it."""
    return f"1 {value}" if isinstance(value, str) and value.strip()[:1].isalpha() else value


class Stl(ToolShape):
    """Rigid tool in space bounded by the triangles of an STL ``file``, read as curved patches.

    The patches go through the corners of the triangles and have the mean normals there, so that they are not as coarse as the
    facets; flats stay flat. Edges between triangles that differ by more than the angle ``sharp`` are edges of the tool. The
    origin of the file is the reference point. ``unit``: the unit of length of the file, such as mm or inch (default: that of the
    case); ``scale``: a factor besides. ``turn``: rotation at the start, by which a z that is upright in the file becomes y:
    ``[-90 deg, 0, 0]``. Of a closed surface the normals look outwards; ``reverse`` turns them round, and ``false`` says that a
    closed one whose normals look inwards is a cavity with bodies inside. An open surface ends at its borders, which are rounded
    outwards with a quarter of an element if it moves on a surface. ``digest`` is filled in by the program: a run is resumed only
    with the file that it began with.
    """

    file: Annotated[str, BeforeValidator(_found)]
    unit: Annotated[Length, Field(gt=0), BeforeValidator(_one)] = 1.0
    scale: Annotated[Number, Field(gt=0)] = 1.0
    turn: Turn = (0.0, 0.0, 0.0)
    reverse: bool | None = None
    sharp: Annotated[Angle, Field(gt=0, lt=math.pi)] = math.pi / 6
    digest: str | None = None
    type: Literal["stl"] = "stl"

    dimensions: ClassVar[tuple[int, ...]] = (3,)

    @model_validator(mode="after")
    def _check(self) -> Stl:
        digest = digest_of(self.file)
        if self.digest not in (None, digest):
            raise ValueError(f"STL file {self.file!r} has changed since this case was written; run the case again")
        object.__setattr__(self, "digest", digest)
        surface = stl.read(self.file, digest)
        if surface.closed and surface.volume < 0.0 and self.reverse is None:
            raise ValueError(
                f"the surface in {Path(self.file).name!r} is inside out, its normals look into it: turn them round with "
                "'reverse: true' (or say 'reverse: false' if the tool is a cavity with bodies inside)"
            )
        return self

    def shape(self, direction: Array, rounding: float) -> Tool:
        """See `prensa.tools.curved`."""
        return self._made().with_lip(rounding)

    def _made(self) -> Curved:
        return _curved(self.file, self.digest or "", self.unit * self.scale, self.turn, bool(self.reverse), self.sharp)

    def touched(self, shape: Tool, xi: Array) -> Touched | None:
        """See `prensa.tools.curved`."""
        from prensa.tools.curved import Curved

        return shape.touched(xi) if isinstance(shape, Curved) else None

    def past_border(self, shape: Tool, xi: Array) -> Flags:
        """See `prensa.tools.curved`."""
        from prensa.tools.curved import Curved

        return shape.past_border(xi) if isinstance(shape, Curved) else super().past_border(shape, xi)

    def presented(self, shape: Tool) -> Array | None:
        """See `prensa.tools.curved`."""
        from prensa.tools.curved import Curved

        return shape.looks if isinstance(shape, Curved) else None

    def goes_on(self, shape: Tool) -> bool:
        """As an open surface does beyond its borders."""
        from prensa.tools.curved import Curved

        return isinstance(shape, Curved) and not shape.surface.closed

    def facets(self, direction: Array, depth: float) -> tuple[Array, Index]:
        """The triangles of the file."""
        surface = self._made().surface
        return surface.points, surface.triangles

    def hint(self, way: Array | None = None) -> str:
        """Units, and of an open surface which way it and its normals look: of a closed one that is known."""
        way_round = "leave 'reverse: true' out" if self.reverse else "'reverse: true' turns them round"
        turned = f"its normals look the wrong way ({way_round}), or "
        unsure = self.reverse is not None or not stl.read(self.file, self.digest or "").closed
        looks = self._made().looks
        if looks is not None and way is not None and looks @ way > FACING:  # as it should
            return "; or its 'unit' is another one"
        aside = f"it faces {along(looks)} and is to be turned ('turn'), or " if looks is not None else ""
        return f"; or {aside}{turned * unsure}its 'unit' is another one"

    def details(self, shape: Tool, direction: Array) -> str:
        """How large and how coarse it is."""
        from prensa.tools.curved import Curved

        if not isinstance(shape, Curved):
            return ""
        x, s = shape.surface.points, shape.surface
        size = " x ".join(f"{v:.4g}" for v in np.ptp(x, axis=0))
        sharp = int((shape.facets.edge_kinds == CREASE).sum())
        chord = float(shape.chords.max())
        angle = math.degrees(float(shape.facet_angles.max()))
        coarse = f"facets up to {angle:.3g}° apart"
        coarse += f" with chords up to {chord:.2g}, good for contacts deeper than {50.0 * chord:.2g}" if chord else ""
        coarse += f", normals off by up to {0.25 * angle:.2g}° on slivers" if chord else ""
        looks, flat = shape.looks, shape.facets.largest_flat
        way = f", faces {along(looks)}" if looks is not None else ""
        way = f", its largest flat faces {along(flat)}" if not way and flat is not None else way
        return (
            f", {Path(self.file).name}, {size}, {len(s.triangles)} triangles in {s.parts} part{'s' * (s.parts > 1)}, "
            f"{'closed' if s.closed else 'open'}{way}, {coarse}, {sharp} sharp edges"
        )

    def notes(self) -> tuple[str, ...]:
        """What was mended, and holes."""
        s = stl.read(self.file, self.digest or "")
        holes = s.holes
        place = coordinates(s.points[s.edges[holes[0]]].mean(axis=0)) if len(holes) else ""
        hole = f"the surface is open at {len(holes)} edges, as near ({place}) of the file: if it is that of a body, close it"
        said = [
            f"{s.turned} triangles looked the other way than the others, and are turned" if s.turned else "",
            f"{s.left_out} triangles without an area are left out" if s.left_out else "",
            f"{s.doubled} triangles were there twice, and count once" if s.doubled else "",
            hole if place else "",
        ]
        return tuple(f"{Path(self.file).name}: {words}" for words in said if words)


@lru_cache(maxsize=8)
def _curved(file: str, digest: str, unit: float, turn: tuple[float, ...], reverse: bool, sharp: float) -> Curved:
    """The shape, made once for all that ask for it; its search is compiled, which the description has no need of."""
    from prensa.tools.curved import Curved

    surface = stl.read(file, digest)
    surface = surface.reversed() if reverse else surface
    return Curved(replace(surface, points=unit * surface.points @ rotation_of(turn).T), sharp)
