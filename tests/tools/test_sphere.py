"""A rigid sphere on bricks: its geometry from one call, Hertz's force on a block, and what case files say of it."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.model.schema import loads

E, NU, R, SIDE = 1000.0, 0.3, 10.0, 10.0
BONDED = 0.4105  # regular part of the Green function of a block twice as wide as it is high, base bonded, nu = 0.3


def test_gap_normal_and_curvature_belong_together():
    """Gap and normal by definition to 1e-14; the curvature is the derivative of the normal to 1e-9; the centre has a normal."""
    rng = np.random.default_rng(0)
    x, ball = rng.normal(size=(200, 3)) * 3.0, pr.Sphere(2.0).shape(np.eye(3)[1], 0.0)
    close = ball.closest(x)
    r = np.sqrt((x**2).sum(axis=1))
    assert np.abs(close.g - (r - 2.0)).max() <= 1e-14 * r.max()
    assert np.abs(close.n - x / r[:, None]).max() <= 1e-14
    h, far = 1e-5, r > 0.5
    for k, e in enumerate(h * np.eye(3)):
        after, before, twice_after, twice_before = (ball.closest(x + s * e).n for s in (1, -1, 2, -2))
        slope = (8 * (after - before) - (twice_after - twice_before)) / (12 * h)
        assert np.abs(close.c[far, :, k] - slope[far]).max() <= 1e-9
    middle = ball.closest(np.zeros((1, 3)))
    assert (middle.g, np.linalg.norm(middle.n)) == (-2.0, 1.0)
    assert np.isfinite(middle.c).all()
    hit = ball.along(np.array([[0.5, -5.0, 0.5], [3.0, -5.0, 0.0]]), np.array([0.0, 1.0, 0.0]), 100.0)
    assert np.allclose(hit, [5.0 - np.sqrt(3.5), np.inf], rtol=1e-12)


def on_block(depth):
    """A quarter of a block, base bonded, under a sphere that is pressed in by ``depth``."""
    return pr.Problem(
        "sphere on a block", space="solid", kinematics="small", contact_geometry="reference",
        bodies={"block": pr.Body(pr.Box((SIDE,) * 3, (14,) * 3, toward=(0, SIDE, 0), ratio=20), pr.Elastic(E, NU), "h8")},
        tools={"ball": pr.Sphere(R, at=(0, SIDE + R, 0))}, contacts=(pr.Contact("block.top", "ball"),),
        fixed={
            "block.left": "x", "block.back": pr.Fixed(z="held"),
            "block.bottom": pr.Fixed(x="held", y="held", z="held"),
        },
        steps=(pr.Step("press", move={"ball": pr.Motion(y=-depth)}, increments=2),),
    )  # fmt: skip


@pytest.mark.parametrize("radius", [0.7, 1.0])
def test_the_force_on_a_block_is_that_of_hertz(radius):
    """Force to 1 % and largest pressure to 2 % for a radius of contact, 4 and 5 elements in it."""
    modulus = E / (1 - NU**2)
    force = 4 / 3 * modulus * radius**3 / R
    depth = radius**2 / R - BONDED * force / (modulus * SIDE)
    *_, last = pr.solve(on_block(depth))
    assert 4 * last.force("ball").y == pytest.approx(force, rel=0.01)
    pressure = last.contacts["block.top-ball"].pressure
    assert pressure.max() == pytest.approx(1.5 * force / (np.pi * radius**2), rel=0.02)


def test_a_case_file_names_a_sphere_in_space_alone():
    """Read in space, refused in the plane with line and column."""
    text = """
name: ball
bodies:
  b: {mesh: {type: rectangle, size: [1, 1], n: [1, 1]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools:
  ball: {type: sphere, radius: 1, at: [0, 2]}
steps: [{name: press}]
"""
    with pytest.raises(pr.CaseError, match="6:3: 'sphere' is a tool of 'space: solid'"):
        loads(text)
    box = "box, size: [1, 1, 1], n: [1, 1, 1]"
    spatial = text.replace("bodies:", "space: solid\nbodies:").replace("rectangle, size: [1, 1], n: [1, 1]", box)
    spatial = spatial.replace("at: [0, 2]", "at: [0, 2, 0]")
    spatial = spatial.replace("steps:", "contacts: [{surface: b.top, against: ball}]\nsteps:")
    assert loads(spatial).problem.tools["ball"] == pr.Sphere(1.0, at=(0.0, 2.0, 0.0))
