"""Bodies in space that drift together with the tools that are pushed against them, by statics alone, before a run."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight

SIDES = {
    "left": ("x", 1.0), "right": ("x", -1.0), "bottom": ("y", 1.0), "top": ("y", -1.0), "back": ("z", 1.0), "front": ("z", -1.0),
}  # fmt: skip
PAIRS = (("left", "right"), ("bottom", "top"), ("back", "front"))
ELASTIC = pr.Elastic(1000.0, 0.3)
ROUGH = pr.Coulomb(0.3)


def block(tools, fixed, step, friction=None):
    """A block with tools, against sides of it by their names."""
    return pr.Problem(
        "block", space="solid", bodies={"b": pr.Body(pr.Box((4.0, 3.0, 2.0), (2, 2, 2)), ELASTIC)},
        tools=tools,
        contacts=tuple(pr.Contact(f"b.{side}", side, friction=friction) for side in tools), fixed=fixed, steps=[step],
    )  # fmt: skip


def planes(*sides, at=(0.0, 0.0, 0.0)):
    """Planes on sides of the block, by which they are called."""
    return {side: pr.Plane(touching=f"b.{side}", at=at) for side in sides}


def refused(problem):
    """What the check refuses."""
    return [f.message for f in preflight(pr.discretise(problem)) if f.fatal]


@pytest.mark.parametrize("friction", [None, ROUGH])
@pytest.mark.parametrize("pair", PAIRS)
def test_a_block_between_two_forces_is_free_along_them(pair, friction):
    """Held by a support or by a tool whose motion is prescribed it is not; the force of that tool is then the one given."""
    one, other = pair
    axis, sign = SIDES[one]
    rest = {f"b.{a}": SIDES[a][0] for a, _ in PAIRS if a != one}
    push = {one: {axis: 10.0 * sign}, other: {axis: -10.0 * sign}}
    (words,) = refused(block(planes(*pair), rest, pr.Step("press", push=push), friction))
    assert f"'b', '{one}', '{other}' are free to move along {axis} together" in words
    third = next(a for a, _ in PAIRS if a != one)
    beside = block(planes(*pair, third), rest, pr.Step("press", push=push, move={third: {SIDES[third][0]: 0.01}}), friction)
    assert bool(refused(beside)) == (friction is None)  # friction of a tool whose motion is prescribed resists
    held = block(planes(*pair), rest, pr.Step("press", push={one: push[one]}, move={other: {axis: 0.0}}), friction)
    assert not refused(held)
    *_, last = pr.solve(held)
    assert getattr(last.force(other), axis) == pytest.approx(10.0 * sign, rel=1e-6)
    assert not refused(block(planes(*pair), rest | {f"b.{other}": axis}, pr.Step("press", push=push), friction))


@pytest.mark.parametrize(
    ("also", "words"),
    [
        ({"x": 0.0, "z": 0.0}, "move along x and z together"),
        ({"x": 0.0}, "move along x together"),
        ({"my": 0.0}, "turn about y through (1, 1.5, 0.5) together"),
        ({"x": 0.0, "z": 0.0, "my": 0.0}, "move along x and z and to turn about y through (2, 1.5, 1) together"),
    ],
)
def test_a_block_that_friction_alone_holds_to_its_die_goes_with_it(also, words):
    """A support of the block across its plane ends that; without friction the block is loose by itself, and the die is held."""
    step, tools = pr.Step("press", push={"top": {"y": -12.0} | also}), planes("top", at=(1.0, 3.0, 0.5))
    (said,) = refused(block(tools, {"b.bottom": "y"}, step, ROUGH))
    assert f"'b', 'top' are free to {words}" in said
    assert not refused(block(tools, {"b.bottom": "xyz"}, step, ROUGH))
    assert not refused(block(tools, {"b.bottom": "y", "b.left": "x", "b.back": "z"}, step, ROUGH))
    assert not any("together" in said for said in refused(block(tools, {"b.bottom": "y"}, step)))


def test_a_block_turns_with_two_dies_where_their_friction_lets_it():
    """Dies that may tilt but not slide hold the sides of a block at two heights; one that may slide too goes along."""
    push = {"top": {"y": -10.0, "mx": 0.0}, "bottom": {"y": 10.0, "mx": 0.0}}

    def pressed(push):
        return refused(block(planes("top", "bottom"), {"b.left": "x"}, pr.Step("press", push=push), ROUGH))

    (said,) = pressed(push)
    assert "'b', 'top', 'bottom' are free to move along y together" in said
    (said,) = pressed(push | {"top": push["top"] | {"z": 0.0}})
    assert "'b', 'top', 'bottom' are free to move along y and to turn about x through (2, 0, 1) together" in said
    assert not pressed({"top": push["top"]})


@pytest.mark.parametrize("friction", [None, ROUGH])
def test_what_a_tool_may_do_alone_is_no_motion_of_the_block(friction):
    """A ball that turns about its middle and rolls on a held block, and a die that slides on one and stands on springs."""
    ball = pr.Sphere(radius=3.0, at=(2.0, 6.0, 1.0))
    turns = {"y": -1.0, "mx": 0.0, "my": 0.0, "mz": 0.0}
    held = {"b.bottom": "xyz"}
    assert not refused(block({"top": ball}, held, pr.Step("press", push={"top": turns}), friction))
    (said,) = refused(block(
        {"top": ball} | planes("bottom"), {"b.left": "x", "b.back": "z"},
        pr.Step("press", push={"top": turns, "bottom": {"y": 1.0}}), friction,
    ))  # fmt: skip
    assert "'b', 'top', 'bottom' are free to move along y together" in said
    hung = {"top": pr.Plane(touching="b.top", at=(0.0, 0.0, 0.0), spring={"x": 5.0, "z": 5.0})}
    assert not refused(block(hung, {"b.bottom": "y"}, pr.Step("press", push={"top": {"y": -1.0}}), ROUGH))


def test_motions_follow_the_axes_that_a_problem_is_written_in():
    """The same die, its reference point and its free turn given with any axis up: one motion, by the name of that axis."""
    ups = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])
    for names in ups:
        across, up, _ = ("xyz"[k] for k in names)
        side, foot = next(pair[::-1] for pair in PAIRS if SIDES[pair[0]][0] == up)
        step = pr.Step("press", push={side: {up: -12.0, across: 0.0}})
        (said,) = refused(block(planes(side), {f"b.{foot}": up}, step, ROUGH))
        assert f"free to move along {across} together" in said
