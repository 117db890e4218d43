"""Meshes of bodies in space from files: bricks and wedges of gmsh, Abaqus and VTK; sides by name, number and place."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

import prensa as pr
from prensa.importers.abaqus_case import case_of
from prensa.importers.deck import FileError
from prensa.mesh.brick_checks import jacobians
from prensa.mesh.bricks import bricks_behind, wedges
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import MeshError

WRITTEN = Path(__file__).parents[1] / "importers" / "written"
# A cube, a second one beside it whose nodes are listed the other way up, and a wedge on that; the lower face has a name.
MSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
4
0 7 "origin"
2 1 "under"
3 3 "left half"
3 4 "right half"
$EndPhysicalNames
$Nodes
15
1 0 0 0
2 1 0 0
3 2 0 0
4 0 1 0
5 1 1 0
6 2 1 0
11 0 0 1
12 1 0 1
13 2 0 1
14 0 1 1
15 1 1 1
16 2 1 1
21 1.5 2 0
22 1.5 2 1
99 7 7 7
$EndNodes
$Elements
7
1 15 2 7 1 1
2 3 2 1 1 1 2 12 11
3 3 2 1 1 2 3 13 12
4 2 2 9 2 5 6 21
5 5 2 3 1 1 2 5 4 11 12 15 14
6 5 2 4 2 12 13 16 15 2 3 6 5
7 6 2 4 3 5 6 21 15 16 22
$EndElements
"""
INP = """*HEADING
two parts, the second of which stands on the first and is turned
*PART, NAME=Foot
*NODE, NSET=ALL
1, 0, 0, 0
2, 2, 0, 0
3, 2, 0, -1
4, 0, 0, -1
5, 0, 1, 0
6, 2, 1, 0
7, 2, 1, -1
8, 0, 1, -1
*ELEMENT, TYPE=C3D8R, ELSET=Brick
10, 1, 2, 3, 4, 5, 6, 7, 8
*SURFACE, NAME=UpperFace
Brick, S2
*SURFACE, NAME=Skin
10, S3
Brick, S6
*NSET, NSET=Origin
1
*NSET, NSET=Base, GENERATE
1, 4, 1
*END PART
*PART, NAME=Roof
*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 3
5, 1, 0, 3
6, 0, 1, 3
*ELEMENT, TYPE=C3D6, ELSET=Wedge
1, 1, 2, 3, 4, 5, 6
*SURFACE, NAME=Gable
1, S1
*END PART
*ASSEMBLY, NAME=A
*INSTANCE, NAME=Foot-1, PART=Foot
*END INSTANCE
*INSTANCE, NAME=Roof-1, PART=Roof
0, 1, 0
0, 1, 0, 0, 2, 0, 90
*END INSTANCE
*END ASSEMBLY
"""


def solid(path: Path, **given):
    return mesh_of(pr.File(str(path), **given), "h8_fbar", "mm", None, 3)


def written(tmp_path: Path, name: str, text: str, **given):
    (tmp_path / name).write_text(text)
    return solid(tmp_path / name, **given)


def volume(mesh) -> float:
    return float(jacobians(mesh.points[mesh.cells]).sum())


def looks(mesh, name: str) -> list[float]:
    """Sum of the area vectors of a side, which look outwards."""
    x = mesh.points[mesh.edges[name]]
    area = 0.5 * np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    inside = mesh.points[mesh.cells[bricks_behind(mesh.edges[name], mesh.cells)]].mean(axis=1)
    assert (np.einsum("ki,ki->k", area, x.mean(axis=1) - inside) > 0).all()
    return area.sum(axis=0).tolist()


def test_names_parts_units_and_orientation_of_gmsh(tmp_path: Path) -> None:
    """Left-handed bricks are turned, wedges collapsed; metres become millimetres; parts are bodies, with what lies on them."""
    with pytest.raises(MeshError, match=r"a\.msh: it has several parts; say with 'part' .*'left half', 'right half'"):
        written(tmp_path, "a.msh", MSH)
    both = written(tmp_path, "a.msh", MSH, part=("left half", "right half"), unit="m")
    assert (len(both.cells), len(both.points), wedges(both.cells).sum()) == (3, 14, 1)
    assert volume(both) == pytest.approx(2.5e9)
    assert looks(both, "under") == pytest.approx([0.0, -2e6, 0.0])
    assert both.points[both.corners["origin"]].tolist() == [0.0, 0.0, 0.0]
    right = written(tmp_path, "a.msh", MSH, part="right half")
    assert volume(right) == pytest.approx(1.5)
    assert looks(right, "under") == pytest.approx([0.0, -1.0, 0.0])
    assert looks(right, "back") == pytest.approx([0.0, 0.0, -1.5])  # a square and a triangle
    assert looks(right, "bottom") == looks(right, "under")
    assert any("'origin'" in note and "not on the outside" in note for note in right.notes)
    with pytest.raises(MeshError, match=r"there is no part 'half'.*"):
        written(tmp_path, "a.msh", MSH, part="half")
    with pytest.raises(MeshError, match=r"unknown boundary 'lower'.*'under'.*found by place"):
        right.nodes("lower")


