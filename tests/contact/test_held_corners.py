"""Corners holding edges that go up a flank: which they are, tangent, balance, resumed runs, where none is looked for, jumps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.contact.cut import cuts_of
from prensa.policy import Policy
from prensa.system.planning import plan_step
from prensa.system.state import State
from prensa.verify.balance import Balance
from prensa.verify.buckling import arch
from problems import pressed_block

ENFORCEMENTS = (pr.Penalty(), pr.Augmented(), pr.Exact())
DIE = pr.Profile(
    points=((-0.6, 3.0), (-0.6, 0.3), pr.Arc(through=(0.0, 0.0), to=(0.6, 0.3)), (0.6, 3.0)), fillet=0.0, at=(0.93, 1.3)
)
PRESS = pr.Step("press", move={"die": pr.Motion(y=-0.5)})
SLIDE = pr.Step("slide", move={"die": pr.Motion(x=0.3, y=-0.5, rz=0.05)})
DEEP = pr.Step("press", move={"die": pr.Motion(y=-0.8)})


def ironed(enforcement=ENFORCEMENTS[0], *, mu=0.3, space="plane strain", steps=(PRESS, SLIDE), stabilise="auto"):
    """A soft block of few elements under a die with sharp corners and steep sides."""
    axis = {"b.left": "x"} if space == "axisymmetric" else {}
    return pressed_block(
        *steps, tools={"die": DIE}, material=pr.NeoHooke(E=689.6, nu=0.32), size=(3.6, 1.2), n=(12, 4),
        enforcement=enforcement, fixed={"b.bottom": "xy"} | axis, space=space, friction=pr.Coulomb(mu),
        stabilise=stabilise,
    )  # fmt: skip


def held(problem):
    """Committed increments whose next one has corners that hold points, each with its context."""
    system = pr.discretise(problem)
    for inc in pr.solve(problem):
        if not inc.end_of_step:
            plan = plan_step(system, inc.state.clock.step, inc.state.step_start)
            c = system.context(inc.state, plan, inc.time + 1e-3)
            if c.surfaces[0].corners is not None:
                yield system, inc, c


@pytest.mark.parametrize("space", ["plane strain", "plane stress", "axisymmetric"])
@pytest.mark.parametrize("enforcement", ENFORCEMENTS, ids=lambda e: e.type)
@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_the_tangent_is_exact(enforcement, mu, space):
    """K v by central differences of the residual, pressed, dragged and turned, with held points that stick and that slip."""
    steps = (DEEP,) if space == "axisymmetric" else (PRESS, SLIDE)
    seen = 0
    for system, inc, c in held(ironed(enforcement, mu=mu, space=space, steps=steps)):
        rng = np.random.default_rng(inc.number)
        u, v = inc.state.u + 1e-5 * rng.standard_normal(system.ndof), rng.standard_normal(system.ndof)
        e = system.evaluate(c, u, inc.state.lam)
        K = csc_matrix((e.data, system.pattern.indices, system.pattern.indptr), (system.ndof,) * 2)
        h = 1e-8
        ahead, behind = (system.evaluate(c, u + s * h * v, inc.state.lam, stiffness=False).r for s in (1, -1))
        assert np.abs((ahead - behind) / (2 * h) - K @ v).max() <= 1e-6 * np.abs(K @ v).max()
        seen += 1
        if seen == 8:
            break
    assert seen


@pytest.mark.parametrize("enforcement", ENFORCEMENTS, ids=lambda e: e.type)
def test_forces_balance(enforcement):
    """Of nodes, tool and supports, moments too, with held points that bear: what the body gets the tool gives."""
    bearing = 0
    for system, inc, c in held(ironed(enforcement)):
        f = system.evaluate(c, inc.state.u, system.initial_multipliers(inc.state)).contacts[0]
        rows = c.surfaces[0].corners.rows
        bearing += int((f.p[rows] > 0).sum())
        x, at = c.surfaces[0].points.at(system.positions(inc.state.u)), system.tools[0].at
        place = system.place_of(0, inc.state.u)
        arm = x - at - place[:2]
        on_body, on_tool = f.vectors, f.F[:, -3:-1]
        size = np.abs(on_tool).max()
        assert np.abs(on_body + on_tool).max() <= 1e-12 * size
        moment = arm[:, 0] * on_body[:, 1] - arm[:, 1] * on_body[:, 0]
        assert np.abs(moment + f.F[:, -1]).max() <= 1e-12 * size
        nodes = c.surfaces[0].points.to_nodes(on_body)
        assert nodes.sum(axis=0) == pytest.approx(on_body.sum(axis=0), abs=1e-12 * size)
    assert bearing


def test_a_run_is_resumed_bit_for_bit():
    """From arrays, as a checkpoint keeps them: what is held follows from the committed state alone."""
    problem = ironed()
    path = list(pr.solve(problem))
    numbers = [inc.number for _, inc, _ in held(problem)]
    assert numbers
    for number in (numbers[0], numbers[len(numbers) // 2], numbers[-1]):
        start = State.from_arrays(path[number - 1].state.arrays())
        for a, b in zip(path[number:], pr.solve(problem, start=start), strict=True):
            assert np.array_equal(a.state.u, b.state.u) and a.energy == b.energy


def test_edges_are_held_where_friction_acts_and_viscous_forces_carry_on():
    """No node hangs without friction, and without viscous forces a run ends where one comes free: all is as it was there."""
    assert list(held(ironed()))
    assert not list(held(ironed(mu=0.0)))
    assert not list(held(ironed(stabilise="off")))


@pytest.mark.parametrize(("behind", "holds"), [((0.75, 0.45), True), ((1.1, 0.3), False)])
def test_an_edge_is_held_that_goes_up_a_flank(behind, holds):
    """Steep beside the corner: the place of the edge at the corner may not pass the line along the edge. A flat one is cut."""
    system = pr.discretise(ironed())
    shape = system.tools[0].shape
    x = np.array([behind, (0.5, 0.15)]) + system.tools[0].at
    edges, place = np.array([[0, 1]]), np.zeros(3)
    found = cuts_of(shape, system.tools[0].at, place, x, edges, 100.0, True)
    assert [one.corner is not None for one in found] == [True] * holds
    assert all(one.corner is None for one in cuts_of(shape, system.tools[0].at, place, x, edges, 100.0))
    if holds:
        (cut,) = found
        assert cut.end == 0
        t = (x[1] - x[0]) / np.hypot(*(x[1] - x[0]))
        assert cut.corner == pytest.approx((0.6, 0.3))
        assert cut.normal @ t == pytest.approx(0.0, abs=1e-12)
        assert cut.covered == pytest.approx((np.array([0.6, 0.3]) + system.tools[0].at - x[0]) @ t / np.hypot(*(x[1] - x[0])))


def test_a_jump_is_cut_where_the_energy_balance_misses_too_much():
    """An arch that snaps under a push: less to be missed makes more increments of the jump, and the far side is the same."""
    problem = replace(arch(pr.Step("push", push={"p": pr.Push(y=-60.0)})), stabilise="auto")
    tight = Policy(jump_imbalance_share=1e-4, jump_increment_share=1e-3, jump_travel_in_elements=0.05)
    runs = [list(pr.solve(problem, policy=policy)) for policy in (Policy(), tight)]
    assert len(runs[1]) > len(runs[0])
    assert runs[1][-1].tools["p"].place.y == pytest.approx(runs[0][-1].tools["p"].place.y, rel=1e-6)


def test_held_points_stick_and_slip():
    """Both are among the states whose tangents are looked at."""
    found = set()
    for mu in (0.1, 0.3):
        for system, inc, c in held(ironed(ENFORCEMENTS[1], mu=mu)):
            f = system.evaluate(c, inc.state.u, inc.state.lam).contacts[0]
            found |= {bool(f.slip[k]) for k in c.surfaces[0].corners.rows if f.p[k] > 0}
    assert found == {True, False}


def test_supports_and_tool_balance():
    """Without viscous forces, which no support bears, the whole run balances as any other: edges are whole there."""
    balance = Balance()
    balance.last(ironed(stabilise="off"))
    assert max(balance.force, balance.moment) <= 1e-8
