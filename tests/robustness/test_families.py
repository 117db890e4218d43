"""Families of random problems: the same for the same seed, their checks find wrong answers, their verdicts are honest."""

from __future__ import annotations

import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from answers import passes, recorded

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.model.schema import warnings_of
from prensa_bench import robustness
from prensa_bench.robustness import checks, judging
from prensa_bench.robustness.claims import let_go, sprung_back
from prensa_bench.robustness.drawn import Drawn, Twin, chain, circle, plane, stamp
from prensa_bench.robustness.families import MOST_INSTEAD, drawn, instead, on_second_mesh
from prensa_bench.robustness.families.cycles import unsettled
from prensa_bench.robustness.files import Record, read, solve_into, solve_stages
from prensa_bench.robustness.judging import judge_files, unlike
from problems import pressed_block, stroke

# ---------------------------------------------------------------------------------------------------------- own geometry
TOOLS = {
    "plane": plane((1.0, 2.0), (0.6, -0.8)),
    "circle": circle((1.0, 2.0), 3.0),
    "hollow": circle((1.0, 2.0), 2.5, hollow=True),
    "stamp": stamp((1.0, 2.0), 4.0, 0.5),
    "profile": chain((1.0, 2.0), [(-6, 5), (-2, 0), (0, 1), (2, 0), (6, 5)], 0.4),
    "polygon": chain((1.0, 2.0), [(-2, -1), (2, -1), (3, 2), (-3, 2)], 0.5, closed=True),
}


@pytest.mark.parametrize("name", TOOLS)
def test_two_geometries_agree(name):
    """Distances and normals by the formulas of the checks are those of the solver's tools, found in another way."""
    tool = TOOLS[name]
    x = np.random.default_rng(3).uniform(-3.0, 3.0, (400, 2))
    gap, n = tool.outline(x)
    shape = tool.tool.shape(tool.tool.looks(np.array([0.0, 1.0])), 0.0)
    told = shape.closest(x)
    near = (np.abs(gap) < 0.35) & (np.abs(told.g) < 0.35)  # deep inside the nearest place depends on what is counted
    assert near.sum() > 20
    assert np.allclose(gap[near], told.g[near], atol=1e-9)
    assert np.allclose(n[near], told.n[near], atol=1e-7)


def test_a_fillet_is_a_circle():
    """On the middle of a right angle's rounding the distance is that to its centre less the radius."""
    corner = chain((0.0, 0.0), [(0, 5), (0, 0), (5, 0)], 1.0)
    gap, n = corner.outline(np.array([[0.0, 0.0], [1.0, -0.3], [-2.0, 3.0], [0.5, 0.5], [4.0, 0.1]]))
    assert np.allclose(gap, [np.sqrt(2) - 1, 0.3, 2.0, np.sqrt(0.5) - 1, -0.1])
    assert np.allclose(n[0], [-np.sqrt(0.5), -np.sqrt(0.5)])


def test_areas_and_volumes_are_those_of_circles():
    """A quarter of a disc of quadratic cells and its body of revolution, a half sphere; lines about the axis as cones."""
    a = np.linspace(0, np.pi / 2, 17)
    rim, middle = (np.stack([np.cos(v), np.sin(v)], axis=1) for v in (a, 0.5 * (a[1:] + a[:-1])))
    points = np.vstack([[[0.0, 0.0]], rim, 0.5 * rim, middle])
    k = np.arange(16)
    cells = np.stack([0 * k, 1 + k, 2 + k, 18 + k, 35 + k, 19 + k], axis=1)
    assert checks.areas(cells, points).sum() == pytest.approx(np.pi / 4, rel=1e-6)
    assert checks.volumes(cells, points, axisymmetric=True).sum() == pytest.approx(2 * np.pi / 3, rel=1e-5)
    x = np.array([[1.0, 0.0], [2.0, 0.5], [4.0, 0.5]])
    cone = np.pi * 3 * np.hypot(1.0, 0.5)
    area = checks.tributary(np.array([[0, 1], [1, 2]]), x, None)
    assert area.sum() == pytest.approx(cone + np.pi * 12)
    assert area[0] == pytest.approx(2 * np.pi * np.hypot(1.0, 0.5) * (2 * 1 + 2) / 6)
    assert np.allclose(checks.tributary(np.array([[0, 1, 2]]), np.array([[0.0, 0], [1, 0], [2, 0]]), 3.0), [1, 4, 1])


