"""The fields of a run, opened with VTK itself."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from problems import stroke, upset_block

vtk = pytest.importorskip("vtk")
numpy_support = pytest.importorskip("vtk.util.numpy_support")


@pytest.mark.parametrize("element", ["q4_fbar", "q8", "t6"])
def test_vtk_reads_the_deformed_body_with_its_arrays(tmp_path, element):
    """VTK integrates the area of the deformed shape that its corners have; nodal values are those of the increment."""
    problem = upset_block(
        stroke(-0.2, increments=4), material=pr.J2(1000.0, 0.3, pr.Perfect(20.0)), n=(4, 2), element=element,
        body="block", friction=pr.Coulomb(0.2),
    )  # fmt: skip
    pr.run(pr.Case(problem), out=tmp_path / "press", quiet=True)
    (*_, last) = pr.solve(problem)
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "press" / "fields" / "0004.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    body = last.bodies["block"]
    x = numpy_support.vtk_to_numpy(grid.GetPoints().GetData())[:, :2]
    assert x == pytest.approx(body.x) and grid.GetNumberOfCells() == (16 if element == "t6" else 8)
    values = grid.GetPointData()
    assert numpy_support.vtk_to_numpy(values.GetArray("mises")) == pytest.approx(body.mises)
    assert numpy_support.vtk_to_numpy(values.GetArray("displacement"))[:, :2] == pytest.approx(body.x - body.X)
    whole = vtk.vtkIntegrateAttributes()
    whole.SetInputData(grid)
    whole.Update()
    area = numpy_support.vtk_to_numpy(whole.GetOutput().GetCellData().GetArray("Area"))[0]
    a, b = x[body.cells[:, : len(body.cells[0]) // (1 if element == "q4_fbar" else 2)]].transpose(2, 0, 1)
    corners = 0.5 * (a * np.roll(b, -1, axis=1) - b * np.roll(a, -1, axis=1)).sum()
    assert area == pytest.approx(corners, rel=1e-12 if element == "q4_fbar" else 0.01)
