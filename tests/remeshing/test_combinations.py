"""Remeshing together with everything else that a case can ask for: it works, or is refused in words."""

from __future__ import annotations

import csv
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.output.checkpoint import read_checkpoint
from prensa.output.run import resume, run
from prensa.policy import Policy
from prensa.remeshing.driver import balanced
from prensa.remeshing.renewal import renewed
from prensa.solver.reporting import Messages
from prensa.solver.time_stepping import TimeStepping
from prensa.system.discretise import discretise, of_state
from prensa.system.state import State
from prensa.system.system import System
from prensa.timer import Timer
from prensa.verify.balance import imbalance
from problems import indented_billet

COARSE = pr.Sizes(far=1.2, near_tools=0.8, per_radius=4)
ONE = pr.Remesh(COARSE, pr.When(quality=0.0, travel=99.0))  # the first mesh, which is too coarse, alone
MANY = pr.Remesh(COARSE, pr.When(travel=0.1))
TABLES = pr.Output(pictures=False, report=False, fields=0)


def press(y: float, **more: Any) -> pr.Step:
    return pr.Step(more.pop("name", "press"), move={"punch": pr.Motion(y=y)}, **more)


def indented(*steps: pr.Step, enforcement: Any = None, **more: Any) -> pr.Problem:
    """A punch with a fillet pressed into the top of a billet that rests on a plane."""
    contacts = (pr.Contact("billet.top", "punch", enforcement=enforcement or pr.Penalty()),)
    return indented_billet(*steps, **{"contacts": contacts, "remesh": MANY} | more)


def solved(problem: pr.Problem) -> tuple[list[pr.Increment], float]:
    """Increments, and the worst imbalance of forces and moments of all of them in which there are some."""
    increments = list(pr.solve(problem))
    pressed = [i for i in increments if i.force("punch").y > 1.0]
    return increments, max(max(imbalance(of_state(problem, i.state), i)) for i in pressed)


def force(increments: list[pr.Increment], time: float) -> float:
    return float(np.interp(time, [i.time for i in increments], [i.force("punch").y for i in increments]))


# ------------------------------------------------------------------------------------------------------------ contacts
@pytest.mark.parametrize("enforcement", [pr.Exact(), pr.Augmented()], ids=lambda e: e.type)
def test_every_enforcement_is_remeshed(enforcement: Any) -> None:
    """Upsetting: forces are those of the penalty within a thousandth, no node is inside the die, forces balance."""
    die = {"tools": {"punch": pr.Plane(touching="billet.top")}, "remesh": pr.Remesh(COARSE, pr.When(travel=0.4))}
    increments, worst = solved(indented(press(-1.5), enforcement=enforcement, **die))
    plain, _ = solved(indented(press(-1.5), **die))
    assert increments[-1].remeshings >= 3 and worst < 1e-8
    for time in (0.3, 0.7, 1.0):
        assert force(increments, time) == pytest.approx(force(plain, time), rel=1e-3)
    contact = increments[-1].contacts["billet.top-punch"]
    assert contact.gap.min() > -1e-4 and (contact.pressure[contact.status > 0] > 0).all()


def pressed_plate(mu: float, space: str) -> tuple[System, State]:
    """A billet between a die narrower than itself and a support, at the end of its first mesh."""
    problem = indented(
        press(-1.5), size=(10.0, 7.5), n=(10, 8), tools={"punch": pr.Stamp(width=12.0, fillet=1.0, touching="billet.top")},
        friction=pr.Coulomb(mu), space=space,
    )  # fmt: skip
    *_, last = pr.solve(replace(problem, remesh="off"))
    return discretise(problem), last.state


@pytest.mark.parametrize(("mu", "space"), [(0.1, "axisymmetric"), (0.3, "plane strain")])
def test_a_die_keeps_its_contact_area(mu: float, space: str) -> None:
    """Ends of contact zones stay nodes, be they corners of elements or not: no die loses 0.5 % of its area at a new mesh."""
    system, state = pressed_plate(mu, space)
    for size in (1.3, 0.7):
        new, there = renewed(system, state, ["billet"], lambda body, h=size: lambda x: np.full(len(x), h))  # type: ignore[misc]
        stepping = TimeStepping(new, pr.Numerics(), Policy(), Messages(new, None), Timer(), False)
        there, _ = balanced(stepping, there)
        assert area(new, there) > 0.995 * area(system, state)


