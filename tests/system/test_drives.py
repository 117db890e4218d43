"""Pushed, spring-mounted and tilting tools with every enforcement in every space: ends of steps, and tools that are removed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from problems import pressed_block

PLASTIC = pr.J2(1000.0, 0.3, pr.Linear(20.0, 50.0))
SPACES = ("plane strain", "plane stress", "axisymmetric")
ENFORCEMENTS = pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented(), pr.Exact()], ids=lambda e: e.type)
AWAY = pr.Step("away", remove_tools=True, fixed={"b.bottom": pr.Fixed(free=True)}, increments=3)


def block(space: str, enforcement, *steps: pr.Step, spring=None, wide: float = 4.0) -> pr.Problem:
    """A block on a smooth base, under a plane that meets all of its top."""
    fixed = {"b.bottom": "y"} | ({} if space == "axisymmetric" else {"b.bottom-left": "x"})
    return pressed_block(
        *steps,
        tools={"t": pr.Plane(touching="b.top", at=(wide / 2, 0.0) if space != "axisymmetric" else None, spring=spring)},
        material=PLASTIC, size=(wide, 2.0), n=(4, 2), friction=pr.Coulomb(0.1), enforcement=enforcement, fixed=fixed,
        space=space,
    )  # fmt: skip


def area(space: str) -> float:
    return math.pi * 16.0 if space == "axisymmetric" else 4.0


def at_rest(i: pr.Increment, force: float) -> None:
    """Nothing is borne when the tools are gone, and what stays in the body is in balance with itself."""
    assert abs(i.supports["b.bottom"].y) <= 1e-8 * force
    assert i.tools["t"].force.y == 0.0
    assert abs(i.bodies["b"].reaction[:, 1]).max() <= 1e-8 * force


@ENFORCEMENTS
@pytest.mark.parametrize("space", SPACES)
def test_a_push_that_a_travel_ends_and_its_release(space, enforcement):
    """The force is what was asked at the time of the end; the travel is met; nothing is left when the tool is gone."""
    most = 40.0 * area(space)
    push = pr.Step("push", push={"t": pr.Push(y=-most)}, until=pr.Until(travel={"t": pr.ToolTravel(y=-0.1)}, required=True))
    done = list(pr.solve(block(space, enforcement, push, AWAY)))
    end = next(i for i in done if i.end_of_step)
    assert end.tools["t"].place.y == pytest.approx(-0.1, rel=1e-8)
    assert end.force("t").y == pytest.approx(most * end.time, rel=1e-8)
    assert end.supports["b.bottom"].y == pytest.approx(end.force("t").y, rel=1e-8)
    at_rest(done[-1], most)
    height = np.ptp(done[-1].bodies["b"].x[:, 1])
    assert 2.0 - 0.1 < height < 2.0 - 0.03  # less than under load, more than before


@ENFORCEMENTS
@pytest.mark.parametrize("space", SPACES)
def test_a_spring_that_a_force_ends_and_its_release(space, enforcement):
    """Spring and contact have one force, which is the target, from what the mount is ahead of the tool."""
    target, stiffness = 22.0 * area(space), 500.0 * area(space)
    press = pr.Step(
        "press", by={"t": pr.Motion(y=-0.5)}, until=pr.Until(force={"t": pr.ToolForce(y=target)}, required=True)
    )
    done = list(pr.solve(block(space, enforcement, press, AWAY, spring=pr.Springs(y=stiffness))))
    end = next(i for i in done if i.end_of_step)
    assert end.force("t").y == pytest.approx(target, rel=1e-8)
    assert stiffness * (0.5 * end.time + end.tools["t"].place.y) == pytest.approx(target, rel=1e-8)
    at_rest(done[-1], target)


@ENFORCEMENTS
@pytest.mark.parametrize("space", SPACES[:2])
def test_a_tool_that_tilts_has_no_moment(space, enforcement):
    """Pushed beside its middle on a block that is free to yield it turns until the moment about its point is zero."""
    force = 10.0 * area(space)
    hold = pr.Step("hold", push={"t": pr.Push(y=-force)}, increments=3)
    tilt = pr.Step("tilt", push={"t": pr.Push(y=-force, m=0.0)}, increments=3)
    problem = block(space, enforcement, hold, tilt, AWAY)
    done = list(pr.solve(replace(problem, tools={"t": pr.Plane(touching="b.top", at=(2.2, 0.0))})))
    last = [i for i in done if i.step == "tilt"][-1]
    assert last.force("t").y == pytest.approx(force, rel=1e-8)
    assert abs(last.force("t").m) <= 1e-8 * force * 4.0
    assert last.tools["t"].place.rz < 0.0  # down on the side on which it is pushed
    at_rest(done[-1], force)
