"""Lines, arcs and curves of DXF drawings: blocks expanded, notes left out, layers that are off skipped."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, floor, isfinite, pi, radians, sin
from pathlib import Path
from typing import Any

from prensa.importers.segments import Curve, Point, Segment
from prensa.model.fields import LARGEST
from prensa.precision import NEGLIGIBLE

MOST_ENTITIES = 10_000  # of a drawing in which a tool is: one with more shows much besides it
NOTES = {"TEXT", "MTEXT", "DIMENSION", "HATCH", "POINT", "LEADER", "MULTILEADER", "VIEWPORT", "ATTDEF", "ATTRIB", "XLINE", "RAY"}
LENGTHS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 7: "km", 10: "yd", 13: "um", 14: "dm"}  # values of $INSUNITS
OTHER_LENGTHS = {3: "miles", 8: "microinches", 9: "mils", 11: "angstroms", 12: "nanometres", 15: "decametres", 16: "hectometres"}


@dataclass
class Found:
    """What a drawing holds: ``segments`` and ``curves``, its ``unit`` (None: not stated), its ``layers``.

    ``notes``: what was left out or expanded; ``warnings``: what of that may matter.
    """

    segments: list[Segment] = field(default_factory=list)
    curves: list[Curve] = field(default_factory=list)
    unit: str | None = None
    layers: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def read(path: str, layer: str | None, what: str) -> Found:
    """Lines, arcs and curves of a DXF file, of one layer if that is named.

    Raises
    ------
    ValueError
        If it cannot be read, is too large, or has none.

    """
    try:
        import ezdxf  # noqa: F401  (an extra)
    except ImportError:
        raise ValueError(f"{what} needs a reader of DXF files: pip install 'prensa[dxf]'") from None
    _count(path, what)
    out = Found()
    try:
        document = _document(path, out)
        parts = list(_Expansion(document, what, out).parts())
    except _Refused as error:
        raise ValueError(str(error)) from None
    except Exception as error:  # of damaged files the reader says so in errors of many kinds
        raise ValueError(f"{what} cannot be read as DXF: {error or type(error).__name__}") from None
    # files without a header get one, in metres, while they are read
    stated = b"$INSUNITS" in Path(path).read_bytes()
    code = document.header.get("$INSUNITS", 0) if stated else 0
    out.unit = LENGTHS.get(code, OTHER_LENGTHS.get(code))
    out.layers = sorted({name for _, name in parts})
    if layer is not None:
        parts = [(e, name) for e, name in parts if name.casefold() == layer.casefold()]
        if not parts:
            raise ValueError(
                f"{what} has nothing on the layer {layer!r}; its layers are {', '.join(map(repr, out.layers)) or 'empty'}"
            )
    _sorted_out(parts, what, out)
    return out


class _Refused(Exception):
    """What is refused while the reader works, in words."""


def _count(path: str, what: str) -> None:
    """Refuse drawings of whole plants before the reader makes an object of each entity: every first line of a pair that is 0."""
    count = sum(line.strip() == b"0" for line in Path(path).read_bytes().splitlines()[::2])
    if count > MOST_ENTITIES:
        raise ValueError(
            f"{what} has {count} entities, and no more than {MOST_ENTITIES} are read: save the lines and arcs of the tool alone"
        )


def _document(path: str, out: Found) -> Any:
    """The drawing; one that is damaged is read as far as it can be repaired."""
    import ezdxf
    from ezdxf import recover

    # what the reader logs of damaged files is said in a warning
    logging.getLogger("ezdxf").addHandler(logging.NullHandler())
    try:
        return ezdxf.readfile(path)
    except OSError:  # no drawing at all
        raise
    except Exception:
        document, _ = recover.readfile(path)
        out.warnings.append("it is damaged and was repaired as far as possible; look at what was read (prensa check --picture)")
        return document


class _Expansion:
    """Entities of the model space of a document with those of its blocks in their places."""

    def __init__(self, document: Any, what: str, out: Found) -> None:
        self.document, self.what, self.out = document, what, out
        self.count = 0
        self.hidden: Counter[str] = Counter()
        self.blocks: Counter[str] = Counter()

    def parts(self) -> Iterator[tuple[Any, str]]:
        """Entities, each with its layer."""
        for entity in self.document.modelspace():
            yield from self._parts(entity, "0", ())
        if self.blocks:
            names = ", ".join(f"{name!r} ({n} ×)" if n > 1 else repr(name) for name, n in sorted(self.blocks.items()))
            self.out.notes.append(f"blocks are drawn where they are inserted: {names}")
        if self.hidden:
            names = ", ".join(f"{n} on {name!r}" for name, n in sorted(self.hidden.items()))
            self.out.notes.append(f"left out, since it cannot be seen there: {names}")

    def _parts(self, entity: Any, layer: str, inside: tuple[str, ...]) -> Iterator[tuple[Any, str]]:
        kind = entity.dxftype()
        # What a block has on the layer 0 is on that on which it is inserted.
        own = entity.dxf.layer if entity.dxf.layer != "0" or not inside else layer
        if not self._seen(entity, own):
            self.hidden[own] += 1
        elif kind == "INSERT":
            yield from self._block(entity, own, inside)
        else:
            self.count += 1
            if self.count > MOST_ENTITIES:
                many = f"{self.what} has more than {MOST_ENTITIES} entities where its blocks are inserted"
                raise _Refused(f"{many}: save the lines and arcs of the tool alone")
            yield entity, own

    def _seen(self, entity: Any, layer: str) -> bool:
        """Whether an entity is shown: its layer is neither off nor frozen."""
        if entity.dxf.get("invisible", 0) or layer not in self.document.layers:
            return not entity.dxf.get("invisible", 0)
        found = self.document.layers.get(layer)
        return not (found.is_off() or found.is_frozen())

    def _block(self, insert: Any, layer: str, inside: tuple[str, ...]) -> Iterator[tuple[Any, str]]:
        name = insert.dxf.name
        block = insert.block()
        if block is None or block.block.is_xref or block.block.is_xref_overlay:
            self.out.warnings.append(f"the block {name!r} is in another file and is left out; bind it in the drawing")
            return
        if name in inside:
            raise _Refused(f"{self.what} has a block {name!r} that is inserted in itself; draw it anew")
        self.blocks[name] += 1
        for copy in insert.multi_insert() if insert.mcount > 1 else (insert,):
            for part in copy.virtual_entities():
                yield from self._parts(part, layer, (*inside, name))


# ------------------------------------------------------------------------------------------------------------ entities
def _sorted_out(parts: list[tuple[Any, str]], what: str, out: Found) -> None:
    """Lines, arcs and curves of entities into what was found; others are counted."""
    notes, strange = Counter[str](), Counter[str]()
    heights: list[float] = []
    for entity, layer in parts:
        kind = entity.dxftype()
        if kind in NOTES:
            notes[kind] += 1
            continue
        try:
            found = list(_shapes(entity, layer, heights))
        except Exception as error:  # damaged entities fail in as many ways
            words = f"{what} has a damaged {kind.lower()} on the layer {layer!r}"
            raise ValueError(f"{words}: {error or type(error).__name__}") from None
        if not found and kind not in _READ:
            strange[kind] += 1
        out.segments += [s for s in found if isinstance(s, Segment) and s.start != s.end]
        out.curves += [c for c in found if isinstance(c, Curve)]
    if not all(isfinite(c) and abs(c) <= LARGEST for s in out.segments for x in (s.start, s.end) for c in x):
        raise ValueError(f"{what} has coordinates that are not usable numbers")
    if notes:
        out.notes.append(f"left out: {_counted(notes)}")
    if strange:
        out.warnings.append(f"left out: {_counted(strange)}; explode or convert them to lines, arcs and splines if they matter")
    if heights and max(heights) - min(heights) > 0:
        out.warnings.append(f"its z goes from {min(heights):g} to {max(heights):g} and is left out; draw the section in x, y")
    if not out.segments and not out.curves:
        others = f"; it has {_counted(strange)}: explode or convert them" if strange else "; draw the outline there"
        raise ValueError(f"{what} has no lines and arcs in its model space{others}")


def _counted(kinds: Counter[str]) -> str:
    return ", ".join(f"{n} {kind.lower()}{'s' * (n > 1)}" for kind, n in sorted(kinds.items()))


_READ = {"LINE", "ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE", "ELLIPSE", "SPLINE"}


def _shapes(entity: Any, layer: str, heights: list[float]) -> Iterator[Segment | Curve]:
    """Lines, arcs and curves of an entity; none of a kind that has no shape here."""
    kind, e = entity.dxftype(), entity.dxf
    if kind == "LINE":
        heights += [e.start.z, e.end.z]
        yield Segment((e.start.x, e.start.y), (e.end.x, e.end.y), None, layer)
    elif kind in ("ARC", "CIRCLE"):
        yield from _arcs(entity, layer)
    elif kind == "POLYLINE" and entity.is_2d_polyline and e.flags & 4:
        # A polyline fitted by a spline has the polygon of its control points besides, marked by 16.
        points = [v.dxf.location for v in entity.vertices if not v.dxf.flags & 16]
        points += points[:1] if entity.is_closed else []
        yield from (Segment((a.x, a.y), (b.x, b.y), None, layer) for a, b in pairwise(points))
    elif kind == "LWPOLYLINE" or (kind == "POLYLINE" and (entity.is_2d_polyline or entity.is_3d_polyline)):
        for part in entity.virtual_entities():
            yield from _shapes(part, layer, heights)
    elif kind == "ELLIPSE":
        yield _ellipse(entity.construction_tool(), layer, e.start_param, e.end_param)
    elif kind == "SPLINE":
        yield _spline(entity.construction_tool(), layer)


def _arcs(entity: Any, layer: str) -> Iterator[Segment | Curve]:
    """One arc, or two of what is more than half a circle; an ellipse of what does not lie in the plane."""
    kind, e = entity.dxftype(), entity.dxf
    first, last = (e.start_angle, e.end_angle) if kind == "ARC" else (0.0, 360.0)
    sweep = (last - first) % 360.0 or 360.0
    if abs(e.extrusion.normalize().z) < 1:
        from ezdxf.math import ConstructionEllipse

        tilted = ConstructionEllipse.from_arc(entity.ocs().to_wcs(e.center), e.radius, e.extrusion, first, first + sweep)
        yield _ellipse(tilted, layer, tilted.start_param, tilted.start_param + radians(sweep))
        return
    # Arcs of mirrored drawings have their extrusion along −z, and angles in axes whose x points to the left.
    (cx, cy, _), r, out = entity.ocs().to_wcs(e.center), e.radius, 1.0 if e.extrusion.z > 0 else -1.0
    steps = [first + sweep * k / 4 for k in range(5)]  # two arcs: one that is a whole circle has no ends
    x = [(cx + out * r * cos(radians(t)), cy + r * sin(radians(t))) for t in steps]
    if sweep > 180.0:
        yield from (Segment(x[0], x[2], x[1], layer), Segment(x[2], x[4], x[3], layer))
    else:
        yield Segment(x[0], x[4], x[2], layer)


def _ellipse(tool: Any, layer: str, first: float, last: float) -> Curve:
    """An ellipse between two parameters (rad), cut at its axes."""
    c, a, b = tool.center, tool.major_axis, tool.minor_axis
    sweep = (last - first) % (2 * pi)
    last = first + (sweep if sweep > NEGLIGIBLE else 2 * pi)
    quarters = [k * pi / 2 for k in range(floor(2 * first / pi) + 1, floor(2 * last / pi) + 1)]

    def point(t: float) -> Point:
        return c.x + cos(t) * a.x + sin(t) * b.x, c.y + cos(t) * a.y + sin(t) * b.y

    def slope(t: float) -> Point:
        return cos(t) * b.x - sin(t) * a.x, cos(t) * b.y - sin(t) * a.y

    inner = [t for t in quarters if first < t < last]
    return Curve(point, slope, (first, *inner, last), layer, "ellipse")


def _spline(tool: Any, layer: str) -> Curve:
    """A spline, cut at its knots."""
    knots = list(tool.knots())
    first, last = knots[tool.order - 1], knots[tool.count]
    inner = sorted({t for t in knots if first < t < last})

    def point(t: float) -> Point:
        x = tool.point(min(max(t, first), last))
        return x.x, x.y

    def slope(t: float) -> Point:
        d = tool.derivative(min(max(t, first), last), 1)[1]
        return d.x, d.y

    return Curve(point, slope, (first, *inner, last), layer, "spline")
