"""Steps, motions, loads and failures as a user meets them; each figure against a closed form or an equivalent problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.thresholds import IMBALANCE
from prensa.errors import PrensaError, SolveError
from prensa.solver import increment_solver
from prensa.system.failure import Unevaluable
from prensa.system.planning import plan_step
from prensa.system.state import State
from problems import pressed_block, single_block, stroke, upset_block

SIZE = (4.0, 3.0)


def pressed(step, *, tool=None, kinematics="finite", **more):
    return pressed_block(
        *(step if isinstance(step, list) else [step]), tools={"punch": tool or pr.Circle(radius=5.0, touching="block.top")},
        kinematics=kinematics, allow_large_strain=kinematics == "small", body="block", **{"n": (8, 6), "size": SIZE} | more,
    )  # fmt: skip


def last(p, numerics=None, **more):
    *_, inc = pr.solve(p, numerics, **more)
    return inc


@pytest.mark.parametrize("end", [1.0, 2.0])
def test_a_table_is_followed_also_where_it_spans_one_step(end):
    """A table of two rows gives its own values in between, whether or not its times are those of the step."""
    table = ((0.0, -0.1), (end, -0.1 - 0.1 * end))
    problem = pressed(pr.Step("move", move={"punch": {"y": table}}, increments=2), kinematics="small")
    half, full = pr.solve(problem)
    assert half.tools["punch"].place.y == pytest.approx(-0.15, rel=1e-12)
    assert full.tools["punch"].place.y == pytest.approx(-0.2, rel=1e-12)


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_pushing_and_moving_are_inverse(kinematics):
    """A tool pushed by F goes where a tool moved there feels F: to 1e-8 in small strain.

    In finite strain to 1e-4: contact weights are those of the committed configuration, and the pushed run cuts its step.
    """
    moved = last(pressed(pr.Step("move", move={"punch": {"y": -0.3}}, increments=1), kinematics=kinematics))
    F = moved.force("punch").y
    pushed = last(pressed(pr.Step("push", push={"punch": {"y": -F}}, increments=1), kinematics=kinematics))
    assert pushed.tools["punch"].place.y == pytest.approx(-0.3, rel=1e-8 if kinematics == "small" else 1e-4)
    assert pushed.force("punch").y == pytest.approx(F, rel=1e-10)


@pytest.mark.parametrize("seed", range(60))
def test_a_step_may_end_exactly_when_a_tool_touches(seed):
    """An approach by the gap, then a press: what the press alone gives, wherever round-off puts the touch."""
    rng = np.random.default_rng(seed)
    gap, depth, height, y = (float(np.round(v, 2)) for v in rng.uniform([0.05, 0.05, 1.0, -9.0], [2.0, 0.1, 9.0, 9.0]))
    tools = [
        pr.Plane(normal=(0, -1), at=(0.0, y + height + gap)),
        pr.Circle(radius=7.0, at=(2.0, y + height + gap + 7.0)),
    ]
    p = pressed_block(
        stroke(-gap, increments=(None, 1, 3)[seed % 3], name="approach"), stroke(-gap - depth, increments=2),
        tools={"t": tools[seed % 2]}, size=(4.0, height), n=(2, 2), origin=(0.0, y), kinematics="small",
    )  # fmt: skip
    *_, inc = pr.solve(p)
    *_, alone = pr.solve(replace(p, steps=p.steps[1:]))
    assert inc.time == 2.0 and inc.force("t").y == pytest.approx(alone.force("t").y, rel=1e-5)


def test_a_table_of_many_rows_keeps_its_corners():
    """A short pulse leaves the same plastic work by 401 rows and by 601, where automatic increments would pass it over."""
    material = pr.J2(1000.0, 0.3, pr.Linear(s0=5.0, H=50.0))

    def plastic(rows):
        times = np.linspace(0.0, 1.0, rows)
        pulse = np.interp(times, [0.0, 0.4, 0.45, 0.5, 1.0], [0.0, 0.0, -0.1, 0.0, 0.0])
        hit = stroke(tuple(zip(times.tolist(), pulse.tolist())), increments=10, name="hit")
        p = upset_block(hit, material=material, size=SIZE, n=(1, 1), kinematics="small")
        return last(p).energy["plastic"]

    assert plastic(601) == pytest.approx(plastic(401), rel=1e-3) and plastic(601) > 1.0


def test_a_table_of_velocities_stops_at_its_own_rows_only():
    """The samples of the integrated course are no corners, however few or many rows the table has."""
    for rows in (5, 600):
        table = tuple((float(t), -float(t)) for t in np.linspace(0.0, 1.0, rows))
        system = pr.discretise(pressed(pr.Step("move", velocity={"punch": {"y": table}}), kinematics="small"))
        plan = plan_step(system, 0, np.zeros(system.ndof))
        assert np.allclose(plan.corners(), [t for t, _ in table[1:-1]])


@pytest.mark.parametrize(("friction", "status"), [(None, 2), (pr.Coulomb(0.0), 2), (pr.Coulomb(0.3), 1)])
def test_a_contact_sticks_or_slips_by_its_law(friction, status):
    """Points that stick without any traction stick; without friction closed points slip."""
    step = pr.Step("press", move={"punch": {"y": -0.01}}, increments=1)
    held = {"block.bottom": "xy", "block.top": "x"}
    inc = last(pressed(step, tool=pr.Plane(touching="block.top"), kinematics="small", friction=friction, fixed=held))
    (contact,) = inc.contacts.values()
    assert not contact.shear.any() and (contact.status == status).all() and (contact.points.status == status).all()


def test_a_pushed_tool_comes_from_afar_and_says_so():
    """A force-driven tool that touches nothing is brought into contact, with a note, to the same place as one that touches."""
    notes = []
    far = pr.Circle(radius=5.0, at=(0.0, 9.0))
    step = pr.Step("push", push={"punch": {"y": -40.0}}, increments=2)
    a = last(pressed(step, tool=far), monitor=lambda e: notes.append(e.message) if e.event == "note" else None)
    b = last(pressed(step))
    assert any("driven by force" in m for m in notes)
    assert a.tools["punch"].place.y + 9.0 == pytest.approx(b.tools["punch"].place.y + 8.0, abs=1e-8)


def test_first_touch_splits_the_increment():
    """A tool that starts 1 above the surface makes an increment end at the touch, and the force is that without the way."""
    notes = []
    far = pr.Circle(radius=5.0, at=(0.0, 9.0))
    history = list(
        pr.solve(
            pressed(pr.Step("move", move={"punch": {"y": -1.3}}, increments=2), tool=far),
            monitor=lambda e: notes.append(e.message) if e.event == "note" else None,
        )
    )
    assert any("first touches block.top" in m for m in notes)
    assert any(abs(i.tools["punch"].place.y + 1.0) < 1e-6 for i in history)
    direct = last(pressed(pr.Step("move", move={"punch": {"y": -0.3}}, increments=1)))
    # two increments instead of one: tributary areas of another committed configuration
    assert history[-1].force("punch").y == pytest.approx(direct.force("punch").y, rel=2e-4)


@pytest.mark.parametrize("moved", ["tool", "block"])
@pytest.mark.parametrize(("gap", "down"), [(0.5, 1.0), (2.0, 0.2)])
def test_the_energy_balance_sees_a_flat_side_land(moved, gap, down):
    """The force of metal under a plane rises to yield at once: its work is seen to 1e-3, and the answer is that without the gap.

    9 % of the work of a short press after a long way were missed.
    """
    step = pr.Step("press", move={"punch": pr.Motion(y=-gap - down)})
    problem = pressed(
        step, tool=pr.Plane(at=(0.0, 3.0 + gap)), material=pr.J2(70e3, 0.3, pr.Voce(100.0, 100.0, 8.0)), friction=pr.Coulomb(0.1),
        fixed={"block.bottom": "y", "block.left": "x"},
    )  # fmt: skip
    contacts = (replace(problem.contacts[0], surface=("block.top", "block.right")),)
    problem = replace(problem, contacts=contacts)
    alone = pr.Step("press", move={"punch": pr.Motion(y=-down)})
    direct = last(replace(problem, tools={"punch": pr.Plane(at=(0.0, 3.0))}, steps=(alone,)))
    if moved == "block":
        fixed = {"block.bottom": pr.Fixed(y=gap + down), "block.left": "x"}
        problem = replace(problem, fixed=fixed, steps=(pr.Step("press", move={"punch": pr.Motion()}),))
    inc = last(problem)
    assert abs(inc.energy["imbalance"]) <= 1e-3 * inc.energy["external"]
    assert inc.force("punch").y == pytest.approx(direct.force("punch").y, rel=2e-4)


def test_velocity_is_the_derivative_of_displacement():
    """A velocity table integrates to the displacement it means: triangle of height 0.6 over one unit of time is 0.3."""
    inc = last(pressed(pr.Step("go", velocity={"punch": {"y": [[0.0, 0.0], [0.5, -0.6], [1.0, 0.0]]}}, increments=4)))
    assert inc.tools["punch"].place.y == pytest.approx(-0.3, rel=1e-5)
    inc = last(pressed(pr.Step("go", velocity={"punch": {"y": -0.3}}, increments=4)))
    assert inc.tools["punch"].place.y == pytest.approx(-0.3, rel=1e-12)


def test_increments_end_at_the_corners_of_tables():
    """Whatever the step size, an increment ends where a table changes slope."""
    step = pr.Step("go", move={"punch": {"y": [[0.0, 0.0], [0.37, -0.2], [1.0, -0.1]]}}, increments=3)
    history = list(pr.solve(pressed(step)))
    assert any(abs(i.time - 0.37) < 1e-12 for i in history)
    assert history[-1].tools["punch"].place.y == pytest.approx(-0.1)


@pytest.mark.parametrize("element", ["q4", "q4_fbar", "q4_bbar", "q4_enhanced", "q4_sheet", "t3", "t6", "q8", "q8_full"])
def test_unloading_an_elastic_body_leaves_nothing(element):
    """Press and release without friction, without a cut-back: no force, no energy left, to 1e-9 of the largest."""
    steps = [
        pr.Step("press", move={"punch": {"y": -0.3}}, increments=3),
        pr.Step("release", move={"punch": {"y": 0.1}}, increments=3),
    ]
    history = list(pr.solve(pressed(steps, n=(6, 4), element=element)))
    assert sum(i.statistics.cutbacks for i in history) == 0
    peak = max(i.energy["elastic"] for i in history)
    assert history[-1].energy["elastic"] <= 1e-9 * peak
    assert history[-1].force("punch").y == 0.0
    assert np.abs(history[-1].bodies["block"].displacement).max() <= 1e-9


def test_column_under_its_own_weight():
    """Body force ρb: a laterally held column shortens by ρb L²/(2M), M the oedometric modulus, exactly for linear elements."""
    p = single_block(
        pr.Step("load", increments=1), n=(1, 8), size=(1.0, 4.0), body="c", body_force={"c": (0.0, -2.0)},
        fixed={"c.bottom": "y", "c.left": "x", "c.right": "x"}, kinematics="small",
    )  # fmt: skip
    u = last(p).bodies["c"].displacement[-1, 1]
    modulus = 1000.0 * 0.7 / (1.3 * 0.4)
    assert u == pytest.approx(-2.0 * 16.0 / (2 * modulus), rel=1e-10)


def lame(r, p, a=10.0, b=20.0, E=1000.0, nu=0.3):
    """Radial displacement of a thick tube in plane strain under internal pressure."""
    c = (1 + nu) * p * a * a / (E * (b * b - a * a))
    return c * ((1 - 2 * nu) * r + b * b / r)


@pytest.mark.parametrize("follower", [True, False])
def test_pressure_on_a_tube(follower):
    """Small pressure on the bore gives Lamé's displacement within 0.1 %, as a follower and as a dead load."""
    p = single_block(
        pr.Step("load", increments=1), n=(20, 1), size=(10.0, 1.0), origin=(10.0, 0.0), body="t", space="axisymmetric",
        fixed={"t.bottom": "y", "t.top": "y"}, loads={"t.left": pr.Load(pressure=0.01, follower=follower)},
    )  # fmt: skip
    b = last(p).bodies["t"]
    assert b.displacement[0, 0] == pytest.approx(lame(10.0, 0.01), rel=1e-3)