def test_bounds_of_a_share_are_those_of_the_tables():
    """Clopper and Pearson's bounds: 0 of 10, 10 of 10, 97 of 100."""
    assert robustness.bounds(0, 10) == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert robustness.bounds(10, 10) == pytest.approx((0.6915, 1.0), abs=1e-4)
    assert robustness.bounds(97, 100) == pytest.approx((0.9148, 0.9938), abs=1e-4)


def test_a_thin_ring_has_the_stiffness_of_the_tables():
    """Two opposite forces on a ring: F = δ E I / (0.1488 R³) (Timoshenko), half of δ the travel of the crown."""
    from prensa_bench.robustness.families.slender import beam_stiffness

    found = beam_stiffness(10.0, 1.0, 12.0, np.pi / 2, free=True)
    assert found == pytest.approx(2.0 / ((np.pi / 4 - 2 / np.pi) * 1000.0), rel=1e-5)


# ---------------------------------------------------------------------------------------------------- wrong answers seeded
def pressed(**changed: object) -> Drawn:
    """A small elastic-plastic block under a stamp: pressed with a force, moved along, lifted."""
    tool = stamp((0.0, 2.0), 3.0, 0.6)
    settings = {"units": pr.Units(), "space": "plane strain"} | changed
    p = pressed_block(
        pr.Step("push", push={"tool": pr.Push(y=-70.0)}, increments=4),
        pr.Step("slide", push={"tool": pr.Push(y=-70.0)}, move={"tool": pr.Motion(x=0.05)}, increments=4),
        tools={"tool": tool.tool}, material=pr.J2(1e4, 0.3, pr.Linear(20.0, 100.0)), size=(6.0, 2.0), n=(10, 3),
        origin=(-3.0, 0.0), body="block", friction=pr.Coulomb(0.2), **settings,
    )  # fmt: skip
    return Drawn((p,), {"tool": tool}, {"block.top-tool": 0.2}, 1e4, 0.3, 60.0)


@cache
def solved() -> tuple[Drawn, Record]:
    d = pressed()
    return d, recorded(d)


def test_a_right_answer_passes():
    """Nothing is found in the answer that the wrong ones are made of; there is pressure, friction and flow in it."""
    passes(checks, *solved())


def contact_node(r: Record, to: float) -> None:
    t = r.contacts["block.top-tool"][5]
    t["y"][5] += to


def body_node(r: Record, to: float) -> None:
    s = r.bodies[8]["block"]
    s.x[np.argmax(s.x[:, 1] - np.abs(s.x[:, 0]))] += (0.0, to)


def scaled(r: Record, column: str, by: float, row: int = 5) -> None:
    r.history[column][row] *= by


def table(r: Record, column: str, by: float, number: int = 6) -> None:
    r.contacts["block.top-tool"][number][column] *= by


