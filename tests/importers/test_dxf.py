"""Profiles out of drawings: DXF as other programs write it, and tables of points."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import numpy as np
import pytest

import prensa as pr
from prensa.errors import CaseError
from prensa.model.schema import loads

CASE = """
name: press
units: {{length: {unit}, force: N}}
bodies:
  block:
    mesh: {{type: rectangle, size: [40 mm, 10 mm], n: [8, 2], origin: [-20 mm, 0]}}
    material: {{type: elastic, E: 1000 MPa, nu: 0.3}}
tools: {{punch: {{type: profile, points: {points}, {more}}}}}
fixed: {{block.bottom: xy}}
steps: [{{name: press, move: {{punch: {{y: -0.1 mm}}}}}}]
"""


def case(tmp_path, points, more="touching: block.top", unit="mm"):
    return loads(CASE.format(points=points, more=more, unit=unit), "case.yaml", tmp_path).problem


def drawing(tmp_path, draw, unit=4, name="punch.dxf"):
    """A DXF file with what ``draw`` puts into its model space."""
    document = ezdxf.new(units=unit)
    draw(document.modelspace())
    document.saveas(tmp_path / name)


def punch(space, layer="0"):
    """Flank, round corner of radius 2, face, corner, flank; drawn in any order and direction."""
    at = {"layer": layer}
    space.add_line((8, 0), (-8, 0), at)
    space.add_line((10, 30), (10, 2), at)
    space.add_arc((8, 2), 2, 270, 360, dxfattribs=at)
    space.add_line((-10, 30), (-10, 2), at)
    space.add_arc((-8, 2), 2, 180, 270, dxfattribs=at)


def closest(problem, x):
    return problem.tools["punch"].shape(np.array([0.0, -1.0]), 0.0).closest(np.asarray(x, dtype=float))


def test_lines_and_arcs_of_a_drawing_are_the_profile_written_by_hand(tmp_path):
    """Gaps around equal those of the same punch written as points with fillets; text beside it does not matter."""
    drawing(tmp_path, lambda s: (punch(s), s.add_text("R2")))
    by_hand = pr.Profile(points=((-10, 30), (-10, 0), (10, 0), (10, 30)), fillet=(0, 2, 2, 0), touching="block.top")
    drawn = case(tmp_path, "punch.dxf, fillet: 0")
    x = np.random.default_rng(0).uniform(-15, 15, (200, 2))
    want = by_hand.shape(np.array([0.0, -1.0]), 0.0).closest(x).g
    assert np.abs(closest(drawn, x).g - want).max() <= 1e-12
    assert loads(pr.dump(drawn), "again").problem == drawn


@pytest.mark.parametrize(("unit", "of"), [(4, 1.0), (5, 10.0), (1, 25.4)])
def test_a_drawing_is_in_its_own_unit(tmp_path, unit, of):
    """Millimetres, centimetres, inches of the drawing are lengths of the case; a key overrules the drawing."""
    drawing(tmp_path, punch, unit)
    assert case(tmp_path, "punch.dxf, fillet: 0").tools["punch"].points[0] == pytest.approx((-10 * of, 30 * of))
    said = case(tmp_path, "{file: punch.dxf, unit: mm}, fillet: 0", unit="m")
    assert said.tools["punch"].points[0] == pytest.approx((-0.01, 0.03))


def test_polylines_with_bulges_close_and_reverse(tmp_path):
    """A closed polyline is a tool counter-clockwise however it was drawn, and a cavity in reverse."""
    square = [(0, 0, 0), (0, 10, 0), (10, 10, 0), (10, 0, 0)]  # clockwise
    drawing(tmp_path, lambda s: s.add_lwpolyline(square, format="xyb", close=True))
    tool = case(tmp_path, "{file: punch.dxf, origin: [5 mm, 0]}, fillet: 0, closed: true")
    cavity = case(
        tmp_path, "{file: punch.dxf, origin: [5 mm, 0], reverse: true}, fillet: 0, closed: true", "at: [0, 5 mm]"
    )
    assert closest(tool, [[0, 5]]).g[0] == pytest.approx(-5) and closest(cavity, [[0, 5]]).g[0] == pytest.approx(5)
    round_end = [(-5, 0, 1.0), (5, 0, 0.0)]  # a half circle below
    drawing(tmp_path, lambda s: s.add_lwpolyline(round_end, format="xyb", close=True))
    half = case(tmp_path, "punch.dxf, fillet: 0, closed: true")
    assert closest(half, [[0, -8], [3, -4], [0, 2]]).g == pytest.approx([3, 0, 2])
    with pytest.raises(CaseError, match="say 'closed: true' as well"):
        case(tmp_path, "punch.dxf, fillet: 0")


def test_a_circle_is_a_closed_profile(tmp_path):
    """Gaps are those of a circle."""
    drawing(tmp_path, lambda s: s.add_circle((3, 4), 5))
    round_tool = case(tmp_path, "{file: punch.dxf, origin: [3 mm, 4 mm]}, closed: true")
    x = np.random.default_rng(1).uniform(-9, 9, (50, 2))
    assert np.abs(closest(round_tool, x).g - (np.hypot(*x.T) - 5)).max() <= 1e-12


def test_tables_of_points_have_arcs(tmp_path):
    """Rows x, y, and of arcs a point on them; a line of names, comments, semicolons."""
    (tmp_path / "punch.csv").write_text("x;y;through x;through y\n# corner\n-9;9\n-9;1\n9;1;0;0\n9;9\n")
    drawn = case(tmp_path, "punch.csv, fillet: 1.5")
    assert drawn.tools["punch"].points == ((-9, 9), (-9, 1), pr.Arc(through=(0, 0), to=(9, 1)), (9, 9))


def branch(space):
    space.add_line((0, 0), (1, 0))
    space.add_line((1, 0), (2, 0))
    space.add_line((1, 0), (1, 1))


def two(space):
    space.add_line((0, 0), (1, 0))
    space.add_line((5, 0), (6, 0))


@pytest.mark.parametrize(
    ("draw", "points", "message"),
    [
        (branch, "punch.dxf", r"branches at \(1, 0\)"),
        (two, "punch.dxf", r"several chains, one more at \(5, 0\)"),
        (punch, "{file: punch.dxf, layer: DIE}", "nothing on the layer 'DIE'; its layers are '0'"),
        (punch, "punsh.dxf", "there is no such file; the folder has broken.dxf, punch.dxf"),
        (lambda s: s.add_text("empty"), "punch.dxf", "no lines and arcs"),
        (punch, "case.csv", "is not a row of numbers"),
        (punch, "broken.dxf", "cannot be read as DXF"),
    ],
)
def test_what_is_no_chain_is_reported_with_its_place(tmp_path, draw, points, message):
    """File, key and remedy."""
    drawing(tmp_path, draw)
    (tmp_path / "case.csv").write_text("x,y\n1,2\nthree,4\n")
    (tmp_path / "broken.dxf").write_text("no drawing\n")
    with pytest.raises(CaseError, match=message) as caught:
        case(tmp_path, points)
    assert str(caught.value).startswith("case.yaml:8:")


def test_a_drawing_of_a_whole_plant_is_refused_before_it_is_read(tmp_path, monkeypatch):
    """The reader makes objects of all entities, some 30 000 a second."""
    drawing(tmp_path, punch)
    file = tmp_path / "punch.dxf"
    text = file.read_bytes()
    at = text.rindex(b"  0\nENDSEC", 0, text.index(b"OBJECTS"))
    file.write_bytes(text[:at] + b"  0\nPOINT\n" * 10_000 + text[at:])
    monkeypatch.setattr("ezdxf.readfile", None)
    with pytest.raises(CaseError, match=r"has 1\d+ entities, and no more than 10000 are read: save the lines and arcs of"):
        case(tmp_path, "punch.dxf")


def test_drawings_of_other_formats_are_refused_with_what_to_save(tmp_path):
    """A DWG is no table of points, whatever its bytes."""
    (tmp_path / "punch.DWG").write_bytes(b"AC1032" + bytes(100))
    with pytest.raises(CaseError, match=r"'punch\.DWG' is no DXF file and no table of points: save it as DXF"):
        case(tmp_path, "punch.DWG")


def test_names_that_are_no_text_are_reported(tmp_path):
    """A layer and a kind of entity with bytes that are no characters stand escaped in the message."""
    drawing(tmp_path, two)
    file = tmp_path / "punch.dxf"
    damaged = file.read_bytes().replace(b"LINE", b"AR\xca\x9d\x9d")
    file.write_bytes(damaged)
    with pytest.raises(CaseError, match=r"the drawing 'punch\.dxf'") as caught:
        case(tmp_path, "punch.dxf")
    str(caught.value).encode("utf-8")


def test_a_layer_of_a_drawing_is_taken(tmp_path):
    """Punch and die in one drawing; the whole runs."""
    drawing(tmp_path, lambda s: (punch(s, "PUNCH"), s.add_line((-50, -20), (50, -20), {"layer": "DIE"})))
    problem = case(tmp_path, "{file: punch.dxf, layer: punch}, fillet: 0")
    (*_, last) = pr.solve(problem)
    assert last.force("punch").y > 0


def test_a_drawing_of_another_program_runs(tmp_path):
    """OpenSCAD's export (release 12, no unit, lines of a hull with 24 to a circle): the punch presses as the one by hand does."""
    file = Path(__file__).parent / "drawings" / "openscad.dxf"
    problem = case(tmp_path, f"{file}, closed: true, fillet: 0")
    corner = [(8 + 2 * np.cos(t), 2 + 2 * np.sin(t)) for t in np.radians(np.arange(270, 361, 15))]
    outline = [(-x, y) for x, y in corner[::-1]] + corner + [(10, 30), (-10, 30)]
    by_hand = pr.Polygon(points=tuple(map(tuple, outline)), fillet=0, touching="block.top")
    x = np.random.default_rng(2).uniform(-15, 15, (100, 2))
    want = by_hand.shape(np.array([0.0, -1.0]), 0.0).closest(x).g
    assert np.abs(closest(problem, x).g - want).max() <= 1e-4  # the file has six digits
    (*_, last) = pr.solve(case(tmp_path, f"{file}, closed: true"))
    assert last.force("punch").y > 0
