"""Exact enforcement: no penetration, no elastic slip, Coulomb's bound to round-off, in every mode; and where it must refuse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.errors import PrensaError, SolveError
from prensa.friction.law import At
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step
from problems import pressed_block

HARDENING = pr.Coulomb(pr.MuExponential(0.1, 0.4, 0.02))
MODES = [("small", "reference"), ("small", "current"), ("finite", "current")]
PRESS = pr.Step("press", move={"tool": {"y": -0.15}}, increments=2)
SLIDE = pr.Step("slide", move={"tool": {"x": 0.2}}, increments=3)


def problem(enforcement=None, *, steps=(PRESS, SLIDE), space="plane strain", mode=MODES[2], friction=HARDENING, tool=None,
            fixed=None, n=(10, 6)):  # fmt: skip
    axi = space == "axisymmetric"
    kinematics, geometry = mode
    return pressed_block(
        *steps, tools={"tool": tool or pr.Circle(radius=3.0, at=(0.0 if axi else 2.0, 5.5))},
        material=pr.J2(1000.0, 0.3, pr.Linear(30.0, 100.0)), size=(4.0, 2.5), n=n, body="block", friction=friction,
        enforcement=enforcement or pr.Exact(), fixed=fixed or {"block.bottom": "xy"}, space=space,
        kinematics=kinematics, contact_geometry=geometry, allow_large_strain=kinematics == "small",
    )  # fmt: skip


def last(p, numerics=None, **more):
    *_, inc = pr.solve(p, numerics, **more)
    return inc


@pytest.mark.parametrize("mode", MODES, ids="-".join)
@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
@pytest.mark.parametrize("pushed", [False, True])
def test_the_conditions_of_contact_hold_to_round_off(space, mode, pushed):
    """Signorini and Coulomb with hardening: gap of closed points, slip of sticking ones, bound of sliding ones, to 1e-12."""
    drive = {"push": {"tool": pr.Push(y=-60.0)}} if pushed else {"move": {"tool": {"y": -0.15}}}
    steps = [pr.Step("press", **drive, increments=3)]
    if space == "plane strain":
        steps.append(pr.Step("slide", move={"tool": pr.Motion(x=0.2)}, push=drive.get("push", {}), increments=3))
    else:
        steps.append(pr.Step("lift", move={"tool": {"y": -0.1}}, increments=2))
    p = problem(steps=steps, space=space, mode=mode)
    h = 2.5 / 6
    before = None
    stuck = slid = 0
    for inc in pr.solve(p):
        c = inc.contacts["block.top-tool"]
        closed, slide, stick = c.pressure > 0, c.status == 2, c.status == 1
        assert np.abs(c.gap[closed]).max() <= 1e-12 * h
        assert c.gap[~closed].min() >= -1e-12 * h
        bound = HARDENING.bound(c.pressure, c.slip, At())[0]
        assert (np.abs(c.shear) <= bound * (1 + 1e-12)).all()
        assert np.abs(np.abs(c.shear) - bound)[slide].max(initial=0.0) <= 1e-12 * bound.max()
        rows = inc.state.contact
        if before is not None:
            moved = (rows.coordinate - before.coordinate)[:, 0]
            assert np.abs(moved[stick]).max(initial=0.0) <= 1e-12 * h  # no slip, and no accumulated slip either
            assert np.array_equal(rows.slip[stick], before.slip[stick])
            both = slide & (before.closed)
            assert np.abs(np.abs(moved) - (rows.slip - before.slip))[both].max(initial=0.0) <= 1e-12 * h
            assert (moved * rows.traction[:, 0])[both].max(initial=0.0) <= 0.0  # friction opposes the slip
        before = rows
        stuck, slid = stuck + stick.sum(), slid + slide.sum()
        assert inc.energy["contact"] == 0.0
    assert stuck
    assert slid


@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_the_answer_does_not_depend_on_the_weights_of_the_iteration(space):
    """A hundredfold change of beta and beta_T changes the force by round-off, and nothing else."""
    steps = (PRESS, SLIDE) if space == "plane strain" else (PRESS,)
    a, b = (last(problem(pr.Exact(beta, beta), steps=steps, space=space)).force("tool") for beta in (1.0, 100.0))
    assert np.allclose(a, b, rtol=1e-9, atol=1e-9 * abs(a.y))


def test_penalty_and_augmented_converge_to_it():
    """Ten times the penalty leaves a tenth of the difference in force; augmentation to 1e-7 h leaves less than 1e-5."""
    exact = last(problem()).force("tool")
    differences = [
        np.abs(np.subtract(last(problem(pr.Penalty(beta, 0.1 * beta))).force("tool"), exact)) / exact.y
        for beta in (100.0, 1000.0)
    ]
    assert np.allclose(differences[1] / differences[0], 0.1, atol=0.02)
    close = last(problem(pr.Augmented(tolerance=1e-7))).force("tool")
    assert np.allclose(close, exact, atol=1e-4 * exact.y)


@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_a_pushed_tool_is_the_inverse_of_a_moved_one(mode):
    """The force found for a motion, applied, gives the motion; the tool's unknowns are free in the saddle-point system."""
    step = pr.Step("press", move={"tool": {"y": -0.15}}, increments=1)
    moved = last(problem(steps=[step], mode=mode))
    push = pr.Step("press", push={"tool": {"y": -moved.force("tool").y}}, increments=1)
    pushed = last(problem(steps=[push], mode=mode))
    small = mode[0] == "small"
    assert pushed.tools["tool"].place.y == pytest.approx(-0.15, rel=1e-7 if small else 1e-3)


