"""Points of profiles out of drawings and tables of points, with what there is to say of how they were read."""

from __future__ import annotations

from itertools import pairwise
from math import isnan, sqrt
from pathlib import Path
from typing import Any, NamedTuple

from prensa.geometry.chain import shown
from prensa.importers import dxf
from prensa.importers.chains import Chain, Gap, chains, from_left, merged, nearest_gap
from prensa.importers.segments import Point, Segment, arcs_of, size_of
from prensa.model.fields import LARGEST
from prensa.model.sheets import DataError, read_sheet
from prensa.model.tables import found_file
from prensa.model.units import factor
from prensa.precision import DRAWN

OTHER_DRAWINGS = (".dwg", ".svg", ".pdf", ".step", ".stp", ".iges", ".igs")
MOST_SEGMENTS = 5000  # lines and arcs of a tool: one with more is a whole drawing, or its splines have too small a tolerance


class Drawn(NamedTuple):
    """``points`` of a profile: pairs, and mappings of ``through`` and ``to`` for arcs; notes on what was read, and warnings."""

    points: list[Any]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


class _Walk(NamedTuple):
    """Segments one after the other in the ``unit`` of the file (None: not stated)."""

    segments: list[Segment]
    unit: str | None
    notes: list[str]
    warnings: list[str]


def drawn(drawing: Any, context: Any) -> Drawn:
    """What a `prensa.Drawing` says. A chain that closes ends with its first point.

    context: that of the validation, with the case's folder and units.

    Raises
    ------
    ValueError
        For a file that is not there or cannot be read, and for lines that make no chain, or several of which none is chosen.

    """
    try:
        return _drawn(drawing, context)
    except ValueError as error:  # names in a damaged file may hold halves of characters, which no message can
        raise ValueError(str(error).encode("utf-8", "backslashreplace").decode("utf-8")) from None


def _drawn(drawing: Any, context: Any) -> Drawn:
    path = found_file(drawing.file, context, "the drawing")
    what = f"the drawing {drawing.file!r}"
    units = (context or {}).get("units", {})

    def scale_of(own: str | None) -> float:
        unit = drawing.unit or own
        if not unit:
            return 1.0
        try:
            return factor(f"1 {unit}", units.get("length", "mm"), "N", (0, 1))
        except ValueError:
            raise ValueError(f"{what} is in {unit}, which is not a unit of length here; give its 'unit', such as mm") from None

    suffix = Path(path).suffix.lower()
    if suffix in OTHER_DRAWINGS:
        raise ValueError(f"{what} is no DXF file and no table of points: save it as DXF (of release R12 or later)")
    is_drawing = suffix == ".dxf"
    walk = _of_drawing(path, drawing, what, scale_of) if is_drawing else _of_table(path, drawing, what)
    segments = [s.turned() for s in reversed(walk.segments)] if drawing.reverse else walk.segments
    scale = scale_of(walk.unit)

    def placed(x: Point) -> Point:
        # The origin is given in the units of the case, so that it comes off after the scale.
        return scale * x[0] - drawing.origin[0], scale * x[1] - drawing.origin[1]

    points: list[Any] = [placed(segments[0].start)]
    for s in segments:
        points.append(placed(s.end) if s.through is None else {"through": placed(s.through), "to": placed(s.end)})
    if drawing.unit:
        unit = f"taken to be in {drawing.unit}" + f" (it states {walk.unit})" * (walk.unit not in (None, drawing.unit))
    else:
        unit = f"in {walk.unit}, which it states" if walk.unit else "states no unit: its numbers are lengths of the case"
    return Drawn(points, (f"{what}: {unit}", *walk.notes), tuple(f"{what}: {w}" for w in walk.warnings))


# ------------------------------------------------------------------------------------------------------------ drawings
def _of_drawing(path: str, drawing: Any, what: str, scale_of: Any) -> _Walk:
    """The chain that is chosen of a DXF file."""
    found = dxf.read(path, drawing.layer, what)
    scale = scale_of(found.unit)
    given = None if drawing.tolerance is None else drawing.tolerance / scale
    segments = [s.straightened() for s in found.segments]
    size = size_of([*segments, *(chord for c in found.curves for chord in c.chords())])
    if not 0 < size <= LARGEST:
        raise ValueError(f"{what} has no extent that one can compute with: it is {size:g} wide")
    segments += _of_curves(found, given or DRAWN * size, what)
    if len(segments) > MOST_SEGMENTS:
        raise ValueError(
            f"{what} has {len(segments)} lines and arcs, no tool has more than {MOST_SEGMENTS}: name its layer with 'layer'"
            + ", or give a larger 'tolerance' for its splines" * bool(found.curves)
        )
    # Ends that CAD programs draw at one point differ by round-off: they are one within a share of the drawing's size.
    near = DRAWN * size
    segments, doubles = merged([s for s in segments if _long(s, near)], near)
    # Wider gaps are joined where half of the digits agree.
    gap = sqrt(DRAWN) * size if given is None else given
    several, joined = _of_layers(segments, near, gap)
    chain = _chosen(several, drawing, what, scale)
    place = "" if len(several) == 1 else f"part {several.index(chain) + 1} of {len(several)}: "
    mine = [g for g in joined if any(s.start in g or s.end in g for s in chain.segments)]
    gaps = [
        f"a gap of {g.width:.3g} at {shown(g.a)} is closed (up to {gap:.3g} are; 'tolerance' is another width)" for g in mine
    ]
    notes, warnings = [f"{place}{chain.line()}", *found.notes], [*found.warnings, *_few(doubles), *_few(gaps)]
    return _Walk(chain.segments, found.unit, notes, warnings)


