"""Pictures of bodies in space: what is in front, sections, surfaces of tools, views, options; without a solver."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import prensa as pr
from prensa.geometry.reflections import Plane
from prensa.mesh.generate import mesh_of
from prensa.mesh.level_set import level_set
from prensa.output import raster, spatial
from prensa.output.mirrors import Whole, images
from prensa.output.solid import shell
from prensa.output.tool_surfaces import drawn_once, motion, own_images, surface
from prensa.result.increment import BodyState, SpatialForce, SpatialPlace, ToolState

BOX = pr.Box((4.0, 2.0, 3.0), (4, 2, 3))


def areas(points, triangles):
    a, b, c = points[triangles].transpose(1, 0, 2)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


# --------------------------------------------------------------------------------------------------- sections, surfaces
@pytest.mark.parametrize("at", [2.0, 2.3, 0.1])
def test_a_section_has_the_area_and_the_values_of_a_plane(at):
    """Between layers of nodes and on one: the whole rectangle once, linear fields exactly, no node twice."""
    mesh = mesh_of(BOX)
    found = level_set(mesh.cells, mesh.points[:, 0] - at)
    on = found.of(mesh.points)
    assert np.allclose(on[:, 0], at)
    assert areas(on, found.triangles).sum() == pytest.approx(6.0)
    assert np.allclose(found.of(mesh.points @ [1.0, 2.0, -3.0]), on @ [1.0, 2.0, -3.0])
    assert len(np.unique(np.round(on, 9), axis=0)) == len(on)


def test_sections_of_tetrahedra_of_both_orders():
    """A tetrahedron cut at a tenth of its height, of four nodes and of ten with straight sides."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
    middles = np.array([0.5 * (corners[a] + corners[b]) for a, b in ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))])
    for points in (corners, np.vstack([corners, middles])):
        found = level_set(np.arange(len(points))[None], points[:, 2] - 0.1)
        assert areas(found.of(points), found.triangles).sum() == pytest.approx(0.5 * 0.9**2)


def test_the_shell_of_a_body_is_its_outside_and_its_sections():
    """Points of the outside are nodes; those of the sections carry values between nodes."""
    mesh = mesh_of(BOX)
    seen = shell(mesh.points, mesh.cells, [(0, 1.5), (1, 1.0)])
    x = seen.of(mesh.points)
    nodes = seen.pairs[:, 0] == seen.pairs[:, 1]
    assert areas(x, np.vstack([seen.faces[:, :3], seen.faces[:, [0, 2, 3]]])).sum() == pytest.approx(2 * (8 + 6 + 12))
    assert [areas(x, t).sum() for t in seen.sections] == pytest.approx([6.0, 12.0])
    assert nodes[np.unique(seen.faces)].all()
    assert np.allclose(x[np.unique(seen.sections[0]), 0], 1.5)


def state(at=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), move=(0.0, 0.0, 0.0), looks=(0.0, -1.0, 0.0)):
    return ToolState(np.array(at), SpatialPlace(*move, *turn), SpatialForce(*np.zeros(6)), looks)


@pytest.mark.parametrize(
    ("tool", "away"),
    [
        (pr.Sphere(radius=2.0), lambda p: np.linalg.norm(p, axis=1) - 2.0),
        (pr.Extruded(pr.Circle(2.0), axis=(0, 0, 1)), lambda p: np.hypot(p[:, 0], p[:, 1]) - 2.0),
        (pr.Plane(), lambda p: p[:, 1]),
        (pr.Revolved(pr.Circle(1.0, at=(2.0, 0.0))), lambda p: np.hypot(np.hypot(p[:, 0], p[:, 2]) - 2.0, p[:, 1]) - 1.0),
    ],
)
def test_surfaces_of_tools_lie_on_the_tools(tool, away):
    """Any tool: its points have no distance, its normals are of unit length, and something of it is near."""
    made = surface(tool, state(), np.full(3, -2.5), np.full(3, 2.5))
    assert len(made.triangles) > 500
    assert np.abs(away(made.points)).max() < 1e-3
    assert np.allclose(np.linalg.norm(made.normals, axis=1), 1.0)


