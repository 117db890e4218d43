"""Tools of the plane, extruded and revolved: closed forms, derivatives by differences, tips on the axis, rays, cases."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.model.schema import loads

DOWN = -np.eye(3)[1]
SLANTED = (1.0, 2.0, 0.5)
UNIT = np.array(SLANTED) / np.linalg.norm(SLANTED)
CONE = pr.Profile(points=((0.0, 0.0), (10.0, 8.0)))
WALL = pr.Profile(points=((-9.0, 0.0), (0.0, 0.0), (0.0, 9.0)), fillet=(0.0, 1.0, 0.0))
SQUARE = pr.Polygon(points=((-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)), fillet=1.5)
TOOLS = {
    "roll": pr.Extruded(pr.Circle(2.0), axis=SLANTED),
    "profile": pr.Extruded(pr.Profile(points=((-3.0, 1.0), (0.0, 0.0), (3.0, 2.0)), fillet=1.0)),
    "sphere": pr.Revolved(pr.Circle(2.0), axis=SLANTED),
    "torus": pr.Revolved(pr.Circle(1.0, at=(3.0, 0.5)), axis=SLANTED),
    "cup": pr.Revolved(pr.Circle(4.0, concave=True)),
    "cone": pr.Revolved(CONE),
    "stamp": pr.Revolved(pr.Stamp(5.0, 1.0)),
    "spheroid": pr.Revolved(pr.Ellipse((3.0, 1.5))),
    "square punch": pr.Swept(WALL, SQUARE, axis=SLANTED),
    "square die": pr.Swept(pr.Profile(points=((9.0, 0.0), (0.2, 0.0), (0.2, -9.0)), fillet=1.0), SQUARE),
    "oval": pr.Swept(pr.Circle(1.0), pr.Ellipse((4.0, 3.0), at=(0.5, 0.0))),
}


def points(k=300, seed=0):
    return np.random.default_rng(seed).normal(size=(k, 3)) * 3.0


def differences(shape, x, h=1e-5):
    """Derivatives of the normal (k, 3, 3), of fourth order."""
    out = np.zeros((len(x), 3, 3))
    for k, e in enumerate(h * np.eye(3)):
        after, before, twice_after, twice_before = (shape.closest(x + s * e).n for s in (1, -1, 2, -2))
        out[:, :, k] = (8 * (after - before) - (twice_after - twice_before)) / (12 * h)
    return out


@pytest.mark.parametrize("tool", TOOLS.values(), ids=TOOLS)
def test_gap_normal_and_curvature_belong_together(tool):
    """N = ∇g and ∂n/∂x as given, by differences, but at kinks; the foot x − g n is on the surface."""
    x, shape, h = points(), tool.shape(DOWN, 0.0), 1e-5
    close = shape.closest(x)
    slope = np.stack([shape.closest(x + e).g - shape.closest(x - e).g for e in h * np.eye(3)], axis=1) / (2 * h)
    found = differences(shape, x)
    off = np.abs(close.c - found).max(axis=(1, 2)) / (1.0 + np.abs(close.c).max(axis=(1, 2)))
    smooth = off < 1e-3  # a difference across a kink is of order 1 / h
    assert smooth.mean() > 0.98
    assert off[smooth].max() < 1e-8
    steep = 1.0 + np.abs(close.c).max(axis=(1, 2)) ** 2  # the third derivative, which the difference is off by
    assert (np.abs(slope - close.n).max(axis=1) / steep)[smooth].max() < 1e-9
    near = np.abs(close.g) < 0.3
    assert np.abs(shape.closest(x[near] - close.g[near, None] * close.n[near]).g).max() < 1e-12


@pytest.mark.parametrize("start", [(0.0, 0.0), (-9.0, 0.0)], ids=["from the reference point", "from elsewhere"])
@pytest.mark.parametrize("rise", [0.0, 3.0])
@pytest.mark.parametrize("kind", [pr.Extruded, pr.Revolved])
def test_rays_straight_at_a_tool_of_one_line_meet_it(kind, rise, start):
    """Along its normal, from either side and any distance, to 1e-9: such a tool has no length of its own."""
    rng, shape = np.random.default_rng(0), kind(pr.Profile(points=(start, (9.0, rise)))).shape(DOWN, 0.0)
    x = np.stack([rng.uniform(0.5, 3.0, 40), np.full(40, -9.0), rng.uniform(-2.0, 2.0, 40)], axis=1)
    for _ in range(300):
        x[:, 1] += 0.9 * shape.closest(x).g
    normals = shape.closest(x).n
    for d in (-1.0, -0.1, -1e-3, -1e-6, 1e-9, 1e-6, 1e-3, 0.1):
        h = np.concatenate([shape.along((a + d * n)[None], -n, 3610.0) for a, n in zip(x, normals)])
        assert np.abs(h - d).max() < 1e-9


def test_closed_forms():
    """A revolved circle is a ball, an extruded one a cylinder, a circle off the axis a torus, to round-off."""
    x = points()
    ball, pipe, ring = (TOOLS[name].shape(DOWN, 0.0).closest(x) for name in ("sphere", "roll", "torus"))
    r = np.linalg.norm(x, axis=1)
    assert np.abs(ball.g - (r - 2.0)).max() < 1e-14 * r.max()
    assert np.abs(ball.n - x / r[:, None]).max() < 1e-14
    z = x @ UNIT
    across = x - z[:, None] * UNIT
    rho = np.linalg.norm(across, axis=1)
    assert np.abs(pipe.g - (rho - 2.0)).max() < 1e-14 * r.max()
    assert np.abs(ring.g - (np.hypot(rho - 3.0, z - 0.5) - 1.0)).max() < 1e-14 * r.max()


def test_a_section_swept_around_a_circle_is_a_revolved_one():
    """Gap, normal and curvature of a plan of radius 3 are those of the section moved out by 3, but near the axis."""
    moved = pr.Profile(points=((-9.0, 0.0), (3.0, 0.0), (3.0, 9.0)), fillet=(0.0, 1.0, 0.0))
    x = points()
    swept = pr.Swept(WALL, pr.Circle(3.0), axis=SLANTED).shape(DOWN, 0.0).closest(x)
    revolved = pr.Revolved(moved, axis=SLANTED).shape(DOWN, 0.0).closest(x)
    for one, other in zip(swept[:3], revolved[:3]):
        assert np.abs(one - other).max() < 1e-12 * max(1.0, np.abs(other).max())


def test_a_square_punch_is_flat_below_and_rounded_at_its_edges_and_corners():
    """Closed forms below the face, beside a side, beside the fillet of a side, beside a corner of the plan."""
    shape = pr.Swept(WALL, SQUARE).shape(DOWN, 0.0)
    x = np.array([[0.3, -2.0, 0.1], [5.0, 4.0, 0.5], [3.0, -1.0, 0.0], [1.5 + 2.4, 4.0, 1.5 + 3.2]])
    assert np.allclose(shape.closest(x).g, [2.0, 2.0, np.hypot(1.0, 2.0) - 1.0, 2.5], rtol=1e-14)
    facets, triangles = pr.Swept(WALL, SQUARE).facets(DOWN, 9.0)
    assert np.abs(shape.closest(facets[facets[:, 1] < 2.0]).g).max() < 1e-12
    corners = facets[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    below = np.abs(corners[:, :, 1]).max(axis=1) < 1e-12
    assert np.linalg.norm(normals[below], axis=1).sum() / 2.0 == pytest.approx(16.0 - (4.0 - np.pi) / 4.0, rel=1e-3)


def test_the_tip_of_a_cone_is_a_vertex():
    """Below it points see the tip, on its sides the flank; on the axis the normal is the axis, inside too."""
    shape = TOOLS["cone"].shape(DOWN, 0.0)
    flank = np.array([8.0, -10.0]) / np.hypot(8.0, 10.0)
    below = shape.closest(np.array([[0.1, -2.0, 0.2], [0.0, -3.0, 0.0]]))
    assert np.allclose(below.g, [np.sqrt(4.05), 3.0], rtol=1e-14)
    assert np.allclose(below.n[1], DOWN)
    side = shape.closest(np.array([[3.0, 1.0, 4.0]]))
    assert np.isclose(side.g[0], 5.0 * flank[0] + 1.0 * flank[1], rtol=1e-14)
    inside = shape.closest(np.array([[0.0, 1.0, 0.0]]))
    assert (inside.g[0], *inside.n[0], np.abs(inside.c).max()) == (-1.0, *DOWN, 0.0)


def test_the_axis_of_a_torus_is_away_from_it():
    """Points on the axis are nearest to a circle: its distance, and the axis as normal."""
    torus = pr.Revolved(pr.Circle(1.0, at=(2.0, 0.0))).shape(np.array([0.0, -1.0, 0.0]), 0.0)
    found = torus.closest(np.array([(0.0, 0.0, 0.0), (0.0, 1.5, 0.0)]))
    assert np.allclose(found.g, [1.0, 1.5])
    assert np.allclose(np.abs(found.n), [[0, 1, 0], [0, 1, 0]])


def test_rays_end_on_the_surface():
    """From outside and inside, into hollows too; those that miss are infinite."""
    for name in ("sphere", "torus", "cup", "stamp", "profile"):
        shape, x, way = TOOLS[name].shape(DOWN, 0.0), points(60, 3), np.array([0.2, 0.9, -0.3])
        way /= np.linalg.norm(way)
        h = shape.along(x, way, 50.0)
        met = np.isfinite(h)
        assert met.any()
        assert np.abs(shape.closest(x[met] + h[met, None] * way).g).max() < 1e-7
    ball = pr.Revolved(pr.Circle(2.0)).shape(DOWN, 0.0)
    hit = ball.along(np.array([[0.5, -5.0, 0.5], [3.0, -5.0, 0.0]]), np.eye(3)[1], 100.0)
    assert np.allclose(hit, [5.0 - np.sqrt(3.5), np.inf], rtol=1e-12)


CASE = """
name: ball
space: solid
bodies:
  b: {mesh: {type: box, size: [2, 1, 2], n: [2, 1, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools:
  t: {type: revolved, section: {type: circle, radius: 10 mm}, touching: b.top, at: [1, 0, 1]}
contacts: [{surface: b.top, against: t}]
steps: [{name: press}]
"""


def test_a_case_places_them_at_sides():
    """Moved along the normal of the side until the first node touches; the section's place stays its own."""
    system = pr.discretise(loads(CASE).problem)
    assert np.allclose(system.tools[0].at, [1.0, 11.0, 1.0], rtol=1e-12)
    torus = CASE.replace("radius: 10 mm}", "radius: 1 mm, at: [1, 0.5]}").replace("at: [1, 0, 1]", "at: [0, 0, 1]")
    assert np.allclose(pr.discretise(loads(torus).problem).tools[0].at, [0.0, 1.5, 1.0], rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("axis", ", axis: [0, 0, 0]"), "the axis .0, 0, 0. has no direction; write 'x', 'y', 'z' or a vector"),
        (("axis", ", axis: [0, 1]"), "axis of tool 't' .revolved. has 2 values; 'x', 'y', 'z' or a list of 3 numbers"),
        (("radius: 10 mm", "radius: 10 mm, touching: b.top"), "'touching' belongs to the revolved tool, not to its section"),
        (("radius: 10 mm", "radius: 10 mm, at: [0, 0, 0]"), "at has two components"),
        (("type: circle, radius: 10 mm", "type: sphere, radius: 10 mm"), "'sphere'"),
        (("type: revolved", "type: swept, plan: {type: plane}"), "the plan is a closed outline with its inside inside"),
        (("type: revolved", "type: swept, plan: {type: circle, radius: 1, concave: true}"), "the plan is a closed outline"),
        (("type: revolved", "type: swept, plan: {type: circle, radius: 1, above: b.top}"), "belongs to the swept tool"),
        (("type: revolved", "type: swept"), "plan"),
    ],
)
def test_sections_are_checked(change, words):
    """An axis without length, keys that belong to the tool, shapes that are no sections."""
    what, by = change
    text = CASE.replace("touching: b.top, at", f"touching: b.top{by}, at") if what == "axis" else CASE.replace(what, by)
    with pytest.raises(pr.CaseError, match=words):
        loads(text)


def test_a_section_that_reaches_beyond_the_corners_of_its_plan_is_doubted():
    """Fillets of 1 mm at corners of 0.5 mm leave a crease; corners of 1.5 mm do not."""
    assert not list(pr.Swept(WALL, SQUARE).doubts())
    ((key, words),) = pr.Swept(WALL, pr.Polygon(points=SQUARE.points, fillet=0.5)).doubts()
    assert (key, "creases" in words) == ("section", True)


def test_a_torus_on_its_axis_has_a_distance_without_a_tip():
    """It does not meet its axis: from the middle all of its inner equator is equally far."""
    torus = pr.Revolved(pr.Circle(5.0, at=(15.0, 0.0))).shape(np.array([0.0, -1.0, 0.0]), 0.0)
    found = torus.closest(np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0]]))
    assert found.g == pytest.approx([10.0, np.hypot(15.0, 3.0) - 5.0])
    assert np.linalg.norm(found.n, axis=1) == pytest.approx([1.0, 1.0])


def test_an_axis_is_named_or_a_vector() -> None:
    """The names x, y and z are unit vectors, of every tool that is swept."""
    circle = pr.Circle(2.0)
    assert pr.Extruded(circle, axis="z") == pr.Extruded(circle, axis=(0.0, 0.0, 1.0))
    assert pr.Revolved(circle, axis="x").axis == (1.0, 0.0, 0.0)
