"""Pyramids and convex polyhedra with rounded edges: gap, normal and curvature, closed forms, rays, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from differences import belongs_together
from prensa.model.schema import loads

DOWN = -np.eye(3)[1]
CUBE = tuple((x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0))
HEXAGON = (*((np.cos(a), 0.0, np.sin(a), 2.0) for a in np.arange(6) * np.pi / 3), (0.0, 2.0, 0.0, 2.0), (0.0, -1.0, 0.0, 1.0))
TOOLS = {
    "vickers": pr.Pyramid(of="vickers", radius=0.3),
    "berkovich": pr.Pyramid(of="berkovich", radius=0.3, turn=(0.3, 0.2, -1.0)),
    "hexagon": pr.Polyhedron(planes=HEXAGON, radius=0.5),
    "octahedron": pr.Polyhedron(points=(*map(tuple, 2.0 * np.eye(3)), *map(tuple, -2.0 * np.eye(3))), radius=0.2),
    "sharp cube": pr.Polyhedron(points=CUBE, radius=0.0, turn=(0.0, 0.5, 0.0)),
}


@pytest.mark.parametrize("tool", TOOLS.values(), ids=TOOLS)
def test_gap_normal_and_curvature_belong_together(tool):
    """By differences to 1e-8 but at kinks; the foot of a point lies on the surface; rays end on it; pictures are of it."""
    rng = np.random.default_rng(0)
    x, shape = rng.normal(size=(1000, 3)) * 1.5, tool.shape(DOWN, 0.0)
    close = shape.closest(x)
    x = x[(np.abs(close.g) < 0.4) & (close.g > -0.9 * shape.radius)]
    slope, bend = belongs_together(shape, x)
    smooth = bend < 1e-3  # a difference across the border of face and edge is of order 1 / h
    assert len(x) > 100 and smooth.mean() > 0.98
    assert slope[smooth].max() < 1e-8 and bend[smooth].max() < 1e-8
    close = shape.closest(x)
    assert np.abs(shape.closest(x - close.g[:, None] * close.n).g).max() < 1e-12
    way = np.array([0.2, 0.9, -0.3]) / np.linalg.norm([0.2, 0.9, -0.3])
    start = x[:100] - 20.0 * way
    h = shape.along(start, way, 100.0)
    met = np.isfinite(h)
    assert met.sum() > 10
    assert np.abs(shape.closest(start[met] + h[met, None] * way).g).max() < 1e-10
    points, triangles = tool.facets(DOWN, 2.0)
    assert shape.closest(points[triangles].mean(axis=1)).g.max() < 1e-9


def test_closed_forms():
    """The ball in a pyramid's tip, its edges as cylinders; a cube's distance; the angle between the faces of an indenter."""
    r, half = 0.3, np.radians(68.0)
    shape = TOOLS["vickers"].shape(DOWN, 0.0)
    middle = np.array([0.0, r / np.sin(half), 0.0])
    below = np.array([[0.1, -1.0, 0.05], [0.0, -3.0, 0.0]])
    assert np.allclose(shape.closest(below).g, np.linalg.norm(below - middle, axis=1) - r, rtol=1e-14)
    normals = shape.normals
    assert np.degrees(np.arccos(normals[0] @ normals[2])) == pytest.approx(180.0 - 136.0)
    edge = np.cross(normals[0], normals[1])
    edge /= np.linalg.norm(edge)
    out = (normals[0] + normals[1]) / np.linalg.norm(normals[0] + normals[1])
    at = middle + 3.0 * edge * np.sign(edge[1])
    found = shape.closest((at + 0.7 * out)[None])
    assert np.isclose(found.g[0], 0.4, rtol=1e-13) and np.allclose(found.n[0], out)
    assert np.allclose(found.c[0], (np.eye(3) - np.outer(out, out) - np.outer(edge, edge)) / 0.7)
    x = np.random.default_rng(1).normal(size=(200, 3)) * 2.0
    cube = pr.Polyhedron(points=CUBE, radius=0.25).shape(DOWN, 0.0)
    q = np.abs(x) - 0.75
    exact = np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0) - 0.25
    assert np.allclose(cube.closest(x).g, exact, atol=1e-14)


def test_points_and_planes_are_one_polyhedron():
    """The hull of a cube's corners is what lies behind its six planes; a pyramid of many sides tends to a cone."""
    planes = tuple((*map(float, s * e), 1.0) for e in np.eye(3) for s in (1, -1))
    x = np.random.default_rng(2).normal(size=(100, 3)) * 2.0
    a, b = (pr.Polyhedron(**given, radius=0.1).shape(DOWN, 0.0).closest(x) for given in ({"points": CUBE}, {"planes": planes}))
    assert np.allclose(a.g, b.g, atol=1e-13) and np.allclose(a.n, b.n, atol=1e-12)
    cone = pr.Revolved(pr.Profile(points=((0.0, 0.0), (1.0, 1.0)))).shape(DOWN, 0.0)
    for n in (32, 64):  # its faces touch the cone, its edges are farther out by 1/cos(π/n)
        off = cone.closest(x).g - pr.Pyramid(sides=n, angle=np.pi / 4, radius=0.0).shape(DOWN, 0.0).closest(x).g
        most = np.abs(x).max() * (1.0 - np.cos(np.pi / n))
        assert off.min() > -1e-12 and 0.2 * most < off.max() < most


CASE = """
name: v
space: solid
bodies:
  b: {mesh: {type: box, size: [2, 1, 2], n: [2, 1, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools:
  t: {type: pyramid, of: vickers, radius: 0.1 mm, touching: b.top, at: [1, 0, 1]}
contacts: [{surface: b.top, against: t}]
steps: [{name: press}]
"""


def test_a_case_places_them():
    """The rounded tip touches the node under it; a turned pyramid looks where it is turned to."""
    tool = pr.discretise(loads(CASE).problem).tools[0]
    lift = 0.1 * (1.0 / np.sin(np.radians(68.0)) - 1.0)
    assert np.allclose(tool.at, [1.0, 1.0 - lift, 1.0], rtol=1e-12)
    side = CASE.replace("b.top, at: [1, 0, 1]", "b.left, at: [0, 0.5, 1], turn: [0, 0, 90 deg]").replace("b.top", "b.left")
    tool = pr.discretise(loads(side).problem).tools[0]
    assert tool.shape.closest(np.array([[5.0, 0.0, 0.0]])).n[0] == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("pyramid, of: vickers, sides: 4", "'vickers' says 'sides' and 'angle': leave these out, or the name"),
        ("pyramid, sides: 4", "a pyramid needs a name, 'of' .vickers, berkovich, cube corner., or both 'sides' and 'angle'"),
        ("polyhedron", "give the corners of the polyhedron, 'points', or its 'planes'"),
        ("polyhedron, points: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]", "four of them at least must not lie in one plane"),
        ("polyhedron, planes: [[0, -1, 0, 1], [1, 0, 0, 1]]", "the planes enclose no body: add those that close it"),
        ("polyhedron, planes: [[0, 0, 0, 1], [1, 0, 0, 1]]", "7:.*the normal .0, 0, 0. has no length"),
        (f"polyhedron, radius: 1.5, points: {[list(p) for p in CUBE]}", "radius of 1.5 leaves nothing .* ball in it has 1"),
    ],
)  # fmt: skip
def test_mistakes_are_reported(given, words):
    """With line and remedy."""
    text = CASE.replace("pyramid, of: vickers, radius: 0.1 mm", given)
    with pytest.raises(pr.CaseError, match=words):
        loads(text)
