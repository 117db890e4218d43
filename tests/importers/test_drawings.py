"""Drawings after the habits of CAD programs: splines, blocks, doubles, gaps, several chains; against SciPy and shapely."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely
from scipy.interpolate import BSpline

import prensa as pr
from prensa.checks.before.file_units import file_units
from prensa.errors import CaseError
from prensa.geometry.chain import chain, corner
from prensa.importers.segments import Segment
from prensa.model.plausibility import warnings_of
from prensa.model.schema import loads
from prensa.system.discretise import discretise

CASE = """
name: press
bodies:
  block:
    mesh: {{type: rectangle, size: [40, 10], n: [8, 2], origin: [-20, -10]}}
    material: {{type: elastic, E: 1000, nu: 0.3}}
tools: {{punch: {{type: profile, points: {points}, fillet: 0, closed: {closed}, at: [0, 500]}}}}
fixed: {{block.bottom: xy}}
steps: [{{name: press}}]
"""


class Read:
    """A profile of the drawing ``a.dxf`` of a folder."""

    def __init__(self, folder: Path, points: str = "a.dxf", closed: bool = False) -> None:
        text = CASE.format(points=points, closed=str(closed).lower())
        self.problem = loads(text, "case.yaml", folder).problem
        self.tool = self.problem.tools["punch"]
        self.points = self.tool.points
        self.notes = "; ".join(self.tool.notes())
        self.warnings = [w for w in warnings_of(self.problem) if w.startswith("tools.punch.points")]

    @property
    def line(self) -> Any:
        """The chain, sampled, by shapely."""
        out = [self.points[0]]
        for p in self.points[1:]:
            if isinstance(p, pr.Arc):
                c, r, start, sweep = Segment(out[-1], p.to, p.through).circle()
                angles = start + sweep * np.linspace(0, 1, 40 + int(400 * abs(sweep)))[1:]
                out += [(c[0] + r * np.cos(t), c[1] + r * np.sin(t)) for t in angles[:-1]] + [p.to]
            else:
                out.append(p)
        return shapely.LineString(out)

    @property
    def area(self) -> float:
        """Of a closed chain."""
        return float(shapely.Polygon(self.line.coords).area)


def drawing(folder: Path, draw: Callable[[Any], object], release: str = "R2010", unit: int = 4) -> Any:
    """A file ``a.dxf``; ``draw`` is given the document."""
    document = ezdxf.new(release, units=unit)
    draw(document)
    document.saveas(folder / "a.dxf")
    return document


def curve_of(document: Any) -> Any:
    """The spline of a drawing, by SciPy."""
    tool = document.modelspace().query("SPLINE").first.construction_tool()
    knots, control = np.array(tool.knots()), np.array([(v.x, v.y) for v in tool.control_points])
    spline = BSpline(knots, control, tool.degree)
    return shapely.LineString(spline(np.linspace(knots[tool.degree], knots[len(control)], 4001)))


def apart(a: Any, b: Any) -> float:
    """Largest distance of the vertices of either of two lines from the other."""
    return max(float(shapely.distance(shapely.points(shapely.get_coordinates(x)), y).max()) for x, y in ((a, b), (b, a)))


DIE = [(-30, 20), (-20, 18), (-8, 2), (0, 0), (8, 2), (20, 18), (30, 20)]


# ------------------------------------------------------------------------------------------------------------- curves
@pytest.mark.parametrize("degree", [2, 3, 5])
def test_a_spline_becomes_arcs_within_the_tolerance(tmp_path: Path, degree: int) -> None:
    """By default a millionth of the drawing's size; smooth to rounding; the largest distance is stated."""
    document = drawing(tmp_path, lambda d: d.modelspace().add_open_spline(DIE, degree))
    read = Read(tmp_path)
    # the pieces of either line are within 1e-5 themselves, their vertices are exact
    assert apart(read.line, curve_of(document)) <= 60e-6 + 1e-5
    assert len(read.points) < 400 and f"1 spline became {len(read.points) - 1} arcs" in read.notes
    assert float(read.notes.split("leave the drawing by ")[1].split()[0]) <= 60e-6 * 1.01
    pieces = chain(read.points, 0.0, closed=False)
    turns = [abs(corner(a, b)) for a, b in pairwise(pieces)]
    assert max(turns) <= (1e-6 if degree > 2 else 1e-5)


