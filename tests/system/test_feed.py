"""Strips and wires that a boundary of theirs brings to rolls and dies, until these have gripped them."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.model.schema import CaseError, dump, loads
from prensa.output.run import resume, run
from stopped import stopped_after

PLASTIC = pr.J2(1000.0, 0.3, pr.Linear(10.0, 50.0))
TURN = {"roll": pr.Motion(rz=0.4)}


def rolled(*steps: pr.Step, half: bool = True, mu: float = 0.3, **more) -> pr.Problem:
    """A strip before one roll over its middle line, or between two."""
    gap = 0.95
    strip = pr.Strip(length=4.0, thickness=2.0, half=half, n=(16, 3 if half else 6), front=(-1.2, 0.0))
    tools = {"roll": pr.Circle(4.0, at=(0.0, 4.0 + gap))}
    if not half:
        tools["lower"] = pr.Circle(4.0, at=(0.0, -4.0 - gap))
    return pr.Problem(
        "roll", bodies={"s": pr.Body(strip, PLASTIC)}, tools=tools, steps=steps, friction=pr.Coulomb(mu),
        fixed={"s.bottom": "y"} if half else {}, **more,
    )  # fmt: skip


FEED = pr.Step("bite", feed={"s.left": pr.Feed(x=1.0)}, by=TURN)
ROLL = pr.Step("roll", by={"roll": pr.Motion(rz=0.2)}, increments=12)


def test_the_step_ends_when_the_roll_draws_and_the_strip_is_free_then():
    """Its tail never pulls while it is fed, pulls with nothing at the end, and bears nothing more; the roll's work goes on."""
    path = list(pr.solve(rolled(FEED, ROLL)))
    bite = [i for i in path if i.step == "bite"]
    assert bite[-1].stopped == "'s.left' is gripped" and bite[-1].time < 1.0
    most = 1e-6 * 1000.0 * 4.0
    assert all(i.supports["s.left"].x >= -1e-3 * most for i in bite[:-1])
    assert bite[-1].supports["s.left"].x == pytest.approx(-most, rel=0.2)
    last = path[-1]
    assert last.supports["s.left"].x == 0.0
    assert last.force("roll").x == pytest.approx(0.0, abs=1e-8 * last.force("roll").y)
    assert last.force("roll").m * 0.2 < 0
    way = (last.bodies["s"].x - bite[-1].bodies["s"].x)[:, 0].mean()
    assert way == pytest.approx(4.0 * 0.2, rel=0.1)


def test_feeding_is_moving_by_a_way_until_the_force_turns_and_letting_go():
    """The three written by hand give the same forces and moments."""
    fed = list(pr.solve(rolled(FEED, ROLL)))
    pull = -fed[[i.step for i in fed].index("roll") - 1].supports["s.left"].x
    by_hand = rolled(
        pr.Step("bite", by={"s.left": pr.Motion(x=1.0), **TURN}, until=pr.Until(measure={"fixed.s.left.fx": -pull})),
        replace(ROLL, fixed={"s.left": pr.Fixed(free=True)}),
    )
    other = list(pr.solve(by_hand))
    assert len(fed) == len(other)
    for a, b in zip(fed, other):
        assert a.force("roll") == pytest.approx(b.force("roll"), rel=1e-6, abs=1e-4)


def test_two_rolls_grip_a_whole_strip():
    """Driven against one another: equal forces, opposite moments, and the strip goes straight on."""
    turns = {"roll": pr.Motion(rz=0.3), "lower": pr.Motion(rz=-0.3)}
    steps = [replace(FEED, by=turns), pr.Step("roll", by={k: pr.Motion(rz=m.rz / 3) for k, m in turns.items()}, increments=6)]
    hold = {"s.left": pr.Fixed(y="held")}
    last = list(pr.solve(replace(rolled(*steps, half=False), fixed=hold)))[-1]
    a, b = last.force("roll"), last.force("lower")
    assert a.y == pytest.approx(-b.y, rel=1e-6)
    assert a.m == pytest.approx(-b.m, rel=1e-6)
    assert abs(last.supports["s.left"].y) <= 1e-6 * a.y


