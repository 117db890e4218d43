"""End conditions of a step: a force, a travel, a contact; exactly there, and the next step goes on from that state."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.errors import SolveError
from prensa.friction.law import At
from prensa.measures import MeasureError, parse, refuse_targets
from prensa.model.schema import CaseError, dump, loads
from prensa.output.checkpoint import read_checkpoint
from prensa.output.run import resume, run
from prensa.result.increment import Increment
from prensa.system.failure import NotReached
from prensa.system.planning import plan_step
from prensa.verify.balance import imbalance
from problems import pressed_block, upset_block
from stopped import stopped_after

ELASTIC = pr.Elastic(1000.0, 0.3)
PLASTIC = pr.J2(1000.0, 0.3, pr.Linear(20.0, 50.0))
TOLERANCE = 1e-8


def block(*steps: pr.Step, gap=0.0, tool=None, **more) -> pr.Problem:
    """A block of 4 × 2 on a smooth base, free at its sides, below a plane."""
    tool = tool or (pr.Plane(normal=(0.0, -1.0), at=(0.0, 2.0 + gap)) if gap else pr.Plane(touching="b.top"))
    given = {"enforcement": pr.Exact(), "fixed": {"b.bottom": "y", "b.bottom-left": "x"}} | more
    return pressed_block(*steps, tools={"t": tool}, n=(4, 2), **given)


def force(y: float, **more) -> pr.Until:
    return pr.Until(force={"t": pr.ToolForce(y=y)}, **more)


def ends(problem: pr.Problem, **options) -> list[Increment]:
    """The increments in which steps end."""
    return [i for i in pr.solve(problem, **options) if i.end_of_step]


def down(y: float, until: pr.Until | None = None, name: str = "press", **more) -> pr.Step:
    return pr.Step(name, by={"t": pr.Motion(y=y)}, until=until, **more)


# ------------------------------------------------------------------------------------------------------------ exactly there
@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented(), pr.Exact()], ids=lambda e: e.type)
@pytest.mark.parametrize("increments", [None, 3])
def test_a_force_is_met_to_the_tolerance(enforcement, increments):
    """Of a body that yields on the way, whatever the increments and the enforcement of contact; force and base agree."""
    problem = block(down(-0.2, force(90.0), increments=increments), material=PLASTIC, enforcement=enforcement)
    (end,) = ends(problem)
    assert end.force("t").y == pytest.approx(90.0, rel=TOLERANCE)
    assert 0 < end.time < 1
    assert "force y of tool 't'" in end.stopped
    assert end.tools["t"].place.y == pytest.approx(-0.2 * end.time, rel=1e-12)
    assert max(imbalance(pr.discretise(problem), end)) <= 1e-8


@pytest.mark.parametrize("condense", [False, True])
def test_the_time_is_that_of_hookes_law(condense):
    """Plane stress, small strain: F = E w t δ / h, so that the step ends at the share F h / (E w) of its travel."""
    for target in (1.0, 37.0):
        problem = block(
            down(-0.05, force(target)), space="plane stress", kinematics="small", contact_geometry="reference"
        )
        (end,) = ends(problem, numerics=pr.Numerics(condense=condense))
        assert end.time == pytest.approx(target * 2 / (1000 * 4) / 0.05, rel=2 * TOLERANCE)
        assert end.bodies["b"].displacement[:, 1].min() == pytest.approx(-target * 2 / (1000 * 4), rel=2 * TOLERANCE)


def test_travels_end_steps_of_driven_and_of_pushed_tools():
    """A tool under force stops where it is asked to, one on a spring too; a turn is a travel like any other."""
    until = pr.Until(travel={"t": pr.ToolTravel(y=-0.01)})
    for step in (down(-0.05, until), pr.Step("press", push={"t": pr.Push(y=-90.0)}, until=until)):
        for tool in (None, pr.Plane(touching="b.top", spring=pr.Springs(y=1e4)) if step.by else None):
            (end,) = ends(block(step, tool=tool))
            assert end.tools["t"].place.y == pytest.approx(-0.01, rel=TOLERANCE)
    turn = pr.Step("turn", move={"t": pr.Motion(rz=0.02)}, until=pr.Until(travel={"t": pr.ToolTravel(rz=0.005)}))
    (end,) = ends(block(turn, tool=pr.Circle(5.0, at=(2.0, 8.0))))
    assert end.tools["t"].place.rz == pytest.approx(0.005, rel=TOLERANCE)


@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Exact()], ids=lambda e: e.type)
def test_contacts_that_are_made_and_lost_end_steps(enforcement):
    """A tool 0.3 above a body touches after 0.3 of travel, and leaves an elastic one where it touched it."""
    touches, leaves = (pr.Until(contact={name: w}) for name, w in (("t", "touches"), ("b.top-t", "leaves")))
    problem = block(
        down(-1.0, touches, "near"), down(-0.1, None, "press"), down(1.0, leaves, "away"),
        gap=0.3, enforcement=enforcement, space="plane stress",
    )  # fmt: skip
    near, _, away = ends(problem)
    h = 1.0  # depth of an element
    assert near.time == pytest.approx(0.3, abs=10 * TOLERANCE)
    assert near.tools["t"].place.y == pytest.approx(-0.3, abs=2 * TOLERANCE * h)
    assert near.force("t").y == 0.0
    assert away.force("t").y == 0.0
    assert away.tools["t"].place.y == pytest.approx(-0.3, abs=20 * TOLERANCE * h)
    assert away.contacts["b.top-t"].gap.min() > 0
    assert np.abs(away.bodies["b"].displacement).max() <= 1e-9


def test_a_force_that_vanishes_is_met_where_it_does():
    """Unloading to zero ends at the last touch, not somewhere after it."""
    press, lift = ends(block(down(-0.02), down(0.1, force(0.0), "lift"), space="plane stress"))
    assert press.force("t").y > 0
    assert lift.tools["t"].place.y == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("increments", [1, 2, None])
def test_what_stays_at_its_target_is_met_where_it_comes_there(increments):
    """A force that stays zero from the last touch on: the tool stops on the body, whatever the increments."""
    lift = pr.Step("lift", by={"t": pr.Motion(y=0.4)}, until=force(0.0), increments=increments)
    _, end = ends(block(down(-0.2), lift, material=PLASTIC, space="plane stress"))
    assert end.bodies["b"].displacement[:, 1].min() == pytest.approx(end.tools["t"].place.y, rel=1e-9)
    assert -0.16 < end.tools["t"].place.y < -0.15 and "jumps" not in end.stopped


def test_a_jump_is_met_just_behind_it_and_reported():
    """The area of a contact jumps as outer nodes touch: no increment has what lies between; the words say from what to what."""
    tool, area = pr.Circle(20.0, at=(2.0, 22.05)), "b.top-t.area"
    step = pr.Step("press", move={"t": pr.Motion(y=-0.5)}, increments=2, until=pr.Until(measure={area: 3.5}))
    (end,) = ends(block(step, tool=tool))
    path = pr.solve(block(replace(step, until=None, increments=None), tool=tool), times=[end.time - 1e-9, end.time, 1.0])
    before, after = next(path), next(path)
    assert before.measure(area) < 3.5 < after.measure(area) == pytest.approx(end.measure(area), rel=1e-9)
    assert f"; it jumps there from {before.measure(area):.4g}" in end.stopped
    assert end.stopped.endswith(f" to {end.measure(area):.6g}")


def test_of_several_the_first_counts():
    """A travel comes before a force or after it; either ends the step."""
    both = pr.Until(force={"t": pr.ToolForce(y=20.0)}, travel={"t": pr.ToolTravel(y=-0.004)})
    (early,) = ends(block(down(-0.1, both, increments=1)))
    assert early.tools["t"].place.y == pytest.approx(-0.004, rel=TOLERANCE)
    assert early.force("t").y < 20
    late = replace(both, travel={"t": pr.ToolTravel(y=-0.09)})
    (end,) = ends(block(down(-0.1, late, increments=1)))
    assert end.force("t").y == pytest.approx(20.0, rel=TOLERANCE)


def test_the_rest_of_an_increment_that_fails_is_found_by_shorter_ones():
    """Increments that fail inside the search are cut like all others."""
    problem = block(down(-0.9, force(150.0)), material=PLASTIC, enforcement=pr.Penalty())
    (end,) = ends(problem, numerics=pr.Numerics(max_iterations=5))
    assert end.force("t").y == pytest.approx(150.0, rel=TOLERANCE)


# ------------------------------------------------------------------------------------------------------- what follows
def test_the_next_step_starts_from_what_is_carried():
    """Motions, pushes and loads go on from where they are; times of steps stay k − 1 … k."""
    load = {"b.right": pr.Load(pressure=8.0)}
    problem = block(
        down(-0.05, force(40.0), increments=4, loads=load),
        pr.Step("hold", push={"t": pr.Push(y=-60.0)}, increments=2),
        pr.Step("back", move={"t": pr.Motion(y=0.0)}, loads={"b.right": pr.Load(pressure=0.0)}, increments=2),
    )  # fmt: skip
    path = list(pr.solve(problem))
    press = [i for i in path if i.step == "press"][-1]
    hold = [i for i in path if i.step == "hold"]
    assert press.time < 1.0
    assert [i.time for i in hold] == [1.5, 2.0]
    assert [i.force("t").y for i in hold] == pytest.approx([50.0, 60.0], rel=1e-8)
    system = pr.discretise(problem)
    for i in path[:-1]:  # without a force in the end
        assert max(imbalance(system, i)) <= 1e-8
    # the pressure stays what it had become, and goes to zero from there
    plan = plan_step(system, 1, press.state.step_start, press.state.ends)
    assert [plan.loads["b.right"].pressure(t) for t in (1.0, 2.0)] == pytest.approx([8.0 * press.time] * 2)
    plan = plan_step(system, 2, press.state.step_start, np.append(press.state.ends, 2.0))
    assert plan.loads["b.right"].pressure(2.5) == pytest.approx(4.0 * press.time)
    assert path[-1].tools["t"].place.y == 0.0
    assert path[-1].energy["external"] == pytest.approx(0.0, abs=2e-2 * max(i.energy["external"] for i in path))


def test_what_a_step_was_letting_go_is_released_on():
    """A support's reaction that has fallen by half when its step ends falls on from there in the next."""
    stretch = pr.Step("stretch", fixed={"b.right": pr.Fixed(x=0.01)})
    fixed = {"b.bottom": "y", "b.left": "x"}
    free = pr.Step("free", fixed={"b.right": "free"}, by={"t": pr.Motion(x=1.0)}, increments=4,
                   until=pr.Until(travel={"t": pr.ToolTravel(x=0.6)}))  # fmt: skip
    wait = pr.Step("wait", increments=2)
    problem = replace(block(stretch, free, wait, gap=1.0), fixed=fixed)
    path = list(pr.solve(problem))
    F = [i for i in path if i.step == "stretch"][-1].supports["b.right"].x
    freed = [i for i in path if i.step == "free"]
    assert freed[-1].time == pytest.approx(1.6, abs=1e-7)
    assert freed[-1].supports["b.right"].x == pytest.approx(0.4 * F, rel=1e-6)
    left = [i.supports["b.left"].x for i in path if i.step == "wait"]
    assert left == pytest.approx([-0.2 * F, 0.0], abs=1e-6 * abs(F))