SPOILT = {
    "a node of the outline in the tool": (checks.outlines, lambda r: contact_node(r, 0.02), "gap is|inside the tool"),
    "a node of the outline off the tool": (
        checks.outlines,
        lambda r: contact_node(r, -0.02),
        "gap is|across an open gap",
    ),
    "both gap and place": (
        checks.outlines,
        lambda r: (contact_node(r, 0.02), r.contacts["block.top-tool"][5]["gap"].__isub__(0.0)),
        "gap is|inside the tool",
    ),
    "a node that no contact has": (checks.outlines, lambda r: body_node(r, 0.2), "lies .* inside tool"),
    "a tool elsewhere": (checks.outlines, lambda r: scaled(r, "tool.uy", 1.3), "gap is|inside the tool"),
    "suction": (checks.outlines, lambda r: table(r, "pressure", -1.0), "negative pressure"),
    "a force of a tool": (checks.balance, lambda r: scaled(r, "tool.fy", 1.001), "forces at the nodes miss"),
    "a drag": (checks.balance, lambda r: scaled(r, "tool.fx", 1.01), "forces at the nodes miss"),
    "all pressures": (checks.balance, lambda r: table(r, "pressure", 1.001), "forces at the nodes miss"),
    "a support": (checks.balance, lambda r: scaled(r, "fixed.block.bottom.fy", 1.001), "out of balance"),
    "a moment": (checks.moments, lambda r: scaled(r, "tool.mz", 1.1), "moments at the nodes miss"),
    "places of reactions": (
        checks.moments,
        lambda r: r.bodies[8]["block"].reaction.__imul__(np.array([1.0, 1.01])),
        "moments of tools and supports differ",
    ),
    "shear": (checks.friction, lambda r: table(r, "shear", 1.05), "above its bound"),
    "a place not reached": (checks.driven, lambda r: scaled(r, "tool.ux", 0.99, 7), "was asked"),
    "a force not reached": (checks.driven, lambda r: scaled(r, "tool.fy", 0.99, 3), "was asked"),
    "a step left out": (checks.driven, lambda r: r.steps.__setitem__(slice(4, 8), ["push"] * 4), "were made of"),
    "plastic work that falls": (checks.energy, lambda r: scaled(r, "energy.plastic", 0.9, 7), "plastic work falls"),
    "friction that gives work": (checks.energy, lambda r: scaled(r, "energy.friction", -1.0), "friction work falls"),
    "work from nowhere": (checks.energy, lambda r: scaled(r, "energy.external", 1.01), "off forces times paths"),
    "an element inside out": (
        checks.elements,
        lambda r: r.bodies[8]["block"].x.__setitem__(20, r.bodies[8]["block"].x[0]),
        "has no area",
    ),
    "a body that has swollen": (checks.volume, lambda r: r.bodies[8]["block"].x.__imul__(1.005), "volume of block"),
}


@pytest.mark.parametrize("what", SPOILT)
def test_a_wrong_answer_is_found(what):
    """An answer in which one number is wrong is refused by the check that is there for it, and by the whole."""
    d, record = solved()
    spoilt = copy.deepcopy(record)
    check, spoil, words = SPOILT[what]
    assert check(d, record) == ""
    spoil(spoilt)
    found = check(d, spoilt)
    import re

    assert re.search(words, found), found
    assert checks.wrong_with(d, [spoilt])


@pytest.mark.parametrize("element", ["q4_fbar", "q8"])
def test_wrong_answers_of_bodies_of_revolution_are_found(element, tmp_path):
    """A cylinder under a flat tool: right as it is, and its volume, areas and balance refused when they are spoilt."""
    tool = plane((0.0, 2.0), (0.0, -1.0))
    p = pressed_block(
        stroke(-0.02, increments=2, tool="tool"), stroke(0.01, increments=2, tool="tool", name="lift"),
        tools={"tool": tool.tool}, material=pr.Elastic(1e4, 0.2), size=(3.0, 2.0), n=(4, 3), element=element,
        body="rod", space="axisymmetric",
    )  # fmt: skip
    solve_into(tmp_path, p, np.inf)
    d, record = Drawn((p,), {"tool": tool}, {"rod.top-tool": 0.0}, 1e4, 0.2), read(tmp_path, p)
    assert checks.wrong_with(replace(d, claims=(let_go, sprung_back)), [record]) == ""
    for spoil, words in (
        (lambda r: r.bodies[2]["rod"].x.__imul__(1.001), "volume of rod"),
        (lambda r: r.contacts["rod.top-tool"][2]["pressure"].__imul__(1.001), "forces at the nodes miss"),
    ):
        spoilt = copy.deepcopy(record)
        spoil(spoilt)
        assert words in checks.balance(d, spoilt) + checks.volume(d, spoilt)
    left = copy.deepcopy(record)
    left.bodies[4]["rod"].x[3, 0] += 1e-3
    assert "is left with displacements" in sprung_back(left)
    left.history["tool.fy"][-1] = 1.0
    assert "after its release" in let_go(left)


