"""Runs in space from a case file: tables, fields, pictures, report, answers, resuming; sections swept to bricks."""

from __future__ import annotations

import json
from dataclasses import replace

import meshio
import numpy as np
import pytest
import test_page
from test_page import browser as browser

import prensa as pr
from prensa.measures import parse_all
from prensa.mesh.bricks import bricks_behind
from prensa.mesh.generate import mesh_of
from prensa.model.schema import loads
from prensa.output.run import resume

CASE = """
name: ball
space: solid
bodies:
  block:
    mesh: {type: box, size: [4, 2, 4], n: [4, 2, 4]}
    material: {type: j2, E: 200000, nu: 0.3, flow: {type: swift, K: 500, e0: 0.01, n: 0.2}}
tools:
  ball: {type: revolved, section: {type: circle, radius: 5}, touching: block.top, at: [0, 0, 0]}
contacts: [{surface: block.top, against: ball, friction: {mu: 0.2}}]
fixed: {block.left: x, block.back: z, block.bottom: y}
steps:
- {name: press, move: {ball: {y: -0.3}}, increments: 3}
- {name: drag, by: {ball: {z: 0.1}}, fixed: {block.bottom: xyz}, increments: 2}
output: {mirror: left}
"""


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The case, run into a folder; and its increments as they were solved."""
    folder = tmp_path_factory.mktemp("space") / "ball"
    case = loads(CASE)
    pr.run(case, folder, quiet=True)
    return folder, case, list(pr.solve(case.problem))


def test_tables_and_fields_are_what_was_solved(ran):
    """Read back: forces, places, contacts to the bit; stresses have six components; hexahedra for ParaView."""
    folder, _, solved = ran
    stored = pr.results(folder)
    assert len(stored.increments) == len(solved) == 5
    for read, made in zip(stored.increments, solved):
        assert read.force("ball") == made.force("ball")
        assert read.tools["ball"].place == made.tools["ball"].place
        assert read.supports == made.supports
        a, b = read.contacts["block.top-ball"], made.contacts["block.top-ball"]
        assert np.array_equal(a.x, b.x)
        assert np.array_equal(a.pressure, b.pressure)
        assert np.array_equal(a.shear, b.shear)
    last = stored.increments[-1].bodies["block"]
    assert last.stress.shape == (len(last.x), 6)
    assert np.allclose(last.stress, solved[-1].bodies["block"].stress)
    grid = meshio.read(next((folder / "fields").glob("0005.vtu")))
    assert grid.cells[0].type == "hexahedron"
    assert np.allclose(grid.point_data["stress"], last.stress)


def test_what_lies_along_a_cut_is_a_table(ran):
    """On a plane of symmetry at the nodes of the side there, between them halfway; a line needs its plane."""
    folder, *_ = ran
    result = pr.results(folder)
    body = result.at("last").bodies["block"]
    columns = result.profile("block.top at Z=0").columns
    nodes = np.flatnonzero((body.X[:, 1] == 2.0) & (body.X[:, 2] == 0.0))
    nodes = nodes[np.argsort(-body.X[nodes, 0])]
    assert np.allclose(columns["X"], body.X[nodes, 0])
    assert np.allclose(columns["y"], body.x[nodes, 1])
    assert np.allclose(columns["stress.yz"], body.stress[nodes, 4])
    between = result.profile("block.top at Z=0.5").columns
    beside = np.flatnonzero((body.X[:, 1] == 2.0) & (body.X[:, 2] == 1.0))
    beside = beside[np.argsort(-body.X[beside, 0])]
    assert np.allclose(between["y"], 0.5 * (body.x[nodes, 1] + body.x[beside, 1]))
    with pytest.raises(pr.PrensaError, match="a side and the plane that cuts it"):
        result.profile("block.top")


def test_forces_balance(ran):
    """Tool and supports hold the block: sums of forces to the tolerance; x and z are even before the drag."""
    *_, solved = ran
    for increment in solved:
        total = np.array(increment.force("ball")[:3]) - sum(np.array(f) for f in increment.supports.values())
        assert np.abs(total).max() < 1e-8 * abs(increment.force("ball").y)
    pressed = solved[2].force("ball")
    assert pressed.x == pytest.approx(pressed.z, rel=1e-6)
    assert solved[-1].force("ball").z != pytest.approx(pressed.z, rel=1e-2)


def test_the_stress_is_that_of_the_metal(ran):
    """No node is above the largest flow stress; the pressure from stresses is near that of the forces."""
    *_, solved = ran
    body = solved[-1].bodies["block"]
    strain = solved[-1].bodies["block"].plastic_strain.max()
    assert 0.02 < strain < 1.0
    assert body.mises.max() <= 500.0 * (0.01 + 1.5 * strain) ** 0.2


def test_summary_report_and_pictures(ran):
    """The answer counts both halves and is in newtons; three components; the report says the same; pictures are drawn."""
    folder, _, solved = ran
    made = json.loads((folder / "summary.json").read_text())
    assert made["status"] == "completed"
    assert set(made["last_force"]["ball"]) == {"x", "y", "z", "mx", "my", "mz"}
    assert "force" in made["answer"][1] and "/mm" not in made["answer"][1]
    page = (folder / "report.html").read_text()
    assert "uz (mm)" in page and "force z (N)" in page
    names = {path.name for path in (folder / "pictures").glob("*.png")}
    assert {"deformed.png", "plastic_strain.png", "force_stroke.png", "pressure_block.top-ball.png"} <= names
    for field in ("mises", "displacement.z", "stress.yz"):
        assert solved[-1].plot(field).axes[0].name == "3d"


def complaints(browser):
    """What the page complains of; the browser itself remarks that it draws without a graphics card."""
    return [text for text in test_page.complaints(browser) if "GL Driver" not in text and "swiftshader" not in text]


@pytest.fixture
def page(browser, ran):
    return test_page.opened(browser, ran[0] / "report.html")


@test_page.needs_browser
def test_the_page_turns_the_bodies(page):
    """Drawn with nothing fetched; fields, increments, sections, mirrors, tools, views and the mouse change the picture."""
    from selenium.webdriver.common.action_chains import ActionChains

    assert page.execute_script("return performance.getEntriesByType('resource').map(e => e.name)") == []
    seen = [test_page.pixels(page, "turned")]
    assert test_page.colourful(seen[0]) > 0.1
    changes = [("field", "stress.xz"), ("field", "contact_pressure"), ("tools", "on"), ("tools", ""), ("slider", "0"),
               ("range", "now"), ("cut", "x"), ("cut", "z"), ("mirror", ""), ("mesh", ""), ("scale", "4")]  # fmt: skip
    for control, value in changes:
        test_page.choose(page, control, value)
        seen.append(test_page.pixels(page, "turned"))
        assert (seen[-1] != seen[-2]).any(), control
    page.find_element("id", "view-top").click()
    canvas = page.find_element("id", "turned")
    ActionChains(page).move_to_element(canvas).click_and_hold().move_by_offset(60, 40).release().perform()
    assert (test_page.pixels(page, "turned") != seen[-1]).any()
    test_page.choose(page, "cut", "")
    ActionChains(page).move_to_element(canvas).click().perform()
    test_page.wait(page, "return !document.getElementById('probe-box').hidden")
    assert "Node " in page.find_element("id", "probe-text").text
    assert complaints(page) == []


@test_page.needs_browser
def test_the_page_holds_what_the_run_wrote(page, ran):
    """Places and fields of the outside come back within their quantisation, and the middle section as interpolated."""
    from prensa.output.plot import field_values
    from prensa.output.solid import shell

    _, _, solved = ran
    test_page.choose(page, "field", "mises")
    low, high = page.execute_script("return (f => [f.low, f.high])(prensa.scene.fields.find(f => f.key === 'mises'))")
    for k in (0, 4):
        body = solved[k].bodies["block"]
        seen = shell(body.X, body.cells, [(0, 2.0), (1, 1.0), (2, 2.0)])
        read = "prensa.go(arguments[0]); const b = prensa.bodies()[0]; return [[[...b.x], [...b.y], [...b.z]], [...b.value]]"
        x, v = page.execute_script(read, k)
        assert np.abs(np.transpose(x) - seen.of(body.x)).max() < 1e-4 * np.ptp(body.displacement)
        assert np.abs(v - seen.of(field_values(body, "mises"))).max() <= 0.51 * (high - low) / 4095


def test_a_page_that_would_be_too_large_shows_fewer_increments(ran):
    """The first, the last and the largest force stay longest; the last alone where there is no room at all."""
    from prensa.output.report import stored_run
    from prensa.output.scene import as_json, scene

    folder, _, solved = ran
    made, data = scene(stored_run(folder))
    whole = len(data) + len(as_json(made))
    fewer, data = scene(stored_run(folder), whole - 1)
    peak = max(solved, key=lambda i: abs(i.force("ball").y)).number
    assert {0, 4, peak - 1} <= set(fewer["frames"]) and len(fewer["frames"]) < 5
    assert len(data) + len(as_json(fewer)) < whole
    assert scene(stored_run(folder), 1)[0]["frames"] == [4]


@test_page.needs_browser
def test_a_phone_turns_them_and_a_browser_without_webgl_shows_pictures(browser, ran):
    """Nothing is wider than the screen; where nothing can be drawn in space the page says so and opens its pictures."""
    page = test_page.opened(browser, ran[0] / "report.html", 360, 740, mobile=True)
    assert page.execute_script("return document.documentElement.scrollWidth") <= 360
    assert test_page.colourful(test_page.pixels(page, "turned")) > 0.05
    script = """const given = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (k, ...a) {
          return k === "webgl2" ? null : given.call(this, k, ...a); };"""
    added = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": script})
    try:
        page = test_page.opened(browser, ran[0] / "report.html")
        assert page.find_element("id", "no-webgl").is_displayed() and not page.find_element("id", "space").is_displayed()
        assert page.find_element("css selector", "#stills img").is_displayed()
        assert test_page.colourful(test_page.pixels(page, "force")) > 0.002  # the curves need no WebGL
        assert complaints(page) == []
    finally:
        browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)


def test_it_resumes_to_the_same_bits(ran, tmp_path):
    """Stopped after two increments and resumed, tables end with the same text."""
    folder, case, _ = ran
    with pytest.raises(KeyboardInterrupt):
        pr.run(case, tmp_path / "again", quiet=True, bar=_Stop(2))
    resume(tmp_path / "again", quiet=True)
    for name in ("history.csv", "convergence.csv", "contact/block.top-ball/0005.csv"):
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes()


class _Stop:
    """A progress bar that interrupts after some increments."""

    def __new__(cls, after):
        from prensa.output.progress import ProgressBar

        class Stopping(ProgressBar):
            seen = 0

            def __call__(self, progress):
                self.seen += progress.event == "accepted"
                if self.seen > after:
                    raise KeyboardInterrupt

        return Stopping(True)


CYLINDER = pr.Extrusion(pr.Disc(10.0, (16, 6)), 20.0, 4, axis="y")


@pytest.mark.parametrize(
    ("mesh", "volume"),
    [
        (CYLINDER, np.pi * 100 * 20),
        (replace(CYLINDER, section=pr.Disc(10.0, (16, 6), part="top-right"), axis="x"), np.pi * 100 * 5),
        (pr.Extrusion(pr.Rectangle((3.0, 2.0), (3, 2)), 4.0, 3, start=-1.0, grade="cap"), 24.0),
        (pr.Revolution(pr.Rectangle((2.0, 3.0), (2, 3), (4.0, 0.0)), 72), np.pi * 60.0),
        (pr.Revolution(pr.Rectangle((2.0, 3.0), (2, 3), (4.0, 0.0)), 18, angle=np.pi / 2), np.pi * 15.0),
    ],
)
def test_swept_sections_are_bodies(mesh, volume):
    """Bricks are positive and fill the volume, but for chords; faces look outwards; every face of the outside has a name."""
    made = mesh_of(mesh)
    corner = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]) / 8
    size = 8.0 * np.linalg.det(np.einsum("ai,maj->mij", corner, made.points[made.cells]))
    assert size.min() > 0
    assert size.sum() == pytest.approx(volume, rel=2.1e-3)
    assert sum(map(len, made.edges.values())) == len(made.boundary)
    for faces in made.edges.values():
        a = made.points[faces]
        inside = made.points[made.cells[bricks_behind(faces, made.cells)]].mean(axis=1)
        assert (np.einsum("ki,ki->k", np.cross(a[:, 2] - a[:, 0], a[:, 3] - a[:, 1]), a.mean(axis=1) - inside) > 0).all()


@pytest.mark.parametrize(
    ("measure", "words"),
    [
        ("block.top.barrel", "needs the plane of the cut"),
        ("block.top-ball.length", "along a line"),
        ("block.top-ball.neutral.x", "along a line"),
    ],
)
def test_measures_of_the_plane_are_refused(measure, words):
    """With what there is instead; those of tools and contacts are read."""
    with pytest.raises(pr.PrensaError, match=words):
        parse_all(loads(CASE + f"measures: {{a: {measure}}}\n").problem)
    there = "measures: {a: ball.force.z, b: block.top-ball.max.pressure, c: block.plastic_power}\n"
    read = parse_all(loads(CASE + there).problem)
    assert list(read) == ["a", "b", "c"]


def test_converge_refines_bricks():
    """A factor of the numbers of elements holds along all three axes; sections and layers too."""
    from prensa.study.levels import _mesh

    problem = loads(CASE).problem
    changes, size = _mesh(problem, 2.0, {})
    assert (changes["bodies.block.mesh.n"], size) == ("[8, 4, 8]", 0.5)
    body = replace(problem.bodies["block"], mesh=CYLINDER)
    alone = replace(problem, bodies={"block": body}, contacts=(), fixed={}, tools={}, steps=(pr.Step("s"),))
    changes, size = _mesh(alone, 0.5, {})
    assert (changes["bodies.block.mesh.section.n"], changes["bodies.block.mesh.n"], size) == ("[8, 3]", "2", 2.0)


def test_tools_that_turned_about_several_axes_are_shown_as_they_stand(tmp_path):
    """A quarter turn about x, then one about the y of space: by SciPy's rotations; the history, the files, the scene agree."""
    from scipy.spatial.transform import Rotation

    from prensa.measures.tool_outlines import motion

    block = CASE[: CASE.index("tools:")]
    pr.run(loads(f"""{block}
tools:
  plate: {{type: plane, touching: block.top}}
  arm: {{type: polyhedron, points: [[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1]], radius: 0.01, at: [2, 9, 2]}}
contacts: [{{surface: block.top, against: plate}}]
fixed: {{block.bottom: xyz}}
steps:
- {{name: x, by: {{plate: {{y: -0.001}}, arm: {{rx: 90 deg}}}}, increments: 1}}
- {{name: y, by: {{plate: {{y: -0.001}}, arm: {{ry: 90 deg}}}}, increments: 2}}
output: {{pictures: false, report: false}}
"""), tmp_path, quiet=True)  # fmt: skip
    stored = pr.results(tmp_path)
    expected = [Rotation.from_rotvec([0, y, 0]) * Rotation.from_rotvec([np.pi / 2, 0, 0]) for y in (0, np.pi / 4, np.pi / 2)]
    vectors = np.stack([stored.history[f"arm.o{a}"] for a in "xyz"], axis=1)
    assert np.allclose(Rotation.from_rotvec(vectors).as_matrix(), [e.as_matrix() for e in expected], atol=1e-12)
    assert np.allclose([motion(i.tools["arm"])[0] for i in stored.increments], [e.as_matrix() for e in expected], atol=1e-12)
    drawn = meshio.read(next((tmp_path / "fields").glob("tools_0003.vtu"))).points
    corner = expected[-1].apply([3.0, 0.0, 0.0]) + np.array([2.0, 9.0, 2.0])  # with its edges rounded a little
    assert np.linalg.norm(drawn - corner, axis=1).min() < 0.1
