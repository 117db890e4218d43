"""Bodies in space along walls: what holds them against what presses them is said before a run."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight

METAL = pr.J2(210e3, 0.3, pr.Linear(300.0, 500.0))
DOWN = pr.Step("press", by={"t": pr.Motion(y=-2.0)})


def said(mu: float, step: pr.Step = DOWN, fixed: dict[str, object] | None = None, **tools: object) -> list[tuple[bool, str]]:
    """What is said of a quarter of a block between two walls under a plane, of its bending apart, and whether it is refused."""
    rub = pr.Coulomb(mu) if mu else None
    walls = {
        "w": pr.Plane(normal=(-1.0, 0.0, 0.0), at=(10.0, 0.0, 0.0)), "v": pr.Plane(normal=(0.0, 0.0, -1.0), at=(0.0, 0.0, 10.0)),
    }  # fmt: skip
    sides = {"t": "b.top", "w": "b.right", "v": "b.front", "table": "b.bottom"}
    all_of = {"t": pr.Plane(touching="b.top")} | walls | tools
    p = pr.Problem(
        "block", space="solid", bodies={"b": pr.Body(pr.Box((10.0, 5.0, 10.0), (4, 2, 4)), METAL)}, tools=all_of,
        contacts=tuple(pr.Contact(sides[name], name, rub if name in "wv" else None) for name in all_of),
        fixed={"b.left": "x", "b.back": "z"} if fixed is None else fixed, steps=(step,),
    )  # fmt: skip
    return [(f.fatal, f.message) for f in preflight(pr.discretise(p)) if f.fatal or "bends" not in f.message]


@pytest.mark.parametrize("step", [DOWN, pr.Step("press", push={"t": pr.Push(y=-1000.0)})])
def test_friction_of_walls_alone_is_named(step):
    """It is warned of; smooth walls hold nothing, and the run is refused."""
    ((fatal, words),) = said(0.1, step)
    assert not fatal and "only friction of 'w' and 'v' holds it along -y against 't'" in words
    ((fatal, words),) = said(0.0, step)
    assert fatal and ("nothing holds it, with 'w' and 'v' beside its way and smooth, along -y" in words) == (step is DOWN)


@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_what_stands_on_something_is_not(mu):
    """On a support, or a table that it touches or comes to; nor what goes with its support."""
    assert said(mu, fixed={"b.left": "x", "b.back": "z", "b.bottom": "y"}) == []
    for gap in (0.0, 0.5):
        assert said(mu, table=pr.Plane(normal=(0.0, 1.0, 0.0), at=(0.0, -gap, 0.0))) == []


def test_a_die_that_narrows_holds():
    """A cone below a container, as in extrusion; a straight one does not."""
    cone = pr.Profile(points=((5.0, 20.0), (5.0, 0.0), (4.0, -3.0), (4.0, -20.0)), fillet=(0.0, 0.3, 0.3, 0.0))
    for section, holds in ((cone, True), (pr.Profile(points=((5.0, 20.0), (5.0, -20.0))), False)):
        p = pr.Problem(
            "billet", space="solid",
            bodies={"b": pr.Body(pr.Cylinder(radius=5.0, height=8.0, n=(3, 4, 4), angle=np.pi / 2), METAL)},
            tools={"t": pr.Plane(touching="b.top"), "die": pr.Revolved(section=section, at=(0.0, -0.3, 0.0))},
            contacts=(pr.Contact("b.top", "t"), pr.Contact(("b.outer", "b.bottom"), "die", pr.Coulomb(0.1))),
            fixed={"b.base": "z", "b.cap": "x"}, steps=(pr.Step("press", by={"t": pr.Motion(y=-1.0)}),),
        )  # fmt: skip
        assert any("only friction of 'die'" in str(f) for f in preflight(pr.discretise(p))) is not holds
