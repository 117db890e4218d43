"""Tools of STL files: patches against the surfaces that the triangles stand for, flats, derivatives, borders, mistakes, a run."""

from __future__ import annotations

import re
from itertools import pairwise

import meshio
import numpy as np
import pytest

import prensa as pr
from differences import belongs_together
from prensa.model.schema import loads
from prensa.output import vtk
from prensa.tools.facets import BORDER, CREASE
from prensa.verify.stl import DIE_PROFILE, extruded, faceted, icosphere, write

DOWN = -np.eye(3)[1]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("stl")
    write(made / "ball.stl", *icosphere(10.0, 3))
    write(made / "die.stl", *extruded(faceted(DIE_PROFILE, 2.0), 20.0), binary=False)
    points, triangles = icosphere(10.0, 1)
    write(made / "inside_out.stl", points, triangles[:, ::-1])
    return made


def degrees(a, b):
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=1), -1.0, 1.0)))


def beside(shape, k=1500, box=((-15, 15), (-1, 5), (-15, 15)), seed=0):
    """Points (k, 3) within 0.05 of a surface."""
    rng = np.random.default_rng(seed)
    x = np.stack([rng.uniform(*b, k) for b in box], axis=1)
    close = shape.closest(x)
    return x - (close.g - rng.uniform(-0.05, 0.05, k))[:, None] * close.n


def test_a_sphere_of_triangles_is_a_sphere(folder):
    """Gap to 1e-4 of the radius over chords of 4e-3, normals within 0.1°, curvature within 5 %; triangles 8.6° long."""
    shape, exact = pr.Stl(str(folder / "ball.stl")).shape(DOWN, 0.0), pr.Sphere(10.0).shape(DOWN, 0.0)
    x = beside(exact, box=((-12, 12),) * 3)
    ours, sphere = shape.closest(x), exact.closest(x)
    assert shape.surface.closed and shape.surface.volume == pytest.approx(4 / 3 * np.pi * 1000, rel=0.02)
    assert not shape.facets.flats.any()
    assert np.abs(ours.g - sphere.g).max() < 2e-4 * 10.0
    assert degrees(ours.n, sphere.n).max() < 0.1
    assert np.abs(ours.c - sphere.c).max() < 0.05 / 10.0
    assert 0.02 < shape.chords.max() < 0.05


def test_the_tangent_is_exact(folder):
    """N = ∇g and ∂n/∂x by differences away from sides of patches, to 1e-8; each point for itself, the same each time."""
    for name, box in (("ball.stl", ((-12, 12),) * 3), ("die.stl", ((-15, 15), (-1, 5), (-15, 15)))):
        shape = pr.Stl(str(folder / name)).shape(DOWN, 0.0)
        x = beside(shape, 600, box)
        slope, bend = belongs_together(shape, x)
        smooth = bend < 1e-3
        assert smooth.mean() > 0.97
        assert max(slope[smooth].max(), bend[smooth].max()) < 1e-8
        first, again = shape.closest(x), shape.closest(x[::7])
        assert all(np.array_equal(a[::7], b) for a, b in zip(first[:3], again))


def test_a_die_as_cad_writes_it(folder):
    """Flats flat to 1e-12, others to the file's seven digits; fillets of 10° within 0.1° and 1e-4, borders apart."""
    shape = pr.Stl(str(folder / "die.stl")).shape(DOWN, 0.0)
    exact = pr.Extruded(pr.Profile(points=DIE_PROFILE, fillet=2.0)).shape(DOWN, 0.0)
    x = beside(exact)
    ours, profile = shape.closest(x), exact.closest(x)
    flat = np.abs(profile.c).max(axis=(1, 2)) == 0.0
    level = flat & (np.abs(profile.n[:, 1]) == 1.0)
    assert level.sum() > 100 and (~flat).sum() > 50
    assert np.abs(ours.g - profile.g)[level].max() < 1e-12 and np.abs(ours.n - profile.n)[level].max() < 1e-12
    assert np.abs(ours.g - profile.g)[flat].max() < 1e-5 and degrees(ours.n, profile.n)[flat].max() < 1e-3
    assert np.abs(ours.g - profile.g)[~flat].max() < 1e-4 and degrees(ours.n, profile.n)[~flat].max() < 0.1
    assert shape.chords.max() > 5e-3


