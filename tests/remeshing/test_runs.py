"""Runs through remeshings: what ends them, what they leave behind, and that they resume bit for bit."""

from __future__ import annotations

import importlib
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError, SolveError
from prensa.mesh.mesh import boundary_edges, segments
from prensa.mesh.sizes import mismatch
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from prensa.output.history import read_history
from prensa.output.run import run
from prensa.remeshing.transfer import utilisation
from prensa.system.discretise import discretise
from prensa.system.element_sizes import size_field
from prensa.timer import Timer
from problems import ALUMINIUM, indented_billet, single_block, stroke


def indented(space: str = "axisymmetric", depth: float = 1.2, **remesh: Any) -> pr.Problem:
    """A punch of radius 3 mm with a fillet of 1 mm, pressed into a billet on a plane."""
    remeshing = pr.Remesh(size=pr.Sizes(far=1.2, near_tools=0.8, per_radius=4), **remesh)
    return indented_billet(stroke(-depth, tool="punch"), space=space, remesh=remeshing)


@pytest.mark.parametrize("space", ["axisymmetric", "plane strain"])
def test_a_punch_goes_deep_on_new_meshes(space: str) -> None:
    """No node of any increment lies inside the punch, force and support balance, the volume of the metal stays."""
    first = last = None
    remeshings = [0]
    for last in pr.solve(indented(space, when=pr.When(travel=0.5))):
        first = first or last
        body, contact = last.bodies["billet"], last.contacts["billet-punch"]
        assert contact.gap.min() > -0.02
        assert last.supports["billet.bottom"].y + -last.force("punch").y == pytest.approx(0, abs=1e-6 * last.force("punch").y)
        remeshings.append(last.remeshings)
        volume = enclosed(body.x, body.cells, space)
        assert volume == pytest.approx(enclosed(first.bodies["billet"].x, first.bodies["billet"].cells, space), rel=5e-3)
    assert last is not None and last.time == 1.0
    assert remeshings[-1] >= 2 and (np.diff(remeshings) >= 0).all()
    assert abs(last.energy["imbalance"]) < 0.01 * last.energy["external"]
    assert -last.tools["punch"].place.y == 1.2


def enclosed(x: np.ndarray, cells: np.ndarray, space: str) -> float:
    """Volume within the polygon of the outline."""
    a, b = np.moveaxis(x[segments(boundary_edges(cells))], 1, 0)
    area = 0.5 * (a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1])
    return float((area * (2 * np.pi * (a[:, 0] + b[:, 0]) / 3 if space == "axisymmetric" else 1.0)).sum())


def test_a_run_is_resumed_through_remeshings_bit_for_bit(tmp_path: Path) -> None:
    """From a checkpoint before one and after another: the same increments to the last bit."""
    case = pr.Case(indented(depth=0.5, when=pr.When(travel=0.15)))
    whole = list(pr.solve(case.problem))
    meshes = [i.remeshings for i in whole]
    assert meshes[-1] >= 3
    for stop in (meshes.index(1), meshes.index(2) + 1):
        path = write_checkpoint(tmp_path / f"{stop}.h5", case, whole[stop].state)
        _, state = read_checkpoint(path)
        again = list(pr.solve(case.problem, start=state))
        assert [i.number for i in again] == [i.number for i in whole[stop + 1 :]]
        assert again[-1].remeshings == meshes[-1]
        for a, b in zip(again, whole[stop + 1 :]):
            assert a.force("punch") == b.force("punch")
            assert np.array_equal(a.state.u, b.state.u)


