"""Newton's steps by factors of single precision, or of a matrix before, and GMRES: as good as double ones, or not taken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix, diags_array, tril

import prensa as pr
from prensa.linear import factorisations
from prensa.linear.factorisations import Factorisation, krylov
from prensa.policy import Policy
from prensa.solver import newton
from prensa.solver.equilibrium import Equilibrium
from prensa.system.state import State
from prensa.verify.forming import upsetting

pytest.importorskip("rslab")
NUMERICS = pr.Numerics(solver="rslab")
ALWAYS, NEVER = Policy(single_precision_from=1), Policy(single_precision_from=10**9)


def grid(n: int, skew: float = 0.0, hold: float = 0.1) -> csc_matrix:
    """Conduction on a square (n², n²), with convection ``skew``, insulated but for losses ``hold`` everywhere."""
    near = np.where(np.arange(n * n - 1) % n == n - 1, 0.0, 1.0)
    far = np.ones(n * n - n)
    a = csc_matrix(diags_array([-far, -near * (1 - skew), -near * (1 + skew), -far], offsets=[-n, -1, 1, n]))
    out = csc_matrix(a + diags_array([hold - a @ np.ones(n * n)], offsets=[0]))
    out.sort_indices()
    return out


def factorisation(a: csc_matrix, symmetric: bool = False, policy: Policy = ALWAYS) -> Factorisation:
    """Of a matrix with rslab."""
    return Factorisation(a.shape[0], a.indptr, a.indices, "rslab", symmetric=symmetric, policy=policy)


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("share", [1e-3, 1e-7, 1e-12])
def test_a_step_leaves_no_more_than_its_share(symmetric, share):
    """Residuals are what was asked for, whatever the size of the right-hand side; factors are of single precision."""
    a = grid(20, 0.0 if symmetric else 0.3)
    f = factorisation(a, symmetric)
    for size in (1.0, 1e-60, 1e60):
        b = size * np.sin(np.arange(400.0))
        x = f.step(a.data, b, share)
        assert f.made_from is not None and f.made_from.dtype == np.float32 and f.own
        assert np.linalg.norm(b - a @ x) <= 2.0 * share * np.linalg.norm(b)
    np.testing.assert_array_equal(f.step(a.data, np.zeros(400), share), 0.0)


def test_factors_of_a_matrix_before_are_taken_where_it_is_alike_and_new_ones_where_it_is_not():
    """The factors stay as long as GMRES with them is short; corrections answer for the last matrix all the same."""
    a = grid(20, 0.3)
    near, other = a.copy(), grid(20, -0.9)
    near.data = a.data * (1.0 + 0.003 * np.sin(np.arange(a.nnz)))
    f, b = factorisation(a), np.cos(np.arange(400.0))
    f.step(a.data, b, 1e-7)
    first = f.made_from
    x = f.step(near.data, b, 1e-7, changed=0)
    assert f.made_from is first
    assert np.linalg.norm(b - near @ x) <= 2e-7 * np.linalg.norm(b)
    assert np.linalg.norm(b - near @ f.correction(b)) <= 2e-3 * np.linalg.norm(b)
    assert np.linalg.norm(b - near @ f.solve_with_factors(b)) > 2e-3 * np.linalg.norm(b)  # what those factors alone would leave
    f.step(other.data, b, 1e-7, changed=0)
    assert f.made_from is not first
    f.step(near.data, b, 1e-7)  # not said to be alike
    np.testing.assert_array_equal(f.made_from, near.data.astype(np.float32))


@pytest.mark.parametrize("bad", ["ill", "large"])
def test_a_matrix_that_single_precision_cannot_bear_is_factored_in_double(bad):
    """Too ill conditioned, or beyond the range: the answer is that of `solve`, and the rest of the attempt stays with double."""
    good = grid(20, 0.3)
    a = grid(20, 0.3, 1e-11) if bad == "ill" else 1e60 * good
    b = a @ np.sin(np.arange(400.0)) if bad == "large" else np.ones(400)
    f = factorisation(a)
    x = f.step(a.data, b, 1e-7)
    assert f.made_from is None
    np.testing.assert_array_equal(x, factorisation(a, policy=NEVER).solve(a.data, b))
    f.step(good.data, b, 1e-7)
    assert f.made_from is None
    f.begin()
    f.step(good.data, b, 1e-7)
    assert f.made_from is not None


def test_an_attempt_depends_on_the_values_its_factors_are_made_from_alone():
    """Whether the factors are at hand or made again: same bits."""
    a = grid(20, 0.3)
    near = a.data * (1.0 + 0.003 * np.sin(np.arange(a.nnz)))
    f, other, b = factorisation(a), factorisation(a), np.cos(np.arange(400.0))
    f.step(a.data, b, 1e-7)
    kept = f.made_from
    f.begin(kept)
    other.begin(kept.copy())
    assert f.step(near, b, 1e-7, changed=0).tobytes() == other.step(near, b, 1e-7, changed=0).tobytes()
    assert not f.own and not f.positive
    f.begin(kept[:-1])  # of another pattern
    assert not f.factored


def test_of_a_symmetric_matrix_half_is_kept():
    """Factors LDLᵀ are of the values of the lower triangle, by columns; with those an attempt begins, not with all of them."""
    a, b = grid(20), np.cos(np.arange(400.0))
    f = factorisation(a, symmetric=True)
    f.step(a.data, b, 1e-7)
    np.testing.assert_array_equal(f.made_from, csc_matrix(tril(a)).data.astype(np.float32))
    kept, before = f.made_from, f.solve_with_factors(b)
    f.begin(a.data.astype(np.float32))
    assert not f.factored
    f.begin(kept.copy())
    assert f.factored and f.solve_with_factors(b).tobytes() == before.tobytes()


def test_newton_goes_on_from_an_iterate_that_could_not_be_finished(monkeypatch):
    """Large systems keep neither its matrix nor its history meanwhile; forces and iterations are those of systems that do."""
    problem, held, failed = upsetting((8, 6), 0.1, increments=3, reductions=(0.05,)), [], []
    plain, handed = newton.finish, newton._handed_over

    def noted(eq, state):
        out = handed(eq, state)
        held.append(len(state.iterate.evaluation.history) > 0)
        return out

    def failing(eq, *args):
        done, converged = plain(eq, *args)
        if converged and len(failed) < 2 and done.u is not args[0]:
            failed.append(True)
            return done, False
        return done, converged

    monkeypatch.setattr(newton, "_handed_over", noted)
    monkeypatch.setattr(newton, "finish", failing)
    runs = []
    for policy in (ALWAYS, NEVER):
        held.clear()
        failed.clear()
        runs.append(run(problem, policy))
        assert len(failed) == 2 and set(held) == {policy is NEVER}
    for one, other in zip(*runs, strict=True):
        assert one.statistics.iterations == other.statistics.iterations
        assert one.force("punch").y == pytest.approx(other.force("punch").y, rel=1e-9)


def test_systems_are_solved_to_what_steps_promise(monkeypatch):
    """The square of the last ratio of residuals: fewer substitutions, no iteration more, forces to 1e-9."""
    state = newton.NewtonState(newton.Iterate(np.zeros(1)), np.zeros((0, 2)))
    assert state.promised == 0.0
    state.least = [1.0, 0.1, 0.02]
    assert state.promised == pytest.approx(0.04)
    solves = []
    plain = factorisations.krylov
    monkeypatch.setattr(factorisations, "krylov", lambda A, solve, *a: plain(A, lambda b: solves.append(1) or solve(b), *a))
    problem = upsetting((10, 8), 0.1, increments=2, reductions=(0.1,))
    promised = run(problem, ALWAYS)
    few = len(solves)
    solves.clear()
    monkeypatch.setattr(newton.NewtonState, "promised", 0.0)
    exact = run(problem, ALWAYS)
    assert few < len(solves)
    assert [i.statistics.iterations for i in promised] == [i.statistics.iterations for i in exact]
    assert promised[-1].force("punch").y == pytest.approx(exact[-1].force("punch").y, rel=1e-9)


def test_what_is_nearly_converged_is_finished_with_its_own_matrix(monkeypatch):
    """Corrections are then Newton's steps: fewer evaluations, no iteration more, forces to 1e-9."""
    a = grid(20, 0.3)
    near, b = a.copy(), np.cos(np.arange(400.0))
    near.data = a.data * (1.0 + 0.003 * np.sin(np.arange(a.nnz)))
    f = factorisation(a)
    f.step(a.data, b, 1e-7)
    f.follow(near.data, 0)
    assert f.follows and np.linalg.norm(b - near @ f.correction(b, 1e-6)) <= 2e-6 * np.linalg.norm(b)
    evaluations = []
    plain = Equilibrium.evaluate
    monkeypatch.setattr(Equilibrium, "evaluate", lambda self, *a, **k: evaluations.append(1) or plain(self, *a, **k))
    problem = upsetting((10, 8), 0.1, increments=4, reductions=(0.05,))
    own = run(problem, ALWAYS)
    few = len(evaluations)
    evaluations.clear()
    monkeypatch.setattr(Factorisation, "follows", False)
    last = run(problem, ALWAYS)
    assert few < len(evaluations)
    assert [i.statistics.iterations for i in own] == [i.statistics.iterations for i in last]
    assert own[-1].force("punch").y == pytest.approx(last[-1].force("punch").y, rel=1e-9)


