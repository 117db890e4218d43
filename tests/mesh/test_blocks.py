"""Disc, annulus and patch: their nodes lie on the curves that they are named after, their boundaries close."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import MeshError, areas, boundary_edges, segments
from prensa.model.checks import _boundaries

SECTOR = pr.Patch(
    corners=((1, 0), (2, 0), (0, 2), (0, 1)), n=(3, 8), grade="left",
    sides={"left": pr.ArcSide(centre=(0, 0)), "right": pr.ArcSide(through=(math.sqrt(2), math.sqrt(2)))},
)  # fmt: skip
BULGE = pr.Patch(
    corners=((0, 0), (4, 0), (4, 1), (0, 1)), n=(12, 4), grade="top-right",
    sides={"top": pr.SplineSide(points=((1, 1.2), (2, 1.4), (3, 1.2)))},
)  # fmt: skip
PARTS = ["full", "left", "right", "top", "bottom", "top-left", "top-right", "bottom-left", "bottom-right"]
ALL = [
    *(pr.Disc(radius=3, n=(4, 2), part=p, centre=(1, 2), ratio=3) for p in PARTS),
    pr.Annulus(inner=1, outer=2, n=(12, 3)),
    pr.Annulus(inner=1, outer=2, n=(12, 3), angles=(0.3, 2.0), grade="outer"),
    SECTOR,
    BULGE,
]


@pytest.mark.parametrize("description", ALL, ids=lambda d: f"{d.type} {getattr(d, 'part', '')}")
@pytest.mark.parametrize("element", ["q4", "q8", "t6"])
def test_the_boundaries_of_a_generated_mesh_are_its_outline(description, element):
    """Every piece of the outline belongs to exactly one boundary, and every name is known before meshing."""
    mesh = mesh_of(description, element)
    outline = sorted(segments(boundary_edges(mesh.cells)).tolist())
    assert sorted(np.concatenate([segments(e) for e in mesh.edges.values()]).tolist()) == outline
    assert set(_boundaries(SimpleNamespace(mesh=description))) == set(mesh.edges) | set(mesh.corners)


@pytest.mark.parametrize("element", ["q4", "q8", "t6"])
def test_nodes_of_round_boundaries_lie_on_their_circle(element):
    """Rim of a disc, both sides of an annulus and the arcs of a patch, mid-side nodes included."""
    disc = mesh_of(pr.Disc(radius=3, n=(4, 2), centre=(1, 2)), element)
    assert np.allclose(np.hypot(*(disc.points[disc.nodes("rim")] - (1, 2)).T), 3.0, rtol=1e-14)
    for description, inner, outer in (
        (pr.Annulus(inner=1, outer=2, n=(12, 3)), "inner", "outer"),
        (SECTOR, "left", "right"),
    ):
        mesh = mesh_of(description, element)
        assert np.allclose(np.hypot(*mesh.points[mesh.nodes(inner)].T), 1.0, rtol=1e-13)
        assert np.allclose(np.hypot(*mesh.points[mesh.nodes(outer)].T), 2.0, rtol=1e-13)


def test_the_area_of_a_disc_converges_to_that_of_the_circle():
    """The polygon of 4 n sides of the rim, exactly: 2 n sin(2 π / 4 n) R²."""
    for n in (4, 8):
        mesh = mesh_of(pr.Disc(radius=3, n=(n, 3)), "q4")
        assert areas(mesh.points, mesh.cells).sum() == pytest.approx(2 * n * math.sin(math.tau / 4 / n) * 9, rel=1e-13)
        assert len(mesh.nodes("rim")) == 4 * n


def test_the_points_of_a_disc_are_where_their_names_say():
    """Centre and the four ends of the axes."""
    mesh = mesh_of(pr.Disc(radius=3, n=(4, 2), centre=(1, 2)), "q4")
    places = {"centre": (1, 2), "rim-right": (4, 2), "rim-top": (1, 5), "rim-left": (-2, 2), "rim-bottom": (1, -1)}
    for name, place in places.items():
        assert np.allclose(mesh.points[mesh.corners[name]], place, atol=1e-14)


def test_a_half_disc_stands_on_the_axis_exactly():
    """The closing side of the section of a sphere has x = 0, so that it is found to be on the axis."""
    mesh = mesh_of(pr.Disc(radius=0.3, n=(6, 3), part="right"), "q8")
    assert (mesh.points[mesh.nodes("left")][:, 0] == 0.0).all() and (mesh.points[:, 0] >= 0.0).all()


def test_a_patch_with_straight_sides_is_the_bilinear_map_of_the_square():
    """Nodes of a quadrilateral region follow (1−s)(1−t) A + … of its corners."""
    corners = np.array([(0, 0), (4, 1), (5, 4), (-1, 3)])
    mesh = mesh_of(pr.Patch(corners=tuple(map(tuple, corners.tolist())), n=(4, 2)), "q4")
    s, t = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 3))
    N = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)
    assert np.allclose(mesh.points, (N @ corners).reshape(-1, 2), atol=1e-14)


def test_a_spline_goes_through_its_points_and_is_shared_out_by_length():
    """A spline through points of a circle gives nodes at equal angles on it, to the accuracy of the spline."""
    angle = np.linspace(0, np.pi / 2, 13)[::-1]
    through = tuple((math.cos(a), math.sin(a)) for a in angle[1:-1])
    arc = pr.Patch(corners=((0, 0), (0.5, -1), (1, 0), (0, 1)), n=(6, 6), sides={"top": pr.SplineSide(points=through)})
    mesh = mesh_of(arc, "q8")
    top = mesh.points[mesh.nodes("top")]
    assert np.allclose(np.hypot(*top.T), 1.0, atol=1e-5)
    assert np.allclose(np.arctan2(top[:, 1], top[:, 0]), np.linspace(0, np.pi / 2, 13), atol=1e-4)


@pytest.mark.parametrize(
    ("side", "words"),
    [
        (pr.ArcSide(through=(0.5, 0.0)), "straight line between the corners"),
        (pr.ArcSide(centre=(0.2, -1.0)), "from the centre .* give 'through'"),
        (pr.SplineSide(points=((0.5, 0.1), (0.5, 0.1))), "two points of the spline are at one place"),
        (pr.SplineSide(points=((1e18, 0.0), (1e18, 1.0))), "two points of the spline are at one place"),
        (pr.SplineSide(points=((-1e308, 0.1),)), "too far apart to be computed with"),
        (pr.ArcSide(through=(0.5, 1.3)), "area|overlap"),
    ],
)
def test_a_side_that_is_no_curve_between_its_corners_is_refused(side, words):
    """Each refusal names the side, or the element that came out impossible."""
    with pytest.raises(MeshError, match=words):
        mesh_of(pr.Patch(corners=((0, 0), (1, 0), (1, 1), (0, 1)), n=(4, 4), sides={"bottom": side}), "q4")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: pr.Disc(radius=1, n=(3, 2)), "must be even"),
        (lambda: pr.Annulus(inner=2, outer=1, n=(8, 2)), "must exceed inner"),
        (lambda: pr.Annulus(inner=1, outer=2, n=(8, 2), angles=(0, 90)), "'90 deg' is converted"),
        (lambda: pr.Annulus(inner=1, outer=2, n=(2, 2)), "too few elements"),
        (lambda: pr.ArcSide(), "either 'through' or 'centre'"),
    ],
)
def test_descriptions_that_make_no_mesh_are_refused(make, words):
    """The message says what would."""
    with pytest.raises(ValueError, match=words):
        make()
