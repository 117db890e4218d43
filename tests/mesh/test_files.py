"""Meshes of gmsh's files and of Abaqus decks: sets survive, units are converted, bad files are reported in one line."""

from __future__ import annotations

import random
from pathlib import Path

import meshio
import numpy as np
import pytest

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import MeshError, areas

# Two squares side by side and a physical group of each; the middle line belongs to both.
MSH2 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
5
0 7 "origin"
1 1 "bottom"
1 2 "weld"
2 3 "left half"
2 4 "right half"
$EndPhysicalNames
$Nodes
7
1 0 0 0
2 1 0 0
3 2 0 0
4 0 1 0
5 1 1 0
6 2 1 0
99 7 7 0
$EndNodes
$Elements
8
1 15 2 7 1 1
2 1 2 1 1 1 2
3 1 2 1 2 2 3
4 1 2 2 3 2 5
5 3 2 3 1 1 2 5 4
6 3 2 4 2 2 5 6 3
7 3 2 4 2 2 5 6 3
8 1 2 9 4 6 5
$EndElements
"""
MSH4 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
5
0 7 "origin"
1 1 "bottom"
1 2 "weld"
2 3 "left half"
2 4 "right half"
$EndPhysicalNames
$Entities
1 4 2 0
1 0 0 0 1 7
1 0 0 0 1 0 0 1 1 0
2 1 0 0 2 0 0 1 1 0
3 1 0 0 1 1 0 1 2 0
4 1 1 0 2 1 0 1 9 0
1 0 0 0 1 1 0 1 3 0
2 1 0 0 2 1 0 1 4 0
$EndEntities
$Nodes
2 7 1 99
2 1 0 4
1
2
4
5
0 0 0
1 0 0
0 1 0
1 1 0
2 2 0 3
3
6
99
2 0 0
2 1 0
7 7 0
$EndNodes
$Elements
7 7 1 7
0 1 15 1
1 1
1 1 1 1
2 1 2
1 2 1 1
3 2 3
1 3 1 1
4 2 5
1 4 1 1
8 6 5
2 1 3 1
5 1 2 5 4
2 2 3 1
6 2 5 6 3
$EndElements
"""
INP = """*HEADING
 two squares
** a comment
*NODE, NSET=ALL
 1, 0., 0.
 2, 1., 0.
 3, 2.0D0, 0.
*NODE
 4, 0., 1.
 5, 1., 1.
 6, 2., 1.
 7, 9., 9.
*ELEMENT, TYPE=CPE4R, ELSET=left_half
 10, 1, 2,
 5, 4
*ELEMENT, TYPE=CPE4R, ELSET=right_half
 11, 2, 5, 6, 3
*NSET, NSET=Bottom, GENERATE
 1, 3, 1
*NSET, NSET=origin
 1,
*NSET, NSET=floor
 bottom
*ELSET, ELSET=both
 left_half, right_half
*SURFACE, NAME=weld, TYPE=ELEMENT
 left_half, S2
*SURFACE, NAME=skin
 both
*SURFACE, NAME=lid, TYPE=ELEMENT
 10, S3
 11, S2
*MATERIAL, NAME=steel
*ELASTIC
 210000., 0.3
*STEP
*STATIC
*END STEP
"""


def write(folder: Path, name: str, text: str) -> str:
    path = folder / name
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("text", [MSH2, MSH4], ids=["2.2", "4.1"])
def test_physical_groups_become_bodies_boundaries_and_points(tmp_path, text):
    """Curves name boundaries (by their number where they have no name), points nodes, surfaces parts."""
    path = write(tmp_path, "two.msh", text)
    left, right = (mesh_of(pr.File(path, part=p)) for p in ("left half", "right half"))
    assert areas(left.points, left.cells).tolist() == [1.0] and areas(right.points, right.cells).tolist() == [1.0]
    assert set(left.edges) == {"bottom", "weld"} and set(left.corners) == {"origin"}
    assert set(right.edges) == {"bottom", "weld", "9"} and not right.corners
    assert left.points[left.nodes("weld")].tolist() == [[1, 0], [1, 1]], "the body is on the left"
    assert right.points[right.nodes("weld")].tolist() == [[1, 1], [1, 0]]
    whole = mesh_of(pr.File(path, part=("left half", "right half")))
    assert areas(whole.points, whole.cells).tolist() == [1.0, 1.0] and len(whole.points) == 6
    assert "weld" not in whole.edges, "inside the body it is not a boundary"
    with pytest.raises(MeshError, match=r"several parts.*'left half', 'right half'"):
        mesh_of(pr.File(path))


