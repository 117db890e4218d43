"""The first guess of an increment in which metal flows from the beginning: its volume stays, and Newton's method gets there."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import prensa as pr
from equilibria import of_first_increment
from prensa.result.increment import Increment
from prensa.solver import newton, predictor
from prensa.solver.predictor import initial_guess
from prensa_bench.robustness.families import drawn

METAL = pr.J2(128e3, 0.34, pr.Linear(190.0, 570.0))
SOFTER = pr.J2(92e3, 0.31, pr.Swift(318.0, 0.01, 0.2))
UPSET = 0.06


def bricks(mu: float) -> pr.Problem:
    """A quarter of a block that a plate upsets in one increment."""
    return pr.Problem(
        "block", space="solid", bodies={"b": pr.Body(pr.Box((12.0, 9.0, 6.5), (5, 3, 3)), METAL)},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),),
        friction=pr.Coulomb(mu) if mu else None, fixed={"b.bottom": "y", "b.left": "x", "b.back": "z"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-9.0 * UPSET)}, increments=1),),
    )  # fmt: skip


def widened(problem: pr.Problem) -> float:
    """Stretch along x of a block without friction in the first guess of its increment."""
    eq = of_first_increment(problem, may_go_far=True)
    state = eq.context.state
    guess = initial_guess(eq, state.u, eq.system.initial_multipliers(state))
    return float(eq.system.positions(guess.u)[:, 0].max()) / 12.0


def test_volume_stays_in_the_first_guess(monkeypatch):
    """A block without friction keeps its volume where it flows; an elastic one spreads by ν of its shortening, less than half."""
    kept = (1.0 - UPSET) ** -0.5
    found = widened(bricks(0.0))
    monkeypatch.setattr(predictor, "_flows", lambda *_: False)
    elastic = widened(bricks(0.0))
    assert abs(elastic - kept) > 0.3 * (kept - 1.0)
    assert abs(found - kept) < 0.1 * (kept - 1.0)


def test_a_long_first_increment_of_metal_is_not_cut(monkeypatch):
    """From an elastic guess the tangent of metal under elastic pressure leads where elements turn inside out."""
    (inc,) = pr.solve(bricks(0.34))
    monkeypatch.setattr(predictor, "_flows", lambda *_: False)
    *_, before = pr.solve(bricks(0.34))
    assert inc.statistics.cutbacks == 0 and inc.statistics.iterations <= 8
    assert inc.force("t").y == pytest.approx(before.force("t").y, rel=0.03)  # of one increment and of several


def in_space(gap: float) -> pr.Problem:
    """The block with a plate that goes through a gap first."""
    plate = pr.Plane(normal=(0.0, -1.0, 0.0), at=(0.0, 9.0 + gap, 0.0))
    way = pr.Motion(y=-gap - 9.0 * UPSET)
    return replace(bricks(0.1), tools={"t": plate}, steps=(pr.Step("press", move={"t": way}, increments=1),))


def in_the_plane(gap: float) -> pr.Problem:
    """A quarter of a bar under a plate, which goes through a gap first."""
    return pr.Problem(
        "bar", bodies={"b": pr.Body(pr.Rectangle((12.0, 9.0), (12, 8)), METAL)},
        tools={"t": pr.Plane(normal=(0.0, -1.0), at=(0.0, 9.0 + gap))}, contacts=(pr.Contact("b.top", "t"),),
        friction=pr.Coulomb(0.15), fixed={"b.bottom": "y", "b.left": "x"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-gap - 0.04 * 9.0)}, increments=1),),
    )  # fmt: skip


@pytest.mark.parametrize("posed", [in_space, in_the_plane])
def test_a_tool_that_comes_through_air_presses_as_one_that_is_there(posed, monkeypatch):
    """The increment after the touch takes as many iterations as without a gap; continued rest takes more, or a cut."""
    (at_once,) = pr.solve(posed(0.0))
    *air, touched = pr.solve(posed(0.5))
    assert air and not any(inc.force("t").y for inc in air)
    assert touched.force("t").y == pytest.approx(at_once.force("t").y, rel=1e-8)
    assert (touched.statistics.iterations, touched.statistics.cutbacks) == (at_once.statistics.iterations, 0)
    monkeypatch.setattr(predictor, "_first_touch", lambda *_: False)
    at_rest = [inc.statistics for inc in pr.solve(posed(0.5)) if inc.force("t").y]
    assert sum(s.iterations for s in at_rest) > touched.statistics.iterations


def tilted(mu: float) -> pr.Problem:
    """A block that a plate presses down at an edge."""
    tilt = 0.1
    plate = pr.Plane(normal=(math.sin(tilt), -math.cos(tilt), 0.0), at=(0.0, 7.0, 0.0))
    return pr.Problem(
        "edge", space="solid", bodies={"b": pr.Body(pr.Box((9.0, 7.0, 8.0), (4, 3, 3)), SOFTER)}, tools={"t": plate},
        contacts=(pr.Contact(("b.top", "b.right", "b.front"), "t"),), friction=pr.Coulomb(mu),
        fixed={"b.bottom": "xyz", "b.left": "x", "b.back": "z"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.03 * 7.0)}, increments=1),),
    )  # fmt: skip


def test_contact_goes_on_to_be_decided_where_the_guess_flows(monkeypatch):
    """Points close and begin to slip with the flow; Newton's steps find them one after another, and lead to the same answer."""
    (decided,) = pr.solve(tilted(0.4))
    init = newton.init
    monkeypatch.setattr(newton, "init", lambda eq, guess, lam: init(eq, replace(guess, flows=False), lam))
    (found,) = pr.solve(tilted(0.4))
    assert decided.force("t").y == pytest.approx(found.force("t").y, rel=1e-8)
    assert decided.statistics.iterations < found.statistics.iterations


def first_contact(seed: int, number: int) -> Increment:
    """The first increment with contact of a random problem in space whose steps have three increments each."""
    found = drawn("space", seed, number)
    problem = replace(found.problem, steps=tuple(replace(step, increments=3) for step in found.problem.steps))
    return next(inc for inc in pr.solve(problem, found.numerics) if inc.state.contact.closed.any())


@pytest.mark.parametrize(("seed", "number"), [(8117, 37), (32, 3)])
def test_errors_of_volume_that_long_steps_leave_are_put_right(seed, number, monkeypatch):
    """No point changes in these, it is flow alone: steps that are corrected are fewer, and lead to the same answer."""
    corrected = first_contact(seed, number)
    monkeypatch.setattr(newton, "_volume_put_right", lambda eq, u, lam, full, secant: (u, full))
    left = first_contact(seed, number)
    assert corrected.statistics.cutbacks == left.statistics.cutbacks == 0
    assert corrected.statistics.iterations <= 8 < left.statistics.iterations
    forces = [[inc.force(tool).y for tool in inc.tools] for inc in (corrected, left)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-7, abs=1e-7)
