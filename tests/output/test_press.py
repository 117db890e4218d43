"""The press of a tool: capacity, torque of a crank, energy of blows; verdicts, stops and what is refused."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.output import answer, press
from prensa.output.history import read_history
from prensa.result.increment import Increment
from prensa.result.presses import use_of
from problems import ALUMINIUM, stroke, upset_billet, upset_block

FREE = -0.5  # the way of the tool


def billet(*steps: pr.Step, limit: pr.Press, **more: object) -> pr.Problem:
    """A billet of aluminium under the plane of a press."""
    given = {"n": (4, 4), "friction": pr.Coulomb(0.1), "sides": ("top", "right")} | more
    tools = {"t": pr.Plane(touching="b.top", press=limit)}
    return upset_billet(*(steps or (stroke(FREE, 8),)), material=ALUMINIUM, tools=tools, **given)


def solved(problem: pr.Problem) -> list[Increment]:
    """All increments."""
    return list(pr.solve(problem))


def ran(problem: pr.Problem, folder: Path, **output: object) -> dict:
    """The summary of a run without pictures."""
    pr.run(pr.Case(problem, output=pr.Output(pictures=False, report=False, fields=0, **output)), out=folder, quiet=True)
    return json.loads((folder / "summary.json").read_text())


def text(limit: str, step: str, top: str = "space: axisymmetric") -> str:
    """A case with a press, to be read."""
    return f"""
