"""Measures of bodies in space: places on faces and inside, cuts, extents, volumes, areas, fields, moments of supports."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.measures import parse
from prensa.measures.grammar import _arguments
from prensa.mesh.faces import enclosed_volume, face_areas, located, multilinear, nearest_on_faces
from prensa.mesh.generate import mesh_of
from prensa.model.schema import loads

BOX = pr.Box((4.0, 2.0, 3.0), (4, 2, 3))
GRADIENT = np.array([[0.05, 0.02, -0.03], [0.01, -0.04, 0.02], [0.03, 0.01, 0.06]])
"""Of a displacement that is linear in the coordinates."""


def problem(**more):
    """A box without anything on it, or with what is given."""
    given = {"bodies": {"b": pr.Body(BOX, pr.J2(1000.0, 0.3, pr.Perfect(50.0)))}, "steps": (pr.Step("s"),)}
    return pr.Problem("box", space="solid", **given | more)


class Posed:
    """An increment whose shape is the box after a linear displacement, without a solve."""

    def __init__(self):
        from prensa.measures.grammar import undeformed

        shape = undeformed(mesh_of(BOX))
        self.shapes = {"b": type(shape)(shape.X, shape.X @ (np.eye(3) + GRADIENT).T, shape.X, shape.cells, shape.edges, {})}


def value(text):
    """A measure of the posed box."""
    return parse(text, problem()).value(Posed())


F = np.eye(3) + GRADIENT


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("b.top.y at X=1.3, Z=0.7", (F @ [1.3, 2.0, 0.7])[1]),
        ("b.uz at X=1.3, Y=0.4, Z=0.7", (GRADIENT @ [1.3, 0.4, 0.7])[2]),
        ("b.right.ux at Y=1.9, Z=3", (GRADIENT @ [4.0, 1.9, 3.0])[0]),
        ("b.z near (4, 2, 3)", (F @ [4.0, 2.0, 3.0])[2]),
        ("b.top.max.x at Z=1.5", (F @ [4.0, 2.0, 1.5])[0]),
        ("b.min.y at X=2", (F @ [2.0, 0.0, 0.0])[1]),
        ("b.max.z", (F @ [4.0, 2.0, 3.0])[2]),
        ("b.depth", (F @ [4.0, 2.0, 3.0])[2]),
        ("b.top.width", (F @ [4.0, 0.0, 0.0])[0] - (F @ [0.0, 0.0, 3.0])[0]),
        ("b.volume", 24.0 * np.linalg.det(F)),
        ("distance(b.top at X=1, Z=2, b.bottom at X=3, Z=1)", np.linalg.norm(F @ [2.0, -2.0, -1.0])),
        ("change(b.volume)", 24.0 * (np.linalg.det(F) - 1.0)),
        ("b.top.surface_expansion", np.linalg.norm(np.cross(F[:, 2], F[:, 0]))),
        ("thickness(b.top, b.bottom)", 2.0 * np.linalg.det(F) / np.linalg.norm(np.cross(F[:, 2], F[:, 0]))),
        ("thickest(b.top at X=2, Z=1.5, b.bottom)", 2.0 * np.linalg.det(F) / np.linalg.norm(np.cross(F[:, 2], F[:, 0]))),
        ("angle(b.top at X=1, Z=2, b.top at X=3, Z=2)", np.degrees(np.arctan2(F[1, 0], F[0, 0]))),
        ("angle(b.right at Y=2, Z=2, b.right at Y=2, Z=1)", np.degrees(np.arctan2(-F[2, 2], -F[0, 2]))),
        ("b.top.barrel at Z=1.3", 0.0),
        ("thinning(b.top at X=2, Z=1.5, b.bottom)", 1.0 - np.linalg.det(F) / np.linalg.norm(np.cross(F[:, 2], F[:, 0]))),
    ],
)
def test_a_linear_displacement_is_read_exactly(text, expected):
    """Places, extents, distances, areas and volumes of a box that is stretched and sheared evenly, by its gradient."""
    assert value(text) == pytest.approx(expected, rel=1e-9, abs=1e-12)


ROUND = pr.Cylinder(10.0, 8.0, n=(2, 4, 8), angle=np.pi / 2)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("b.outer.barrel at Z=0", 1.0),
        ("b.outer.barrel at X=0", 1.0),
        ("b.outer.barrel at Y=4", 11.0 * (1.0 - np.sqrt(0.5))),
        (f"curvature(b.outer at X={10 * np.sin(np.pi / 8)}, Y=4, b.outer at X={10 * np.cos(np.pi / 8)}, Y=4)", 1.0 / 11.0),
        (f"radius(b.outer at X={10 * np.sin(np.pi / 8)}, Y=0, b.outer at X={10 * np.cos(np.pi / 8)}, Y=0)", 10.0),
    ],
)
def test_a_barrelled_cylinder_is_measured_along_its_cuts(text, expected):
    """A quarter of a cylinder with a parabola for its side: its rise in two planes of symmetry, its radius across the axis."""
    inc = Posed()
    mesh = mesh_of(ROUND)
    bulge = 1.0 + 0.1 * (1.0 - (mesh.points[:, 1:2] / 4.0 - 1.0) ** 2)
    x = mesh.points * np.hstack([bulge, np.ones_like(bulge), bulge])
    shape = inc.shapes["b"]
    inc.shapes = {"b": type(shape)(mesh.points, x, mesh.points, mesh.cells, mesh.edges, mesh.corners)}
    p = problem(bodies={"b": pr.Body(ROUND, pr.Elastic(1000.0, 0.3))})
    assert parse(text, p).value(inc) == pytest.approx(expected, rel=1e-9)


def test_places_of_the_deformed_body():
    """A place named by coordinates of now is there now, and is the material that came from where the gradient says."""
    assert value("b.ux at x=2, y=1, z=1.5") == pytest.approx(2.0 - np.linalg.solve(F, [2.0, 1.0, 1.5])[0], rel=1e-8)
    top = value("b.top.y at x=2, z=1.5")
    X, Z = np.linalg.solve(F[np.ix_([0, 2], [0, 2])], np.array([2.0, 1.5]) - F[[0, 2], 1] * 2.0)
    assert top == pytest.approx((F @ [X, 2.0, Z])[1], rel=1e-8)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("b.top.y at X=1", "is a line in space: give two coordinates"),
        ("b.top.x at X=1, Y=2", "on a side give the two coordinates that change along it"),
        ("b.mises at X=1, y=2, Z=1", "all of the deformed"),
        ("b.y at X=9, Y=1, Z=1", "no place of b is at X=9, Y=1, Z=1"),
        ("b.y at X=1, Z=1", "in 2 places"),
        ("b.top.barrel", "needs the plane of the cut: 'b.top.barrel at Z=0'"),
        ("b.barrel at Z=0", "a barrel is of a side along a cut"),
        ("b.top.barrel at Z=9", "does not reach Z = 9"),
        ("b.top.barrel at Y=2", "lies in that plane"),
        ("curvature(b.top at X=1, Z=1, b.top at X=3, Z=2)", "share a coordinate"),
        ("angle(b.top at X=1, Z=1, b.bottom at X=3, Z=1)", "of two places on a side"),
        ("b.fill", "bodies in space have no outline"),
        ("angle(b near (0, 0, 0), b near (1, 0, 0))", "share a coordinate"),
        ("b.top.angle at X=1, Z=1", "bodies in space have no outline"),
        ("b.x near (1, 2)", "three coordinates"),
        ("b.top.mises at X=1, Y=2, Z=1", "leave out 'top'"),
        ("b.max.stres.yz", "did you mean 'b.max.stress.yz'"),
    ],
)
def test_what_is_no_measure_is_refused(text, words):
    """With what to write instead."""
    with pytest.raises(pr.PrensaError, match=words):
        parse(text, problem())


def test_elements_are_searched_exactly():
    """Shaken bricks and faces: a place in each is found again, by the inverse map, in the element that it was taken from."""
    rng = np.random.default_rng(7)
    mesh = mesh_of(pr.Box((2.0, 2.0, 2.0), (3, 3, 3)))
    x = mesh.points + rng.uniform(-0.1, 0.1, mesh.points.shape)
    for cell in (0, 13, 26):
        at = rng.uniform(-0.9, 0.9, (1, 3))
        place = multilinear(at, 8)[0][0] @ x[mesh.cells[cell]]
        found, where = located(x[mesh.cells], place)
        assert found.tolist() == [cell]
        assert np.allclose(where, at, atol=1e-7)
    volume = enclosed_volume(x, mesh.boundary)
    assert volume == pytest.approx(sum(enclosed_volume(x, outside_of(c)) for c in mesh.cells), rel=1e-12)
    assert face_areas(mesh.points, mesh.boundary).sum() == pytest.approx(24.0)


def outside_of(cell):
    """The six faces of one brick."""
    from prensa.mesh.bricks import outside

    return outside(cell[None])


def test_the_nearest_point_of_a_warped_face():
    """Newton's foot against the least over a fine grid of the face, to its spacing squared."""
    rng = np.random.default_rng(3)
    face = np.array([[0, 0, 0], [1, 0, 0.3], [1.1, 0, 1.2], [0, 0.2, 1.0]])
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 401)] * 2), axis=-1).reshape(-1, 2)
    fine = multilinear(grid, 4)[0] @ face
    for p in rng.uniform(-1.0, 2.0, (6, 3)):
        least = np.linalg.norm(fine - p, axis=1).min()
        assert nearest_on_faces(p[None], face, np.array([[0, 1, 2, 3]]))[0] == pytest.approx(least, abs=1e-5)