def column(n: int, load: float) -> csc_matrix:
    """A hinged column of n + 1 links that bend at n joints, under a multiple of its load of buckling.

    With D the second difference, D² − P D: eigenvalues μ (μ − P), the least 4 sin²(π/2(n + 1)) being the critical P.
    """
    D = diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    out = csc_matrix(D @ D - load * 4.0 * np.sin(np.pi / (2 * n + 2)) ** 2 * D)
    out.sort_indices()
    return out


@pytest.mark.parametrize("load", [0.0, 0.9, 0.999, 1.001, 1.1, 2.0])
def test_slender_columns_are_not_called_stable_by_factors_of_single_precision_that_cannot_tell(load):
    """Whatever the slenderness, no column that buckles is called stable; short ones are judged, long ones not by single ones."""
    resolved = {}
    for n in (10, 20, 40, 60, 80, 100, 150, 200, 400):
        a = column(n, load)
        f = factorisation(a, symmetric=True)
        f.step(a.data, np.sin(np.arange(float(n))), 1e-4)
        assert not (f.positive and load > 1.0), n
        resolved[n] = f.positive
        if f.made_from is not None and f.own:  # they say that they know
            assert f.positive == (load < 1.0), n
    assert resolved[10] == (load < 1.0)


def test_factors_of_single_precision_alone_would_call_a_buckling_column_stable():
    """What the check is for: believed, factors in single precision have no negative pivot for this one."""
    a = column(400, 1.1)
    believed = factorisation(a, True, Policy(single_precision_from=1, soft_mode_error=np.inf))
    believed.step(a.data, np.sin(np.arange(400.0)), 1e-4)
    assert believed.made_from is not None and believed.positive


