"""STEP files are meshed by gmsh where it is installed, and refused with what to install where it is not; the case with them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.mesh.brick_checks import jacobians
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.faces import enclosed_volume
from prensa.mesh.generate import mesh_of


def called(*arguments: str):
    return CliRunner().invoke(app, ["import", *arguments])


def test_what_is_missing_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The size, the file to write, the program that meshes; sizes are of STEP files only."""
    part, out = tmp_path / "part.step", tmp_path / "part.msh"
    part.write_text("ISO-10303-21;\n")
    monkeypatch.setitem(sys.modules, "gmsh", None)
    for arguments, words in (
        (["--size", "2"], "as in --size 2 --out part.msh"),
        (["--out", str(out)], "give the size of its elements"),
        (["--size", "0", "--out", str(out)], "give a length above 0"),
        (["--size", "2", "--out", str(out)], "pip install 'prensa[step]'"),
        (["--size", "2", "--out", str(part.with_suffix(".inp"))], "and the file to write"),
    ):
        result = called(str(part), *arguments)
        assert result.exit_code == 2 and words in result.output.replace("\n", ""), (arguments, result.output)
    out.write_text("")
    assert "exists; name another file" in called(str(part), "--size", "2", "--out", str(out)).output.replace("\n", "")
    assert "--size, --around and --hexahedra are of STEP files" in called("deck.inp", "--size", "2").output


