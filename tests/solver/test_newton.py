"""Newton by its parts: what `init`, `step` and `terminate` leave in the state, driven by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from equilibria import of_first_increment
from prensa.policy import Policy
from prensa.solver.equilibrium import Equilibrium, reversed_slip, signature
from prensa.solver.newton import _search_line, _shortened, init, newton, observe, step, terminate
from prensa.solver.newton_state import Best
from prensa.solver.predictor import Guess, initial_guess
from prensa.solver.projection import linear_gaps
from prensa.system.failure import Stagnated, Unevaluable
from prensa.system.outcome import NewtonResult
from prensa.system.planning import plan_step
from prensa.system.system import Evaluation
from prensa_bench.panel.problems import problems
from problems import pressed_block, single_block, squeezed_block, stroke


def pressed(policy: Policy | None = None) -> Equilibrium:
    """A block under a cylinder, at the end of its first increment."""
    problem = pressed_block(
        stroke(-0.05, increments=1), tools={"t": pr.Circle(radius=2.0, touching="b.top")}, size=(2, 1),
        friction=pr.Coulomb(0.3),
    )  # fmt: skip
    return of_first_increment(problem, policy)


def start(eq: Equilibrium) -> tuple[np.ndarray, NewtonResult]:
    u, lam = eq.context.state.u, eq.system.initial_multipliers(eq.context.state)
    return lam, NewtonResult(False, None, u, None, lam, 0)


def test_steps_by_hand_are_the_iteration():
    """`observe`, `terminate`, `step` in turn give the residuals and the solution that `newton` gives."""
    eq = pressed()
    lam, result = start(eq)
    whole = newton(eq, initial_guess(eq, result.u, lam), lam, result)
    assert isinstance(whole, Evaluation)
    lam, again = start(eq)
    state, end = init(eq, initial_guess(eq, again.u, lam), lam), None
    while end is None:
        observe(eq, state, again)
        end = terminate(eq, state, again) or step(eq, state, again)
        state.iteration += 1
    assert isinstance(end, Evaluation)
    assert again.residuals == result.residuals and len(again.residuals) > 2
    assert np.array_equal(again.u, result.u)


def test_the_state_lets_its_matrix_go():
    """After the guess is taken the state alone has the evaluation; after a step it has that of the new iterate."""
    eq = pressed()
    lam, result = start(eq)
    guess = Guess(result.u, eq.evaluate(result.u, lam))
    state = init(eq, guess, lam)
    assert guess.evaluation is None
    observe(eq, state, result)
    before = state.iterate.evaluation
    assert before is not None and before.data is not None
    assert step(eq, state, result) is None
    assert state.iterate.evaluation is not before


def test_an_iterate_that_cannot_be_evaluated_is_a_reason():
    """An element turned inside out is a value, no exception."""
    eq = pressed()
    lam, result = start(eq)
    u = result.u.copy()
    u[1 : 2 * eq.system.nodes : 2] = -2.0 * eq.system.X[:, 1]
    assert isinstance(newton(eq, Guess(u), lam, result), Unevaluable)


def test_slip_that_turns_is_seen():
    """Points that slip along + and then along −, and only those."""
    before, now = np.array([2, 6, 2, 1, 0, 6], dtype=np.int8), np.array([6, 2, 2, 2, 6, 1], dtype=np.int8)
    assert reversed_slip(before, now).tolist() == [True, True, False, False, False, False]
    assert not reversed_slip(None, now).any()
    # in space eighths of a turn are told apart: more than a right angle is a reversal
    before, now = np.array([2, 2, 2, 2, 9], dtype=np.int8), np.array([4, 5, 7, 8, 3], dtype=np.int8)
    assert reversed_slip(before, now).tolist() == [False, True, True, False, False]


def test_a_shortened_step_along_a_curved_tool_keeps_the_gaps_of_the_linear_model():
    """A block that is moved past a cylinder has its closed points where that has them, a straight step has not."""
    eq = pressed()
    lam, result = start(eq)
    e = newton(eq, initial_guess(eq, result.u, lam), lam, result)
    assert isinstance(e, Evaluation)
    u, delta = result.u, np.zeros(eq.system.ndof)
    eq.system.displacement(delta)[:, 0] = -0.1
    found, _ = _shortened(eq, u, delta, e, lam)
    f = (eq.system.displacement(found) - eq.system.displacement(u))[0, 0] / -0.1
    assert any(f == pytest.approx(share) for share in eq.policy.line_search_factors)
    (gaps,), s = linear_gaps(e, f * delta), eq.system.surfaces[0]
    closed = gaps < 0
    assert closed.any()
    np.testing.assert_allclose(eq.system.stencils(s, found).g[closed], gaps[closed], rtol=1e-9)
    straight = eq.system.stencils(s, u + f * delta).g[closed]
    assert (np.abs(straight - gaps[closed]) > 1e-3 * np.abs(gaps[closed])).all()


def test_the_secant_keeps_the_direction_of_flow():
    """Half the way is the mean of tangent and secant; that is θ times the elastic moduli in shear; stresses stay."""
    from prensa.materials.material import material_of
    from prensa.materials.protocol import At, Out

    law = material_of(pr.J2(E=1e3, nu=0.3, flow=pr.Voce(s0=1.0, Q=1.0, b=10.0)), "small", "plane strain")
    strain = np.array([[0.02, 0.01, 0.01, -0.015, 0.0]])
    found = []
    for secant in (0.0, 0.5, 1.0):
        out = Out(np.zeros((1, 5)), np.zeros((1, 5, 5)), np.zeros((1, law.size)), np.zeros(1, dtype=bool))
        law.update(strain, np.zeros((1, law.size)), At(1.0, 1.0, secant=secant), out)
        found.append((out.P[0], out.A[0]))
    (P, tangent), (_, half), (Q, full) = found
    np.testing.assert_array_equal(P, Q)
    np.testing.assert_allclose(half, 0.5 * (tangent + full), rtol=1e-12, atol=1e-9)
    G = 1e3 / 2.6
    trace = strain[0, 0] + strain[0, 3]
    deviator = 2 * G * (strain[0, 0] - trace / 3)
    theta = (P[0] - P[[0, 3, 4]].mean()) / deviator
    assert 0.01 < theta < 0.3
    np.testing.assert_allclose(full[0, 0] - full[0, 3], 2 * G * theta, rtol=1e-10)
    np.testing.assert_allclose(full[1, 1], G * theta, rtol=1e-10)
    assert np.linalg.eigvalsh(full[np.ix_([0, 3, 4], [0, 3, 4])]).min() > 0
    assert tangent[0, 0] < full[0, 0]


@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
@pytest.mark.parametrize("element", ["q4", "q4_enhanced", "q4_sheet"])
def test_the_secant_of_an_element_gives_back_its_forces(element, space):
    """In small strain, flowing from rest, stresses are secant moduli times strains: forces are the matrix times displacements.

    Of enhanced elements that holds with their modes, whose forces vanish, and so with what is left when they are eliminated.
    """
    metal = pr.J2(E=1e3, nu=0.3, flow=pr.Voce(s0=1.0, Q=1.0, b=10.0))
    problem = single_block(
        pr.Step("bend", by={"b.top": pr.Motion(x=0.1)}), material=metal, size=(3, 2), n=(3, 2), origin=(1, 0),
        element=element, fixed={"b.bottom": "xy"}, space=space, kinematics="small",
    )  # fmt: skip
    system = pr.discretise(problem)
    state = system.initial()
    c = system.context(state, plan_step(system, 0, state.step_start), 1.0)
    u = 0.01 * np.random.default_rng(7).normal(size=system.ndof)
    found = {s: system.evaluate(c, u, state.lam, secant=s) for s in (0.0, 1.0)}
    np.testing.assert_array_equal(found[0.0].r, found[1.0].r)
    r, pattern = found[1.0].r, system.pattern
    secant, tangent = (csc_matrix((found[s].data, pattern.indices, pattern.indptr)) @ u for s in (1.0, 0.0))
    np.testing.assert_allclose(secant, r, rtol=0, atol=1e-9 * np.abs(r).max())
    assert np.abs(tangent - r).max() > 0.05 * np.abs(r).max()


def test_steps_may_go_far_until_one_has_failed():
    """A block that nothing but contact holds: at the first attempt at an increment; one that stands on its support: always."""
    from prensa.linear.rigid_modes import loose_bodies
    from prensa.solver.time_stepping import Messages, TimeStepping
    from prensa.timer import Timer

    metal = pr.J2(E=1e3, nu=0.3, flow=pr.Voce(s0=1.0, Q=1.0, b=10.0))
    for held, expected in ({"b.left": "x"}, (True, False)), ({"b.bottom": "xy"}, (True, True)):
        problem = squeezed_block(
            stroke(-0.05), material=metal, size=(2, 1), n=(4, 2), friction=pr.Coulomb(0.1), fixed=held
        )
        system, policy = pr.discretise(problem), Policy()
        run = TimeStepping(system, pr.Numerics(), policy, Messages(system, None), Timer(), condense=False)
        state = system.initial()
        plan = plan_step(system, 0, state.step_start)
        run.prepare(plan)
        assert bool(run.loose) == bool(loose_bodies(system, plan)) == (not expected[1])
        c = run.context(state, plan, 0.1)
        assert tuple(run.equilibrium(c, uncut=uncut).may_go_far for uncut in (True, False)) == expected


def test_a_node_that_lands_on_a_wedge_takes_few_iterations():
    """Half of a sheet drawn through a wedge, nearly rigid (with the tangent alone: 3.9 iterations an increment and 3 cuts)."""
    from prensa.verify.sliding import FLOW, drawing

    problem = drawing(1 / 6, 4, 5800 * FLOW.s0, travel=0.8)
    steps = (replace(problem.steps[0], increments=48),)
    spent = [(i.statistics.iterations, i.statistics.cutbacks) for i in pr.solve(replace(problem, steps=steps))]
    assert sum(n for n, _ in spent) <= 3.75 * len(spent)
    assert sum(cuts for _, cuts in spent) <= 1


def first_step(example: str, way: float, increments: int) -> pr.Problem:
    """The first step of an example, with its punch going a part of its way."""
    path = Path(__file__).parents[2] / "examples" / example
    case = pr.load(path, [f"steps.0.move.punch.y={way}", f"steps.0.increments={increments}"])
    return replace(case.problem, steps=case.problem.steps[:1])


def test_what_contact_steps_have_settled_newton_finishes():
    """Sheets over a punch and over fillets: 3.8 iterations an increment and 187 in all (4.2, and 260 with 5 cuts, if contact
    steps go on to the end).
    """
    problem = pressed_block(
        stroke(12.0, name="stretch"), tools={"t": pr.Circle(20.0, below="b.bottom")},
        material=pr.J2(210e3, 0.3, pr.Swift(560.0, 0.007, 0.26)), size=(30, 1), n=(60, 2), sides=("bottom",),
        friction=pr.Coulomb(0.1), fixed={"b.right": "xy"}, space="axisymmetric",
    )  # fmt: skip
    spent = [i.statistics.iterations for i in pr.solve(problem)]
    assert sum(spent) <= 4.0 * len(spent)
    assert sum(spent) <= 260
    bent = [i.statistics for i in pr.solve(first_step("u_bending.yaml", -3.5, 35))]
    assert sum(s.iterations for s in bent) <= 220
    assert sum(s.cutbacks for s in bent) <= 2


def best_of(eq: Equilibrium, u: np.ndarray, step: np.ndarray, lam: np.ndarray) -> Best:
    """An iterate to which the line search goes back."""
    e = eq.evaluate(u, lam)
    return Best(eq.norm(e), u, step, e)


def test_an_attempt_ends_where_no_part_of_a_step_lowers_the_residual_a_second_time_in_an_active_set():
    """Steps up the residual: the first is walked on from, the second too if another set of points is closed; then it ends."""
    eq = pressed()
    lam, result = start(eq)
    e = newton(eq, initial_guess(eq, result.u, lam), lam, result)
    assert isinstance(e, Evaluation)
    up, lifted = np.zeros(eq.system.ndof), result.u.copy()
    eq.system.displacement(up)[:, 1] = -1e-3
    eq.system.displacement(lifted)[:, 1] -= 1e-4
    touching, apart = (best_of(eq, u, up, lam) for u in (result.u, lifted))
    assert not np.array_equal(signature(touching.e), signature(apart.e))
    for at, another in ((touching, apart), (apart, touching)):
        state = init(eq, Guess(result.u), lam)
        assert _search_line(eq, state, result, at) is None and state.stuck
        assert _search_line(eq, state, result, another) is None and len(state.stuck) == 2
        assert isinstance(_search_line(eq, state, result, at), Stagnated)


def test_a_step_that_lowers_the_residual_is_nowhere_stuck():
    """Newton's own step, shortened: never an end, however often."""
    eq = pressed()
    lam, result = start(eq)
    u = initial_guess(eq, result.u, lam).u
    e = eq.evaluate(u, lam)
    down = eq.reduced.solve(eq.reduced.matrix(e, -e.r), -e.r)
    state = init(eq, Guess(u), lam)
    for _ in range(3):
        assert _search_line(eq, state, result, best_of(eq, u, down, lam)) is None
    assert not state.stuck


def test_a_strip_with_exact_contact_and_friction_is_drawn_to_its_end():
    """It is on its way by small steps where the least residual does not halve in six iterations, which once ended attempts."""
    problem, numerics = problems()["exact 1"].pose()
    last = list(pr.solve(problem, numerics))[-1]
    assert last.end_of_step and last.time == len(problem.steps)
