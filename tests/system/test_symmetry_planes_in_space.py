"""Free sides that come to a plane of symmetry in space: the same as in the plane, across the axes and across inclined normals."""

from __future__ import annotations

import logging
import math
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import tetrahedra
from prensa.measures import parse
from prensa.system.symmetry_planes import guard_of, unguarded
from problems import flattened_tube, one_side_beyond, tube_quarter
from stopped import goes_on_bit_for_bit

PLASTIC = pr.J2(1000.0, 0.3, pr.Linear(10.0, 20.0))
STROKE = -3.98


def words(caplog) -> list[str]:
    return [r.getMessage() for r in caplog.records if "of symmetry" in r.getMessage()]


def tube(*, turned: float = 0.0, **more) -> pr.Problem:
    return tube_quarter(STROKE, turned=turned, material=PLASTIC, element="h8_enhanced", increments=16, **more)


@pytest.fixture(scope="module")
def upright() -> list[pr.Increment]:
    return list(pr.solve(tube()))


def test_an_extruded_tube_is_that_of_the_plane(upright):
    """One layer, per thickness: forces, places and the force on the plane of symmetry in every increment, and the energies."""
    step = pr.Step("flatten", by={"punch": pr.Motion(y=STROKE)}, increments=16)
    plane = list(pr.solve(flattened_tube(step, material=PLASTIC, element="q4_enhanced", n=(8, 1))))
    assert len(plane) == len(upright)
    for a, b in zip(plane, upright):
        assert list(a.tools) == list(b.tools)
        assert b.force("punch").y == pytest.approx(a.force("punch").y, rel=1e-8)
        there = np.concatenate([a.bodies["t"].x, a.bodies["t"].x])
        ours = b.bodies["t"].x
        nearest = np.linalg.norm(ours[:, None, :2] - there[None], axis=2).min(axis=1)
        assert nearest.max() < 1e-8
    a, b = plane[-1], upright[-1]
    assert b.tools["symmetry_y"].force.y == pytest.approx(a.tools["symmetry_y"].force.y, rel=1e-8)
    assert abs(b.tools["symmetry_y"].force.y) > 0.1
    assert b.energy["plastic"] == pytest.approx(a.energy["plastic"], rel=1e-8)
    assert b.energy["contact"] == pytest.approx(a.energy["contact"], rel=1e-7)
    assert min(i.bodies["t"].x[:, 1].min() for i in upright) > -1e-3


def test_supports_of_the_first_step_and_of_no_motion_make_planes_too():
    """They hold in all steps, as those of the problem do."""
    problem = tube()
    step = replace(problem.steps[0], fixed=problem.fixed)
    still = {name: pr.Fixed(**{k: 0.0 for k in "xyz" if getattr(one, k) == "held"}) for name, one in problem.fixed.items()}
    given = [m.plane for m in guard_of(pr.discretise(problem)).mirrors]
    assert given
    for other in (replace(problem, fixed={}, steps=(step,)), replace(problem, fixed={}, steps=(replace(step, fixed=still),))):
        assert [m.plane for m in guard_of(pr.discretise(other)).mirrors] == given


def test_normals_of_the_first_step_make_planes_too():
    """As those that the problem holds; the side is held in the same equations."""
    problem = tube(turned=math.radians(30.0))
    normals = {name: one for name, one in problem.fixed.items() if one.normal is not None}
    others = {name: one for name, one in problem.fixed.items() if one.normal is None}
    first = replace(problem, fixed=others, steps=(replace(problem.steps[0], fixed=normals),))
    a, b = pr.discretise(problem), pr.discretise(first)
    assert normals and [m.plane for m in guard_of(b).mirrors] == [m.plane for m in guard_of(a).mirrors]
    assert np.array_equal(b.ties.inclined.normals, a.ties.inclined.normals)


