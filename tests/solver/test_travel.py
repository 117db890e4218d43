"""Travel of tools, and of bodies past them, in an automatic increment."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.policy import Policy
from problems import upset_block

EULER = pr.Numerics(time_rule="backward_euler")  # of second order in time tools go twice as far in an increment


def pressed(*travels, gap=0.0):
    """An elastic-plastic block under a plane at a gap, moved to each of the travels in a step of its own."""
    return upset_block(
        *(pr.Step(f"s{i}", move={"punch": pr.Motion(y=y)}) for i, y in enumerate(travels)),
        tools={"punch": pr.Plane(at=(0, 1 + gap), normal=(0, -1))},
        material=pr.J2(1000.0, 0.3, pr.Linear(10.0, 50.0)), size=(2, 1), n=(4, 2), body="block",
    )  # fmt: skip


def test_a_tool_that_has_left_the_body_is_not_held_to_the_size_of_elements():
    """It moves as far again as it is away: forty elements in some twenty increments, each within the rule."""
    increments = [i for i in pr.solve(pressed(-0.05, 20.0), EULER) if i.step == "s1"]
    gaps = np.array([float(i.contacts["block.top-punch"].gap.min()) for i in increments])
    way = np.diff([i.tools["punch"].place.y for i in increments])
    assert len(increments) < 30
    assert (way <= 1.001 * (0.3 * 0.5 + np.maximum(gaps[:-1], 0.0))).all()
    assert increments[-1].force("punch").y == pytest.approx(0.0, abs=1e-9)


def test_a_tool_that_comes_from_afar_is_slow_again_where_it_touches():
    """From twenty elements away in twenty increments: it stops at the touch, and presses as one does that stood there."""
    near = list(pr.solve(pressed(-0.2), EULER))
    far = list(pr.solve(pressed(-10.2, gap=10.0), EULER))
    assert far[-1].force("punch").y == pytest.approx(near[-1].force("punch").y, rel=1e-9)
    # 14 % of the work were missed for 0.01 by a first increment of half the stroke
    assert far[-1].energy["imbalance"] == pytest.approx(near[-1].energy["imbalance"], rel=1e-3)
    after = [i.tools["punch"].place.y for i in far if i.tools["punch"].place.y <= -10.0 + 1e-9]
    assert np.abs(np.diff(after)).max() <= 0.3 * 0.5 * 1.001
    assert len(far) - len(near) < 20


def pushed(way, gap=0.0):
    """The block of `pressed`, its base pushed up against a plane that stands at a gap."""
    plane = pressed(0.0, gap=gap)
    base = {"block.bottom": {"y": way}, "block.left": "x"}
    return replace(plane, steps=(pr.Step("s0", fixed=base),), fixed={})


@pytest.mark.parametrize("gap", [0.0, 2.0])
def test_it_does_not_matter_which_of_two_the_description_has_moved(gap):
    """A block pushed against a plane goes in the increments in which the plane is pressed on the block, with its forces."""
    problems = pressed(-0.3 - gap, gap=gap), pushed(0.3 + gap, gap=gap)
    plane, block = (list(pr.solve(problem, EULER)) for problem in problems)
    assert [i.time for i in block] == pytest.approx([i.time for i in plane], abs=1e-6)
    forces = [[i.force("punch").y for i in run] for run in (plane, block)]
    np.testing.assert_allclose(*forces, rtol=1e-5, atol=1e-9)
    assert block[-1].energy["imbalance"] == pytest.approx(plane[-1].energy["imbalance"], rel=1e-3, abs=1e-6)


def test_a_strip_that_is_drawn_lands_in_a_short_increment():
    """On a wedge that stands: the work of the force that begins within it is known, better in increments half as long."""
    problem = pr.load(Path(__file__).parents[2] / "examples" / "strip_drawing.yaml").problem
    problem = replace(problem, steps=(pr.Step("draw", fixed={"sheet.right": {"x": 1.1}}),))
    for share, most in ((1.0, 0.2), (0.5, 0.06)):  # N mm; 3.5 before, whatever the increments
        run = list(pr.solve(problem, policy=Policy(travel_in_elements=0.3 * share, plastic_strain_increment=0.01 * share)))
        assert run[-1].force("die").x > 30.0
        assert np.abs(np.diff([i.energy["imbalance"] for i in run])).max() <= most
