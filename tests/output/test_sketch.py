"""The picture of `prensa check`: bodies with the names of their sides, tools where they start."""

from __future__ import annotations

import json
from pathlib import Path

import ezdxf
import meshio
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.patches import Polygon
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.model.schema import load
from prensa.output.sketch import sketch
from prensa.system.discretise import discretise

CASE = """
name: press
space: plane strain
bodies:
  block:
    mesh: {type: file, path: a.msh}
    material: {type: elastic, E: 1000, nu: 0.3}
tools: {punch: {type: profile, points: a.dxf, fillet: 0, touching: block.top}}
fixed: {block.bottom: xy}
steps: [{name: press, move: {punch: {y: -0.01}}}]
"""
MESH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
6
1 0 0 0
2 1 0 0
3 2 0 0
4 0 1 0
5 1 1 0
6 2 1 0
$EndNodes
$Elements
3
1 1 2 0 7 1 2
2 3 2 0 1 1 2 5 4
3 3 2 0 1 2 3 6 5
$EndElements
"""


@pytest.fixture
def case(tmp_path: Path) -> Path:
    (tmp_path / "a.msh").write_text(MESH)
    document = ezdxf.new(units=4)
    document.modelspace().add_spline([(-1, 2), (0.2, 0.5), (1, 0), (1.8, 0.5), (3, 2)])
    document.saveas(tmp_path / "a.dxf")
    (tmp_path / "case.yaml").write_text(CASE)
    return tmp_path / "case.yaml"


def words(figure: object) -> list[str]:
    return [t.get_text() for t in figure.axes[0].texts]  # type: ignore[attr-defined]


def test_the_picture_has_all_names_once_and_the_tool_in_its_place(case: Path) -> None:
    """Names of one side stand together; the polygon of the tool has the drawn curve, lifted onto the block."""
    system = discretise(load(case).problem)
    figure = sketch(system.problem, system.meshes, system)
    shown = words(figure)
    assert sorted(shown) == sorted(
        ["block", "bottom", "curve-7", "right", "top", "left", "bottom-left", "bottom-right", "top-left", "top-right", "punch"]
    )
    (tool,) = [p for p in figure.axes[0].patches if isinstance(p, Polygon)]
    assert tool.get_xy()[:, 1].min() == pytest.approx(1.0, abs=1e-3)
    (x0, x1), (y0, y1) = figure.axes[0].get_xlim(), figure.axes[0].get_ylim()
    assert x0 < 0 < 2 < x1 and y0 < 0 < 1 < y1


def test_check_writes_the_picture(case: Path) -> None:
    """By its ending; another one is refused; results are as without."""
    for name in ("a.png", "a.svg"):
        done = CliRunner().invoke(app, ["check", str(case), "--picture", str(case.with_name(name))])
        assert done.exit_code == 0 and "1 spline became" in done.output and "found by place: 'bottom'" in done.output
        assert case.with_name(name).stat().st_size > 5000
    done = CliRunner().invoke(app, ["check", str(case), "--json", "--picture", str(case.with_name("b.pdf"))])
    summary = json.loads(done.stdout)
    assert summary["picture"].endswith("b.pdf") and summary["sides"]["block"]["boundaries"][0] == "curve-7"
    assert "1 spline became" in "".join(summary["drawings"]["punch"])
    done = CliRunner().invoke(app, ["check", str(case), "--picture", "a.xyz"])
    assert done.exit_code == 2 and "no picture ends in '.xyz'" in done.output


IN_SPACE = """
name: coining
space: solid
bodies:
  b: {mesh: {type: cylinder, radius: 4, height: 3, n: [2, 2, 3], angle: 90 deg}, material: {type: elastic, E: 1000, nu: 0.3}}
tools: {ball: {type: sphere, radius: 5, touching: b.top, at: [0, 0, 0]}}
contacts: [{surface: b.top, against: ball}]
fixed: {b.bottom: y, b.base: z, b.cap: x}
steps: [{name: press, move: {ball: {y: -0.01}}}]
"""


def test_bodies_in_space_are_drawn_from_two_sides(tmp_path: Path) -> None:
    """Each side is named in the view that sees it, in its own colour; without tools where a side does not exist."""
    case = tmp_path / "case.yaml"
    case.write_text(IN_SPACE)
    system = discretise(load(case).problem)
    figure = sketch(system.problem, system.meshes, system)
    above, below = ({t.get_text() for t in axes.texts} for axes in figure.axes)
    assert above == {"top", "outer"} and below == {"bottom", "base", "cap"}
    picture = np.asarray(figure.axes[0].images[0].get_array()).reshape(-1, 4)
    shown = {t.get_text(): np.array(to_rgb(t.get_color())) for t in figure.axes[0].texts}
    for colour in shown.values():  # shaded, but of one hue
        hue = picture[:, :3] / np.maximum(picture[:, :3].max(axis=1, keepdims=True), 1e-9)
        assert (np.abs(hue - colour / colour.max()).max(axis=1) < 0.02).mean() > 0.02
    done = CliRunner().invoke(app, ["check", str(case), "--picture", str(tmp_path / "a.png")])
    assert done.exit_code == 0 and (tmp_path / "a.png").stat().st_size > 5000
    mesh = system.meshes["b"]  # from a file: which sides there are is known once it is read
    meshio.write(tmp_path / "b.vtu", meshio.Mesh(mesh.points, [("hexahedron", mesh.cells)]))
    cylinder = IN_SPACE[IN_SPACE.index("{type: cylinder") : IN_SPACE.index(", material")]
    case.write_text(IN_SPACE.replace(cylinder, "{type: file, path: b.vtu}").replace("b.base: z, b.cap: x", "b.side: z"))
    done = CliRunner().invoke(app, ["check", str(case), "--picture", str(tmp_path / "b.png")])
    assert done.exit_code == 2 and "unknown boundary 'side'" in done.output and (tmp_path / "b.png").stat().st_size > 5000


def test_a_side_that_does_not_exist_is_looked_for_in_a_picture_of_the_bodies(case: Path) -> None:
    """The error comes all the same."""
    case.write_text(CASE.replace("block.bottom: xy", "block.floor: xy"))
    done = CliRunner().invoke(app, ["check", str(case), "--picture", str(case.with_name("a.png"))])
    assert done.exit_code == 2 and "unknown boundary 'floor'" in done.output and "shows the bodies" in done.output
    assert case.with_name("a.png").is_file()
    problem = load(case).problem
    mesh = pr.File(str(case.with_name("a.msh")))
    from prensa.mesh.generate import mesh_of

    figure = sketch(problem, {"block": mesh_of(mesh)})
    assert "punch" not in words(figure) and "curve-7" in words(figure)
