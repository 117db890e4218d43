"""Exact enforcement in space: conditions with two tangents, the tangent, what supports hold, restarts, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.errors import ArgumentError, CaseError, SolveError
from prensa.output.estimate import estimate
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step
from prensa.verify.space import imbalance

MU = 0.4
BALL = pr.Revolved(section=pr.Circle(radius=3.0), touching="b.top", at=(1.1, 0.0, 0.9))
PLATE = pr.Plane(touching="b.top")
PRESS = pr.Step("press", move={"t": pr.Motion(y=-0.2)}, increments=2)
SLIDE = pr.Step("slide", by={"t": pr.Motion(x=0.06, z=-0.1, ry=0.04)}, increments=2)
LIFT = pr.Step("lift", by={"t": pr.Motion(y=0.01)}, increments=2)
MODES = [("small", "reference"), ("finite", "current")]


def block(tool=BALL, steps=(PRESS, SLIDE), mode=MODES[1], mu=MU, n=(3, 2, 3), enforcement=None, **more):
    """A block 2 × 1.5 × 2 of steel on its bonded base, under a tool."""
    kinematics, geometry = mode
    given = {
        "contacts": (pr.Contact("b.top", "t", enforcement=enforcement or pr.Exact()),), "fixed": {"b.bottom": "xyz"},
        "bodies": {"b": pr.Body(pr.Box((2.0, 1.5, 2.0), n), pr.J2(1000.0, 0.3, pr.Linear(20.0, 100.0)), "h8_fbar")},
        "tools": {"t": tool}, "friction": pr.Coulomb(mu) if mu else None, "kinematics": kinematics,
    }  # fmt: skip
    return pr.Problem(
        "block", space="solid", steps=steps, contact_geometry=geometry, allow_large_strain=kinematics == "small", **given | more
    )


@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_the_conditions_of_contact_hold_to_round_off(mode):
    """Signorini and Coulomb's circle under a ball that presses, slides and turns: gaps, slips that stick, bounds, balance."""
    h, before, stuck, slid = 0.75, None, 0, 0
    for inc in pr.solve(block(mode=mode)):
        c, rows = inc.contacts["b.top-t"], inc.state.contact
        closed, stick, slide = c.pressure > 0, c.status == 1, c.status == 2
        assert np.abs(c.gap[closed]).max() <= 1e-12 * h
        assert c.gap[~closed].min() >= -1e-12 * h
        size, bound = np.linalg.norm(rows.traction, axis=1), MU * inc.state.lam[:, 0]
        assert (size - bound).max() <= 1e-12 * bound.max()
        assert np.abs(size - bound)[slide].max(initial=0.0) <= 1e-12 * bound.max()
        if before is not None:
            moved = np.linalg.norm(rows.coordinate - before.coordinate, axis=1)
            assert moved[stick].max(initial=0.0) <= 1e-12 * h
            both = slide & before.closed
            assert np.abs(moved - (rows.slip - before.slip))[both].max(initial=0.0) <= 1e-12 * h
        before, stuck, slid = rows, stuck + int(stick.sum()), slid + int(slide.sum())
        assert inc.energy["contact"] == 0.0
        assert imbalance(inc) <= 1e-8
    assert stuck
    assert slid


def test_friction_opposes_the_slip():
    """Under a plate, whose tangents stand still, tractions are against the slips, to round-off."""
    turn = pr.Step("turn", by={"t": pr.Motion(ry=0.2)}, increments=2)
    *_, before, inc = pr.solve(block(PLATE, (PRESS, turn)))
    rows, slide = inc.state.contact, inc.contacts["b.top-t"].status == 2
    moved = rows.coordinate - before.state.contact.coordinate
    along = (moved * rows.traction).sum(axis=1) + np.linalg.norm(moved, axis=1) * np.linalg.norm(rows.traction, axis=1)
    assert slide.sum() > 4
    assert np.abs(along[slide]).max() <= 1e-12 * np.abs(rows.traction).max()


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_one_layer_is_the_exact_answer_of_plane_strain(mu):
    """Forces of a roll that presses and slides over one layer of bricks, per thickness, to 1e-8 of those in the plane."""
    slide = pr.Step("slide", by={"t": pr.Motion(x=0.2)}, increments=2)
    steps = (pr.Step("press", move={"t": pr.Motion(y=-0.15)}, increments=2), slide)
    given = {"steps": steps, "friction": pr.Coulomb(mu) if mu else None}
    contacts, metal, roll = (pr.Contact("b.top", "t", enforcement=pr.Exact()),), pr.NeoHooke(1000.0, 0.3), pr.Circle(3.0)
    flat = pr.Problem(
        "flat", space="plane strain", bodies={"b": pr.Body(pr.Rectangle((4.0, 2.5), (6, 3)), metal, "q4")}, contacts=contacts,
        tools={"t": replace(roll, touching="b.top", at=(2.0, 0.0))}, fixed={"b.bottom": "xy"}, **given,
    )  # fmt: skip
    solid = pr.Problem(
        "layer", space="solid", bodies={"b": pr.Body(pr.Box((4.0, 2.5, 0.5), (6, 3, 1)), metal, "h8")}, contacts=contacts,
        tools={"t": pr.Extruded(roll, axis=(0, 0, 1), touching="b.top", at=(2.0, 0.0, 0.0))},
        fixed={"b.bottom": "xyz", "b.back": "z", "b.front": "z"}, **given,
    )  # fmt: skip
    for a, b in zip(pr.solve(flat), pr.solve(solid), strict=True):
        f, g = a.force("t"), b.force("t")
        assert np.allclose([g.x / 0.5, g.y / 0.5], [f.x, f.y], rtol=1e-8, atol=1e-8 * abs(f.y))
    assert mu == 0.0 or b.contacts["b.top-t"].status.max() == 2


