"""Sections that touch their axis, revolved into bricks: with a square core, or with wedges."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.brick_checks import jacobians
from prensa.mesh.bricks import BrickMesh, bricks_behind, wedges
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import MeshError
from prensa.mesh.quality import quality

RECTANGLE = pr.Rectangle((10.0, 15.0), (6, 4))
BALL = pr.Disc(10.0, (8, 4), part="right")
WAVY = pr.Patch(((0, 0), (10, 3), (8, 15), (0, 12)), (6, 4))


def volume(mesh):
    return float(jacobians(mesh.points[mesh.cells]).sum())


def section_volume(section, angle):
    """Volume that a section sweeps by Pappus, of its quadrilaterals."""
    plane = mesh_of(section, "q4")
    x = plane.points[plane.cells]
    total = 0.0
    for a, b, c in ((0, 1, 2), (0, 2, 3)):
        t = x[:, [a, b, c]]
        u, v = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
        total += (0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) * t[..., 0].mean(axis=1)).sum()
    return total * angle


@pytest.mark.parametrize("core", ["square", "wedges"])
@pytest.mark.parametrize(
    ("section", "n", "degrees"),
    [(RECTANGLE, 8, 90), (RECTANGLE, 16, 360), (RECTANGLE, 4, 60), (WAVY, 12, 180), (BALL, 6, 90), (BALL, 24, 360)],
)
def test_bricks_fill_what_the_section_sweeps(section, n, degrees, core):
    """But for chords; they are positive, their faces look outwards, and each face of the outside has one name."""
    angle = np.radians(degrees)
    mesh = mesh_of(pr.Revolution(section, n, angle=angle, core=core))
    assert wedges(mesh.cells).any() == (core == "wedges")
    chords = np.sin(angle / n) / (angle / n)
    assert volume(mesh) == pytest.approx(section_volume(section, angle) * chords, rel=1e-12 if section is RECTANGLE else 3e-3)
    assert sum(map(len, mesh.edges.values())) == len(mesh.boundary)
    assert set(mesh.edges) >= ({"base", "cap"} if degrees < 360 else set())
    for faces in mesh.edges.values():
        a = mesh.points[faces]
        inside = mesh.points[mesh.cells[bricks_behind(faces, mesh.cells)]].mean(axis=1)
        assert (np.einsum("ki,ki->k", np.cross(a[:, 2] - a[:, 0], a[:, 3] - a[:, 1]), a.mean(axis=1) - inside) > 0).all()


def test_planes_between_the_pieces_of_a_core_have_the_mesh_of_the_section():
    """Of a quarter, both its ends: nodes of the section, and no others."""
    plane = mesh_of(WAVY, "q4").points
    mesh = mesh_of(pr.Revolution(WAVY, 8, angle=np.pi / 2, core="square"))
    for name, axis in (("base", 0), ("cap", 2)):
        there = mesh.points[np.unique(mesh.edges[name])]
        assert np.allclose(sorted(map(tuple, np.round(there[:, [axis, 1]], 9))), sorted(map(tuple, np.round(plane, 9))))
        assert np.abs(there[:, 2 - axis]).max() == 0.0


def test_a_core_is_a_core_where_there_is_room_for_one():
    """Without being asked; or else wedges, and an error with the remedy for who asks."""
    few = pr.Rectangle((10.0, 15.0), (4, 3))
    assert not wedges(mesh_of(pr.Revolution(few, 6, angle=np.pi / 2)).cells).any()
    for n, angle, why in (
        (8, np.pi / 2, "needs 5 columns"),
        (5, np.pi / 2, "not a multiple of 2"),
        (4, 0.5, "less than an eighth"),
    ):
        assert wedges(mesh_of(pr.Revolution(few, n, angle=angle)).cells).sum() == 3 * n
        with pytest.raises(MeshError, match=f"no square core.*{why}.*leave 'core' out"):
            mesh_of(pr.Revolution(few, n, angle=angle, core="square"))
    with pytest.raises(MeshError, match="crosses its axis: it comes to x = -1; draw it at x ≥ 0"):
        mesh_of(pr.Revolution(pr.Rectangle((2.0, 3.0), (2, 3), (-1.0, 0.0)), 8))
    with pytest.raises(pr.PrensaError, match="2 of them over 360° span half a turn"):
        pr.Cylinder(1.0, 1.0, (1, 1, 2))


def test_a_cylinder_is_a_revolved_rectangle():
    """Solid or with a bore; its sides and points have names of their own."""
    solid = mesh_of(pr.Cylinder(10.0, 15.0, (6, 4, 8), angle=np.pi / 2))
    assert np.array_equal(solid.points, mesh_of(pr.Revolution(RECTANGLE, 8, angle=np.pi / 2)).points)
    assert set(solid.edges) == {"bottom", "top", "outer", "base", "cap"}
    assert [solid.points[n].tolist() for n in (solid.corners["bottom-centre"], solid.corners["top-centre"])] == [
        [0.0, 0.0, 0.0],
        [0.0, 15.0, 0.0],
    ]
    ring = mesh_of(pr.Cylinder(10.0, 3.0, (3, 2, 24), bore=5.0, start=-1.0))
    assert set(ring.edges) == {"bottom", "top", "outer", "inner"}
    assert volume(ring) == pytest.approx(12 * np.sin(np.pi / 12) * 75.0 * 3.0)
    assert np.hypot(*ring.points[np.unique(ring.edges["inner"])][:, [0, 2]].T) == pytest.approx(5.0)
    assert (ring.points[:, 1].min(), ring.points[:, 1].max()) == (-1.0, 2.0)


@pytest.mark.parametrize("element", ["h8", "h8_fbar"])
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_wedges_and_cores_have_constant_stress(element, kinematics):
    """The patch test: nodes of the outside moved linearly, those inside follow, and stress is the same everywhere."""
    for core in ("wedges", "square"):
        mesh = mesh_of(pr.Revolution(pr.Rectangle((1.0, 1.0), (3, 2)), 4, angle=np.pi / 2, core=core))
        inside = np.setdiff1d(np.arange(len(mesh.points)), mesh.boundary)
        points = mesh.points.copy()
        points[inside] += 0.02 * np.random.default_rng(1).uniform(-1, 1, (len(inside), 3))
        outer = np.unique(mesh.boundary)
        sides = {f"n{k}": (int(n),) for k, n in enumerate(outer)}
        bricks = pr.Bricks(points.tolist(), mesh.cells.tolist(), sides)
        gradient = np.array([[0.01, 0.004, 0.0], [-0.002, -0.02, 0.003], [0.0, 0.006, 0.005]])
        fixed = {f"b.n{k}": pr.Fixed(**dict(zip("xyz", (gradient @ points[n]).tolist()))) for k, n in enumerate(outer)}
        *_, last = pr.solve(pr.Problem(
            "patch", space="solid", kinematics=kinematics, bodies={"b": pr.Body(bricks, pr.Elastic(1000.0, 0.3), element)},
            fixed=fixed, steps=(pr.Step("move", increments=1),),
        ))  # fmt: skip
        body = last.bodies["b"]
        assert np.abs(body.x - body.X - body.X @ gradient.T).max() < 1e-10
        assert np.ptp(body.stress, axis=0).max() < 1e-8 * np.abs(body.stress).max()


def test_a_brick_that_cannot_be_computed_is_refused():
    """Turned over, left-handed, on the same side of a face as another, or collapsed otherwise than a wedge; with what to do."""
    x = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=float)
    one = np.arange(8)[None]
    for cells, points, words in (
        (one[:, [4, 5, 6, 7, 0, 1, 2, 3]], x, "brick 0 near .* is left-handed; list its lower four nodes counter-clockwise"),
        (one, np.where(np.arange(8)[:, None] == 6, -2.0, x), "brick 0 near .* is turned over: its Jacobian is .*; move"),
        (one[:, [0, 1, 2, 3, 4, 5, 6, 0]], x[:7], "names a node twice"),
        (one[:, [0, 1, 2, 2, 4, 5, 5, 7]], x, "belongs to no brick|names a node twice"),
    ):
        with pytest.raises(MeshError, match=words):
            BrickMesh(points, cells, {})
    above = np.concatenate([x, x[4:] + np.array([0.1, 0.1, 1.0])])
    second = np.array([[4, 5, 6, 7, 8, 9, 10, 11]])
    assert len(BrickMesh(above, np.concatenate([one, second]), {}).boundary) == 10
    below = np.concatenate([x, x[4:] - np.array([0.1, 0.1, 0.5])])
    with pytest.raises(MeshError, match=r"bricks 0 and 1 .* lie on the same side of a common face: they overlap"):
        BrickMesh(below, np.concatenate([one, second[:, [4, 5, 6, 7, 0, 1, 2, 3]]]), {})


def test_quality_of_bricks():
    """Boxes are 1, a corner of 60° its sine; wedges are measured where they have three edges; long ones by their sides."""
    box = quality(mesh_of(pr.Box((4.0, 2.0, 1.0), (1, 1, 1))))
    assert box.line().startswith("H8: scaled Jacobian 1 … 1, aspect ratio 4 … 4")
    x = np.array([(0, 0), (1, 0), (1.5, 0.75**0.5), (0.5, 0.75**0.5)])
    leaning = np.concatenate([np.column_stack([x, np.full(4, z)]) for z in (0.0, 1.0)])
    assert quality(BrickMesh(leaning, np.arange(8)[None], {})).jacobian[0] == pytest.approx(0.75**0.5)
    few = quality(mesh_of(pr.Cylinder(1.0, 1.0, (1, 1, 6))))
    assert few.line().startswith("H8, 6 of them wedges")
    assert few.jacobian == pytest.approx(0.75**0.5)
    assert few.aspect == pytest.approx(1.0)


def test_converge_keeps_the_kind_of_the_bricks_at_the_axis():
    """Finer and coarser cylinders have a square core where the case has one; a sector may have a single layer."""
    from prensa.study.levels import _mesh

    def levels(mesh, factor):
        problem = pr.Problem("c", space="solid", bodies={"b": pr.Body(mesh, pr.Elastic(1.0, 0.3))}, steps=(pr.Step("s"),))
        return _mesh(problem, factor, {})[0]

    quarter = pr.Cylinder(10.0, 15.0, (6, 4, 8), angle=np.pi / 2)
    assert levels(quarter, 0.6) == {"bodies.b.mesh.n": "[4, 2, 4]"}
    assert levels(pr.Revolution(RECTANGLE, 8, angle=np.pi / 2), 0.6)["bodies.b.mesh.n"] == "4"
    assert levels(pr.Revolution(RECTANGLE, 5, angle=0.5), 0.25)["bodies.b.mesh.n"] == "1"
    assert levels(pr.Cylinder(10.0, 15.0, (1, 4, 4)), 0.25)["bodies.b.mesh.n"] == "[1, 1, 3]"
