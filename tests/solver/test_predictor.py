"""The start of an increment: quadratic motions are extrapolated exactly, kinks are not carried on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.contact.record import ContactRecord
from prensa.solver import predictor
from prensa.solver.projection import project_prediction
from prensa.system.planning import plan_step
from prensa.system.state import Clock, Energy, State
from prensa_bench.robustness import draw
from prensa_bench.robustness.increments import solve_checked
from problems import ALUMINIUM, pressed_block, stroke, upset_billet

NODES = 3


def after(state: State, u: np.ndarray, time: float) -> State:
    """The state that follows with unknowns u at a time."""
    dt = time - state.clock.time
    du = u - state.u
    difference, damping = state.damped_difference(du, dt, slice(2 * NODES))
    clock = Clock(0, state.clock.number + 1, time, dt, damping)
    return replace(state, u=u, du=du, dt_last=dt, second_difference=difference, clock=clock)


def at_rest(u: np.ndarray) -> State:
    """The beginning of a step."""
    none = np.zeros(0)
    return State(
        u, np.zeros_like(u), 0.0, np.zeros_like(u), (), ContactRecord.initial(0, 1), none, Energy(), none, Clock(), u
    )


@pytest.fixture
def course():
    """A motion u(t) (2 · 3 + 3,) of second degree."""
    a, v = np.random.default_rng(1).normal(size=(2, 2 * NODES + 3))
    return lambda t: v * t + a * t * t


def test_a_motion_of_second_degree_is_predicted_exactly(course):
    """With unequal increments too, from the third on; before that the last increment is continued in proportion."""
    state = at_rest(course(0.0))
    for t in (0.1, 0.25):
        state = after(state, course(t), t)
        assert state.clock.damping == 0.0
    straight = state.du * (0.2 / 0.15)
    np.testing.assert_allclose(state.extrapolated(0.2), straight, rtol=1e-14)
    for t, dt in ((0.3, 0.4), (0.7, 0.05)):
        state = after(state, course(t), t)
        assert state.clock.damping == pytest.approx(1.0, abs=1e-10)
        np.testing.assert_allclose(state.u + state.extrapolated(dt), course(t + dt), rtol=1e-10)


def test_a_kink_is_not_carried_on(course):
    """When the velocity jumps, what the bend says of the jump is not trusted in the next increment."""
    state = at_rest(course(0.0))
    for t in (0.1, 0.2, 0.3):
        state = after(state, course(t), t)
    back = -np.sign(state.second_difference) * 50.0
    state = after(state, state.u + back * 0.1, 0.4)
    assert state.clock.damping == 0.0
    np.testing.assert_allclose(state.extrapolated(0.1), state.du, rtol=1e-14)


def test_a_steady_process_starts_closer_to_its_answer(monkeypatch):
    """Upsetting: from the tenth increment on the first residual is less than 0.4 of that of the straight start."""
    problem = upset_billet(
        stroke(-1.0, increments=30), material=pr.J2(200e3, 0.3, pr.Ludwik(250.0, 500.0, 0.3)), size=(10, 7.5),
        n=(2, 2),
    )  # fmt: skip
    first = np.array([i.statistics.residuals[0] for i in pr.solve(problem)])
    monkeypatch.setattr(State, "damped_difference", lambda self, du, dt, nodal: (np.zeros_like(du), 0.0))
    straight = np.array([i.statistics.residuals[0] for i in pr.solve(problem)])
    assert (first[9:] < 0.4 * straight[9:]).all()


@pytest.mark.parametrize(
    ("element", "rule"), [("t6", "nodal"), ("q8", "nodal"), ("q4_fbar", "gauss2"), ("q4_fbar", "nodal")]
)
def test_no_time_moves_no_node(element, rule):
    """The start of an increment of no duration is the committed state: nodes that lie in the tool unheld are left there.

    A node of a quadratic edge at the axis, or beside a point inside an edge, may be in the tool and open.
    """
    p = upset_billet(
        stroke(-0.3), tools={"t": pr.Circle(radius=3.0, touching="b.top")},
        material=pr.J2(1000.0, 0.3, pr.Perfect(5.0)), size=(4, 4), n=(8, 8), element=element, integration=rule,
    )  # fmt: skip
    system = pr.discretise(p)
    *_, inc = pr.solve(system)
    assert inc.time == 1.0
    assert inc.number < 100
    state = inc.state
    c = system.context(state, plan_step(system, 0, state.step_start), 1.0)
    u = state.u.copy()
    project_prediction(system, c, u)
    assert np.abs(u - state.u).max() <= 1e-13 * system.length


@pytest.mark.parametrize("rule", ["gauss1", "gauss2", "simpson", "kikuchi"])
def test_points_between_nodes_start_no_worse_than_predicted(rule, monkeypatch):
    """Nodes are put at the gaps that they had where that is better: those of points between them are what contact holds.

    From one increment to the next some nodes beside a point in contact come nearer and others go away from the tool.
    """
    p = pressed_block(
        stroke(-0.4, increments=20), tools={"t": pr.Circle(radius=6.0, at=(0.0, 10.0))},
        material=pr.J2(1000.0, 0.3, pr.Linear(5.0, 50.0)), size=(6, 4), n=(6, 4), element="q4_fbar", integration=rule,
        fixed={"b.bottom": "xy", "b.left": "x"},
    )  # fmt: skip
    first = np.array([i.statistics.residuals[0] for i in pr.solve(p)])
    monkeypatch.setattr(predictor, "project_prediction", lambda *_: None)
    predicted = np.array([i.statistics.residuals[0] for i in pr.solve(p)])
    assert (first <= 1.1 * predicted).all()  # both relative to the forces of their own, which differ a little


def test_a_start_that_nobody_has_improved_is_not_let_pass_as_round_off():
    """What round-off may leave is estimated from above, here at forty times what one step leaves of the first increments."""
    *_, wrong = solve_checked(draw("plastic", 2257363500, 140))
    assert wrong == ""


def test_a_table_with_corners_is_as_easy_as_the_same_way_at_one_speed():
    """Slow and fast rows in turn: the extrapolation follows the way that the tool goes, not time."""
    rows = ((0.0, 0.0), (0.3, -0.03), (0.5, -0.6), (0.8, -0.65), (1.0, -1.5))
    spent = []
    for y in (-1.5, rows):
        p = upset_billet(stroke(y), material=ALUMINIUM, friction=pr.Coulomb(0.1), size=(6, 6), n=(12, 12))
        run = list(pr.solve(p))
        assert sum(i.statistics.cutbacks for i in run) == 0
        spent.append(sum(i.statistics.iterations for i in run) / len(run))
    assert spent[1] <= 1.25 * spent[0]


def test_nothing_is_extrapolated_where_motions_turn_back():
    """The committed state is what there is to start from, not one that goes on the old way."""
    p = upset_billet(stroke(((0.0, 0.0), (0.5, -0.5), (1.0, 0.0)), increments=4), material=ALUMINIUM, size=(6, 6), n=(4, 4))
    system = pr.discretise(p)
    runs = pr.solve(system)
    next(runs)
    state = next(runs).state
    plan = plan_step(system, 0, state.step_start)
    assert system.context(state, plan, 0.75).extrapolated_for == 0.0