def test_a_tolerance_of_the_case_makes_fewer_arcs(tmp_path: Path) -> None:
    """In a drawing in inches, too: it is a length of the case."""
    for unit, of in ((4, 1.0), (1, 25.4)):
        document = drawing(tmp_path, lambda d: d.modelspace().add_open_spline(DIE), unit=unit)
        theirs = shapely.affinity.scale(curve_of(document), of, of, origin=(0, 0))
        fine, coarse = Read(tmp_path), Read(tmp_path, "{file: a.dxf, tolerance: 20 um}")
        assert len(coarse.points) < 0.6 * len(fine.points)
        assert 0.001 < apart(coarse.line, theirs) <= 0.02 + 1e-4 * of


def test_splines_through_points_rational_and_closed_ones(tmp_path: Path) -> None:
    """Fit points alone, the weights of a circle, a closed loop."""
    document = drawing(tmp_path, lambda d: d.modelspace().add_spline(DIE))
    assert apart(Read(tmp_path).line, curve_of(document)) < 7e-5
    half = ezdxf.math.BSpline.from_arc(ezdxf.math.ConstructionArc((0, 0), 5, 0, 180))

    def rational(d: Any) -> None:
        spline = d.modelspace().add_spline()
        spline.apply_construction_tool(half)
        d.modelspace().add_line((-5, 0), (5, 0))

    drawing(tmp_path, rational)
    read = Read(tmp_path, closed=True)
    assert len(read.points) < 16 and read.area == pytest.approx(12.5 * np.pi, rel=1e-5)
    document = drawing(tmp_path, lambda d: d.modelspace().add_spline().set_closed([(0, 0, 0), (10, 0, 0), (12, 8, 0), (3, 9, 0)]))
    assert Read(tmp_path, closed=True).area == pytest.approx(shapely.Polygon(curve_of(document).coords).area, rel=1e-5)


def test_a_spline_with_a_corner_keeps_it(tmp_path: Path) -> None:
    """A knot of full multiplicity: the arcs meet in the corner and are not led round it."""
    control = [(0, 10), (3, 0), (6, 0), (10, 0), (14, 0), (17, 0), (20, 10)]
    control[3] = (10, -5)
    knots = [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2]

    def draw(d: Any) -> None:
        spline = d.modelspace().add_spline()
        spline.control_points, spline.knots, spline.dxf.degree = control, knots, 3

    document = drawing(tmp_path, draw)
    read = Read(tmp_path)
    assert shapely.Point(10, -5).distance(read.line) < 1e-9
    assert apart(read.line, curve_of(document)) < 3e-5


def test_a_spline_of_too_many_arcs_is_refused(tmp_path: Path) -> None:
    """A tolerance far below what is drawn, and control points that are not usable numbers."""
    drawing(tmp_path, lambda d: d.modelspace().add_open_spline(DIE))
    with pytest.raises(CaseError, match="of more than 5000 arcs; give a larger 'tolerance' than 1e-12"):
        Read(tmp_path, "{file: a.dxf, tolerance: 1e-12}")
    drawing(tmp_path, lambda d: d.modelspace().add_open_spline([*DIE[:-1], (1e308, 1e308)]))
    with pytest.raises(CaseError, match=r"drawing 'a\.dxf' has .*(no extent|no numbers)"):
        Read(tmp_path)


def test_ellipses_become_arcs(tmp_path: Path) -> None:
    """A whole one and half of one, tilted."""
    drawing(tmp_path, lambda d: d.modelspace().add_ellipse((3, 4), (6, 8), 0.4))
    read = Read(tmp_path, closed=True)
    assert read.area == pytest.approx(np.pi * 10 * 4, rel=1e-5) and "1 ellipse became" in read.notes
    drawing(tmp_path, lambda d: d.modelspace().add_ellipse((0, 0), (10, 0), 0.3, np.pi, 2 * np.pi))
    x, y = np.array(Read(tmp_path).line.coords).T
    assert np.abs(np.hypot(x / 10, y / 3) - 1).max() < 1e-5 and y.max() < 1e-9 and len(x) > 100


