"""Release of forces in a step: it starts from the force that it carries and goes linearly to what is asked."""

from __future__ import annotations

import itertools
import logging
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.errors import SolveError
from prensa.friction.fading import Fading, fading
from prensa.friction.law import At
from prensa.system.planning import plan_step
from prensa.system.state import State
from prensa.verify.balance import imbalance
from problems import pressed_block, single_block, tied_blocks

ELASTIC = pr.Elastic(1000.0, 0.3)
PLASTIC = pr.J2(1000.0, 0.3, pr.Linear(20.0, 50.0))
MODES = [("small", "reference"), ("small", "current"), ("finite", "current")]
WAYS = [
    (pr.Penalty(), "nodal"), (pr.Penalty(), "gauss2"), (pr.Penalty(), "kikuchi"), (pr.Augmented(), "nodal"),
    (pr.Augmented(), "simpson"), (pr.Exact(), "nodal"), (pr.Exact(), "gauss1"),
]  # fmt: skip
PRESS = pr.Step("press", move={"t": pr.Motion(y=-0.05)}, increments=2)
DRAG = pr.Step("drag", move={"t": pr.Motion(x=0.1)}, increments=2)


def bar(*steps: pr.Step, **more) -> pr.Problem:
    """A block on a smooth base, its top held by steps."""
    fixed = {"b.bottom": "y"} | ({"b.left": "x"} if more.get("space") != "axisymmetric" else {})
    return single_block(*steps, n=(6, 3), **{"fixed": fixed} | more)


def pressed(*steps: pr.Step, tool=None, mu=0.3, rule="nodal", **more) -> pr.Problem:
    """A bonded block under a plane, or another tool."""
    law = pr.Coulomb(mu) if mu else None
    return pressed_block(*steps, tools={"t": tool} if tool else None, n=(6, 3), friction=law, integration=rule, **more)


def by_step(problem: pr.Problem) -> dict[str, list[pr.Increment]]:
    """Increments by step; all in balance, what is being released counted in, unless forces are nothing but round-off."""
    out, system, largest = {}, pr.discretise(problem), 0.0
    for inc in pr.solve(system):
        forces = [*(t.force[:2] for t in inc.tools.values()), *inc.supports.values()]
        size = float(np.abs(forces).max())
        largest = max(largest, size)
        if inc.tools and size > 1e-3 * largest:
            assert max(imbalance(system, inc)) <= 1e-6
        out.setdefault(inc.step, []).append(inc)
    return out


def assert_linear(path: list[pr.Increment], values: list[float], first: float, last: float, tolerance: float = 1e-7):
    """The values of a step go on a straight line from that before it to the last one."""
    for inc, value in zip(path, values, strict=True):
        s = 1.0 if inc.time == int(inc.time) else inc.time % 1.0
        assert value == pytest.approx((1 - s) * first + s * last, abs=tolerance * max(abs(first), abs(last)))


PULL = pr.Step("pull", fixed={"b.top": pr.Fixed(y=0.1)}, increments=2)
FREE = pr.Step("free", fixed={"b.top": "free"}, increments=4)


@pytest.mark.parametrize("space", ["plane strain", "plane stress", "axisymmetric"])
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_a_support_is_released_linearly(space, kinematics):
    """Its reaction falls linearly; the elastic body springs back to where it was; all work that was done comes back."""
    steps = by_step(bar(PULL, FREE, space=space, kinematics=kinematics))
    pulled, free = steps["pull"][-1], steps["free"]
    F = pulled.supports["b.top"].y
    assert F > 0
    assert_linear(free, [i.supports["b.top"].y for i in free], F, 0.0)
    assert np.abs(free[-1].bodies["b"].displacement).max() <= 1e-9
    if kinematics == "small":
        h = pulled.bodies["b"].displacement
        for i, s in zip(free, (0.25, 0.5, 0.75, 1.0), strict=True):
            assert np.abs(i.bodies["b"].displacement - (1 - s) * h).max() <= 1e-12
        assert [i.energy["external"] for i in free] == pytest.approx(
            [(1 - s) ** 2 * pulled.energy["external"] for s in (0.25, 0.5, 0.75, 1.0)], abs=1e-10
        )
    assert free[-1].energy["imbalance"] == pytest.approx(0.0, abs=5e-3 * pulled.energy["external"])


