"""Travels from where a thing is: ``by`` of a step, of tools and of boundaries."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.model.schema import CaseError, dump, loads
from prensa.output.run import resume, run
from prensa.system.planning import plan_step

CASE = """\
name: pressed
bodies: {b: {mesh: {type: rectangle, size: [4, 2], n: [4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {t: {type: plane, touching: b.top}}
contacts: [{surface: b.top, against: t}]
fixed: {b.bottom: y, b.left: x}
steps:
  - {name: one, move: {t: {y: -0.02}}, increments: 2}
  - {name: two, by: {t: {y: -0.01}, b.right: {x: 0.03}}, increments: 2}
  - {name: three, by: {t: {y: [[2, 0], [2.5, -0.01], [3, 0.005]]}, b.right: {x: -0.01}}, increments: 2}
  - {name: four, velocity: {t: {y: 0.001}}}
output: {pictures: false, report: false, fields: 0}
"""


HELD = CASE.replace("b.left: x}", "b.left: x, b.right: x}")


def absolute() -> pr.Problem:
    """The same travels from the initial place."""
    text = HELD.replace("by: {t: {y: -0.01}, b.right: {x: 0.03}}", "move: {t: {y: -0.03}}, fixed: {b.right: {x: 0.03}}")
    text = text.replace("by: {t: {y: [[2, 0], [2.5, -0.01], [3, 0.005]]}, b.right: {x: -0.01}}",
                        "move: {t: {y: [[2, -0.03], [2.5, -0.04], [3, -0.025]]}}, fixed: {b.right: {x: 0.02}}")  # fmt: skip
    return loads(text).problem


def test_travels_from_where_a_thing_is_are_those_from_the_initial_place():
    """Increment by increment the same places and forces, of a chain of numbers and tables, tools and supports."""
    ours, theirs = (list(pr.solve(p)) for p in (loads(HELD).problem, absolute()))
    assert len(ours) == len(theirs)
    for a, b in zip(ours, theirs):
        assert a.time == pytest.approx(b.time, abs=1e-12)
        np.testing.assert_allclose(a.tools["t"].place, b.tools["t"].place, atol=1e-14)
        np.testing.assert_allclose(a.force("t"), b.force("t"), rtol=1e-9, atol=1e-9)
    body = ours[-1].bodies["b"]
    right = body.X[:, 0] == 4.0
    np.testing.assert_allclose((body.x - body.X)[right, 0], 0.02, atol=1e-14)


def test_a_step_goes_on_from_a_place_that_only_the_answer_knows():
    """After a force the tool is where the body lets it be; ``by`` is measured from there, also of a boundary."""
    text = CASE.replace("move: {t: {y: -0.02}}", "push: {t: {y: -100}}")
    incs = [i for i in pr.solve(loads(text).problem) if i.end_of_step]
    assert incs[0].tools["t"].place.y < -0.01
    assert incs[1].tools["t"].place.y == pytest.approx(incs[0].tools["t"].place.y - 0.01, abs=1e-15)
    moved = [(i.bodies["b"].x - i.bodies["b"].X)[i.bodies["b"].X[:, 0] == 4.0, 0] for i in incs[:3]]
    assert np.ptp(moved[0]) < 1e-3 < abs(moved[0][0])
    np.testing.assert_allclose(moved[1], moved[0] + 0.03, atol=1e-14)
    np.testing.assert_allclose(moved[2], moved[1] - 0.01, atol=1e-14)


def test_turns_and_mounts_of_springs_go_on_from_where_they_are():
    """A turn adds to the one before; of a tool on a spring it is the mount that moves."""
    p = loads(CASE).problem
    steps = (
        pr.Step("a", move={"t": pr.Motion(y=-0.02, rz=0.1)}),
        pr.Step("b", by={"t": pr.Motion(y=-0.03, rz=0.2)}),
        pr.Step("c", by={"t": pr.Motion(y=((2.0, 0.0), (3.0, -0.1)))}),
    )
    for tool in (pr.Circle(2.0, touching="b.top"), pr.Circle(2.0, touching="b.top", spring=pr.Springs(y=1e3))):
        system = pr.discretise(replace(p, tools={"t": tool}, steps=steps))
        start = system.initial().u
        for number, y, rz in ((0, -0.02, 0.1), (1, -0.05, 0.3), (2, -0.15, 0.3)):
            plan = plan_step(system, number, start)
            place = dict(zip(plan.moved.tolist(), plan.motion(plan.t1).tolist()))
            first = system.tool_dof(0)
            assert place[first + 1] == pytest.approx(y)
            assert place[first + 2] == pytest.approx(rz)
            start = start.copy()
            start[plan.fixed] = plan.values(plan.t1)


def test_a_case_with_by_is_written_and_read_again():
    """What is dumped is the same case."""
    case = loads(CASE)
    assert loads(dump(case)) == case


def test_a_run_with_by_is_resumed_and_started_from(tmp_path: Path):
    """Stopped in a step that goes on from elsewhere, it ends bit for bit as if it had not; a new run goes on from there."""
    case = loads(CASE)
    whole = run(case, tmp_path / "whole", quiet=True)
    part = run(case, tmp_path / "part", quiet=True)
    incs = list(pr.solve(case.problem))
    from prensa.output import checkpoint

    text = checkpoint.case_text(case)
    checkpoint.write_checkpoint(tmp_path / "part" / checkpoint.CHECKPOINT, text, incs[2].state)
    resume(tmp_path / "part", quiet=True)
    assert part.directory.joinpath("history.csv").read_text() == whole.directory.joinpath("history.csv").read_text()
    steps = (pr.Step("on", by={"t": pr.Motion(y=0.002)}, increments=1),)
    p = replace(case.problem, steps=steps, start=pr.Start(str(whole.directory)))
    *_, last = pr.solve(p)
    assert last.tools["t"].place.y == pytest.approx(incs[-1].tools["t"].place.y + 0.002, abs=1e-15)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("by: {t: {y: -0.01}", "move: {t: {y: -1}}, by: {t: {y: -0.01}", "y of tool 't' is given by 'move' and by 'by'"),
        ("b.right: {x: 0.03}}", "b.right: {x: 0.03}}, fixed: {b.right: x}", "x of 'b.right' is given by 'fixed' and by 'by'"),
        ("b.right: {x: 0.03}", "b.rigth: {x: 0.03}", "unknown boundary 'rigth' of body 'b'; did you mean 'right'?"),
        ("b.right: {x: 0.03}", "b.right: {rz: 0.03}", "'b.right' is a boundary, which has no rotation"),
        ("by: {t: {y: -0.01}", "by: {s: {y: -0.01}", "unknown tool 's'"),
    ],
)  # fmt: skip
def test_by_and_anything_else_are_not_given_at_once(old, new, words):
    """One motion is prescribed once, by a name that exists."""
    with pytest.raises(CaseError) as error:
        loads(CASE.replace(old, new, 1))
    assert words in str(error.value)
