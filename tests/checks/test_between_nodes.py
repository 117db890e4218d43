"""Tools whose edges or fillets are finer than the elements dip into a surface between its nodes: seen by geometry."""

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.after.between_nodes import NEVER_ASKED, BetweenNodes, Dip, Right
from prensa.checks.before.preflight import preflight
from prensa.solver import finer_contact
from prensa_bench.punches import FINENESS, answer, draw, verdict
from problems import pressed_block, stroke


def wedge(fillet, place, depth, length):
    """A blunt wedge with a small fillet at its tip, pressed into a block of elements of a ``length`` at x = ``place``."""
    points = ((0.0, 0.0), (4.0, 2.0), (4.0, 9.0), (-4.0, 9.0), (-4.0, 2.0))
    mesh = pr.Rectangle((12.0, 4.0), n=(round(12 / length), round(4 / length)))
    return pr.Problem(
        "wedge", bodies={"block": pr.Body(mesh, pr.Elastic(1000.0, 0.3))},
        tools={"tip": pr.Polygon(points=points, fillet=fillet, at=(place, 4.0))},
        fixed={"block.bottom": "xy"}, steps=[pr.Step("press", move={"tip": {"y": -depth}}, increments=4)],
    )  # fmt: skip


def said(problem, caplog):
    """What is reported of a run about edges between nodes; its failure too."""
    caplog.clear()
    try:
        list(pr.solve(problem))
    except pr.SolveError as error:
        return [str(error)]
    return [words for words in caplog.messages if "between nodes" in words]


@pytest.mark.parametrize("seed", range(10))
def test_a_tip_between_nodes_is_reported_where_it_is_a_tenth_of_an_edge_deep(seed, caplog):
    """No node is touched; at eighths of the edge, beside the tip, the flanks are higher by a thirty-second of it."""
    rng = np.random.default_rng(seed)
    place, fillet = 6.0 + float(rng.uniform(0.35, 0.65)), float(rng.uniform(0.02, 0.1))
    # the fillet of two flanks at ±atan(1/2) ends by R (1/cos − 1) above the corner
    blunt = fillet * (np.hypot(1.0, 0.5) - 1.0)
    short, deep = 0.08, 0.16
    assert not said(wedge(fillet, place, blunt + short, 1.0), caplog)
    (words,) = said(wedge(fillet, place, blunt + deep, 1.0), caplog)
    assert "tool 'tip' lies more than 0.1 inside 'block' between nodes" in words


def test_a_needle_is_found_behind_the_edge_though_it_is_thin(caplog):
    """No place in it is deeper than half its width."""
    problem = pr.Problem(
        "needle", bodies={"block": pr.Body(pr.Rectangle((12.0, 8.0), n=(6, 4)), pr.Elastic(1000.0, 0.3))},
        tools={"tip": pr.Polygon(points=((7.0, 8.0), (7.3, 20.0), (6.7, 20.0)), fillet=0.05, at=(0.0, 0.0))},
        fixed={"block.bottom": "xy"}, steps=[pr.Step("press", move={"tip": {"y": -3.0}}, increments=6)],
    )  # fmt: skip
    (words,) = said(problem, caplog)
    assert "lies more than 0.2 inside 'block' between nodes" in words


def test_round_tools_of_elements_that_find_them_are_silent(caplog):
    """On elements of a quarter of its radius the force is within 1 % of that on finer ones, on those of a half it is not."""
    problem = pr.Problem(
        "roll", bodies={"block": pr.Body(pr.Rectangle((12.0, 4.0), n=(24, 8)), pr.Elastic(1000.0, 0.3))},
        tools={"roll": pr.Circle(radius=2.0, at=(6.5, 6.0))}, fixed={"block.bottom": "xy"},
        steps=[pr.Step("press", move={"roll": {"y": -0.6}}, increments=4)],
    )  # fmt: skip
    assert not said(problem, caplog)


def estimated(said):
    """The share of the force that a run says to miss."""
    (words,) = [line for line in said if "by an estimated" in line]
    return float(words.split("by an estimated ")[1].split(" %")[0]) / 100.0


@pytest.mark.parametrize(("radius", "depth", "aside"), [(2.5, 0.22, 0.3), (8.5, 0.03, 0.4), (1.5, 0.15, 0.15)])
def test_the_force_that_is_missed_between_nodes_is_estimated(radius, depth, aside):
    """Rolls on one or two nodes: what a mesh four times as fine has more, within a factor of two."""
    forces = []
    for finer in (1, FINENESS[0]):
        problem = pr.Problem(
            "roll", bodies={"block": pr.Body(pr.Rectangle((12.0, 8.0), n=(12 * finer, 8 * finer)), pr.Elastic(1000.0, 0.3))},
            tools={"punch": pr.Circle(radius=radius, at=(6.0 + aside, 8.0 + radius))}, fixed={"block.bottom": "xy"},
            steps=[pr.Step("press", move={"punch": {"y": -depth}}, increments=4)],
        )  # fmt: skip
        forces.append(answer(problem))
    (force, said), (right, _) = forces
    missed = 1.0 - force / right
    assert missed > 0.05
    assert 0.5 * missed <= estimated(said) <= 2.0 * missed


