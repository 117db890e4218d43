"""Inputs that go wrong without a guard: each fails where `prensa_bench.panel` switches that off."""

from __future__ import annotations

from dataclasses import replace

import pytest

import prensa as pr
from prensa.checks.during.acceptance import least_corner
from prensa.errors import SolveError
from prensa.result.increment import Progress
from prensa.system.failure import LostSupport, ToolRunaway
from prensa_bench.robustness.families import drawn
from problems import pressed_block, single_block, stroke, upset_block


def test_a_strip_that_its_last_tool_has_left_is_refused():
    """A drawn strip that no support holds when the tools have gone: it would end anywhere, without an imbalance to tell."""
    p = drawn("strips", 7, 1).problem
    hold, draw, release = p.steps
    with pytest.raises(SolveError) as caught:
        list(pr.solve(replace(p, steps=(hold, draw, replace(release, fixed={})))))
    assert isinstance(caught.value.reason, LostSupport)


SOFT = pr.J2(2e3, 0.3, pr.Linear(200.0, 600.0))


def upset(increments: int) -> pr.Problem:
    """A block that is pressed to a tenth of its height, its sides too in contact."""
    return upset_block(
        stroke(-1.82, increments=increments), material=SOFT, size=(2.0, 2.0), n=(2, 4), element="q4", friction=pr.Coulomb(0.3),
        sides=("top", "right"),
    )  # fmt: skip


def sheared(increments: int) -> pr.Problem:
    """A block whose top goes aside by one and a half of its width."""
    aside = pr.Step("shear", fixed={"b.top": pr.Fixed(x=-5.97, y=1.74)}, increments=increments)
    return single_block(aside, material=SOFT, n=(2, 2), element="q8", fixed={"b.bottom": "xy"})


@pytest.mark.parametrize("problem", [upset, sheared], ids=["a corner beyond 180°", "a plastic strain above 1"])
def test_an_increment_that_is_far_too_long_is_not_taken_to_another_solution(problem):
    """Asked for in one increment, forces are those of twenty: cut, where the equilibrium that Newton finds is another one.

    Without the guard the upset block has 0.60 of its force and an element that turned over; the sheared one, with nothing told,
    0.89.
    """
    (*_, one), (*_, many) = pr.solve(problem(1)), pr.solve(problem(20))
    driven = [inc.force("t").y if inc.tools else inc.supports["b.top"].x for inc in (one, many)]
    assert driven[0] == pytest.approx(driven[1], rel=0.05)
    nodes = pr.discretise(problem(1)).blocks[0].corners.T
    assert least_corner(one.bodies["b"].x[nodes]).min() > 0.0


def test_a_roll_that_friction_cannot_brake_is_named_at_once():
    """A moment beyond what friction can bear spins a roll: its first step is a turn that nobody means, and no other is tried."""
    tools = {"roll": pr.Circle(radius=4.0, at=(3.0, 0.0), touching="b.top")}
    down = pr.Step("down", move={"roll": {"y": -0.1}}, increments=2)
    spin = pr.Step("spin", push={"roll": {"m": 117.0}}, increments=1)
    p = pressed_block(down, spin, tools=tools, size=(6.0, 2.0), n=(12, 4), friction=pr.Coulomb(0.2))
    iterates = 0

    def watch(e: Progress) -> None:
        nonlocal iterates
        iterates += e.event == "iteration" and e.step == "spin"
        assert iterates <= 4  # two of each of both attempts

    with pytest.raises(SolveError) as caught:
        list(pr.solve(p, pr.Numerics(max_cutbacks=0), monitor=watch))
    assert caught.value.reason == ToolRunaway("roll", "rz")