@pytest.mark.parametrize(("falls", "settles"), [
    ("0.02 * 0.7**k", True), ("0.02 / (k + 1)**2", True), ("0.0 * k", True), ("1e-9 * (k % 2)", True),
    ("0.01 * 0.85**k", True), ("0.003 + 0.0 * k", False), ("0.006 / np.sqrt(k + 1)", False), ("0.0002 * 1.3**k", False),
    ("0.004 * (k > 7)", False), ("0.2 * 0.7**k", False),
])  # fmt: skip
def test_peaks_that_go_on_falling_do_not_settle(falls, settles):
    """Falls of ten cycles with and without a finite sum, growing, beginning late, and too large at the end."""
    k = np.arange(9)
    peaks = 1000.0 * np.concatenate([[1.0], 1.0 - np.cumsum(eval(falls, {"k": k, "np": np}))])
    assert (unsettled(peaks) == "") == settles


@pytest.mark.parametrize("element", ["q8", "q4_fbar"])
def test_what_drags_at_a_free_roll_is_found(element, tmp_path):
    """A right roll passes that has 2.5 elements beneath it; one does not whose torque drags by 1e-3 of what friction bears.

    Nor does friction of which no work of the tool shows, nor a load that was to be released.
    """
    d = drawn("rolls", 401396437, 8)
    body = replace(d.problem.bodies["block"], element=element)
    (record,) = solve_stages(tmp_path, (replace(d.problem, bodies={"block": body}),), np.inf)
    (claim,) = d.claims
    assert claim(record) == ""
    h = record.history
    R, on = d.problem.tools["roll"].radius, np.array([step == "pass" for step in record.steps])
    bear = d.mu["block.top-roll"] * h["roll.fy"][on][-1]
    for sign in (-1.0, 1.0):
        wrong = replace(record, history={**h, "roll.mz": h["roll.mz"] + sign * 1e-3 * bear * R})
        assert "no energy accounts for" in claim(wrong)
    rubbed = h["energy.friction"] + np.where(on, 1e-3 * bear * (h["roll.ux"] - h["roll.ux"][on][0]), 0.0)
    assert "no energy accounts for" in claim(replace(record, history={**h, "energy.friction": rubbed}))
    assert "is left of a load" in claim(replace(record, history={**h, "roll.fx": h["roll.fx"] + 1e-5 * bear}))


def test_tall_bodies_of_wide_ranges_are_pressed_by_less_than_what_buckles_them():
    """The shortening of a plane body, by its drawing, is below half of Euler's for a column with a free head."""
    pressed = 0
    for number in range(60):
        p = robustness.drawn("wide", 5, number).problem
        (w, h), way = p.bodies["block"].mesh.size, -p.steps[0].move["tool"].y
        if p.space == "plane strain":
            pressed += 1
            assert way / h <= 0.5 * np.pi**2 / 12 * (w / (2 * h)) ** 2 * (1 + 1e-12)
    assert pressed > 20


def test_a_crash_is_a_wrong_answer(tmp_path, monkeypatch):
    """What is no message of prensa's own is reported as a crash, and the suite goes on."""
    from prensa_bench.robustness import judging

    def crash(*_: object) -> None:
        raise IndexError("list index out of range")

    monkeypatch.setattr(judging, "solve_stages", crash)
    outcome = judge_files(pressed(), 0, tmp_path)
    assert (outcome.status, outcome.reason) == ("wrong", "Crashed")
    assert outcome.words == "crashed: IndexError: list index out of range"