def test_an_abaqus_deck_gives_its_sets_and_surfaces(tmp_path):
    """Node sets (listed, generated, of sets), surfaces by side and as free outline, element sets; the names as written."""
    path = write(tmp_path, "two.inp", INP)
    mesh = mesh_of(pr.File(path))
    assert areas(mesh.points, mesh.cells).tolist() == [1.0, 1.0], "the clockwise element is turned round"
    assert mesh.points[mesh.nodes("Bottom")].tolist() == [[0, 0], [1, 0], [2, 0]]
    assert mesh.nodes("floor").tolist() == mesh.nodes("Bottom").tolist()
    assert mesh.points[mesh.nodes("lid")].tolist() == [[2, 1], [1, 1], [0, 1]]
    assert len(mesh.edges["skin"]) == 6 and "weld" not in mesh.edges
    assert mesh.corners == {"origin": 0}
    left = mesh_of(pr.File(path, part="left_half"))
    assert left.points[left.nodes("weld")].tolist() == [[1, 0], [1, 1]]
    assert mesh_of(pr.File(path, part="both")).cells.shape == (2, 4)


def test_parts_of_an_assembly_are_kept_apart_and_moved(tmp_path):
    """Numbers start again in every part; an instance shifts its part; sets of the assembly name their instance."""
    part = "*PART, NAME={}\n*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n*ELEMENT, TYPE=CAX4\n1,1,2,3,4\n*END PART\n"
    text = part.format("Low") + part.format("High") + (
        "*ASSEMBLY, NAME=a\n*INSTANCE, NAME=Low-1, PART=Low\n*END INSTANCE\n"
        "*INSTANCE, NAME=High-1, PART=High\n0., 1.\n*END INSTANCE\n"
        "*NSET, NSET=roof, INSTANCE=High-1\n3, 4\n*NSET, NSET=ground, INSTANCE=Low-1\n1, 2\n*END ASSEMBLY\n"
    )  # fmt: skip
    path = write(tmp_path, "assembly.inp", text)
    high = mesh_of(pr.File(path, part="High"))
    assert high.points[high.nodes("roof")].tolist() == [[1, 2], [0, 2]] and "ground" not in high.edges
    with pytest.raises(MeshError, match="several parts"):
        mesh_of(pr.File(path))


def test_lengths_of_the_file_are_converted_to_those_of_the_case(tmp_path):
    """A deck in metres of a case in millimetres."""
    mesh = mesh_of(pr.File(write(tmp_path, "two.inp", INP), unit="m"), "q4", "mm")
    assert areas(mesh.points, mesh.cells).sum() == pytest.approx(2e6)


def test_a_mesh_that_is_open_between_its_parts_is_refused_or_merged(tmp_path):
    """Nodes that were written twice are named; 'merge' joins them."""
    text = INP.replace("7, 9., 9.", "7, 1., 0.\n 8, 1., 1.").replace("11, 2, 5, 6, 3", "11, 7, 8, 6, 3")
    path = write(tmp_path, "open.inp", text)
    with pytest.raises(MeshError, match="at the same place"):
        mesh_of(pr.File(path))
    mesh = mesh_of(pr.File(path, merge=True))
    assert len(mesh.points) == 6 and len(mesh.edges["skin"]) == 6


MIXED = """*NODE
1,0,0
2,1,0
3,1,1
4,0,1
5,2,0.5
*ELEMENT, TYPE=CPE4
1,1,2,3,4
*ELEMENT, TYPE=CPE3
2,2,5,3
*NSET, NSET=base
1,2
"""
MIXED2 = """*NODE
1,0,0
2,1,0
3,1,1
4,0,1
5,2,0.5
12,0.5,-0.1
23,1,0.5
34,0.5,1
41,0,0.5
25,1.5,0.25
53,1.5,0.75
*ELEMENT, TYPE=CPE8R
1,1,2,3,4,12,23,34,41
*ELEMENT, TYPE=CPE6
2,2,5,3,25,53,23
*NSET, NSET=base
1,2,12
"""