@pytest.mark.parametrize("mode", MODES, ids="-".join)
@pytest.mark.parametrize("held", [{}, {"b.left": "x", "b.back": "z"}], ids=["free", "symmetry"])
def test_the_tangent_is_exact(mode, held):
    """By central differences with six motions of the tool, points that stick and slip, and such whose ways supports prescribe."""
    tool = replace(BALL, at=(0.0, 0.0, 0.0)) if held else BALL
    p, seen, kept = block(tool, (PRESS, LIFT) if held else (PRESS, SLIDE), mode, fixed={"b.bottom": "xyz"} | held), set(), 0
    system, rng = discretise(p), np.random.default_rng(2)
    for inc in pr.solve(p):
        if inc.end_of_step:
            continue
        plan = plan_step(system, inc.state.clock.step, inc.state.step_start)
        c = system.context(inc.state, plan, inc.time + 0.25)
        moved, v = rng.standard_normal((2, system.ndof))
        moved[np.union1d(plan.fixed, np.arange(system.surfaces[0].unknowns.start, system.ndof))] = 0.0
        v[system.dofs.orientation(0)] = 0.0
        u = inc.state.u + 1e-4 * moved
        sets = system.active_sets(c, system.evaluate(c, u, inc.state.lam))
        e = system.evaluate(c, u, inc.state.lam, active_sets=sets)
        seen |= set(sets.contacts[0].wanted.tolist())
        kept += 0 if sets.contacts[0].redundant is None else int(sets.contacts[0].redundant.tangential.sum())
        K = csc_matrix((e.data, system.pattern.indices, system.pattern.indptr))
        ends = [system.evaluate(c, u + s * 1e-7 * v, inc.state.lam, stiffness=False, active_sets=sets).r for s in (1, -1)]
        assert np.abs(K @ v - (ends[0] - ends[1]) / 2e-7).max() <= 1e-6 * np.abs(K @ v).max()
    assert {0, 1} <= seen
    assert 2 in seen or held
    assert (kept > 0) == bool(held)


# ------------------------------------------------------------------------------------- where supports leave no freedom
CORNER = 0  # of the points of the upper side: at x = z = 0
SLID = pr.Step("press", move={"t": pr.Motion(y=-0.2)}, by={"b.left": pr.Motion(x=0.05)}, increments=3)
PUSHED = pr.Step("press", push={"t": pr.Push(y=-60.0)}, by={"b.left": pr.Motion(x=0.05)}, increments=2)
AGAIN = pr.Step("press again", by={"t": pr.Motion(y=-0.05)}, increments=2)
EDGE = {"b.bottom": "xyz", "b.back": "z"}


def test_a_node_that_supports_hold_keeps_its_traction_as_far_as_friction_bears_it():
    """At a corner that a side slid along the plate: that of the last increment, cut down to the bound; nothing slips there."""
    traction, cut, kept = np.zeros(2), 0, 0
    for inc in pr.solve(block(PLATE, (SLID, replace(LIFT, by={"t": pr.Motion(y=0.01)}), AGAIN), mu=0.2, n=(2, 2, 2), fixed=EDGE)):
        pressure, t = inc.state.lam[CORNER, 0], inc.state.contact.traction[CORNER]
        if inc.time > 1.0:
            bound, size = 0.2 * pressure, float(np.linalg.norm(traction))
            cut, kept = cut + (size > bound), kept + (size < bound)
            assert t == pytest.approx(traction * min(1.0, bound / size), rel=1e-9, abs=1e-9 * bound)
            assert inc.state.contact.slip[CORNER] == pytest.approx(0.05, rel=1e-12)
        traction = t
    assert cut
    assert kept


