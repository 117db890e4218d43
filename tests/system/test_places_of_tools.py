"""Which tools have a prescribed place at the moments at which checks before a run look at them."""

from __future__ import annotations

import pytest

import prensa as pr
from prensa.system.moments import moments, stages

STEEL = pr.J2(210e3, 0.3, pr.Swift(800.0, 0.005, 0.18))
UNTIL = pr.Until(force={"t": pr.ToolForce(y=100.0)})
LOST = pr.Step("a", by={"t": pr.Motion(y=-1.0)}, until=UNTIL)


def places(*steps: pr.Step) -> list[tuple[bool, bool, bool]]:
    """By steps, whether the place is known before their end, at it, and after them by their degrees of freedom."""
    p = pr.Problem(
        "press", space="plane strain", bodies={"b": pr.Body(pr.Rectangle((5.0, 5.0), (2, 2)), STEEL)},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "y", "b.left": "x"},
        steps=steps,
    )  # fmt: skip
    system = pr.discretise(p)
    dofs, all_moments = system.dofs.tool.dofs(0), list(moments(system))
    own = [[bool(m.known[0]) for m in all_moments if m.plan.number == k] for k in range(len(steps))]
    return [(all(known[:-1]), known[-1], bool(s.known_after[dofs].all())) for known, s in zip(own, stages(system))]


@pytest.mark.parametrize(
    ("step", "found"),
    [
        (pr.Step("b", move={"t": pr.Motion(y=-2.0)}), True),
        (pr.Step("b", by={"t": pr.Motion(y=-2.0)}), False),
        (pr.Step("b", velocity={"t": pr.Motion(y=-2.0)}), False),
        (pr.Step("b", crank={"t": pr.Crank(stroke=40.0, height=0.5)}), False),
        (pr.Step("b"), False),
        (pr.Step("b", move={"t": pr.Motion(y=-2.0)}, until=UNTIL), False),
        (pr.Step("b", move={"t": pr.Motion(y=-1.0)}, until=UNTIL), False),
    ],
)
def test_a_place_that_is_lost_is_found_at_the_end_of_a_motion_to_a_given_one(step, found):
    """Not on the way there, nor by a way, at a speed, or where the motion may end before."""
    assert places(LOST, step, pr.Step("c")) == [(False, False, False), (False, found, found), (found, found, found)]