def test_inclined_planes_act_as_those_across_the_axes(upright, caplog):
    """The tube turned by 30° about its axis, its sides held along their normals: the same scalars in every increment."""
    angle = math.radians(30.0)
    with caplog.at_level(logging.INFO, "prensa"):
        turned = list(pr.solve(tube(turned=angle)))
    assert len(words(caplog)) == 1
    assert "reaches the plane of symmetry (-0.5, 0.866, 0) · x = 0 near" in words(caplog)[0]
    across = np.array([-math.sin(angle), math.cos(angle), 0.0])
    assert len(turned) == len(upright)
    for a, b in zip(upright, turned):
        assert across @ [*b.force("punch")][:3] == pytest.approx(a.force("punch").y, rel=1e-9)
        np.testing.assert_allclose(b.bodies["t"].x @ across, a.bodies["t"].x[:, 1], rtol=0, atol=1e-9)
    on = [across @ [*t.force][:3] for name, t in turned[-1].tools.items() if name.startswith("symmetry_n")]
    assert max(on, key=abs) == pytest.approx(upright[-1].tools["symmetry_y"].force.y, rel=1e-8)
    assert turned[-1].energy["imbalance"] == pytest.approx(upright[-1].energy["imbalance"], rel=1e-6, abs=1e-9)


def test_a_plane_written_by_hand_does_the_same(upright):
    """Of several layers that are held at one end alone, with the plane as a tool and a contact of all free sides."""
    free = {"depth": 3.0, "layers": 2, "held": ("base",), "increments_end": 14}
    found, by_hand = list(pr.solve(tube(**free))), list(pr.solve(tube(plane=True, **free)))
    assert len(found) == len(by_hand)
    for a, b in zip(found, by_hand):
        assert a.force("punch").y == pytest.approx(b.force("punch").y, rel=1e-8)
        np.testing.assert_allclose(a.bodies["t"].x, b.bodies["t"].x, rtol=0, atol=1e-8)
    assert found[-1].tools["symmetry_y"].force.y == pytest.approx(by_hand[-1].tools["mirror"].force.y, rel=1e-8)


def quadratic(**more) -> pr.Problem:
    """The tube of quadratic tetrahedra, whose nodes in the middle of sides are the contact points."""
    X, cells, _ = tetrahedra((1, 8, 1), (1.0, math.pi / 2, 1.0))
    ends = {"start": (1, 0.0), "end": (1, math.pi / 2), "base": (2, 0.0), "cap": (2, 1.0), "inner": (0, 0.0), "outer": (0, 1.0)}
    sides = {name: tuple(np.flatnonzero(np.abs(X[:, k] - at) < 1e-9).tolist()) for name, (k, at) in ends.items()}
    r = 4.0 + X[:, 0]
    x = np.stack([r * np.cos(X[:, 1]), r * np.sin(X[:, 1]), X[:, 2]], axis=1)
    x[np.abs(x) < 1e-12] = 0.0
    mesh = pr.Tetrahedra(tuple(map(tuple, x.tolist())), tuple(map(tuple, cells.tolist())), sides)
    return replace(tube(increments_end=15, **more), bodies={"t": pr.Body(mesh, PLASTIC)})


def test_tetrahedra_meet_the_plane_too():
    """As they meet one that is written by hand."""
    found, by_hand = list(pr.solve(quadratic())), list(pr.solve(quadratic(plane=True)))
    assert [i.time for i in found] == [i.time for i in by_hand]
    for a, b in zip(found, by_hand):
        assert a.force("punch").y == pytest.approx(b.force("punch").y, rel=1e-8)
    pressed = found[-1].tools["symmetry_y"].force.y
    assert pressed == pytest.approx(by_hand[-1].tools["mirror"].force.y, rel=1e-6)
    assert abs(pressed) > 0.1