# ------------------------------------------------------------------------------------------------------------- blocks
def notch(block: Any) -> None:
    """A rectangle of 4 × 2 with a half circle of radius 1 cut from its top; area 8 − π/2."""
    block.add_lwpolyline([(0, 0, 0), (4, 0, 0), (4, 2, 0), (3, 2, -1), (1, 2, 0), (0, 2, 0)], format="xyb", close=True)


NOTCH = 8 - np.pi / 2


@pytest.mark.parametrize(
    ("attributes", "area", "corner_at"),
    [
        ({}, NOTCH, (104, 50)),
        ({"xscale": 3.0, "yscale": 3.0, "zscale": 3.0}, 9 * NOTCH, (112, 50)),
        ({"rotation": 90}, NOTCH, (100, 54)),
        ({"xscale": -1.0}, NOTCH, (96, 50)),
        ({"xscale": -2.0, "yscale": 2.0, "rotation": 30}, 4 * NOTCH, (100 - 8 * np.cos(np.pi / 6), 50 - 8 * 0.5)),
        ({"xscale": 2.0}, 2 * NOTCH, (108, 50)),  # its round is an ellipse
    ],
)
def test_blocks_are_read_where_they_are_inserted(tmp_path: Path, attributes: Any, area: float, corner_at: Any) -> None:
    """Moved, scaled, rotated, mirrored, stretched; nested in another block; the layer 0 of a block is that of its place."""

    def draw(d: Any) -> None:
        notch(d.blocks.new("NOTCH"))
        d.blocks.new("OUTER").add_blockref("NOTCH", (100, 50), dxfattribs=attributes)
        d.modelspace().add_blockref("OUTER", (0, 0), dxfattribs={"layer": "PUNCH"})

    drawing(tmp_path, draw)
    read = Read(tmp_path, "{file: a.dxf, layer: punch}", closed=True)
    assert read.area == pytest.approx(area, rel=1e-5)
    assert min(np.hypot(*np.subtract(p, corner_at)) for p in read.line.coords) < 1e-9
    assert "blocks are drawn where they are inserted: 'NOTCH', 'OUTER'" in read.notes


def test_rows_of_a_block_are_parts_of_which_one_is_chosen(tmp_path: Path) -> None:
    """An INSERT with columns; by number from the left, and by place."""

    def draw(d: Any) -> None:
        notch(d.blocks.new("NOTCH"))
        d.modelspace().add_blockref("NOTCH", (0, 0), dxfattribs={"column_count": 3, "column_spacing": 10})

    drawing(tmp_path, draw)
    with pytest.raises(CaseError, match=r"several chains.*part 2: layer '0', x 10 … 14, y 0 … 2, 6 segments, closed; part 3"):
        Read(tmp_path, closed=True)
    for points, left in (("part: 3", 20), ("'near': [13, 9]", 10), ("near: [-9, 0], unit: cm", 0)):
        read = Read(tmp_path, f"{{file: a.dxf, {points}}}", closed=True)
        assert read.line.bounds[0] == pytest.approx(left)
    assert "part 1 of 3" in read.notes and "taken to be in cm (it states mm)" in read.notes
    with pytest.raises(CaseError, match="has no part 4; part 1: layer"):
        Read(tmp_path, "{file: a.dxf, part: 4}", closed=True)
    with pytest.raises(CaseError, match="'part' and 'near' both choose"):
        Read(tmp_path, "{file: a.dxf, part: 1, near: [0, 0]}", closed=True)