def test_every_solver_gives_the_same_answer():
    """The rslab and SuperLU answers agree to 1e-9 on the unsymmetric saddle-point system."""
    a, b = (last(problem(), pr.Numerics(solver=s)).force("tool") for s in ("rslab", "superlu"))
    assert np.allclose(a, b, rtol=1e-9)


def test_newton_is_quadratic():
    """With the status settled, the digits of the residual double."""
    inc = last(problem(), pr.Numerics(reuse_factors=False, tolerance=1e-11))
    r = inc.statistics.residuals
    assert r[-1] <= 1e-11
    assert r[-1] <= 1e-3 * r[-2] <= 1e-5 * r[-3]


def test_continuing_from_a_saved_state_changes_nothing():
    """The multipliers are part of the committed state: a continued run equals the whole one bit for bit."""
    whole = list(pr.solve(problem()))
    saved = type(whole[2].state).from_arrays({k: v.copy() for k, v in whole[2].state.arrays().items()})
    for a, b in zip(pr.solve(problem(), start=saved), whole[3:], strict=True):
        assert all(np.array_equal(x, b.state.arrays()[k]) for k, x in a.state.arrays().items())


def test_exact_and_penalty_contacts_in_one_problem():
    """Each contact keeps its own form: no penetration on the exact one, p/k_n on the other; forces balance."""
    p = pr.Problem(
        "two", bodies={"block": pr.Body(pr.Rectangle(size=(4.0, 2.5), n=(8, 5)), pr.Elastic(1000.0, 0.3))},
        tools={"top": pr.Plane(touching="block.top"), "side": pr.Plane(touching="block.right")},
        contacts=[
            pr.Contact("block.top", "top", pr.Coulomb(0.2), pr.Exact()),
            pr.Contact("block.right", "side", pr.Coulomb(0.2), pr.Penalty()),
        ],
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=[pr.Step("press", move={"top": {"y": -0.2}}, increments=2)],
    )  # fmt: skip
    inc = last(p)
    top, side = inc.contacts["block.top-top"], inc.contacts["block.right-side"]
    assert np.abs(top.gap).max() <= 1e-12
    k_n = 100.0 * 1000.0 * 0.7 / (1.3 * 0.4) / 0.5  # M/h with M = λ + 2μ
    assert np.allclose(-side.gap * k_n * (side.pressure > 0), side.pressure, rtol=0.2)  # per current area: 10 % strain
    assert (side.pressure > 0).any()


# ------------------------------------------------------------------------------------- where supports leave no freedom
def test_a_point_held_along_the_tangent_slides_and_does_not_stick():
    """The corner on a symmetry line under a tool that moves along it cannot stick: its traction is μp, in every mode."""
    for mode in MODES:
        p = problem(friction=pr.Coulomb(0.3), mode=mode, tool=pr.Plane(touching="block.top"),
                    fixed={"block.bottom": "y", "block.left": "x"})  # fmt: skip
        c = last(p).contacts["block.top-tool"]
        corner = int(np.argmin(c.X[:, 0]))
        assert c.status[corner] == 2
        assert abs(c.shear[corner]) == pytest.approx(0.3 * c.pressure[corner], rel=1e-12)


def test_two_tools_with_one_face_share_the_pressure():
    """Two planes in the same place are redundant constraints: the sum of their forces is that of one."""
    one = problem(friction=None, tool=pr.Plane(touching="block.top"), steps=[PRESS])
    two = pr.Problem(
        "two", bodies=one.bodies, tools={"tool": one.tools["tool"], "other": one.tools["tool"]},
        contacts=[one.contacts[0], pr.Contact("block.top", "other", enforcement=pr.Exact())], fixed=one.fixed,
        steps=[pr.Step("press", move={"tool": {"y": -0.15}, "other": {"y": -0.15}}, increments=2)],
    )  # fmt: skip
    inc = last(two)
    assert inc.force("tool").y + inc.force("other").y == pytest.approx(last(one).force("tool").y, rel=1e-8)