def test_sides_of_decks_instances_and_shells(tmp_path: Path) -> None:
    """Element sides S1 … S6, node sets, instances that are moved and turned about any axis."""
    with pytest.raises(MeshError, match="say with 'part' which one the body is: 'Foot', 'Roof'"):
        written(tmp_path, "a.inp", INP)
    foot = written(tmp_path, "a.inp", INP, part="Foot")
    assert volume(foot) == pytest.approx(2.0)
    assert looks(foot, "UpperFace") == pytest.approx([0.0, 2.0, 0.0])
    assert looks(foot, "Skin") == pytest.approx([-1.0, 0.0, 2.0])
    assert looks(foot, "Base") == pytest.approx([0.0, -2.0, 0.0])
    assert foot.points[foot.corners["Origin"]].tolist() == [0.0, 0.0, 0.0]
    roof = written(tmp_path, "a.inp", INP, part="Wedge")
    assert volume(roof) == pytest.approx(1.5)
    # a quarter turn about y takes z to x and x to −z; the height of the part's origin is 1
    assert roof.extent == pytest.approx([3.0, 1.0, 1.0])
    assert roof.points.min(axis=0) == pytest.approx([0.0, 1.0, -1.0])
    assert looks(roof, "Gable") == pytest.approx([-0.5, 0.0, 0.0])
    end = "*END PART\n*PART, NAME=Roof"
    shell = INP.replace(end, f"*ELEMENT, TYPE=S4, ELSET=Shell\n20, 2, 3, 7, 6\n{end}")
    assert looks(written(tmp_path, "b.inp", shell, part="Foot"), "Shell") == pytest.approx([2.0 / 2, 0.0, 0.0])


@pytest.mark.parametrize("ending", [".vtk", ".vtu"])
def test_files_of_vtk(tmp_path: Path, ending: str) -> None:
    """Bricks and wedges in whatever order of their nodes; sides by number and place; plane meshes too."""
    x = np.concatenate([cube(0.0), [(0.5, 2, 0), (0.5, 2, 1)]])
    cells = [("hexahedron", [[0, 1, 2, 3, 4, 5, 6, 7]]), ("wedge", [[3, 8, 2, 7, 9, 6]]), ("quad", [[0, 1, 5, 4]])]
    numbers = [np.array([1]), np.array([1]), np.array([7])]
    path = tmp_path / f"a{ending}"
    meshio.write(path, meshio.Mesh(x.astype(float), cells, cell_data={"CellEntityIds": numbers}))
    mesh = solid(path)
    assert (len(mesh.cells), volume(mesh)) == (2, pytest.approx(1.5))
    assert looks(mesh, "surface-7") == pytest.approx([0.0, -1.0, 0.0])
    assert looks(mesh, "front") == pytest.approx([0.0, 0.0, 1.5])
    with pytest.raises(MeshError, match="no section of the plane; compute it in 'space: solid'"):
        mesh_of(pr.File(str(path)))
    meshio.write(path, meshio.Mesh(x[:4].astype(float), [("quad", [[0, 1, 2, 3]])]))
    assert len(mesh_of(pr.File(str(path))).nodes("bottom")) == 2
    path.write_bytes(path.read_bytes()[:150])
    with pytest.raises(MeshError, match=r"cannot be read|no hexahedron"):
        solid(path)


@pytest.mark.parametrize("name", ["quarter.msh", "quarter.inp", "quarter.vtu"])
def test_a_quarter_of_a_cylinder_of_gmsh_is_pressed_as_a_bar(tmp_path: Path, name: str) -> None:
    """Written by gmsh 4.15.2, and as VTU by meshio, which reads the same mesh: without friction the force is E ε A."""
    import yaml

    file = WRITTEN / name
    if name.endswith("u"):
        file = tmp_path / name
        theirs = meshio.read(WRITTEN / "quarter.msh")
        bricks = [block for block in theirs.cells if block.type == "hexahedron"]
        meshio.write(file, meshio.Mesh(theirs.points, bricks))
        there = mesh_of(pr.File(str(file)), "h8", "mm", None, 3)
        centres = theirs.points[np.concatenate([b.data for b in bricks])].mean(axis=1)
        assert np.allclose(sorted(map(tuple, there.points[there.cells].mean(axis=1))), sorted(map(tuple, centres)))
    lower, x, z, upper = ("bottom", "left", "back", "top") if name.endswith("u") else (
        "lower", *(("plane x", "plane z") if name.endswith("h") else ("plane_x", "plane_z")), "upper"
    )  # fmt: skip
    case = {
        "name": "bar", "space": "solid", "kinematics": "small", "tools": {"plate": {"type": "plane", "touching": f"b.{upper}"}},
        "bodies": {"b": {"mesh": {"type": "file", "path": str(file)}, "material": {"type": "elastic", "E": 1000, "nu": 0.3}}},
        "contacts": [{"surface": f"b.{upper}", "against": "plate", "enforcement": {"type": "augmented"}}],
        "fixed": {f"b.{lower}": "y", f"b.{x}": "x", f"b.{z}": "z"},
        "steps": [{"name": "press", "move": {"plate": {"y": -0.15}}, "increments": 1}],
    }  # fmt: skip
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(case))
    *_, last = pr.solve(pr.load(tmp_path / "case.yaml").problem)
    area = 50.0 * 6 * np.sin(np.radians(15.0))
    assert last.force("plate").y == pytest.approx(10.0 * area, rel=1e-5)


