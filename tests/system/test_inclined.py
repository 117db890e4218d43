"""Sides held along their normals: sectors of rings, blocks in any position, and what cannot be held so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import MeshError
from prensa.model.schema import dump, loads
from prensa.system.discretise import discretise

STEEL = pr.J2(200000.0, 0.3, pr.Swift(K=500.0, e0=0.01, n=0.2))
TIGHT = pr.Numerics(tolerance=1e-11)


def sector(layers, cap, **more):
    """A ring of ``layers`` of 15°, pressed with friction on a smooth base."""
    mesh = pr.Revolution(pr.Rectangle((3.0, 2.0), (2, 2), (3.0, 0.0)), layers, angle=np.radians(15.0 * layers))
    given = {"fixed": {"b.bottom": "y", "b.base": "z", "b.cap": cap}, "friction": pr.Coulomb(0.1)}
    return pr.Problem(
        "ring", space="solid", bodies={"b": pr.Body(mesh, STEEL)}, tools={"t": pr.Plane(touching="b.top")},
        contacts=(pr.Contact("b.top", "t"),), steps=(pr.Step("press", move={"t": pr.Motion(y=-0.2)}, increments=2),),
        **given | more,
    )  # fmt: skip


def test_a_sector_is_its_part_of_a_quarter():
    """Three layers between planes at 45° bear half of six in a quarter, plastic and with friction, to 1e-8."""
    *_, part = pr.solve(sector(3, "normal"), TIGHT)
    *_, quarter = pr.solve(sector(6, "x"), TIGHT)
    assert 2.0 * part.force("t").y == pytest.approx(quarter.force("t").y, rel=1e-8)
    for name in ("elastic", "plastic", "friction", "external"):
        assert 2.0 * part.energy[name] == pytest.approx(quarter.energy[name], rel=1e-7)
    cap, base = part.supports["b.cap"], part.supports["b.base"]
    n = np.array([-np.sin(np.radians(45.0)), 0.0, np.cos(np.radians(45.0))])
    assert np.dot(cap, n) == pytest.approx(-base.z, rel=1e-8)  # of either plane as much, towards each other
    assert np.linalg.norm(cap) == pytest.approx(abs(base.z), rel=1e-8)
    total = np.sum([list(f) for f in part.supports.values()], axis=0) - part.force("t")[:3]
    assert np.abs(total).max() < 1e-8 * part.force("t").y
    assert part.bodies["b"].reaction.sum(axis=0) == pytest.approx(part.force("t")[:3], abs=1e-7 * part.force("t").y)


def test_a_missing_plane_is_named():
    """A sector without its inclined plane is free, one with it is not."""
    smooth, fixed = {"friction": None}, {"b.bottom": "y", "b.base": "z"}
    assert [f for f in preflight(discretise(sector(3, "normal", **smooth))) if f.path == "bodies.b"] == []
    (free,) = [f for f in preflight(discretise(sector(3, "normal", fixed=fixed, **smooth))) if f.path == "bodies.b"]
    assert "free to move along x: " in free.message
    assert "hold it there with 'fixed', like 'b.cap: normal'" in free.message


def block(turn):
    """A block on three of its sides, pressed from a fourth, in a position that a rotation gives it."""
    mesh = mesh_of(pr.Box((2.0, 1.0, 1.5), (2, 2, 2)))
    boundaries = {name: np.unique(faces).tolist() for name, faces in mesh.edges.items()}
    body = pr.Body(pr.Bricks((mesh.points @ turn.T).tolist(), mesh.cells.tolist(), boundaries), STEEL)
    return pr.Problem(
        "block", space="solid", bodies={"b": body}, friction=pr.Coulomb(0.2), contacts=(pr.Contact("b.top", "t"),),
        tools={"t": pr.Plane(normal=tuple(-turn[:, 1]), at=tuple(turn @ [0.0, 1.0, 0.0]))},
        fixed={f"b.{side}": "normal" for side in ("left", "bottom", "back")},
        steps=(pr.Step("press", move={"t": pr.Motion(**dict(zip("xyz", turn @ [0.0, -0.15, 0.0])))}, increments=2),),
    )  # fmt: skip


def test_a_turned_block_has_the_same_answer():
    """Three sides along their normals, which meet in edges and a corner: scalars of a turned block to 1e-9, forces turned."""
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    *_, plain = pr.solve(block(np.eye(3)), TIGHT)
    *_, other = pr.solve(block(turn), TIGHT)
    assert other.energy["plastic"] == pytest.approx(plain.energy["plastic"], rel=1e-9)
    size = np.linalg.norm(plain.force("t")[:3])
    assert np.allclose(turn.T @ other.force("t")[:3], plain.force("t")[:3], atol=1e-9 * size)
    for name in plain.supports:
        assert np.allclose(turn.T @ np.array(other.supports[name]), plain.supports[name], atol=1e-9 * size)


@pytest.mark.parametrize(
    ("fixed", "words"), [({"b.left": "normal"}, "is not flat"), ({"b.nowhere": "normal"}, "unknown boundary")],
)  # fmt: skip
def test_a_curved_side_has_no_normal(fixed, words):
    """Nor has one that there is not."""
    with pytest.raises((MeshError, pr.PrensaError), match=words):
        discretise(sector(3, "x", fixed=fixed))


def test_normals_are_of_space_and_of_the_whole_run():
    """Refused in the plane, in later steps than the first, and to be released."""
    plane = {"bodies": {"b": pr.Body(pr.Rectangle((1.0, 1.0), (1, 1)), STEEL)}, "steps": (pr.Step("s"),)}
    with pytest.raises(pr.PrensaError, match="for sides in 'space: solid'"):
        pr.Problem("p", fixed={"b.left": "normal"}, **plane)
    for given, words in (({"b.cap": "normal"}, "under 'fixed' of the problem"), ({"b.cap": "free"}, "cannot be released")):
        with pytest.raises(pr.PrensaError, match=words):
            replace(sector(3, "normal"), steps=(pr.Step("s"), pr.Step("t", fixed=given)))


def test_a_normal_is_written_as_it_was_read():
    """Alone and beside an axis, so that a run is resumed with it."""
    for cap in ("normal", pr.Fixed(normal="held", y="held")):
        problem = sector(3, cap)
        assert loads(dump(pr.Case(problem))).problem == problem