def test_the_volume_of_the_plane():
    """Of a section, of its thickness, and of the body of revolution that it makes (Pappus)."""
    for space, origin, expected in (("plane strain", 0.0, 24.0), ("axisymmetric", 1.0, 2 * np.pi * 3.0 * 8.0)):
        thick = {"thickness": 3.0} if space == "plane strain" else {}
        p = pr.Problem(
            "r", space=space, bodies={"b": pr.Body(pr.Rectangle((4.0, 2.0), (2, 1), (origin, 0.0)), pr.Elastic(1.0, 0.3))},
            steps=(pr.Step("s"),), **thick,
        )  # fmt: skip
        from prensa.measures.grammar import undeformed

        posed = type("Posed", (), {"shapes": {"b": undeformed(mesh_of(p.bodies["b"].mesh))}})()
        assert parse("b.volume", p).value(posed) == pytest.approx(expected)


@pytest.fixture(scope="module")
def twisted():
    """A block under a slanted plane that rubs, on a bonded base."""
    p = problem(
        tools={"t": pr.Plane(normal=(0.1, -1.0, 0.05), at=(4.0, 2.0, 0.0))}, contacts=(pr.Contact("b.top", "t"),),
        fixed={"b.bottom": "xyz"}, friction=pr.Coulomb(0.2), bodies={"b": pr.Body(BOX, pr.J2(1000.0, 0.3, pr.Perfect(50.0)))},
        steps=(pr.Step("press", move={"t": pr.Motion(x=0.1, y=-0.3)}, increments=3),),
    )  # fmt: skip
    *_, last = pr.solve(p)
    return last