@pytest.mark.slow
def test_derivatives_go_on_at_the_plane():
    """They are differences of whole runs, and a run from a state with the plane has the same ones."""
    path, step = "bodies.t.material.flow.s0", 1e-4

    def of(s0: float) -> pr.Problem:
        return replace(tube(), bodies={"t": replace(tube().bodies["t"], material=replace(PLASTIC, flow=pr.Linear(s0, 20.0)))})

    found = list(pr.solve(of(10.0), derivatives=[path]))
    measure, times = parse("punch.force.y", of(10.0)), [i.time for i in found]
    above, below = (list(pr.solve(of(10.0 + h), times=times))[-1] for h in (step, -step))
    by_differences = (measure.value(above) - measure.value(below)) / (2.0 * step)
    assert found[-1].derivative(measure)[path] == pytest.approx(by_differences, rel=1e-6)
    *_, resumed = pr.solve(of(10.0), start=found[14].state, derivatives=[path])
    assert "symmetry_y" in resumed.tools
    assert resumed.derivative(measure) == found[-1].derivative(measure)


def test_forces_balance_with_the_plane(upright):
    """What punch, plane and support of the side bear along y is nothing together."""
    last = upright[-1]
    borne = sum(t.force.y for t in last.tools.values()) - last.supports["t.start"].y
    assert borne == pytest.approx(0.0, abs=1e-7 * abs(last.force("punch").y))


@pytest.mark.slow
def test_a_run_goes_on_bit_for_bit(tmp_path):
    """Stopped before and after a free side came to the plane, its tables are those of a run that went through."""
    case = pr.Case(tube(), output=pr.Output(1, False, False))
    goes_on_bit_for_bit(case, tmp_path, 8)


def test_planes_of_symmetry_of_a_block():
    """Those held along their normals and not along themselves, however thin the body; walls and clamped sides are none."""
    def planes(n, **fixed: str) -> set[str]:
        block = pr.Problem(
            "block", space="solid", bodies={"b": pr.Body(pr.Box((2.0, 2.0, 2.0), n), PLASTIC)}, steps=(pr.Step("on"),),
            fixed={f"b.{side}": held for side, held in fixed.items()},
        )  # fmt: skip
        guard = guard_of(pr.discretise(block))
        return set() if guard is None else {str(m) for m in guard.mirrors}

    assert planes((2, 2, 2), left="x", bottom="y", back="z") == {"x = 0", "y = 0", "z = 0"}
    assert planes((2, 2, 2), left="xyz") == set()
    assert planes((2, 2, 2), left="x", bottom="xyz") == {"x = 0"}
    assert planes((1, 2, 2), left="x", bottom="xyz") == {"x = 0"}
    assert planes((2, 2, 1), left="x", back="z", front="z") == {"x = 0"}
    assert planes((2, 2, 2), left="normal", bottom="y") == {"x = 0", "y = 0"}


def test_what_cannot_have_a_plane_is_watched():
    """Small strain, with contact on the undeformed surface too, and tools that are gone; nothing where a plane can stand."""
    system = pr.discretise(tube())
    assert guard_of(system) is not None and unguarded(system) is None
    assert unguarded(system.without_tools()) is not None
    for geometry in ("current", "reference"):
        system = pr.discretise(replace(tube(), kinematics="small", contact_geometry=geometry))
        watched = unguarded(system)
        assert guard_of(system) is None and watched is not None
        assert {str(m) for m in watched.mirrors} == {"x = 0", "y = 0"}


@pytest.mark.parametrize("space", ["plane strain", "solid"])
def test_a_side_that_passes_where_no_tool_can_stand_is_reported_once(space, caplog):
    """In small strain; 'no_contact' against symmetry says that it may."""
    problem = one_side_beyond(space)
    with caplog.at_level(logging.WARNING, "prensa"):
        list(pr.solve(problem))
    kind = "line" if space == "plane strain" else "plane"
    assert [w for w in words(caplog) if f"a free side of 'b' passes through the {kind} of symmetry y = 0 near" in w]
    assert len([w for w in words(caplog) if "passes through" in w]) == 1
    caplog.clear()
    list(pr.solve(replace(problem, no_contact=(pr.NoContact("b", "symmetry"),))))
    assert not words(caplog)
