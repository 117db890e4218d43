"""Meshes as other programs write them: read as meshio and shapely read them, with sides by name, number or place, or refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import shapely

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import Mesh, MeshError, areas

TALL, WIDE = 3.0, 4.0


def grid(nx: int = 4, ny: int = 3, x0: float = 0.0, y0: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and quadrilaterals (m, 4) of a rectangle."""
    x, y = np.meshgrid(x0 + np.linspace(0, WIDE, nx + 1), y0 + np.linspace(0, TALL, ny + 1))
    node = np.arange(x.size).reshape(ny + 1, nx + 1)
    cells = np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1).reshape(-1, 4)
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), cells


def halves(quads: np.ndarray) -> np.ndarray:
    return np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def with_middles(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quadratic cells of linear ones."""
    number: dict[tuple[int, int], int] = {}
    more, out = list(points), []
    for c in cells.tolist():
        middles = []
        for a, b in zip(c, c[1:] + c[:1]):
            key = (min(a, b), max(a, b))
            if key not in number:
                number[key] = len(more)
                more.append(0.5 * (points[a] + points[b]))
            middles.append(number[key])
        out.append(c + middles)
    return np.array(more), np.array(out)


def cells_of(kind: str) -> tuple[np.ndarray, list[tuple[str, np.ndarray]]]:
    points, quads = grid()
    match kind:
        case "quads":
            return points, [("quad", quads)]
        case "triangles":
            return points, [("triangle", halves(quads))]
        case "mixed":
            return points, [("quad", quads[:6]), ("triangle", halves(quads[6:]))]
        case "with lines and points":
            return points, [("vertex", np.array([[0], [4]])), ("line", np.array([[0, 1], [1, 2]])), ("quad", quads)]
        case "clockwise":
            return points, [("quad", quads[:, ::-1])]
        case "at a height":
            return points + np.array([0, 0, 7.0]), [("quad", quads)]
        case "quadratic":
            points, cells = with_middles(points, quads)
            return points, [("quad8", cells)]
        case "quadratic triangles":
            points, cells = with_middles(points, halves(quads))
            return points, [("triangle6", cells)]
        case "unused points":
            return np.vstack([points, [[9, 9, 0]]]), [("quad", quads)]
    raise AssertionError(kind)


KINDS = ("quads", "triangles", "mixed", "with lines and points", "clockwise", "at a height", "quadratic")
KINDS = (*KINDS, "quadratic triangles", "unused points")
FORMATS = {"gmsh22": ".msh", "gmsh": ".msh", "abaqus": ".inp"}


def outline_of(mesh: Mesh) -> Any:
    """The union of the cells, by shapely."""
    corners = mesh.points[mesh.cells[:, : 3 if mesh.cells.shape[1] in (3, 6) else 4]]
    return shapely.union_all([shapely.Polygon(c) for c in corners])


@pytest.mark.parametrize("written", FORMATS)
@pytest.mark.parametrize("kind", KINDS)
def test_meshes_without_names_have_sides_by_place(tmp_path: Path, kind: str, written: str) -> None:
    """Area, extent and the lengths of four sides are those that meshio and shapely find, whatever cells there are."""
    points, blocks = cells_of(kind)
    path = tmp_path / f"plate{FORMATS[written]}"
    options: dict[str, Any] = {} if written == "abaqus" else {"binary": False}
    # Abaqus has no cells of one node, and meshio's writer of version 4.1 takes one kind of cells.
    blocks = blocks if written == "gmsh22" else [b for b in blocks if b[0] not in ("vertex", "line")]
    if written == "gmsh" and len(blocks) > 1:
        blocks = [("triangle", np.vstack([halves(b) if b.shape[1] == 4 else b for _, b in blocks]))]
    meshio.write(path, meshio.Mesh(points, blocks), file_format=written, **options)
    theirs = meshio.read(path)
    rings = [c[: 3 if b.type.startswith("tri") else 4] for b in theirs.cells for c in b.data if b.type[:4] in ("quad", "tria")]
    whole = shapely.union_all([shapely.Polygon(theirs.points[r][:, :2]) for r in rings])
    element = {"triangles": "t3", "mixed": "t3", "quadratic": "q8", "quadratic triangles": "t6"}.get(kind, "q4")
    mesh = mesh_of(pr.File(str(path)), element)
    assert outline_of(mesh).equals_exact(whole.normalize(), 1e-9) or outline_of(mesh).symmetric_difference(whole).area < 1e-9
    assert areas(mesh.points, mesh.cells).sum() == pytest.approx(WIDE * TALL)
    for name, want in {
        "bottom": [(0, 0), (WIDE, 0)],
        "right": [(WIDE, 0), (WIDE, TALL)],
        "top": [(WIDE, TALL), (0, TALL)],
        "left": [(0, TALL), (0, 0)],
    }.items():
        x = mesh.points[mesh.nodes(name)]
        assert [tuple(x[0]), tuple(x[-1])] == want, "in order, body on the left"
        assert shapely.LineString(x).length == pytest.approx(shapely.LineString(want).length)
    assert mesh.points[mesh.corners["top-left"]].tolist() == [0, TALL]


def test_gmsh_curves_and_points_have_names_by_their_numbers(tmp_path: Path) -> None:
    """Without physical groups the geometry of the drawing names sides; with them it does not."""
    points, quads = grid()
    lines = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    geometry = [np.array([5]), np.full(4, 7), np.full(len(quads), 1)]
    for physical, curve in ((0, True), (3, False)):
        tags = {
            "gmsh:geometrical": geometry,
            "gmsh:physical": [np.array([0]), np.full(4, physical), np.full(len(quads), 0)],
        }
        blocks = [("vertex", np.array([[0]])), ("line", lines), ("quad", quads)]
        path = tmp_path / "plate.msh"
        meshio.write(path, meshio.Mesh(points, blocks, cell_data=tags), file_format="gmsh22", binary=False)
        mesh = mesh_of(pr.File(str(path)))
        assert ("curve-7" in mesh.edges, "point-5" in mesh.corners, "3" in mesh.edges) == (curve, curve, not curve)
        name = "curve-7" if curve else "3"
        assert mesh.points[mesh.nodes(name)].tolist() == [[x, 0.0] for x in range(5)]
        assert mesh.points[mesh.nodes("bottom")].tolist() == mesh.points[mesh.nodes(name)].tolist()


PLAIN = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
0 1 2 0
3 1 0 0 1 1 0 0 0
1 0 0 0 1 1 0 0 0
2 1 0 0 2 1 0 0 0
$EndEntities
$Nodes
1 6 1 6
2 1 0 6
1
2
3
4
5
6
0 0 0
1 0 0
2 0 0
0 1 0
1 1 0
2 1 0
$EndNodes
$Elements
3 3 1 3
1 3 1 1
1 2 5
2 1 3 1
2 1 2 5 4
2 2 3 1
3 2 3 6 5
$EndElements
"""


def test_surfaces_by_number_are_parts_and_their_common_curve_is_a_side_of_both(tmp_path: Path) -> None:
    """Two materials of one file without physical groups."""
    path = tmp_path / "two.msh"
    path.write_text(PLAIN)
    one, two = (mesh_of(pr.File(str(path), part=f"surface-{k}")) for k in (1, 2))
    assert one.points[one.nodes("curve-3")].tolist() == [[1, 0], [1, 1]]
    assert two.points[two.nodes("curve-3")].tolist() == [[1, 1], [1, 0]]
    whole = mesh_of(pr.File(str(path)))
    assert len(whole.cells) == 2 and "'part' takes some of 'surface-1', 'surface-2'" in "".join(whole.notes)
    with pytest.raises(MeshError, match=r"no part 'surface-3'; did you mean 'surface-[12]'"):
        mesh_of(pr.File(str(path), part="surface-3"))


def parts_without_curves(folder: Path) -> str:
    """Two physical surfaces and no curves, as gmsh saves them where only surfaces are in groups."""
    points, quads = grid()
    tags = {"gmsh:physical": [np.where(np.arange(len(quads)) % 4 < 2, 1, 2)], "gmsh:geometrical": [np.ones(len(quads), int)]}
    names = {"core": np.array([1, 2]), "skin": np.array([2, 2])}
    path = folder / "two.msh"
    mesh = meshio.Mesh(points, [("quad", quads)], cell_data=tags, field_data=names)
    meshio.write(path, mesh, file_format="gmsh22", binary=False)
    return str(path)


def test_where_two_materials_meet_is_a_side_of_both(tmp_path: Path) -> None:
    """Where the file has no curve the interface is found from the cells; the two are tied along it, and pull alike."""
    path = parts_without_curves(tmp_path)
    core = mesh_of(pr.File(path, part="core"))
    assert core.points[core.nodes("interface-skin")][:, 0].tolist() == [2.0] * 4
    soft, steps = pr.Elastic(E=1000, nu=0.0), (pr.Step("pull", loads={"skin.right": pr.Load(pressure=-10)}),)
    both = {name: pr.Body(pr.File(path, part=name), soft, element="q4") for name in ("core", "skin")}
    fixed = {"core.left": pr.Fixed(x="held"), "core.bottom": pr.Fixed(y="held"), "skin.bottom": pr.Fixed(y="held")}
    tied = pr.Problem(
        "tied", both, steps, fixed=fixed, kinematics="small", space="plane strain",
        ties=(pr.Tie(slave="core.interface-skin", master="skin.interface-core"),),
    )  # fmt: skip
    (*_, last) = pr.solve(tied)
    assert np.ptp(last.bodies["skin"].x[:, 0]) + np.ptp(last.bodies["core"].x[:, 0]) == pytest.approx(WIDE * 1.01)


def plate(outline: list[tuple[float, float]], folder: Path) -> Mesh:
    """A fan of triangles round the middle of an outline, in an Abaqus deck."""
    ring = np.array(outline)
    points = np.vstack([ring, ring.mean(axis=0)])
    k = np.arange(len(ring))
    fan = np.column_stack([k, np.roll(k, -1), 0 * k + len(k)])
    meshio.write(folder / "a.inp", meshio.Mesh(np.column_stack([points, 0 * points[:, 0]]), [("triangle", fan)]))
    return mesh_of(pr.File(str(folder / "a.inp")), "t3")


def half_disc() -> list[tuple[float, float]]:
    return [(float(np.cos(t)), float(np.sin(t))) for t in np.linspace(0, np.pi, 19)]


@pytest.mark.parametrize(
    ("outline", "sides"),
    [
        (half_disc(), {"bottom": 2.0, "top": 18 * 2 * np.sin(np.pi / 36)}),  # corners are left and right
        ([(0, 0), (4, 0), (3, 2), (1, 2)], {"bottom": 4, "top": 2, "left": 5**0.5, "right": 5**0.5}),
        ([(0, 0), (2, -2), (4, 0), (2, 2)], {}),  # on its tip: nothing lies below alone
        ([(float(np.cos(t)), float(np.sin(t))) for t in np.linspace(0, 2 * np.pi, 24, endpoint=False)], {}),
    ],
    ids=["half a disc", "trapezium", "square on its tip", "disc"],
)
def test_sides_by_place_are_what_lies_or_looks_that_way_alone(tmp_path: Path, outline: Any, sides: dict[str, float]) -> None:
    """The round of a dome is its top, a disc has no sides; what is missing is said."""
    mesh = plate(outline, tmp_path)
    lengths = {
        name: sum(float(np.hypot(*(mesh.points[b] - mesh.points[a]))) for a, b in e.tolist()) for name, e in mesh.edges.items()
    }
    assert lengths == pytest.approx(sides)
    missing = [n for n in ("bottom", "right", "top", "left") if n not in sides]
    assert ("could not be found by place" in "".join(mesh.notes)) == bool(missing)


def test_both_feet_are_the_bottom(tmp_path: Path) -> None:
    """All stretches that lie at the lowest place."""
    points, quads = grid()
    x, y, _ = points[quads].mean(axis=1).T
    meshio.write(tmp_path / "a.inp", meshio.Mesh(points, [("quad", quads[(y > 1) | (x < 1) | (x > 3)])]))
    mesh = mesh_of(pr.File(str(tmp_path / "a.inp")))
    assert mesh.points[mesh.nodes("bottom")].tolist() in ([[0, 0], [1, 0], [3, 0], [4, 0]], [[3, 0], [4, 0], [0, 0], [1, 0]])
    assert {name: len(e) for name, e in mesh.edges.items()} == {"bottom": 2, "right": 3, "top": 4, "left": 3}


def test_cells_that_overlap_are_refused_before_their_outline_is_walked(tmp_path: Path) -> None:
    """A triangle written twice under two labels, turned over."""
    with pytest.raises(MeshError, match="overlap"):
        plate([(0, 0), (1, 0), (1.0, 0.5), (3, 0.5), (3, 0), (4, 0), (4, 2), (0, 2)], tmp_path)


def test_round_corners_are_cut_where_curves_end(tmp_path: Path) -> None:
    """A plate with round corners has no corner; gmsh's curves part its sides from the rounds."""
    ring, curve = [], []
    for number, (cx, cy, start) in enumerate([(3, 1, -90), (3, 3, 0), (1, 3, 90), (1, 1, 180)]):
        for k in range(6):
            t = np.radians(start + 18 * k)
            ring.append((cx + np.cos(t), cy + np.sin(t)))
            curve.append(2 * number + (k == 5))  # the last piece is the straight side to the next round
    k, points = np.arange(len(ring)), np.array([*ring, (2, 2)])
    lines = np.column_stack([k, np.roll(k, -1)])
    blocks = [("line", lines), ("triangle", np.column_stack([lines, 0 * k + len(k)]))]
    tags = {"gmsh:geometrical": [np.array(curve) + 1, np.ones(len(k), int)], "gmsh:physical": [0 * k, 0 * k]}
    mesh = meshio.Mesh(np.column_stack([points, 0 * points[:, 0]]), blocks, cell_data=tags)
    meshio.write(tmp_path / "round.msh", mesh, file_format="gmsh22", binary=False)
    read = mesh_of(pr.File(str(tmp_path / "round.msh")), "t3")
    for name, at in (("bottom", (0.0, 0.0)), ("top", (4.0, 4.0))):
        assert read.points[read.nodes(name)][:, 1] == pytest.approx(at)
        assert sorted(read.points[read.nodes(name)][:, 0]) == pytest.approx([1, 3])


def test_an_unknown_side_is_answered_with_those_there_are_and_where_they_come_from(tmp_path: Path) -> None:
    """Names of the file, by number and by place."""
    path = tmp_path / "two.msh"
    path.write_text(PLAIN)
    mesh = mesh_of(pr.File(str(path), part="surface-1"))
    with pytest.raises(MeshError) as caught:
        mesh.nodes("die", "block.die")
    words = str(caught.value)
    for part in (
        "'block.die': unknown boundary 'die'", "two.msh names no sides (names are its physical curves and points)",
        "'curve-3' are its curves", "found by place: 'bottom' (x 0 … 1, y 0), 'right' (x 1, y 0 … 1)",
    ):  # fmt: skip
        assert part in words
    with pytest.raises(MeshError, match="did you mean 'curve-3'"):
        mesh.nodes("curve-33")


def test_a_surface_is_not_the_mesh_of_a_body(tmp_path: Path) -> None:
    """An STL file has no volume, whatever it is converted to: it is a tool."""
    path = tmp_path / "plate.stl"
    path.write_text("other\n")
    with pytest.raises(pr.CaseError, match=r"is an STL file, a surface: for tools \(type: stl\); a body needs elements"):
        pr.File(str(path))


MESHIO = "meshio convert --ascii --output-format gmsh"


@pytest.mark.parametrize(("ending", "by"), [(".xdmf", MESHIO), (".unv", "gmsh"), (".med", MESHIO)])
def test_other_formats_are_refused_with_how_to_convert_them(tmp_path: Path, ending: str, by: str) -> None:
    """The ending decides before anything is read; what the remedy makes is read."""
    path = tmp_path / f"plate{ending}"
    path.write_text("other\n")
    with pytest.raises(pr.CaseError, match=rf": {by} plate\S* .*plate\.msh"):
        pr.File(str(path))


def test_the_remedy_for_other_formats_makes_a_mesh(tmp_path: Path) -> None:
    """What `meshio convert` writes of a VTU file is read, its sides by place."""
    from meshio._cli import main

    points, quads = grid()
    meshio.write(tmp_path / "plate.vtu", meshio.Mesh(points, [("quad", quads)]))
    main(["convert", "--ascii", "--output-format", "gmsh", str(tmp_path / "plate.vtu"), str(tmp_path / "plate.msh")])
    assert len(mesh_of(pr.File(str(tmp_path / "plate.msh"))).nodes("bottom")) == 5


def test_a_mesh_in_space_is_refused_with_its_element(tmp_path: Path) -> None:
    """Tetrahedra of a solid, and a surface that is not plane."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    solid, steep = [("tetra", [[0, 1, 2, 3]])], [("triangle", [[0, 1, 3]])]
    for cells, words in ((solid, "type 4.*three-dimensional"), (steep, "plane of x and y")):
        meshio.write(tmp_path / "a.msh", meshio.Mesh(corners, cells), file_format="gmsh22", binary=False)
        with pytest.raises(MeshError, match=words):
            mesh_of(pr.File(str(tmp_path / "a.msh")), "t3")
    meshio.write(tmp_path / "a.msh", meshio.Mesh(corners, [("triangle", [[0, 1, 2]])]), file_format="gmsh22", binary=True)
    with pytest.raises(MeshError, match="binary; save it as text"):
        mesh_of(pr.File(str(tmp_path / "a.msh")), "t3")
