"""Meshes within outlines: areas, names, fillets, holes, and what makes none."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import MeshError, areas, boundary_edges, segments
from prensa.mesh.triangulate import TriangulationError

L = ((0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0))
NAMES = ("bottom", "right", "step", "step", "top", "left")


def area_within(mesh: object) -> float:
    """Area of the polygon of all nodes of the outlines."""
    x = mesh.points[segments(boundary_edges(mesh.cells))]  # type: ignore[attr-defined]
    return float(0.5 * (x[:, 0, 0] * x[:, 1, 1] - x[:, 1, 0] * x[:, 0, 1]).sum())


@pytest.mark.parametrize("turned", [False, True])
def test_sides_have_their_names_either_way_round(turned: bool) -> None:
    """An L with named sides, its points in either order: the area, and each boundary where its side is."""
    points, names = (L[::-1], (*NAMES[-2::-1], NAMES[-1])) if turned else (L, NAMES)
    mesh = mesh_of(pr.Outline(points=points, size=0.3, sides=names), "t6")
    assert area_within(mesh) == pytest.approx(6.0)
    assert areas(mesh.points, mesh.cells).min() > 0
    assert mesh.points[mesh.nodes("bottom"), 1] == pytest.approx(0.0)
    assert mesh.points[mesh.nodes("left"), 0] == pytest.approx(0.0)
    step = mesh.points[mesh.nodes("step")]
    assert (np.isclose(step[:, 0], 1.0) | np.isclose(step[:, 1], 1.0)).all()
    assert sum(len(e) for e in mesh.edges.values()) == len(boundary_edges(mesh.cells))
    length = np.hypot(*np.diff(mesh.points[mesh.edges["bottom"][:, :2]], axis=1)[:, 0].T)
    assert length.max() < 0.4


def test_fillets_are_circles() -> None:
    """A square with rounded corners: its area to 1e-5, all nodes of a corner on the arc, smaller elements there."""
    square = pr.Outline(points=((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)), size=1.0, fillet=0.5)
    mesh = mesh_of(square, "t6")
    nodes = np.unique(boundary_edges(mesh.cells))
    corner = mesh.points[nodes][(mesh.points[nodes] > 3.5).all(axis=1)]
    assert len(corner) >= 5
    assert np.hypot(*(corner - 3.5).T) == pytest.approx(0.5, rel=2e-3)
    assert area_within(mesh) == pytest.approx(16 - (4 - np.pi) * 0.25, rel=1e-3)


def test_holes_are_left_out() -> None:
    """A plate with two holes: its area, and boundaries of their own; also as linear triangles."""
    holes = (((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)), ((3.0, 3.0), (3.5, 3.0), (3.25, 3.5)))
    plate = pr.Outline(points=((0.0, 0.0), (5.0, 0.0), (5.0, 5.0), (0.0, 5.0)), size=0.5, holes=holes)
    for element in ("t6", "t3"):
        mesh = mesh_of(plate, element)
        assert area_within(mesh) == pytest.approx(25 - 1 - 0.125)
        assert set(mesh.edges) == {"outline", "hole-1", "hole-2"}
        assert np.ptp(mesh.points[mesh.nodes("hole-1")], axis=0) == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize("seed", range(20))
def test_long_narrow_corners(seed: int) -> None:
    """Stars of few nodes, whose sides are none of a Delaunay triangulation of these (MMG alone looks for them for ever)."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(5, 14))
    way, far = 2 * np.pi * (np.arange(n) + rng.uniform(0, 0.5, n)) / n, rng.uniform(0.3, 4.0, n)
    x = np.column_stack([far * np.cos(way), far * np.sin(way)])
    mesh = mesh_of(pr.Outline(tuple((a, b) for a, b in x.tolist()), size=2.0), "t6")
    area = 0.5 * float((x[:, 0] * np.roll(x[:, 1], -1) - x[:, 1] * np.roll(x[:, 0], -1)).sum())
    assert area_within(mesh) == pytest.approx(area, rel=1e-9)
    assert areas(mesh.points, mesh.cells).min() > 0


