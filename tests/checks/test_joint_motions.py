"""Motions of bodies together with pushed tools, and bodies that tools push away: drawn at random, against statics."""

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight

SIDES = {"left": ("x", 1.0), "right": ("x", -1.0), "bottom": ("y", 1.0), "top": ("y", -1.0)}
OPPOSITE = {"left": "right", "right": "left", "bottom": "top", "top": "bottom"}


def box(tools, fixed, step, friction=None, space="plane strain"):
    """A block with planes on some of its sides."""
    return pr.Problem(
        "box", space=space, bodies={"box": pr.Body(pr.Rectangle((4.0, 3.0), n=(4, 3)), pr.Elastic(1000.0, 0.3))},
        tools={side: pr.Plane(touching=f"box.{side}") for side in tools}, friction=friction, fixed=fixed, steps=[step],
    )  # fmt: skip


def refused(problem):
    """What the check refuses."""
    return [f.message for f in preflight(pr.discretise(problem)) if f.fatal]


def away(problem):
    """What the check says of bodies that tools push away."""
    return [f.message for f in preflight(pr.discretise(problem)) if "away from the tools" in f.message]


@pytest.mark.parametrize("seed", range(16))
def test_a_block_between_two_forces_is_free_along_them(seed):
    """Held by a support, a tool whose motion is prescribed, or friction of one, it is not; its force is the one given."""
    rng = np.random.default_rng(seed)
    side = str(rng.choice(list(SIDES)))
    axis, sign = SIDES[side]
    across = "y" if axis == "x" else "x"
    other = OPPOSITE[side]
    rest = {f"box.{'bottom' if axis == 'x' else 'left'}": across}
    push = {side: {axis: sign * 10.0}, other: {axis: -sign * 10.0}}
    (words,) = refused(box((side, other), rest, pr.Step("press", push=push)))
    assert f"move along {axis} together" in words and side in words and other in words
    held = box((side, other), rest, pr.Step("press", push={side: push[side]}, move={other: {axis: 0.0}}))
    assert not refused(held)
    *_, last = pr.solve(held)
    assert getattr(last.force(other), axis) == pytest.approx(sign * 10.0, rel=1e-6)
    assert not refused(box((side, other), rest | {"box.bottom-left": "xy"}, pr.Step("press", push=push)))
    third = "top" if axis == "x" else "right"
    rough = box((side, other, third), rest, pr.Step("press", push=push, move={third: {across: -0.01}}), pr.Coulomb(0.3))
    assert not refused(rough)


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
@pytest.mark.parametrize("side", ["top", "bottom"])
def test_a_block_that_nothing_stands_behind_is_pushed_away(side, space, mu):
    """With a support, a tool or a load on its other side it is not."""
    _, sign = SIDES[side]
    friction = pr.Coulomb(mu) if mu else None
    middle = {} if space == "axisymmetric" else {"box.left": "x"}
    step = pr.Step("press", move={side: {"y": 0.1 * sign}})
    (words,) = away(box((side,), middle, step, friction, space))
    assert [words] == refused(box((side,), middle, step, friction, space))  # the run would go to its end with 0 N
    assert f"free to move along {'-' if sign < 0 else '+'}y, away from" in words
    other = OPPOSITE[side]
    assert not away(box((side,), middle | {f"box.{other}": "y"}, step, friction, space))
    assert not away(box((side, other), middle, step, friction, space))
    lifted = pr.Step("lift", move={side: {"y": -0.1 * sign}})
    assert not away(box((side,), middle, lifted, friction, space))
    pressure = pr.Step("press", move={side: {"y": 0.1 * sign}}, loads={f"box.{other}": pr.Load(pressure=1.0)})
    assert not away(box((side,), middle, pressure, friction, space))


def test_a_strip_that_rolls_grip_is_not_pushed_away():
    """The roll stands above the strip and before it: without friction it pushes the strip back, with friction it draws it in."""

    def strip(friction):
        mesh = pr.Rectangle((20.0, 2.0), n=(20, 2), origin=(-20.0, 0.0))
        return pr.Problem(
            "strip", bodies={"strip": pr.Body(mesh, pr.Elastic(1000.0, 0.3))},
            tools={"roll": pr.Circle(radius=20.0, at=(4.0, 21.5))}, friction=friction, fixed={"strip.bottom": "y"},
            steps=[pr.Step("roll", move={"roll": {"y": -0.1, "rz": -0.3}})],
        )  # fmt: skip

    assert any("along -x" in words for words in away(strip(None)))
    assert not away(strip(pr.Coulomb(0.3)))


@pytest.mark.parametrize("gap", [0.0, 0.5])
@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_an_upsetting_without_a_support_is_refused_in_one_sentence(space, gap):
    """With a gap too, where a tool that touched it first would not help; a second plane or a support is what is missing."""

    def upsetting(**more):
        tools = {"top": pr.Plane(at=(0.0, 3.0 + gap), normal=(0.0, -1.0))} | more.pop("tools", {})
        return pr.Problem(
            "billet", space=space, bodies={"billet": pr.Body(pr.Rectangle((4.0, 3.0), n=(4, 3)), pr.Elastic(1000.0, 0.3))},
            tools=tools, friction=pr.Coulomb(0.2), steps=[pr.Step("press", move={"top": {"y": -gap - 0.1}})], **more,
        )  # fmt: skip

    (finding,) = preflight(pr.discretise(upsetting()))
    assert finding.fatal and "move along -y" in finding.message and "'fixed'" in finding.message
    with pytest.raises(pr.PrensaError, match="nothing carries what they press with"):
        list(pr.solve(upsetting()))
    anvil = {"anvil": pr.Plane(at=(0.0, 0.0), normal=(0.0, 1.0))}
    for held in (upsetting(tools=anvil), upsetting(fixed={"billet.bottom": "xy"})):
        assert not refused(held)
        *_, last = pr.solve(held)
        assert last.force("top").y > 1.0


def test_a_body_that_something_may_yet_stop_is_warned_of():
    """In a V that it slides into, on its other flank; where a later step holds it."""
    mesh = pr.Rectangle((2.0, 2.0), n=(2, 2), origin=(-4.0, 0.0))
    vee = pr.Polygon(points=((0.0, 8.0), (8.0, 0.0), (8.0, 12.0), (-8.0, 12.0), (-8.0, 0.0)), fillet=0.1, at=(0.0, 1.0))
    steps = [pr.Step("close", move={"vee": {"y": -2.0}})]
    guided = pr.Problem(
        "vee", bodies={"b": pr.Body(mesh, pr.Elastic(1000.0, 0.3))}, tools={"vee": vee}, fixed={"b.bottom": "y"}, steps=steps
    )
    assert not [words for words in refused(guided) if "away from the tools" in words]
    push = {"move": {"top": {"y": -0.1}}}
    later = box(("top",), {"box.left": "x"}, pr.Step("bring", **push))
    held = pr.Step("hold", fixed={"box.bottom": pr.Fixed(y="held")}, move={"top": {"y": -0.2}})
    twice = pr.Problem(
        "twice", bodies=later.bodies, tools=later.tools, fixed=later.fixed, steps=[*later.steps, held]
    )
    assert away(twice) and not refused(twice)