def test_a_support_that_drives_a_point_into_a_tool_is_refused_with_words(monkeypatch):
    """What a support and a tool prescribe differently has no exact answer; seen before the solve, and in it by the solver."""
    lift = pr.Step("lift", fixed={"block.top-left": pr.Fixed(y=0.1)}, increments=1)
    p = problem(friction=None, tool=pr.Plane(touching="block.top"), steps=[lift])
    with pytest.raises(PrensaError, match=r"held along the normal of tool 'tool'"):
        last(p)
    monkeypatch.setattr("prensa.analysis.preflight", lambda _: [])
    with pytest.raises(SolveError, match=r"driven into the point at \(0, 2.5\), which a support holds.*penalty"):
        last(p, pr.Numerics(max_cutbacks=1))


def held_side(steps, enforcement=None):
    """The corner of a block under a plane, moved along it by the side of the block in the first step."""
    return pressed_block(
        *steps, material=pr.J2(1000.0, 0.3, pr.Linear(30.0, 100.0)), size=(2, 1.5), n=(3, 2), body="block",
        enforcement=enforcement or pr.Exact(), plane="tool", friction=pr.Coulomb(0.2),
    )  # fmt: skip


CORNER = 3  # of the points of the upper side, which are counted from the right
SLID = pr.Step("press", move={"tool": {"y": -0.2}}, by={"block.left": {"x": 0.05}}, increments=4)
LIFT = pr.Step("lift", by={"tool": {"y": 0.004}}, increments=3)
AGAIN = pr.Step("press again", by={"tool": {"y": -0.05}}, increments=3)


def test_a_node_that_supports_hold_keeps_its_traction_as_far_as_friction_bears_it():
    """Nothing else says what it is: that of the last increment, cut down to the bound, whatever the iteration began with."""
    found = {}
    for predictor in (True, False):
        traction, cut, kept = 0.0, 0, 0
        for inc in pr.solve(held_side([SLID, LIFT, AGAIN]), pr.Numerics(predictor=predictor)):
            (pressure, _), shear = inc.state.lam[CORNER], inc.state.contact.traction[CORNER, 0]
            if inc.time > 1.0:
                bound = 0.2 * pressure
                cut, kept = cut + (abs(traction) > bound), kept + (abs(traction) < bound)
                assert shear == pytest.approx(np.sign(traction) * min(abs(traction), bound), rel=1e-10)
                assert inc.state.contact.slip[CORNER] == pytest.approx(0.05, rel=1e-12)
            traction = shear
        assert (cut, kept) == (3, 3)
        found[predictor] = inc.force("tool")
    assert found[True].x == pytest.approx(found[False].x, rel=1e-9)


def test_a_node_that_supports_move_with_the_tool_keeps_its_pressure():
    """The gap says nothing of its multiplier then; and one that they do not move with the tool is reported."""
    push = pr.Step("press", push={"tool": pr.Push(y=-30.0)}, by={"block.left": {"x": 0.05}}, increments=4)
    both = {"y": -0.05}
    *_, before, inc = pr.solve(held_side([push, pr.Step("both", by={"tool": both, "block.left": both})]))
    assert before.state.lam[CORNER, 0] > 0.0
    assert inc.state.lam[CORNER] == pytest.approx(before.state.lam[CORNER], rel=1e-12)
    with pytest.raises(SolveError, match="which a support holds: exact enforcement has no compliance"):
        list(pr.solve(held_side([push, pr.Step("both", by={"tool": {"y": -0.06}, "block.left": both})])))


@pytest.mark.parametrize("friction", [pr.Coulomb(0.2), pr.Shear(0.3), HARDENING], ids=["coulomb", "shear", "hardening"])
@pytest.mark.parametrize("step", [LIFT, AGAIN], ids=["cut", "kept"])
def test_the_tangent_of_kept_multipliers_is_exact(friction, step):
    """Along any motion of the free dofs, to 1e-6 of differences."""
    p = replace(held_side([SLID, LIFT, replace(step, name="then")]), friction=friction)
    system = discretise(p)
    *_, inc = pr.solve(replace(p, steps=[SLID, LIFT]))
    c = system.context(inc.state, plan_step(system, 2, inc.state.step_start, inc.state.ends), 2.3)
    free = np.setdiff1d(np.arange(system.ndof), c.plan.fixed)
    u, way = inc.state.u.copy(), np.zeros(system.ndof)
    u[c.plan.fixed] = c.plan.values(c.time)
    way[free] = np.random.default_rng(1).standard_normal(len(free))
    e = system.evaluate(c, u, system.initial_multipliers(inc.state))
    assert e.contacts[0].redundant is not None
    K = csc_matrix((e.data, system.pattern.indices, system.pattern.indptr), (system.ndof, system.ndof))
    ends = [system.evaluate(c, u + s * 1e-7 * way, inc.state.lam, stiffness=False).r for s in (1, -1)]
    change = (K @ way)[free]
    assert (ends[0] - ends[1])[free] / 2e-7 == pytest.approx(change, abs=1e-6 * np.abs(change).max())
