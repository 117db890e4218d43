"""Force against travel as two columns, and the options of plots and films, of small runs in the plane."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image
from test_answer import table
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.model.sheets import read_sheet
from prensa.output.curve import force_curve

CASE = """
name: small
space: plane strain
bodies:
  block: {mesh: {type: rectangle, size: [4, 2], n: [4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}, element: t6}
tools: {punch: {type: circle, radius: 10, touching: block.top}, wall: {type: plane, touching: block.left}}
fixed: {block.bottom: y, block.right: x}
steps: [{name: press, move: {punch: {y: -0.1}}, increments: 3}]
"""


def prensa(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    from prensa.model.schema import loads

    return pr.run(loads(CASE), tmp_path_factory.mktemp("curve") / "small", quiet=True)


def test_the_curve_is_that_of_the_history(done):
    """From the initial state on, both positive, of the tool that does the work."""
    curve = done.curve()
    assert (curve.tool, curve.axis, curve.travel_unit, curve.force_unit) == ("punch", "y", "mm", "N/mm")
    assert np.array_equal(curve.travel, -np.append(0.0, done.history["punch.uy"]))
    assert np.array_equal(curve.force, np.append(0.0, done.history["punch.fy"]))
    assert curve.force[-1] > 0.0


@pytest.mark.parametrize("semicolons", [False, True])
def test_tables_of_both_kinds_are_read_back(done, semicolons):
    """Commas and points, semicolons and decimal commas: two columns with names and units, the same bits."""
    out = done.directory / f"curve{semicolons}.csv"
    assert prensa("curve", done.directory, "--out", out, *(["--semicolons"] if semicolons else [])).exit_code == 0
    text = out.read_text(encoding="utf-8")
    assert (";" in text) == semicolons and ("." not in text.splitlines()[2]) == semicolons
    sheet = read_sheet(out)
    assert (sheet.names, sheet.units) == (["travel", "force"], ["mm", "N/mm"])
    curve = done.curve("punch")
    assert np.array_equal(sheet.rows, np.stack([curve.travel, curve.force], axis=1))


def test_what_lies_along_a_boundary_is_a_table(done):
    """Nodes of quadratic edges in walking order, with their coordinates and fields; from the command line too."""
    found = done.profile("block.top", at=2)
    body, columns = done.at(2).bodies["block"], found.columns
    on_top = np.flatnonzero(body.X[:, 1] == 2.0)
    walked = on_top[np.argsort(-body.X[on_top, 0])]
    assert np.array_equal(columns["x"], body.x[walked, 0])
    assert np.array_equal(columns["mises"], body.mises[walked])
    assert np.allclose(np.diff(columns["s"]), np.linalg.norm(np.diff(body.x[walked], axis=0), axis=1))
    out = done.directory / "top.csv"
    assert prensa("curve", done.directory, "--along", "block.top", "--at", 2, "--out", out).exit_code == 0
    assert np.array_equal(np.genfromtxt(out, delimiter=",", names=True)["y"], columns["y"])
    for line, words in (("block.top at X=1", "name a boundary"), ("block.tip", "did you mean 'top'")):
        with pytest.raises(pr.PrensaError, match=words):
            done.profile(line)


def test_tools_that_turn_or_stand_still():
    """Of a tool that only turns its moment against its rotation; one that never moves is refused with those that do."""
    problem = pr.Problem(
        "two", space="plane strain", bodies={"block": pr.Body(pr.Rectangle((4, 2), (2, 1)), pr.Elastic(1e3, 0.3))},
        tools={"roll": pr.Circle(1.0, at=(9, 9)), "still": pr.Plane(at=(0, -9))}, fixed={"block.bottom": "xy"},
        steps=(pr.Step("press", move={"roll": {"rz": -0.2}}),),
    )  # fmt: skip
    rows = table("roll", rz=[-0.1, -0.2], mz=[3.0, 4.0]) | table("still", uy=[0.0, 0.0])
    curve = force_curve(rows, problem)
    assert (curve.axis, curve.travel.tolist(), curve.force.tolist()) == ("rz", [0.0, 0.1, 0.2], [0.0, 3.0, 4.0])
    with pytest.raises(pr.PrensaError, match=r"'still' never moves.*'roll'"):
        force_curve(rows, problem, "still")
    with pytest.raises(pr.PrensaError, match="did you mean 'roll'"):
        force_curve(rows, problem, "rol")


def test_plots_have_the_size_and_the_part_that_is_asked_for(done):
    """Pixels of the file; a part of the plane; what cannot be combined is refused in words."""
    out = done.directory / "a.png"
    for field in ("mises", "pressure", "force_stroke"):
        options = ["--size", "4x3", "--dpi", "50", "--out", out, "--field", field]
        options += ["--contact", "block-punch"] if field == "pressure" else []
        assert prensa("plot", done.directory, *options).exit_code == 0
        with Image.open(out) as drawn:
            assert drawn.size == (200, 150)
    figure = done.plot("mises", box=(0.0, 1.0, 1.0, 2.0), range=(0.0, 5.0))
    assert (*figure.axes[0].get_xlim(), *figure.axes[0].get_ylim()) == (0.0, 1.0, 1.0, 2.0)
    for wrong, words in [
        (["--size", "4"], "give 2 numbers"), (["--box", "1,0,0,1"], "lower end first"), (["--dpi", "1"], "between 10 and 2400"),
        (["--view", "top"], "of 'space: solid'"), (["--film", "--step", "press"], "leave --step out"),
        (["--field", "pressure", "--box", "0,1,0,1"], "no option 'box'"),
        (["--field", "energy", "--section", "x"], "no options but"), (["--field", "pressure", "--film"], "'pressure' is a curve"),
    ]:  # fmt: skip
        failed = prensa("plot", done.directory, *wrong)
        assert failed.exit_code == 2 and words in " ".join(failed.output.split()), (wrong, failed.output)


def test_axes_of_films_stand_still(done):
    """What is beside the body (axes, numbers, colours) has the same pixels in the first and in the last frame."""
    path, frames = done.animate("mises", done.directory / "f.gif", dpi=60, size=(4.0, 3.0)).path, []
    with Image.open(path) as film:
        for k in (0, film.n_frames - 1):
            film.seek(k)
            frames.append(np.asarray(film.convert("L")).astype(int))
    assert frames[0].shape == (180, 240)
    changed = np.argwhere(np.abs(frames[0] - frames[1]) > 40)
    assert len(changed)
    left, below = frames[0][:, :30], frames[0][120:, :]
    assert np.abs(left - frames[1][:, :30]).max() <= 40 and np.abs(below - frames[1][120:, :]).max() <= 40


def test_pressures_of_quadratic_edges_are_drawn_by_the_smoothed_stress(done):
    """The line is that of the smoothed stress; nodal forces, which scatter about it, are dots; the page does the same."""
    from prensa.output.report import stored_run
    from prensa.output.scene import scene

    contact = done.at("last").contacts["block-punch"]
    lines = {line.get_label(): line for line in done.plot("pressure", contact="block-punch").axes[0].lines}
    assert lines["p, nodal forces"].get_linestyle() == "None"
    assert "p, recovered stress" not in lines
    closed = contact.status > 0
    drawn = lines["p, smoothed stress"].get_ydata()
    assert np.array_equal(np.sort(drawn[np.isfinite(drawn)]), np.sort(contact.pressure_smoothed[closed]))
    made = {c["name"]: c for c in scene(stored_run(done.directory))[0]["contacts"]}
    assert made["block-punch"]["quadratic"]
