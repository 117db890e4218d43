"""How far tools move in an automatic increment."""

import numpy as np
import pytest

import prensa as pr

EULER = pr.Numerics(time_rule="backward_euler")  # of second order in time tools go twice as far in an increment


def pressed(*travels, gap=0.0):
    """An elastic-plastic block under a plane at a gap, moved to each of the travels in a step of its own."""
    return pr.Problem(
        "press", bodies={"block": pr.Body(pr.Rectangle(size=(2, 1), n=(4, 2)), pr.J2(1000.0, 0.3, pr.Linear(10.0, 50.0)))},
        tools={"punch": pr.Plane(at=(0, 1 + gap), normal=(0, -1))}, contacts=(pr.Contact("block.top", "punch"),),
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=tuple(pr.Step(f"s{i}", move={"punch": pr.Motion(y=y)}) for i, y in enumerate(travels)),
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
    """From twenty elements away: it stops at the touch, and presses as one does that stood there."""
    near = list(pr.solve(pressed(-0.2), EULER))
    far = list(pr.solve(pressed(-10.2, gap=10.0), EULER))
    assert far[-1].force("punch").y == pytest.approx(near[-1].force("punch").y, rel=1e-3)
    after = [i.tools["punch"].place.y for i in far if i.tools["punch"].place.y <= -10.0 + 1e-9]
    assert np.abs(np.diff(after)).max() <= 0.3 * 0.5 * 1.001
    assert len(far) < 40