def test_a_closed_tool_is_drawn_whole_and_where_it_is():
    """The area of a sphere, moved and turned."""
    made = surface(pr.Sphere(radius=2.0), state(), np.full(3, -1.9), np.full(3, 1.9))
    assert areas(made.points, made.triangles).sum() == pytest.approx(4 * np.pi * 4.0, rel=5e-3)
    there = state(at=(1, 0, 0), move=(0, 5, 0), turn=(0, 0, np.pi / 2))
    assert np.allclose(motion(there)[0] @ [1, 0, 0], [0, 1, 0])
    assert np.allclose(made.at(there).mean(axis=0), [1, 5, 0], atol=0.05)


# ------------------------------------------------------------------------------------------------------------- pixels
def test_what_is_nearer_covers_what_is_behind():
    """Two triangles that cross, as no order of them would show; values between corners; what is cut away shows what is behind."""
    xy = np.array([[(0, 0), (20, 0), (0, 20)]] * 2, dtype=float)
    depth = np.array([(0.0, 20.0, 0.0), (10.0, 10.0, 10.0)])  # the first is nearer where x > 10
    found = raster.seen(xy, depth, 20, 20)
    x, y = found.pixel % 20 + 0.5, found.pixel // 20 + 0.5
    assert len(found.pixel) == (x + y <= 20).sum() == pytest.approx(200, abs=12)
    assert (found.triangle == np.where(x > 10, 0, 1)).all()
    assert np.allclose(found.of(xy), np.stack([x, y], axis=1))
    off = np.array([(1.0, 1.0, 1.0), (-1.0, -1.0, -1.0)])
    assert (raster.seen(xy, depth, 20, 20, off).triangle == 1).all()


def test_no_pixel_between_triangles_is_missed_or_doubled():
    """A square of many triangles that meet at slanting sides is covered without holes."""
    rng = np.random.default_rng(3)
    from scipy.spatial import Delaunay

    points = np.vstack([rng.uniform(0, 40, (60, 2)), [(0, 0), (40, 0), (40, 40), (0, 40)]])
    xy = points[Delaunay(points).simplices]
    found = raster.seen(xy, np.zeros(xy.shape[:2]), 40, 40)
    assert len(found.pixel) == 1600


def test_sides_of_faces_are_drawn_and_diagonals_are_not():
    """Of a square of two triangles: dark at its four sides, not along its diagonal."""
    xy = np.array([[(2, 2), (38, 2), (38, 38)], [(2, 2), (38, 38), (2, 38)]], dtype=float)
    found = raster.seen(xy, np.zeros((2, 3)), 40, 40)
    drawn = np.zeros(1600)
    drawn[found.pixel] = raster.on_sides(found, xy, np.array([[True, False, True], [True, True, False]]), 2.0)
    image = drawn.reshape(40, 40)
    assert image[20, 2] > 0.9 and image[2, 20] > 0.9 and image[37, 10] > 0.9
    assert image[20, 20] == image[10, 30] == 0.0


@pytest.mark.parametrize("corners", [3, 4, 6])
def test_sides_of_faces_are_those_of_their_outline(corners):
    """Of triangles, quadrilaterals and triangles with middles: the drawn sides go once around."""
    from prensa.output.cells import around, covered

    faces = np.arange(corners)[None]
    outer = zip(covered(faces), spatial.outer_sides(faces))
    sides = {frozenset(np.delete(t, k)) for t, drawn in outer for k in range(3) if drawn[k]}
    ring = around(faces)[0]
    assert sides == {frozenset(pair) for pair in zip(ring, np.roll(ring, -1))}