def drawn(part: Path, draw) -> Path:
    """A STEP file by gmsh's kernel."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    draw(gmsh.model.occ)
    gmsh.model.occ.synchronize()
    gmsh.write(str(part))
    gmsh.finalize()
    return part


def test_a_solid_of_a_step_file_is_filled_with_tetrahedra_and_pressed(tmp_path: Path) -> None:
    """Curved sides follow the drawing; the case that comes along runs, its force is about that of a rod; two solids are parts."""
    part = drawn(tmp_path / "rod.step", lambda occ: occ.addCylinder(0.0, 0.0, 0.0, 0.0, 20.0, 0.0, 5.0))
    result = called(str(part), "--size", "6", "--out", str(tmp_path / "rod.yaml"))
    assert result.exit_code == 0, result.output
    mesh = mesh_of(pr.File(str(tmp_path / "rod.msh")), dimension=3)
    assert isinstance(mesh, BrickMesh) and mesh.cells.shape[1] == 10
    assert enclosed_volume(mesh.points, mesh.boundary) == pytest.approx(np.pi * 25.0 * 20.0, rel=1e-3)
    *_, last = pr.solve(pr.load(tmp_path / "rod.yaml").problem)
    assert last.force("plate").y == pytest.approx(210e3 * 1e-3 * np.pi * 25.0, rel=0.05)  # its lower end cannot widen
    again = called(str(part), "--size", "6", "--out", str(tmp_path / "rod.yaml"))
    assert "exists; name another" in again.output.replace("\n", "")

    def two(occ):
        occ.addBox(0.0, 0.0, 0.0, 10.0, 10.0, 10.0)
        occ.addBox(10.0, 0.0, 0.0, 10.0, 10.0, 10.0)

    result = called(str(drawn(tmp_path / "two.step", two)), "--size", "8", "--out", str(tmp_path / "two.msh"))
    assert result.exit_code == 0 and "part: volume-" in result.output.replace("\n", ""), result.output
    half = mesh_of(pr.File(str(tmp_path / "two.msh"), "volume-2"), dimension=3)
    assert half.extent == pytest.approx([10.0] * 3)


def test_a_drawing_of_several_solids_is_a_case_with_a_body_of_each(tmp_path: Path) -> None:
    """Two posts under a bridge: the posts are held, the bridge is pressed, the ties are a comment that is right when taken."""

    def bridge(occ):
        occ.addBox(0.0, 0.0, 0.0, 10.0, 10.0, 10.0)
        occ.addBox(20.0, 0.0, 0.0, 10.0, 10.0, 10.0)
        occ.addBox(0.0, 10.0, 0.0, 30.0, 5.0, 10.0)

    out = tmp_path / "bridge.yaml"
    result = called(str(drawn(tmp_path / "bridge.step", bridge)), "--size", "6", "--out", str(out))
    assert result.exit_code == 0, result.output
    text = out.read_text()
    problem = pr.load(out).problem
    assert [body.mesh.part for body in problem.bodies.values()] == [("volume-1",), ("volume-2",), ("volume-3",)]
    assert set(problem.fixed) == {"part1.bottom", "part2.bottom"} and not problem.ties
    said = CliRunner().invoke(app, ["check", str(out)]).output.replace("\n", " ")
    assert "lies on body 'part1'" in said and "join them with 'ties'" in said
    ties = "ties: [{slave: part1.top, master: part3.bottom}, {slave: part2.top, master: part3.bottom}]"
    assert f"# {ties}" in text
    out.write_text(text.replace(f"# {ties}", ties))
    *_, last = pr.solve(pr.load(out).problem)
    posts = [last.measure(f"fixed.{post}.bottom.fy") for post in ("part1", "part2")]
    assert abs(last.force("plate").y) == pytest.approx(abs(sum(posts)), rel=1e-6)  # the posts carry it, alike
    assert posts[0] == pytest.approx(posts[1], rel=0.01)
    assert abs(sum(posts)) == pytest.approx(210e3 * 0.015 / (10.0 / 200.0 + 5.0 / 300.0), rel=0.15)  # as rods


def test_ties_of_bodies_that_lie_on_each_other() -> None:
    """The side that lies on another body all over is the slave; bodies apart, and those that overlap in part, have none."""
    from prensa.cli.step import _ties

    def box(size, origin):
        mesh = mesh_of(pr.Box(size, (2, 2, 2), origin), dimension=3)
        assert isinstance(mesh, BrickMesh)
        return mesh

    base = box((4.0, 1.0, 4.0), (0.0, 0.0, 0.0))
    on, off, beside = (box((2.0, 1.0, 2.0), origin) for origin in ((1.0, 1.0, 1.0), (1.0, 1.5, 1.0), (3.0, 1.0, 1.0)))
    assert _ties(["a", "b"], [base, on]).endswith("# ties: [{slave: b.bottom, master: a.top}]")
    assert all("No side of a body lies on another one" in _ties(["a", "b"], [base, x]) for x in (off, beside))
    assert not _ties(["a"], [base])


def test_the_faces_of_a_step_file_are_a_tool(tmp_path: Path) -> None:
    """Closed, its normals outwards, the curved sides within 1e-3 of the radius; a file without faces is an error."""
    part = drawn(tmp_path / "rod.step", lambda occ: occ.addCylinder(0.0, 0.0, 0.0, 0.0, 20.0, 0.0, 5.0))
    out = tmp_path / "rod.stl"
    assert called(str(part), "--out", str(out)).exit_code == 0
    shape = pr.Stl(str(out)).shape(np.array([0.0, -1.0, 0.0]), 0.0)
    assert shape.surface.closed and shape.surface.volume == pytest.approx(500.0 * np.pi, rel=0.01)
    angle = np.linspace(0.0, 6.0, 40)
    beside = np.stack([5.1 * np.cos(angle), np.full(40, 9.0), 5.1 * np.sin(angle)], axis=1)
    assert np.abs(shape.closest(beside).g - 0.1).max() < 5e-3
    line = drawn(tmp_path / "line.step", lambda occ: occ.addLine(occ.addPoint(0, 0, 0), occ.addPoint(1, 0, 0)))
    assert "there is no face in it" in called(str(line), "--out", str(tmp_path / "line.stl")).output.replace("\n", "")


def test_a_rounded_punch_of_a_step_file_has_a_flat_end(tmp_path: Path) -> None:
    """Its gap is that of the revolved stamp to the height of a chord, from the inside to far away, and its flat is flat."""

    def punch(occ):
        body = occ.addCylinder(0.0, 0.0, 0.0, 0.0, 10.0, 0.0, 5.0)
        occ.synchronize()
        edges = [tag for _, tag in occ.getEntities(1) if abs(occ.getCenterOfMass(1, tag)[1]) < 1e-6]
        occ.fillet([body], edges, [1.5])

    part = drawn(tmp_path / "punch.step", punch)
    assert called(str(part), "--out", str(tmp_path / "punch.stl")).exit_code == 0
    shape = pr.Stl(str(tmp_path / "punch.stl")).shape(np.array([0.0, -1.0, 0.0]), 0.0)
    exact = pr.Revolved(pr.Stamp(width=10.0, fillet=1.5), at=(0.0, 0.0, 0.0)).shape(np.array([0.0, -1.0, 0.0]), 0.0)
    rng = np.random.default_rng(0)
    x = rng.uniform([-6.0, -6.0, -6.0], [6.0, 1.0, 6.0], (6000, 3))
    ours, stamp = shape.closest(x), exact.closest(x)
    below = np.abs(stamp.g) < 6.0
    assert np.abs(ours.g - stamp.g)[below].max() < 5.0 * (1.0 - np.cos(np.pi / 36))
    flat = np.hypot(x[:, 0], x[:, 2]) < 3.4
    assert np.abs(ours.n - [0.0, -1.0, 0.0])[flat & (x[:, 1] < 0.5)].max() < 1e-9


def test_what_would_take_hours_to_mesh_is_refused(tmp_path: Path) -> None:
    """A part in metres with a size in millimetres, of its volume and of its faces; surfaces alone, and a STEP file as a mesh."""
    part = drawn(tmp_path / "hall.step", lambda occ: occ.addBox(0.0, 0.0, 0.0, 40e3, 30e3, 20e3))
    for out, words in (("hall.msh", "9e+11 elements"), ("hall.yaml", "9e+11 elements"), ("hall.stl", "more than 1e+06")):
        said = called(str(part), "--size", "6", "--out", str(tmp_path / out)).output.replace("\n", " ")
        assert "it measures 40000 x 30000 x 20000 mm" in said and words in said and "larger --size" in said, said
    face = drawn(tmp_path / "face.step", lambda occ: occ.addRectangle(0.0, 0.0, 0.0, 4.0, 3.0))
    said = called(str(face), "--size", "1", "--out", str(tmp_path / "f.msh")).output.replace("\n", " ")
    assert "surfaces do: --out tool.stl" in said
    with pytest.raises(ValueError, match=r"is a STEP file: fill its solid with elements, prensa import .*hall\.step --size 4"):
        pr.File(str(part))
    (tmp_path / "face.stl").write_text("solid face\n")
    with pytest.raises(ValueError, match="is an STL file, a surface: for tools"):
        pr.File(str(tmp_path / "face.stl"))


def test_surfaces_of_a_step_file_are_listed_with_their_places(tmp_path: Path) -> None:
    """A plate with a hole: what it is fixed or loaded by need not lie at an end."""

    def plate(occ):
        occ.cut([(3, occ.addBox(0.0, 0.0, 0.0, 40.0, 6.0, 20.0))], [(3, occ.addCylinder(20.0, -1.0, 10.0, 0.0, 8.0, 0.0, 5.0))])

    part = drawn(tmp_path / "plate.step", plate)
    said = called(str(part), "--size", "8", "--out", str(tmp_path / "plate.msh")).output.replace("\n", " ")
    assert "(x 15 … 25, y 0 … 6, z 5 … 15)" in said and "(x 0, y 0 … 6, z 0 … 20)" in said, said


def test_a_solid_of_a_step_file_is_filled_with_hexahedra(tmp_path: Path) -> None:
    """They have its volume, and about as many as cubes of the size; sides are found by place; a wrong file is an error."""
    part = drawn(tmp_path / "part.step", lambda occ: occ.addBox(0.0, 0.0, 0.0, 30.0, 20.0, 10.0))
    out = tmp_path / "part.msh"
    assert called(str(part), "--size", "1.5", "--hexahedra", "--out", str(out)).exit_code == 0
    mesh = mesh_of(pr.File(str(out)), "h8", dimension=3)
    assert jacobians(mesh.points[mesh.cells]).sum() == pytest.approx(6000.0)
    assert 0.5 < len(mesh.cells) / (6000.0 / 1.5**3) < 3.0
    assert {"left", "right", "bottom", "top", "back", "front", "surface-1"} <= set(mesh.edges)
    assert np.ptp(mesh.points[mesh.edges["top"]][..., 1]) < 1e-9
    part.write_text("ISO-10303-21;\n")
    wrong = called(str(part), "--size", "3", "--out", str(tmp_path / "b.msh"))
    assert wrong.exit_code == 2 and "part.step" in wrong.output