def area(system: System, state: State) -> float:
    """Projected area of the contact as far as its outermost closed node."""
    (s,) = system.surfaces
    x = system.positions(state.u)[s.points.support[state.contact.closed, 0], 0].max()
    return float(np.pi * x**2 if system.axisymmetric else x)


# --------------------------------------------------------------------------------------------------------------- steps
@pytest.mark.slow
def test_forces_that_are_released_come_over_to_new_meshes() -> None:
    """A side that was held is released while the punch goes on: forces and shape as on one mesh, and balance throughout."""
    held = {"billet.bottom": pr.Fixed(y="held"), "billet.left": pr.Fixed(x="held"), "billet.right": pr.Fixed(x="held")}
    steps = press(-0.5), press(-0.8, name="free", fixed={"billet.right": pr.Fixed(free=True)})
    one, many = (solved(indented(*steps, fixed=held, space="plane strain", remesh=r)) for r in (ONE, MANY))
    meshes = [(i.remeshings, i.state.release is not None) for i in many[0]]
    assert sum(a[0] != b[0] and a[1] and b[1] for a, b in pairwise(meshes)) >= 2
    assert max(one[1], many[1]) < 1e-8
    for time in (1.25, 1.5, 2.0):
        assert force(many[0], time) == pytest.approx(force(one[0], time), rel=1e-2)
    wide = [i[-1].bodies["billet"].x[:, 0].max() for i, _ in (one, many)]
    assert wide[1] == pytest.approx(wide[0], abs=0.02)


def test_a_step_ends_where_it_is_reported_to_on_any_mesh() -> None:
    """'until' a force: met to its tolerance after several meshes, and the next step goes on from there."""
    steps = (
        press(-2.0, until=pr.Until(force={"punch": pr.ToolForce(y=8000.0)})),
        pr.Step("back", by={"punch": pr.Motion(y=0.05)}),
    )
    increments, worst = solved(indented(*steps))
    met = next(i for i in increments if i.end_of_step)
    assert met.force("punch").y == pytest.approx(8000.0, rel=1e-7) and met.remeshings >= 3 and worst < 1e-8
    assert increments[-1].tools["punch"].place.y == pytest.approx(met.tools["punch"].place.y + 0.05)


@pytest.mark.parametrize("space", [pytest.param("axisymmetric", marks=pytest.mark.slow), "plane strain"])
def test_tools_are_removed_from_a_body_on_new_meshes(space: str) -> None:
    """It springs back as it does from a punch that is lifted; no mesh is made meanwhile."""
    gone, lifted = (
        solved(indented(press(-0.4), last, space=space))
        for last in (pr.Step("release", remove_tools=True), pr.Step("lift", by={"punch": pr.Motion(y=0.05)}))
    )
    assert lifted[1] < 1e-8 and gone[0][-1].remeshings == next(i for i in gone[0] if i.end_of_step).remeshings >= 3
    a, b = (i[-1].bodies["billet"].x for i, _ in (gone, lifted))
    before = next(i for i in gone[0] if i.end_of_step).bodies["billet"].x
    assert len(a) == len(before)
    assert a[:, 1].max() == pytest.approx(b[:, 1].max(), abs=5e-4)
    assert np.abs(a - before).max() > 1e-3


def test_pushed_and_sprung_tools() -> None:
    """A punch that is pushed by a force, and one that hangs on a spring: where the driven one is when it bears that."""
    driven, _ = solved(indented(press(-0.4)))
    pushed, worst = solved(indented(pr.Step("push", push={"punch": pr.Push(y=-driven[-1].force("punch").y)})))
    assert worst < 1e-8 and pushed[-1].remeshings >= 3
    assert pushed[-1].tools["punch"].place.y == pytest.approx(-0.4, rel=3e-2)