def test_six_sums_are_in_balance(twisted):
    """Forces and moments of tool and support about the origin, from the columns of the history."""
    last = twisted
    f = np.array(last.force("t"))
    at = last.tools["t"].at + np.array(last.tools["t"].place[:3])
    on_support = np.array([last.measure(f"fixed.b.bottom.{c}") for c in ("fx", "fy", "fz", "mx", "my", "mz")])
    on_tool = np.concatenate([f[:3], f[3:] + np.cross(at, f[:3])])
    size = np.abs(f[:3]).max()
    assert np.abs(on_tool - on_support).max() < 1e-7 * size
    assert np.abs(on_support[3:]).max() > 0.1 * size


def test_fields_of_a_solved_body(twisted):
    """Largest values and where they are; a field in the middle of a brick is the mean of its nodes; areas in contact."""
    last = twisted
    body = last.bodies["b"]
    k = int(np.argmax(body.mises))
    assert last.measure("b.max.mises") == body.mises[k]
    assert last.measure("b.max.mises.place.z") == body.x[k, 2]
    assert last.measure("b.max.stress.yz") == body.stress[:, 4].max()
    inside = last.measure("b.plastic_strain at X=2.5, Y=1.5, Z=1.5")
    cell = body.cells[np.argmin(np.linalg.norm(body.X[body.cells].mean(axis=1) - (2.5, 1.5, 1.5), axis=1))]
    assert inside == pytest.approx(body.plastic_strain[cell].mean())
    assert 0.8 < last.measure("b.top-t.surface_expansion") < 1.5
    assert last.measure("b.max.surface_expansion") > 1.0
    assert last.measure("b.volume") == pytest.approx(24.0, rel=0.05)