def test_a_twin_of_another_answer_is_found():
    """Last forces are compared with those of the twin, scaled."""
    d, record = solved()
    other = copy.deepcopy(record)
    assert unlike(record, other, Twin(d.problem)) == ""
    assert unlike(record, other, Twin(d.problem, scale=1.001))
    other.history["tool.fx"][-1] *= 1.1
    assert "last tool.fx" in unlike(record, other, Twin(d.problem))


# ---------------------------------------------------------------------------------------------------------------- verdicts
def test_verdicts_say_what_happened(tmp_path):
    """Right, wrong where a claim does not hold or a twin differs, reported with its type, and out of time."""
    d = pressed()
    right = judge_files(replace(d, claims=(lambda r: "" if r.steps[-1] == "slide" else "?",)), 7, tmp_path / "a")
    assert (right.status, right.words, right.number) == ("right", "", 7)
    assert right.iterations > 8
    wrong = judge_files(replace(d, claims=(lambda r: "the moon is green",)), 0, tmp_path / "b")
    assert (wrong.status, wrong.words) == ("wrong", "the moon is green")
    stiffer = replace(d.problem, friction=pr.Coulomb(0.1))
    assert judge_files(replace(d, twins=(Twin(stiffer),)), 0, tmp_path / "c").status == "wrong"
    late = judge_files(replace(d, limit=0.0), 0, tmp_path / "d")
    assert (late.status, late.words) == ("time", "not ended after 0 s, stage 1, step '', increment 0, time 0")
    told = judge_files(replace(d, stages=(replace(d.problem, fixed={}),)), 0, tmp_path / "e")
    assert (told.status, told.reason) == ("reported", "PreflightError")


def twins(monkeypatch, **failing):
    """A problem and twins of it by name: one like it, and others that fail so when they are solved."""
    solve = judging.solve_into

    def failed(folder, problem, until, numerics):
        if problem.name in failing:
            raise failing[problem.name]
        solve(folder, problem, until, numerics)

    monkeypatch.setattr(judging, "solve_into", failed)
    d = pressed()
    return lambda name, **keys: replace(d, twins=(Twin(replace(d.problem, name=name), **keys),), kind=f"with {name}")


def test_a_second_run_that_is_late_is_no_agreement(tmp_path, monkeypatch):
    """It is not compared, and says so; of the problems that are drawn instead the first that can be compared is the last."""
    drawn = twins(monkeypatch, late=judging.OutOfTime())
    late, good = drawn("late"), drawn("like it")
    assert judge_files(good, 0, tmp_path / "a").twin == "like it: compared"
    alone = judge_files(late, 0, tmp_path / "b")
    assert (alone.status, alone.twin) == ("right", "late: not compared")
    assert alone.words == "not compared: its twin did not end in time"
    other = judge_files(late, 0, tmp_path / "c", iter([late, good, replace(good, claims=(lambda r: "not asked",))]))
    assert (other.status, other.twin) == ("right", "late: another compared")
    assert other.words.count("did not end in time") == 2 and other.words.endswith("instead of it with like it: right")
    wrong = judge_files(late, 0, tmp_path / "d", [replace(good, claims=(lambda r: "the moon is green",))])
    assert wrong.status == "wrong" and "instead of it with like it: the moon is green" in wrong.words
    stiffer = Twin(replace(late.problem, name="rougher", friction=pr.Coulomb(0.1)))
    assert judge_files(late, 0, tmp_path / "e", [replace(late, twins=(stiffer,))]).status == "wrong"
    assert judge_files(replace(late, limit=0.0), 0, tmp_path / "f", [good]).twin == "late: another compared"
    tally = robustness.Tally("x", 0, [alone, other, other])
    assert tally.twins() == "2 late: another compared, 1 late: not compared"


