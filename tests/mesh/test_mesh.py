"""Meshes of every kind of cells: they fill the body, their boundaries walk round it, and impossible ones are refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import (
    Mesh,
    MeshError,
    areas,
    boundary_edges,
    coincident,
    meshed_like,
    oriented,
    segments,
    within,
)

KINDS = {"t3": 3, "q4": 4, "t6": 6, "q8": 8}
RECTANGLE = pr.Rectangle(size=(3.0, 2.0), n=(4, 3), grade="top-left")


@pytest.mark.parametrize("element", KINDS)
def test_cells_of_every_kind_fill_the_body_and_their_boundaries_walk_round_it(element):
    """A rectangle in T3, Q4, T6, Q8 has its area, and its four boundaries are its outline, the body on their left."""
    mesh = mesh_of(RECTANGLE, element)
    assert mesh.cells.shape[1] == KINDS[element]
    assert areas(mesh.points, mesh.cells).sum() == pytest.approx(6.0, rel=1e-13)
    pieces = np.concatenate([segments(e) for e in mesh.edges.values()])
    a, b = mesh.points[pieces[:, 0]], mesh.points[pieces[:, 1]]
    assert 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() == pytest.approx(6.0, rel=1e-13)
    outline = {tuple(e) for e in segments(boundary_edges(mesh.cells)).tolist()}
    assert outline == {tuple(e) for e in pieces.tolist()}
    x = mesh.points[mesh.nodes("top")][:, 0]
    assert (np.diff(x) < 0).all() and x[0] == 3.0 and x[-1] == 0.0


@pytest.mark.parametrize("element", ["t6", "q8"])
def test_mid_side_nodes_lie_half_way_between_their_ends(element):
    """In a straight mesh the node of a side is its middle, for every side of every cell."""
    mesh = mesh_of(RECTANGLE, element)
    c = mesh.cells.shape[1] // 2
    corner = mesh.points[mesh.cells[:, :c]]
    assert np.allclose(mesh.points[mesh.cells[:, c:]], 0.5 * (corner + np.roll(corner, -1, axis=1)), rtol=0, atol=1e-14)


def test_a_free_corner_is_cut_by_its_diagonal():
    """No triangle of a split rectangle has all its nodes on two supported sides."""
    mesh = mesh_of(pr.Rectangle(size=(1.0, 1.0), n=(2, 2)), "t3")
    outline = np.isin(mesh.cells, boundary_edges(mesh.cells)).all(axis=1)
    assert not outline.any()


def test_the_element_decides_what_is_made_of_given_cells():
    """Q8 cells given by arrays keep their curved mid-side nodes in Q8 and T6 and lose them in Q4 and T3."""
    points = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2.3, 1), (1, 2), (0, 1))
    cells = pr.Points(points, cells=(tuple(range(8)),), boundaries={"right": (1, 2), "origin": (0,)})
    for element, count in (("q8", 8), ("q4", 4), ("t3", 4), ("t6", 9)):
        mesh = mesh_of(cells, element)
        assert mesh.cells.shape[1] == KINDS[element] and len(mesh.points) == count
        middle = [2.3, 1.0] in mesh.points.tolist()
        assert middle == (element in ("q8", "t6"))
        assert mesh.points[mesh.corners["origin"]].tolist() == [0, 0]
        assert mesh.points[mesh.nodes("right")[[0, -1]]].tolist() == [[2, 0], [2, 2]]


def test_triangles_do_not_become_quadrilaterals():
    """The refusal says what to do instead."""
    mesh = pr.Points(((0, 0), (1, 0), (0, 1)), ((0, 1, 2),), {})
    with pytest.raises(MeshError, match="triangles and the element is Q4; use element 't6'"):
        mesh_of(mesh, "q4_fbar")


SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))


@pytest.mark.parametrize(
    ("points", "cells", "words"),
    [
        (SQUARE, ((0, 3, 2, 1),), "element 0 near .0.5, 0.5. has area -1"),
        ((*SQUARE, (5, 5)), ((0, 1, 2, 3),), r"node 4 at \[5.0, 5.0\] belongs to no element"),
        (SQUARE, ((0, 1, 2, 4),), "element 0 refers to a node outside 0 … 3"),
        (SQUARE, ((0, 1, 2, 2),), "names a node twice"),
        ((*SQUARE, (0.5, 2)), ((0, 1, 2, 3), (0, 1, 4, 3)), "elements 0 and 1 .* overlap"),
        ((*SQUARE, (1, 0), (2, 0), (2, 1), (1, 1)), ((0, 1, 2, 3), (4, 5, 6, 7)), "nodes 1 and 4 are at the same place"),
        (
            (*SQUARE, (2, 0), (2, 0.5), (1, 0.5), (2, 1)),
            ((0, 1, 2, 3), (1, 4, 5, 6), (6, 5, 7, 2)),
            "node 6 at .1, 0.5. hangs in the middle of the side between nodes 1 and 2",
        ),
    ],
)  # fmt: skip
def test_an_impossible_mesh_is_refused_by_element_node_and_place(points, cells, words):
    """Clockwise, unused, unknown, repeated, overlapping, coincident and hanging: each is named with its place."""
    with pytest.raises(MeshError, match=words):
        mesh_of(pr.Points(points, cells, {}), "q4")


@pytest.mark.parametrize("element", KINDS)
def test_cells_that_go_clockwise_are_turned_round(element):
    """Mirrored cells, turned round, make a mesh again, mid-side nodes in their places."""
    mesh = mesh_of(RECTANGLE, element)
    mirrored = mesh.points * (-1.0, 1.0)
    cells = oriented(mirrored, mesh.cells)
    again = Mesh(mirrored, cells, {})
    assert areas(again.points, again.cells).sum() == pytest.approx(6.0, rel=1e-13)
    if cells.shape[1] > 4:
        c = cells.shape[1] // 2
        corner = mirrored[cells[:, :c]]
        assert np.allclose(mirrored[cells[:, c:]], 0.5 * (corner + np.roll(corner, -1, axis=1)), rtol=0, atol=1e-14)


@pytest.mark.parametrize("strips", [7, 2**20])
def test_neighbours_are_those_of_a_tree(monkeypatch, strips):
    """All points in each circle, none else, in order of the circles, however many are looked through at once."""
    monkeypatch.setattr("prensa.mesh.mesh.POINTS_AT_ONCE", strips)
    rng = np.random.default_rng(5)
    grid = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0)), axis=-1).reshape(-1, 2)
    points = np.concatenate([grid, rng.uniform(0, 5, (40, 2)), grid[::4] + 1e-9])
    centres, radii = rng.uniform(-1, 6, (30, 2)), rng.uniform(0, 2, 30)
    i, j = within(points, centres, radii)
    expected = cKDTree(points).query_ball_point(centres, radii)
    assert (np.diff(i) >= 0).all()
    assert [sorted(j[i == k].tolist()) for k in range(30)] == [sorted(e) for e in expected]
    pairs = set(zip(*(x.tolist() for x in coincident(points, 1e-7)), strict=True))
    assert pairs == {(k, 70 + k // 4) for k in range(0, 30, 4)}
    assert len(within(points, np.array([[50.0, 50.0]]), np.ones(1))[0]) == 0


def test_cells_of_two_kinds_are_refused_with_the_remedy():
    """A quadrilateral beside a triangle belongs to another body."""
    with pytest.raises(ValueError, match=r"same number of nodes .* make two bodies"):
        pr.Points((*SQUARE, (2, 0)), ((0, 1, 2, 3), (1, 4, 2)), {})
    with pytest.raises(ValueError, match="cell 1 has 5 nodes"):
        pr.Points(SQUARE, ((0, 1, 2, 3), (1, 4, 2, 0, 3)), {})


@pytest.mark.parametrize(
    ("made", "beside"),
    [
        (pr.Rectangle(size=(4.0, 3.0), n=(5, 3)), pr.Rectangle(size=(4.00004, 3.0), n=(5, 3))),
        (pr.Annulus(inner=3.0, outer=5.0, n=(8, 3)), pr.Annulus(inner=3.00003, outer=5.0, n=(8, 3))),
        (pr.Disc(radius=4.0, n=(4, 2)), pr.Disc(radius=4.00004, n=(4, 2))),
    ],
    ids=lambda mesh: type(mesh).__name__.lower(),
)
def test_a_mesh_beside_a_checked_one_is_that_of_its_description(made, beside):
    """Its points, cells, boundaries and corners are those without the other, which stays as it is."""
    first, alone = mesh_of(made), mesh_of(beside)
    was = first.points.copy()
    found = mesh_of(beside, beside=first)
    np.testing.assert_array_equal(found.points, alone.points)
    np.testing.assert_array_equal(found.cells, alone.cells)
    assert found.edges.keys() == alone.edges.keys() and found.corners == alone.corners
    for name in alone.edges:
        np.testing.assert_array_equal(found.nodes(name), alone.nodes(name))
    np.testing.assert_array_equal(first.points, was)
    assert not np.array_equal(found.points, was)


def test_a_mesh_that_joins_other_nodes_than_the_one_beside_is_checked():
    """An element that goes clockwise is reported, whatever stands beside."""
    good = mesh_of(pr.Rectangle(size=(1.0, 1.0), n=(1, 1)))
    with pytest.raises(MeshError, match="counter-clockwise"):
        meshed_like(good, good.points, good.cells[:, ::-1], good.edges, good.corners)