def test_blocks_in_themselves_and_in_other_files(tmp_path: Path) -> None:
    """The one is refused, the other reported; many inserts of a large block are refused before they are drawn."""

    def circle(d: Any) -> None:
        block = d.blocks.new("A")
        notch(block)
        d.blocks.new("B").add_blockref("A", (0, 0))
        block.add_blockref("B", (0, 0))
        d.modelspace().add_blockref("A", (0, 0))

    drawing(tmp_path, circle)
    with pytest.raises(CaseError, match="has a block 'A' that is inserted in itself"):
        Read(tmp_path)

    def missing(d: Any) -> None:
        d.modelspace().add_blockref("ELSEWHERE", (0, 0))
        d.modelspace().add_lwpolyline([(0, 1), (0, 0), (5, 0), (5, 1)])

    drawing(tmp_path, missing)
    assert "the block 'ELSEWHERE' is in another file and is left out" in Read(tmp_path).warnings[0]

    def many(d: Any) -> None:
        block = d.blocks.new("A")
        for k in range(150):
            block.add_line((k, 0), (k, 1))
        d.modelspace().add_blockref("A", (0, 0), dxfattribs={"column_count": 100, "column_spacing": 1})

    drawing(tmp_path, many)
    with pytest.raises(CaseError, match="more than 10000 entities where its blocks are inserted"):
        Read(tmp_path)


# --------------------------------------------------------------------------------------------- doubles, overlaps, gaps
PUNCH = [((-10, 20), (-10, 0)), ((-10, 0), (10, 0)), ((10, 0), (10, 20))]
U = ((-10, 20), (-10, 0), (10, 0), (10, 20))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ([((10, 0), (-10, 0))], r"a line is drawn twice, from \(-10, 0\) to \(10, 0\)"),
        ([((10, 0), (-10, 0))] * 2, "a line is drawn 3 times"),
        ([((-4, 0), (6, 0))], r"2 lines overlap from \(-10, 0\) to \(10, 0\)"),
        ([((-10, 0), (3, 0)), ((3, 0), (10, 0))], "3 lines overlap"),
        ([((0, 0), (10, 0)), ((-10, 0), (1, 0)), ((-3, 0), (2, 0))], "4 lines overlap"),
        ([((10, 20), (10, 5))], r"2 lines overlap from \(10, 0\) to \(10, 20\)"),
        ([((10, 2e-6), (-10, -2e-6))], "a line is drawn twice"),  # by another program, with other digits
    ],
)
def test_lines_on_one_another_are_taken_as_one(tmp_path: Path, more: Any, words: str) -> None:
    """Doubled, in part, in pieces; reported with their place."""
    drawing(tmp_path, lambda d: [d.modelspace().add_line(a, b) for a, b in [*PUNCH, *more]])
    read = Read(tmp_path)
    assert read.points == U
    (warning,) = read.warnings
    assert np.char.find(warning, "drawing 'a.dxf'") >= 0
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(warning)


def test_pieces_that_overlap_make_the_line_between_their_outer_ends(tmp_path: Path) -> None:
    """A face drawn as two lines that reach over one another, and one drawn over the end of a flank."""
    pieces = [PUNCH[0], ((-10, 0), (4, 0)), ((-3, 0), (10, 0)), PUNCH[2], ((10, 12), (10, 30))]
    drawing(tmp_path, lambda d: [d.modelspace().add_line(a, b) for a, b in pieces])
    read = Read(tmp_path)
    assert read.points == (*U[:3], (10, 30)) and len(read.warnings) == 2


@pytest.mark.parametrize("arcs", [((0, 180), (90, 270), (200, 20)), ((0, 360), (10, 50)), ((0, 200), (180, 380), (0, 200))])
def test_arcs_on_one_another_are_taken_as_one(tmp_path: Path, arcs: Any) -> None:
    """Pieces of a circle that cover it together, in any order."""
    for order in (arcs, arcs[::-1]):
        drawing(tmp_path, lambda d, order=order: [d.modelspace().add_arc((3, 4), 5, a, b) for a, b in order])
        read = Read(tmp_path, closed=True)
        assert read.area == pytest.approx(25 * np.pi, rel=1e-4)
        assert "arcs overlap" in "".join(read.warnings)


