"""Quadratic tetrahedra: patch tests, contact at the middle of their sides, recovered stresses, files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import block_of, respond, tetrahedra
from prensa.contact.faces import face_points
from prensa.contact.recovery_in_space import recover
from prensa.elements.shapes import t10, table, tetrahedron
from prensa.errors import PrensaError
from prensa.layout import TETRAHEDRON_EDGES
from prensa.mesh.bricks import outside
from prensa.system.state import State

SWIFT = pr.J2(200e3, 0.3, pr.Swift(565.0, 0.007, 0.26))


def test_shapes_are_one_at_their_node_and_have_exact_slopes():
    """N_a is 1 at node a and 0 at the others; slopes agree with differences; the rule integrates all quadratics."""
    corners = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    nodes = np.concatenate([corners, corners[np.array(TETRAHEDRON_EDGES)].mean(axis=1)])
    assert np.allclose([t10(*at)[0] for at in nodes], np.eye(10), atol=1e-15)
    at = np.array([0.3, 0.2, 0.1])
    for k in range(3):
        d = 1e-3 * np.eye(3)[k]
        assert np.allclose((t10(*(at + d))[0] - t10(*(at - d))[0]) / 2e-3, t10(*at)[1][:, k], atol=1e-12)
    t = table(10, tetrahedron())
    assert np.isclose(t.weight.sum(), 1.0 / 6.0, rtol=1e-15)
    assert np.isclose((t.weight * t.at[:, 0] ** 2).sum(), 1.0 / 60.0, rtol=1e-14)
    assert np.isclose((t.weight * t.at[:, 0] * t.at[:, 1]).sum(), 1.0 / 120.0, rtol=1e-14)


@pytest.mark.parametrize("case", [(pr.Elastic(200e3, 0.3), "small"), (SWIFT, "finite")], ids=["elastic", "j2"])
def test_patch(case):
    """A constant gradient on a skew mesh gives the law's stress at every point and no force on inner nodes, to 1e-12."""
    X, cells, inner = tetrahedra((2, 2, 2), (1.0, 1.2, 0.8), 0.2)
    block, pattern = block_of(X, cells, "t10", *case)
    assert np.isclose(block.volume.sum(), 0.96, rtol=1e-13)
    H = np.array([[0.02, 0.01, -0.005], [-0.01, -0.008, 0.004], [0.006, 0.012, -0.01]])
    r, _, result = respond(block, pattern, X, X @ H.T, block.undeformed)
    sigma = block.law.cauchy(block.at_law(result.history).reshape(-1, block.law.size))
    assert np.abs(sigma - sigma[0]).max() <= 1e-12 * np.abs(sigma).max()
    assert np.abs(r).max() > 0.0
    assert np.abs(r[inner]).max() <= 1e-12 * np.abs(r).max()


def bent(X, nu):
    """Displacements of pure bending of curvature 0.001 in the plane x, y."""
    x, y, z = X.T
    return 1e-3 * np.stack([x * y, -0.5 * (x**2 + nu * (y**2 - z**2)), -nu * y * z], axis=1)


def test_pure_bending_is_exact_and_its_stress_is_recovered_at_the_nodes():
    """Forces on inner nodes of a skew mesh are round-off, stresses at points and recovered ones are E κ y."""
    X, cells, inner = tetrahedra((3, 2, 2), (3.0, 1.0, 1.0), 0.2)
    block, pattern = block_of(X, cells, "t10", pr.Elastic(1000.0, 0.3), "small")
    r, _, result = respond(block, pattern, X, bent(X, 0.3), block.undeformed)
    assert np.abs(r[inner]).max() <= 1e-12 * np.abs(r).max()
    stress = block.law.cauchy(block.at_law(result.history).reshape(-1, block.law.size)).reshape(len(cells), 4, 6)
    height = np.einsum("qa,ma->mq", block.element.N, X[cells][..., 1])
    assert np.abs(stress[..., 0] - height).max() <= 1e-12
    nodal = recover(cells, block.volume, block.element.N, stress)
    assert np.abs(nodal[:, 0] - X[:, 1]).max() <= 1e-12
    assert np.abs(nodal[:, 1:]).max() <= 1e-12
    kept = recover(cells, block.volume, block.element.N, stress, np.ones(len(cells), dtype=bool))
    assert kept[:, 0].max() <= stress[..., 0].max()