def test_a_node_that_supports_move_with_the_tool_keeps_its_pressure():
    """The gap says nothing of its multiplier then; one that they do not move with the tool is reported with its place."""
    both = pr.Motion(y=-0.05)
    steps = (PUSHED, pr.Step("both", by={"t": both, "b.left": both}))
    *_, before, inc = pr.solve(block(PLATE, steps, n=(2, 2, 2), fixed=EDGE))
    assert before.state.lam[CORNER, 0] > 0.0
    assert inc.state.lam[CORNER] == pytest.approx(before.state.lam[CORNER], rel=1e-12)
    steps = (PUSHED, pr.Step("both", by={"t": pr.Motion(y=-0.06), "b.left": both}))
    with pytest.raises(SolveError, match=r"driven into the point at \(0, 1.5, .*\), which a support holds"):
        list(pr.solve(block(PLATE, steps, n=(2, 2, 2), fixed=EDGE), pr.Numerics(max_cutbacks=1)))


def test_sides_held_along_inclined_normals():
    """Three layers of a ring between planes at 45° bear half of six in a quarter, with friction, to 1e-9."""
    forces = {}
    for layers, cap in ((3, "normal"), (6, "x")):
        mesh = pr.Revolution(pr.Rectangle((3.0, 2.0), (2, 2), (3.0, 0.0)), layers, angle=np.radians(15.0 * layers))
        body = {"b": pr.Body(mesh, pr.J2(1000.0, 0.3, pr.Linear(20.0, 100.0)))}
        fixed = {"b.bottom": "y", "b.base": "z", "b.cap": cap}
        *_, inc = pr.solve(block(PLATE, (PRESS,), bodies=body, fixed=fixed), pr.Numerics(tolerance=1e-11))
        forces[layers] = inc.force("t").y
        c = inc.contacts["b.top-t"]
        assert np.abs(c.gap[c.pressure > 0]).max() <= 1e-12
    assert 2.0 * forces[3] == pytest.approx(forces[6], rel=1e-9)


def test_two_tools_with_one_face_share_the_force():
    """Two plates in the same place, and a wall besides whose edge all three press on: redundant constraints, forces of one."""
    wall, both = pr.Plane(normal=(-1.0, 0.0, 0.0), at=(2.0, 0.0, 0.0)), {"b.bottom": "y", "b.left": "x", "b.back": "z"}
    forces = []
    for tools in (("t",), ("t", "other")):
        contacts = tuple(pr.Contact("b.top", name, enforcement=pr.Exact()) for name in tools)
        contacts += (pr.Contact("b.right", "wall", friction=pr.Coulomb(0.1), enforcement=pr.Exact()),)
        given = {"tools": dict.fromkeys(tools, PLATE) | {"wall": wall}, "contacts": contacts, "mu": 0.0, "fixed": both}
        press = pr.Step("press", move=dict.fromkeys(tools, pr.Motion(y=-0.1)), increments=1)
        *_, inc = pr.solve(block(steps=(press,), n=(2, 2, 2), **given))
        forces.append([sum(inc.force(name).y for name in tools), inc.force("wall").x])
        assert imbalance(inc) <= 1e-8
    assert forces[1] == pytest.approx(forces[0], rel=1e-7)


def test_continuing_from_a_saved_state_changes_nothing():
    """Multipliers along the tangents in which tractions are kept: a continued run equals the whole one bit for bit."""
    whole = list(pr.solve(block()))
    saved = type(whole[2].state).from_arrays({k: v.copy() for k, v in whole[2].state.arrays().items()})
    (again,) = pr.solve(block(), start=saved)
    assert all(np.array_equal(x, whole[3].state.arrays()[k]) for k, x in again.state.arrays().items())


def test_a_pushed_tool_is_the_inverse_of_a_moved_one():
    """With the force that moving took, it goes as far; penalties come as near as they are deep."""
    press = pr.Step("press", move={"t": pr.Motion(y=-0.1)}, increments=1)
    *_, moved = pr.solve(block(steps=(press,), mu=0.0))
    force = moved.force("t").y
    push = pr.Step("push", push={"t": pr.Push(y=-force)}, increments=1)
    *_, pushed = pr.solve(block(steps=(push,), mu=0.0), pr.Numerics(tolerance=1e-11))
    assert pushed.tools["t"].place[1] == pytest.approx(-0.1, rel=1e-8)
    found = [list(pr.solve(block(steps=(press,), mu=0.0, enforcement=pr.Penalty(beta)))) for beta in (100.0, 1000.0)]
    near, nearer = (abs(inc[-1].force("t").y / force - 1.0) for inc in found)
    assert nearer < 0.15 * near < 0.01


@pytest.mark.parametrize("solver", ["ldlt", "multigrid"])
def test_solvers_without_a_place_for_multipliers_are_refused(solver):
    """They are refused before anything starts; without a word the matrix itself is factored, and `check` says so."""
    with pytest.raises(ArgumentError, match=f"'{solver}', which has no place for multipliers"):
        next(pr.solve(block(), pr.Numerics(solver=solver)))
    with pytest.raises(CaseError, match="has no place for multipliers"):
        pr.Case(block(), pr.Numerics(solver=solver))
    found = estimate(discretise(block()), pr.Numerics(), pr.Output())
    assert found.solver == "lu"
    assert found.remedy == "'enforcement: penalty'"