name: billet
{top}
bodies: {{b: {{mesh: {{type: rectangle, size: [4, 2], n: [2, 2]}}, material: {{type: elastic, E: 1000, nu: 0.3}}}}}}
tools: {{t: {{type: plane, touching: b.top, press: {limit}}}}}
fixed: {{b.bottom: y}}
steps: [{{name: press, {step}}}]
"""


# ------------------------------------------------------------------------------------------------------------- capacity
def test_a_step_ends_where_the_force_is_the_capacity(tmp_path: Path) -> None:
    """A stop at the press is a stop at that force, and it is what the answer says first."""
    limit = 9000.0
    until = pr.Until(press="t")
    summary = ran(billet(stroke(FREE, 8, until=until), limit=pr.Press(limit)), tmp_path / "press")
    force = ran(
        billet(stroke(FREE, 8, until=pr.Until(force={"t": pr.ToolForce(y=limit)})), limit=pr.Press(limit)), tmp_path / "force"
    )
    way = -summary["last_place"]["t"]["y"]
    assert summary["last_force"]["t"]["y"] == pytest.approx(limit, rel=1e-6)
    assert way == pytest.approx(-force["last_place"]["t"]["y"], rel=1e-6)
    assert summary["answer"][0] == f"stopped at 9 kN after {way:.4g} mm of 0.5"
    assert summary["answer"][1].startswith("largest force of t")


def test_a_run_goes_on_beyond_the_capacity_and_says_so(tmp_path: Path) -> None:
    """Without ``until`` the verdict has the largest share, and where the capacity was passed, between two increments."""
    summary = ran(billet(limit=pr.Press(9000.0)), tmp_path)
    table = read_history(tmp_path)
    share = 100 * table["t.fy"].max() / 9000.0
    at = float(np.interp(9000.0, np.append(0.0, table["t.fy"]), -np.append(0.0, table["t.uy"])))
    assert summary["answer"][0] == f"not enough: {share:.3g} % of 9 kN at 0.5 mm, passed at {at:.4g} mm"
    assert table["t.press_utilisation"] == pytest.approx(table["t.fy"] / 9000.0, rel=1e-12)
    enough = ran(billet(limit=pr.Press(20e3)), tmp_path)
    assert enough["answer"][0] == f"enough: {share * 9 / 20:.3g} % of 20 kN at 0.5 mm"
    assert enough["answer"][1] == "completed"
    assert enough["press"][0]["passed"] is None


def test_a_table_by_stroke_is_linear_between_its_points(tmp_path: Path) -> None:
    """Shares are forces over interpolated capacities; a file is the same as its numbers."""
    points = ((0.0, 4000.0), (0.3, 12e3), (0.6, 13e3))
    (tmp_path / "curve.csv").write_text("stroke (um); force (kN)\n0; 4\n300; 12\n600; 13\n")
    found = solved(billet(limit=pr.Press(points)))
    for inc in found:
        most = np.interp(-inc.tools["t"].place.y, *zip(*points))
        assert inc.measure("t.press_utilisation") == pytest.approx(inc.force("t").y / most, rel=1e-12)
    (tmp_path / "case.yaml").write_text(text("curve.csv", "move: {t: {y: -0.6}}"))
    assert pr.load(tmp_path / "case.yaml").problem.tools["t"].press.capacity == pytest.approx(np.array(points))


def test_the_torque_of_a_crank_bounds_the_force_by_virtual_work() -> None:
    """Capacity × way of the slide = torque × turn, by differences of the crank's way; near dead centre the frame's counts."""
    crank = pr.Crank(stroke=40.0, ratio=0.25, height=0.5)
    step = pr.Step("press", crank={"t": crank}, increments=6)
    torque, frame = 40e3, 30e3
    for inc in solved(billet(step, limit=pr.Press(frame, torque=torque))):
        turn = 1e-6 * (crank.first - crank.end)
        way = abs(crank.way(inc.time + 1e-6) - crank.way(inc.time - 1e-6)) / 2
        by_torque = torque * turn / max(way, 1e-30)
        assert inc.measure("t.press_utilisation") == pytest.approx(inc.force("t").y / min(frame, by_torque), rel=1e-6)
    assert crank.lever(0.3) == pytest.approx((crank.above(0.3 + 1e-6) - crank.above(0.3 - 1e-6)) / 2e-6, rel=1e-8)
    assert by_torque > frame and crank.lever(0.0) == 0.0


def test_half_a_part_needs_half_of_the_press(tmp_path: Path) -> None:
    """The right half with its mirror image is used as much as the whole; half of a height has twice the stroke."""
    curve = ((0.0, 4e3), (2.0, 40e3))

    def block(
        size: tuple[float, float], origin: float, mirror: tuple[str, ...] | None, fixed: dict, n: tuple[int, int], way: float
    ) -> pr.Problem:
        tools = {"t": pr.Plane(touching="b.top", press=pr.Press(curve, energy=1e4, mirror=mirror))}
        return upset_block(
            stroke(way, 4), material=ALUMINIUM, tools=tools, size=size, origin=(origin, 0.0), n=n, fixed=fixed, thickness=10.0
        )

    whole = block((8.0, 2.0), -4.0, (), {"b.bottom": "y", "b.bottom-left": "xy"}, (8, 4), -0.2)
    half = block((4.0, 2.0), 0.0, ("left",), {"b.bottom": "y", "b.left": "x"}, (4, 4), -0.2)
    quarter = block((4.0, 1.0), 0.0, ("left", "bottom"), {"b.bottom": "y", "b.left": "x"}, (4, 2), -0.1)
    ends = [solved(p)[-1] for p in (whole, half, quarter)]
    used = [inc.measure("t.press_utilisation") for inc in ends]
    assert used[1] == pytest.approx(used[0], rel=1e-9)
    assert used[2] == pytest.approx(used[0], rel=1e-4)  # its base is a support, and no tool with the give of a penalty
    work = [use_of(p, "t").energies * i.tools["t"].work for p, i in zip((whole, half, quarter), ends)]
    assert work[1:] == pytest.approx([work[0]] * 2, rel=1e-4)
    with pytest.raises(pr.PrensaError, match=r"give the press of 't' 'mirror: \[left\]' too"):
        pr.Case(block((4.0, 2.0), 0.0, None, {"b.bottom": "y", "b.left": "x"}, (4, 4), -0.2), output=pr.Output(mirror="left"))


# --------------------------------------------------------------------------------------------------------------- energy
@pytest.mark.parametrize("capacity", [None, 80e3])
def test_a_screw_press_that_used_its_energy_has_a_verdict_on_its_force(capacity: float | None, tmp_path: Path) -> None:
    """The end of the step says that the energy was used; whether the frame bears the force is another question."""
    step = pr.Step("blow", by={"t": pr.Motion(y=-1.0)}, until=pr.Until(press="t"))
    summary = ran(billet(step, limit=pr.Press(capacity, energy=1500.0)), tmp_path)
    said = [line for line in summary["answer"] if line.startswith("enough")]
    force = float(np.nanmax(read_history(tmp_path)["t.fy"]))
    share = 100 * force / 80e3
    assert [line.startswith(f"enough: {share:.3g} % of 80 kN in force at ") for line in said] == [True] * (capacity is not None)
    assert any(line.startswith("stopped at 1.5 J after") for line in summary["answer"])


def test_blows_end_when_their_energy_is_used_and_it_adds_up(tmp_path: Path) -> None:
    """Two blows of different energies: what is given is plastic + friction + elastic to 1e-3, and each ends exactly there."""
    blow = {"by": {"t": pr.Motion(y=-1.0)}}
    steps = (
        pr.Step("first", until=pr.Until(energy={"t": 2000.0}), **blow),
        pr.Step("up", by={"t": pr.Motion(y=0.2)}, increments=3),
        pr.Step("second", until=pr.Until(press="t"), **blow),
    )
    problem = billet(*steps, limit=pr.Press(energy=4000.0), n=(8, 8))
    summary = ran(problem, tmp_path)
    first, second = summary["blows"]
    assert [first["step"], second["step"]] == ["first", "second"]  # going up is not a blow
    for made, energy in ((first, 2000.0), (second, 4000.0)):
        assert made["gave"] == pytest.approx(energy, rel=1e-6)
        assert abs(made["missing"]) < 1e-3 * energy
        assert made["efficiency"] == pytest.approx((made["plastic"] + made["friction"]) / energy, rel=1e-6)
        assert 0.9 < made["efficiency"] < 1.0
    table = read_history(tmp_path)
    for name, row in (("first", 0), ("second", 1)):  # the work of the tool, by hand
        rows = np.flatnonzero(table["step"] == name)
        before = np.append(rows[0] - 1, rows) if rows[0] else rows
        f, u = (np.append([] if rows[0] else [0.0], table[f"t.{c}"][before]) for c in ("fy", "uy"))
        assert summary["blows"][row]["gave"] == pytest.approx(float((0.5 * (f[1:] + f[:-1]) * -np.diff(u)).sum()), rel=1e-3)
    said = summary["answer"]
    assert said[0].startswith("step 'first' stopped at 2 J after") and "step 'second' stopped at 4 J after" in said[0]
    assert said[1].startswith("step 'first': 2 J given: ") and said[1].endswith(f"efficiency {100 * first['efficiency']:.1f} %")


def test_a_blow_whose_energy_does_not_add_up_is_warned_of(tmp_path: Path) -> None:
    """Two increments of a user's own: the balance of the first blow is off by more than 5 % of what it gave."""
    blow = pr.Step("first", by={"t": pr.Motion(y=-1.0)}, increments=2, until=pr.Until(energy={"t": 2000.0}))
    summary = ran(billet(blow, limit=pr.Press(energy=2000.0), n=(2, 2)), tmp_path)
    assert abs(summary["blows"][0]["missing"]) > 0.05 * 2000.0
    assert any("energy balance of step 'first' off by" in words for words in summary["warnings"])