def test_half_circles_between_the_same_ends_are_not_doubles(tmp_path: Path) -> None:
    """The other half is another arc; and open arcs that overlap cover their union."""
    drawing(tmp_path, lambda d: [d.modelspace().add_arc((0, 0), 5, a, b) for a, b in ((0, 180), (180, 360))])
    read = Read(tmp_path, closed=True)
    assert read.area == pytest.approx(25 * np.pi, rel=1e-4) and not read.warnings
    drawing(tmp_path, lambda d: [d.modelspace().add_arc((0, 0), 5, a, b) for a, b in ((200, 290), (270, 340), (220, 240))])
    assert Read(tmp_path).line.length == pytest.approx(5 * np.radians(140), rel=1e-5)


def test_bodies_that_touch_along_a_side_stay_apart(tmp_path: Path) -> None:
    """A punch on a sheet that is wider: the common stretch belongs to both outlines."""

    def draw(d: Any) -> None:
        d.modelspace().add_lwpolyline([(-10, 0), (10, 0), (10, 20), (-10, 20)], close=True)
        d.modelspace().add_lwpolyline([(-30, -2), (30, -2), (30, 0), (-30, 0)], close=True)

    drawing(tmp_path, draw)
    sheet, punch = (Read(tmp_path, f"{{file: a.dxf, part: {k}}}", closed=True) for k in (1, 2))
    assert (sheet.area, punch.area) == (120, 400) and not punch.warnings


def test_gaps_are_closed_and_reported(tmp_path: Path) -> None:
    """A hundredth of a millimetre by itself, a tenth with a tolerance; without it the ends are named."""
    for gap, points in ((0.01, "a.dxf"), (0.1, "{file: a.dxf, tolerance: 0.2}")):
        lines = [PUNCH[0], ((-10, 0), (10 - gap, 0)), PUNCH[2]]
        drawing(tmp_path, lambda d, lines=lines: [d.modelspace().add_line(a, b) for a, b in lines])
        read = Read(tmp_path, points)
        assert read.points == U or np.allclose(read.points, U, atol=gap)
        assert f"a gap of {gap:.3g} at" in read.warnings[0]
    with pytest.raises(CaseError, match=r"several chains.*the nearest ends, \(9.9, 0\) and \(10, 0\), are 0.1 apart"):
        Read(tmp_path)


def test_ends_of_short_lines_are_not_joined_across_them(tmp_path: Path) -> None:
    """A gap that is as long as the line beside it is none."""
    lines = [((0, 0), (100, 0)), ((100.05, 0), (100.1, 0)), ((100.15, 0), (200, 0))]
    drawing(tmp_path, lambda d: [d.modelspace().add_line(a, b) for a, b in lines])
    with pytest.raises(CaseError, match="several chains"):
        Read(tmp_path)


# ------------------------------------------------------------------------------------------------ layers, units, notes
def test_layers_that_meet_are_read_one_by_one(tmp_path: Path) -> None:
    """A punch and a die that touch, a centre line through both: chosen by layer or place; layers that are off are not there."""

    def draw(d: Any) -> None:
        space = d.modelspace()
        space.add_lwpolyline(U, dxfattribs={"layer": "PUNCH"})
        space.add_lwpolyline([(-40, 0), (-10, 0), (-10, -20), (10, -20), (10, 0), (40, 0)], dxfattribs={"layer": "DIE"})
        space.add_line((0, -50), (0, 50), {"layer": "CENTRE"})
        space.add_line((10, 0), (60, 60), {"layer": "OLD"})
        for name, state in (("OLD", "off"), ("OLDER", "freeze")):
            getattr(d.layers.add(name), state)()
        space.add_circle((0, 0), 3, {"layer": "OLDER"})

    drawing(tmp_path, draw)
    for points in ("{file: a.dxf, layer: PUNCH}", "{file: a.dxf, near: [-9, 15]}"):
        read = Read(tmp_path, points)
        assert read.points == U
    assert "left out, since it cannot be seen there: 1 on 'OLD', 1 on 'OLDER'" in read.notes
    with pytest.raises(CaseError, match=r"part 1: layer 'DIE'.*part 2: layer 'PUNCH'.*part 3: layer 'CENTRE'.*1 segment, open"):
        Read(tmp_path)
    with pytest.raises(CaseError, match="nothing on the layer 'OLD'; its layers are 'CENTRE', 'DIE', 'PUNCH'"):
        Read(tmp_path, "{file: a.dxf, layer: OLD}")