def test_the_reaction_of_a_support_being_released_is_at_its_nodes():
    """Nodal reactions of the freed boundary sum up to the reaction that is reported, and balance those of the base."""
    a = by_step(bar(PULL, FREE))["free"][1]
    top = np.isclose(a.bodies["b"].X[:, 1], 2.0)
    reaction = a.bodies["b"].reaction
    assert reaction[top, 1].sum() == pytest.approx(a.supports["b.top"].y, rel=1e-12)
    assert reaction[:, 1].sum() == pytest.approx(0.0, abs=1e-8 * a.supports["b.top"].y)


def test_the_result_of_an_elastic_body_does_not_depend_on_the_increments():
    """One increment ends where four and eleven do."""
    ends = [
        by_step(bar(PULL, replace(FREE, increments=n), loads={"b.right": pr.Load(traction=(5.0, 0.0))}))
        for n in (1, 4, 11)
    ]
    shapes = [e["free"][-1].bodies["b"].displacement for e in ends]
    assert np.abs(shapes[0]).max() > 1e-3
    for shape in shapes[1:]:
        assert np.abs(shape - shapes[0]).max() <= 1e-9


@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented(), pr.Exact()], ids=lambda e: e.type)
def test_a_step_lets_go_as_a_case_that_starts_from_a_run(tmp_path, enforcement):
    """A support released under a tool with friction: the second step of a run is the first of one that starts from the first."""
    hold = {"b.bottom": "xy", "b.right": "x"}
    one = replace(pressed(PRESS, enforcement=enforcement, material=PLASTIC), fixed=hold)
    go = pr.Step("go", fixed={"b.right": "free"}, increments=3)
    whole = [i for i in pr.solve(replace(one, steps=(PRESS, go))) if i.step == "go"]
    quiet = pr.Output(fields=0, pictures=False, report=False)
    pr.run(pr.Case(one, output=quiet), tmp_path / "press", quiet=True)
    second = replace(
        one, fixed={"b.bottom": "xy"}, steps=(pr.Step("go", increments=3),), start=pr.Start(str(tmp_path / "press"))
    )
    for a, b in zip(whole, pr.solve(second), strict=True):
        assert np.abs(a.state.u - b.state.u).max() <= 1e-8 * np.abs(a.state.u).max()
        assert a.force("t").y == pytest.approx(b.force("t").y, rel=1e-7)
        for key in ("elastic", "plastic"):
            assert a.energy[key] == pytest.approx(b.energy[key], rel=1e-7)
    assert abs(whole[0].supports["b.right"].x) > 0.1 * abs(whole[0].force("t").y)


@pytest.mark.parametrize("mode", MODES, ids="-".join)
@pytest.mark.parametrize("way", WAYS, ids=lambda w: f"{w[0].type}-{w[1]}")
def test_a_moved_tool_that_is_pushed_starts_from_its_force(way, mode):
    """From the force of the motion linearly to that asked for, whatever the enforcement and the rule."""
    enforcement, rule = way
    push = pr.Step("push", push={"t": pr.Push(y=-60.0)}, increments=3)
    steps = by_step(
        pressed(PRESS, push, enforcement=enforcement, rule=rule, kinematics=mode[0], contact_geometry=mode[1])
    )
    first = steps["press"][-1].force("t").y
    assert first > 100.0
    assert_linear(steps["push"], [i.force("t").y for i in steps["push"]], first, 60.0)
    assert all(i.statistics.cutbacks == 0 for i in steps["push"])


def test_all_motions_of_a_tool_are_released():
    """Along x and y and to turn; a tool that becomes free has no force; one that is moved again starts from where it is."""
    stamp = pr.Stamp(width=2.5, fillet=0.2, at=(1.4, 2.0))
    push = pr.Step("push", push={"t": pr.Push(y=-60.0, m=0.0)}, increments=2)
    steps = by_step(pressed(PRESS, push, tool=stamp))
    first = steps["press"][-1].force("t")
    assert abs(first.m) > 1.0
    assert_linear(steps["push"], [i.force("t").m for i in steps["push"]], first.m, 0.0)
    steps = by_step(
        pressed(PRESS, DRAG, pr.Step("free", push={"t": pr.Push(x=0.0)}, increments=2), replace(PRESS, name="again"))
    )
    first, there = steps["drag"][-1].force("t"), steps["free"][-1].tools["t"].place
    assert first.x < -10.0
    assert_linear(steps["free"], [i.force("t").x for i in steps["free"]], first.x, 0.0)
    assert steps["again"][-1].tools["t"].place.x == there.x != 0.1
    steps = by_step(pressed(PRESS, pr.Step("off", push={"t": pr.Push(y=0.0)}, increments=2)))
    assert_linear(steps["off"], [i.force("t").y for i in steps["off"]], steps["press"][-1].force("t").y, 0.0)


