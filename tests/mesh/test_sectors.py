"""Sectors of bodies of revolution in any mesh: their axis, and the sides in which they are cut."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import tetrahedra
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.sectors import sector_of
from prensa.system.discretise import discretise

STEEL = pr.J2(210e3, 0.3, pr.Linear(300.0, 500.0))


def mesh_of(mesh: object) -> BrickMesh:
    """What is made of a description."""
    p = pr.Problem("p", space="solid", bodies={"b": pr.Body(mesh, STEEL)}, steps=(pr.Step("on"),))
    return discretise(p).meshes["b"]


def from_file(mesh: object, turn: np.ndarray) -> BrickMesh:
    """The same, turned and moved, by its nodes and elements alone."""
    made = mesh_of(mesh)
    sides = {f"side {k}": made.nodes(name, name).tolist() for k, name in enumerate(made.edges)}
    points = made.points @ turn.T + [3.0, -20.0, 7.0]
    return mesh_of(pr.Bricks(points.tolist(), made.cells.tolist(), sides))


def turned(a: float, b: float) -> np.ndarray:
    """About z and x."""
    about_z = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(b), -np.sin(b)], [0.0, np.sin(b), np.cos(b)]])
    return about_x @ about_z


@pytest.mark.parametrize("angle", [15.0, 60.0, 90.0, 120.0, 180.0])
@pytest.mark.parametrize("bore", [None, 4.0])
def test_a_sector_is_found_whatever_its_place(angle, bore):
    """Its two cuts, and its axis."""
    body = pr.Cylinder(10.0, 8.0, (3, 3, 4), angle=np.radians(angle), **({"bore": bore} if bore else {}))
    for turn in (np.eye(3), turned(0.4, 1.1)):
        found = sector_of(from_file(body, turn))
        assert found is not None
        names = list(mesh_of(body).edges)
        assert {names[int(cut.split()[1])] for cut in found.cuts} == {"base", "cap"}
        np.testing.assert_allclose(np.abs(turn.T @ found.axis.way), [0.0, 1.0, 0.0], atol=1e-6)
        off = turn.T @ (found.axis.place - [3.0, -20.0, 7.0])
        assert np.hypot(off[0], off[2]) < 1e-5


@pytest.mark.parametrize("angle", [200.0, 270.0, 360.0])
def test_more_than_half_a_turn_is_none(angle):
    """Part of no whole."""
    assert sector_of(mesh_of(pr.Cylinder(10.0, 8.0, (3, 3, 8), bore=4.0, angle=np.radians(angle)))) is None


def test_blocks_and_prisms_are_none():
    """A box, a wedge with a flat back, and part of a polygon."""
    assert sector_of(mesh_of(pr.Box((4.0, 2.0, 3.0), (2, 1, 2)))) is None
    box = mesh_of(pr.Box((1.0, 2.0, 3.0), (2, 2, 4)))
    points = box.points.copy()
    points[:, 2] = (points[:, 2] - 1.5) * (0.2 + points[:, 0])  # both flat sides meet, and the back is flat
    sides = {name: box.nodes(name, name).tolist() for name in box.edges}
    assert sector_of(mesh_of(pr.Bricks(points.tolist(), box.cells.tolist(), sides))) is None


def test_a_sector_of_tetrahedra_is_found():
    """Whose triangles are not symmetric about radii."""
    points, cells, _ = tetrahedra((2, 2, 6), (6.0, 8.0, 1.0))
    r, y, angle = 4.0 + points[:, 0], points[:, 1], points[:, 2] * np.radians(70.0)
    sides = {name: np.flatnonzero(np.abs(angle - at) < 1e-9).tolist() for name, at in (("one", 0.0), ("two", np.radians(70.0)))}
    bent = np.column_stack([r * np.cos(angle), r * np.sin(angle), -y])
    found = sector_of(mesh_of(pr.Tetrahedra(points=bent.tolist(), cells=cells.tolist(), boundaries=sides)))
    assert found is not None and set(found.cuts) == {"one", "two"}


def test_half_a_ring_is_cut_in_one_side():
    """Where no two sides meet: in both ends of it, under one name."""
    body = pr.Cylinder(10.0, 8.0, (3, 3, 8), bore=4.0, angle=np.pi)
    made = mesh_of(body)
    cut = np.union1d(made.nodes("base", "b"), made.nodes("cap", "c")).tolist()
    found = sector_of(mesh_of(pr.Bricks(made.points.tolist(), made.cells.tolist(), {"cut": cut})))
    assert found is not None and set(found.cuts) == {"cut"}
    np.testing.assert_allclose(np.abs(found.axis.way), [0.0, 1.0, 0.0], atol=1e-6)