def test_triangles_and_quadrilaterals_together_make_triangles_only(tmp_path):
    """Quadrilaterals are split for a triangular element, mid-side nodes kept; another element is refused with a remedy."""
    path = write(tmp_path, "mixed.inp", MIXED)
    assert mesh_of(pr.File(path), "t6").cells.shape == (3, 6)
    with pytest.raises(MeshError, match="1 T3 and 1 Q4; use element 't6'"):
        mesh_of(pr.File(path))
    mesh = mesh_of(pr.File(write(tmp_path, "mixed2.inp", MIXED2)), "t6")
    assert mesh.cells.shape == (3, 6) and [0.5, -0.1] in mesh.points[mesh.nodes("base")].tolist()
    assert mesh_of(pr.File(write(tmp_path, "mixed3.inp", MIXED2)), "t3").cells.shape == (3, 3)


def test_what_is_read_of_a_gmsh_file_is_what_meshio_reads():
    """Points, cells and named curves of the block of the verification, by an independent reader."""
    path = Path(pr.__file__).parent / "verify" / "meshes" / "block.msh"
    ours, theirs = mesh_of(pr.File(str(path))), meshio.read(path)
    quads = next(c.data for c in theirs.cells if c.type == "quad")
    centre = np.sort(ours.points[ours.cells].mean(axis=1), axis=0)
    assert np.allclose(centre, np.sort(theirs.points[quads][:, :, :2].mean(axis=1), axis=0), atol=1e-12)
    for name in ("bottom", "right", "top", "left"):
        lines = [c.data[s] for c, s in zip(theirs.cells, theirs.cell_sets[name]) if c.type == "line" and len(s)]
        x = np.unique(theirs.points[np.concatenate(lines)].reshape(-1, 3)[:, :2], axis=0)
        assert np.allclose(np.unique(ours.points[ours.nodes(name)], axis=0), x, atol=1e-12)


def test_boundaries_that_a_file_does_not_have_are_reported_with_those_it_has(tmp_path):
    """An unknown name of a body's boundary names the body and the nearest set."""
    problem = pr.Problem(
        "p", {"plate": pr.Body(pr.File(write(tmp_path, "two.inp", INP)), pr.Elastic(E=1, nu=0.3))}, (pr.Step("s"),),
        fixed={"plate.bottom": pr.Fixed(y="held")},
    )  # fmt: skip
    with pytest.raises(MeshError, match=r"'plate.bottom': unknown boundary 'bottom'; did you mean 'Bottom'\?"):
        pr.discretise(problem)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.msh", "", "no \\$MeshFormat"),
        pytest.param("a.msh", MSH2.replace('"origin"', '"' + "b" * 3_000_000, 1), 'is not: dimension tag "name"', id="3 MB"),
        ("a.msh", MSH2.replace("2.2 0 8", "2.2 1 8"), "binary; save it as text"),
        ("a.msh", MSH2.replace("2.2 0 8", "4.0 0 8"), "format 4.0; save it as version 4.1"),
        ("a.msh", MSH2[:300], "is not closed by"),
        ("a.msh", MSH2.replace("$Nodes\n7", "$Nodes\n7000000000000"), "line 13: 7000000000000 entries are announced"),
        ("a.msh", MSH4.replace("2 2 0 3", "2 2 0 300000000000"), "line 33: 600000000000 entries"),
        ("a.msh", MSH4.replace("2 2 3 1\n", "2 2 3 99999\n"), "99999 entries are announced"),
        ("a.msh", MSH2.replace("2 1 0 0\n", "2 1 nan 0\n"), "node 2 has a coordinate that is not a finite number"),
        ("a.msh", MSH2.replace("2 1 0 0\n", "2 1 zero 0\n"), "line 15: '1 zero 0' is not three coordinates"),
        ("a.msh", MSH2.replace("5 3 2 3 1 1 2 5 4", "5 3 2 3 1 1 2 5 44"), "element 5 refers to node 44"),
        ("a.msh", MSH2.replace("5 3 2 3 1 1 2 5 4", "5 5 2 3 1 1 2 5 4 1 2 5 4"), "type 5; .* three-dimensional"),
        ("a.msh", MSH2.replace("5 3 2 3 1 1 2 5 4", "5 3 2 3 1 1 2 5"), "has 3 nodes; type 3 has 4"),
        ("a.msh", MSH2.replace("2 1 0 0\n", "2 1 0 0.3\n"), "plane of x and y"),
        ("a.msh", MSH2.replace(" 3 2 3 1 1 2 5 4", " 1 2 3 1 1 2").replace(" 3 2 4 2 2 5 6 3", " 1 2 3 1 1 2"), "no triangle"),
        ("a.inp", "", "no plane elements"),
        ("a.inp", INP.replace("CPE4R", "C3D8"), "'C3D8' is no plane element"),
        ("a.inp", INP.replace(" 5, 4\n", " 5\n"), "3 numbers|4 numbers are not rows of 5"),
        ("a.inp", INP.replace("*MATERIAL", "*INCLUDE, INPUT=/etc/passwd\n*MATERIAL"), "INCLUDE is not read"),
        ("a.inp", INP.replace(" 1, 3, 1", " 1, 999999999999, 1"), "generates no set"),
        ("a.inp", INP.replace(" left_half, S2", " left, S2"), "unknown element set 'left'"),
        ("a.inp", INP.replace("NSET=origin\n 1,", "NSET=origin\n 1" + 5000 * "0" + ","), "unknown set '1000"),
        ("a.inp", INP.replace(" 10, S3", " 10, S\u00b2"), "is not a side of element 10"),
        ("a.inp", INP.replace(" 10, S3", " \u00b2, S3"), "unknown element set"),
        ("a.inp", INP.replace(" left_half, S2", " left_half, S7"), "'S7' is not a side of element 10"),
        ("a.inp", INP.replace(" 4, 0., 1.", " four, 0., 1."), "line 9: 'four, 0., 1.' is not"),
        ("a.inp", INP.replace("*NODE\n", "*NGEN\n"), "NGEN is not read"),
        ("a.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\n", r"\(Only VTK .*not POLYDATA\)\); save it again"),
        ("a.vtu", "<?xml version='1.0'?>\n<VTKFile type='Unstr", r"\(.*cut off, or of another kind\); save it again as VTK"),
    ],
)  # fmt: skip
def test_a_bad_file_is_refused_in_one_line_that_says_where(tmp_path, name, text, words):
    """Wrong formats, cut-off sections, absurd counts, unknown nodes, generators: no traceback and no huge memory."""
    with pytest.raises(MeshError, match=words) as caught:
        mesh_of(pr.File(write(tmp_path, name, text), part="left half" if name == "a.msh" else ()))
    assert "\n" not in str(caught.value) and str(caught.value).startswith(name)