def test_a_wire_is_threaded_through_its_die_and_then_drawn():
    """No tool grips: ``until`` ends the feed, the tail is free, and the pull is that which drawing needs."""
    die = pr.Profile(points=((6.0, 11.5), (4.5, 1.0), (4.5, 0.0), (7.3107, -20.0)), fillet=1.0, at=(0.0, 0.0))
    wire = pr.Wire(length=16.0, diameter=10.0, n=(16, 3), nose=pr.Nose(length=6.0, thickness=8.8), front=-3.0)
    steel = pr.J2(210e3, 0.3, pr.Perfect(300.0))
    problem = pr.Problem(
        "wire", bodies={"wire": pr.Body(wire, steel)}, tools={"die": die}, friction=pr.Shear(0.1), space="axisymmetric",
        contacts=[pr.Contact("wire.right", "die")],
        steps=(
            pr.Step("thread", feed={"wire.bottom": pr.Feed(y=12.0)}, until=pr.Until(measure={"wire.top.max.y": 2.0})),
            pr.Step("draw", by={"wire.top": pr.Motion(y=5.0)}),
        ),
    )  # fmt: skip
    path = list(pr.solve(problem))
    thread = next(i for i in path if i.end_of_step)
    assert thread.stopped == "measure 'wire.top.max.y' has reached 2"
    assert thread.supports["wire.bottom"].y > 0.0
    last = path[-1]
    assert last.supports["wire.bottom"].y == 0.0
    assert last.supports["wire.top"].y == pytest.approx(last.force("die").y, rel=1e-8)
    stress = np.mean([i.supports["wire.top"].y for i in path if i.time > 1.7]) / (np.pi * 4.5**2)
    assert 80.0 < stress < 130.0  # slab 89, upper bound 121; three elements over the radius


def test_a_strip_that_no_roll_draws_is_reported(caplog):
    """Without friction it is pushed to the end of its way; the warning says with what."""
    with caplog.at_level(logging.WARNING, "prensa"):
        path = list(pr.solve(rolled(replace(FEED, feed={"s.left": pr.Feed(x=0.9)}, increments=8), mu=1e-3)))
    assert path[-1].time == 1.0 and path[-1].supports["s.left"].x > 0.1
    assert "feed.s.left (it was pushed with" in caplog.text
    assert "let it go further" in caplog.text


def test_a_fed_run_goes_on_bit_for_bit(tmp_path):
    """From within the bite, and from its end."""
    case = pr.Case(rolled(FEED, replace(ROLL, increments=3)), output=pr.Output(1, False, False))
    whole = run(case, tmp_path / "whole", quiet=True)
    end = int(np.flatnonzero(whole.history["step"] == "bite")[-1]) + 1
    assert whole.summary["ended_early"] == {"bite": whole.history["time"][end - 1]}
    for stop in (end - 2, end):
        stopped_after(case, tmp_path / f"{stop}", stop)
        resume(tmp_path / f"{stop}", quiet=True)
        assert (tmp_path / f"{stop}" / "history.csv").read_bytes() == (tmp_path / "whole" / "history.csv").read_bytes()


@pytest.mark.parametrize(
    ("feed", "words"),
    [
        ("{s.lft: {x: 1}}", r"unknown boundary 'lft' of body 's'"),
        ("{s.left: {x: 0}}", r"feed of 's.left': give the way along x or along y, other than 0"),
        ("{s.left: {x: 1, y: 1}}", r"feed of 's.left': give the way along x or along y"),
        ("{roll: {x: 1}}", r"roll"),
    ],
)
def test_mistakes_in_feeds_have_a_place_and_a_remedy(feed, words):
    """Line and column; a tool is not a boundary."""
    text = dump(pr.Case(rolled(FEED))).replace("feed: {s.left: {x: 1}}", f"feed: {feed}")
    assert feed in text
    with pytest.raises(CaseError, match=rf"case.yaml:\d+:\d+: .*{words}"):
        loads(text, "case.yaml")


def test_what_a_step_says_twice_or_cannot_be_is_refused():
    """A support and a feed of one component; a radial feed; derivatives of a step that ends when it is gripped."""
    with pytest.raises(CaseError, match=r"x of 's\.left' is given by 'by' and by 'feed'"):
        rolled(replace(FEED, by={**TURN, "s.left": pr.Motion(x=1.0)}))
    with pytest.raises(CaseError, match="fed along y"):
        replace(rolled(FEED), space="axisymmetric")
    with pytest.raises(PrensaError, match="'until' or 'feed'"):
        list(pr.solve(rolled(FEED), derivatives=["friction.mu"]))
