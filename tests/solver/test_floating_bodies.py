"""Bodies that nothing holds go along with the tools that touch them until others stop them."""

from __future__ import annotations

import logging
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.sensitivity.parameters import numbers as numbers_of
from problems import pressed_block

ENFORCEMENTS = {"penalty": pr.Penalty(), "augmented": pr.Augmented(), "exact": pr.Exact()}
METAL = pr.J2(E=70e3, nu=0.33, flow=pr.Voce(s0=100.0, Q=100.0, b=10.0))


def billet(under: float, over: float, step: pr.Step, space: str = "axisymmetric", **more: Any) -> pr.Problem:
    """A billet with gaps to the plate under it and to that over it; in the plane the plates are smooth and a support holds x."""
    plane = space != "axisymmetric"
    return pr.Problem(
        "billet", space=space,
        bodies={"b": pr.Body(pr.Rectangle((6.0, 4.0), (6, 4), origin=(0.0, under)), more.pop("material", METAL))},
        tools={"low": pr.Plane(normal=(0, 1), at=(0.0, 0.0)), "high": pr.Plane(normal=(0, -1), at=(0.0, under + 4.0 + over))},
        contacts=[
            pr.Contact(side, tool, friction=pr.Coulomb(0.0 if plane else 0.2), enforcement=more.get("enforcement", pr.Penalty()))
            for side, tool in (("b.bottom", "low"), ("b.top", "high"))
        ],
        fixed={"b.left": "x"} if plane else {}, steps=[step],
        kinematics=more.get("kinematics", "finite"),
    )  # fmt: skip


@pytest.mark.parametrize("space", ["axisymmetric", "plane strain", "plane stress"])
@pytest.mark.parametrize("enforcement", ENFORCEMENTS)
def test_a_billet_between_two_gaps_is_pressed_as_one_that_touches(enforcement: str, space: str, caplog: Any) -> None:
    """Forces are nothing until both gaps have gone, and then those of a billet that begins between its plates."""
    way, by, gaps = 0.4, ENFORCEMENTS[enforcement], (0.3, 0.1)
    touching = billet(0.0, 0.0, pr.Step("press", move={"high": pr.Motion(y=-way)}, increments=20), space, enforcement=by)
    *_, right = pr.solve(touching)
    apart = billet(*gaps, pr.Step("press", move={"high": pr.Motion(y=-way - sum(gaps))}), space, enforcement=by)
    with caplog.at_level(logging.WARNING):
        run = list(pr.solve(apart))
    assert not any("buckle" in r.getMessage() for r in caplog.records)
    for inc in run:
        gone = -inc.tools["high"].place.y - sum(gaps)
        assert (abs(inc.force("high").y) > 1.0) == (gone > 1e-6)
    assert sum(inc.statistics.cutbacks for inc in run) == 0
    assert run[-1].force("high").y == pytest.approx(right.force("high").y, rel=2e-3)


@pytest.mark.parametrize("space", ["axisymmetric", "plane strain"])
@pytest.mark.parametrize("enforcement", ENFORCEMENTS)
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_a_pushed_tool_brings_the_billet_to_rest(kinematics: str, enforcement: str, space: str) -> None:
    """Whatever the gaps, the force clamps the billet at once, and it yields as one that touches does."""
    elastic = pr.Elastic(1e4, 0.3)
    more = {"enforcement": ENFORCEMENTS[enforcement], "material": elastic, "kinematics": kinematics}
    step = pr.Step("press", push={"high": pr.Push(y=-3000.0)}, increments=3)
    (*_, right), (*_, inc) = (list(pr.solve(billet(*gaps, step, space, **more))) for gaps in ((0.0, 0.0), (0.2, 0.7)))
    assert inc.force("low").y == pytest.approx(-3000.0, rel=1e-8)
    short = 0.9 + inc.tools["high"].place.y - right.tools["high"].place.y
    assert short == pytest.approx(0.0, abs=1e-9 if kinematics == "small" else 1e-7)


