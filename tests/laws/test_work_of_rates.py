"""The plastic work of metals whose flow stress depends on the strain rate."""

from __future__ import annotations

import pytest

import prensa as pr

FAST = pr.JohnsonCook(A=300.0, B=200.0, n=0.3, C=0.3, rate0=1.0)

SPACES = [
    ("plane strain", "finite"), ("axisymmetric", "finite"), ("solid", "finite"), ("plane strain", "small"),
    ("plane stress", "small"),
]  # fmt: skip


def missed(space: str, kinematics: str, rule: str, increments: int) -> float:
    """Share of the work of a plate that the energy balance misses after it has flattened a billet at a rate of 1000/s."""
    solid = space == "solid"
    size, n = ((1.0, 1.0, 1.0), (1, 1, 1)) if solid else ((1.0, 1.0), (1, 1))
    depth = 0.2 if kinematics == "finite" else 0.08
    step = pr.Step("press", move={"t": pr.Motion(y=-depth)}, increments=increments, duration=2e-4)
    problem = pr.Problem(
        "billet", space=space, kinematics=kinematics,
        bodies={"b": pr.Body(pr.Box(size, n) if solid else pr.Rectangle(size, n), pr.J2(200e3, 0.3, FAST))},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),), steps=(step,),
        fixed={"b.bottom": "y", "b.left": "x"} | ({"b.back": "z"} if solid else {}),
    )  # fmt: skip
    *_, last = pr.solve(problem, pr.Numerics(time_rule=rule))
    return abs(last.energy["imbalance"]) / last.energy["external"]


@pytest.mark.parametrize("rule", ["backward_euler", "bdf2"])
@pytest.mark.parametrize(("space", "kinematics"), SPACES)
def test_the_energy_balance_closes_with_shorter_increments(space: str, kinematics: str, rule: str) -> None:
    """What it misses is of the first yield and of trapezoids; by the flow stress at rest 30 to 44 % stayed."""
    coarse, fine = (missed(space, kinematics, rule, k) for k in (10, 40))
    assert fine < 0.3 * coarse
    assert fine < 0.01