# ------------------------------------------------------------------------------------------------------------ pictures
def made(pressed_from=(0.0, 1.0, 0.0)):
    """An increment of a box whose stress is 1 inside and 0 at its outside, under a ball that presses from somewhere."""
    problem = pr.Problem(
        "box", space="solid", bodies={"b": pr.Body(pr.Box((4.0, 4.0, 4.0), (4, 4, 4)), pr.Elastic(1e3, 0.3))},
        tools={"ball": pr.Sphere(2.0, at=(2.0, 6.0, 2.0))}, contacts=(pr.Contact(("b.top",), "ball"),),
        fixed={"b.bottom": "xyz"}, steps=(pr.Step("press", move={"ball": {"y": -0.1}}, increments=1),),
    )  # fmt: skip
    [increment] = pr.solve(problem)
    mesh = mesh_of(problem.bodies["b"].mesh)
    X, n = mesh.points, len(mesh.points)
    inside = (np.abs(X - 2.0) < 1.5).all(axis=1).astype(float)
    body = BodyState(X, X, mesh.cells, np.zeros_like(X), np.zeros((n, 6)), inside, np.zeros(n))
    contact = increment.contacts["b.top-ball"]
    force = np.zeros_like(contact.force)
    force[0] = -np.array(pressed_from)
    contact = replace(contact, force=force)
    return replace(increment, _bodies=lambda: {"b": body}, _contacts=lambda: {"b.top-ball": contact})


@pytest.fixture(scope="module")
def increment():
    return made()


def colours(figure):
    """Share of the picture's pixels that are bright as the end of the colour map is."""
    figure.canvas.draw()
    image = np.asarray(figure.canvas.buffer_rgba())[:, : int(0.7 * figure.bbox.width), :3].astype(int)
    yellow = (image[..., 0] > 120) & (image[..., 1] > 120) & (image[..., 2] < 110)
    return yellow.mean()


MIRRORED = {"section": "y", "mirror": ("bottom", "left")}


@pytest.mark.parametrize("options", [{"section": "x"}, {"section": "z=1.5", "view": "front"}, MIRRORED])
def test_a_section_shows_what_is_inside(increment, options):
    """From outside nothing is stressed; cut in the middle the core is; what is mirrored is cut in the middle of the whole."""
    small = {"size": (2.6, 2.2), "dpi": 50}
    assert colours(increment.plot("mises", mirror=options.get("mirror", ()), **small)) == 0.0
    seen = colours(increment.plot("mises", **options, **small))
    assert (seen > 0.02) if "mirror" not in options else seen == 0.0  # there the middle is a side
    if "mirror" in options:
        assert colours(increment.plot("mises", mirror=options["mirror"], section="z", **small)) > 0.02


def test_pressures_are_seen_from_the_side_of_the_tools(increment):
    """From above, from below, and from a side."""
    assert spatial.view_angles("tool", increment) == spatial.VIEWS["iso"]
    assert spatial.view_angles("tool", made((0.0, -1.0, 0.0)))[1] < 0.0
    turn, _ = spatial.view_angles("tool", made((-1.0, 0.0, 0.0)))
    assert np.sin(np.radians(turn)) < 0.0
    assert increment.plot("pressure", size=(3, 3), dpi=40).axes[0].name == "3d"
    options = {"mirror": ("left",), "view": "20,-30", "section": "z", "title": "p", "size": (3, 3), "dpi": 40}
    assert increment.plot("pressure", contact="b.top-ball", **options).axes


def test_sizes_and_resolutions_are_those_asked_for(increment):
    """In inches and pixels; the part to show is that of the axes."""
    figure = increment.plot("mises", size=(3.0, 2.5), dpi=60, box=(0, 2, 0, 3, 1, 4))
    assert (tuple(figure.get_size_inches()), figure.dpi) == ((3.0, 2.5), 60)
    axes = figure.axes[0]
    assert [*axes.get_xlim(), *axes.get_zlim(), *axes.get_ylim()] == [0, 2, 0, 3, -4, -1]