def _long(s: Segment, near: float) -> bool:
    """Whether a segment is longer than what makes ends one."""
    return size_of([s]) > near


def _few(sentences: list[str]) -> list[str]:
    """The first of many sentences of one kind, and how many more there are."""
    return sentences if len(sentences) <= 4 else [*sentences[:3], f"{len(sentences) - 3} more like these"]


def _of_curves(found: dxf.Found, tolerance: float, what: str) -> list[Segment]:
    """Arcs in the place of splines and ellipses, and a note of how near they are."""
    out: list[Segment] = []
    worst = 0.0
    for curve in found.curves:
        try:
            arcs, off = arcs_of(curve, tolerance, MOST_SEGMENTS // 2)
        except (ValueError, OverflowError, ZeroDivisionError) as error:
            raise ValueError(f"{what} has {error}") from None
        out += arcs
        worst = max(worst, off)
    if out:
        many = len(found.curves)
        kinds = " and ".join(sorted({c.kind + "s" * (many > 1) for c in found.curves}))
        found.notes.append(
            f"{many} {kinds} became {len(out)} arcs with the same tangents, which leave the drawing by {worst:.2g} at most "
            f"(tolerance {tolerance:.2g})"
        )
    return out


def _of_layers(segments: list[Segment], near: float, gap: float) -> tuple[list[Chain], list[Gap]]:
    """Chains of a drawing; those of each layer by itself where lines of several layers meet and branch."""
    several, joined = chains(segments, near, gap)
    layers = dict.fromkeys(s.layer for s in segments)
    if len(layers) == 1 or not any(c.branch for c in several):
        return several, joined
    apart = [chains([s for s in segments if s.layer == name], near, gap) for name in layers]
    return from_left(c for some, _ in apart for c in some), [g for _, some in apart for g in some]


def _chosen(several: list[Chain], drawing: Any, what: str, scale: float) -> Chain:
    """The chain that the description chooses, or the only one."""
    if drawing.part is not None and not 1 <= drawing.part <= len(several):
        raise ValueError(f"{what} has no part {drawing.part}; {_listed(several)}")
    if drawing.part is not None:
        chain = several[drawing.part - 1]
    elif drawing.near is not None:
        place = (drawing.near[0] / scale, drawing.near[1] / scale)
        chain = min(several, key=lambda c: min(s.distance(place) for s in c.segments))
    elif len(several) > 1:
        x = several[1].segments[0].start
        nearest = nearest_gap(several)
        hint = ""
        if nearest is not None:
            hint = f"; the nearest ends, {shown(nearest.a)} and {shown(nearest.b)}, are {nearest.width:.3g} apart"
            hint += ", which a larger 'tolerance' joins"
        raise ValueError(
            f"{what} has several chains, one more at {shown(x)}: choose one with 'layer', 'near: [x, y]' or 'part'; "
            f"{_listed(several)}{hint}"
        )
    else:
        chain = several[0]
    if chain.branch:
        raise ValueError(f"{what} branches at {shown(chain.branch)}: keep one chain, or name its layer with 'layer'")
    return chain


def _listed(several: list[Chain]) -> str:
    """Chains in a message, numbered as 'part' counts."""
    lines = [f"part {k}: {c.line()}" for k, c in enumerate(several, 1)]
    return "; ".join(lines if len(lines) <= 12 else [*lines[:11], f"… {len(lines)} parts"])


# -------------------------------------------------------------------------------------------------------------- tables
def _of_table(path: str, drawing: Any, what: str) -> _Walk:
    """Lines and arcs out of rows ``x, y``, or ``x, y, through x, through y`` of an arc that ends there."""
    for key in ("layer", "part", "near", "tolerance"):
        if getattr(drawing, key) is not None:
            raise ValueError(f"{what} is a table of points, and has no {key} {getattr(drawing, key)!r}")
    try:
        sheet = read_sheet(Path(path), named=False, ragged=True)
    except DataError as error:
        raise ValueError(f"{what} contains a line that is not a row of numbers: {error}") from None
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
    return _Walk(walk, units.pop() if units else None, [], [])