# ----------------------------------------------------------------------------------------------- cases that follow on
@pytest.mark.parametrize(
    "remesh", [pytest.param("off", id="on its meshes"), pytest.param(MANY, id="remeshed on", marks=pytest.mark.slow)]
)
def test_a_case_starts_from_a_run_on_new_meshes(tmp_path: Path, remesh: Any) -> None:
    """Two stages in two cases are those of one, with nothing to release between them; and the second one resumes bit for bit."""
    lift = press(0.02, name="lift", increments=16)
    run(pr.Case(indented(press(-0.4)), output=TABLES), tmp_path / "first", quiet=True)
    whole = run(pr.Case(indented(press(-0.4), lift, remesh=MANY), output=TABLES), tmp_path / "whole", quiet=True)
    second = pr.Case(indented(lift, remesh=remesh, start=pr.Start(str(tmp_path / "first"))), output=TABLES)
    system = discretise(second.problem)
    assert system.first is not None and system.release is None
    after = run(second, tmp_path / "second", quiet=True)
    a, b = whole.increment, after.increment
    assert b.bodies["billet"].x[:, 1].max() == pytest.approx(a.bodies["billet"].x[:, 1].max(), abs=2e-4)
    assert b.energy["external"] == pytest.approx(a.energy["external"], rel=2e-3)
    assert max(imbalance(of_state(second.problem, b.state), b)) < 1e-8
    assert not after.summary["warnings"]
    third = indented(press(0.03, name="on"), remesh="off", start=pr.Start(str(tmp_path / "second")))
    assert discretise(third).first is not None
    _, state = read_checkpoint(tmp_path / "second" / "checkpoint.h5")
    assert np.array_equal(state.u, b.state.u)
    assert resume(tmp_path / "second", quiet=True).status == "completed"
    again = list(pr.solve(second.problem))
    assert np.array_equal(again[-1].state.u, b.state.u)


def test_a_second_stage_goes_on_bit_for_bit_from_any_state(tmp_path: Path) -> None:
    """States of a case that started from a remeshed run, and has made meshes of its own since."""
    run(pr.Case(indented(press(-0.3)), output=TABLES), tmp_path / "first", quiet=True)
    problem = indented(press(-0.6), start=pr.Start(str(tmp_path / "first")))
    whole = list(pr.solve(problem))
    assert whole[-1].remeshings >= 2
    for k in (0, len(whole) // 2):
        arrays = State.from_arrays(whole[k].state.arrays())
        again = list(pr.solve(problem, start=arrays))
        assert [i.remeshings for i in again] == [i.remeshings for i in whole[k + 1 :]]
        assert np.array_equal(again[-1].state.u, whole[-1].state.u)


# -------------------------------------------------------------------------------------------------------------- studies
@pytest.mark.slow
def test_a_sweep_of_a_remeshed_case(tmp_path: Path) -> None:
    """Each case of the table is what its own run says."""
    path = tmp_path / "case.yaml"
    path.write_text(pr.dump(pr.Case(indented(press(-0.15)), output=TABLES)), encoding="utf-8")
    name = "end(punch.force.y, press)"
    study = pr.sweep(path, {"friction.mu": [0.0, 0.2]}, out=tmp_path / "out", measures=[name], jobs=1, quiet=True)
    alone = run(pr.load(path, ["friction.mu=0.2"]), tmp_path / "alone", quiet=True)
    assert study[name][1] == alone.increment.force("punch").y and alone.increment.remeshings >= 1


def test_convergence_over_the_sizes_that_meshes_are_made_of(tmp_path: Path) -> None:
    """First meshes and the sizes of new ones are refined alike; where sizes are automatic the study asks for one."""
    path = tmp_path / "case.yaml"
    path.write_text(pr.dump(pr.Case(indented(press(-0.1)), output=TABLES)), encoding="utf-8")
    pr.converge(path, "max(punch.force.y)", mesh=[0.7, 1.0, 1.3], out=tmp_path / "out", jobs=1, quiet=True)
    with (tmp_path / "out" / "table.csv").open(encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    assert [float(r["remesh.size.far"]) for r in rows] == pytest.approx([1.2 / f for f in (0.7, 1.0, 1.3)])
    assert [float(r["remesh.size.per_radius"]) for r in rows] == pytest.approx([4 * f for f in (0.7, 1.0, 1.3)])
    assert all(r["status"] == "completed" for r in rows)
    automatic = replace(indented(press(-0.1)), remesh="auto")
    path.write_text(pr.dump(pr.Case(automatic, output=TABLES)), encoding="utf-8")
    with pytest.raises(PrensaError, match="give 'far'"):
        pr.converge(path, "max(punch.force.y)", mesh=[0.8, 1.0, 1.25], out=tmp_path / "more", jobs=1, quiet=True)