def test_a_hole_that_is_a_splinter() -> None:
    """One that MMG alone never ends with."""
    plate = pr.Outline(((2, 0), (6, 0), (6, 8), (2, 8)), 2.0, holes=(((3, 1), (4, 3), (4, 4)),))
    assert area_within(mesh_of(plate, "t6")) == pytest.approx(32 - 0.5)


def test_a_plate_with_a_hole_in_tension() -> None:
    """It is solved as any other body: the force of its ends is in balance, and the hole opens."""
    hole = tuple((1.5 + 0.5 * np.cos(a), 1.5 + 0.5 * np.sin(a)) for a in np.arange(16) * np.pi / 8)
    square = ((0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0))
    mesh = pr.Outline(square, 0.4, sides=("bottom", "right", "top", "left"), holes=(hole,))
    problem = pr.Problem(
        "plate", {"plate": pr.Body(mesh, pr.Elastic(E=1000.0, nu=0.3), "t6")}, (pr.Step("pull", increments=1),),
        fixed={"plate.bottom": {"x": "held", "y": "held"}, "plate.top": {"y": 0.003}}, kinematics="small",
    )  # fmt: skip
    last = list(pr.solve(problem))[-1]
    assert last.supports["plate.top"].y == pytest.approx(-last.supports["plate.bottom"].y)
    whole = 1000.0 / (1 - 0.3**2) * 0.001 * 3.0
    assert 0.7 * whole < last.supports["plate.top"].y < whole


def holed(*holes: tuple[tuple[float, float], ...]) -> pr.Outline:
    """A square of 2 by 2 with holes."""
    return pr.Outline(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)), 0.4, holes=holes)


IN_ANOTHER = ((0.5, 0.5), (1.5, 0.5), (1.0, 1.5)), ((0.8, 0.6), (1.2, 0.6), (1.0, 1.0))
CROSSED = ((0.2, 0.9), (1.8, 0.9), (1.8, 1.1), (0.2, 1.1)), ((0.9, 0.2), (1.1, 0.2), (1.1, 1.8), (0.9, 1.8))
WRONG = {
    "crossing": (pr.Outline(((0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)), 0.1), "crosses itself"),
    "fillet": (pr.Outline(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)), 0.1, fillet=1.5), "does"),
    "hole beyond the outline": (holed(((1.0, 1.0), (9.0, 1.0), (1.0, 1.5))), r"point 1 of hole-1, \(9, 1\), lies outside"),
    "hole elsewhere": (holed(((7.0, 1.0), (8.0, 1.0), (7.0, 2.0))), "point 0 of hole-1, .*outside of the outline"),
    "hole in a hole": (holed(*IN_ANOTHER), r"point 0 of hole-2, \(0\.8, 0\.6\), lies within hole-1"),
    "holes that cross": (holed(*CROSSED), "crosses or touches itself, or a hole, near"),
    "hole on the outline": (holed(((0.0, 0.5), (1.0, 0.5), (1.0, 1.0))), "touches itself, or a hole|outside"),
    "quadrilaterals": (pr.Outline(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0)), 0.5), "triangle"),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_makes_no_mesh_is_reported(what: str) -> None:
    """In words."""
    outline, words = WRONG[what]
    with pytest.raises((MeshError, TriangulationError), match=words):
        mesh_of(outline, "q4" if what == "quadrilaterals" else "t6")


def test_names_that_do_not_fit_and_sizes_beyond_reason_are_refused() -> None:
    """With their numbers."""
    triangle = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0))
    with pytest.raises(PrensaError, match="2 names in 'sides' for 3 sides"):
        pr.Outline(triangle, 0.5, sides=("a", "b"))
    with pytest.raises(PrensaError, match="elements; a body has"):
        pr.Outline(triangle, 1e-6)