# ---------------------------------------------------------------------------------------------------------------- contact
def test_faces_bear_at_the_middle_of_their_sides():
    """A third of the area each, corners none; a linear pressure on a slanted side has its resultant and its moments, exactly."""
    X, cells, _ = tetrahedra((2, 3, 2), (1.0, 1.0, 1.0))
    faces = outside(cells)
    faces = faces[(X[faces][..., 1] == 1.0).all(axis=1)]
    A = np.array([[2.0, 0.3, 0.1], [0.2, 1.5, -0.4], [-0.3, 0.1, 1.2]])
    x = X @ A.T
    points = face_points(x, cells, faces, np.full(len(cells), np.linalg.det(A) / len(cells)))
    assert np.array_equal(points.nodes, np.unique(faces[:, 3:]))
    weight, normal = points.weights(x), points.normals(x)
    n = -np.cross(A[:, 0], A[:, 2])
    assert weight.sum() == pytest.approx(np.linalg.norm(n), rel=1e-13)
    assert np.allclose(normal, n / np.linalg.norm(n), atol=1e-13)
    assert np.allclose(points.depth.max(), np.linalg.det(A) / np.linalg.norm(n) / 9.0)  # volume of a tetrahedron over its face
    pressure = lambda at: 3.0 + at @ [1.0, -2.0, 0.5]  # noqa: E731
    g, w = np.polynomial.legendre.leggauss(3)
    grid = np.stack(np.meshgrid(0.5 + 0.5 * g, [1.0], 0.5 + 0.5 * g, indexing="ij"), axis=-1).reshape(-1, 3) @ A.T
    share = np.outer(w, w).ravel() / 4.0 * np.linalg.norm(n)
    at = x[points.nodes]
    assert weight @ pressure(at) == pytest.approx(share @ pressure(grid), rel=1e-13)
    assert np.allclose(weight * pressure(at) @ at, share * pressure(grid) @ grid, rtol=1e-12)


def under_plane(skew=0.0, element=None, material=None, friction=None, travel=-0.05, increments=2, enforcement=None):
    """A block of tetrahedra, a unit cube held at three sides, under a plane."""
    X, cells, _ = tetrahedra((2, 2, 2), (1.0, 1.0, 1.0), skew)
    sides = {"top": np.flatnonzero(X[:, 1] > 1.0 - 1e-9)}
    sides |= {name: np.flatnonzero(X[:, k] < 1e-9) for k, name in enumerate("xyz")}
    mesh = pr.Tetrahedra(X.tolist(), cells.tolist(), {name: nodes.tolist() for name, nodes in sides.items()})
    return pr.Problem(
        "block", space="solid", friction=friction, bodies={"b": pr.Body(mesh, material or pr.Elastic(1000.0, 0.3), element)},
        tools={"t": pr.Plane(touching="b.top")},
        contacts=(pr.Contact("b.top", "t", enforcement=enforcement or pr.Penalty(k_n=1e5)),),
        fixed={f"b.{axis}": axis for axis in "xyz"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=travel)}, increments=increments),),
    )  # fmt: skip