@pytest.mark.parametrize("space", ["axisymmetric", "plane strain"])
@pytest.mark.parametrize("enforcement", ENFORCEMENTS)
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_the_way_of_a_pushed_tool_through_air_is_no_work(kinematics: str, enforcement: str, space: str) -> None:
    """Whatever the gaps, the energy balance has the work of a press that touches from the start, and misses no more of it."""
    more = {"enforcement": ENFORCEMENTS[enforcement], "material": pr.Elastic(1e4, 0.3), "kinematics": kinematics}
    step = pr.Step("press", push={"high": pr.Push(y=-300.0)}, increments=2)
    runs = [list(pr.solve(billet(*gaps, step, space, **more)))[-1] for gaps in ((0.0, 0.0), (0.2, 0.7), (0.2, 0.0), (0.0, 0.3))]
    work = [inc.energy["external"] for inc in runs]
    assert work == pytest.approx([work[0]] * len(runs), rel=1e-6)
    missed = [inc.energy["imbalance"] for inc in runs]
    assert missed == pytest.approx([missed[0]] * len(runs), abs=1e-6 * work[0])
    if kinematics == "small" and enforcement != "augmented":  # that ends at a tolerance
        assert abs(missed[0]) < 1e-6 * work[0]


@pytest.mark.parametrize("element", ["q4", "q4_fbar"])
@pytest.mark.parametrize("enforcement", ENFORCEMENTS)
def test_a_tool_that_is_pushed_onto_a_held_body_does_no_work_in_the_air(enforcement: str, element: str) -> None:
    """The work of a roller lowered by a force on a block does not depend on its height, nor does what the trapezoid misses.

    Its derivatives, by modulus, force, height and radius, are those of differences.
    """

    def lowered(gap: float = 0.05, radius: float = 8.0, E: float = 1e4, force: float = -300.0) -> pr.Problem:
        by = ENFORCEMENTS[enforcement]
        return pressed_block(
            pr.Step("press", push={"t": pr.Push(y=force)}, increments=2),
            tools={"t": pr.Circle(radius, at=(3.0, 12.0 + gap))}, material=pr.Elastic(E, 0.3), size=(6.0, 4.0),
            n=(12, 8), element=element, enforcement=by,
        )  # fmt: skip

    def work(problem: pr.Problem) -> tuple[float, float]:
        *_, inc = pr.solve(problem, exact)
        return inc.energy["external"], inc.energy["imbalance"]

    exact = pr.Numerics(tolerance=1e-11)
    low, high = work(lowered(0.01)), work(lowered(0.7))
    assert low == pytest.approx(high, rel=1e-9)
    if enforcement == "augmented":  # its end is a tolerance, which differences see
        return
    sizes = {"tools.t.radius": ("radius", 8.0), "bodies.b.material.E": ("E", 1e4), "steps.0.push.t.y": ("force", -300.0)}
    *_, inc = pr.solve(lowered(), exact, derivatives=[*sizes, "tools.t.at.1"])
    assert inc.derivatives is not None
    found = inc.derivatives.of(lambda i: i.energy["external"], inc)
    for path, (name, size) in sizes.items():
        step = 1e-4 * abs(size)
        above, below = (work(lowered(**{name: size + sign * step}))[0] for sign in (1.0, -1.0))
        assert found[path] == pytest.approx((above - below) / (2.0 * step), rel=1e-5)
    assert abs(found["tools.t.at.1"]) < 1e-6 * low[0]


def rolled_down(
    gap: float, space: str = "plane strain", radius: float = 8.0, mu: float = 0.3, element: str = "q4_fbar",
    enforcement: Any = None, **more: Any,
) -> pr.Problem:  # fmt: skip
    """A block under a roller beside its middle, with friction, that a force lowers through a gap; nothing else moves it."""
    axisymmetric, by = space == "axisymmetric", enforcement or pr.Penalty()
    return pressed_block(
        pr.Step("press", push={"t": pr.Push(y=-300.0)}, increments=2), material=pr.Elastic(1e4, 0.3), size=(6.0, 4.0),
        n=(24, 16), element=element, tools={"t": pr.Circle(radius, at=(0.0 if axisymmetric else 2.3, 4.0 + radius + gap))},
        contacts=[pr.Contact("b.top", "t", friction=pr.Coulomb(mu), enforcement=by)],
        fixed={"b.bottom": "y", "b.left": "x"} if axisymmetric else {"b.bottom": "xy"}, space=space, **more,
    )  # fmt: skip