def test_a_second_run_that_stops_without_a_reason_that_its_files_show_is_reported(tmp_path, monkeypatch):
    """One that had to stop is not compared, one that crashes or whose files are wrong is wrong."""
    drawn = twins(monkeypatch, stopped=pr.PrensaError("no way on"), crashed=IndexError("out of range"))
    for keys in ({}, {"same_tools": True}):
        outcome = judge_files(drawn("stopped", **keys), 0, tmp_path / f"a{len(keys)}")
        assert (outcome.status, outcome.reason, outcome.twin) == ("reported", "PrensaError", "stopped: not compared")
        assert outcome.words == "its twin: no way on"
    crashed = judge_files(drawn("crashed"), 0, tmp_path / "b", [drawn("like it")])
    assert (crashed.status, crashed.reason) == ("wrong", "Crashed")
    monkeypatch.setattr(judging, "_stopped", lambda *_: judging.Verdict("confirmed", "folded: no way on", "Distorted"))
    confirmed = judge_files(drawn("stopped", same_tools=True), 0, tmp_path / "c")
    assert (confirmed.status, confirmed.twin) == ("right", "stopped: not compared")
    assert confirmed.words == "not compared: its twin stopped, folded: no way on"
    finer = drawn("like it", same_tools=True)
    seen = replace(finer, claims=(lambda r: "twice" if r.problem.name == "like it" else "",))
    assert (outcome := judge_files(seen, 0, tmp_path / "d")).status == "wrong" and outcome.words == "its twin: twice"