def test_fillets_of_different_radii_beside_flats_and_slopes(folder):
    """Level flats to 1e-12, others to a file's digits, convex and concave fillets of 0.8 to 3 in facets of 10° within 0.05°."""
    points = ((-30.0, 7.0), (-11.0, 7.0), (-10.0, 2.5), (-4.0, 2.5), (-1.5, 0.0), (2.0, 0.0), (5.5, 4.5), (30.0, 6.0))
    radii = (0.0, 0.8, 1.2, 0.9, 2.5, 1.7, 3.0, 0.0)
    shape = pr.Stl(write(folder / "steps.stl", *extruded(faceted(points, radii), 20.0))).shape(DOWN, 0.0)
    exact = pr.Extruded(pr.Profile(points=points, fillet=radii)).shape(DOWN, 0.0)
    x = beside(exact, 3000, ((-20, 20), (-1, 7), (-15, 15)))
    x = x[np.abs(exact.closest(x).g) < 0.06]
    ours, profile = shape.closest(x), exact.closest(x)
    flat = np.abs(profile.c).max(axis=(1, 2)) == 0.0
    level = flat & (np.abs(profile.n[:, 1]) == 1.0)
    assert level.sum() > 500 and (~flat).sum() > 500
    assert np.abs(ours.g - profile.g)[level].max() < 1e-12 and np.abs(ours.n - profile.n)[level].max() < 1e-12
    assert np.abs(ours.g - profile.g)[flat].max() < 1e-5 and degrees(ours.n, profile.n)[flat].max() < 1e-3
    assert np.abs(ours.g - profile.g)[~flat].max() < 1e-4 and degrees(ours.n, profile.n)[~flat].max() < 0.05


def punch(folder, n=36):
    """A closed cylindrical punch of radius 5 and fillet 1, in facets of 10°."""
    a = np.radians(np.arange(0.0, 91.0, 10.0))
    line = [(0.0, 0.0), *zip(4.0 + np.sin(a), 1.0 - np.cos(a)), (5.0, 10.0), (0.0, 10.0)]
    points, rows = [], []
    for r, y in line:
        rows.append(len(points) + np.arange(n) * (r > 0.0))
        points += [(r * np.cos(w), y, r * np.sin(w)) for w in 2 * np.pi * np.arange(n if r > 0.0 else 1) / n]
    quads = [(a[i], b[i], b[(i + 1) % n], a[(i + 1) % n]) for a, b in pairwise(rows) for i in range(n)]
    strips = [t for i, j, k, l in quads for t in ((i, j, k), (i, k, l))]
    triangles = np.array([t for t in strips if len(set(t)) == 3])
    return write(folder / "punch.stl", np.array(points), triangles)


def test_a_punch_has_flats_fillets_sides_and_a_sharp_rim(folder):
    """Normals within 3°, the flat face flat, the straight lines of its side straight, the sharp rim a circle."""
    shape, exact = pr.Stl(punch(folder)).shape(DOWN, 0.0), pr.Revolved(pr.Stamp(10.0, 1.0)).shape(DOWN, 0.0)
    x = beside(exact, 3000, ((-6, 6), (-0.5, 6), (-6, 6)))
    x = x[np.abs(exact.closest(x).g) < 0.06]
    ours, stamp = shape.closest(x), exact.closest(x)
    assert shape.surface.closed and (shape.facets.edge_kinds == CREASE).sum() == 36
    assert degrees(ours.n, stamp.n).max() < 3.0
    assert np.abs(ours.g - stamp.g).max() < 2e-3
    face = np.array([[0.3, -0.01, 0.7], [-2.0, 0.01, 2.0]])
    assert np.abs(shape.closest(face).n - DOWN).max() < 1e-12
    rim = 5.0 * np.array([[np.cos(w), 0.0, np.sin(w)] for w in np.radians(np.arange(2.0, 90.0, 7.0))]) + [0.0, 10.0, 0.0]
    assert np.abs(shape.closest(rim).g).max() < 1e-4


def test_an_open_surface_ends_at_its_borders(folder):
    """Points past one are outside, as far as the border is, in front and behind; its gap and normal belong together there."""
    shape = pr.Stl(str(folder / "die.stl")).shape(DOWN, 0.0)
    assert (shape.facets.edge_kinds == BORDER).sum() > 50 and not shape.surface.closed
    rng = np.random.default_rng(2)
    x = rng.uniform((23.0, 0.0, -26.0), (28.0, 6.0, 26.0), (400, 3)) * [[a, 1.0, 1.0] for a in rng.choice([-1.0, 1.0], 400)]
    border = np.stack([20.0 * np.sign(x[:, 0]), np.full(400, 3.0), np.clip(x[:, 2], -20.0, 20.0)], axis=1)
    far = np.linalg.norm(x - border, axis=1)
    assert shape.past_border(x).all()
    assert np.abs(shape.closest(x).g - far).max() < 1e-6
    assert np.abs(shape.closest(x).n - (x - border) / far[:, None]).max() < 1e-6
    slope, bend = belongs_together(shape, x)
    assert max(slope.max(), bend[bend < 1e-3].max()) < 1e-8 and (bend < 1e-3).mean() > 0.99
    within = beside(shape, 400, ((-19.9, 19.9), (-1, 4), (-19.9, 19.9)))
    assert not shape.past_border(within).any() and np.abs(shape.closest(within).g).max() < 0.06