def test_an_increment_that_fails_is_tried_on_a_new_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where it fails again on finer ones, the run ends and says so."""
    from prensa.solver import time_stepping
    from prensa.system.failure import Stagnated

    problem = indented(depth=0.2, when=pr.When(quality=0.0, travel=100.0))
    plain, tried = time_stepping.TimeStepping.attempt, []

    def attempt(self: Any, c: Any, start: Any, was_cut: bool, uncut: bool = False) -> Any:
        result = plain(self, c, start, was_cut, uncut)
        if c.state.clock.number == 5 and (c.state.remeshed is None or c.state.remeshed.count < fails):
            tried.append(c.state.remeshed and c.state.remeshed.count)
            result.converged, result.reason = False, Stagnated(1.0)
        return result

    monkeypatch.setattr(time_stepping.TimeStepping, "attempt", attempt)
    fails = 2
    increments = list(pr.solve(problem))
    assert increments[-1].time == 1.0 and increments[-1].remeshings == 2
    assert [i.remeshings for i in increments[4:6]] == [min(increments[4].remeshings, 1), 2]
    fails = 99
    with pytest.raises(SolveError, match="New meshes have not helped"):
        list(pr.solve(problem))


def test_no_more_meshes_than_allowed(caplog: pytest.LogCaptureFixture) -> None:
    """Then the run goes on with the last one, and says so."""
    problem = indented(depth=0.3, when=pr.When(travel=0.08), at_most=2)
    assert [i.remeshings for i in pr.solve(problem)][-1] == 2
    assert sum("no more are allowed" in r.getMessage() for r in caplog.records) == 1


def upset(**when: Any) -> pr.Problem:
    """A billet between smooth flat dies: its elements stay good for long."""
    return single_block(
        stroke(-2.6, tool="die"), tools={"die": pr.Plane(touching="billet.top")}, material=ALUMINIUM, size=(6.0, 6.0),
        n=(5, 5), element="t6", body="billet", space="axisymmetric",
        remesh=pr.Remesh(pr.Sizes(far=1.2, near_tools=0.5), pr.When(**when)),
    )  # fmt: skip


def test_travel_alone_makes_no_mesh_that_is_no_better(caplog: pytest.LogCaptureFixture) -> None:
    """Where shapes and sizes are still right. A number for the way is kept to."""
    caplog.set_level("INFO", logger="prensa")
    for travel, meshes in (("auto", 2), (1.25, 3)):
        done = list(pr.solve(upset(travel=travel)))
        made = np.flatnonzero(np.diff([i.remeshings for i in done]))
        assert done[-1].remeshings == meshes
        if travel == 1.25:
            assert [-done[k].tools["die"].place.y for k in made] == pytest.approx([1.25, 2.5], abs=0.1)
    assert "remeshing 2 (travel 2.5, shape measure 0.5" in caplog.text


def test_sizes_that_are_not_those_asked_for() -> None:
    """Share of the elements that are missing, and those there are over those asked for."""
    system = discretise(upset())

    def of(far: float) -> tuple[float, float]:
        sizes = pr.Sizes(far=far, near_tools=far, across=1.0, per_strain=0.0)
        return mismatch(size_field(system, system.initial(), "billet", sizes, 36.0))

    missing, ratio = of(0.5)
    assert missing == 1.0 and ratio == pytest.approx(50 * np.sqrt(3) / 4 * 0.5**2 / 36.0, rel=1e-12)
    missing, ratio = of(5.0)
    assert missing == 0.0 and ratio > 5.0


def test_stresses_at_the_end_of_increments_on_new_meshes_do_not_exceed_yield() -> None:
    """Those carried over may, between the increments."""
    made = 0
    for i in pr.solve(indented(depth=0.5, when=pr.When(travel=0.15))):
        made = max(made, i.remeshings)
        block = discretise(indented()).blocks[0]
        assert utilisation(block.law, i.state.history[0]).max() < 1 + 1e-8
    assert made >= 3


def test_seconds_of_a_section_within_another_are_the_outer_ones() -> None:
    """So that sections add up to the whole."""
    ticks = iter(range(100))
    timer = Timer(lambda: float(next(ticks)))
    with timer("remeshing"), timer("assembly"):
        pass
    with timer("assembly"):
        pass
    assert timer.seconds == {"remeshing": 1.0, "assembly": 1.0}


def test_files_of_a_run(tmp_path: Path) -> None:
    """The column ``remeshings``, the meshes in the field files, the log and the summary."""
    import meshio

    problem = indented(depth=0.3, when=pr.When(travel=0.1))
    case = pr.Case(problem, output=pr.Output(pictures=False, report=False))
    result = run(case, tmp_path / "run", quiet=True)
    table = read_history(result.directory)["remeshings"]
    assert table[0] == 1 and table[-1] >= 2
    elements = {len(meshio.read(p).cells[0].data) for p in sorted((result.directory / "fields").glob("*.vtu"))}
    assert len(elements) >= 2 and result.summary["bodies"]["billet"]["elements"] in elements
    assert "remeshing 1 (the first mesh is too coarse)" in (result.directory / "run.log").read_text(encoding="utf-8")


def test_the_mesher_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything is solved, with what to install."""
    plain = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *a: None if name == "mmgpy" else plain(name, *a))
    with pytest.raises(PrensaError, match=r"pip install 'prensa\[remesh\]'"):
        next(iter(islice(pr.solve(indented()), 1)))


