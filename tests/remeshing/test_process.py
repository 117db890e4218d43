"""Processes whose bodies are remeshed: ends of steps, driven tools, springback, in both spaces and through a resume."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from problems import indented_billet

FORCE = {"axisymmetric": 7000.0, "plane strain": 450.0}
SPACES = pytest.mark.parametrize("space", FORCE)


def indented(space: str, *steps: pr.Step, **more: Any) -> pr.Problem:
    """New meshes whenever the punch has moved by a tenth of its fillet."""
    remesh = pr.Remesh(size=pr.Sizes(far=1.2, near_tools=0.8, per_radius=4), when=pr.When(travel=0.12))
    return indented_billet(*steps, space=space, remesh=remesh, **more)


def press(depth: float = 1.2, until: pr.Until | None = None, **more: Any) -> pr.Step:
    return pr.Step("press", by={"punch": pr.Motion(y=-depth)}, until=until, **more)


def to_the_end(problem: pr.Problem) -> list[pr.Increment]:
    """Every increment of a run through two remeshings at least, whose tool and base are in balance."""
    done = list(pr.solve(problem))
    assert done[-1].remeshings >= 2
    removed = {s.name for s in problem.steps if s.remove_tools}
    for i in done:
        if i.step in removed:
            continue
        assert i.supports["billet.bottom"].y == pytest.approx(i.force("punch").y, abs=1e-6 * FORCE[problem.space])
    return done


@pytest.mark.parametrize(
    ("space", "criterion"),
    [("axisymmetric", "force"), ("plane strain", "force"), ("axisymmetric", "travel"), ("plane strain", "measure"),
     ("plane strain", "contact")],
)  # fmt: skip
def test_what_ends_a_step_is_met_on_new_meshes(space: str, criterion: str) -> None:
    """To 1e-8, and the next step goes from there by its own way."""
    force = FORCE[space]
    until = {
        "force": pr.Until(force={"punch": pr.ToolForce(y=force)}, required=True),
        "travel": pr.Until(travel={"punch": pr.ToolTravel(y=-0.31)}, required=True),
        "measure": pr.Until(measure={"punch.uy": -0.31}, required=True),
        "contact": pr.Until(contact={"punch": "leaves"}, required=True),
    }[criterion]
    steps = [press(until=until), pr.Step("on", by={"punch": pr.Motion(y=-0.05)})]
    if criterion == "contact":
        steps = [press(0.4), pr.Step("lift", by={"punch": pr.Motion(y=0.5)}, until=until)]
    done = to_the_end(indented(space, *steps))
    ends = [i for i in done if i.end_of_step]
    if criterion == "force":
        assert ends[0].force("punch").y == pytest.approx(force, rel=1e-8)
    elif criterion == "contact":
        assert ends[1].stopped and ends[1].force("punch").y == pytest.approx(0.0, abs=1e-6 * force)
    else:
        assert ends[0].tools["punch"].place.y == pytest.approx(-0.31, rel=1e-8)
    if criterion != "contact":
        way = ends[1].tools["punch"].place.y - ends[0].tools["punch"].place.y
        assert way == pytest.approx(-0.05, rel=1e-12)


def test_pushed_and_spring_mounted_tools_on_new_meshes() -> None:
    """A force is held exactly; a spring carries stiffness times what the mount is ahead of the tool; both as when moved."""
    space, force = "plane strain", FORCE["plane strain"]
    pushed = to_the_end(indented(space, pr.Step("press", push={"punch": pr.Push(y=-force)})))[-1]
    assert pushed.force("punch").y == pytest.approx(force, rel=1e-8)
    moved = to_the_end(indented(space, press(until=pr.Until(force={"punch": pr.ToolForce(y=force)}))))[-1]
    assert pushed.tools["punch"].place.y == pytest.approx(moved.tools["punch"].place.y, rel=0.03)
    stiffness = 20.0 * force
    sprung = to_the_end(indented(space, press(0.5), spring=pr.Springs(y=stiffness)))[-1]
    place = sprung.tools["punch"].place.y
    assert sprung.force("punch").y == pytest.approx(stiffness * (place + 0.5), rel=1e-8)


@SPACES
def test_springback_from_a_new_mesh(space: str) -> None:
    """Removed tools leave nothing behind: the base bears nothing, and a tool that leaves by itself leaves the same shape."""
    free = {"fixed": {"billet.bottom": pr.Fixed(free=True)}}
    shapes = []
    for last in (
        pr.Step("release", remove_tools=True, **free),
        pr.Step("release", by={"punch": pr.Motion(y=0.5)}),
    ):
        done = to_the_end(indented(space, press(0.4), last, pr.Step("rest")))
        shapes.append(done[-1].bodies["billet"])
        assert abs(done[-1].supports["billet.bottom"].y) <= 1e-8 * FORCE[space]
        assert done[-1].remeshings == next(i for i in done if i.step == "release").remeshings or not last.remove_tools
    for axis in (0, 1):
        assert np.ptp(shapes[0].x[:, axis]) == pytest.approx(np.ptp(shapes[1].x[:, axis]), rel=2e-3)


def test_processes_are_resumed_bit_for_bit(tmp_path: Path) -> None:
    """From before a remeshing, from after an early end and from within the release of the tools."""
    until = pr.Until(force={"punch": pr.ToolForce(y=300.0)})
    steps = (press(until=until), pr.Step("on", by={"punch": pr.Motion(y=-0.15)}), pr.Step("release", remove_tools=True))
    case = pr.Case(indented("plane strain", *steps))
    whole = list(pr.solve(case.problem))
    assert whole[-1].remeshings >= 2
    changed = next(k for k, (a, b) in enumerate(itertools.pairwise(whole)) if b.remeshings > max(a.remeshings, 1))
    ended = next(k for k, i in enumerate(whole) if i.stopped)
    within = next(k for k, i in enumerate(whole) if i.step == "release") + 1
    for stop in (changed, ended, within):
        path = write_checkpoint(tmp_path / f"{stop}.h5", case, whole[stop].state)
        again = list(pr.solve(case.problem, start=read_checkpoint(path)[1]))
        assert [i.number for i in again] == [i.number for i in whole[stop + 1 :]]
        assert all(np.array_equal(a.state.u, b.state.u) for a, b in zip(again, whole[stop + 1 :]))