@pytest.mark.parametrize("load", [0.0, 0.5, 0.9, 1.1, 1.5])
def test_modes_that_such_factors_cannot_resolve_are_found_with_the_matrix(load):
    """Inverse iteration with the matrix itself finds the sign of the softest mode where GMRES leads to it, else nothing."""
    answered = 0
    for n in (60, 80, 100, 150, 200, 400):
        a = column(n, load)
        f = factorisation(a, symmetric=True)
        x: np.ndarray | None = np.random.default_rng(0).standard_normal((n, 1))
        f.step(a.data, np.sin(np.arange(float(n))), 1e-4)
        for _ in range(3):
            b = x / np.linalg.norm(x)
            x = f.exactly(b, 1e-4)
            if x is None:
                break
            assert np.linalg.norm(b - a @ x) <= 2e-4
        if x is not None:
            assert (float((x.T @ b).item()) < 0.0) == (load > 1.0)
            answered += not f.own
    assert answered >= 1 or load > 1.0  # what pivots show is left to them


@pytest.mark.parametrize("symmetric", [True, False])
def test_the_softest_mode_agrees_with_inverse_iteration(symmetric):
    """What the factors leave of the softest mode that was looked for decides as a check of its own does, on both sides."""
    verdicts = set()
    for n in (20, 60, 100, 200, 300, 400):
        for load in (0.0, 0.9, 1.1):
            a = column(n, load)
            f, other = (factorisation(a, symmetric=symmetric) for _ in range(2))
            for each in (f, other):
                each.step(a.data, np.sin(np.arange(float(n))), 1e-4)
            x = np.random.default_rng(0).standard_normal(n)
            for _ in range(3):
                b = x / np.linalg.norm(x)
                x = f.solve_with_factors(b)
            assert f.may_resolve_soft_modes
            resolved = f.resolves_soft_modes(b, x)
            assert resolved == other.own and f.may_resolve_soft_modes == resolved, (n, load)
            verdicts.add(resolved)
    assert verdicts == {True, False}


def test_modes_take_no_factors_of_double_precision_where_single_ones_help(monkeypatch):
    """Factors that cannot tell the modes: the same stiffness of the softest ones, no factor of double precision."""
    kinds = []
    plain = factorisations.BACKENDS["rslab"]

    def noted(structure):
        factor = plain(structure)

        def noting(values):
            kinds.append(values.dtype)
            return factor(values)

        return noting

    monkeypatch.setitem(factorisations.BACKENDS, "rslab", noted)
    problem = upsetting((8, 6), 0.1, increments=3, reductions=(0.05,))
    sure, unsure = (Policy(single_precision_from=1, soft_mode_error=telling) for telling in (0.1, 0.0))
    known = list(pr.solve(problem, NUMERICS, policy=sure))
    kinds.clear()
    found = list(pr.solve(problem, NUMERICS, policy=unsure))
    assert set(kinds) == {np.dtype(np.float32)}
    for a, b in zip(known, found, strict=True):
        assert a.force("punch").y == b.force("punch").y and a.state.stability.negative == b.state.stability.negative == 0