def test_a_driven_roller_that_is_freed_keeps_its_moment_at_first():
    """A roller whose turn was given lets its moment go over the step, also when it travels on."""
    roll = pr.Circle(radius=4.0, at=(1.5, 6.0))
    turn = pr.Step("turn", move={"t": pr.Motion(rz=0.02)}, increments=2)
    coast = pr.Step("coast", move={"t": pr.Motion(x=0.3)}, push={"t": pr.Push(m=0.0)}, increments=3)
    steps = by_step(pressed(PRESS, turn, coast, tool=roll))
    assert abs(steps["turn"][-1].force("t").m) > 5.0
    assert_linear(steps["coast"], [i.force("t").m for i in steps["coast"]], steps["turn"][-1].force("t").m, 0.0)


def test_a_table_of_forces_that_begins_elsewhere_is_reported(caplog):
    """The difference at its start goes linearly to 0; one that begins with what is carried says nothing and is followed."""
    push = pr.Step("push", push={"t": pr.Push(y=((1.0, -50.0), (1.5, -70.0), (2.0, -60.0)))}, increments=2)
    with caplog.at_level(logging.WARNING):
        steps = by_step(pressed(PRESS, push))
    (told,) = (r.getMessage() for r in caplog.records if "push.t.y" in r.getMessage())
    first = steps["press"][-1].force("t").y
    assert f"-50 at time 1, where {-first:.6g} acts" in told
    assert steps["push"][0].force("t").y == pytest.approx(70.0 + 0.5 * (first - 50.0), rel=1e-7)
    assert steps["push"][1].force("t").y == pytest.approx(60.0, rel=1e-7)
    caplog.clear()
    pushed = pr.Step("first", push={"t": pr.Push(y=-50.0)}, increments=1)
    steps = by_step(pressed(pushed, push))
    assert not caplog.records
    assert [i.force("t").y for i in steps["push"]] == pytest.approx([70.0, 60.0], rel=1e-7)


def test_a_load_that_changes_its_kind_goes_over_linearly():
    """A traction in a pressure's place is the same load; a pressure that follows no more ends where one that never did ends."""
    hold = {"b.left": "xy"}
    load = {"b.right": pr.Load(pressure=30.0)}
    kind = pr.Step("kind", loads={"b.right": pr.Load(traction=(-30.0, 0.0))}, increments=2)
    steps = by_step(bar(pr.Step("press", increments=1), kind, kinematics="small", loads=load, fixed=hold))
    for i in steps["kind"]:
        assert np.abs(i.bodies["b"].displacement - steps["press"][0].bodies["b"].displacement).max() <= 1e-12
    back = replace(kind, name="back", loads=load)
    *_, last = pr.solve(bar(pr.Step("press", increments=1), kind, back, kinematics="small", loads=load, fixed=hold))
    assert np.abs(last.bodies["b"].displacement - steps["press"][0].bodies["b"].displacement).max() <= 1e-12
    top = {"b.top": pr.Load(pressure=10.0)}
    dead = {"b.top": pr.Load(pressure=10.0, follower=False)}
    steps = by_step(
        bar(pr.Step("press", increments=2), pr.Step("dead", loads=dead, increments=4), loads=top, fixed=hold)
    )
    *_, never = pr.solve(bar(pr.Step("press", increments=4), loads=dead, fixed=hold))
    held = [i.supports["b.left"] for i in (steps["press"][-1], *steps["dead"])]
    assert held[0].x > 1.0
    assert_linear(steps["dead"], [f.x for f in held[1:]], held[0].x, 0.0)
    assert np.abs(steps["dead"][-1].bodies["b"].displacement - never.bodies["b"].displacement).max() <= 1e-8


@pytest.mark.parametrize("way", WAYS, ids=lambda w: f"{w[0].type}-{w[1]}")
@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_friction_that_is_lowered_fades(way, mode):
    """The drag of a sliding tool goes from μ₀N to μ₁N with the mean of both laws; what springs back is dissipated."""
    enforcement, rule = way
    drag = replace(DRAG, move={"t": pr.Motion(x=0.6)})
    oil = pr.Step("oil", friction={"b.top-t": pr.Coulomb(0.1)}, increments=3)
    p = pressed(PRESS, drag, oil, enforcement=enforcement, rule=rule, kinematics=mode[0], contact_geometry=mode[1])
    path = by_step(p)
    before = path["drag"][-1]
    assert -before.force("t").x == pytest.approx(0.3 * before.force("t").y, rel=1e-6)
    for i, mu in zip(path["oil"], (0.7 / 3, 0.5 / 3, 0.1), strict=True):
        assert -i.force("t").x == pytest.approx(mu * i.force("t").y, rel=1e-5)
        assert i.statistics.cutbacks == 0
    last = path["oil"][-1].energy
    assert last["friction"] > before.energy["friction"]
    assert last["imbalance"] == pytest.approx(before.energy["imbalance"], abs=2e-3 * last["friction"])