def test_friction_that_a_step_was_lowering_goes_on_from_its_share():
    """A law that has faded to 0.7 of the way is what the next step fades from."""
    contacts = [pr.Contact("b.top", "t", friction=pr.Coulomb(0.4))]
    steps = [
        pr.Step("a"),
        pr.Step("b", friction={"b.top-t": None}),
        pr.Step("c", friction={"b.top-t": pr.Coulomb(0.1)}),
    ]
    system = pr.discretise(replace(block(*steps), contacts=contacts))
    p, at = np.ones(1), At(None, 0.1, 0.0, np.zeros(1))
    for end, bounds in ((2.0, {2.0: 0.1, 2.5: 0.1}), (1.25, {2.0: 0.3, 2.5: 0.2, 3.0: 0.1})):
        (law,) = plan_step(system, 2, np.zeros(system.ndof), np.array([1.0, end])).friction
        for t, bound in bounds.items():
            assert law.bound(p, np.zeros(1), at._replace(time=t))[0] == pytest.approx(bound)


def test_a_mount_stays_where_its_step_ended():
    """The spring of a tool goes on from the mount's place at the early end."""
    tool = pr.Plane(touching="b.top", spring=pr.Springs(y=1e4))
    problem = block(down(-0.1, force(30.0)), pr.Step("wait"), down(-0.01, None, "on"), tool=tool)
    a, b, c = ends(problem)
    assert b.force("t").y == pytest.approx(30.0, rel=1e-7)
    for i, mount in ((a, -0.1 * a.time), (b, -0.1 * a.time), (c, -0.1 * a.time - 0.01)):
        assert i.force("t").y == pytest.approx(1e4 * (i.tools["t"].place.y - mount), rel=1e-8)