# of seed 5: rounded punches, wedges, rolls and tilted blocks that are off by more than 5 %; sharp punches and others that are not
OFF = (1, 16, 76, 17, 52, 18, 43, 58, 14, 74)
GOOD = (0, 30, 35, 96, 12, 92, 13, 33, 88, 99)


@pytest.mark.parametrize(
    "number", [pytest.param(n, marks=[] if n == OFF[0] else [pytest.mark.slow]) for n in (*OFF, *GOOD)]
)
def test_random_punches_are_right_or_said_to_be_off(number):
    """Within 5 % of a mesh four times as fine and silent, or the cause is named."""
    found, error, said = verdict(draw(5, number))
    assert found == ("reported" if number in OFF else "right"), (error, said)


def test_a_force_that_other_increments_change_is_the_one_that_is_judged():
    """A wedge whose elements give 3 % more in one increment than in the run's six: the run's force is off by 7.5 %."""
    found, error, said = verdict(draw(91002, 12))
    assert found == "reported" and error < -0.05
    force, right = (answer(draw(91002, 12).problem(finer))[0] for finer in (1, FINENESS[0]))
    assert estimated(said) == pytest.approx(1.0 - force / right, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("number", [24, 59])
def test_forces_that_are_too_large_are_reported_too(number):
    """A node on the fillet of a tilted block presses for edges beside it that the block does not reach."""
    found, error, said = verdict(draw(4242, number))
    assert found == "reported" and error > 0.05
    assert any("forces are too large, by an estimated" in words for words in said)


@pytest.mark.slow
@pytest.mark.parametrize("number", [55, pytest.param(50, marks=pytest.mark.slow)])
def test_sharp_stamps_that_coarse_metal_carries_too_well_are_reported(number):
    """On two to four nodes; forces of others, 0, 30 and 35 of `GOOD`, are right, and nothing is said."""
    found, error, said = verdict(draw(9071, number))
    assert found == "reported" and error > 0.05
    assert estimated(said) == pytest.approx(error, abs=0.03)
    assert "too large" in " ".join(said)


def deep(n):
    """A roll on two elements in the middle of a body of n (2,) elements of length 1."""
    mesh = pr.Rectangle((float(n[0]), float(n[1])), n=n)
    return pr.Problem(
        "roll", bodies={"block": pr.Body(mesh, pr.Elastic(1000.0, 0.3))}, fixed={"block.bottom": "xy"},
        tools={"punch": pr.Circle(radius=3.0, at=(n[0] / 2 + 0.3, n[1] + 3.0))}, contacts=(pr.Contact("block.top", "punch"),),
        steps=[pr.Step("press", move={"punch": {"y": -0.25}}, increments=1)],
    )  # fmt: skip


def test_the_part_around_a_contact_stands_for_a_body_of_any_size():
    """What finer elements add is that of the whole on finer ones, where the part is all of it and where it is a quarter."""
    for n in ((12, 6), (32, 24)):
        _, said = answer(deep(n))
        finer = replace(deep(n), bodies={"block": replace(deep(n).bodies["block"], mesh=pr.Rectangle(n, n=(4 * n[0], 4 * n[1])))})
        missed = 1.0 - answer(deep(n))[0] / answer(finer)[0]
        assert estimated(said) == pytest.approx(missed, abs=0.006)


@pytest.mark.parametrize(
    ("material", "way"),
    [(pr.Elastic(2e5, 0.3), 1.0), pytest.param(pr.J2(2e5, 0.3, pr.Linear(300.0, 1000.0)), 6.0, marks=pytest.mark.slow)],
)
def test_the_force_that_bends_a_sheet_is_not_decided_by_what_lies_between_its_nodes(material, way, caplog):
    """One node under a roll: elements half as long have the same force, though between its ends the sheet is hard to press."""
    forces = []
    for finer in (1, 2):
        caplog.clear()
        problem = pr.Problem(
            "bend", bodies={"s": pr.Body(pr.Rectangle((40.0, 1.0), n=(40 * finer, 2 * finer)), material, "q4_enhanced")},
            tools={"punch": pr.Circle(radius=2.0, at=(0.3, 3.0)), "support": pr.Circle(radius=2.0, at=(30.3, -2.0))},
            friction=pr.Coulomb(0.1), fixed={"s.left": "x"}, steps=[pr.Step("bend", move={"punch": {"y": -way}})],
        )  # fmt: skip
        forces.append([*pr.solve(problem)][-1].force("punch").y)
        assert "by an estimated" not in caplog.text
    assert forces[0] == pytest.approx(forces[1], rel=0.05)


def test_a_hollow_side_on_its_pulley_is_silent(caplog):
    """A few chords of a shoe that goes along a drum lie in it, though the shoe itself does not."""
    problem = pr.Problem(
        "shoe", bodies={"shoe": pr.Body(pr.Annulus(10.0, 14.0, (6, 3), angles=(0.8, 2.3)), pr.Elastic(1000.0, 0.3))},
        tools={"drum": pr.Circle(radius=10.0, at=(0.0, 0.0))}, contacts=(pr.Contact("shoe.inner", "drum"),),
        steps=[pr.Step("press", fixed={"shoe.outer": pr.Fixed(y=-0.1)}, increments=2)], fixed={"shoe.outer": "x"},
    )  # fmt: skip
    assert not said(problem, caplog)


def ramp(fillet):
    """A stiff block whose edge is driven into a ramp of elements 0.7 long."""
    corners = ((8.0, 2.0), (14.0, 2.0), (14.0, 8.0), (8.0, 8.0))
    mesh = pr.Patch(corners=((0, 0), (10, 0), (10, 1), (0, 4)), n=(12, 4))
    return pr.Problem(
        "ramp", bodies={"ramp": pr.Body(mesh, pr.Elastic(1000.0, 0.3))},
        tools={"block": pr.Polygon(points=corners, fillet=fillet, at=(0.0, 0.0))}, fixed={"ramp.bottom": "xy"},
        steps=[pr.Step("slide", move={"block": {"x": -1.8}}, increments=3)],
    )  # fmt: skip


@pytest.mark.parametrize(("fillet", "found"), [(0.1, True), (1.5, False)])
def test_an_edge_that_goes_in_between_nodes_is_found_before_the_run(fillet, found):
    """A small one meets no node of the undeformed ramp; one that meets nodes is left to the run."""
    said = [str(finding) for finding in preflight(pr.discretise(ramp(fillet)))]
    assert any("inside 'ramp' between nodes" in words and "no force acts" in words for words in said) == found


def test_sizes_that_a_run_judges_are_no_warnings_of_it(caplog):
    """A roll of less than two elements is a finding of a check; its run says what the force is off, or nothing."""
    problem = deep((12, 6))
    narrow = replace(problem, tools={"punch": pr.Circle(radius=1.9, at=(6.3, 7.9))})
    assert any("less than two elements" in str(f) and f.seen_in_run for f in preflight(pr.discretise(narrow)))
    list(pr.solve(narrow))
    assert not [w for w in caplog.messages if "less than two elements" in w]
    assert [w for w in caplog.messages if "by an estimated" in w]


def test_an_edge_that_goes_in_between_nodes_is_not_said_to_go_away():
    """A block pushed into a ramp: the gaps of all nodes grow, and geometry sees that it presses: one finding, of the edge."""
    for travel, words in ((-1.8, "between nodes"), (1.8, "never touches")):
        problem = replace(ramp(0.1), steps=(pr.Step("slide", move={"block": {"x": travel}}, increments=18),))
        said = [str(finding) for finding in preflight(pr.discretise(problem)) if "block" in str(finding)]
        assert len(said) == 1 and words in said[0], said


def test_tools_at_rest_are_not_named_where_the_moved_one_goes_away():
    """A punch that is pulled off a billet on an anvil: the punch's sign is wrong, nothing is of the anvil."""
    problem = pr.Problem(
        "upset", {"billet": pr.Body(pr.Rectangle((15.0, 40.0), (4, 8)), pr.Elastic(1000.0, 0.3))}, space="axisymmetric",
        tools={"punch": pr.Plane(touching="billet.top"), "anvil": pr.Plane(touching="billet.bottom", normal=(0, 1))},
        steps=[pr.Step("press", move={"punch": {"y": 20.0}})],
    )  # fmt: skip
    (said,) = [str(finding) for finding in preflight(pr.discretise(problem)) if "never presses" in str(finding)]
    assert "tools.punch: tool 'punch' touches 'billet' at first and only goes away" in said


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "number", "missed"), [(4711, 24, 0.682), (4712, 49, 0.759)])
def test_a_share_is_of_the_force_along_the_way_of_the_tool(seed, number, missed):
    """A node on the corner of a tilted punch is pushed aside: what it lacks along its way of a mesh four times as fine."""
    _, said = answer(draw(seed, number).problem())
    assert estimated(said) == pytest.approx(missed, abs=0.02)


