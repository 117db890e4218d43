"""STEP files are meshed by gmsh where it is installed, and refused with what to install where it is not."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.mesh.brick_checks import jacobians
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
        (["--size", "2", "--out", str(part.with_suffix(".inp"))], "and the mesh to write"),
    ):
        result = called(str(part), *arguments)
        assert result.exit_code == 2 and words in result.output.replace("\n", ""), (arguments, result.output)
    out.write_text("")
    assert "exists; name another file" in called(str(part), "--size", "2", "--out", str(out)).output.replace("\n", "")
    assert "--size is of STEP files" in called("deck.inp", "--size", "2").output


def test_a_solid_of_a_step_file_is_filled_with_hexahedra(tmp_path: Path) -> None:
    """They have its volume, and about as many as cubes of the size; sides are found by place; a wrong file is an error."""
    gmsh = pytest.importorskip("gmsh")
    part, out = tmp_path / "part.step", tmp_path / "part.msh"
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addBox(0.0, 0.0, 0.0, 30.0, 20.0, 10.0)
    gmsh.model.occ.synchronize()
    gmsh.write(str(part))
    gmsh.finalize()
    assert called(str(part), "--size", "1.5", "--out", str(out)).exit_code == 0
    mesh = mesh_of(pr.File(str(out)), "h8", dimension=3)
    assert jacobians(mesh.points[mesh.cells]).sum() == pytest.approx(6000.0)
    assert 0.5 < len(mesh.cells) / (6000.0 / 1.5**3) < 3.0
    assert {"left", "right", "bottom", "top", "back", "front", "surface-1"} <= set(mesh.edges)
    assert np.ptp(mesh.points[mesh.edges["top"]][..., 1]) < 1e-9
    part.write_text("ISO-10303-21;\n")
    wrong = called(str(part), "--size", "3", "--out", str(tmp_path / "b.msh"))
    assert wrong.exit_code == 2 and "part.step" in wrong.output
