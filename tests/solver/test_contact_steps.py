"""Contact steps: Newton's step with the contact conditions as inequalities, for increments that Newton's method gives up."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.linear.reduction import Reduced
from prensa.policy import Policy
from prensa.solver.contact_lcp import contact_step
from prensa.solver.equilibrium import Equilibrium, Reporter
from prensa.solver.newton import newton
from prensa.solver.predictor import Guess
from prensa.system.outcome import NewtonResult
from prensa.timer import Timer
from problems import squeezed_block, stroke

ENFORCEMENTS = [pr.Penalty(), pr.Augmented(), pr.Exact()]
FRICTION = [None, pr.Coulomb(0.2)]


def block(rule="nodal", enforcement=None, friction=None, space="plane strain", tie=False):
    """A block between a table and a cylinder, no side of it held along y."""
    more = {"enforcement": enforcement or pr.Penalty(), "integration": rule}
    body = pr.Body(pr.Rectangle(size=(2.0, 1.0), n=(8, 4)), pr.Elastic(E=1000.0, nu=0.3))
    bodies, ties = {"block": body}, ()
    if tie:
        under = pr.Body(pr.Rectangle(size=(2.0, 0.5), n=(6, 2), origin=(0.0, -0.5)), pr.Elastic(E=500.0, nu=0.3))
        bodies, ties = {"block": body, "under": under}, (pr.Tie("block.bottom", "under.top"),)
    bottom, y = ("under.bottom", -0.5) if tie else ("block.bottom", 0.0)
    return pr.Problem(
        "block", space=space, bodies=bodies, ties=ties,
        tools={"table": pr.Plane(normal=(0.0, 1.0), at=(0.0, y)), "roll": pr.Circle(radius=3.0, at=(0.0, 4.0))},
        contacts=(pr.Contact(bottom, "table", friction, **more), pr.Contact("block.top", "roll", friction, **more)),
        fixed={f"{name}.left": "x" for name in bodies},
        steps=(pr.Step("press", move={"roll": pr.Motion(y=-0.05)}, increments=2),),
    )  # fmt: skip


def equations(problem, increment, time=1.0):
    """The equations of the increment to a time after a converged one, and where Newton's iteration of it starts."""
    system = pr.discretise(problem)
    inc = next(itertools.islice(pr.solve(system), increment - 1, None))
    from prensa.system.planning import plan_step

    plan = plan_step(system, inc.step_number - 1, inc.state.step_start)
    c = system.context(inc.state, plan, time)
    timer = Timer()
    reduced = Reduced.of(system, plan.fixed, pr.Numerics())
    eq = Equilibrium(system, c, reduced, pr.Numerics(), Policy(), Reporter(lambda *a: None, timer))
    u = inc.state.u.copy()
    u[plan.fixed] = plan.values(time)
    return eq, u, inc.state


@pytest.mark.parametrize(
    ("rule", "enforcement"),
    [*itertools.product(["nodal", "gauss2", "simpson"], ENFORCEMENTS[:2]), ("nodal", ENFORCEMENTS[2])],
    ids=lambda x: x if isinstance(x, str) else x.type,
)
@pytest.mark.parametrize("friction", FRICTION, ids=["frictionless", "coulomb"])
@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_where_no_point_changes_it_is_newtons_step(enforcement, rule, friction, space):
    """Near the solution, where points stay closed and slip as they do, the step is that of the exact tangent.

    That is the end of the increment: at its start, points that slid in the last one lie on the kink between stick and slip.
    """
    eq, u, state = equations(block(rule, enforcement, friction, space), 2)
    rng = np.random.default_rng(1)
    lam = eq.system.initial_multipliers(state)
    result = NewtonResult(False, None, u, None, lam, 0)
    newton(eq, Guess(u), lam, result)
    u = result.u.copy()
    size = 1e-8 * np.abs(state.u[eq.system.dofs.displacement.slice]).max()
    free = eq.reduced.free[eq.reduced.free < eq.system.dofs.tool.slice.start]
    u[free] += size * rng.standard_normal(len(free))
    e = eq.evaluate(u, lam)
    found = contact_step(eq, u, lam, e, None)
    plain = eq.reduced.solve(eq.reduced.matrix(e, -e.r), -e.r)
    assert found is not None
    step = found.step
    body = eq.system.dofs.displacement.slice
    np.testing.assert_allclose(step[body], plain[body], atol=2e-5 * np.abs(plain[body]).max())