def test_an_edge_between_nodes_is_said_once_and_nothing_against_it(caplog):
    """It comes to the ramp and goes in: it does not go away, nor has it never touched, nor is a force too small that is none."""
    (finding,) = preflight(pr.discretise(ramp(0.1)))
    assert "between nodes" in finding.message and "no force acts" in finding.message
    caplog.clear()
    *_, last = pr.solve(ramp(0.1))
    assert last.force("block").y == 0.0
    (words,) = [words for words in caplog.messages if "block" in words]
    assert "between nodes" in words and "no force acts" in words


def test_a_tool_that_comes_to_touch_has_not_never_touched(caplog):
    """A plane that ends where the body begins presses nothing, and one that stays away never touches."""
    for way, words in ((1.0, "touched 'block' and never pressed"), (0.5, "never touched 'block'")):
        problem = pr.Problem(
            "block", bodies={"block": pr.Body(pr.Rectangle((4.0, 3.0), n=(4, 3)), pr.Elastic(1000.0, 0.3))},
            tools={"top": pr.Plane(at=(0.0, 4.0), normal=(0.0, -1.0))}, fixed={"block.bottom": "xy"},
            steps=[pr.Step("come", move={"top": {"y": -way}}, increments=2)],
        )  # fmt: skip
        (finding,) = preflight(pr.discretise(problem))
        assert ("comes to touch" if way == 1.0 else "never touches") in finding.message
        caplog.clear()
        list(pr.solve(problem))
        assert [w for w in caplog.messages if words in w]