def test_a_second_blow_of_steel_adds_up_in_increments_of_its_elastic_part() -> None:
    """Hardened steel yields again after a thousandth of the stroke, where the trapezoid of a long increment misses work."""
    steel = pr.J2(200e3, 0.3, pr.Ludwik(250.0, 500.0, 0.3))
    blow = {"by": {"t": pr.Motion(y=-10.0)}}
    steps = (
        pr.Step("first", until=pr.Until(energy={"t": 0.5e6}), **blow), pr.Step("up", by={"t": pr.Motion(y=1.0)}, increments=4),
        pr.Step("second", until=pr.Until(press="t"), **blow),
    )  # fmt: skip
    tools = {"t": pr.Plane(touching="b.top", press=pr.Press(energy=0.8e6))}
    problem = upset_billet(
        *steps, material=steel, tools=tools, size=(10.0, 15.0), n=(4, 6), friction=pr.Coulomb(0.1), sides=("top", "right"),
        element="q8",
    )  # fmt: skip

    def missing(numerics: pr.Numerics) -> tuple[float, int]:
        """Of the second blow, over its energy; with the number of increments."""
        found = list(pr.solve(problem, numerics))
        before = next(i for i in found if i.step == "second").number - 1
        return abs(found[-1].energy["imbalance"] - found[before - 1].energy["imbalance"]) / 0.8e6, len(found)

    (fine, few), (coarse, fewer) = missing(pr.Numerics()), missing(pr.Numerics(energy_tolerance=0.5))
    assert fine < 2e-4 < 8e-4 < coarse
    assert few <= fewer + 6