def test_a_border_turns_away_with_the_radius_that_edges_get(folder):
    """A quarter of an element, as edges without fillets: gap and normal go on across it, are exact, and the tool ends there."""
    corners = np.array([[-4.0, 0, -4], [4, 0, -4], [4, 0, 4], [-4, 0, 4]])
    shape = pr.Stl(write(folder / "plate.stl", corners, np.array([[0, 1, 2], [0, 2, 3]]))).shape(DOWN, 0.5)
    assert shape.radius == 0.5
    rng = np.random.default_rng(5)
    x = rng.uniform(-6.0, 6.0, (3000, 3)) * [1.0, 0.08, 1.0]
    past = np.abs(x[:, [0, 2]]).max(axis=1) > 4.0
    assert (shape.past_border(x) == past).all() and 0.3 < past.mean() < 0.7
    off = np.stack([np.maximum(np.abs(x[:, 0]) - 4.0, 0.0), x[:, 1] - 0.5, np.maximum(np.abs(x[:, 2]) - 4.0, 0.0)], axis=1)
    expected = np.where(past, np.linalg.norm(off, axis=1) - 0.5, -x[:, 1])
    assert np.abs(shape.closest(x).g - expected).max() < 1e-12
    slope, bend = belongs_together(shape, x)
    smooth = bend < 1e-3
    assert smooth.mean() > 0.99 and max(slope[smooth].max(), bend[smooth].max()) < 1e-8
    for depth in (-0.1, 0.0, 0.1):
        a, b = shape.closest(np.array([[4.0 - 1e-9, depth, 0.3], [4.0 + 1e-9, depth, 0.3]])).n
        assert np.abs(a - b).max() < 1e-7


def test_a_plate_as_wide_as_the_body_presses_it_and_slides_past_a_node(folder):
    """Nodes at its border leave it by and by; drag is friction times the normal force while it slides off others."""
    corners = np.array([[-4.0, 0, -4], [4, 0, -4], [4, 0, 4], [-4, 0, 4]])
    write(folder / "plate.stl", corners, np.array([[0, 1, 2], [0, 2, 3]]))
    text = BESIDE.replace("TOOL", "type: stl, file: plate.stl, touching: b.top, at: [0, 0, 0]")
    text = text.replace("size: [20, 4, 20]", "size: [8, 4, 8]").replace("n: [10, 2, 10]", "n: [4, 2, 4]")
    text = text.replace("origin: [-10, 0, -10]", "origin: [-4, 0, -4]")
    free = text.replace("b.bottom: xyz", "b.bottom: y, b.left: x, b.back: z")
    wide = free.replace("plate.stl,", "plate.stl, scale: 2,")
    equal, larger = ([i.force("t").y for i in pr.solve(loads(t, folder=folder).problem)][-1] for t in (free, wide))
    assert equal == pytest.approx(larger, rel=0.1)
    slide = text.replace("increments: 1}]", "increments: 1}, {name: s, by: {t: {x: 2.5}}, increments: 5}]")
    slide = slide.replace("contacts:", "friction: {type: coulomb, mu: 0.1}\ncontacts:")
    made = list(pr.solve(loads(slide, folder=folder).problem))
    assert made[-1].time == pytest.approx(2.0)
    assert -made[-1].force("t").x == pytest.approx(0.1 * made[-1].force("t").y, rel=0.05)


