"""Ten-node tetrahedra of gmsh, Abaqus and VTK files: the order of their nodes, sides, what is refused, a body that is pressed."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import block_of, respond, tetrahedra
from prensa.mesh.brick_checks import tetrahedron_jacobians
from prensa.mesh.faces import enclosed_volume, face_areas
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import MeshError
from prensa.mesh.quality import quality
from prensa.system.discretise import discretise

WRITTEN = Path(__file__).parents[1] / "importers" / "written"
SIDES = {"quarter10.msh": ("lower", "upper", "plane x", "plane z"), "quarter10.inp": ("lower", "upper", "plane_x", "plane_z")}
ELASTIC = pr.Elastic(1000.0, 0.3)


def solid(path: Path, **given):
    return mesh_of(pr.File(str(path), **given), dimension=3)


def saved(path: Path, X, cells, kind: str = "tetra10") -> Path:
    """A file by meshio, an independent writer, which has the nodes in the order of VTK."""
    form = {".msh": {"file_format": "gmsh22", "binary": False}}.get(path.suffix, {})
    if path.name == "four.msh":
        form = {"file_format": "gmsh", "binary": False}
    meshio.write(path, meshio.Mesh(X, [(kind, np.asarray(cells))]), **form)
    return path


@pytest.mark.parametrize("name", ["two.msh", "four.msh", "a.inp", "a.vtu", "a.vtk"])
def test_a_quadratic_field_is_exact_on_what_another_program_has_written(tmp_path: Path, name: str) -> None:
    """Pure bending, whose displacements are quadratic, leaves no force on inner nodes of a skew mesh, half of it left-handed."""
    X, cells, _ = tetrahedra((2, 2, 2), (2.0, 1.0, 1.0), 0.2)
    mirrored = cells[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    mesh = solid(saved(tmp_path / name, X, np.where((np.arange(len(cells)) % 2 == 0)[:, None], cells, mirrored)))
    X, (x, y, z) = mesh.points, mesh.points.T
    block, pattern = block_of(X, mesh.cells, "t10", ELASTIC, "small")
    bent = 1e-3 * np.stack([x * y, -0.5 * (x**2 + 0.3 * (y**2 - z**2)), -0.3 * y * z], axis=1)
    r, _, _ = respond(block, pattern, X, bent, block.undeformed)
    inner = np.setdiff1d(np.arange(len(X)), mesh.boundary)
    assert len(inner) and np.abs(r[inner]).max() <= 1e-12 * np.abs(r).max()
    assert enclosed_volume(X, mesh.boundary) == pytest.approx(2.0, rel=1e-13)
    assert {"left", "right", "bottom", "top", "back", "front"} == set(mesh.edges)
    assert len(mesh.nodes("top")) == 25


@pytest.mark.parametrize("name", SIDES)
def test_curved_tetrahedra_of_gmsh(name: str) -> None:
    """Written by gmsh 4.15.2: cells as meshio reads them, areas and volume of a cylinder, to the error of quadratic faces."""
    theirs = meshio.read(WRITTEN / "quarter10.msh")
    cells = np.concatenate([block.data for block in theirs.cells if block.type == "tetra10"])
    mesh = solid(WRITTEN / name)
    assert len(mesh.cells) == len(cells)
    ours, others = (x[np.lexsort(x.mean(axis=1).round(6).T)] for x in (mesh.points[mesh.cells], theirs.points[cells]))
    assert np.abs(ours - others).max() <= 1e-9
    assert enclosed_volume(mesh.points, mesh.boundary) == pytest.approx(np.pi * 25 * 15, rel=1e-4)
    areas = {side: face_areas(mesh.points, mesh.edges[side]).sum() for side in (*SIDES[name], "skin", "back")}
    assert list(areas.values()) == pytest.approx([25 * np.pi, 25 * np.pi, 150, 150, 75 * np.pi, 150], rel=2e-4)
    assert 0.2 < quality(mesh).jacobian.min() < quality(mesh).jacobian.max() < 1.0


@pytest.mark.parametrize("name", SIDES)
def test_a_quarter_of_a_cylinder_of_tetrahedra_is_pressed_as_a_bar(name: str) -> None:
    """Without friction the force is E ε A, but for a third of the area at each middle of curved sides; the element follows."""
    lower, upper, x, z = SIDES[name]
    problem = pr.Problem(
        "bar", space="solid", kinematics="small", bodies={"b": pr.Body(pr.File(str(WRITTEN / name)), ELASTIC)},
        tools={"plate": pr.Plane(touching=f"b.{upper}")},
        contacts=(pr.Contact(f"b.{upper}", "plate", enforcement=pr.Augmented()),),
        fixed={f"b.{lower}": "y", f"b.{x}": "x", f"b.{z}": "z"},
        steps=(pr.Step("press", move={"plate": pr.Motion(y=-0.15)}, increments=1),),
    )  # fmt: skip
    system = discretise(problem)
    assert system.problem.element_name("b") == "t10"
    *_, last = pr.solve(problem)
    area = face_areas(system.X, system.meshes["b"].edges[upper]).sum()
    assert last.force("plate").y == pytest.approx(10.0 * area, rel=1e-4)


def test_sides_of_decks(tmp_path: Path) -> None:
    """S1 … S4 are opposite to nodes 4, 3, 1, 2; a set of nodes is the faces whose corners it has."""
    X, cells, _ = tetrahedra((1, 1, 1), (1.0, 1.0, 1.0))
    rows = "\n".join(", ".join(map(str, [e + 1, *(np.array(c) + 1)])) for e, c in enumerate(cells))
    nodes = "\n".join(f"{k + 1}, {a}, {b}, {c}" for k, (a, b, c) in enumerate(X))
    deck = f"*NODE\n{nodes}\n*ELEMENT, TYPE=C3D10M, ELSET=ALL\n{rows}\n"
    for side, opposite in zip(("S1", "S2", "S3", "S4"), (3, 2, 0, 1)):
        (tmp_path / "a.inp").write_text(f"{deck}*ELSET, ELSET=ONE\n1\n*SURFACE, NAME=SKIN\n1, {side}\n")
        mesh = solid(tmp_path / "a.inp", part="ONE")
        ((*corners, _, _, _),) = mesh.edges["SKIN"]
        assert sorted(mesh.points[corners].tolist()) == sorted(X[np.delete(cells[0, :4], opposite)].tolist())
    top = ", ".join(str(k + 1) for k in range(8) if X[k, 1] == 1.0)
    (tmp_path / "a.inp").write_text(f"{deck}*NSET, NSET=UPPER\n{top}\n*NSET, NSET=ONE\n1\n")
    mesh = solid(tmp_path / "a.inp")
    assert face_areas(mesh.points, mesh.edges["UPPER"]).sum() == pytest.approx(1.0)
    assert mesh.corners == {"ONE": 0}


def test_what_tetrahedra_are_refused_for(tmp_path: Path) -> None:
    """Two kinds in a body, sides bent over, another element, open meshes: with the file, the element and what to do."""
    X, cells, _ = tetrahedra((1, 1, 1), (1.0, 1.0, 1.0))
    with pytest.raises(MeshError, match=r"a\.msh: line \d+: element 1 is one of tetrahedra of 4 nodes, .* second order"):
        solid(saved(tmp_path / "a.msh", X, cells[:, :4], "tetra"))
    bent = X.copy()
    middle = cells[0, 4]
    bent[middle] += 0.9 * (X[cells[0, 3]] - X[middle])
    with pytest.raises(MeshError, match=r"a\.vtu: element \d near .* is bent over by a node in the middle of a side: .*shorter"):
        solid(saved(tmp_path / "a.vtu", bent, cells))
    apart = np.concatenate([X, X + np.eye(3)[0]]), np.concatenate([cells, cells + len(X)])
    with pytest.raises(MeshError, match=r"at the same place, .* open between their elements; merge them"):
        solid(saved(tmp_path / "b.vtu", *apart))
    assert len(solid(tmp_path / "b.vtu", merge=True).boundary) == 20
    both = meshio.Mesh(np.concatenate([X, X[:8] + 5.0]), [("tetra10", cells), ("hexahedron", [np.arange(8) + len(X)])])
    meshio.write(tmp_path / "c.vtu", both)
    with pytest.raises(MeshError, match=r"of tetrahedra of 10 nodes, element 6 of hexahedra: a body has elements of one kind"):
        solid(tmp_path / "c.vtu")
    file = saved(tmp_path / "d.vtu", X, cells)
    body = {"b": pr.Body(pr.File(str(file)), ELASTIC, "h8_fbar")}
    with pytest.raises(MeshError, match=r"bodies\.b\.mesh: 'h8_fbar' does not fit the mesh, which has tetrahedra; use 't10'"):
        discretise(pr.Problem("b", space="solid", bodies=body, tools={}, steps=(pr.Step("rest"),)))
    assert (tetrahedron_jacobians(X[cells]) > 0.0).all()