def test_a_blow_goes_on_bit_for_bit_from_a_checkpoint() -> None:
    """The work done so far is part of the committed state."""
    problem = billet(stroke(-1.0, 20, until=pr.Until(press="t")), limit=pr.Press(energy=3000.0))
    found = solved(problem)
    state = type(found[4].state).from_arrays(found[4].state.arrays())
    again = list(pr.solve(problem, start=state))
    assert again[-1].tools["t"].work == found[-1].tools["t"].work == pytest.approx(3000.0, rel=1e-6)
    assert np.array_equal(again[-1].state.u, found[-1].state.u)


def test_springs_of_the_frame_take_their_part_of_the_energy() -> None:
    """What a blow gives is the work at the mount: that on the billet and F²/2k of the frame."""
    k = 40e3
    tools = {"t": pr.Plane(touching="b.top", spring=pr.Springs(y=k), press=pr.Press(energy=4000.0))}
    steps = (stroke(-2.0, 20, until=pr.Until(press="t")),)
    last = solved(upset_billet(*steps, material=ALUMINIUM, tools=tools, n=(4, 4)))[-1]
    force, e = last.force("t").y, last.energy
    assert last.tools["t"].work == pytest.approx(4000.0, rel=1e-6)
    assert e["elastic"] > 0.5 * force**2 / k
    assert e["external"] == pytest.approx(last.tools["t"].work, rel=1e-12)


def test_the_use_of_a_press_has_derivatives() -> None:
    """Those of forces and of energies, by two parameters at once, against differences of runs."""

    def used(mu: float, height: float, limit: pr.Press) -> list[Increment]:
        problem = billet(stroke(FREE, 6), limit=limit, friction=pr.Coulomb(mu), size=(4.0, height))
        return list(pr.solve(problem, derivatives=["friction.mu", "bodies.b.material.flow.K"]))

    for limit in (pr.Press(9000.0), pr.Press(((0.0, 8e3), (1.0, 20e3))), pr.Press(energy=3000.0)):
        d = used(0.1, 2.0, limit)[-1].derivative("t.press_utilisation")["friction.mu"]
        ends = [used(mu, 2.0, limit)[-1].measure("t.press_utilisation") for mu in (0.0999, 0.1001)]
        assert d == pytest.approx((ends[1] - ends[0]) / 2e-4, rel=1e-4)


# ------------------------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    ("limit", "step", "top", "says"),
    [
        ("[[0, 3 kN], [0.5, 4 kN]]", "move: {t: {y: -0.6}}", "", "ends at a stroke of 0.5, and step .press. goes to 0.6"),
        ("[[0, 3 kN], [0.5, 4 kN]]", "push: {t: {y: -60}}", "", "how far 'push' brings 't' is not known before: give"),
        ("[[0.1, 3 kN], [0.5, 4 kN]]", "move: {t: {y: -0.4}}", "", "'capacity' begins at a stroke of 0.1; give it from 0 on"),
        ("{energy: 5 J}", "push: {t: {y: -60}}", "", "a given force and the energy of a blow contradict each other: move 't'"),
        ("{torque: 5 N*m}", "move: {t: {y: -0.4}}", "", "has a 'torque', .* drive 't' by 'crank' here"),
        ("{}", "move: {t: {y: -0.4}}", "", "a press needs a limit: 'capacity'"),
        ("3 kN", "move: {t: {y: -0.4}}", "space: plane strain", "give 'thickness', how long the part is"),
        ("3 kN", "by: {b.bottom: {y: 0.1}}", "", "no step drives tool 't' along x or y"),
        ("3 kN", "move: {t: {y: -0.4}}, until: {press: u}", "", "unknown tool 'u'"),
        ("3 kN", "move: {t: {y: -0.4}}, until: {energy: {t: -1 J}}", "", "greater than 0"),
        ("{energy: 2 J}", "move: {t: {y: -0.4}}, until: {energy: {t: 3 J}}", "", "has an energy of 2000, and the blow"),
        ("{capacity: 3 kN, mirror: left}", "move: {t: {y: -0.4}}", "", "in axisymmetry the axis mirrors"),
        ("no.csv", "move: {t: {y: -0.4}}", "", "capacity curve 'no.csv': there is no such file"),
    ],
)  # fmt: skip
def test_what_contradicts_itself_is_refused_in_one_line(limit: str, step: str, top: str, says: str, tmp_path: Path) -> None:
    """With the place in the file and a remedy, before anything is solved."""
    (tmp_path / "case.yaml").write_text(text(limit, step, top or "space: axisymmetric"))
    with pytest.raises(pr.CaseError, match=says) as caught:
        pr.load(tmp_path / "case.yaml")
    assert len(str(caught.value).splitlines()) == 1
    assert str(caught.value).startswith(f"{tmp_path / 'case.yaml'}:")