def octant(half=40.0, n=6, m=9, seed=0):
    """Points and triangles, of uneven sizes, of a cap of radius 10 that looks down, between the planes x = 0 and z = 0."""
    rng = np.random.default_rng(seed)
    points, triangles = [(0.0, 0.0, 0.0)], [(0, 1 + j, 2 + j) for j in range(m)]
    for k in range(1, n + 1):
        for j in range(m + 1):
            t = np.radians(half) * (k + (rng.uniform(-0.3, 0.3) if k < n else 0.0)) / n
            w = 0.5 * np.pi * (j + (rng.uniform(-0.3, 0.3) if 0 < j < m else 0.0)) / m
            points.append((10 * np.sin(t) * np.cos(w), 10 - 10 * np.cos(t), 10 * np.sin(t) * np.sin(w)))
    for k in range(n - 1):
        a, b = 1 + k * (m + 1), 1 + (k + 1) * (m + 1)
        for j in range(m):
            triangles += [(a + j, b + j, b + j + 1), (a + j, b + j + 1, a + j + 1)]
    return np.array(points), np.array(triangles)


QUARTER = """
name: quarter
space: solid
bodies:
  b: {mesh: {type: box, size: [6, 6, 6], n: [8, 4, 8]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools:
  t: {TOOL, at: [0, 6, 0]}
contacts: [{surface: b.top, against: t}]
fixed: {b.bottom: y, b.left: x, b.back: z}
steps: [{name: press, move: {t: {y: -0.5}}, increments: 2}]
"""


def test_points_in_a_plane_of_symmetry_see_the_border_of_half_a_tool(folder):
    """A cap that ends there within a file's digits, with normals that lean: the force is that of the whole sphere."""
    write(folder / "octant.stl", *octant())
    shape = pr.Stl(str(folder / "octant.stl")).shape(DOWN, 0.0)
    u = np.linspace(0.1, 6.0, 100)
    for depth in (-0.1, -1e-3, 1e-3):
        r = (10.0 + depth) / 10.0
        x = np.stack([0 * u, 10.0 - r * np.sqrt(100.0 - u**2), r * u], axis=1)
        for points in (x, x[:, [2, 1, 0]]):
            assert not shape.past_border(points).any() and np.abs(shape.closest(points).g - depth).max() < 5e-3
            assert np.abs(shape.closest(points).n[:, 0 if points is x else 2]).max() > np.sin(np.radians(1.0))
    forces = []
    for tool in ("type: stl, file: octant.stl", "type: sphere, radius: 10"):
        text = QUARTER.replace("TOOL", tool).replace("at: [0, 6, 0]", "at: [0, 16, 0]" if "sphere" in tool else "at: [0, 6, 0]")
        forces.append([i.force("t").y for i in pr.solve(loads(text, folder=folder).problem)][-1])
    assert forces[0] == pytest.approx(forces[1], rel=2e-3)


BESIDE = """
name: beside
space: solid
bodies:
  b: {mesh: {type: box, size: [20, 4, 20], n: [10, 2, 10], origin: [-10, 0, -10]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools:
  t: {TOOL}
contacts: [{surface: b.top, against: t}]
fixed: {b.bottom: xyz}
steps: [{name: press, move: {t: {y: -0.1}}, increments: 1}]
"""


@pytest.mark.parametrize("key", ["touching", "above"])
@pytest.mark.parametrize("x", [9.0, 12.0, 15.0, 17.0])
def test_a_cap_half_beside_a_body_is_placed_as_its_sphere(folder, x, key):
    """By what meets along the way: within the height of a chord of where the sphere of the cap stands."""
    points, triangles = octant(50.0, 9)
    whole = [np.stack([a * points[:, 0], points[:, 1], b * points[:, 2]], 1) for a in (1, -1) for b in (1, -1)]
    turned = [triangles if k in (0, 3) else triangles[:, ::-1] for k in range(4)]
    number = [t + k * len(points) for k, t in enumerate(turned)]
    write(folder / "cap.stl", np.concatenate(whole), np.concatenate(number))
    at = []
    for tool in ("type: stl, file: cap.stl", "type: sphere, radius: 10"):
        text = BESIDE.replace("TOOL", f"{tool}, {key}: b.top, at: [{x}, 0, 0]")
        at.append(pr.discretise(loads(text, folder=folder).problem).tools[0].at[1])
    assert at[0] + 10.0 == pytest.approx(at[1], abs=0.02)


