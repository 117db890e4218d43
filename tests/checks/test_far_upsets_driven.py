"""Bodies that a side that is moved presses together, in any direction: as a moved tool does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_far_upsets import BOX, ROUND, STEEL, extrusion
from test_far_upsets import upset as by_tool

import prensa as pr
from prensa.checks.before.extrusions import spread
from prensa.checks.before.far_upsets import far_upsets, sheared, upset


def by_side(mesh: object, travel: float, mu: float = 0.3, **given: object) -> pr.Problem:
    """The same eighth of a billet against a tool that stands, its middle plane moved towards it."""
    p = by_tool(mesh, travel, mu)
    step = pr.Step("press", by={"b.bottom": pr.Motion(y=-p.steps[0].move["t"].y)}, increments=30)
    fixed = {name: way for name, way in p.fixed.items() if name != "b.bottom"}
    return replace(p, **({"fixed": fixed, "steps": (step,)} | given))


def said(p: pr.Problem) -> str:
    """What the check says."""
    return " ".join(map(str, far_upsets(pr.discretise(p))))


@pytest.mark.parametrize("mesh", [BOX, ROUND], ids=["box", "round"])
@pytest.mark.parametrize(("travel", "mu"), [(0.85, 0.3), (0.3, 0.3), (0.85, 0.0)])
def test_a_moved_side_presses_as_a_moved_tool_does(mesh, travel, mu):
    """By as much, with the same shear; the subject of the sentence is another."""
    one, other = said(by_side(mesh, travel, mu)), said(by_tool(mesh, travel, mu))
    assert one == other.replace("tools press 'b' together", "the motion of a side of 'b' presses it together")
    assert bool(one) == (travel > 0.5 and mu > 0.0)


def test_a_gap_is_gone_through_before():
    """A tool that stands half of the height off is met after that way."""
    away = pr.Plane(at=(0.0, 3.5, 0.0), normal=(0.0, -1.0, 0.0))
    wide = by_side(BOX, 0.85, tools={"t": away})
    a, b = upset(pr.discretise(wide), "b"), upset(pr.discretise(by_side(BOX, 0.45)), "b")
    assert a is not None and b is not None and a.left == pytest.approx(b.left) and a.driven and b.driven


def test_a_side_moved_towards_one_that_is_held_presses():
    """Without any tool, where supports hold both ends sideways; and not where they pull."""
    fixed = {"b.bottom": pr.Fixed(x=0.0, y=0.0, z=0.0), "b.top": pr.Fixed(x=0.0, z=0.0)}
    p = by_side(BOX, 0.6, tools={}, contacts=(), fixed=fixed, steps=(pr.Step("press", by={"b.top": pr.Motion(y=-1.5)}),))
    assert "presses it together by 1.5 of 2.5" in said(p)
    assert said(replace(p, steps=(pr.Step("pull", by={"b.top": pr.Motion(y=1.5)}),))) == ""


def test_a_side_that_is_fed_presses_all_the_way():
    """A tool that stands does not grip it."""
    assert "by 2.125 of 2.5" in said(by_side(BOX, 0.85, steps=(pr.Step("feed", feed={"b.bottom": pr.Feed(y=2.125)}),)))


def test_what_follows_a_step_that_ends_on_its_way_is_the_least():
    """Two ways, of which the first may end at once."""
    until = pr.Until(force={"t": pr.ToolForce(y=2500.0)})
    first = pr.Step("meet", by={"b.bottom": pr.Motion(y=1.0)}, until=until, increments=3)
    on = pr.Step("press", by={"b.bottom": pr.Motion(y=2.0)}, increments=20)
    assert "by at least 2 of 2.5" in said(by_side(BOX, 0.0, steps=(first, on)))
    assert said(by_side(BOX, 0.0, steps=(first, replace(on, by={"b.bottom": pr.Motion(y=0.5)})))) == ""


def test_a_strip_that_is_pushed_between_rolls_is_not_pressed_along_its_length():
    """It goes past the roll that its front faces from afar."""
    roll = pr.Extruded(section=pr.Circle(radius=50.0), axis=(0.0, 0.0, 1.0), at=(60.0, 54.0, 0.0))
    bar = pr.Box((20.0, 5.0, 5.0), (8, 2, 2))
    p = by_side(bar, 0.0, tools={"t": roll}, fixed={"b.bottom": "y", "b.back": "z"},
                contacts=(pr.Contact(("b.top", "b.right"), "t", pr.Coulomb(0.3)),),
                steps=(pr.Step("push", by={"b.left": pr.Motion(x=60.0)}),))  # fmt: skip
    u = upset(pr.discretise(p), "b")
    assert u is None or abs(u.across[0]) < 0.5


@pytest.mark.parametrize(("angle", "reported"), [(40, True), (30, False)])
def test_an_extrusion_by_a_moved_side_is_one_by_a_punch(angle, reported):
    """The same sentence, whatever pushes the billet."""
    p = extrusion(angle, 0.5)
    step = pr.Step("press", by={"b.top": pr.Motion(y=p.steps[0].move["t"].y)}, increments=30)
    other = replace(p, tools={"die": p.tools["die"]}, contacts=p.contacts[1:], steps=(step,))
    assert said(other) == said(p) and bool(said(p)) == reported


def turned_about(p: pr.Problem, angle: float) -> pr.Problem:
    """A quarter of a box that a plane presses onto a plane, all of it turned about z."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    mesh = pr.discretise(p).meshes["b"]
    sides = {name: mesh.nodes(name, name).tolist() for name in ("left", "right", "bottom", "top", "back", "front")}
    bricks = pr.Bricks((mesh.points @ R.T).tolist(), mesh.cells.tolist(), sides)
    motion, force = p.steps[0].move.get("t"), p.steps[0].push.get("t")
    move = {"t": pr.Motion(**dict(zip("xyz", (R @ (0.0, motion.y, 0.0)).tolist())))} if motion else {}
    push = {"t": pr.Push(**dict(zip("xyz", (R @ (0.0, force.y, 0.0)).tolist())))} if force else {}
    tool = pr.Plane(normal=tuple((R @ (0.0, -1.0, 0.0)).tolist()), at=tuple((R @ (0.0, BOX.size[1], 0.0)).tolist()))
    fixed = {"b.left": "normal", "b.back": "z", "b.bottom": "normal"}
    step = replace(p.steps[0], move=move, push=push)
    return replace(p, bodies={"b": pr.Body(bricks, STEEL)}, tools={"t": tool}, fixed=fixed, steps=(step,))


@pytest.mark.parametrize("angle", [0.3, 0.7, 1.2])
def test_a_turned_billet_is_pressed_as_a_straight_one(angle):
    """By a motion, and by a force along the same direction; its width is found across it."""
    p = by_tool(BOX, 0.85)
    made, straight = pr.discretise(turned_about(p, angle)), pr.discretise(p)
    a, b = upset(made, "b"), upset(straight, "b")
    assert a is not None and b is not None and (a.left, a.height) == pytest.approx((b.left, b.height))
    np.testing.assert_allclose(spread(made, "b", a.across).distances, spread(straight, "b", b.across).distances, atol=1e-9)
    assert sheared(made, "b", a) == pytest.approx(sheared(straight, "b", b), rel=1e-6)
    assert said(turned_about(p, angle)) == said(p) != ""
    push = replace(p, steps=(pr.Step("press", push={"t": pr.Push(y=-3e5)}, increments=9),))
    assert said(turned_about(push, angle)) == said(push) != ""
