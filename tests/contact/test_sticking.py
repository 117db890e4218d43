"""A step that ends at the touch, a towed roller, a tool that is released: in every enforcement, rule, space and geometry."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.result.increment import STATUS
from problems import pressed_block, stroke

RULES = ["nodal", "gauss1", "gauss2", "gauss3", "kikuchi", "simpson"]
WAYS = [(e, rule) for e in (pr.Penalty(), pr.Augmented()) for rule in RULES]
WAYS += [(pr.Exact(), rule) for rule in ("nodal", "gauss1")]  # the others are refused: their multipliers are not determined
SPACES = ["plane strain", "plane stress", "axisymmetric"]
MODES = [("small", "reference"), ("small", "current"), ("finite", "current")]
#: every way with every space and every geometry, three of the nine pairs of these for each
EVERYWHERE = [(*w, space, MODES[(i + k) % 3]) for i, w in enumerate(WAYS) for k, space in enumerate(SPACES)]
NAMES = [f"{e.type}-{rule}-{space.replace(' ', '-')}-{'-'.join(mode)}" for e, rule, space, mode in EVERYWHERE]
MU = 0.4


def pressed(way: tuple, gap: float, *steps: pr.Step, at: float = 3.0) -> pr.Problem:
    """A round tool or a plane (by the space) ``gap`` over an elastic block on a bonded base."""
    enforcement, rule, space, mode = way
    at = 0.0 if space == "axisymmetric" else at
    tool = pr.Circle(radius=7.0, at=(at, 3.0 + gap + 7.0))
    return pressed_block(
        *steps, tools={"t": tool}, size=(6.0, 3.0), n=(6, 3), friction=pr.Coulomb(MU), enforcement=enforcement,
        integration=rule, fixed={"b.bottom": "xy"} | ({"b.left": "x"} if space == "axisymmetric" else {}),
        space=space, kinematics=mode[0], contact_geometry=mode[1],
    )  # fmt: skip


@pytest.mark.parametrize("way", EVERYWHERE, ids=NAMES)
def test_a_step_ends_where_the_tool_touches(way: tuple) -> None:
    """An approach by exactly the gap and then a press give what the press alone gives from where the tool touches."""
    number = EVERYWHERE.index(way)
    rng = np.random.default_rng(number)
    gap, depth = (float(np.round(v, 2)) for v in rng.uniform([0.05, 0.05], [2.0, 0.2]))
    approach = pr.Step("approach", move={"t": pr.Motion(y=-gap)}, increments=(None, 1, 3)[number % 3])
    press = pr.Step("press", move={"t": pr.Motion(y=-gap - depth)}, increments=2)
    *_, inc = pr.solve(pressed(way, gap, approach, press))
    *_, alone = pr.solve(pressed(way, 0.0, pr.Step("press", move={"t": pr.Motion(y=-depth)}, increments=2)))
    assert inc.force("t").y > 0.1 and inc.force("t").y == pytest.approx(alone.force("t").y, rel=1e-6)


@pytest.mark.parametrize("way", EVERYWHERE, ids=NAMES)
def test_a_tool_that_is_released_starts_from_its_force(way: tuple) -> None:
    """A tool moved, then pushed by less: in both increments the force on the line from the one it had to the one asked for."""
    press = pr.Step("press", move={"t": pr.Motion(y=-0.1)}, increments=1)
    first = list(pr.solve(pressed(way, 0.0, press)))[-1].force("t").y
    push = pr.Step("push", push={"t": pr.Push(y=-0.4 * first)}, increments=2)
    *_, half, end = pr.solve(pressed(way, 0.0, press, push))
    assert half.time == 1.5 and half.force("t").y == pytest.approx(0.7 * first, rel=1e-6)
    assert end.force("t").y == pytest.approx(0.4 * first, rel=1e-6)


#: cheap ones; augmented contact at points inside edges rolls too, and takes ten times as long
TOWED = [k for k, (e, rule) in enumerate(WAYS) if not isinstance(e, pr.Augmented) or rule == "nodal"]


@pytest.mark.parametrize("k", TOWED, ids=[f"{WAYS[k][0].type}-{WAYS[k][1]}" for k in TOWED])
def test_a_towed_roller_rolls(k: int) -> None:
    """Pressed in and towed, free to turn: drag within 1e-3 of what friction could bear, turned by −x/R."""
    (enforcement, rule), space, mode = WAYS[k], SPACES[k % 2], MODES[k % 3]  # nothing rolls about an axis of revolution
    radius, down = 20.0, -0.05
    press = pr.Step("press", move={"t": pr.Motion(y=down)}, increments=2)
    tow = pr.Step("tow", move={"t": pr.Motion(x=4.0, y=down)}, push={"t": pr.Push(m=0.0)}, increments=32)
    p = pressed_block(
        press, tow, tools={"t": pr.Circle(radius, at=(0.0, 4.0 + radius))}, material=pr.Elastic(E=1e4, nu=0.3),
        size=(14, 3), n=(56, 3), origin=(-3, 1), friction=pr.Coulomb(MU), enforcement=enforcement, integration=rule,
        space=space, kinematics=mode[0], contact_geometry=mode[1],
    )  # fmt: skip
    # the drag of the press without a turn has gone when all points that it touched are behind
    path = [inc.tools["t"] for inc in pr.solve(p) if inc.tools["t"].place[0] > 3.0]
    for tool in path:
        assert abs(tool.force.x) <= 1e-3 * MU * tool.force.y
    turned, rolled = (path[-1].place[k] - path[0].place[k] for k in (2, 0))
    assert turned == pytest.approx(-rolled / radius, rel=2e-2)  # but for penetration and creep


@pytest.mark.parametrize(("friction", "word"), [(pr.Coulomb(0.3), "stick"), (None, "slip")], ids=["friction", "none"])
def test_a_lone_node_without_shear_sticks_if_there_is_friction(friction, word):
    """Whether a contact has friction is its law's to say, not its tractions'."""
    p = pressed_block(
        stroke(-0.01, tool="die"), tools={"die": pr.Circle(4.0, at=(1.0, 6.0))}, size=(2, 2), n=(2, 2),
        friction=friction,
    )  # fmt: skip
    *_, last = pr.solve(p)
    contact = last.contacts["b.top-die"]
    assert [STATUS[k] for k in contact.status if STATUS[k] != "open"] == [word]
    assert contact.shear == pytest.approx(0.0, abs=1e-12)