TOOLS_WITH_AN_END = {
    "cap": "type: stl, file: octant.stl",
    "plate": "type: stl, file: plate.stl",
    "sphere": "type: sphere, radius: 4",
    "round punch": "type: revolved, section: {type: stamp, width: 8, fillet: 0.5}",
    "disc": "type: revolved, section: {type: polygon, points: [[0, 0], [4, 0], [4, 5], [0, 5]], fillet: 0.5}",
    "torus": "type: revolved, section: {type: circle, radius: 1, at: [4, 0]}",
    "roll": "type: extruded, section: {type: circle, radius: 4}",
    "bar": "type: extruded, section: {type: stamp, width: 8, fillet: 0.5}",
    "pointed": "type: revolved, section: {type: profile, points: [[0, 0], [4, 2], [4, 6]]}",
    "polyhedron": "type: polyhedron, points: [[-4, 0, -4], [4, 0, -4], [4, 0, 4], [-4, 0, 4], [0, 5, 0]], radius: 0.1",
    "square": (
        "type: swept, section: {type: profile, points: [[-4, 0], [0, 0], [0, 6]], fillet: [0, 1, 0]}, "
        "plan: {type: polygon, points: [[-4, -4], [4, -4], [4, 4], [-4, 4]], fillet: 1.2}"
    ),
}


@pytest.mark.parametrize("tool", TOOLS_WITH_AN_END)
def test_a_tool_beside_the_body_it_is_to_touch_is_refused_with_where_it_lies(folder, tool):
    """One sentence; half beside it is placed, and no node lies in it."""
    words = r"never meets 'b.top': it passes beside it, from .* along \+x where that is from -10 to 10"
    write(folder / "octant.stl", *octant())
    write(folder / "plate.stl", np.array([[-4.0, 0, -4], [4, 0, -4], [4, 0, 4], [-4, 0, 4]]), np.array([[0, 1, 2], [0, 2, 3]]))
    for x, key in ((18, "touching"), (50, "above")):
        text = BESIDE.replace("TOOL", f"{TOOLS_WITH_AN_END[tool]}, {key}: b.top, at: [{x}, 0, 0]")
        with pytest.raises(pr.PrensaError, match=words):
            pr.discretise(loads(text, folder=folder).problem)
    half = BESIDE.replace("TOOL", f"{TOOLS_WITH_AN_END[tool]}, touching: b.top, at: [{8 if tool == 'cap' else 12}, 0, 0]")
    system = pr.discretise(loads(half, folder=folder).problem)
    placed = system.tools[0]
    assert abs(placed.shape.closest(system.X - placed.at).g.min()) < 1e-6


@pytest.mark.parametrize(
    ("tool", "words"),
    [
        ("type: sphere, radius: 0.3, touching: b.top, at: [1, 0, 1]", r"it goes in between its nodes, as at \(1, 4, 1\), where"),
        ("type: stl, file: octant.stl, scale: 0.05, touching: b.top, at: [0.9, 0, 0.9]", "it goes in between its nodes.*'unit'"),
        ("type: plane, normal: [0, 1, 0], touching: b.top", "never meets 'b.top'; change 'at'"),
    ],
)
def test_why_a_tool_cannot_be_placed(folder, tool, words):
    """Between nodes; a plane that looks the other way is beside nothing."""
    write(folder / "octant.stl", *octant())
    with pytest.raises(pr.PrensaError, match=words):
        pr.discretise(loads(BESIDE.replace("TOOL", tool), folder=folder).problem)


def test_what_files_get_wrong_is_mended(folder):
    """Corners that differ by round-off are joined, triangles that look the other way turned; both are reported."""
    points, triangles = icosphere(1.0, 1)
    triangles[5] = triangles[5, ::-1]
    loose = points[triangles].reshape(-1, 3) * (1.0 + 1e-8 * np.random.default_rng(0).normal(size=(3 * len(triangles), 1)))
    path = write(folder / "loose.stl", loose, np.arange(len(loose)).reshape(-1, 3), binary=False)
    tool = pr.Stl(path)
    surface = tool.shape(DOWN, 0.0).surface
    assert (surface.closed, surface.turned, len(surface.points)) == (True, 1, len(points))
    assert tool.notes() == ("loose.stl: 1 triangles looked the other way than the others, and are turned",)
    twice = pr.Stl(write(folder / "twice.stl", points, np.concatenate([triangles, triangles[3:5, [2, 0, 1]]])))
    assert (twice.shape(DOWN, 0.0).surface.closed, len(twice.shape(DOWN, 0.0).surface.triangles)) == (True, len(triangles))
    assert "twice.stl: 2 triangles were there twice, and count once" in twice.notes()


CASE = """
name: stl
space: solid
bodies:
  b: {mesh: {type: box, size: [4, 2, 1], n: [8, 4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools:
  t: {type: stl, file: die.stl, touching: b.top, at: [0, 0, 0]}
contacts: [{surface: b.top, against: t}]
fixed: {b.bottom: y, b.left: x, b.back: z}
steps: [{name: press, move: {t: {y: -0.02}}, increments: 1}]
"""