@pytest.mark.parametrize(
    ("what", "options", "words"),
    [
        ("mises", {"view": "tpo"}, "did you mean 'top'"),
        ("mises", {"section": "u"}, "no section 'u'"),
        ("mises", {"section": "x=9"}, "misses the bodies, which reach from 0 to 4"),
        ("mises", {"contact": "b.top-ball"}, "'contact' belongs to 'pressure'"),
        ("pressure", {"reference": {}}, "has no option 'reference'"),
        ("mises", {"sise": (3, 3)}, "did you mean 'size'"),
    ],
)
def test_options_that_mean_nothing_are_refused(increment, what, options, words):
    """With what there is."""
    with pytest.raises(pr.PrensaError, match=words):
        increment.plot(what, **options)


def test_options_of_space_are_refused_in_the_plane(increment):
    """Views and sections, of fields and of pressures."""
    import synthetic

    plane = synthetic.increment(n=(4, 2))
    plane = replace(plane, _more=increment._more._replace(problem=synthetic.problem()))
    for what, options in (("mises", {"view": "top"}), ("pressure", {"section": "x"})):
        with pytest.raises(pr.PrensaError, match="problem of the plane"):
            plane.plot(what, **options)




# ------------------------------------------------------------------------------------------- tools that are one with images
SIXTH = (Plane((0.0, 0.0, 1.0), 0.0), Plane((0.5 * 3**0.5, 0.0, -0.5), 0.0))  # a sector of 60 degrees about y
SQUARE = pr.Extruded(pr.Stamp(width=4.0), axis=(0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("tool", "states", "one", "drawn"),
    [
        (pr.Plane(), [state(looks=(0.0, -1.0, 0.0))], 6, 1),
        (pr.Sphere(radius=2.0), [state(), state(move=(0.0, 1.0, 0.0))], 6, 1),
        (pr.Sphere(radius=2.0), [state(), state(move=(1.0, 0.0, 0.0))], 2, 3),  # along the first plane, across the other
        (pr.Sphere(radius=0.5), [state(at=(4.0, 0.0, 1.5))], 1, 6),
        (pr.Plane(), [state(looks=(0.6, -0.8, 0.0))], 2, 3),
        (SQUARE, [state()], 2, 3),
    ],
    ids=["plane", "ball", "ball that leaves", "ball in the part", "inclined plane", "bar"],
)
def test_a_tool_is_one_with_images_that_leave_it_where_it_is(tool, states, one, drawn):
    """In a whole of six sectors, by the symmetry of a tool at its places; each of its places is drawn once."""
    whole = images(SIXTH)
    made = surface(tool, states[0], np.full(3, -2.5), np.full(3, 2.5))
    own = own_images(tool, states, made, whole)
    kept = drawn_once(whole, own, 1.0)
    assert len(whole) == 6 and own[0] == kept[0] == 0
    assert (len(own), len(kept)) == (one, drawn)


def test_the_plane_of_a_sector_is_drawn_as_one_square():
    """Over the whole part, with the area of one square, and not as those of six parts that lie in one another."""
    x = np.array([(0, 0, 0), (3, 0, 0), (1.5, 0, 2.598), (0, 1, 0), (3, 1, 0), (1.5, 1, 2.598)], dtype=float)
    body = SimpleNamespace(x=x)
    problem = SimpleNamespace(tools={"t": pr.Plane()}, steps=())
    increment = SimpleNamespace(bodies={"b": body}, tools={"t": state(at=(0.0, 1.0, 0.0))}, step="press")
    glass = spatial.glass_of(increment, problem, Whole(SIXTH, images(SIXTH)), None, np.zeros(3))
    a, b, c = glass.x.transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    low, high = glass.x.reshape(-1, 3).min(axis=0), glass.x.reshape(-1, 3).max(axis=0)
    assert (low[[0, 2]] <= [-3.0, -2.598]).all() and (high[[0, 2]] >= [3.0, 2.598]).all()
    assert area == pytest.approx(np.prod((high - low)[[0, 2]]), rel=1e-6)
