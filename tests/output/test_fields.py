import dataclasses

import meshio
import numpy as np
import pytest
import synthetic

import prensa as pr
from prensa.output import vtk


def test_meshio_reads_the_fields_back(tmp_path):
    """A .vtu file holds the current positions, the way back to the initial ones, and every promised field."""
    increment = synthetic.increment(5)
    body = increment.bodies["block"]
    mesh = meshio.read(vtk.write_fields(tmp_path / "0005.vtu", increment))
    assert np.array_equal(mesh.points[:, :2], body.x)
    assert np.allclose(
        mesh.points - mesh.point_data["displacement"], np.pad(body.X, ((0, 0), (0, 1))), rtol=0, atol=1e-13
    )
    assert mesh.point_data["stress"].shape == (len(body.X), 6)
    assert np.array_equal(mesh.point_data["stress"][:, :4], body.stress)
    assert np.array_equal(mesh.point_data["reaction"][:, :2], body.reaction)
    assert np.array_equal(mesh.point_data["mises"], body.mises)
    assert np.array_equal(mesh.point_data["plastic_strain"], body.plastic_strain)
    assert mesh.point_data["contact_pressure"].max() == increment.contacts[synthetic.CONTACT].pressure.max()
    assert np.array_equal(mesh.cells[0].data, body.cells)


def test_fields_are_binary_and_compressed(tmp_path):
    """The file is smaller than its own arrays as text would be, and says that it is compressed."""
    text = vtk.write_fields(tmp_path / "a.vtu", synthetic.increment(5)).read_bytes()
    assert b"vtkZLibDataCompressor" in text and b'format="binary"' in text


def test_several_bodies_share_one_file_and_keep_their_number(tmp_path):
    """Two bodies give one file whose cells say which body they belong to."""
    increment = synthetic.increment(5)
    block = increment.bodies["block"]
    other = dataclasses.replace(block, x=block.x + 100.0, X=block.X + 100.0)
    two = dataclasses.replace(increment, _bodies=lambda: {"block": block, "other": other})
    mesh = meshio.read(vtk.write_fields(tmp_path / "a.vtu", two))
    number = mesh.cell_data["body"][0]
    assert np.array_equal(np.unique(number), [0, 1])
    assert mesh.points[mesh.cells[0].data[number == 1]][..., 0].min() >= 100.0


def test_values_at_integration_points_are_read_back_by_body(tmp_path):
    """Of elements with other numbers of points and bodies with other laws, to the last bit; without them the file says so."""
    steel = pr.J2(200e3, 0.3, pr.Linear(100.0, 500.0))
    bodies = {
        "a": pr.Body(pr.Rectangle((1, 1), (2, 2)), steel, "q8", damage=pr.Freudenthal()),
        "b": pr.Body(pr.Rectangle((1, 1), (2, 1), origin=(3, 0)), steel, "t3"),
        "c": pr.Body(pr.Rectangle((1, 1), (1, 1), origin=(6, 0)), pr.Elastic(1e3, 0.3), "q4"),
    }
    fixed = {f"{b}.bottom": "xy" for b in bodies} | {f"{b}.top": {"y": 0.01} for b in bodies}
    *_, last = pr.solve(pr.Problem("three", bodies=bodies, fixed=fixed, steps=[pr.Step("pull", increments=2)]))
    path = vtk.write_fields(tmp_path / "a.vtu", last, points=True)
    stored = vtk.read_points(path, list(bodies))
    for name, points in last.points.items():
        assert np.array_equal(stored[name].stress, points.stress) and stored[name].stress.shape[2] == 4
        assert np.array_equal(stored[name].plastic_strain, points.plastic_strain)
        assert list(stored[name].damage) == (["freudenthal"] if name == "a" else [])
    assert np.array_equal(stored["a"].damage["freudenthal"], last.points["a"].damage["freudenthal"])
    assert set(vtk.read_fields(path, list(bodies))) == set(bodies)
    with pytest.raises(pr.PrensaError, match="no values at integration points were written"):
        vtk.read_points(vtk.write_fields(tmp_path / "b.vtu", last), list(bodies))


def test_the_collection_lists_files_in_time_after_each_increment(tmp_path):
    """fields.pvd is valid after every increment and names the files written so far."""
    writer = vtk.Fields(tmp_path)
    assert vtk.read_collection(tmp_path / "fields.pvd") == []
    for n in (1, 2):
        writer.append(synthetic.increment(n))
        listed = vtk.read_collection(tmp_path / "fields.pvd")
        assert listed == [(k / 10, f"fields/{k:04d}.vtu") for k in range(1, n + 1)]


def test_continued_fields_forget_what_came_after_the_checkpoint(tmp_path):
    """Field files later than the checkpoint go, in the folder and in the collection."""
    first = vtk.Fields(tmp_path)
    for n in (1, 2, 3):
        first.append(synthetic.increment(n))
    vtk.Fields(tmp_path, keep=2)
    assert sorted(p.name for p in (tmp_path / "fields").iterdir()) == ["0001.vtu", "0002.vtu"]
    assert [name for _, name in vtk.read_collection(tmp_path / "fields.pvd")] == ["fields/0001.vtu", "fields/0002.vtu"]