def test_a_run_goes_on_bit_for_bit_from_any_increment(tmp_path):
    """Tables and checkpoint of a run stopped after any of its increments and resumed are those of one that went through."""
    steps = [
        down(-0.1, force(60.0), "one", increments=6), down(1.0, pr.Until(contact={"t": "leaves"}), "two"),
        down(-0.1, force(50.0), "three", increments=5),
    ]  # fmt: skip
    case = pr.Case(block(*steps, material=PLASTIC, enforcement=pr.Penalty()), output=pr.Output(1, False, False))
    whole = run(case, tmp_path / "whole", quiet=True)
    table = whole.history
    assert whole.summary["ended_early"] == {s: table["time"][table["step"] == s][-1] for s in ("one", "two", "three")}
    _, end = read_checkpoint(tmp_path / "whole" / "checkpoint.h5")
    for stop in range(1, len(table["time"])):
        part = tmp_path / f"part{stop}"
        stopped_after(case, part, stop)
        resume(part, quiet=True)
        assert (part / "history.csv").read_text() == (tmp_path / "whole" / "history.csv").read_text()
        _, state = read_checkpoint(part / "checkpoint.h5")
        for name, array in end.arrays().items():
            np.testing.assert_array_equal(array, state.arrays()[name])


# ------------------------------------------------------------------------------------------------------- not met, refused
def test_what_is_not_met_is_reported_or_refused(caplog):
    """The warning names the step, the criterion and what was reached; with ``required`` the run fails for it."""
    with caplog.at_level(logging.WARNING, "prensa"):
        (end,) = ends(block(down(-0.01, force(1e4))))
    assert end.time == 1.0
    assert not end.stopped
    assert any("until.force.t.y" in m and "not met" in m and "'press'" in m for m in caplog.messages)
    with pytest.raises(SolveError, match=r"until.force.t.y .* was not met") as error:
        ends(block(down(-0.01, force(1e4, required=True))))
    assert isinstance(error.value.reason, NotReached)