@pytest.mark.parametrize(
    ("said", "follows"),
    [
        ((None, None), True),
        ((False, None), False),
        ((False, True), True),
        ((True, False), False),
        ((None, False), False),
    ],
)
def test_a_later_load_keeps_what_an_earlier_one_said_of_following(said, follows):
    """A load that does not say `follower` keeps what its boundary's loads before said; none said it: it follows."""
    loads = [{"block.right": pr.Load(pressure=2.0, follower=f)} for f in said]
    steps = [pr.Step("first", loads=loads[0]), pr.Step("second", loads=loads[1])]
    system = pr.discretise(pressed(steps))
    assert plan_step(system, 1, np.zeros(system.ndof)).loads["block.right"].follower is follows


def test_follower_pressure_does_no_net_force_on_a_closed_surface():
    """Equal pressure all round compresses a free-floating block without reactions, even when it has turned."""
    p = single_block(
        pr.Step("turn and press", increments=4), size=SIZE, n=(8, 6),
        fixed={"b.bottom-left": "xy", "b.bottom-right": {"y": 0.8}},
        loads={f"b.{s}": pr.Load(pressure=50.0) for s in ("bottom", "right", "top", "left")},
    )  # fmt: skip
    b = last(p).bodies["b"]
    assert np.abs(b.reaction).max() <= 1e-8 * 50.0 * 4.0
    assert np.allclose(b.stress[:, :2], -50.0, rtol=1e-6)


