"""Binders under force and on springs, rolls that are driven and rolls that are not: their balances, increment by increment."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from problems import pressed_block, squeezed_block

PLASTIC = pr.J2(1000.0, 0.3, pr.Linear(10.0, 50.0))


def drawn(binder: pr.Step, draw: pr.Step, spring=None) -> pr.Problem:
    """A strip on a table, held down by a plate and drawn out to the right."""
    tools = {"plate": pr.Plane(touching="s.top", spring=spring), "table": pr.Plane(touching="s.bottom")}
    return squeezed_block(
        binder, draw, tools=tools, material=PLASTIC, size=(4, 1), n=(8, 2), origin=(-2, 0), body="s", friction=pr.Coulomb(0.1)
    )


PULL = {"s.right": pr.Motion(x=0.3)}


@pytest.mark.parametrize("tilts", [False, True])
def test_a_binder_holds_its_force_while_metal_is_drawn_from_under_it(tilts):
    """The force of the strip on it is what it is pushed with to 1e-8, free to tilt (without a moment) or not."""
    push = {"plate": pr.Push(y=-20.0, m=0.0 if tilts else None)}
    path = list(pr.solve(drawn(pr.Step("hold", push=push, increments=2), pr.Step("draw", push=push, by=PULL, increments=4))))
    table = [i.force("table").x for i in path if i.step == "draw"]
    for i in path:
        target = 20.0 if i.step == "draw" else 20.0 * i.time
        assert i.force("plate").y == pytest.approx(target, rel=1e-8)
        assert i.force("table").y == pytest.approx(-target, rel=1e-8)
        if tilts:
            assert abs(i.force("plate").m) <= 1e-8 * 4 * target
    assert table[-1] == pytest.approx(0.1 * 20.0, rel=1e-3)  # slides: Coulomb's law on the table


def test_a_binder_on_a_spring_holds_its_characteristic():
    """Force = stiffness × (mount − place) to 1e-8, while the sheet under it thins and the mount is moved again."""
    k = 300.0
    hold = pr.Step("hold", move={"plate": pr.Motion(y=-0.08)}, increments=2)
    draw = pr.Step("draw", by=PULL | {"plate": pr.Motion(y=-0.02)}, increments=4)
    path = list(pr.solve(drawn(hold, draw, pr.Springs(y=k))))
    for i in path:
        mount = -0.08 * min(i.time, 1.0) - 0.02 * max(i.time - 1.0, 0.0)
        state = i.tools["plate"]
        assert state.force.y > 1.0
        assert state.force.y == pytest.approx(k * (state.place.y - mount), rel=1e-8)
        assert state.spring.y == pytest.approx(-state.force.y, rel=1e-8)


def rolled(*steps: pr.Step) -> pr.Problem:
    """Half a strip on its middle line under a roll."""
    return pressed_block(
        *steps, tools={"roll": pr.Circle(4.0, at=(0.0, 5.0))}, material=PLASTIC, size=(6, 1), n=(18, 3),
        origin=(-1.5, 0), body="s", fixed={"s.bottom": "y"}, friction=pr.Coulomb(0.3),
    )  # fmt: skip


PRESS = pr.Step("press", move={"roll": pr.Motion(y=-0.05)}, fixed={"s.right": "x"}, increments=2)
IDLE = {"roll": pr.Push(m=0.0)}


def test_an_idle_roll_turns_with_the_strip_and_has_no_moment():
    """A strip that is pulled through turns the roll: its moment is zero to 1e-8 of force × radius, its rim goes along."""
    pull = pr.Step("pull", push=IDLE, by={"s.right": pr.Motion(x=1.2)}, increments=12)
    path = [i for i in pr.solve(rolled(PRESS, pr.Step("free", push=IDLE, increments=1), pull)) if i.step == "pull"]
    for i in path:
        force = i.force("roll")
        assert abs(force.m) <= 1e-8 * 4.0 * force.y
    turn = path[-1].tools["roll"].place.rz - path[-7].tools["roll"].place.rz
    assert 4.0 * turn == pytest.approx(0.6, rel=0.05)  # the strip's way in as many increments, less what it is stretched


def test_a_driven_roll_feeds_the_strip_and_its_moment_is_a_result():
    """A roll that is turned draws the strip in; its moment is that of the nodal forces about its axis, and does the work."""
    roll = pr.Step("roll", by={"roll": pr.Motion(rz=0.3)}, fixed={"s.right": "free"}, increments=12)
    path = list(pr.solve(rolled(PRESS, roll)))
    for i in path:
        c, tool = i.contacts["s.top-roll"], i.tools["roll"]
        arm = c.x - (tool.at + np.array(tool.place[:2]))
        moment = -(arm[:, 0] * c.force[:, 1] - arm[:, 1] * c.force[:, 0]).sum()
        assert tool.force.m == pytest.approx(moment, abs=1e-8 * 4.0 * tool.force.y)
    last = path[-1]
    assert (last.bodies["s"].x - path[1].bodies["s"].x)[:, 0].mean() == pytest.approx(4.0 * 0.3, rel=0.05)
    assert last.tools["roll"].force.m * 0.3 < 0  # the strip resists: the drive does work on it


def test_a_strip_is_fed_until_friction_carries_it():
    """A pusher brings the strip to the turning rolls, releases once they pull, and the strip goes on by itself."""
    tools = {
        "roll": pr.Circle(4.0, at=(4.5, 4.9)), "pusher": pr.Plane(normal=(1.0, 0.0), at=(-1.5, 0.0)),
    }  # fmt: skip
    turn = pr.Motion(rz=0.1)
    strip = pr.Problem(
        "feed", bodies={"s": pr.Body(pr.Rectangle((3, 1), (12, 3), origin=(-1.5, 0)), PLASTIC)}, fixed={"s.bottom": "y"},
        tools=tools,
        contacts=[pr.Contact(["s.top", "s.right"], "roll", friction=pr.Coulomb(0.3)), pr.Contact("s.left", "pusher")],
        steps=(
            pr.Step("bring", by={"pusher": pr.Motion(x=5.0)}, until=pr.Until(contact={"roll": "touches"}), increments=10),
            pr.Step("bite", by={"pusher": pr.Motion(x=0.5), "roll": pr.Motion(rz=0.3)},
                    until=pr.Until(contact={"pusher": "leaves"}), increments=20),
            pr.Step("roll", by={"roll": turn}, increments=8),
        ),
    )  # fmt: skip
    path = list(pr.solve(strip))
    bring, bite, roll = (i for i in path if i.end_of_step)
    assert bring.stopped == "'roll' touches"
    assert bring.contacts["s.top+s.right-roll"].gap.min() == pytest.approx(0.0, abs=1e-7)
    assert bite.stopped == "'pusher' leaves"
    assert roll.force("pusher").x == 0.0
    assert roll.force("roll").m * 0.1 < 0
    way = (roll.bodies["s"].x - bite.bodies["s"].x)[:, 0]
    assert way.mean() == pytest.approx(4.0 * 0.1, rel=0.2)