def test_gmres_is_given_up_where_it_takes_too_long():
    """At its rate, or at the end."""
    a, b = grid(20), np.cos(np.arange(400.0))
    assert krylov(a, lambda r: r, b, 8, 1e-12) is None
    assert krylov(a, lambda r: r, np.full(400, np.nan), 8, 1e-7) is None


def run(problem: pr.Problem, policy: Policy, threads: int = 1, start: State | None = None) -> list[pr.Increment]:
    """The increments of a problem."""
    return list(pr.solve(problem, pr.Numerics(threads=threads, solver="rslab"), start=start, policy=policy))


def test_upsetting_takes_the_same_increments_and_is_resumed_bit_for_bit():
    """Increments and iterations of double precision, forces to 1e-9; going on from a state, with any threads, changes nothing."""
    problem = upsetting((10, 8), 0.1, reductions=(0.05,))
    single, double = run(problem, ALWAYS), run(problem, NEVER)
    assert [i.time for i in single] == [i.time for i in double]
    assert sum(i.statistics.iterations for i in single) <= sum(i.statistics.iterations for i in double)
    for one, other in zip(single, double):
        assert one.force("punch").y == pytest.approx(other.force("punch").y, rel=1e-9)
    made = [i.state.made_from for i in single]
    reused = [k for k in range(1, len(made)) if made[k] is not None and made[k] is made[k - 1]]
    assert reused and all(m is None for m in (i.state.made_from for i in double))
    at = reused[len(reused) // 2] - 1
    for threads in (1, 2):
        start = State.from_arrays(single[at].state.arrays())
        rest = run(problem, ALWAYS, threads, start)
        assert rest[-1].state.u.tobytes() == single[-1].state.u.tobytes()
        assert len(rest) == len(single) - at - 1


@pytest.mark.parametrize(
    ("enforcement", "error"),
    # gaps of so stiff a penalty are next to the round-off of places
    [(pr.Penalty(), 1e-10), (pr.Penalty(beta=1e6), 1e-7), (pr.Exact(), 1e-11), (pr.Augmented(), 1e-9)],
)
@pytest.mark.parametrize("nu", [0.3, 0.4999])
def test_stiff_exact_and_incompressible_ones_have_the_forces_of_double_precision(enforcement, error, nu):
    """Whether single precision bears them or gives way: no more iterations, and the same force."""
    confined = (1.0 - nu) ** 2 / (1.0 - 2.0 * nu)  # M/E*: springs are as much stiffer, and the round-off of their gaps is
    error *= confined
    if enforcement.beta > 1e3:
        enforcement = pr.Penalty(beta=enforcement.beta / confined)
    base = upsetting((6, 5), 0.1, enforcement=enforcement, reductions=(0.01,), increments=2)
    body = base.bodies["billet"]
    problem = replace(base, bodies={"billet": replace(body, material=pr.NeoHooke(E=200e3, nu=nu))})
    single, double = run(problem, ALWAYS), run(problem, NEVER)
    assert sum(i.statistics.iterations for i in single) <= sum(i.statistics.iterations for i in double)
    for one, other in zip(single, double):
        assert one.force("punch").y == pytest.approx(other.force("punch").y, rel=error)


@pytest.mark.parametrize("solver", ["rslab", "superlu"])
@pytest.mark.parametrize("coarse", [False, True])
def test_kept_factors_solve_with_the_transpose_after_others_have_come(solver: str, coarse: bool) -> None:
    """Factors that are kept outlive those of another matrix, in both precisions and with scaled unknowns; they say their size."""
    a, b = grid(12, skew=0.4), np.random.default_rng(1).normal(size=144)
    scale = np.exp2(np.arange(144) % 3)
    f = Factorisation(144, a.indptr, a.indices, solver, policy=ALWAYS, scale=scale)
    assert f.kept() is None
    if coarse and solver == "superlu":
        assert not f.coarse(a.data)
        return
    assert f.coarse(a.data) if coarse else len(f.solve(a.data, b))
    kept = f.kept()
    f.solve(3.0 * a.data, b)
    assert kept is not None
    assert f.kept().factors is not kept.factors
    assert kept.size > 8 * 144
    x = kept.transposed(b)
    assert np.abs(a.T @ x - b).max() <= (1e-4 if coarse else 1e-12) * np.abs(b).max()