def test_a_force_found_right_is_looked_at_again_where_that_may_change() -> None:
    """Where dips grow so far that the larger of both shares is worth saying, or one of them is notable by itself."""
    dip = Dip(np.arange(2), 1.0)
    dips, finer = Right(0.02, 0.0), Right(0.01, 0.04)
    assert dips.covers(0.049, None) and not dips.covers(0.051, None)
    assert finer.covers(0.0124, None) and not finer.covers(0.0126, None)
    assert dips.covers(0.02, dip) and not dips.covers(0.021, dip)
    assert Right(0.06, 0.0).covers(0.06, None) and not Right(0.06, 0.0).covers(0.061, None)
    assert Right(0.0, 0.01).covers(0.0, None) and not Right(0.0, 0.01).covers(0.001, None)
    assert not NEVER_ASKED.covers(0.0, None)


@pytest.mark.parametrize(
    ("material", "asked"), [(pr.Elastic(1000.0, 0.3), 6), (pr.J2(1000.0, 0.3, pr.Linear(5.0, 20.0)), None)]
)
def test_finer_elements_go_the_way_of_the_same_increments(material, asked, monkeypatch) -> None:
    """Of elastic bodies in one increment a step, whatever the run is asked for; of metal in as many as its own elements took."""
    taken, solved = [], finer_contact._solved

    def watched(problem, *args, **kwargs):
        out = solved(problem, *args, **kwargs)
        taken.append(([step.increments for step in problem.steps], out.increments))
        return out

    monkeypatch.setattr(finer_contact, "_solved", watched)
    (step,) = deep((12, 6)).steps
    bodies = {"block": replace(deep((12, 6)).bodies["block"], material=material)}
    list(pr.solve(replace(deep((12, 6)), bodies=bodies, steps=(replace(step, increments=asked),))))
    (own, count), *_, (fine, _) = taken
    assert (own, fine) == (([1], [1]) if asked else ([None], count))
    assert asked or count[0] > 1


def test_planes_are_not_looked_at_between_nodes() -> None:
    """They are nowhere deeper there than at the ends of an edge; rolls are."""
    for tool, looked in ((pr.Plane(touching="b.top"), 0), (pr.Circle(radius=3.0, touching="b.top"), 1)):
        system = pr.discretise(pressed_block(stroke(-0.1), tools={"t": tool}))
        assert len(BetweenNodes(system).contacts) == looked


def test_edges_of_a_tool_on_many_nodes_in_space_are_reported(caplog):
    """A square punch with its edges over nodes, 17 of which carry it: most are at its rim; half of the force is missed."""
    punch = pr.Polyhedron(points=tuple((x, y, z) for x in (-2.0, 2.0) for y in (0.0, 3.0) for z in (-2.0, 2.0)), touching="b.top")
    problem = pr.Problem(
        "punch", space="solid", friction=pr.Coulomb(0.15),
        bodies={"b": pr.Body(pr.Box((8.0, 4.0, 8.0), (8, 4, 8), (-4.0, 0.0, -4.0)), pr.Elastic(10e3, 0.3))},
        tools={"t": punch}, contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "xyz"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.2)}, increments=2),),
    )  # fmt: skip
    *_, last = pr.solve(problem)
    assert (next(iter(last.contacts.values())).pressure > 0.0).sum() > 10
    assert "forces are too small" in caplog.text
