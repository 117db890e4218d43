"""Chains of lines and arcs out of drawings: DXF files of any program, and tables of points."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from math import cos, hypot, isnan, radians, sin
from pathlib import Path
from typing import Any, NamedTuple

from prensa.model.sheets import DataError, read_sheet
from prensa.model.tables import found_file
from prensa.model.units import factor
from prensa.precision import DRAWN

Point = tuple[float, float]

MOST_SEGMENTS = 5000  # lines and arcs of a tool
MOST_ENTITIES = 10_000  # of a drawing in which it is
NOTES = {"TEXT", "MTEXT", "DIMENSION", "HATCH", "POINT", "LEADER", "MULTILEADER", "VIEWPORT", "ATTDEF", "XLINE", "RAY"}
LENGTHS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 13: "um", 14: "dm"}  # values of $INSUNITS


class Segment(NamedTuple):
    """A line (``through`` None) or an arc from ``start`` to ``end``."""

    start: Point
    end: Point
    through: Point | None = None

    def turned(self) -> Segment:
        """The same, walked the other way."""
        return Segment(self.end, self.start, self.through)


def vertices(drawing: Any, context: Any) -> list[Any]:
    """Points of a `prensa.Profile` out of a `prensa.Drawing`: pairs, and mappings of ``through`` and ``to`` for arcs.

    context: that of the validation, with the case's folder and units. A chain that closes ends with its first point.

    Raises
    ------
    ValueError
        For a file that is not there or cannot be read, and for lines that make no chain.

    """
    try:
        return _vertices(drawing, context)
    except ValueError as error:  # names in a damaged file may hold halves of characters, which no message can
        raise ValueError(str(error).encode("utf-8", "backslashreplace").decode("utf-8")) from None


def _vertices(drawing: Any, context: Any) -> list[Any]:
    path = found_file(drawing.file, context, "the drawing")
    what = f"the drawing {drawing.file!r}"
    unit = drawing.unit
    if Path(path).suffix.lower() == ".dxf":
        segments, own = _dxf(path, drawing.layer, what)
        unit = unit or own
        # Drawings list lines in the order in which they were drawn, and in either direction.
        walk = _chain(segments, what)
    else:
        if drawing.layer is not None:
            raise ValueError(f"{what} is a table of points, and has no layer {drawing.layer!r}")
        walk, own = _table(path, what)
        unit = unit or own
    if drawing.reverse:
        walk = [s.turned() for s in reversed(walk)]
    units = (context or {}).get("units", {})
    scale = factor(f"1 {unit}", units.get("length", "mm"), "N", (0, 1)) if unit else 1.0

    def placed(x: Point) -> Point:
        # The origin is given in the units of the case, so that it comes off after the scale.
        return scale * x[0] - drawing.origin[0], scale * x[1] - drawing.origin[1]

    out: list[Any] = [placed(walk[0].start)]
    for s in walk:
        out.append(placed(s.end) if s.through is None else {"through": placed(s.through), "to": placed(s.end)})
    return out


def _dxf(path: str, layer: str | None, what: str) -> tuple[list[Segment], str | None]:
    """Lines and arcs of a DXF file, and its unit of length."""
    try:
        import ezdxf
    except ImportError:
        raise ValueError(f"{what} needs a reader of DXF files: pip install 'prensa[dxf]'") from None
    _entities(path, what)
    try:
        document = ezdxf.readfile(path)
        # Notes and dimensions lie beside every outline; only what has a shape may be refused or read.
        found: list[Any] = [e for e in document.modelspace() if e.dxftype() not in NOTES]
        layers = sorted({e.dxf.layer for e in found})
    except Exception as error:  # of damaged files the reader says so in errors of many kinds
        raise ValueError(f"{what} cannot be read as DXF: {error or type(error).__name__}") from None
    # files without a header get one, in metres, while they are read
    stated = b"$INSUNITS" in Path(path).read_bytes()
    unit = LENGTHS.get(document.header.get("$INSUNITS", 0)) if stated else None
    if layer is not None:
        found = [e for e in found if e.dxf.layer.casefold() == layer.casefold()]
        if not found:
            raise ValueError(
                f"{what} has nothing on the layer {layer!r}; its layers are {', '.join(map(repr, layers))}"
            )
    if not found:
        raise ValueError(f"{what} has no lines and arcs in its model space")
    segments: list[Segment] = []
    for entity in found:
        # Polylines hold arcs as bulges; the reader makes lines and arcs of them.
        parts = entity.virtual_entities() if entity.dxftype() in ("LWPOLYLINE", "POLYLINE") else [entity]
        segments += [s for part in parts for s in _segments(part, what)]
    return [s for s in segments if s.start != s.end], unit


def _entities(path: str, what: str) -> None:
    """Refuse drawings of whole plants before the reader makes an object of each entity: every first line of a pair that is 0."""
    count = sum(line.strip() == b"0" for line in Path(path).read_bytes().splitlines()[::2])
    if count > MOST_ENTITIES:
        raise ValueError(
            f"{what} has {count} entities, and no more than {MOST_ENTITIES} are read: save the lines and arcs of the tool alone"
        )


def _segments(entity: Any, what: str) -> Iterable[Segment]:
    kind, e = entity.dxftype(), entity.dxf
    if kind == "LINE":
        return [Segment((e.start.x, e.start.y), (e.end.x, e.end.y))]
    if kind not in ("ARC", "CIRCLE"):
        raise ValueError(
            f"{what} has {kind.lower()}s (layer {e.layer!r}): a tool is made of lines and arcs; convert them there"
        )
    # Arcs of mirrored drawings have their extrusion along −z, and angles in axes whose x points to the left.
    (cx, cy, _), r, out = entity.ocs().to_wcs(e.center), e.radius, 1.0 if e.extrusion.z > 0 else -1.0
    first, last = (e.start_angle, e.end_angle) if kind == "ARC" else (0.0, 360.0)
    sweep = (last - first) % 360.0 or 360.0
    steps = [first + sweep * k / 4 for k in range(5)]  # two arcs: one that is a whole circle has no ends
    x = [(cx + out * r * cos(radians(t)), cy + r * sin(radians(t))) for t in steps]
    return [Segment(x[0], x[2], x[1]), Segment(x[2], x[4], x[3])] if sweep > 180.0 else [Segment(x[0], x[4], x[2])]


def _chain(segments: list[Segment], what: str) -> list[Segment]:
    """Segments one after the other, from the left end, or counter-clockwise."""
    if len(segments) > MOST_SEGMENTS:
        raise ValueError(
            f"{what} has {len(segments)} lines and arcs, no tool has more than {MOST_SEGMENTS}: name its layer with 'layer'"
        )
    points = [x for s in segments for x in (s.start, s.end)]
    size = max(hypot(x[0] - points[0][0], x[1] - points[0][1]) for x in points)
    ends: list[Point] = []

    def number(x: Point) -> int:
        # Ends that CAD programs draw at one point differ by round-off: they are one within a share of the drawing's size.
        for i, y in enumerate(ends):
            if hypot(x[0] - y[0], x[1] - y[1]) <= DRAWN * size:
                return i
        ends.append(x)
        return len(ends) - 1

    joined = [(number(s.start), number(s.end)) for s in segments]
    meets: dict[int, list[int]] = {}
    for i, pair in enumerate(joined):
        for end in pair:
            meets.setdefault(end, []).append(i)
    for end, several in meets.items():
        if len(several) > 2:
            x, y = ends[end]
            raise ValueError(f"{what} branches at ({x:g}, {y:g}): keep one chain, or name its layer with 'layer'")
    free = sorted((e for e, several in meets.items() if len(several) == 1), key=lambda e: ends[e])
    at, rest = free[0] if free else joined[0][0], set(range(len(segments)))
    walk: list[Segment] = []
    while here := [i for i in meets[at] if i in rest]:
        i = here[0]
        rest.remove(i)
        turn = joined[i][0] != at
        at = joined[i][0] if turn else joined[i][1]
        s = segments[i].turned() if turn else segments[i]
        # The profile is to be continuous to the last digit: gaps within the tolerance are closed here.
        walk.append(s._replace(start=walk[-1].end if walk else s.start))
    if rest:
        x, y = ends[joined[min(rest)][0]]
        raise ValueError(
            f"{what} has several chains, one more at ({x:g}, {y:g}): name the layer of one with 'layer', or close its gaps "
            f"(more than {DRAWN * size:.1g} wide)"
        )
    if free:
        return walk
    walk[-1] = walk[-1]._replace(end=walk[0].start)
    # The sign of the area gives the direction; points on arcs count, since two half circles have no area between their ends.
    corners = [x for s in walk for x in ([s.start] if s.through is None else [s.start, s.through])]
    area = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, corners[1:] + corners[:1]))
    return walk if area > 0 else [s.turned() for s in reversed(walk)]


def _table(path: str, what: str) -> tuple[list[Segment], str | None]:
    """Lines and arcs out of rows ``x, y``, or ``x, y, through x, through y`` of an arc that ends there; and the stated unit."""
    try:
        sheet = read_sheet(Path(path), named=False, ragged=True)
    except DataError as error:
        raise ValueError(f"{what} has what is no row of numbers: {error}") from None
    rows: list[list[float]] = []
    for line, row in zip(sheet.lines, sheet.rows):
        rows.append([x for x in row if not isnan(x)])
        # An empty cell between others would shift what stands behind it.
        if len(rows[-1]) not in (2, 4) or any(isnan(x) for x in row[: len(rows[-1])]):
            cells = ", ".join(f"{x:g}" for x in row)
            raise ValueError(f"{path}:{line}: {cells} is not x, y, or x, y and a point that the arc to there goes through")
    if len(rows) < 2:
        raise ValueError(f"{what} has fewer than two points")
    units = {unit for unit in sheet.units if unit}
    if len(units) > 1:
        raise ValueError(f"{what} states several units, {', '.join(sorted(units))}; write all coordinates in one")
    walk = [Segment((a[0], a[1]), (b[0], b[1]), (b[2], b[3]) if len(b) == 4 else None) for a, b in pairwise(rows)]
    return walk, units.pop() if units else None
