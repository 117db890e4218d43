"""Rollers on a block: what turns freely is not dragged, what is turned does the work of friction; moments about fixed points."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.contact.pairing import Since, reference_pairs
from prensa.verify.balance import wrench
from problems import pressed_block

R, MU = 20.0, 0.4
GEOMETRIES = ["reference", "current"]


def roller(geometry: str, *steps: pr.Step, above: float = 0.0, columns: int = 64) -> pr.Problem:
    """A rigid roller (``above`` the block at first) on an elastic block of so many columns of elements, off the origin."""
    return pressed_block(
        *steps, tools={"roll": pr.Circle(radius=R, at=(0.0, 7.0 + R + above))}, material=pr.Elastic(E=1e4, nu=0.3),
        size=(16, 6), n=(columns, 8), origin=(-4, 1), body="block", friction=pr.Coulomb(MU), kinematics="small",
        contact_geometry=geometry,
    )  # fmt: skip


def towed(geometry: str, above: float = 0.0) -> list[pr.Increment]:
    """Pressed in by 0.05 and towed by 6, free to turn."""
    down = -0.05 - above
    press = pr.Step("press", move={"roll": pr.Motion(y=down)}, increments=4)
    tow = pr.Step("tow", move={"roll": pr.Motion(x=6.0, y=down)}, push={"roll": pr.Push(m=0.0)}, increments=48)
    return list(pr.solve(roller(geometry, press, tow, above=above)))


@pytest.mark.parametrize("above", [0.0, 5.0])
@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_a_free_roller_rolls_freely(geometry: str, above: float) -> None:
    """Drag within 1e-3 of what friction could bear, and a turn by −x/R, from wherever the roller came."""
    # the drag of the press without a turn has gone when all points that it touched are behind
    path = [inc.tools["roll"] for inc in towed(geometry, above) if inc.tools["roll"].place[0] > 4.0]
    for roll in path:
        assert abs(roll.force.x) <= 1e-3 * MU * roll.force.y
    turned = path[-1].place[2] - path[0].place[2]
    rolled = path[-1].place[0] - path[0].place[0]
    assert turned == pytest.approx(-rolled / R, rel=1e-2)  # but for penetration and creep


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_the_mean_drag_of_a_passage_is_that_of_the_blocks_ends(geometry: str) -> None:
    """In the middle of the block the mean over a passage is none, before and behind it the nearer end draws the roller.

    The ripple about it is much the same with points at nodes, two an edge, and exact enforcement.
    """
    ripples = []
    for more in ({}, {"integration": "gauss2"}, {"enforcement": pr.Exact()}):
        press = pr.Step("press", move={"roll": pr.Motion(y=-0.05)}, increments=2)
        tow = pr.Step("tow", move={"roll": pr.Motion(x=6.0, y=-0.05)}, push={"roll": pr.Push(m=0.0)}, increments=120)
        problem = roller(geometry, press, tow)
        problem = replace(problem, contacts=[replace(problem.contacts[0], **more)])
        late = [i for i in pr.solve(problem) if "roll.fx" in i.means and i.tools["roll"].place.x > 2.5]
        x = np.array([i.tools["roll"].place.x for i in late]) - 0.125  # the middle of the passage
        borne = np.array([MU * i.force("roll").y for i in late])
        mean, ripple = (np.array([getattr(i.means["roll.fx"], of) for i in late]) / borne for of in ("mean", "ripple"))
        before, middle, behind = np.interp([3.0, 4.0, 5.0], x, mean)
        assert abs(middle) < 1e-5
        assert 1e-4 < behind < 2e-4 and -2e-4 < before < -1e-4
        ripples.append(ripple[-1])
    assert max(ripples) < 1.5 * min(ripples) < 1e-3


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_what_drags_a_free_roller_between_nodes_is_the_meshs_ripple(geometry: str) -> None:
    """At nodes and half-way no drag is seen; between them it rises and falls about 0, less on shorter elements.

    With 7 nodes in contact by nearly 1e-3 of what friction could bear, with 15 by a third of that.
    """
    ripple = []
    for columns in (64, 128):
        press = pr.Step("press", move={"roll": pr.Motion(y=-0.05)}, increments=2)
        here = pr.Step("here", move={"roll": pr.Motion(x=3.5, y=-0.05)}, push={"roll": pr.Push(m=0.0)}, increments=columns // 2)
        on = pr.Step("on", move={"roll": pr.Motion(x=4.0, y=-0.05)}, push={"roll": pr.Push(m=0.0)}, increments=columns // 4)
        path = [inc.force("roll") for inc in pr.solve(roller(geometry, press, here, on, columns=columns)) if inc.step == "on"]
        drag = np.array([f.x / (MU * f.y) for f in path])
        assert abs(drag.mean()) <= 1e-4
        ripple.append(np.abs(drag).max())
    assert 5e-4 <= ripple[0] <= 1e-3
    assert ripple[1] <= 0.4 * ripple[0]


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_moments_about_a_fixed_point(geometry: str) -> None:
    """About any point that stays: nodal forces where they act, and the roller's force and moment where the roller is."""
    point = np.array([3.0, -2.0])
    for inc in towed(geometry):
        tool, c = inc.tools["roll"], next(iter(inc.contacts.values()))
        f = np.array(tool.force)
        arm = tool.at + np.array(tool.place[:2]) - point
        nodal = wrench((c.X if geometry == "reference" else c.x) - point, c.force)
        assert f[2] + arm[0] * f[1] - arm[1] * f[0] == pytest.approx(-nodal[2], abs=1e-9 * R * f[1])


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_the_torque_does_the_work_of_friction(geometry: str) -> None:
    """Turned in place, after travelling to it: torque × angle = μ f_y R φ once all slides."""
    down = pr.Motion(x=3.0, y=-0.05)
    press = pr.Step("press", move={"roll": pr.Motion(y=-0.05)}, increments=2)
    tow = pr.Step("tow", move={"roll": down}, push={"roll": pr.Push(m=0.0)}, increments=8)
    turn = pr.Step("turn", move={"roll": pr.Motion(x=3.0, y=-0.05, rz=1.0)}, increments=20)
    path = [inc for inc in pr.solve(roller(geometry, press, tow, turn)) if inc.step == "turn"]
    work = friction = 0.0
    for a, b in itertools.pairwise(path[4:]):
        (fa, pa), (fb, pb) = ((i.tools["roll"].force, i.tools["roll"].place) for i in (a, b))
        work -= 0.5 * (fa.m + fb.m) * (pb[2] - pa[2])
        friction += MU * 0.5 * (fa.y + fb.y) * R * (pb[2] - pa[2])
    assert work == pytest.approx(friction, rel=5e-3)
    # on the undeformed surface pressures along its normal have a moment although turning changes no gap: the tool's slope
    tolerance = 1e-2 if geometry == "reference" else 2e-3
    assert path[-1].energy["friction"] - path[4].energy["friction"] == pytest.approx(work, rel=tolerance)


def test_a_turn_of_before_does_not_slip_when_the_tool_is_lifted() -> None:
    """On the undeformed surface: slip of a motion along the normal is zero whatever the tool has turned."""
    X, normal, u = np.array([[0.3, 1.0], [1.0, 1.0]]), np.array([[0.0, 1.0], [0.0, 1.0]]), np.zeros((2, 2))
    shape = pr.discretise(roller("reference", pr.Step("none"))).tools[0].shape
    before = np.array([2.0, -0.1, -0.7])
    since = Since(np.full((2, 1), 0.25), u, before)
    lifted = reference_pairs(
        shape, X, normal, u, np.array([0.0, 21.0]), before + np.array([0.0, 0.05, 0.0]), 1e3, since
    )
    assert np.allclose(lifted.s, 0.25, atol=1e-14)