def test_the_page_has_measures_that_exist():
    """What docs/guide/space.md lists is read in its case."""
    page = (Path(__file__).parents[2] / "docs" / "guide" / "space.md").read_text(encoding="utf-8")
    case = loads(re.search(r"```yaml\n(.*?)```", page, re.S)[1])
    block = re.search(r"## Measures.*?```text\n(.*?)```", page, re.S)[1]
    texts = [t for line in block.splitlines() for t in _arguments(re.split(r"\s{3,}", line)[0]) if t and "…" not in t]
    assert len(texts) > 15
    for text in texts:
        parse(text, case.problem)


def test_fields_on_cuts(twisted):
    """On planes and lines through the nodes those of the nodes there; between them linear between the two planes of nodes."""
    last, body = twisted, twisted.bodies["b"]
    at = {k: np.isclose(body.X[:, 0], k) for k in (2.0, 3.0)}
    assert last.measure("b.max.mises at X=2") == pytest.approx(body.mises[at[2.0]].max())
    assert last.measure("b.min.stress.yy at X=3") == pytest.approx(body.stress[at[3.0], 1].min())
    on_line = at[2.0] & np.isclose(body.X[:, 2], 1.0)
    assert on_line.sum() == 3
    assert last.measure("b.max.plastic_strain at X=2, Z=1") == pytest.approx(body.plastic_strain[on_line].max())
    pairs = {tuple(x[1:]): {} for x in body.X}
    for x, v in zip(body.X, body.mises):
        pairs[tuple(x[1:])][float(x[0])] = v
    assert last.measure("b.max.mises at X=2.25") == pytest.approx(max(0.75 * p[2.0] + 0.25 * p[3.0] for p in pairs.values()))
    top = at[2.0] & np.isclose(body.X[:, 1], 2.0)
    assert last.measure("b.top.max.mises at X=2") == pytest.approx(body.mises[top].max())


@pytest.mark.parametrize(("middle", "highest"), [((0.3, 0.25), 0.3), ((0.5, 0.7), 0.294), ((-0.2, -0.1), 0.285)])
def test_extremes_of_quadratic_tetrahedra_lie_on_their_faces(middle, highest):
    """A face that bulges as a paraboloid is highest at its top, inside of it, on a side or at a corner, not at a node alone."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [0, -1, 0]])
    pairs = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    X = np.concatenate([corners, [0.5 * (corners[a] + corners[b]) for a, b in pairs]])
    mesh = pr.Tetrahedra(points=X.tolist(), cells=[list(range(10))], boundaries={"top": [0, 1, 2]})
    from prensa.measures.grammar import undeformed

    shape = undeformed(mesh_of(mesh))
    x = shape.X.copy()
    rise = 1.0 - (x[:, 0] - middle[0]) ** 2 - (x[:, 2] - middle[1]) ** 2
    x[:, 1] += 0.3 * rise

    class Bulged:
        shapes = {"b": type(shape)(shape.X, x, shape.X, shape.cells, shape.edges, {})}  # noqa: RUF012

    case = problem(bodies={"b": pr.Body(mesh, pr.J2(1000.0, 0.3, pr.Perfect(50.0)), "t10")})
    assert parse("b.max.y", case).value(Bulged()) == pytest.approx(highest, rel=1e-12)
    lowest = x[:4, 1].min()
    assert parse("b.height", case).value(Bulged()) == pytest.approx(highest - lowest, rel=1e-12)