def test_texts_and_dimensions_are_left_out_with_a_note(tmp_path: Path) -> None:
    """Also hatches and points; a filled shape is reported, since it may be the tool."""

    def draw(d: Any) -> None:
        space = d.modelspace()
        space.add_lwpolyline(U)
        space.add_text("R3")
        space.add_mtext("punch")
        space.add_point((3, 3))
        space.add_hatch()
        space.add_linear_dim(base=(0, -5), p1=(-10, 0), p2=(10, 0)).render()
        space.add_solid([(0, 0), (1, 0), (0, 1)])

    drawing(tmp_path, draw)
    read = Read(tmp_path)
    assert read.points == U and "left out: 1 dimension, 1 hatch, 1 mtext, 1 point, 1 text" in read.notes
    assert "left out: 1 solid; explode or convert" in read.warnings[0]


@pytest.mark.parametrize(
    ("unit", "words", "width"),
    [(4, "in mm, which it states", 20), (1, "in in, which", 508), (10, "in yd", 18288), (0, "states no unit: its numbers", 20)],
)
def test_the_unit_of_a_drawing_is_taken_and_reported(tmp_path: Path, unit: int, words: str, width: float) -> None:
    """$INSUNITS."""
    drawing(tmp_path, lambda d: d.modelspace().add_lwpolyline(U), unit=unit)
    read = Read(tmp_path)
    assert read.line.bounds[2] - read.line.bounds[0] == pytest.approx(width) and words in read.notes


def test_a_unit_that_is_none_here_is_refused(tmp_path: Path) -> None:
    """Mils: unless the case says what they are."""
    drawing(tmp_path, lambda d: d.modelspace().add_lwpolyline(U), unit=9)
    with pytest.raises(CaseError, match="is in mils, which is not a unit of length here; give its 'unit'"):
        Read(tmp_path)
    assert Read(tmp_path, "{file: a.dxf, unit: mm}").points == U


def test_release_12_polylines(tmp_path: Path) -> None:
    """With bulges; fitted by a spline, whose control points stand between its vertices; heights."""

    def round_end(d: Any) -> None:
        line = d.modelspace().add_polyline2d([(-5, 10), (-5, 0), (5, 0), (5, 10)])
        line.vertices[1].dxf.bulge = 1.0

    drawing(tmp_path, round_end, "R12")
    read = Read(tmp_path)
    assert (*read.points[2].through, *read.points[2].to) == pytest.approx((0, -5, 5, 0))

    def fitted(d: Any) -> None:
        line = d.modelspace().add_polyline2d([(-5, 10), (0, -9), (-4, 3), (4, 3), (5, 10)])
        line.dxf.flags |= 4
        line.vertices[1].dxf.flags = 16
        for k in (0, 2, 3, 4):
            line.vertices[k].dxf.flags = 8

    drawing(tmp_path, fitted, "R12")
    assert Read(tmp_path).points == ((-5, 10), (-4, 3), (4, 3), (5, 10))
    drawing(tmp_path, lambda d: d.modelspace().add_polyline3d([(-5, 9, 0), (0, 0, 2), (5, 9, 0)]), "R12")
    read = Read(tmp_path)
    assert read.points == ((-5, 9), (0, 0), (5, 9)) and "its z goes from 0 to 2 and is left out" in read.warnings[0]


def test_arcs_that_do_not_lie_in_the_plane_are_ellipses(tmp_path: Path) -> None:
    """A circle seen at 60°."""
    tilt = {"extrusion": (0.0, float(np.sin(np.pi / 3)), float(np.cos(np.pi / 3)))}
    drawing(tmp_path, lambda d: d.modelspace().add_circle((0, 0), 10, tilt))
    assert Read(tmp_path, closed=True).area == pytest.approx(np.pi * 50, rel=1e-5)