def test_units_turns_and_texts(folder):
    """One of the file's unit is a length of the case, by its name or a number; turned; what is written is read again."""
    given = loads(CASE.replace("die.stl,", "die.stl, unit: inch, scale: 0.5, turn: [0, 90 deg, 0],"), folder=folder).problem
    size = np.ptp(given.tools["t"].shape(DOWN, 0.0).surface.points, axis=0)
    assert np.allclose(size, [12.7 * 40, 12.7 * 3, 12.7 * 40], rtol=1e-6)
    assert loads(pr.dump(given)).problem == given
    assert pr.discretise(loads(CASE, folder=folder).problem).tools[0].at == pytest.approx([0.0, 2.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("die.stl", "nothing.stl", "7:.*STL file 'nothing.stl': there is no such file; the folder has"),
        ("die.stl", "die.step", "7:.*is a STEP file: make triangles of it, prensa import die.step --out die.stl"),
        ("die.stl", "case.yaml", "'case.yaml' is not an STL file that can be read"),
        ("die.stl", "inside_out.stl", "the surface in 'inside_out.stl' is inside out.* 'reverse: true'"),
        ("die.stl", "three.stl", "3 triangles of 'three.stl' meet in one edge, near .0.5, 0, 0. of the file"),
        ("die.stl,", "die.stl, scale: 0,", "scale .* must be greater than 0"),
        ("die.stl,", "die.stl, unit: kN,", "unit.*'1 kN' is not a length"),
    ],
)
def test_mistakes_in_files_are_reported(folder, old, new, words):
    """With the line and a remedy, before anything is solved."""
    (folder / "case.yaml").write_text(CASE)
    x = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])
    write(folder / "three.stl", x, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]]))
    with pytest.raises(pr.CaseError, match=words):
        loads(CASE.replace(old, new), folder=folder)


def test_a_file_that_is_cut_off_is_named_with_what_is_missing(folder):
    """Binary, after 50 of its triangles; a text that is none is said to be that, without words of the program."""
    (folder / "cut.stl").write_bytes((folder / "ball.stl").read_bytes()[: 84 + 50 * 50 + 7])
    with pytest.raises(pr.CaseError, match=r"'cut\.stl' is cut off: its header says 1280 triangles, and 50 are in it"):
        loads(CASE.replace("die.stl", "cut.stl"), folder=folder)
    (folder / "notes.stl").write_text("no triangles here\n" * 9)
    with pytest.raises(pr.CaseError, match=r"'notes\.stl' is not an STL file that can be read, neither as text nor") as said:
        loads(CASE.replace("die.stl", "notes.stl"), folder=folder)
    assert "Error" not in str(said.value)


def test_of_a_closed_surface_that_looks_outwards_the_normals_are_not_in_doubt(folder):
    """Too far away: its place and its unit are; of one that was turned by 'reverse' the normals too."""
    assert "normals" not in pr.Stl(str(folder / "ball.stl")).hint() and "'unit'" in pr.Stl(str(folder / "ball.stl")).hint()
    assert "normals" in pr.Stl(str(folder / "ball.stl"), reverse=True).hint()