def test_dead_traction_and_its_reaction():
    """A dead traction t on an edge of length L is answered by a support reaction −tL."""
    p = single_block(
        pr.Step("pull", increments=2), size=SIZE, n=(8, 6), fixed={"b.left": "xy"},
        loads={"b.right": pr.Load(traction=(3.0, 1.0))},
    )  # fmt: skip
    assert np.allclose(last(p).bodies["b"].reaction.sum(0), [-9.0, -3.0], rtol=1e-8)


def test_loads_are_held_and_supports_can_be_freed():
    """What a later step does not mention stays; a freed support has no reaction and the body springs back."""
    p = single_block(
        pr.Step("pull", fixed={"b.top": {"y": 0.1}}, increments=1), pr.Step("wait", increments=1),
        pr.Step("free", fixed={"b.top": "free"}, increments=1),
        size=SIZE, n=(8, 6), fixed={"b.bottom": "xy"}, kinematics="small",
    )  # fmt: skip
    a, b, c = pr.solve(p)
    assert np.allclose(a.bodies["b"].reaction, b.bodies["b"].reaction)
    assert np.abs(c.bodies["b"].reaction).max() <= 1e-9 * np.abs(a.bodies["b"].reaction).max()
    assert np.abs(c.bodies["b"].displacement).max() <= 1e-9