def test_one_of_ten_is_solved_on_a_second_mesh():
    """The seed chooses it, and what is drawn instead of it is of the same kind, and other problems."""
    for seed in (7, 8):
        second = [k for k in range(100) if any(t.problem.name == "on a finer mesh" for t in drawn("space", seed, k).twins)]
        assert [k // 10 for k in second] == list(range(10))
        assert all(on_second_mesh("space", seed, k) == (k in second) for k in range(100))
        others = list(instead("space", seed, second[0]))
        assert len({d.kind for d in (drawn("space", seed, second[0]), *others)}) == 1 + MOST_INSTEAD
        assert all(d.twins[0].problem.name == "on a finer mesh" for d in others)
        assert not list(instead("space", seed, second[0] + 1))
    assert not any(on_second_mesh("setups", 7, k) for k in range(10))


def test_stages_go_on_from_one_another(tmp_path):
    """A chain of two runs ends where the one run of both steps ends."""
    d, record = solved()
    stages = tuple(replace(d.problem, steps=(s,)) for s in d.problem.steps)
    chained = solve_stages(tmp_path, stages, np.inf)
    assert [len(r.history["time"]) for r in chained] == [4, 4]
    assert unlike(chained[-1], record, Twin(d.problem)) == ""
    assert checks.wrong_with(replace(d, stages=stages), chained) == ""


def test_a_problem_and_itself_turned_are_reported_from_others(tmp_path):
    """A block and the same turned, moved and numbered anew have the same forces; half a degree or more friction is seen."""
    d = next(d for d in (robustness.drawn("posed", 7, k) for k in range(40)) if "turned, wedge, moved" in d.kind)
    (one,) = solve_stages(tmp_path / "one", d.stages, np.inf, d.numerics)
    (twin,) = d.twins
    solve_into(tmp_path / "other", twin.problem, np.inf, d.numerics)
    other = read(tmp_path / "other", twin.problem)
    assert abs(np.sin(twin.angle)) > 1e-3
    assert unlike(one, other, twin) == ""
    assert "fx" in unlike(one, other, replace(twin, angle=twin.angle + np.radians(0.5)))
    (contact,) = twin.problem.contacts
    rougher = replace(twin.problem, contacts=(replace(contact, friction=pr.Coulomb(1.02 * d.mu[contact.name] + 0.01)),))
    solve_into(tmp_path / "rougher", rougher, np.inf, d.numerics)
    assert unlike(one, read(tmp_path / "rougher", rougher), twin) != ""


def test_a_half_is_half_of_the_whole(tmp_path):
    """Forces of a whole are twice those of its half; cells of the mirror image have areas."""
    d = next(d for d in (robustness.drawn("posed", 7, k) for k in range(40)) if d.kind.startswith("half"))
    (one,) = solve_stages(tmp_path / "one", d.stages, np.inf, d.numerics)
    (twin,) = d.twins
    solve_into(tmp_path / "whole", twin.problem, np.inf, d.numerics)
    whole = read(tmp_path / "whole", twin.problem)
    assert unlike(one, whole, twin) == ""
    assert unlike(one, whole, replace(twin, scale=0.5001)) != ""
    half, both = (next(iter(r.bodies.values()))["block"] for r in (one, whole))
    assert len(both.cells) == 2 * len(half.cells)
    assert checks.areas(both.cells, both.X).sum() == pytest.approx(2.0 * checks.areas(half.cells, half.X).sum())


def test_elastic_bodies_that_stay_elsewhere_are_found(tmp_path):
    """Under the same forces tools are where they were; a millionth of the size off is reported."""
    d = next(d for d in (robustness.drawn("loaded", 7, k) for k in range(60)) if d.claims)
    (record,) = solve_stages(tmp_path, d.stages, np.inf, d.numerics)
    (claim,) = d.claims
    assert claim(record) == ""
    moved = record.history["press.uy"].copy()
    moved[-1] += 1e-4
    assert "press.uy is off by" in claim(replace(record, history={**record.history, "press.uy": moved}))


@pytest.mark.parametrize("family", robustness.FAMILIES)
def test_a_family_is_drawn_by_its_seed(family):
    """The same seed and number give the same problem, others another; what is drawn can be set up and is refused nothing."""
    one = robustness.drawn(family, 3, 7)
    assert one.stages == robustness.drawn(family, 3, 7).stages
    assert one.stages != robustness.drawn(family, 4, 7).stages
    for number in range(4):
        d = robustness.drawn(family, 5, number)
        assert d.kind
        for stage in d.stages[:1]:
            system = pr.discretise(stage)
            assert {t.name: tuple(t.at) for t in system.tools} == {k: v.at for k, v in d.tools.items()}
            assert set(d.mu) == {c.name for c in stage.contacts}
            said = [*map(str, preflight(system)), *warnings_of(stage)]
            assert [a for a in said if "modulus of a metal" not in a] == []  # elastic metals that are pressed far are such


def test_outcomes_of_several_processes_are_in_order():
    """Two problems in two processes: their outcomes in the order of their numbers."""
    tally = robustness.run("wide", 2, 1, first=0, jobs=2)
    assert [(o.number, o.status) for o in tally.outcomes] == [(0, "right"), (1, "right")]


def test_the_command_runs_a_family(tmp_path):
    """``--family`` runs that family alone and leaves a row for each problem; unknown ones are refused."""
    import csv

    from typer.testing import CliRunner

    from prensa.cli import app

    runner, table = CliRunner(), tmp_path / "x.csv"
    done = runner.invoke(
        app, ["bench", "robustness", "--family", "wide", "--count", "1", "--first", "1", "--report", str(table)]
    )
    assert done.exit_code == 0, done.output
    assert "wide: 1 problems, seed 0: right 100.0%" in done.output
    (row,) = csv.DictReader(table.read_text(encoding="utf-8").splitlines())
    assert (row["family"], row["number"], row["verdict"]) == ("wide", "1", "right")
    page = tmp_path / "x.md"
    again = runner.invoke(app, ["bench", "robustness", "--from", str(table), "--report", str(page)])
    assert again.output == done.output
    assert "| wide | 0 | 1 | 100.0% | 2.5% to 100.0% | 0.0% | 0.0% | 0.0% |" in page.read_text(encoding="utf-8")
    refused = runner.invoke(app, ["bench", "robustness", "--from", str(page)])
    assert (refused.exit_code, "not a table of outcomes" in refused.output) == (2, True)
    refused = runner.invoke(app, ["bench", "fuzz", "--family", "wide"])
    assert (refused.exit_code, "are for 'robustness'" in refused.output) == (2, True)
    refused = runner.invoke(app, ["bench", "robustness", "--family", "wires"])
    assert refused.exit_code == 2
    assert "unknown family 'wires'" in refused.output
