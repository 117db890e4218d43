"""Forces on tools: away from the body, towards it, across to it, off it again, in the plane and in space."""

from __future__ import annotations

import pytest

import prensa as pr
from prensa.checks.before.pushed_tools import pushed_tools

AWAY, DOWN, ACROSS, NOTHING = pr.Push(y=5.0), pr.Push(y=-5.0), pr.Push(x=5.0), pr.Push(y=0.0)


def findings(space: str, tool: pr.ToolShape, *steps: pr.Step) -> list[str]:
    """What is said of a block under a tool 't'."""
    solid = space == "solid"
    mesh = pr.Box((4, 2, 2), (4, 2, 2)) if solid else pr.Rectangle((4, 2), (4, 2))
    body = pr.Body(mesh, pr.Elastic(1e3, 0.3))
    problem = pr.Problem(
        "t", space=space, bodies={"b": body}, tools={"t": tool}, contacts=(pr.Contact("b.top", "t"),),
        fixed={"b.bottom": "xyz" if solid else "xy"}, steps=steps,
    )  # fmt: skip
    return [str(f) for f in pushed_tools(pr.discretise(problem))]


@pytest.mark.parametrize("space", ["plane strain", "axisymmetric", "solid"])
@pytest.mark.parametrize(
    ("pushes", "wrong"),
    [
        ((AWAY,), True),
        ((AWAY, AWAY), True),
        ((NOTHING, AWAY), True),
        ((pr.Push(y=((0.0, 0.0), (1.0, 5.0))),), True),
        ((DOWN,), False),
        ((DOWN, AWAY), False),
        ((pr.Push(y=((0.0, 5.0), (1.0, -5.0))),), False),
        ((NOTHING,), False),
    ],
    ids=["away", "twice", "later", "table", "towards", "and off", "table of both", "none"],
)
def test_a_tool_that_is_only_pushed_away_is_named(space: str, pushes: tuple[pr.Push, ...], wrong: bool) -> None:
    """Once, with the side; one that has been pressed on before may be pulled off."""
    steps = [pr.Step(f"s{k}", push={"t": push}) for k, push in enumerate(pushes)]
    said = findings(space, pr.Plane(touching="b.top"), *steps)
    assert len(said) == wrong
    assert not wrong or "it pushes the tool away from 'b.top', which it never presses; check the sign" in said[0]


@pytest.mark.parametrize("space", ["plane strain", "solid"])
def test_what_a_force_may_do_besides(space: str) -> None:
    """Push across to a side, lift off after a prescribed way into the body; a spring along another axis changes nothing."""
    ball = pr.Sphere(2.0, touching="b.top") if space == "solid" else pr.Circle(2.0, touching="b.top")
    into = pr.Step("into", move={"t": pr.Motion(y=-0.05)})
    off = pr.Step("off", push={"t": AWAY})
    assert not findings(space, ball, pr.Step("across", push={"t": ACROSS}))
    assert not findings(space, ball, into, off)
    assert len(findings(space, ball, off)) == 1
    assert len(findings(space, pr.Plane(touching="b.top", spring=pr.Springs(x=100.0)), off)) == 1