def test_thickness_scales_the_force():
    """A plane body of thickness 3 gives three times the force."""
    step = pr.Step("move", move={"punch": {"y": -0.3}}, increments=2)
    thin, thick = last(pressed(step)), last(pressed(step, thickness=3.0))
    assert thick.force("punch").y == pytest.approx(3 * thin.force("punch").y, rel=1e-9)


def test_a_dragged_block_reaches_coulomb():
    """Pressed and dragged, the tangential force of the tool settles at μ times the normal one."""
    steps = [
        pr.Step("press", move={"punch": {"y": -0.05}}, increments=1),
        pr.Step("drag", move={"punch": {"x": 1.5}}, increments=6),
    ]
    inc = last(pressed(steps, tool=pr.Plane(touching="block.top"), friction=pr.Coulomb(0.2)))
    f = inc.force("punch")
    assert abs(f.x) == pytest.approx(0.2 * f.y, rel=1e-9)
    assert f.x < 0  # friction of the block on the tool opposes the tool's motion
    assert inc.energy["friction"] > 0


def test_every_solver_gives_the_same_answer():
    """The rslab and SuperLU answers agree to 1e-9 on an unsymmetric problem."""
    p = pressed(pr.Step("go", move={"punch": {"x": 0.1, "y": -0.3}}, increments=3), friction=pr.Coulomb(0.3))
    a, b = (last(p, pr.Numerics(solver=s)).force("punch") for s in ("rslab", "superlu"))
    assert np.allclose(a, b, rtol=1e-9)