@pytest.mark.parametrize("tie", [False, True], ids=["one body", "tied"])
@pytest.mark.parametrize("enforcement", ENFORCEMENTS, ids=lambda e: e.type)
def test_the_linearised_conditions_hold_after_one_step(enforcement, tie):
    """From the undeformed block, whose contact is one node and will be many: pressures and gaps of the linear model fit."""
    eq, u, state = equations(block(enforcement=enforcement, tie=tie), 1)
    lam = eq.system.initial_multipliers(state)
    e = eq.evaluate(u, lam)
    found = contact_step(eq, u, lam, e, None)
    assert found is not None
    step = found.step
    after = eq.evaluate(u + eq.system.with_slaves(step), lam)
    # what is left is the curvature of the tool and of the bodies' answer: one more step of the kind ends it
    again = u + eq.system.with_slaves(step)
    for _ in range(4):
        e = eq.evaluate(again, lam)
        again = again + eq.system.with_slaves(contact_step(eq, again, lam, e, None).step)
    end = eq.evaluate(again, lam)
    assert eq.norm(end) < 1e-8 * end.scale < eq.norm(after)


def sheet(n, friction):
    """A thin sheet between a force-driven binder and a die, and a punch: most of it lies flat, unloaded and loose."""
    w, h = 8.0, 0.066
    die = pr.Profile(points=[(16.0, 0.0), (1.55, 0.0), (1.55, -8.0)], fillet=0.35, at=(0.0, 0.0))
    binder = pr.Profile(points=[(1.9, 8.0), (1.9, h), (16.0, h)], fillet=0.17, at=(0.0, 0.0))
    con = {"friction": friction}
    return pr.Problem(
        "sheet", bodies={"sheet": pr.Body(pr.Rectangle(size=(w, h), n=(n, 1)), pr.Elastic(E=60000.0, nu=0.3))},
        tools={"punch": pr.Circle(radius=1.4, touching="sheet.top"), "die": die, "binder": binder},
        contacts=(
            pr.Contact("sheet.top", "punch", **con), pr.Contact("sheet.bottom", "die", **con),
            pr.Contact("sheet.top", "binder", **con),
        ),
        fixed={"sheet.left": "x"},
        steps=(
            pr.Step("hold", push={"binder": {"y": -8.0}}),
            pr.Step("draw", move={"punch": pr.Motion(y=-0.25)}, push={"binder": {"y": -8.0}}),
        ),
    )  # fmt: skip


@pytest.mark.parametrize("friction", FRICTION, ids=["frictionless", "coulomb"])
def test_a_thin_sheet_between_binder_and_die(friction):
    """Stiffness in bending is 1e-8 of that of contact: without contact steps the run was cut to nothing in its second step."""
    increments = list(pr.solve(sheet(30, friction)))
    assert increments[-1].time == 2.0
    for inc in increments:
        total = sum(inc.force(t).y for t in ("punch", "die", "binder"))
        assert abs(total) < 1e-6 * abs(inc.force("die").y)
    assert increments[-1].force("binder").y == pytest.approx(8.0, rel=1e-6)
    assert sum(inc.statistics.cutbacks for inc in increments) <= 3


def test_of_many_candidates_those_that_press_are_enough(monkeypatch):
    """Begun with the closed points, the linear problem of a sheet ends with the pairs of all points near a tool."""
    from prensa.solver import contact_lcp as module

    calls = []
    one = module._unknowns
    monkeypatch.setattr(module, "_unknowns", lambda *given: calls.append(given[3].sum()) or one(*given))
    more = False
    for number in (12, 15):
        eq, u, _ = equations(sheet(30, None), number, 0.1 * number + 0.1)
        lam = eq.system.initial_multipliers(eq.context.state)
        e = eq.evaluate(u, lam)
        calls.clear()
        chosen = contact_step(replace(eq, policy=replace(eq.policy, few_candidates=0)), u, lam, e, None)
        more |= len(calls) > 1
        everything = contact_step(replace(eq, policy=replace(eq.policy, few_candidates=1000)), u, lam, e, None)
        assert chosen is not None and everything is not None and calls[0] < calls[-1]
        body = eq.system.dofs.displacement.slice
        np.testing.assert_allclose(chosen.step[body], everything.step[body], atol=1e-5 * np.abs(everything.step[body]).max())
    assert more


