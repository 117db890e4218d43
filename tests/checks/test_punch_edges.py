"""Punches that go into a part of an end of a body in a container: said before a run in space when elements turn over there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.far_upsets import far_upsets
from prensa.checks.during.acceptance import least_corner
from prensa.errors import SolveError

STEEL = pr.J2(210e3, 0.3, pr.Swift(800.0, 0.005, 0.18))


def can(width: float, travel: float, n: tuple[int, int, int] = (5, 6, 4), height: float = 8.0) -> pr.Problem:
    """A quarter of a billet in a container, into the end of which a flat punch goes, with a share of its width."""
    edge = 5.0 * width
    punch = pr.Profile(points=((0.0, 0.0), (edge, 0.0), (edge, 30.0)), fillet=(0.0, 0.3, 0.0))
    wall = pr.Profile(points=((5.0, 30.0), (5.0, -20.0)))
    tools = {"t": pr.Revolved(section=punch, at=(0.0, height, 0.0)), "can": pr.Revolved(section=wall, at=(0.0, 0.0, 0.0))}
    little = pr.Coulomb(0.05)
    return pr.Problem(
        "can", space="solid", bodies={"b": pr.Body(pr.Cylinder(radius=5.0, height=height, n=n, angle=np.pi / 2), STEEL)},
        tools=tools, contacts=(pr.Contact("b.top", "t", little), pr.Contact("b.outer", "can", little)),
        fixed={"b.bottom": "y", "b.base": "z", "b.cap": "x"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-travel)}, increments=40),),
    )  # fmt: skip


def said(p: pr.Problem) -> str:
    """What the check says."""
    return " ".join(map(str, far_upsets(pr.discretise(p))))


@pytest.mark.parametrize("width", [0.4, 0.5, 0.7])
def test_punches_that_go_in_by_an_element_are_reported(width):
    """Not what goes in by less; nor a punch as wide as the body, nor one without a container, nor with one below that end."""
    element = 8.0 / 6
    words = said(can(width, 1.3 * element))
    assert "'t' goes 1.733 into a part of an end of 'b'" in words and "by 1.3 elements" in words
    assert said(can(width, 0.9 * element)) == ""
    far = can(width, 2.0 * element)
    assert said(far) and not said(can(1.2, 2.0 * element))
    free = replace(far, tools={"t": far.tools["t"]}, contacts=far.contacts[:1])
    low = pr.Revolved(section=pr.Profile(points=((20.0, 4.0), (5.0, 4.0), (5.0, -20.0)), fillet=0.1), at=(0.0, 0.0, 0.0))
    for other in (free, replace(far, tools={"t": far.tools["t"], "can": low})):
        assert "into a part" not in said(other)


def test_a_round_nose_goes_in_further():
    """Neighbouring nodes differ by its slope only."""
    p = can(0.5, 2.0)
    ball = {**p.tools, "t": pr.Sphere(radius=3.0, at=(0.0, 11.0, 0.0))}
    assert said(p) and said(replace(p, tools=ball)) == ""


def test_a_punch_that_starts_above_goes_as_much_further():
    """By the gap."""
    p = can(0.5, 2.0)
    above = {**p.tools, "t": replace(p.tools["t"], at=(0.0, 9.0, 0.0))}
    assert said(replace(p, tools=above)) == ""
    step = replace(p.steps[0], move={"t": pr.Motion(y=-3.0)})
    assert "by 1.5 elements" in said(replace(p, tools=above, steps=(step,)))


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.5, 0.7])
def test_elements_turn_over_about_where_it_is_reported(width):
    """Within a half of an element, or the run has ended there."""
    p, element = can(width, 2.0 * 8.0 / 6), 8.0 / 6
    block, folded = pr.discretise(p).blocks[0], np.inf
    try:
        for increment in pr.solve(p):
            folded = -increment.tools["t"].place.y
            if least_corner(increment.bodies["b"].x[block.corners].transpose(1, 0, 2)).min() < 0.0:
                break
    except SolveError as error:
        folded = -error.last.tools["t"].place.y
    assert folded == pytest.approx(element, abs=0.5 * element)