@pytest.mark.parametrize("at", [1, 3, 5])
def test_continuing_from_a_saved_state_changes_nothing(at):
    """A run continued from the state of any increment, through its flat arrays, equals the whole run bit for bit."""
    steps = [
        pr.Step("press", move={"punch": {"y": -0.3}}, increments=3),
        pr.Step("drag", move={"punch": {"x": 0.4}}, increments=3),
    ]
    p = pressed(steps, friction=pr.Coulomb(0.3), material=pr.J2(1000.0, 0.3, pr.Linear(20.0, 50.0)))
    whole = list(pr.solve(p))
    saved = State.from_arrays({k: v.copy() for k, v in whole[at - 1].state.arrays().items()})
    rest = list(pr.solve(p, start=saved))
    assert [i.number for i in rest] == [i.number for i in whole[at:]]
    for a, b in zip(rest, whole[at:], strict=True):
        assert all(np.array_equal(x, b.state.arrays()[k]) for k, x in a.state.arrays().items())


def test_a_rejected_increment_leaves_no_trace():
    """An increment that is cut gives the same bits as asking for a quarter, and goes on as if it had been that."""
    p = pressed(pr.Step("go", move={"punch": {"y": -0.3}}, increments=1), friction=pr.Coulomb(0.3))
    four = pressed(pr.Step("go", move={"punch": {"y": -0.3}}, increments=4), friction=pr.Coulomb(0.3))
    quarter = next(iter(pr.solve(four)))
    real, calls = increment_solver.attempt, []

    def fails_once(*args):
        trial = real(*args)
        calls.append(1)
        if len(calls) == 1:
            trial.converged, trial.reason = False, Unevaluable("asked to fail")
        return trial

    increment_solver.attempt = fails_once
    try:
        cut = list(pr.solve(p))
    finally:
        increment_solver.attempt = real
    assert cut[0].statistics.cutbacks == 1
    assert np.array_equal(cut[0].state.u, quarter.state.u)
    rest = list(pr.solve(p, start=cut[0].state))
    assert [i.time for i in rest] == [i.time for i in cut[1:]]
    assert all(np.array_equal(a.state.u, b.state.u) for a, b in zip(rest, cut[1:], strict=True))


# ------------------------------------------------------------------------------------------------------------ failures
def test_a_free_body_is_named():
    """A body that nothing holds fails with words, not with numbers."""
    p = single_block(
        pr.Step("go", increments=1), size=SIZE, n=(8, 6), fixed={"b.bottom": "y"},
        loads={"b.right": pr.Load(traction=(1.0, 0.0))},
    )  # fmt: skip
    with pytest.raises(PrensaError, match=r"bodies\.b: it is free to move along x: no support"):
        last(p, pr.Numerics(max_cutbacks=0))


def test_a_tool_pushed_the_wrong_way_is_named():
    """A force that drives the tool away from everything is an error that says so."""
    with pytest.raises(PrensaError, match="touches nothing"):
        last(pressed(pr.Step("go", push={"punch": {"y": 5.0}}, increments=1)))


def test_a_tool_that_cannot_touch_is_named():
    """A stamp beside the boundary it should touch is refused when the problem is discretised."""
    p = pressed(
        pr.Step("go", move={"punch": {"y": -1.0}}), tool=pr.Stamp(width=1.0, at=(50.0, 0.0), touching="block.top")
    )
    with pytest.raises(PrensaError, match="never meets"):
        pr.discretise(p)


