"""Steps that last so many seconds, and tools that a crank drives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.model.schema import CaseError, dump, loads
from prensa.output.history import read_history
from prensa.output.run import resume, run
from prensa.system.planning import plan_step
from problems import upset_block
from stopped import stopped_after

BARE = pr.Output(1, False, False)
RATED = pr.J2(1000.0, 0.3, pr.JohnsonCook(A=20.0, B=50.0, n=0.3, C=0.1, rate0=0.02))
CRANK = pr.Crank(stroke=100.0, ratio=0.3, start=math.radians(70.0), end=math.radians(-40.0), strokes_per_minute=30.0)


def block(*steps: pr.Step, material=RATED, **more) -> pr.Problem:
    """A block of 4 × 2 on a smooth base, below a plane."""
    return upset_block(*steps, material=material, n=(2, 1), **more)


def down(y: float, name: str = "press", **more) -> pr.Step:
    return pr.Step(name, by={"t": pr.Motion(y=y)}, increments=3, **more)


def forces(problem: pr.Problem) -> list[float]:
    return [i.force("t").y for i in pr.solve(problem)]


# --------------------------------------------------------------------------------------------------------------- seconds
def test_rates_are_per_second_of_the_duration():
    """Flow at a reference rate r in T seconds is flow at r T in one; a slower step needs less force, the next its own rate."""
    slow = replace(RATED, flow=replace(RATED.flow, rate0=0.02 * 50.0))
    assert forces(block(down(-0.2, duration=50.0))) == pytest.approx(forces(block(down(-0.2), material=slow)), rel=1e-12)
    one, other = forces(block(down(-0.2), down(-0.2, "on"))), forces(block(down(-0.2), down(-0.2, "on", duration=50.0)))
    assert one[:3] == other[:3]
    assert other[-1] < 0.97 * one[-1]


def test_durations_change_nothing_where_nothing_depends_on_rates():
    """To the last bit, in the increments that are chosen on the way."""
    step = pr.Step("press", by={"t": pr.Motion(y=-0.4)})
    plastic = pr.J2(1000.0, 0.3, pr.Linear(20.0, 50.0))
    ways = [forces(block(replace(step, duration=seconds), material=plastic)) for seconds in (None, 1e-3, 3600.0)]
    assert ways[0] == ways[1] == ways[2]


def test_velocities_speeds_of_slip_and_powers_are_per_second():
    """A velocity goes on for the duration; powers times seconds are works; friction feels the speed in mm per second."""
    table = ((0.0, 0.0), (0.5, -0.2), (1.0, 0.0))
    problem = block(pr.Step("press", velocity={"t": pr.Motion(y=table)}, duration=4.0, increments=2))
    first, last = pr.solve(problem)
    assert first.tools["t"].place.y == pytest.approx(-0.2, rel=1e-6)
    assert last.tools["t"].place.y == pytest.approx(-0.4, rel=1e-12)
    assert (first.seconds, last.seconds) == (2.0, 4.0)
    works = [float(np.vdot(*i.plastic_power["b"])) * 2.0 for i in (first, last)]
    assert sum(works) == pytest.approx(last.energy["plastic"], rel=1e-9)
    law = pr.Stribeck(mu_static=0.3, mu_kinetic=0.05, speed=0.01)
    fast, slow = (block(down(-0.2, duration=s), friction=law) for s in (1.0, 100.0))
    scaled = block(down(-0.2), friction=replace(law, speed=1.0))
    assert forces(slow)[-1] > 1.01 * forces(fast)[-1]
    rated = [replace(p, bodies={"b": replace(p.bodies["b"], material=pr.Elastic(1000.0, 0.3))}) for p in (slow, scaled)]
    assert forces(rated[0]) == pytest.approx(forces(rated[1]), rel=1e-12)
    speeds = [list(pr.solve(p))[-1].contacts["b.top-t"].points.speed for p in rated]
    assert 100.0 * speeds[0] == pytest.approx(speeds[1], rel=1e-10)


def test_laws_are_reported_durations_and_seconds():
    """``dt`` and ``time`` of what a law is given are in seconds; what an early end leaves of a step is passed over."""
    until = pr.Until(travel={"t": pr.ToolTravel(y=-0.05)})
    problem = block(replace(down(-0.2, duration=8.0), until=until), down(-0.1, "on", duration=0.5))
    end, *_, last = (i for i in pr.solve(problem) if i.end_of_step)
    assert end.seconds == pytest.approx(2.0, rel=1e-7)
    assert last.seconds == pytest.approx(2.5, rel=1e-7)
    system = pr.discretise(problem)
    plan = plan_step(system, 1, end._state().u, end._state().ends)
    context = system.context(end._state(), plan, 1.5)
    assert context.law_at[0].dt == pytest.approx((1.5 - end.time) * 0.5, rel=1e-9)
    assert context.law_at[0].time == pytest.approx(2.25, rel=1e-7)


def test_durations_in_a_file_and_in_its_results(tmp_path):
    """Texts with units of time; a column of seconds, with which a stored increment comes back; none without durations."""
    case = loads(dump(pr.Case(block(down(-0.1), down(-0.1, "on")), output=BARE)))
    assert "seconds" not in read_history(run(case, tmp_path / "plain", quiet=True).directory)
    text = dump(pr.Case(block(down(-0.1), down(-0.1, "on", duration=0.02)), output=BARE))
    text = text.replace("duration: 0.02", "duration: 20 ms")
    found = run(loads(text), tmp_path / "timed", quiet=True).directory
    assert read_history(found)["seconds"][[2, 5]] == pytest.approx([1.0, 1.02], rel=1e-12)
    assert pr.results(found).increments[-1].seconds == pytest.approx(1.02, rel=1e-12)
    with pytest.raises(CaseError, match=r"case.yaml:\d+:\d+: .*'20 mm' is not a time; write it in seconds"):
        loads(text.replace("20 ms", "20 mm"), "case.yaml")


# ---------------------------------------------------------------------------------------------------------------- cranks
@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.9])
def test_the_way_of_a_crank_is_that_of_its_mechanism(ratio):
    """The pin is on its circle and the rod keeps its length at every angle; the slide is lowest at bottom dead centre."""
    crank = replace(CRANK, ratio=ratio)
    for share in np.linspace(0.0, 1.0, 23):
        angle = crank.first + share * (crank.end - crank.first)
        pin = 50.0 * np.array([math.sin(angle), -math.cos(angle)])
        slide = -crank.way(share) + crank.way(0.0)  # how far down
        if ratio:
            rod = 50.0 / ratio
            here = -50.0 - rod + crank.above(crank.first) - slide
            assert math.hypot(pin[0], here - pin[1]) == pytest.approx(rod, rel=1e-14)
        else:
            assert crank.above(crank.first) - slide == pytest.approx(50.0 + pin[1], abs=1e-12)
    assert crank.dead_centre == pytest.approx(70.0 / 110.0)
    assert crank.above(1e-9) == pytest.approx(25.0 * (1 + ratio) * 1e-18, rel=1e-12)


def test_a_crank_begins_at_a_height_and_turns_as_fast_as_it_says():
    """The angle of a height by the law of cosines; the speed of the slide is r ω sin(θ + φ) / cos φ, the rod at φ."""
    press = pr.Crank(stroke=100.0, ratio=0.3, height=12.0, strokes_per_minute=30.0)
    assert press.above(press.first) == pytest.approx(12.0, rel=1e-13)
    assert press.seconds == pytest.approx(press.first / (2 * math.pi) * 2.0)
    problem = block(pr.Step("press", crank={"t": CRANK}))
    plan = plan_step(pr.discretise(problem), 0, pr.discretise(problem).initial().u)
    dof = int(pr.discretise(problem).dofs.tool.dofs(0)[1])
    at = plan.fixed.tolist().index(dof)
    assert plan.corners() == pytest.approx([70.0 / 110.0])
    omega = 2 * math.pi * 30.0 / 60.0
    for share in (0.1, 0.5, 0.9):
        angle = math.radians(70.0 - 110.0 * share)
        phi = math.asin(0.3 * math.sin(angle))
        speed = -50.0 * omega * math.sin(angle + phi) / math.cos(phi)
        h = 1e-5
        measured = (plan.values(share + h)[at] - plan.values(share - h)[at]) / (2 * h * plan.seconds)
        assert measured == pytest.approx(speed, rel=1e-8)


@pytest.mark.parametrize("spring", [None, pr.Springs(y=1e9)], ids=["rigid", "sprung"])
def test_a_crank_drives_tools_and_mounts_in_the_run(spring):
    """A tool over its body is where the mechanism is, at the end of each increment, one of which ends at dead centre."""
    tools = {"t": pr.Plane(at=(0.0, 200.0), spring=spring)}
    problem = block(
        pr.Step("close", crank={"t": CRANK}, increments=4), down(-1.0, "on"), tools=tools, material=pr.Elastic(1000.0, 0.3)
    )
    done = list(pr.solve(problem))
    assert any(abs(i.time - 70.0 / 110.0) < 1e-12 for i in done)
    for i in done[:-3]:
        assert i.tools["t"].place.y == pytest.approx(CRANK.way(i.time), rel=1e-9)
    assert done[-1].tools["t"].place.y == pytest.approx(CRANK.way(1.0) - 1.0, rel=1e-9)
    assert done[-1].seconds == pytest.approx(CRANK.seconds + 1.0)


def test_a_press_stops_at_a_force_and_another_crank_goes_on_bit_for_bit(tmp_path):
    """``until`` ends the turn anywhere; the next one goes from there; a resumed run has the same rows."""
    stroke = pr.Crank(stroke=20.0, ratio=0.2, height=1.0, strokes_per_minute=600.0)
    lift = pr.Crank(stroke=20.0, start=0.0, end=math.radians(-20.0), strokes_per_minute=60.0)
    until = pr.Until(force={"t": pr.ToolForce(y=90.0)})
    problem = block(
        pr.Step("close", crank={"t": stroke}, increments=4, until=until),
        pr.Step("open", crank={"t": lift}, increments=4),
    )
    case = pr.Case(problem, output=BARE)
    whole = run(case, tmp_path / "whole", quiet=True).directory
    part = tmp_path / "part"
    stopped_after(case, part, 3)
    resume(part, quiet=True)
    assert (whole / "history.csv").read_bytes() == (part / "history.csv").read_bytes()
    table = read_history(whole)
    end = int(np.flatnonzero(table["step"] == "close")[-1])
    assert table["t.fy"][end] == pytest.approx(90.0, rel=1e-8)
    assert table["t.uy"][end] == pytest.approx(stroke.way(float(table["time"][end])), rel=1e-12)
    assert table["t.uy"][-1] - table["t.uy"][end] == pytest.approx(10.0 * (1 - math.cos(math.radians(20.0))), rel=1e-9)
    assert table["seconds"][-1] == pytest.approx(table["time"][end] * stroke.seconds + lift.seconds, rel=1e-12)


CASE = """
name: press
bodies: {b: {mesh: {type: rectangle, size: [4, 2], n: [2, 1]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {t: {type: plane, touching: b.top}}
fixed: {b.bottom: y, b.left: x}
steps:
  - name: press
    crank: {t: {stroke: 100 mm, ratio: 0.3, height: 2 mm, strokes_per_minute: 30}}
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("height: 2 mm", "height: 2 mm, start: 30 deg", "8:13: .*give either 'start'"),
        ("height: 2 mm", "height: 120 mm", "8:13: .*never 120 above bottom dead centre"),
        ("height: 2 mm", "start: 10 deg, end: 20 deg", "8:13: .*from 10 to 20 degrees"),
        ("{t: {stroke", "{s: {stroke", "8:13: .*unknown tool 's'"),
        ("    crank", "    duration: 2\n    crank", "9:79: .*leave out 'duration', or 'strokes_per_minute'"),
        ("    crank", "    by: {t: {y: -1}}\n    crank", "9:13: .*given by 'by' and by 'crank'"),
        ("name: press\nbodies", "name: press\nspace: axisymmetric\nbodies", None),
        ("strokes_per_minute: 30", "strokes_per_minute: 30, toward: left", None),
    ],
)
def test_mistakes_in_cranks_have_a_place_and_a_remedy(old, new, words):
    """Line and column of what is wrong; what can be meant is taken."""
    text = CASE.replace(old, new, 1)
    if words is None:
        assert loads(text, "case.yaml").problem.steps[0].crank
        return
    with pytest.raises(CaseError, match=words):
        loads(text, "case.yaml")


def test_derivatives_by_durations_and_strokes_are_those_of_differences():
    """A longer step is a slower one, a longer stroke a longer way: both as central differences have it."""
    crank = pr.Crank(stroke=20.0, ratio=0.2, start=math.radians(10.0))
    problem = block(pr.Step("press", crank={"t": crank}, duration=3.0, increments=2))
    paths = ["steps.0.duration", "steps.0.crank.t.stroke"]
    last = list(pr.solve(problem, derivatives=paths))[-1]
    found = last.derivative("t.force.y")
    times, text = [0.5, 1.0], dump(pr.Case(problem))
    for path, size, at in zip(paths, (1e-3, 1e-4), (3.0, 20.0)):  # forces have digits beyond 1e-10 that Newton leaves open
        sides = [
            list(pr.solve(loads(text, overrides=[f"{path}={at + s * size!r}"]).problem, times=times))[-1] for s in (1, -1)
        ]
        slope = (sides[0].force("t").y - sides[1].force("t").y) / (2 * size)
        assert found[path] == pytest.approx(slope, rel=1e-5)
