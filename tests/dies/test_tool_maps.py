"""Maps of loads and wear over tools in space: a block that slides evenly, a ball, files, refusals."""

from __future__ import annotations

import json

import meshio
import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.model.schema import loads
from prensa.output.tool_maps import tool_map

CASE = """
name: slide
space: solid
bodies:
  block: {mesh: {type: box, size: [2, 1, 2], n: [4, 1, 4]}, material: {type: elastic, E: 1000, nu: 0}, element: h8}
tools:
  plate: {type: plane, touching: block.top, at: [1, 1, 1]}
contacts: [{surface: block.top, against: plate, friction: {mu: 0.1}}]
fixed: {block.bottom: xyz}
steps:
- {name: press, move: {plate: {y: -0.01}}, increments: 1}
- {name: slide, by: {plate: {x: 0.4}}, increments: 4}
output: {pictures: false, report: false}
"""


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """A block that a plate slides over, run into a folder; and its increments as they were solved."""
    folder = tmp_path_factory.mktemp("maps") / "slide"
    case = loads(CASE)
    pr.run(case, folder, quiet=True)
    return folder, list(pr.solve(case.problem))


def test_a_block_that_slides_wears_its_plate_by_pressure_times_way(ran):
    """What the block never left has the way of the plate and p times it; volume and force are those of the nodes."""
    folder, solved = ran
    found = pr.results(folder).tool_map("plate")
    assert found.work == pytest.approx(solved[-1].tools["plate"].wear, rel=1e-9)
    (contact,) = solved[-1].contacts.values()
    middle = (np.abs(found.x[:, [0, 2]] + [0.2, 0.0]) < 0.45).all(axis=1)
    assert middle.sum() > 20
    slid = 0.4 - np.abs(contact.x[:, 0] - contact.X[:, 0]).mean()  # what the block gives is no slip
    assert found.sliding[middle] == pytest.approx(slid, rel=0.02)
    assert found.pressure[middle] == pytest.approx(contact.pressure.mean(), rel=0.1)
    assert found.wear[middle] == pytest.approx(found.pressure[middle] * found.sliding[middle], rel=0.05)
    outside = found.x[:, 0] > 1.1
    assert found.pressure[outside].max(initial=0.0) == 0.0
    assert np.abs(found.x[:, 1]).max() < 1e-12


def test_a_law_of_ones_own_wears_tools_in_space(ran):
    """The depth that it states a second, at each point, and its volume: of a law of Archard's form k/H times ∫ p ds."""

    class Own(pr.WearLaw):
        c: float

        def rate(self, at):
            return self.c * at.pressure * at.speed

    run = pr.results(ran[0])
    found, plain, archard = (run.tool_map("plate", law) for law in (Own(1e-8), None, pr.Archard(1e-5, 1e3)))
    assert found.wear == pytest.approx(1e-8 * plain.wear, rel=1e-12, abs=1e-30) and found.wear.max() > 0.0
    assert archard.wear == pytest.approx(found.wear, rel=1e-12, abs=1e-30)
    assert found.work == pytest.approx(1e-8 * plain.work, rel=1e-12)


def test_maps_are_files_for_spreadsheets_and_paraview(ran, tmp_path):
    """From the command line, with the depth of Archard's law; options of sections are refused."""
    folder, _ = ran
    out = tmp_path / "plate"
    said = CliRunner().invoke(app, ["die", str(folder), "--tool", "plate", "--k", "1e-5", "--hardness", "5000", "--depth", "0.01",
                                    "--out", str(out)])  # fmt: skip
    assert said.exit_code == 0, said.output
    table, grid = np.genfromtxt(out / "map.csv", delimiter=",", names=True), meshio.read(out / "map.vtu")
    assert np.allclose(table["wear"], grid.point_data["wear"])
    relative = pr.results(folder).tool_map("plate")
    assert np.allclose(table["wear"], 2e-9 * relative.wear)
    assert len(grid.cells[0].data) == len(relative.triangles)
    summary = json.loads((out / "map.json").read_text(encoding="utf-8"))
    assert summary["parts"] == pytest.approx(0.01 / (2e-9 * relative.wear.max()))
    for given in ("--thickness 3", "--E 210000", "--nu 0.3", "--at last", "--fix back=y"):
        said = CliRunner().invoke(app, ["die", str(folder), "--tool", "plate", *given.split()])
        words = f"stresses of dies are of sections: leave out {given.split()[0]} for a map of the loads"
        assert said.exit_code != 0 and words in said.output


def test_maps_are_of_tools_in_space_that_something_presses_on(ran):
    """Other tools are refused, with what there is."""
    _, solved = ran
    problem = loads(CASE).problem
    with pytest.raises(pr.PrensaError, match="did you mean 'plate'"):
        tool_map(solved, problem, "plat")
    with pytest.raises(pr.PrensaError, match="nothing has pressed"):
        tool_map([], problem, "plate")