def test_a_sharp_edge_over_a_node_is_refused_on_the_moved_surface():
    """The error names the node and a fillet; with the fillet, or the edge elsewhere, the problem is solved."""
    step = pr.Step("go", move={"punch": {"y": -0.05}}, increments=1)
    with pytest.raises(PrensaError, match=r"sharp edge lies over the node at \(1, 3\).*fillet"):
        pr.discretise(pressed(step, tool=pr.Stamp(width=2.0, touching="block.top")))
    assert last(pressed(step, tool=pr.Stamp(width=2.0, fillet=0.25, touching="block.top"))).force("punch").y > 0


def test_an_impossible_motion_fails_with_a_diagnosis_and_keeps_the_last_increment():
    """Crushing a block to a hundredth of its height ends in an error that says where, and the good part survives."""
    p = pressed(pr.Step("crush", move={"punch": {"y": -2.97}}, increments=4), tool=pr.Plane(touching="block.top"))
    good = []
    with pytest.raises(SolveError, match=r"step 'crush', time .*What to try") as caught:
        good.extend(pr.solve(p, pr.Numerics(max_cutbacks=2)))
    assert caught.value.last is not None
    assert caught.value.last.time < 1.0


def test_supports_carry_what_the_tools_press():
    """The forces of all supports and tools balance to 1e-9, and a support that another step releases carries nothing."""
    hold, let = pr.Step("hold", move={"punch": {"y": -0.2}}), pr.Step("let", fixed={"block.left": "free"})
    problem = pressed([hold, let], fixed={"block.bottom": "y", "block.left": "x", "block.bottom-right": "x"})
    *_, inc = pr.solve(problem)
    F, held = inc.force("punch"), inc.supports
    assert list(held) == ["block.bottom", "block.left", "block.bottom-right"]
    assert sum(r.y for r in held.values()) == pytest.approx(F.y, rel=1e-9)
    assert sum(r.x for r in held.values()) == pytest.approx(F.x, abs=1e-9 * F.y)
    assert held["block.left"] == (0.0, 0.0)
    assert held["block.bottom"].x == 0.0


def test_increments_do_not_shrink_until_time_stands_still(monkeypatch):
    """Where nothing goes on, whatever the increment, the run ends with what it has, and says so, while time still moves."""
    attempt = increment_solver.attempt

    def stuck(eq, *args):
        trial = attempt(eq, *args)
        failed = replace(trial, converged=False, reason=Unevaluable("no way past this"))
        return trial if eq.context.time < 0.5 else failed

    monkeypatch.setattr(increment_solver, "attempt", stuck)
    done = []
    with pytest.raises(SolveError, match=r"no way past this.*too short for another cut.*last good state"):
        done.extend(pr.solve(pressed(pr.Step("press", move={"punch": {"y": -0.1}}), kinematics="small")))
    # `extend` keeps what came before the error
    times = np.array([i.time for i in done])
    assert (np.diff(times) > 0).all() and 0.5 - 1e-9 < times[-1] < 0.5 and len(times) < 100


@pytest.mark.parametrize("increments", [None, 600])
def test_automatic_increments_balance_where_a_tool_passes_from_node_to_node(increments):
    """A circle, free to roll, is drawn over a coarse block: its drag turns round as the next node takes over its force.

    The balance of automatic increments is off by less than a run warns of (75 % of the largest energy without their control), and
    the force is that of short ones.
    """
    push = pr.Push(y=-10.0)
    roll = pr.Step("roll", push={"punch": replace(push, m=0.0)}, move={"punch": pr.Motion(x=1.5)}, increments=increments)
    p = pressed(
        [pr.Step("push", push={"punch": push}), roll], tool=pr.Circle(radius=4.0, at=(0.0, 7.0)), n=(4, 2),
        material=pr.Elastic(1000.0, 0.3), friction=pr.Coulomb(0.3), fixed={"block.bottom": "xy"}, origin=(-4.0, 0.0),
        size=(8.0, 3.0),
    )  # fmt: skip
    run = list(pr.solve(p))
    largest = max(abs(inc.energy[key]) for inc in run for key in ("external", "elastic", "friction"))
    assert max(abs(inc.energy["imbalance"]) for inc in run) < IMBALANCE * largest
    assert run[-1].force("punch").x == pytest.approx(-1.27034315, rel=1e-6)
    assert increments or len(run) < 45