REFUSED = {
    "kinematics": ({"kinematics": "small"}, "small strain keeps the initial shape"),
    "plane stress": ({"space": "plane stress"}, "thickness of plane stress"),
    "elastic": (
        {"bodies": {"billet": pr.Body(pr.Rectangle(size=(6.0, 6.0), n=(2, 2)), pr.Elastic(E=1.0, nu=0.3), "t6")}},
        "no body flows plastically",
    ),
    "element": (
        {"bodies": {"billet": pr.Body(pr.Rectangle(size=(6.0, 6.0), n=(2, 2)), ALUMINIUM, "q8")}},
        "new meshes are of 't6', triangles; 'q8' is not: leave the element out",
    ),
    "ties": (
        {"ties": (pr.Tie("billet.top", "other.bottom"),),
         "bodies": {"billet": pr.Body(pr.Rectangle(size=(6.0, 6.0), n=(2, 2)), ALUMINIUM, "t6"),
                    "other": pr.Body(pr.Rectangle(size=(6.0, 6.0), n=(2, 2), origin=(0.0, 6.0)), ALUMINIUM, "t6")}},
        "tied sides are not transferred to new meshes; make one body of the tied ones",
    ),
    "control": (
        {"steps": (pr.Step("press", control={"punch": pr.Motion(y=-1.0)}, push={"punch": pr.Push(y=-1.0)}),)},
        "the factor of 'control' is not transferred to new meshes; move the tool",
    ),
    "integration": (
        {"contacts": (pr.Contact("billet.top", "punch", integration="kikuchi"),)}, "have 'integration: nodal'",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_remeshed_is_refused(what: str) -> None:
    """In words, with the remedy."""
    change, words = REFUSED[what]
    with pytest.raises(pr.CaseError, match=words):
        replace(indented(), **change)


@pytest.mark.parametrize(
    "driven",
    [
        {"move": {"die": pr.Motion(y=-0.4)}},
        {"move": {"die": pr.Motion(y=-0.4)}, "increments": 9},
        {"push": {"die": pr.Push(y=-15e3)}},
        {"velocity": {"die": pr.Motion(y=((0.0, -0.8), (1.0, 0.0)))}},
    ],
    ids=["moved", "increments", "pushed", "slowing down"],
)
def test_an_increment_ends_where_the_way_of_a_mesh_is_gone(driven: dict[str, Any]) -> None:
    """Of a tool that is driven by force within a hundredth of it: what is nearer is not worth another solution."""
    problem = replace(upset(quality=0.0, travel=0.15), steps=(pr.Step("press", duration=1.0, **driven),))
    done = list(pr.solve(problem))
    assert done[-1].time == 1.0
    made = np.flatnonzero(np.diff([i.remeshings for i in done]))
    ways = np.diff([0.0, *(-done[k].tools["die"].place.y for k in made)])
    assert len(ways) >= 2
    assert ways == pytest.approx(0.15, rel=1.1e-2 if "push" in driven else 1e-9)
