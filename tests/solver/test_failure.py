"""Reasons of failure as values: remedies follow their type, never the words, which hold names that users gave."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import get_args

import pytest

import prensa as pr
from prensa import solver
from prensa.checks.during.distortion import IN_A_SECTION
from prensa.errors import SolveError
from prensa.policy import Policy
from prensa.solver.diagnosis import InUse, hint
from prensa.system import failure as f
from prensa.system.failure import ElementFailed, Fold, FrictionTooSoft, Hang, Inside, Past, Why
from problems import pressed_block, stroke, upset_block

EACH = (
    f.Unevaluable(ElementFailed(3, "body", 1.0, 2.0, Why.INVERTED)), f.Unevaluable(FrictionTooSoft("top-tool")),
    f.Unevaluable("something else"), f.Diverged(), f.Stagnated(1e-3), f.NotConverged(25, 1e-3), f.Unsettled(40),
    f.Blocked("top-tool", 1.0, 2.0), f.Singular("a pivot is zero"), f.ToolRunaway("tool", "rz"), f.Runaway(),
    f.LostSupport("body"), f.UnilaterallySupported("body", "tool"),
    f.TipsOver("tool", (1.0, 2.0), (0.0, -1.0), (3.0, 2.0), (4.0, 2.0)), f.Tunnelled("tool", 7, "body", 1.0, 2.0),
    f.CornerInverted(3, "body", 1.0, 2.0), f.Collapsed(3, "body", 1.0, 2.0, 1.5), f.Unstable(2), f.Jumped(),
    f.LimitPoint(f.Unstable(1)),
    f.MetalInside(Inside("tool", 7, "body", "body.right", 1.0, 2.0, 0.1)), f.TurnedThrough("tool", "body", 6.28),
    f.BeyondSmall("body", 0.2, 0.1, 0.3, 0.2), f.Folded(Fold("body.right", "body.bottom", 1.0, 2.0, 0.1)),
    f.Folded(Fold("body.top", "body.top", 1.0, 2.0, 0.1), Hang("body.top", "tool", 1.0, 2.0, 0.1, 5.0)),
    f.Distorted(3, "body", 1.0, 2.0, -0.1, 7, ("body.top",), ("body.top-tool",)),
    f.PastSupport(3, "body", 1.0, 2.0, Past("body.right", "body.bottom", 0.1, 0.2), 20),
    f.StartsInside("tool", "body.top", 0.5, 2.0), f.NotReached("until.force.punch.y is met when the step begins (3)"),
)  # fmt: skip


def test_every_failure_has_its_words_and_a_remedy():
    """No type is left out of the sentences, and no sentence ends in a full stop that the message would double."""
    assert {type(x) for x in EACH} == set(get_args(f.Failure))
    said = [f.sentence(x) for x in EACH]
    assert len(set(said)) == len(said)
    assert all(said) and not any(words.endswith(".") for words in said)
    assert all(hint(x) for x in EACH)


def test_remedies_do_not_follow_names():
    """A tool called 'multipliers' and a body called 'inside out' change nothing but the sentence."""
    for plain, named in (
        (f.Tunnelled("tool", 7, "body", 1.0, 2.0), f.Tunnelled("multipliers", 7, "inside out", 1.0, 2.0)),
        (f.Collapsed(3, "body", 1.0, 2.0, 1.5), f.Collapsed(3, "singular", 1.0, 2.0, 1.5)),
    ):
        assert hint(plain) == hint(named)
        assert f.sentence(plain) != f.sentence(named)
    assert hint(f.Singular("x")) == hint(f.LostSupport("b")) != hint(f.Stagnated(1.0))
    assert hint(f.ToolRunaway("t", "y")) == hint(f.LostSupport("b")) != hint(f.ToolRunaway("t", "rz"))


def test_the_error_carries_the_reason():
    """Who catches a `SolveError` can tell failures apart without reading."""
    problem = pressed_block(
        stroke(-0.97, increments=1, name="crush"), material=pr.J2(1000.0, 0.3, pr.Perfect(5.0)), size=(2, 1),
        n=(6, 3), friction=pr.Coulomb(3.0),
    )  # fmt: skip
    with pytest.raises(SolveError) as caught:
        list(pr.solve(problem, pr.Numerics(max_cutbacks=0)))
    assert isinstance(caught.value.reason, f.Failure)
    assert f.sentence(caught.value.reason) in str(caught.value)


@pytest.mark.parametrize("place", [13.0, 35.0])
def test_a_tool_that_tips_over_is_reported_so(place):
    """A plate that is free to turn is pressed beside the sheet under it: the line of the force and the supports are reported.

    Opposite the sheet it stays, and with a moment that brings the line over the sheet.
    """

    def pressed(at: float, m: float = 0.0) -> pr.Problem:
        plate = pr.Profile(((-40.0, 0.0), (40.0, 0.0)), at=(at, 1.0))
        return pressed_block(
            pr.Step("hold", push={"plate": pr.Push(y=-50.0, m=m)}), tools={"plate": plate}, size=(10.0, 1.0),
            n=(10, 1), origin=(20.0, 0.0), friction=pr.Coulomb(0.1),
        )  # fmt: skip

    words = rf"along a line through \({place:g}, 1\), .* reaches from \(\d+, 1\) to \(\d+, 1\)"
    with pytest.raises(SolveError, match=words) as failed:
        list(pr.solve(pressed(place), pr.Numerics(max_cutbacks=2)))
    reason = failed.value.reason
    assert isinstance(reason, f.TipsOver)
    assert {reason.first, reason.last} == {(20.0, 1.0), (30.0, 1.0)}
    for stands in (pressed(25.0), pressed(place, 50.0 * (place - 25.0))):
        *_, last = pr.solve(stands)
        assert last.force("plate").y == pytest.approx(50.0)


def test_the_solver_asks_no_words():
    """No module of the solver looks for a literal in a text (`'singular' in reason`)."""
    for path in Path(solver.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In | ast.NotIn):
                assert not (isinstance(node.left, ast.Constant) and isinstance(node.left.value, str)), path


def test_the_solver_has_no_tuning_but_its_policy():
    """No module of the solver but `policy.py` has a number of its own at module level."""
    for path in Path(solver.__file__).parent.glob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.Assign | ast.AnnAssign) and path.name != "policy.py":
                assert not (isinstance(node.value, ast.Constant) and isinstance(node.value.value, int | float)), path


def test_a_policy_is_handed_in():
    """Another first increment, and the run has it; the default is left as it was."""
    problem = upset_block(stroke(-0.01), material=pr.J2(1000.0, 0.3, pr.Voce(5.0, 5.0, 8.0)), size=(2, 1), n=(6, 3))
    assert next(iter(pr.solve(problem, policy=Policy(first_share=0.001)))).time == 0.001
    assert next(iter(pr.solve(problem))).time == Policy().first_share


def test_a_step_without_contacts_that_cannot_be_evaluated_ends_in_words():
    """A bar of rubber that is crushed in one increment: elements turn inside out, and there is no contact step to take."""
    body = pr.Body(pr.Rectangle((1.0, 3.0), (4, 12)), pr.NeoHooke(E=1000.0, nu=0.3))
    crush = pr.Step("crush", increments=1, fixed={"b.top": pr.Fixed(x=0.0, y=-2.8)})
    problem = pr.Problem("bar", bodies={"b": body}, steps=(crush,), fixed={"b.bottom": "xy"})
    with pytest.raises(SolveError, match="What to try"):
        list(pr.solve(problem))


@pytest.mark.parametrize(
    ("failure", "in_use", "words"),
    [
        (f.LimitPoint(f.Jumped()), InUse(forces=False), ("'move'", "'control'")),
        (f.LimitPoint(f.Jumped()), InUse(viscous_forces=True), ("'stabilise: auto'",)),
        (f.Distorted(1, "b", 0.0, 0.0, 0.1, 3, (), ()), InUse(remeshing=True), ("'remesh: auto'",)),
        (f.Distorted(1, "b", 0.0, 0.0, 0.1, 3, (), ()), InUse(friction=False), ("friction",)),
        (f.Distorted(1, "b", 0.0, 0.0, 0.1, 3, (), ()), InUse(space=True), ("'t6'",)),
        (f.Unevaluable(f.ElementFailed(1, "b", 0.0, 0.0, f.Why.INVERTED)), InUse(space=True), ("q4",)),
    ],
)
def test_nothing_is_advised_that_is_in_use_already(failure, in_use, words):
    """Without it the advice has these words."""
    for word in words:
        assert word in hint(failure) and word not in hint(failure, in_use)


@pytest.mark.parametrize(
    "failure",
    [
        f.Distorted(1, "b", 0.0, 0.0, 0.1, 3, (), (), z=0.0), f.CornerInverted(1, "b", 0.0, 0.0, 0.0),
        f.Collapsed(1, "b", 0.0, 0.0, 2.0, 0.0), f.Unevaluable(f.ElementFailed(1, "b", 0.0, 0.0, f.Why.INVERTED)),
    ],
)  # fmt: skip
def test_elements_in_space_that_fold_are_advised_what_there_is(failure):
    """A section in the plane may have new meshes, and so may a finer mesh help; 'remesh' of the body itself is not there."""
    words = hint(failure, InUse(space=True))
    assert IN_A_SECTION in words and "finer" in words
    assert words.count("remesh") == 1
