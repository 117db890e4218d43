"""Forces of a thousandth of what any section yields under are those of another unit; forces that are small on purpose are not."""

from dataclasses import replace

import pytest

import prensa as pr
from prensa.checks.before.forces import weak
from prensa.system.discretise import discretise


def upset(press=None, step=None, **steel) -> pr.Problem:
    """A billet of 15 × 40 mm between a punch and its support."""
    material = pr.J2(200e3, 0.3, pr.Ludwik(250, 500, 0.3)) if not steel else pr.Elastic(**steel)
    return pr.Problem(
        "upset",
        space="axisymmetric",
        bodies={"billet": pr.Body(pr.Rectangle(size=(15, 40), n=(3, 8)), material)},
        tools={"punch": pr.Plane(touching="billet.top", press=press)},
        fixed={"billet.bottom": "y"},
        steps=[step or pr.Step("press", move={"punch": {"y": -1.0}})],
    )


@pytest.mark.parametrize(
    ("problem", "path"),
    [
        (upset(pr.Press(capacity=1.0)), "tools.punch.press"),
        (upset(pr.Press(capacity=1e3)), ""),
        (upset(step=pr.Step("press", push={"punch": {"y": -1.0}})), "steps.0.push.punch"),
        (upset(step=pr.Step("press", push={"punch": {"y": -1e4}})), ""),
        (
            upset(step=pr.Step("press", move={"punch": {"y": -9.0}}, until=pr.Until(force={"punch": pr.ToolForce(y=1.0)}))),
            "steps.0.until.force.punch",
        ),
        (upset(pr.Press(capacity=1.0), E=200e3, nu=0.3), ""),  # an elastic body has no force at which it yields
    ],
)
def test_forces_of_another_unit(problem, path):
    """The place of the force and the force at which the smallest section yields are said, once."""
    found = list(weak(discretise(problem)))
    assert [f.path for f in found] == ([path] if path else [])
    assert all("1 N is" in f.message and "such as '1 kN'" in f.message for f in found)


def test_a_touch_before_the_stroke_is_meant():
    """A step that ends at the first newton is no slip where the next one goes on without waiting."""
    p = upset()
    touch = pr.Step("touch", move={"punch": {"y": -9.0}}, until=pr.Until(force={"punch": pr.ToolForce(y=1.0)}))
    problem = replace(p, steps=(touch, *p.steps))
    assert not list(weak(discretise(problem)))