@pytest.mark.parametrize("space", ["axisymmetric", "plane strain", "plane stress"])
@pytest.mark.parametrize("enforcement", ENFORCEMENTS)
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_friction_knows_nothing_of_the_way_through_air(kinematics: str, enforcement: str, space: str) -> None:
    """A round tool comes near to other points as it is lowered; what slips, and the forces of that, begin at the touch."""
    more: dict[str, Any] = {"enforcement": ENFORCEMENTS[enforcement], "kinematics": kinematics, "element": "q4"}
    (*_, near), (*_, far) = (list(pr.solve(rolled_down(gap, space, **more))) for gap in (0.0, 1.5))
    name = "b.top-t"
    shear, most = near.contacts[name].shear, float(np.abs(near.contacts[name].shear).max())
    assert most > 0.1 * np.abs(near.contacts[name].pressure).max()
    assert far.force("t").x == pytest.approx(near.force("t").x, rel=1e-5, abs=1e-5)
    assert far.contacts[name].shear == pytest.approx(shear, abs=1e-4 * most)


@pytest.mark.parametrize("element", ["q4", "q4_fbar"])
@pytest.mark.parametrize("enforcement", ["penalty", "exact"])
def test_derivatives_know_where_friction_begins(enforcement: str, element: str) -> None:
    """Those of the force along a roller that a force lowers through a gap are those of differences of whole runs."""
    by = {"friction.mu": "mu", "tools.t.radius": "radius", "tools.t.at.1": "gap"}
    own = {"mu": 0.3, "radius": 8.0, "gap": 0.7}

    def force(**more: float) -> float:
        values = own | more
        problem = rolled_down(values.pop("gap"), element=element, enforcement=ENFORCEMENTS[enforcement], **values)
        *_, inc = pr.solve(problem, exact)
        return float(inc.force("t").x)

    exact = pr.Numerics(tolerance=1e-11)
    problem = rolled_down(0.7, element=element, enforcement=ENFORCEMENTS[enforcement])
    paths = {"friction.mu": "contacts.0.friction.mu"}
    *_, inc = pr.solve(problem, exact, derivatives=[paths.get(path, path) for path in by])
    found = inc.derivative("t.force.x")
    for path, name in by.items():
        step = 1e-4 * own[name]  # with 1e-5 the digits that Newton leaves open in the forces, 1e-11 of them, are those compared
        above, below = (force(**{name: own[name] + sign * step}) for sign in (1.0, -1.0))
        assert found[paths.get(path, path)] == pytest.approx((above - below) / (2.0 * step), rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("enforcement", ["penalty", "exact"])
def test_the_way_back_knows_where_friction_begins(enforcement: str) -> None:
    """Gradients by friction, shape, height, place and a slanting force are the derivatives forwards, after a lift as well."""
    push = pr.Push(x=-20.0, y=-300.0)
    steps = [
        pr.Step("press", push={"t": push}, increments=2), pr.Step("lift", move={"t": pr.Motion(y=0.6)}, increments=1),
        pr.Step("again", push={"t": push}, increments=2),
    ]  # fmt: skip
    problem = replace(rolled_down(0.7, enforcement=ENFORCEMENTS[enforcement]), steps=steps)
    by = [
        "contacts.0.friction.mu", "tools.t.radius", "tools.t.at.0", "tools.t.at.1", "steps.0.push.t.x", "steps.0.push.t.y",
        "steps.1.move.t.y", "steps.2.push.t.y", "bodies.b.material.E", "bodies.b.mesh.size.0",
    ]  # fmt: skip
    exact = pr.Numerics(tolerance=1e-11)
    *_, inc = pr.solve(problem, exact, derivatives=by)
    of = ["t.travel.x", "t.travel.y"]
    back, numbers = pr.gradient(problem, of, by, exact), numbers_of(problem)
    for k, measure in enumerate(of):
        forwards = inc.derivative(measure)
        sized = np.array([[forwards[path] * numbers[path], back[path][k] * numbers[path]] for path in by])
        assert np.abs(sized[:, 0] - sized[:, 1]).max() < 1e-7 * np.abs(sized).max()


def test_bodies_carried_through_air_go_no_way_back() -> None:
    """Where a billet between gaps comes to rest cannot be followed backwards, and that is reported."""
    problem = billet(0.2, 0.7, pr.Step("press", push={"high": pr.Push(y=-3000.0)}, increments=3))
    with pytest.raises(pr.PrensaError, match="move through air until something stops them"):
        pr.gradient(problem, "high.travel.y", ["contacts.1.friction.mu"])


def on_posts(at: float, gaps: tuple[float, float]) -> pr.Problem:
    """A stiff beam of 20 × 2 over two round posts at x = 3 and 17, pushed down by a round tool at x = ``at``."""
    tools: dict[str, Any] = {
        f"post{k}": pr.Circle(1.0, at=(x, -1.0 - gap)) for k, (x, gap) in enumerate(zip((3.0, 17.0), gaps))
    }
    contacts = [pr.Contact("b.bottom", name) for name in tools]
    return pr.Problem(
        "beam", space="plane strain", bodies={"b": pr.Body(pr.Rectangle((20.0, 2.0), (40, 4)), pr.Elastic(1e6, 0.3))},
        tools={**tools, "punch": pr.Circle(2.0, at=(at, 4.05))}, contacts=[*contacts, pr.Contact("b.top", "punch")],
        fixed={"b.bottom-left": "x"}, steps=[pr.Step("press", push={"punch": pr.Push(y=-10.0)}, increments=1)],
    )  # fmt: skip


@pytest.mark.parametrize("gaps", [(0.02, 0.05), (0.0, 0.1), (0.1, 0.0)], ids=str)
def test_a_beam_turns_until_it_lies_on_both_posts(gaps: tuple[float, float]) -> None:
    """It comes to lie on both, turned by the difference of the gaps; the posts bear what the lever rule gives them."""
    *_, inc = pr.solve(on_posts(8.0, gaps))
    left, right, u = inc.force("post0"), inc.force("post1"), inc.bodies["b"].x - inc.bodies["b"].X
    assert -(left.y + right.y) == pytest.approx(10.0, rel=1e-6)
    assert -right.y == pytest.approx(10.0 * 5.0 / 14.0, rel=0.02)
    assert (u[40, 1] - u[0, 1]) / 20.0 == pytest.approx((gaps[0] - gaps[1]) / 14.0, rel=0.02)


def test_a_body_that_nothing_stops_is_reported() -> None:
    """The tool takes it along, to where nothing is."""
    p = billet(0.2, 0.1, pr.Step("press", push={"high": pr.Push(y=-10.0)}))
    alone = replace_contacts(p)
    with pytest.raises(pr.PrensaError, match="free to move"):
        list(pr.solve(alone))


def replace_contacts(p: pr.Problem) -> pr.Problem:
    """Without the plate under the billet."""
    return pr.Problem(
        p.name, space=p.space, bodies=p.bodies, tools={"high": p.tools["high"]}, contacts=p.contacts[1:], steps=p.steps
    )


def test_it_goes_on_afloat_as_if_it_had_not_stopped() -> None:
    """A run that goes on from an increment in which the billet is carried along has the same bits."""
    p = billet(0.3, 0.1, pr.Step("press", move={"high": pr.Motion(y=-0.6)}))
    run = list(pr.solve(p))
    at = next(k for k, inc in enumerate(run) if inc.tools["high"].place.y < -0.2)
    assert not run[at].force("high").y
    again = list(pr.solve(p, start=run[at].state))
    assert np.array_equal(again[-1].state.u, run[-1].state.u) and len(again) == len(run) - at - 1


@pytest.mark.parametrize("gap", [0.5, 2.0, 30.0, 90.0])
def test_a_pushed_round_tool_is_found_contact_from_far_away(gap):
    """A roll thinner than its way to the block is not led through it; the farther one presses as the nearer one does."""
    p = pressed_block(
        pr.Step("press", push={"t": pr.Push(y=-10.0)}), tools={"t": pr.Circle(radius=1.0, at=(2.0, 3.0 + gap))},
        plane="t",
    )  # fmt: skip
    *_, inc = pr.solve(p)
    assert inc.tools["t"].force.y == pytest.approx(10.0, rel=1e-8)
    assert inc.tools["t"].place.y + gap == pytest.approx(_depth_of_a_near_roll(), rel=1e-6)


@cache
def _depth_of_a_near_roll() -> float:
    """How far a roll that begins on the block goes."""
    p = pressed_block(
        pr.Step("press", push={"t": pr.Push(y=-10.0)}), tools={"t": pr.Circle(radius=1.0, at=(2.0, 3.0))}, plane="t"
    )
    *_, inc = pr.solve(p)
    return float(inc.tools["t"].place.y)