@pytest.mark.parametrize("middle", [True, False], ids=["fan", "corners alone"])
def test_a_flat_within_fillets_is_flat_whatever_its_triangles(folder, middle):
    """The end of a round punch, as a fan about its middle or between its corners, beside a fillet of unlike triangles.

    The profile of the fillet has its points at uneven angles, other ones in each meridian: nothing of it is a regular strip.
    """
    rng, n, m, radius, fillet = np.random.default_rng(3), 40, 7, 5.0, 1.5
    around = 2.0 * np.pi * np.arange(n) / n
    down = np.radians(np.linspace(0.0, 90.0, m + 1) + np.r_[0.0, rng.uniform(-4.0, 4.0, m - 1), 0.0])
    rings = []
    for k, t in enumerate(down):
        a = around + (0.5 * k + (rng.uniform(-0.3, 0.3, n) if 0 < k < m else 0.0)) * 2.0 * np.pi / n
        r = radius - fillet + fillet * np.sin(t)
        rings.append(np.stack([r * np.cos(a), np.full(n, fillet - fillet * np.cos(t)), r * np.sin(a)], axis=1))
    i, j = np.arange(n), (np.arange(n) + 1) % n
    triangles = []
    for k in range(m):
        a, b, c, d = k * n + i, k * n + j, (k + 1) * n + i, (k + 1) * n + j
        triangles += [np.stack([a, b, c], 1), np.stack([b, d, c], 1)]
    points = np.concatenate([*rings, [[0.0, 0.0, 0.0]]])
    flat = np.stack([j, i, np.full(n, len(points) - 1)], 1) if middle else np.stack([i[2:], i[1:-1], np.zeros(n - 2, int)], 1)
    shape = pr.Stl(write(folder / f"end{middle}.stl", points, np.concatenate([*triangles, flat]))).shape(DOWN, 0.0)
    x = np.stack([*rng.uniform(-2.4, 2.4, (2, 300)), np.zeros(300)], axis=1)[:, [0, 2, 1]]
    x[:, 1] = rng.uniform(-0.1, 0.1, 300)
    seen = shape.closest(x)
    sign = np.sign(seen.n[0, 1])
    assert np.abs(seen.n - [0.0, sign, 0.0]).max() < 1e-12 and np.abs(seen.g - sign * x[:, 1]).max() < 1e-6
    # Far from the fillet, on its outer side: patches that are followed beyond their sides do not turn over.
    t, a, far = rng.uniform(0.1, 1.4, 4000), rng.uniform(0.0, 2.0 * np.pi, 4000), rng.uniform(0.0, 6.0, 4000)
    r, y = radius - fillet + (fillet + far) * np.sin(t), fillet - (fillet + far) * np.cos(t)
    off = np.abs(shape.closest(np.stack([r * np.cos(a), y, r * np.sin(a)], axis=1)).g - far * -sign)
    assert off.max() < 0.03 * fillet


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ((("die.stl,", "die.stl, reverse: true,"),), "never meets 'b.top'.* look the wrong way .leave 'reverse: true' out"),
        (
            (("die.stl,", "die.stl, reverse: true,"), ("touching: b.top, at: [0, 0", "at: [0, 2")),
            "leave 'reverse: true' out, or name",
        ),
        ((("die.stl,", "die.stl, unit: m,"),), "the tool measures 2e.04 mm and the bodies 4: an STL file states no unit"),
        (
            (("die.stl,", "ball.stl, scale: 0.02,"),),
            "tools.t.unit: the tool measures 0.399 mm, and the smallest element of 'b.top' 0.5: an STL file states no unit",
        ),
        ((("touching: b.top, at: [0, 0", "at: [0, 1.5"),), "it starts 0.5 inside 'b.top', .* move the tool by .0, 0.5, 0. mm"),
    ],
)  # fmt: skip
def test_mistakes_of_place_are_reported(folder, changes, words):
    """Normals the wrong way, another unit, a body inside the tool."""
    from prensa.checks.before.preflight import preflight

    text = CASE
    for old, new in changes:
        text = text.replace(old, new)
    with pytest.raises(pr.PrensaError, match=words):
        found = [*preflight(pr.discretise(loads(text, folder=folder).problem))]
        raise pr.PrensaError("; ".join(map(str, found)))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ((), r"^$"),
        ((("die.stl", "upright.stl"),), r"it faces -z and is to be turned \('turn'\)"),
        ((("die.stl", "upright.stl, turn: [-90 deg, 0, 0]"),), r"^$"),
        (
            (("die.stl", "upright.stl"), ("touching: b.top, at: [0, 0, 0]", "at: [0, 22, 1]")),
            r"the surface faces -z, but the tool moves along -y, .* turn it, as with 'turn: \[-90 deg, 0, 0\]'$",
        ),
        ((("y: -0.02", "y: -0.02, x: 0.1"),), r"^$"),
    ],
    ids=["in order", "touching", "turned", "at a place", "aslant"],
)  # fmt: skip
def test_a_surface_that_looks_past_its_way_is_turned(folder, changes, words):
    """A die drawn with z upright, as CAD programs do, in a case that presses along y; nothing is said of one in order."""
    from prensa.checks.before.tool_faces import tool_faces

    points, triangles = extruded(faceted(DIE_PROFILE, 2.0), 20.0)
    write(folder / "upright.stl", points[:, [0, 2, 1]] * [1.0, -1.0, 1.0], triangles)
    text = CASE
    for old, new in changes:
        text = text.replace(old, new)
    try:
        found = "; ".join(map(str, tool_faces(pr.discretise(loads(text, folder=folder).problem))))
    except pr.PrensaError as error:
        found = str(error)
    assert re.search(words, found), found


