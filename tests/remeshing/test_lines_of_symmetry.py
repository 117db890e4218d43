"""Free sides that come to a line of symmetry while the body is remeshed: what they meet there, on every mesh."""

from __future__ import annotations

import logging
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from problems import flattened_tube

METAL = pr.J2(1000.0, 0.3, pr.Linear(10.0, 20.0))


def tube(**more: object) -> pr.Problem:
    """A quarter of a tube, pressed flat until nothing is left of its inside."""
    return flattened_tube(
        pr.Step("flatten", by={"punch": pr.Motion(y=-4.3)}, increments=24), material=METAL, element="t6", n=(12, 2),
        remesh=pr.Remesh(pr.Sizes(far=0.6, near_tools=0.6, per_strain=0.0), pr.When(travel=1.35)), **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def flattened() -> list[pr.Increment]:
    """Increments of the tube."""
    return list(pr.solve(tube()))


def met(increments: list[pr.Increment]) -> int:
    """Number, from 0, of the first increment with planes."""
    return ["symmetry_y" in i.tools for i in increments].index(True)


def test_a_bore_that_closes_on_new_meshes_meets_its_mirror_image(flattened: list[pr.Increment]) -> None:
    """Nothing comes through the line, forces balance on every mesh, there is no friction."""
    first = met(flattened)
    assert flattened[-1].remeshings >= flattened[first].remeshings + 1
    for i in flattened[first:]:
        assert i.bodies["t"].x[:, 1].min() > -2e-3
        borne = sum(t.force.y for t in i.tools.values()) - i.supports["t.start"].y
        assert borne == pytest.approx(0.0, abs=1e-6 * abs(i.force("punch").y))
        assert i.tools["symmetry_y"].force.x == 0.0
    assert -flattened[-1].tools["symmetry_y"].force.y > 0.9 * flattened[-1].force("punch").y > 100.0


def test_it_is_what_a_plane_written_by_hand_gives(flattened: list[pr.Increment]) -> None:
    """The punch's force to 2 % once the inside lies flat, though a tool of the description asks for other sizes of elements."""
    by_hand = list(pr.solve(tube(plane=True)))
    time, force = np.array([(i.time, i.force("punch").y) for i in by_hand]).T
    flat = [i for i in flattened if i.force("punch").y > 150.0]
    assert len(flat) >= 4
    for i in flat:
        assert i.force("punch").y == pytest.approx(np.interp(i.time, time, force), rel=0.02)


def test_nothing_that_is_not_meant_is_held(caplog: pytest.LogCaptureFixture) -> None:
    """A word in the log, once; a body that is excepted passes its line."""
    with caplog.at_level(logging.INFO, "prensa"):
        excepted = tube(no_contact=(pr.NoContact("t", "symmetry"),))
        beyond = next(i for i in pr.solve(excepted) if i.bodies["t"].x[:, 1].min() < -0.05)
    assert "symmetry_y" not in beyond.tools
    assert "line of symmetry" not in caplog.text


def test_it_resumes_bit_for_bit(flattened: list[pr.Increment], tmp_path: Path) -> None:
    """From a state before planes stood, and from one on a mesh made since, three increments each."""
    case, first = pr.Case(tube()), met(flattened)
    later = next(k for k, i in enumerate(flattened) if i.remeshings > flattened[first].remeshings)
    for stop in (first - 1, later):
        path = write_checkpoint(tmp_path / f"{stop}.h5", case, flattened[stop].state)
        again = islice(pr.solve(case.problem, start=read_checkpoint(path)[1]), 3)
        for a, b in zip(again, flattened[stop + 1 :][:3], strict=True):
            assert a.number == b.number
            assert np.array_equal(a.state.u, b.state.u)
            assert a.tools["symmetry_y"].force == b.tools["symmetry_y"].force


@pytest.mark.parametrize("moved", [
    {"by": {"b.left": pr.Motion(x=-3.0)}}, {"feed": {"b.left": pr.Feed(x=-3.0)}}, {"fixed": {"b.left": pr.Fixed(x=-3.0)}},
])  # fmt: skip
def test_a_side_that_a_later_step_moves_is_no_line_of_symmetry(moved):
    """A bar is drawn at one end while the other one carries the load: statics gives the support, however the end is moved."""
    load = pr.Step("load", loads={"b.right": pr.Load(traction=(20.0, 0.0))}, increments=1)
    p = pr.Problem(
        "bar", {"b": pr.Body(pr.Rectangle((40.0, 10.0), (8, 2)), pr.Elastic(2000.0, 0.3))},
        (load, pr.Step("draw", increments=2, **moved)), fixed={"b.left": "x", "b.bottom-left": "y"}, space="plane strain",
    )  # fmt: skip
    *_, inc = pr.solve(p)
    assert inc.supports["b.left"].x == pytest.approx(-200.0, rel=1e-6)
