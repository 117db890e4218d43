"""Displacement control: the tool leads, and one factor on all loads of the step follows from equilibrium."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.errors import PrensaError
from prensa.linear.reduction import Reduced
from prensa.system.control import FACTOR
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step
from prensa.verify.buckling import arch
from problems import tied_blocks

FACTOR_AT = -1  # in the dofs of a problem without fields of its own


def led(push: float, way: float, **more: object) -> pr.Problem:
    """A shallow arch under a circle whose push follows from its way."""
    step = pr.Step("press", push={"p": pr.Push(y=push)}, control={"p": pr.Motion(y=way)}, increments=10)
    return replace(arch(), steps=(step,), **more)  # type: ignore[arg-type]


def force(inc: pr.Increment) -> float:
    """Of the arch on the circle."""
    return inc.force("p").y


def test_a_push_passes_its_maximum_as_the_motion_does():
    """Way by way the force is that of the circle that is moved, through the limit point and the least force behind it."""
    moved = replace(arch(), steps=(pr.Step("press", move={"p": pr.Motion(y=-4.0)}, increments=10),))
    expected = np.array([force(i) for i in pr.solve(moved)])
    increments = list(pr.solve(led(-60.0, -4.0)))
    forces = np.array([force(i) for i in increments])
    np.testing.assert_allclose(forces, expected, rtol=1e-8)
    assert np.diff(np.sign(np.diff(forces))).any()
    np.testing.assert_allclose([i.state.u[FACTOR_AT] for i in increments], forces / 60.0, rtol=1e-8)
    assert abs(increments[-1].energy["imbalance"]) < 0.02 * increments[-1].energy["elastic"]


@pytest.mark.parametrize("follower", [True, False])
def test_all_loads_of_the_step_keep_their_proportion(follower: bool):
    """With the factor that is found, all loads given as numbers lead to where the tool was led."""
    pressure, weight = pr.Load(pressure=0.05, follower=follower), {"b": (0.01, -0.03)}
    problem = led(-60.0, -0.5)
    problem = replace(problem, steps=(replace(problem.steps[0], loads={"b.inner": pressure}, body_force=weight),))
    last = list(pr.solve(problem))[-1]
    factor = float(last.state.u[FACTOR_AT])
    assert 0.02 < abs(factor) < 1.0
    given = pr.Step(
        "press", push={"p": pr.Push(y=-60.0 * factor)},
        loads={"b.inner": replace(pressure, pressure=0.05 * factor)}, body_force={"b": (0.01 * factor, -0.03 * factor)},
    )  # fmt: skip
    end = list(pr.solve(replace(problem, steps=(given,))))[-1]
    assert end.tools["p"].place.y == pytest.approx(-0.5, rel=1e-6)
    assert force(end) == pytest.approx(force(last), rel=1e-8)


@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Exact()])
def test_the_tangent_is_the_derivative(enforcement: object):
    """Each column of the matrix, that of the factor among them, is the difference of the residuals it belongs to."""
    problem = led(-60.0, -0.5, contacts=(pr.Contact("b.outer", "p", enforcement=enforcement),))  # type: ignore[arg-type]
    step = replace(problem.steps[0], loads={"b.inner": pr.Load(pressure=0.5)}, body_force={"b": (0.01, -0.03)})
    system = discretise(replace(problem, steps=(step,)))
    state, plan = system.initial(), plan_step(system, 0, np.zeros(system.ndof))
    reduced = Reduced.of(system, plan.fixed, pr.Numerics(), control=plan.control)
    c, rng = system.context(state, plan, 0.5), np.random.default_rng(1)
    u = 1e-3 * rng.standard_normal(system.ndof)
    u[plan.fixed] = plan.values(0.5)
    u[system.dofs.fields[FACTOR].first] = 0.3
    e = system.evaluate(c, u, state.lam)
    entries = reduced.restriction
    found = csc_matrix((entries.values(e.data), entries.indices, entries.indptr)).toarray()  # type: ignore[attr-defined]

    def part(k: int, h: float) -> np.ndarray:
        v = u.copy()
        v[reduced.free[k]] += h
        return entries.part(system.evaluate(c, v, state.lam, stiffness=False).r)

    h = 1e-7
    columns = np.stack([(part(k, h) - part(k, -h)) / (2 * h) for k in range(len(reduced.free))], axis=1)
    assert np.abs(found - columns).max() < 1e-6 * np.abs(columns).max()
    assert np.abs(found[:, -1]).max() > 0


def test_a_run_goes_on_from_any_increment_to_the_last_bit():
    """The factor is in the state."""
    problem = led(-60.0, -2.0)
    whole = list(pr.solve(problem))
    rest = list(pr.solve(problem, start=whole[4].state))
    assert [force(i) for i in rest] == [force(i) for i in whole[5:]]
    np.testing.assert_array_equal(rest[-1].state.u, whole[-1].state.u)


def test_steps_before_and_after_are_continuous():
    """What is carried when the control begins and ends is where the next step starts from; a second control goes on from it."""
    step = led(-60.0, -0.2).steps[0]
    moved = pr.Step("move", move={"p": pr.Motion(y=-0.4)}, increments=2)
    after = pr.Step("release", push={"p": pr.Push(y=-2.0)}, increments=40)
    steps = (moved, replace(step, increments=40), replace(step, name="press on", increments=40), after)
    increments = list(pr.solve(replace(arch(), steps=steps)))
    forces = np.array([force(i) for i in increments])
    assert np.abs(np.diff(forces[1:])).max() < 0.6
    assert increments[81].tools["p"].place.y == pytest.approx(-0.8)
    assert forces[-1] == pytest.approx(2.0, rel=1e-8)


def test_tied_bodies_are_led_as_one():
    """Ties and control change rows and columns of the matrix together: the loads found lead where the tool was led."""

    def pressed(step: pr.Step) -> pr.Increment:
        problem = tied_blocks(
            step, sizes=((2.0, 2.0), (2.0, 2.0)), n=((2, 2), (3, 3)), names=("low", "high"),
            ties=(pr.Tie("low.top", "high.bottom"),), tools={"p": pr.Plane(touching="high.top")},
            contacts=(pr.Contact("high.top", "p"),),
        )  # fmt: skip
        return list(pr.solve(problem))[-1]

    def loads(share: float, **more: object) -> pr.Step:
        push, side = {"p": pr.Push(y=-100.0 * share)}, {"high.right": pr.Load(pressure=-20.0 * share)}
        return pr.Step("press", push=push, loads=side, **more)  # type: ignore[arg-type]

    last = pressed(loads(1.0, control={"p": pr.Motion(y=-0.1)}))
    end = pressed(loads(force(last) / 100.0))
    assert end.tools["p"].place.y == pytest.approx(-0.1, rel=1e-6)
    assert abs(last.state.u[FACTOR_AT] - force(last) / 100.0) < 1e-9


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"control": {"p": pr.Motion(x=1.0, y=-1.0)}}, "one component"),
        ({"control": {"q": pr.Motion(y=-1.0)}}, "unknown tool 'q'"),
        ({"control": {"p": pr.Motion(x=-1.0)}}, "'push' has to drive it"),
        ({"control": {"p": pr.Motion(y=((0.0, 0.0), (1.0, -1.0)))}}, "as a number"),
        ({"push": {"p": pr.Push(y=((0.0, 0.0), (1.0, -1.0)))}}, "give numbers"),
        ({"loads": {"b.inner": pr.Load(pressure=((0.0, 0.0), (1.0, -1.0)))}}, "give numbers"),
        ({"body_force": {"b": (0.0, ((0.0, 0.0), (1.0, -1.0)))}}, "give numbers"),
        ({"push": {"p": pr.Push(y=0.0)}}, "not 0"),
    ],
)
def test_what_makes_no_sense_is_refused(change: dict, words: str):
    """At the key, with what to write instead."""
    with pytest.raises(PrensaError, match=words):
        replace(arch(), steps=(replace(led(-60.0, -1.0).steps[0], **change),))


def test_derivatives_are_refused():
    """They are not followed through the factor."""
    with pytest.raises(PrensaError, match="follow by its 'control'"):
        list(pr.solve(led(-60.0, -0.1), derivatives=["bodies.b.material.E"]))


def test_remeshing_is_refused():
    """A new mesh has no place for the factor."""
    metal = pr.Body(arch().bodies["b"].mesh, pr.J2(1e4, 0.3, pr.Perfect(100.0)))
    with pytest.raises(PrensaError, match="'control' is not transferred"):
        led(-60.0, -0.1, bodies={"b": metal}, remesh="auto")


def test_condensed_bodies_are_refused():
    """What is condensed stands on the loads of a step over time."""
    with pytest.raises(PrensaError, match="displacement control"):
        list(pr.solve(replace(led(-60.0, -0.1), kinematics="small"), pr.Numerics(condense=True)))


def shallow(solid: bool) -> pr.Problem:
    """The arch of enhanced elements, in the plane or of one layer of bricks 0.5 thick, led through its limit point."""
    section = pr.Annulus(40.0, 41.0, (10, 1), angles=(np.pi / 2 - 0.35, np.pi / 2 + 0.35))
    space = {"space": "solid"} if solid else {}
    share, circle = (0.5, pr.Circle(8.0)) if solid else (1.0, pr.Circle(8.0, at=(0.0, 49.0)))
    held = {"b.start": "xyz", "b.end": "xyz", "b.base": "z", "b.cap": "z"} if solid else {"b.start": "xy", "b.end": "xy"}
    mesh, element = (pr.Extrusion(section, 0.5, 1), "h8_enhanced") if solid else (section, "q4_enhanced")
    return pr.Problem(
        "arch", {"b": pr.Body(mesh, pr.Elastic(1e4, 0.3), element)},
        (pr.Step("press", push={"p": pr.Push(y=-60.0 * share)}, control={"p": pr.Motion(y=-4.0)}, increments=10),),
        {"p": pr.Extruded(circle, at=(0.0, 49.0, 0.0)) if solid else circle}, (pr.Contact("b.outer", "p"),), fixed=held,
        **space,
    )  # fmt: skip


def test_bricks_in_plane_strain_snap_through_as_the_plane_does():
    """Force per thickness and factor, through the maximum and the minimum behind it, to 1e-8 of the largest force."""
    expected, found = (list(pr.solve(shallow(solid))) for solid in (False, True))
    forces = np.array([force(i) for i in expected])
    assert np.diff(np.sign(np.diff(forces))).any()
    assert np.abs(2.0 * np.array([force(i) for i in found]) - forces).max() < 1e-8 * forces.max()
    factors = np.array([i.state.u[FACTOR_AT] for i in found])
    assert np.abs(factors * 60.0 - forces).max() < 1e-8 * forces.max()


def test_a_turn_in_space_leads_its_moment():
    """A stamp that is turned on a block with friction: the moment that leads it is that of the turn without control."""

    def twisted(**how: object) -> list[pr.Increment]:
        problem = pr.Problem(
            "twist", {"b": pr.Body(pr.Box((2.0, 1.0, 2.0), (2, 1, 2)), pr.NeoHooke(100.0, 0.3), "h8")},
            (pr.Step("press", move={"p": pr.Motion(y=-0.05)}, increments=1), pr.Step("turn", increments=2, **how)),  # type: ignore[arg-type]
            {"p": pr.Plane(touching="b.top", at=(1.0, 1.0, 1.0))},
            (pr.Contact("b.top", "p", friction=pr.Coulomb(0.5)),), fixed={"b.bottom": "xyz"}, space="solid",
        )  # fmt: skip
        return list(pr.solve(problem))

    turned = twisted(by={"p": pr.Motion(ry=0.1)})
    led_ = twisted(push={"p": pr.Push(my=50.0)}, control={"p": pr.Motion(ry=0.1)})
    moments = [i.force("p").my for i in turned]
    assert moments[-1] != 0.0
    np.testing.assert_allclose([i.force("p").my for i in led_], moments, rtol=1e-8)