def test_what_is_met_from_the_beginning_is_refused():
    """A step that would end as it begins."""
    with pytest.raises(SolveError, match=r"until.contact.t is met when the step begins \(it touches\)"):
        ends(block(down(-0.01, pr.Until(contact={"t": "touches"}))))
    with pytest.raises(SolveError, match=r"until\.force\.t\.y is met when the step begins"):
        ends(block(down(-0.01, force(0.0))))


CASE = """\
name: pressed
bodies: {b: {mesh: {type: rectangle, size: [4, 2], n: [4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {t: {type: plane, touching: b.top}, u: {type: plane, normal: [0, 1], at: [0, -5]}}
contacts: [{surface: b.top, against: t}]
fixed: {b.bottom: y, b.left: x}
steps:
  - {name: one, move: {t: {y: -0.02}}, until: {force: {t: {y: 1 kN}}}}
  - {name: two, by: {t: {y: -0.01}}}
"""


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("force: {t: {y: 1 kN}}", "force: {q: {y: 1 kN}}", "7:56: unknown tool 'q'"),
        ("force: {t: {y: 1 kN}}", "force: {t: {y: 1 mm}}", "is not a force"),
        ("force: {t: {y: 1 kN}}", "force: {t: {}}, travel: {t: {y: 1}}", "force of tool 't' has no component"),
        ("force: {t: {y: 1 kN}}", "required: true", "nothing to wait for"),
        ("force: {t: {y: 1 kN}}", "contact: {t: opens}", "write 'touches' or 'leaves'"),
        ("force: {t: {y: 1 kN}}", "contact: {b: leaves}", "unknown tool or contact 'b'"),
        ("force: {t: {y: 1 kN}}", "contact: {u: leaves}", "tool 'u' has no contact"),
        ("force: {t: {y: 1 kN}}", "speed: {t: 3}", "unknown key 'speed'"),
        ("by: {t: {y: -0.01}}", "move: {t: {y: [[1, -0.02], [2, -0.03]]}}", "wherever step 'one' ended"),
        ("move: {t: {y: -0.02}}", "move: {t: {y: [[0, 0], [2, -0.02]]}}", "the table continues after time 1"),
        ("fixed: {b.bottom: y,", "loads: {b.right: {pressure: [[0, 0], [2, 3]]}}\nfixed: {b.bottom: y,", "continues after"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_at_its_place(old, new, words):
    """Names, units and tables that an early end would leave without a meaning."""
    with pytest.raises(CaseError, match=words):
        loads(CASE.replace(old, new, 1))


def test_axisymmetric_tools_have_no_other_component():
    """Along y alone."""
    text = CASE.replace("b.left: x", "b.left: y").replace("name: pressed", "name: pressed\nspace: axisymmetric")
    with pytest.raises(CaseError, match="moves along y only"):
        loads(text.replace("force: {t: {y: 1 kN}}", "travel: {t: {x: 1}}"))


def test_a_table_after_a_number_says_where_the_tool_is():
    """A travel from the initial place in between makes the place known again."""
    between = "{name: mid, move: {t: {y: -0.02}}}\n  - {name: two, move: {t: {y: [[2, -0.02], [3, -0.03]]}}}"
    assert loads(CASE.replace("{name: two, by: {t: {y: -0.01}}}", between)).problem.steps[2].move["t"].y[0] == (
        2,
        -0.02,
    )


def test_the_file_and_python_say_the_same():
    """A problem with criteria is written and read back."""
    problem = loads(CASE).problem
    assert problem.steps[0].until == pr.Until(force={"t": pr.ToolForce(y=1000.0)})
    until = pr.Until(travel={"t": pr.ToolTravel(y=-1.0, x=2.0)}, contact={"b.top-t": "leaves"}, required=True)
    problem = replace(problem, steps=(replace(problem.steps[0], until=until), problem.steps[1]))
    assert loads(dump(problem)).problem == problem


def test_the_check_predicts_travels_beyond_reach():
    """And says nothing that an early end would make untrue."""
    short = block(down(-0.02, pr.Until(travel={"t": pr.ToolTravel(y=-0.05)})))
    (notice,) = preflight(pr.discretise(short))
    assert "never reaches y = -0.05" in str(notice)
    assert not preflight(pr.discretise(block(down(-0.02, pr.Until(travel={"t": pr.ToolTravel(y=-0.01)})))))
    far = block(down(-1000.0, force(10.0)), pr.Step("wait"))  # far through the body, if it were not to end
    assert not preflight(pr.discretise(far))
    assert any(n.fatal for n in preflight(pr.discretise(block(down(-1000.0)))))


# ------------------------------------------------------------------------------------------------------------- measures
def test_any_number_of_an_increment_ends_a_step():
    """A height, a column of the history, a pressure, a named measure: each exactly; a contact that is open has none yet."""
    for name, target, number in (
        ("b.height", "1.9 mm", 1.9), ("energy.elastic", 1.0, 1.0), ("t.max.pressure", "20 MPa", 20.0), ("bulge", 4.01, 4.01),
    ):  # fmt: skip
        text = WITH_MEASURE.replace("NAME", name).replace("TARGET", str(target))
        problem = loads(text).problem
        (end,) = ends(problem)
        assert parse(name, problem).value(end) == pytest.approx(number, rel=TOLERANCE)
        assert f"measure {name!r}" in end.stopped


FORMING = (
    "punch.force.y", "punch.moment", "billet.top-punch.area", "thinning(billet.top, billet.bottom)", "billet.right.barrel",
    "billet.right.angle at Y=5", "change(billet.right.angle at Y=5)", "curvature(billet.right at Y=2, billet.right at Y=13)",
    "billet.top-punch.max.pressure", "energy.friction", "billet.top-punch.friction_power", "billet.plastic_power",
)  # fmt: skip


def test_each_measure_of_forming_ends_a_step():
    """Between two increments each is met exactly; a power that jumps there is met where an increment ends."""

    def upset(until: pr.Until | None = None) -> list[Increment]:
        step = pr.Step("press", move={"punch": pr.Motion(y=-1.5)}, increments=4, until=until)
        return list(pr.solve(upset_block(
            step, material=pr.J2(70e3, 0.33, pr.Voce(60, 120, 8)), size=(10, 15), n=(4, 6), body="billet",
            plane="punch", friction=pr.Coulomb(0.15),
        )))  # fmt: skip

    whole = upset()
    for name in FORMING:
        before, after = whole[1].measure(name), whole[2].measure(name)
        target = 0.5 * (before + after)
        last = upset(pr.Until(measure={name: target}))[-1]
        assert f"measure {name!r} has reached" in last.stopped, name
        if name == "billet.plastic_power":  # a mean over the increment
            assert target < last.measure(name) <= 1.01 * after
        else:
            assert last.measure(name) == pytest.approx(target, rel=2.0 * TOLERANCE), name


WITH_MEASURE = """\
name: pressed
bodies: {b: {mesh: {type: rectangle, size: [4, 2], n: [4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {t: {type: plane, normal: [0, -1], at: [0, 2.05]}}
contacts: [{surface: b.top, against: t}]
fixed: {b.bottom: y, b.left: x}
measures: {bulge: b.bottom-right.x}
steps: [{name: one, move: {t: {y: -0.5}}, until: {measure: {NAME: TARGET}}}]
"""


@pytest.mark.parametrize(
    "name, target, words",
    [
        ("b.hieght", "1", "b.height"),
        ("b.height", "2 kN", "it is in mm"),
        ("mean(t.fy)", "1", "known of whole increments"),
    ],
)
def test_measures_that_do_not_exist_are_refused_before_anything_is_solved(name, target, words, tmp_path):
    """By the check, by a run and by a solve, with the path of the criterion."""
    problem = loads(WITH_MEASURE.replace("NAME", name).replace("TARGET", target)).problem
    out = tmp_path / "out"
    for act in (lambda: next(pr.solve(problem)), lambda: refuse_targets(problem), lambda: run(pr.Case(problem), out)):
        with pytest.raises(MeasureError, match=words) as error:
            act()
        assert f"steps.0.until.measure.{name}: " in str(error.value)
    assert not out.exists()