def test_a_tool_without_a_press_has_no_utilisation() -> None:
    """The message says what to give."""
    problem = upset_billet(stroke(-0.1))
    with pytest.raises(pr.PrensaError, match="tool 't' has no press; give it one, such as 'press: 400 kN'"):
        problem_measure(problem)


def problem_measure(problem: pr.Problem) -> None:
    """Read the measure."""
    from prensa.measures import parse

    parse("t.press_utilisation", problem)


def test_the_picture_has_force_capacity_and_share() -> None:
    """Of a table the whole curve, of a crank what it is on the way."""
    crank = pr.Step("press", crank={"t": pr.Crank(stroke=40.0, ratio=0.25, height=0.5)}, increments=4)
    for problem in (billet(limit=pr.Press(((0.0, 4e3), (1.0, 20e3)))), billet(crank, limit=pr.Press(20e3, torque=4e4))):
        found = solved(problem)
        from prensa.measures.columns import columns

        table = {k: np.array([c.value(i) for i in found]) for k, c in columns(problem).items()}
        force, capacity = press.picture(table, problem, "t").axes[0].lines
        assert np.array_equal(force.get_ydata()[1:], table["t.fy"])
        drawn = np.isfinite(capacity.get_ydata())
        assert drawn.any() and capacity.get_ydata()[drawn].min() > 0.0
        assert math.isfinite(answer.press.course(table, problem, use_of(problem, "t")).stroke[-1])


def test_the_interactive_plot_has_the_capacity_beside_the_force(tmp_path: Path) -> None:
    """At the first place and at all increments, of the modelled part, with the sign of the force; nothing of energies alone."""
    from prensa.output.report import stored_run
    from prensa.output.scene import scene

    curve = pr.Press(((0.0, 4e3), (1.0, 20e3)), mirror="left")
    tools = {"t": pr.Plane(touching="b.top", press=curve), "u": pr.Plane(at=(0.0, 9.0))}
    fixed = {"b.bottom": "y", "b.left": "x"}
    half = upset_block(stroke(-0.2, 4), material=ALUMINIUM, tools=tools, n=(4, 4), fixed=fixed, thickness=10.0)
    pr.run(pr.Case(half, output=pr.Output(pictures=False, report=False, mirror="left")), out=tmp_path, quiet=True)
    made = scene(stored_run(tmp_path))[0]["capacities"]
    assert list(made) == ["t"]
    assert made["t"] == pytest.approx(0.5 * np.interp([0.0, 0.05, 0.1, 0.15, 0.2], [0.0, 1.0], [4e3, 20e3]), rel=1e-5)


def test_a_tool_that_meets_nothing_is_not_enough(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its verdict says so, in place of 'enough: 0 %'; what was warned of after the last increment is not said twice."""
    touching = billet(stroke(FREE, 2), limit=pr.Press(9000.0))
    missed = replace(touching, tools={"t": pr.Plane(at=(0.0, 9.0), press=pr.Press(9000.0))})
    out = pr.Output(pictures=False, report=False, fields=0)
    made = pr.run(pr.Case(missed, output=out), out=tmp_path / "away")
    assert made.summary["answer"][0].startswith("t met nothing: no force on its press in 0.5")
    said = capsys.readouterr().err
    assert said.count("never touched 'b.") == 1 and said.count("met nothing") == 1