def test_friction_that_is_taken_away_is_gone_at_the_end():
    """Nothing is left at the end of the step, and the state is that of contact without friction."""
    path = by_step(pressed(PRESS, DRAG, pr.Step("off", friction={"b.top-t": None}, increments=2)))
    a, b = path["off"]
    assert a.force("t").x < -1.0
    assert b.force("t").x == pytest.approx(0.0, abs=1e-9)
    assert set(b.contacts["b.top-t"].status.tolist()) <= {0, 2}
    assert b.energy["imbalance"] == pytest.approx(a.energy["imbalance"], abs=1e-4 * b.energy["external"])
    *_, smooth = pr.solve(pressed(PRESS, mu=0.0))
    rough = path["drag"][-1].bodies["b"].displacement
    smooth = smooth.bodies["b"].displacement
    assert np.abs(b.bodies["b"].displacement - smooth).max() <= 1e-3 * np.abs(rough - smooth).max()


def test_friction_that_rises_rises_at_once():
    """It only resists more, so nothing jumps, and nothing is released."""
    law, none = pr.Coulomb(0.3), pr.Coulomb(0.0)
    assert fading(None, law, 1.0, 2.0) is law
    assert fading(none, law, 1.0, 2.0) is law
    assert fading(law, law, 1.0, 2.0) is law
    p, kappa = np.array([1.0, 2.0]), np.zeros(2)
    rises = fading(pr.Coulomb(0.1), law, 1.0, 2.0)
    assert rises.bound(p, kappa, At(time=1.1))[0] == pytest.approx(0.3 * p)


@pytest.mark.parametrize("now", [None, pr.Coulomb(0.1), pr.Shear(m=0.2, k=5.0)], ids=["none", "coulomb", "shear"])
def test_the_bound_of_fading_friction_has_exact_derivatives(now):
    """∂τ/∂p and ∂τ/∂κ against central differences, with laws that cross, and none where friction has gone."""
    law = Fading(pr.Coulomb({"mu0": 0.3, "mu_inf": 0.05, "u0": 0.4}), now, 1.0, 2.0)
    rng = np.random.default_rng(1)
    p, kappa, h = rng.uniform(0.5, 9.0, 40), rng.uniform(0.0, 1.0, 40), 1e-6
    for time in (1.0, 1.3, 2.0):
        at = At(time=time)
        tau, by_p, by_kappa = law.bound(p, kappa, at)
        assert (tau >= 0.0).all()
        assert np.allclose(by_p, (law.bound(p + h, kappa, at)[0] - law.bound(p - h, kappa, at)[0]) / (2 * h), atol=1e-7)
        assert np.allclose(
            by_kappa, (law.bound(p, kappa + h, at)[0] - law.bound(p, kappa - h, at)[0]) / (2 * h), atol=1e-7
        )
        assert (law.softening(p, kappa, at) >= -by_kappa - 1e-12).all()
    assert now is not None or not tau.any()


@pytest.mark.parametrize("rule", ["nodal", "gauss2"])
def test_the_tangent_of_a_releasing_step_is_exact(rule):
    """Assembled, by central differences: a tool released, friction that fades and slips, in finite strain."""
    step = pr.Step("off", push={"t": pr.Push(y=-60.0)}, friction={"b.top-t": pr.Shear(m=0.1, k=5.0)})
    problem = pressed(PRESS, DRAG, step, rule=rule, mu=0.2)
    *_, last = pr.solve(replace(problem, steps=(PRESS, DRAG)))
    system = pr.discretise(problem)
    plan = plan_step(system, 2, last.state.u)
    c = system.context(last.state, plan, 2.4)
    rng = np.random.default_rng(3)
    u, v = last.state.u + 1e-4 * rng.standard_normal(system.ndof), rng.standard_normal(system.ndof)
    e = system.evaluate(c, u, last.state.lam)
    assert any(f.slip.any() for f in e.contacts)
    K = csc_matrix((e.data, system.pattern.indices, system.pattern.indptr), (system.ndof,) * 2)
    h = 1e-7
    ahead, behind = (system.evaluate(c, u + s * h * v, last.state.lam, stiffness=False).r for s in (1, -1))
    assert np.abs((ahead - behind) / (2 * h) - K @ v).max() <= 1e-6 * np.abs(K @ v).max()


