"""Belts over pulleys that are free to turn: friction alone holds them, by one node that sticks, and both ends bear the same."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr


def belt(n, *, layers=1, mu=0.3, radius=50.0, thick=1.0, pull=2.0, way=-1.0):
    """A belt over a quarter of an idle pulley, pulled down at its beginning, then drawn along x at its end."""
    mesh = pr.Annulus(radius, radius + thick, (n, layers), angles=(0.0, 0.5 * np.pi))
    idle = {"drum": pr.Push(m=0.0)}
    return pr.Problem(
        "belt", bodies={"belt": pr.Body(mesh, pr.Elastic(2000.0, 0.3), "q4_enhanced")},
        tools={"drum": pr.Circle(radius=radius, at=(0.0, 0.0))}, contacts=(pr.Contact("belt.inner", "drum"),),
        friction=pr.Coulomb(mu), fixed={"belt.end": "x"},
        steps=[
            pr.Step("tension", push=idle, loads={"belt.start": pr.Load(traction=(0.0, -pull))}),
            pr.Step("pull", push=idle, fixed={"belt.end": pr.Fixed(x=way)}),
        ],
    )  # fmt: skip


@pytest.mark.parametrize("n", [20, 67, 75, 90])
def test_both_ends_of_a_belt_bear_the_same(n):
    """2 N/mm at either end by the balance of moments, to 1 %, whatever the number of nodes; the drum turns with the belt."""
    ends = [i for i in pr.solve(belt(n)) if i.end_of_step]
    assert [abs(i.supports["belt.end"].x) for i in ends] == pytest.approx([2.0, 2.0], rel=0.01)
    assert max(abs(i.force("drum").m) for i in ends) <= 1e-5
    # drawn by 1 along the circumference of radius 50, less what the belt stretches
    assert ends[-1].tools["drum"].place.rz == pytest.approx(0.0197, rel=0.05)


@pytest.mark.parametrize("number", [7, 13, 23, 29, 57])
def test_belts_of_any_size_go_over_idle_pulleys(number):
    """Radius, thickness, friction, layers and pull at random: the first increments are found, and both ends bear the same."""
    rng = np.random.default_rng([9, number])
    n, mu, radius, thick = int(rng.integers(20, 101)), *(float(rng.uniform(*a)) for a in ((0.05, 1.0), (20, 200), (0.5, 2.0)))
    layers, pull = int(rng.integers(1, 3)), float(np.exp(rng.uniform(-2, 2)))
    problem = belt(n, layers=layers, mu=mu, radius=radius, thick=thick, pull=pull)
    for inc in pr.solve(problem):
        if inc.end_of_step:
            assert abs(inc.supports["belt.end"].x) == pytest.approx(pull * thick, rel=2e-3)
            return
