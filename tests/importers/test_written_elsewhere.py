"""Meshes that another program has written (gmsh 4.15.2, its own format and an Abaqus deck) run end to end from a case file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import prensa as pr

WRITTEN = Path(__file__).parent / "written"
CASE = """
name: upsetting
space: axisymmetric
bodies:
  billet:
    mesh: {mesh}
    material: {{type: j2, E: 70 GPa, nu: 0.33, flow: {{type: voce, s0: 60, Q: 120, b: 8}}}}
tools: {{punch: {{type: plane, touching: billet.top}}}}
contacts: [{{surface: [billet.top, billet.right], against: punch, friction: {{type: coulomb, mu: 0.2}}}}]
fixed: {{billet.bottom: y}}
steps: [{{name: press, move: {{punch: {{y: -3}}}}, increments: 6}}]
output: {{pictures: false, report: false}}
"""


def history(mesh: str, folder: Path) -> dict[str, np.ndarray]:
    path = folder / "case.yaml"
    path.write_text(CASE.format(mesh=mesh), encoding="utf-8")
    return pr.run(pr.load(path), folder / "results", quiet=True).history


@pytest.mark.parametrize("name", ["billet.msh", "billet.inp"])
def test_a_mesh_of_gmsh_gives_the_forces_of_the_same_mesh_made_here(name, tmp_path):
    """Named sides, elements and coordinates arrive: forces and friction work agree with the built-in rectangle to rounding."""
    file = "{type: file, path: " + (WRITTEN / name).as_posix() + ", part: billet}"
    ours_folder = tmp_path / "ours"
    ours_folder.mkdir()
    theirs = history(file, tmp_path)
    ours = history("{type: rectangle, size: [10, 15], n: [4, 6]}", ours_folder)
    for column in ("punch.fy", "energy.friction", "fixed.billet.bottom.fy"):
        assert np.allclose(theirs[column], ours[column], rtol=1e-8), column
    assert theirs["punch.fy"][-1] > 5e4