def test_a_skew_block_under_a_plane_has_uniform_pressure(tmp_path):
    """To 1e-10 at all nodes in the middle of sides; fields in files have the same cells and stresses."""
    import meshio

    from prensa.output.vtk import read_fields, write_fields

    *_, increment = pr.solve(under_plane(skew=0.2))
    (contact,) = increment.contacts.values()
    X = increment.bodies["b"].X
    middles = np.unique(outside(increment.bodies["b"].cells)[:, 3:])
    assert set(contact.node) == set(middles[X[middles, 1] == 1.0])
    assert np.abs(contact.pressure - contact.pressure.mean()).max() <= 1e-10 * contact.pressure.mean()
    stress = increment.bodies["b"].stress
    assert np.abs(stress[:, 1] + contact.pressure.mean()).max() <= 1e-3 * contact.pressure.mean()  # areas are of the start
    written = write_fields(tmp_path / "0001.vtu", increment)
    assert meshio.read(written).cells[0].type == "tetra10"
    body = read_fields(written, ["b"])["b"]
    assert np.array_equal(body.cells, increment.bodies["b"].cells)
    assert np.allclose(body.stress, stress)


def test_tetrahedra_upset_as_bricks_do():
    """A plastic cube with friction, 10 %: the force of bricks, within 2 % on coarse meshes; it restarts and is drawn."""
    from prensa.output.plot import deformed
    from prensa.output.spatial import contact_pressures

    problem = under_plane(material=SWIFT, friction=pr.Coulomb(0.2), travel=-0.1, increments=4, enforcement=pr.Penalty())
    assert problem.element_name("b") == "t10"
    increments = list(pr.solve(problem))
    last = increments[-1]
    half = State.from_arrays(increments[1].state.arrays())
    again = [i.state.arrays() for i in pr.solve(problem, start=half)]  # bit for bit
    for one, other in zip(again, (i.state.arrays() for i in increments[2:]), strict=True):
        assert all(one[key].tobytes() == other[key].tobytes() for key in other)
    bricks = pr.Problem(
        "block", space="solid", friction=pr.Coulomb(0.2), bodies={"b": pr.Body(pr.Box((1.0,) * 3, (4,) * 3), SWIFT)},
        tools=problem.tools, contacts=(pr.Contact("b.top", "t"),),
        fixed={"b.left": "x", "b.bottom": "y", "b.back": "z"}, steps=problem.steps,
    )  # fmt: skip
    *_, increment = pr.solve(bricks)
    assert last.force("t").y == pytest.approx(increment.force("t").y, rel=0.02)
    assert abs(last.force("t").x - last.force("t").z) <= 1e-6 * last.force("t").y
    assert deformed(last, problem, "plastic_strain").axes
    pressure, (contact,) = contact_pressures(last, "b"), last.contacts.values()
    top = np.flatnonzero(last.bodies["b"].X[:, 1] == 1.0)
    assert (pressure[top] > 0.5 * contact.pressure.min()).all()  # corners have those around them
    assert pressure.max() == contact.pressure.max()


@pytest.mark.parametrize(("at", "reported"), [((0.5, 0.5), True), ((0.25, 0.25), False)], ids=["corner", "middle of a side"])
def test_a_corner_inside_a_small_ball_is_reported(at, reported, caplog):
    """A ball over a corner passes between the points of contact; over the middle of a side it is met."""
    problem = under_plane(enforcement=pr.Penalty())
    ball = pr.Revolved(pr.Circle(0.2), at=(at[0], 1.2, at[1]))
    steps = (pr.Step("press", move={"t": pr.Motion(y=-0.05)}, increments=1),)
    list(pr.solve(replace(problem, tools={"t": ball}, steps=steps)))
    assert ("of a tetrahedron, at (0.5, 1, 0.5), lies 0.05 inside 't'" in caplog.text) == reported


@pytest.mark.parametrize(("element", "words"), [("h8_fbar", "has tetrahedra; use 't10'"), ("t6", "of the plane")])
def test_elements_of_bricks_do_not_take_tetrahedra(element, words):
    """They are named with what to write instead, and so is `t10` on bricks."""
    with pytest.raises(PrensaError, match=words):
        under_plane(element=element)
    with pytest.raises(PrensaError, match="has bricks; use 'h8_fbar'"):
        pr.Problem("b", space="solid", bodies={"b": pr.Body(pr.Box((1.0,) * 3, (1,) * 3), SWIFT, "t10")}, tools={}, steps=())
