"""Increments in which a tool begins to slide over a body in space: the first guess decides which points slip."""

from __future__ import annotations

import pytest

import prensa as pr


def under_a_plate(material, mu, depth, **more):
    """A box of 2 × 2 × 2 bricks on its bottom that a plate presses by a depth and then slides over by five, in one increment."""
    return pr.Problem(
        "slid over", space="solid", bodies={"b": pr.Body(pr.Box((1.0, 1.0, 1.0), (2, 2, 2)), material)},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),), friction=pr.Coulomb(mu),
        fixed={"b.bottom": "xyz"}, **more,
        steps=(
            pr.Step("press", move={"t": pr.Motion(y=-depth)}, increments=2),
            pr.Step("slide", move={"t": pr.Motion(x=5.0 * depth, z=2.0 * depth)}, increments=1),
        ),
    )  # fmt: skip


def test_of_a_linear_body_the_first_guess_is_the_answer():
    """Of a linear elastic body with linear contact geometry: all that is not linear is which points are closed and which slip."""
    p = under_a_plate(pr.Elastic(1000.0, 0.3), 0.2, 0.01, kinematics="small", contact_geometry="reference")
    *_, last = pr.solve(p)
    force = last.force("t")
    assert last.statistics.iterations <= 2 and last.statistics.cutbacks == 0
    for along, share in ((force.x, 5.0), (force.z, 2.0)):
        assert -along == pytest.approx(0.2 * abs(force.y) * share / 29.0**0.5, rel=1e-2)


def test_metal_is_not_dragged_along_by_a_tool_that_slips():
    """The way is a quarter of the height: metal that was dragged along so far would be strained by a quarter."""
    p = under_a_plate(pr.J2(2e5, 0.3, pr.Linear(300.0, 600.0)), 0.05, 0.05)
    (slide,) = (i for i in pr.solve(p) if i.step == "slide")
    assert slide.statistics.iterations <= 8 and slide.statistics.cutbacks == 0