def test_a_releasing_step_is_resumed_bit_for_bit():
    """From arrays, as a checkpoint keeps them, in the middle of a step that lets a support, a tool and friction go."""
    go = pr.Step(
        "go",
        push={"t": pr.Push(y=-60.0)},
        fixed={"b.right": "free"},
        friction={"b.top-t": pr.Coulomb(0.1)},
        increments=4,
    )
    problem = replace(pressed(PRESS, go, material=PLASTIC), fixed={"b.bottom": "xy", "b.right": "x"})
    path = list(pr.solve(problem))
    assert path[3].state.release is not None and path[-1].state.release is None
    for k in (1, 2, 3):
        state = State.from_arrays(path[k].state.arrays())
        for a, b in zip(path[k + 1 :], pr.solve(problem, start=state), strict=True):
            assert np.array_equal(a.state.u, b.state.u) and a.energy == b.energy and a.supports == b.supports


def test_condensed_bodies_released_as_whole_ones():
    """Supports, loads and tools in small strain, by either way of solving."""
    load = {"b.right": pr.Load(pressure=3.0)}
    go = pr.Step("go", push={"t": pr.Push(y=-60.0)}, fixed={"b.left": "free"}, increments=3)
    problem = replace(pressed(PRESS, go, kinematics="small", loads=load), fixed={"b.bottom": "xy", "b.left": "x"})
    ways = [list(pr.solve(problem, pr.Numerics(condense=condense))) for condense in (True, False)]
    for a, b in zip(*ways, strict=True):
        assert np.abs(a.state.u - b.state.u).max() <= 1e-9 * np.abs(b.state.u).max()
        assert a.supports["b.left"].x == pytest.approx(b.supports["b.left"].x, rel=1e-6, abs=1e-9)
    assert ways[0][3].supports["b.left"].x != 0.0


def test_what_cannot_balance_is_reported_with_what_was_released():
    """Friction bears less than the support that goes: the message names the body, the way, the support and the share."""
    press = pr.Step("press", move={"t": pr.Motion(y=-0.02)}, increments=1)
    load = pr.Step("load", loads={"b.right": pr.Load(traction=(6.0, 0.0))}, increments=1)
    go = pr.Step("go", fixed={"b.left": "free"}, increments=4)
    problem = replace(pressed(press, load, go, mu=0.1), fixed={"b.bottom": "y", "b.left": "x"})
    words = r"body 'b' can move along x.*releases support 'b.left' \(-8\.\d+ along x\), of which 3\.\d"
    with pytest.raises(SolveError, match=words):
        list(pr.solve(problem))
    with pytest.raises(pr.errors.PreflightError, match="in step 'go' it is free to move along x"):
        list(pr.solve(replace(problem, friction=None)))


def test_steps_that_change_nothing_release_nothing():
    """Held, pushed and loaded on: not a bit of difference between one step and two."""
    wait = pr.Step("wait", push={"t": pr.Push(y=-60.0)}, increments=1)
    push = replace(wait, name="push")
    more = {"loads": {"b.right": pr.Load(pressure=3.0)}, "kinematics": "small"}
    path = list(pr.solve(pressed(push, wait, replace(wait, name="on"), **more)))
    assert all(i.state.release is None for i in path)
    for a, b in itertools.pairwise(path):
        assert np.abs(a.state.u - b.state.u).max() <= 1e-9


@pytest.mark.parametrize("sides", [("a.top", "b.bottom"), ("b.bottom", "a.top")], ids="-".join)
def test_supports_of_tied_nodes_are_released(sides):
    """Every support beside a tie of meshes that do not match falls linearly, slave side or master side."""
    go = pr.Step("go", fixed=dict.fromkeys(("b.top", "a.left", "b.left"), "free"), increments=3)
    pull = replace(PULL, fixed={"b.top": pr.Fixed(y=0.1), "a.left": "x", "b.left": "x"})
    problem = tied_blocks(
        pull, go, sizes=((4, 2), (4, 2)), n=((4, 2), (6, 3)), names=("a", "b"), ties=(pr.Tie(*sides),), kinematics="small"
    )
    path = [i for i in pr.solve(problem) if i.number > 1]
    for name, axis in (("b.top", "y"), ("a.left", "x"), ("b.left", "x"), ("a.bottom", "y")):
        values = [getattr(i.supports[name], axis) for i in path]
        assert abs(values[0]) > 1.0
        assert_linear(path[1:], values[1:], values[0], 0.0)
    assert np.abs(path[-1].state.u).max() <= 1e-10