def test_a_body_that_nothing_holds_is_not_held_by_the_foundation():
    """The springs under candidates keep matrices regular; a body that slides off without resistance is still reported."""
    tools = {"t": pr.Plane(touching="b.top"), "table": pr.Plane(normal=(0.0, 1.0), at=(0.0, -0.01))}
    problem = squeezed_block(stroke(-0.05), tools=tools, size=(2.0, 1.0), n=(4, 2), body_force={"b": (0.01, 0.0)})
    with pytest.raises(PrensaError, match="free"):
        list(pr.solve(problem))


def test_increments_are_judged_by_the_way_that_led_to_them(monkeypatch):
    """Iterations of an attempt that was given up are reported, but do not keep the next increment short."""
    from prensa.solver import attempt as module
    from prensa.system.failure import NotConverged

    def gives_up(eq, start):
        found = NewtonResult(False, NotConverged(12, 1.0), start, None, eq.system.initial_multipliers(eq.context.state), 12)
        found.changes = [1]
        return found

    problem = sheet(16, None)
    problem = replace(problem, steps=(replace(problem.steps[0]),))
    plain = list(pr.solve(problem))
    monkeypatch.setattr(module, "attempt_by_newton", gives_up)
    rescued = list(pr.solve(problem))
    assert all(inc.statistics.iterations > 12 for inc in rescued)
    assert len(rescued) <= 1.2 * len(plain)
    assert rescued[-1].force("die").y == pytest.approx(plain[-1].force("die").y, rel=1e-6)


@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_nodes_round_a_corner_leave_no_equation_empty(space):
    """A node beside a sharp corner is nearest to it wherever it goes: it sticks without a slope, and its equation is empty."""
    corner = pr.Profile(points=((-0.9, 3.0), (-0.9, 0.0), (0.9, 0.0), (0.9, 3.0)), at=(0.0, 1.06), fillet=0)
    p = block(enforcement=pr.Exact(), friction=pr.Coulomb(0.2), space=space)
    p = replace(
        p, tools={"roll": corner}, fixed={**p.fixed, "block.bottom": "y"}, contacts=p.contacts[1:],
        steps=(pr.Step("press", move={"roll": pr.Motion(y=-0.08)}, increments=2),),
    )  # fmt: skip
    eq, u, state = equations(p, 1, time=0.7)
    lam = eq.system.initial_multipliers(state)
    e = eq.evaluate(u, lam)
    beside = eq.context.surfaces[0].X[:, 0] > 0.9
    assert not e.contacts[0].stencils.ds[beside & (e.contacts[0].g < 0.3)].any()
    found = contact_step(eq, u, lam, e, None)
    assert found is not None
    body = eq.system.dofs.displacement.slice
    assert np.abs(found.step[body]).max() < 1e-12  # nothing touches yet, and nothing is held


def test_a_ball_that_begins_to_turn_in_a_block_of_metal(monkeypatch):
    """In space friction is decided with two tangents; steps begin with secants where flow turns: two cuts without either."""
    from prensa.solver import newton as module

    decided = []

    def noted(*given, **more):
        found = contact_step(*given, **more)
        decided.append(found is not None and found.decided)
        return found

    monkeypatch.setattr(module, "contact_step", noted)
    metal = pr.J2(E=100000.0, nu=0.3, flow=pr.Swift(K=400.0, e0=0.01, n=0.15))
    problem = pr.Problem(
        "ball", space="solid", bodies={"block": pr.Body(pr.Box(size=(8.0, 10.0, 7.0), n=(4, 6, 3)), metal)},
        tools={"ball": pr.Sphere(12.0, touching="block.top", at=(4.5, 10.0, 3.0))}, fixed={"block.bottom": "xyz"},
        contacts=(pr.Contact(("block.top",), "ball", friction=pr.Coulomb(0.3)),),
        steps=(
            pr.Step("press", move={"ball": pr.Motion(y=-0.3)}, increments=2),
            pr.Step("turn", by={"ball": pr.Motion(ry=0.2)}, increments=2),
            pr.Step("back", by={"ball": pr.Motion(ry=-0.2, x=0.1)}, increments=2),
        ),
    )  # fmt: skip
    costs = [i.statistics for i in pr.solve(problem)]
    assert any(decided)
    assert sum(c.cutbacks for c in costs) == 0 and max(c.iterations for c in costs) <= 12
