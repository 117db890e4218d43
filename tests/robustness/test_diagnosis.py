"""A failed run says what, where, why and what to try, and keeps the last good state and a picture of it."""

from __future__ import annotations

import re
from itertools import islice

import pytest

import prensa as pr
from prensa.checks.during.acceptance import tunnelled
from prensa.errors import SolveError
from prensa.output.checkpoint import read_checkpoint
from prensa.output.report import read_summary
from prensa.output.run import run
from prensa.system.failure import LimitPoint
from prensa_bench.robustness.blocks import draw
from problems import pressed_block, single_block, stroke


def crushed(*first: pr.Step) -> pr.Case:
    """A block crushed between rough plates by more than its mesh can bear."""
    problem = pressed_block(
        *first, stroke(-0.97, increments=1, name="crush"), material=pr.J2(1000.0, 0.3, pr.Perfect(5.0)), size=(2, 1),
        n=(6, 3), friction=pr.Coulomb(3.0),
    )  # fmt: skip
    return pr.Case(problem, pr.Numerics(max_cutbacks=0), pr.Output(report=False))


def test_a_failed_run_is_reported_and_kept(tmp_path):
    """The message has step, time, reason, place with element or node and coordinates, the last good state and a remedy."""
    with pytest.raises(SolveError) as caught:
        run(crushed(pr.Step("press", move={"t": pr.Motion(y=-0.004)}, increments=2)), tmp_path, quiet=True)
    text = str(caught.value)
    assert re.match(r"step 'crush', time [\d.]+: ", text)
    assert re.search(r"(element \d+ of b \(initially near |node \d+ of 'b' at \()-?[\d.]+, -?[\d.]+\)", text)
    assert "What to try: " in text
    last = caught.value.last
    assert f"The last good state is at time {last.time:.6g} (increment {last.number})" in text
    _, state = read_checkpoint(tmp_path / "checkpoint.h5")
    assert state.clock == last.state.clock
    assert state.u.tobytes() == last.state.u.tobytes()
    assert read_summary(tmp_path)["reason"] == text
    assert (tmp_path / "pictures" / "deformed.png").stat().st_size > 5000


def test_a_failure_of_the_first_increment_leaves_a_picture_of_the_initial_state(tmp_path):
    """With no increment behind it the message says so, and the picture shows where the tools stand."""
    with pytest.raises(SolveError, match="No increment of this run had converged before"):
        run(crushed(), tmp_path, quiet=True)
    assert (tmp_path / "pictures" / "deformed.png").stat().st_size > 5000


def test_a_cylinder_on_the_far_side_of_a_point_has_passed_through_it():
    """Both ends of the increment are free of contact; the straight way between them is not."""
    problem = pressed_block(
        stroke(-8.0, increments=1, name="go"), tools={"t": pr.Circle(radius=1.0, at=(2.0, 4.0))}, size=(4, 0.5),
        n=(8, 1), fixed={"b.left": "xy", "b.right": "xy"},
    )  # fmt: skip
    system = pr.discretise(problem)
    state = system.initial()
    there = state.u.copy()
    for y, through in ((-2.0, False), (-2.4, False), (-8.0, True)):
        there[system.tool_dof(0) + 1] = y
        assert bool(tunnelled(system, state, there)) == through


def test_a_run_with_a_step_of_that_size_finds_the_contact(tmp_path):
    """The touch is found although the tool is apart at both ends, and the bar is pushed along from there."""
    problem = pressed_block(
        stroke(-8.0, increments=1, name="go"), tools={"t": pr.Circle(radius=1.0, at=(2.0, 4.0))}, size=(4, 0.5),
        n=(16, 2), fixed={"b.left": "xy", "b.right": "xy"},
    )  # fmt: skip
    increments = list(islice(pr.solve(problem), 5))  # the bar comes to a limit point of its own later
    assert increments[0].time == pytest.approx(2.5 / 8, rel=1e-6)
    assert all(i.force("t").y > 0 for i in increments[1:])


def test_a_point_that_lets_go_at_once_is_a_limit_point():
    """No mode is soft while the last point sticks; as soon as it slides the spring of the tool takes all away."""
    with pytest.raises(SolveError, match="limit point") as caught:
        list(pr.solve(draw("plastic", 77120451, 30)))
    assert isinstance(caught.value.reason, LimitPoint)
    assert "instead of pushed or mounted on a spring" in str(caught.value)


def test_a_singular_iterate_beyond_a_limit_point_is_no_body_that_comes_free():
    """The one corner that touches a pushed tool is about to fold: states ahead are unstable, the one that is there is held."""
    with pytest.raises(SolveError, match="limit point") as caught:
        list(pr.solve(draw("plastic", 1790888604, 226)))
    assert isinstance(caught.value.reason, LimitPoint)
    assert "free to move" not in str(caught.value)


@pytest.mark.parametrize(
    ("push", "words"),
    [
        ({"y": 0.0}, "tool 't' touches nothing and is driven by force along y"),
        ({"y": -5.0, "m": 3.0}, "tool 't' is free to turn, and as it is round only friction resists that"),
    ],
)
def test_a_tool_that_nothing_resists_is_named(push, words):
    """A singular matrix is reported with the tool that makes it so: one that is let free in the air, a round one with a
    moment.
    """
    place = {"at": (0.0, 10.0)} if "m" not in push else {"touching": "b.top"}
    problem = single_block(
        pr.Step("push", push={"t": pr.Push(**push)}), tools={"t": pr.Circle(radius=4.0, **place)},
        fixed={"b.bottom": "xy"}, friction=pr.Coulomb(0.1),
    )  # fmt: skip
    with pytest.raises(SolveError) as caught:
        list(pr.solve(problem))
    assert words in str(caught.value)