def test_a_damaged_drawing_is_repaired_with_a_warning(tmp_path: Path) -> None:
    """Cut off before its end, decimal commas, a handle that is none."""
    drawing(tmp_path, lambda d: d.modelspace().add_lwpolyline(U))
    text = (tmp_path / "a.dxf").read_text()
    for old, new in (("  0\nEOF\n", ""), ("\n20.0\n", "\n20,0\n"), ("LWPOLYLINE\n  5\n", "LWPOLYLINE\n  5\nXYZ")):
        assert old in text
        (tmp_path / "a.dxf").write_text(text.replace(old, new))
        read = Read(tmp_path)
        assert read.points == U and "it is damaged and was repaired" in read.warnings[0]


def test_tables_have_no_layers_and_no_parts(tmp_path: Path) -> None:
    """Keys of drawings are refused for tables of points."""
    (tmp_path / "a.csv").write_text("0,1\n0,0\n3,0\n")
    for key in ("layer: A", "part: 1", "near: [0, 0]", "tolerance: 1"):
        with pytest.raises(CaseError, match=f"a table of points, and has no {key.partition(':')[0]}"):
            Read(tmp_path, f"{{file: a.csv, {key}}}")


def test_points_of_a_drawing_are_points_like_others(tmp_path: Path) -> None:
    """They compare, are written out and read again; copies keep what was reported of them."""
    import copy
    import pickle

    drawing(tmp_path, lambda d: [d.modelspace().add_line(a, b) for a, b in [*PUNCH, PUNCH[1]]])
    read = Read(tmp_path)
    assert loads(pr.dump(read.problem), "again").problem == read.problem
    for again in (copy.deepcopy(read.points), pickle.loads(pickle.dumps(read.points))):
        assert again == U and again.warnings == read.points.warnings
    tool = pr.Profile(points=pr.Drawing(file=str(tmp_path / "a.dxf")), fillet=0, at=(0, 500))
    assert tool.points == U and "drawn twice" in tool.points.warnings[0]


def test_a_chain_is_not_asked_to_be_joined_with_itself(tmp_path):
    """A closed frame around one open tool: no two ends of different chains; of two open ones the nearest ends are named."""
    drawing = ezdxf.new()
    space = drawing.modelspace()
    space.add_lwpolyline([(-50, -50), (50, -50), (50, 50), (-50, 50)], close=True)
    space.add_lwpolyline([(0, 0), (5, 0), (6, 2)])
    drawing.saveas(tmp_path / "a.dxf")
    with pytest.raises(CaseError) as one:
        Read(tmp_path)
    assert "has several chains" in str(one.value) and "nearest ends" not in str(one.value)
    space.add_line((6.5, 2), (20, 2))
    drawing.saveas(tmp_path / "a.dxf")
    with pytest.raises(CaseError, match=r"the nearest ends, \(6, 2\) and \(6.5, 2\), are 0.5 apart"):
        Read(tmp_path)


@pytest.mark.parametrize(("draw", "remedy"), [("add_mline", "1 mline: explode or convert"), ("", "draw the outline there")])
def test_a_drawing_without_lines_says_what_to_do(tmp_path, draw, remedy):
    """Of kinds that are not read, or empty."""
    drawing = ezdxf.new()
    if draw:
        getattr(drawing.modelspace(), draw)([(0, 0), (5, 0), (6, 3)])
    drawing.saveas(tmp_path / "a.dxf")
    with pytest.raises(CaseError, match=remedy):
        Read(tmp_path)


@pytest.mark.parametrize(("unit", "said"), [(6, True), (4, False)])
def test_a_drawing_in_metres_of_a_die_in_millimetres_is_warned_of(tmp_path: Path, unit: int, said: bool) -> None:
    """The header of a drawing says metres: a die a thousand times as large as the body."""
    drawing(tmp_path, lambda d: d.modelspace().add_lwpolyline(U), unit=unit)
    found = [str(f) for f in file_units(discretise(Read(tmp_path).problem))]
    assert len(found) == said
    assert all("the tool measures" in f and "unit: mm}" in f for f in found)
