"""Ties between faces of bodies in space whose meshes do not match: patches, tubes, turns, sides that do not lie on each other."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.mesh import MeshError
from prensa.system.discretise import discretise

E, NU = 1000.0, 0.3
ELASTIC = pr.Elastic(E, NU)


def blocks(lower, upper, material=ELASTIC, size=(4.0, 1.0, 3.0), y=2.0):
    """Two blocks on each other, of bricks that need not match."""
    meshes = {"a": pr.Box((4.0, 2.0, 3.0), lower), "b": pr.Box(size, upper, origin=(0.0, y, 0.0))}
    return {name: pr.Body(mesh, material) for name, mesh in meshes.items()}


def tied(bodies, **more):
    """The upper one on the lower one."""
    given = {"kinematics": "small", "steps": (pr.Step("s", increments=1),), "ties": (pr.Tie("b.bottom", "a.top"),)}
    return pr.Problem("tied", space="solid", bodies=bodies, **given | more)


SLIDING = {"a.left": "x", "a.bottom": "y", "a.back": "z", "b.left": "x", "b.back": "z"}
CLAMPED = {"a.bottom": "xyz"}


@pytest.mark.parametrize("meshes", [((3, 2, 2), (4, 1, 5)), ((2, 1, 2), (5, 2, 3)), ((2, 1, 2), (2, 1, 2))], ids=str)
def test_an_even_stress_passes(meshes):
    """Tension, and with planes of symmetry through the tie, of which nodes of the slave side are held: to round-off."""
    *_, last = pr.solve(tied(blocks(*meshes), fixed=SLIDING, loads={"b.top": pr.Load(traction=(0.0, -5.0, 0.0))}))
    for name in "ab":
        assert np.allclose(last.bodies[name].stress, [0.0, -5.0, 0.0, 0.0, 0.0, 0.0], atol=1e-10)
        assert last.bodies[name].displacement[:, 1] == pytest.approx(-5.0 / E * last.bodies[name].X[:, 1], abs=1e-12)


def test_forces_go_through_a_tie():
    """A shear on top is carried at the bottom, with its moment; energies balance."""
    shear = {"b.top": pr.Load(traction=(2.0, 0.0, 1.0))}
    *_, last = pr.solve(tied(blocks((2, 2, 2), (3, 1, 5)), fixed=CLAMPED, loads=shear))
    assert last.supports["a.bottom"] == pytest.approx((-24.0, 0.0, -12.0), abs=1e-9)
    assert last.support_moments["a.bottom"].mz == pytest.approx(24.0 * 3.0, rel=1e-9)
    assert last.energy["external"] == pytest.approx(last.energy["elastic"], rel=1e-9)


def test_a_turn_makes_no_stress():
    """Both blocks turned by 20°: the slave nodes go where the turn takes them."""
    angle = np.radians(20.0)
    system = discretise(tied(blocks((2, 1, 2), (3, 1, 4), pr.NeoHooke(E, NU)), kinematics="finite"))
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    u = np.zeros(system.ndof)
    system.displacement(u)[:] = system.X @ (turn - np.eye(3)).T
    assert np.allclose(system.with_slaves(u), u, atol=1e-12)


def test_tied_tubes_bear_as_one():
    """A tube of two, with 10 and 7 layers to a quarter: Lamé's displacement, at the inside and the outside, within 1 %."""
    bodies = {}
    for name, radius, n, layers in (("in", 1.0, 5, 10), ("out", 2.0, 4, 7)):
        section = pr.Rectangle((1.0, 0.4), (n, 1), (radius, 0.0))
        bodies[name] = pr.Body(pr.Revolution(section, layers, angle=np.pi / 2), ELASTIC)
    fixed = {f"{b}.{side}": axis for b in bodies for side, axis in (("bottom", "y"), ("top", "y"), ("base", "z"), ("cap", "x"))}
    p = 10.0
    ties = (pr.Tie("in.right", "out.left"),)
    *_, last = pr.solve(tied(bodies, fixed=fixed, loads={"in.left": pr.Load(pressure=p)}, ties=ties))
    a = p / 8.0  # inner radius 1, outer 3
    for name in bodies:
        X, x = last.bodies[name].X, last.bodies[name].x
        r = np.hypot(X[:, 0], X[:, 2])
        exact = (1.0 + NU) / E * (a * (1.0 - 2.0 * NU) * r + 9.0 * a / r)
        moved = np.hypot(x[:, 0], x[:, 2]) - r
        ends = (r < 1.01) | (r > 2.99)
        assert moved[ends] == pytest.approx(exact[ends], rel=1e-2)


def test_sides_that_do_not_lie_on_each_other_are_refused():
    """One that sticks out, and one that is apart; with the place."""
    beside, above = ((5.0, 1.0, 3.0), 2.0), ((4.0, 1.0, 3.0), 2.5)
    for (size, y), words in ((beside, "% of the face lies on the other"), (above, "nothing lies opposite")):
        with pytest.raises(MeshError, match=words):
            discretise(tied(blocks((2, 1, 2), (3, 1, 2), size=size, y=y)))