def test_check_says_where_a_surface_looks(folder):
    """An open one by its borders; of a closed one its largest flat, if it has one."""
    said = {}
    for name in ("die.stl", "ball.stl", "punch.stl"):
        tool = pr.Stl(str(folder / name) if name != "punch.stl" else punch(folder))
        said[name] = tool.details(tool.shape(DOWN, 0.0), DOWN)
    assert "open, faces -y," in said["die.stl"]
    assert "looks" not in said["ball.stl"]
    assert "good for contacts deeper than 0.31, normals off by up to 2.3° on slivers" in said["die.stl"]
    assert "closed, its largest flat faces +y," in said["punch.stl"]


def test_a_run_says_how_coarse_it_is(folder, tmp_path, caplog):
    """Chords of more than 2 % of the depth, and borders within the contact; fields have the tools at their places."""
    text = CASE.replace("size: [4,", "size: [8,").replace("y: -0.02", "y: -0.25").replace("at: [0, 0, 0]", "at: [0, 0, -19.5]")
    problem = loads(text, folder=folder).problem
    with caplog.at_level("WARNING", "prensa"):
        fields = vtk.Fields(tmp_path, problem=problem)
        for increment in pr.solve(problem):
            fields.append(increment)
    said = " ".join(r.message for r in caplog.records)
    assert re.search(r"an open border of its surface presses within 'b.top', as near \(.*\): nothing presses past it", said)
    assert re.search("leave chords of 0.0062 mm .9° between them., 2.5 % of the depth of contact 0.249", said)
    grid = meshio.read(tmp_path / "fields" / "tools_0001.vtu")
    tool = problem.tools["t"]
    assert np.allclose(grid.points, tool.shape(DOWN, 0.0).surface.points + np.array([0.0, 1.75, -19.5]))
    assert (tmp_path / "fields.pvd").read_text().count('part="1"') == 1
    assert len(vtk.read_collection(tmp_path / "fields.pvd")) == 1


# ------------------------------------------------------------------------------------------------------- places on seams
def cap_of_meridians(file, radius, meridians):
    """A cap of 60° with a corner at its lowest point, from which the sides of triangles run out along meridians."""
    rings = meridians // 3
    a, b = np.radians(60.0) * np.arange(1, rings + 1) / rings, 2.0 * np.pi * np.arange(meridians) / meridians
    x, z = (np.outer(np.sin(a), f(b)) for f in (np.cos, np.sin))
    at = radius * np.stack([x, -np.sqrt(1.0 - x**2 - z**2), z], axis=-1)
    number = 1 + np.arange(rings * meridians).reshape(rings, meridians)
    nxt = np.roll(number, -1, axis=1)
    fan = np.stack([np.zeros(meridians, dtype=int), number[0], nxt[0]], axis=1)
    rest = [np.stack(c, axis=-1).reshape(-1, 3) for c in (
        (number[:-1], number[1:], nxt[:-1]), (nxt[:-1], number[1:], nxt[1:]),
    )]  # fmt: skip
    write(file, np.concatenate([[[0.0, -radius, 0.0]], at.reshape(-1, 3)]), np.concatenate([fan, *rest]))


@pytest.mark.parametrize(("meridians", "mu", "x"), [(36, 0.0, 0.0), (12, 0.3, 2.5), (24, 0.1, 1.25)])
def test_nodes_that_symmetry_keeps_on_sides_and_corners_of_triangles(tmp_path, meridians, mu, x):
    """A whole block: its nodes in z = 0 are below meridians, one below the pole; forces of the exact sphere to half a percent."""
    cap_of_meridians(tmp_path / "cap.stl", 10.0, meridians)
    forces = []
    for tool in (pr.Stl(str(tmp_path / "cap.stl"), at=(x, 14.0, 0.0)), pr.Sphere(10.0, at=(x, 14.0, 0.0))):
        problem = pr.Problem(
            "seam", space="solid", friction=pr.Coulomb(mu),
            bodies={"b": pr.Body(pr.Box((10.0, 4.0, 10.0), (8, 3, 8), (-5.0, 0.0, -5.0)), pr.NeoHooke(1000.0, 0.45))},
            tools={"t": tool}, contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "xyz"},
            steps=(
                pr.Step("press", move={"t": pr.Motion(y=-0.6)}, increments=4),
                pr.Step("slide", by={"t": pr.Motion(x=0.5)}, increments=4),
            ),
        )  # fmt: skip
        increments = list(pr.solve(problem))
        assert sum(i.statistics.cutbacks for i in increments) == 0
        forces.append([i.force("t")[:3] for i in increments if i.end_of_step])
    ours, exact = np.array(forces)
    assert np.abs(ours - exact).max() < 0.005 * np.abs(exact).max()