@pytest.mark.parametrize(("name", "text"), [("a.msh", MSH2), ("b.msh", MSH4), ("c.inp", INP)])
def test_damaged_files_never_raise_anything_but_a_mesh_error(tmp_path, name, text):
    """Lines dropped, doubled, cut and words exchanged at random: read as a mesh or refused."""
    chance = random.Random(1)
    for _ in range(150):
        lines = text.splitlines()
        for _ in range(chance.randint(1, 3)):
            k = chance.randrange(len(lines))
            words = lines[k].split(chance.choice([" ", ","]))
            words[chance.randrange(len(words))] = chance.choice(
                ["", "-1", "1e400", "99999999999999999999", "x", "$", "*"]
            )
            lines[k : k + 1] = chance.choice([[], [lines[k]] * 2, [lines[k][:3]], [" ".join(words)]])
        try:
            mesh_of(pr.File(write(tmp_path, name, "\n".join(lines)), part=() if name == "c.inp" else "left half"))
        except MeshError as error:
            assert str(error)


def test_a_file_is_found_beside_its_case_and_its_change_is_noticed(tmp_path):
    """Paths are the case file's; a case that is written out remembers the file by its digest."""
    write(tmp_path, "two.inp", INP)
    case = (
        "name: c\nbodies:\n  b:\n    mesh: {type: file, path: two.inp}\n    material: {type: elastic, E: 1, nu: 0.3}\n"
        "steps: [{name: s}]\n"
    )
    path = write(tmp_path, "case.yaml", case)
    problem = pr.load(path).problem
    assert problem.bodies["b"].mesh == pr.File(str(tmp_path / "two.inp"))
    from prensa.model.schema import loads

    assert loads(pr.dump(problem)).problem == problem
    write(tmp_path, "two.inp", INP.replace("2.0D0", "3.0D0"))
    with pytest.raises(pr.CaseError, match="has changed since"):
        loads(pr.dump(problem))
    for wrong, words in (
        ("tow.inp", r"case.yaml:4:\d+: .*no such file; the folder has two.inp"),
        ("case.yaml", "export the mesh"),
    ):
        with pytest.raises(pr.CaseError, match=words):
            pr.load(write(tmp_path, "case.yaml", case.replace("two.inp", wrong)))