def cube(x: float) -> np.ndarray:
    return np.array([(x + a, b, c) for c in (0.0, 1.0) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))])


def test_what_cannot_be_computed_is_refused_with_the_remedy(tmp_path: Path) -> None:
    """Four-node tetrahedra, bricks of second order or turned over, open and hanging meshes: with file, element and what to do."""
    one = np.arange(8)
    kinds = {
        "tetra": (4, "tetrahedra of 4 nodes, which bodies are not made of; mesh it with tetrahedra of second order"),
        "pyramid": (5, "pyramids, .* mesh the body with tetrahedra of 10 nodes"),
        "hexahedron20": (20, "hexahedra of 20 nodes, .* elements of the first order"),
    }
    for kind, (nodes, words) in kinds.items():
        points = np.random.default_rng(0).uniform(size=(nodes, 3))
        meshio.write(tmp_path / "a.msh", meshio.Mesh(points, [(kind, [range(nodes)])]), file_format="gmsh22", binary=False)
        with pytest.raises(MeshError, match=rf"a\.msh: line \d+: element 1 is one of {words}"):
            solid(tmp_path / "a.msh")

    def meshed(points, cells):
        meshio.write(tmp_path / "a.vtu", meshio.Mesh(np.asarray(points, dtype=float), [("hexahedron", cells)]))
        return tmp_path / "a.vtu"

    over = MSH.replace("15 1 1 1\n", "15 1 -1 -1\n")
    with pytest.raises(MeshError, match=r"a\.msh: line 35: element 5 near .* is turned over: its Jacobian is -.*; mesh it again"):
        written(tmp_path, "a.msh", over, part="left half")
    with pytest.raises(MeshError, match=r"a\.inp: line 14: element 10 near .* is turned over"):
        written(tmp_path, "a.inp", INP.replace("7, 2, 1, -1", "7, 0, -1, 1"), part="Foot")
    bent = cube(0.0)
    bent[6] = -2.0
    with pytest.raises(MeshError, match=r"a\.vtu: element 0 near .* is turned over: .*\(1 of 1 are\); mesh it again"):
        solid(meshed(bent, [one]))
    double = meshed(np.concatenate([cube(0.0), cube(1.0)]), [one, one + 8])
    with pytest.raises(MeshError, match=r"at the same place, .* open between their elements; merge them \('merge: true'"):
        solid(double)
    joined = solid(double, merge=True)
    assert (len(joined.points), len(joined.boundary)) == (12, 10)
    smaller = np.concatenate([cube(0.0), cube(1.0) * [1.0, 0.5, 0.5] + [0.0, 0.2, 0.2]])
    with pytest.raises(MeshError, match=r"node \d+ at \(1, .*\) hangs in the face of the nodes .*; split that element"):
        solid(meshed(smaller, [one, one + 8]))
    with pytest.raises(FileError, match=r"the deck has no \*STEP, so no process is described"):
        case_of(INP, "a.inp", frozenset())
    with pytest.raises(MeshError, match="there is no hexahedron, wedge or tetrahedron in it"):
        meshio.write(tmp_path / "a.vtu", meshio.Mesh(cube(0.0), [("quad", [[0, 1, 2, 3]])]))
        solid(tmp_path / "a.vtu")
    deck = INP.replace("10, 1, 2, 3, 4, 5, 6, 7, 8", "10, 1, 2, 3, 4, 5, 6, 7, 77")
    with pytest.raises(MeshError, match="line 14: element 10 refers to node 77"):
        written(tmp_path, "c.inp", deck, part="Foot")
    with pytest.raises(MeshError, match=r"line 18: 'S9' is not a side of element 10; write S1 … S6"):
        written(tmp_path, "d.inp", INP.replace("10, S3", "10, S9"), part="Foot")
