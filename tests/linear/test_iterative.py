"""Linear systems in space by GMRES: answers of a direct solver whatever P is worth, reported fallbacks, modes, restarts."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.errors import ArgumentError, CaseError
from prensa.linear import iterative
from prensa.linear.factorisations import krylov
from prensa.linear.iterative import NodalMatrix, geometry_of
from prensa.linear.multigrid import Multigrid
from prensa.linear.reduction import Reduced
from prensa.model.schema import dump, loads
from prensa.policy import Policy
from prensa.solver.softest_modes import softest_modes
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step

STEEL = pr.J2(200e3, 0.3, pr.Swift(K=600.0, e0=0.01, n=0.2))
SHAPES = {"cubes": (4.0, 4.0, 4.0), "flat": (4.0, 0.8, 4.0), "drawn": (4.0, 20.0, 4.0)}


def billet(size=(4.0, 4.0, 4.0), n=4, mu=0.3, material=STEEL, increments=2):
    """An eighth of a billet, upset by 4 % between plates on which it slides and sticks."""
    return pr.Problem(
        "billet", space="solid", friction=pr.Coulomb(mu), bodies={"b": pr.Body(pr.Box(size, (n, n, n)), material)},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),),
        fixed={"b.bottom": "y", "b.left": "x", "b.back": "z"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.04 * size[1])}, increments=increments),),
    )  # fmt: skip


def system_of(problem, solver):
    """A sliding, plastic state of a problem: the equations of its last increment by a solver, their matrix and a load."""
    system = discretise(problem)
    first, last = pr.solve(system, pr.Numerics(solver="superlu"))
    state, plan = first.state, plan_step(system, 0, np.zeros(system.ndof))
    c = system.context(state, plan, last.time)
    e = system.evaluate(c, last.state.u, state.lam)
    assert sum(f.slip.sum() for f in e.contacts) > 3
    reduced = Reduced.of(system, plan.fixed, pr.Numerics(solver=solver))
    matrix, b = reduced.matrix(e, -e.r), np.random.default_rng(1).standard_normal(len(reduced.free))
    return system, reduced, matrix, b


@pytest.fixture(scope="module")
def sliding():
    """Systems of the three shapes, solved by LDLᵀ."""
    return {name: system_of(billet(size), "ldlt") for name, size in SHAPES.items()}


def spectrum(A):
    """Eigenvalues of the symmetric part of a matrix."""
    dense = A.toarray()
    return np.linalg.eigvalsh(0.5 * (dense + dense.T))


def test_p_is_symmetric_and_definite_where_the_symmetric_part_is_not(sliding):
    """P is A's symmetric part but for elements (below) and for contact, where that is negative and of the penalty's size."""
    _, reduced, matrix, _ = sliding["cubes"]
    A, f = reduced.restriction.sparse(matrix), reduced.factorisation
    numbers = matrix[f._entries :]
    p = f._symmetric_values(f._tangent(matrix), numbers)
    P = reduced.restriction.sparse(p)
    assert abs(P - P.T).max() <= 1e-12 * abs(P).max()
    elements, away = f.part.of_elements(numbers, apart=False), np.setdiff1d(np.arange(len(p)), f.part.places)
    assert 0 < abs(elements).max() < 0.05 * abs(p).max()
    half = (0.5 * (A + A.T)).tocsc()
    half.sort_indices()
    assert np.allclose(p[away], (half.data + elements)[away], rtol=1e-12, atol=1e-9) and len(f.part.places) > 0
    own, part = spectrum(P), spectrum(A)
    assert own[0] > 0
    assert part[0] < -0.01 * part[-1]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("solver", ["ldlt", "multigrid"])
def test_solutions_are_those_of_the_matrix(sliding, shape, solver):
    """Solutions are exact to 1e-10, steps to their share; few iterations, on cubes, with lines and with long aggregates."""
    system, reduced, matrix, b = sliding[shape]
    policy = Policy(multigrid_coarsest=60)
    made = Reduced.of(system, reduced.fixed, pr.Numerics(solver=solver), policy=policy)
    f, A = made.factorisation, made.restriction.sparse(matrix)
    x = f.solve(matrix, b)
    assert np.linalg.norm(A @ x - b) <= 1e-10 * np.linalg.norm(b)
    f.begin()
    x = f.step(matrix, b, 1e-5)
    assert np.linalg.norm(A @ x - b) <= 2e-5 * np.linalg.norm(b)
    assert 0 < f.krylov_iterations <= (25 if solver == "ldlt" else 100) and f.name == solver
    other = np.random.default_rng(2).standard_normal((len(b), 2))
    for answer, share in ((f.solve_with_factors(other), 1e-6), (f.exactly(other, 0.01), 0.02)):
        assert np.linalg.norm(A @ answer - other) <= share * np.linalg.norm(other)
    x = f.correction(b)
    assert np.linalg.norm(A @ x - b) <= 2e-3 * np.linalg.norm(b)
    if solver == "multigrid":
        assert f._nodal is not None


@pytest.mark.parametrize("shape", ["cubes", "flat"])
def test_runs_are_those_of_the_direct_solver(shape):
    """Forces to 1e-8, at most 1.3 times the iterations; the linear solver's are counted."""
    found = {}
    for solver in ("superlu", "ldlt", "multigrid"):
        *_, found[solver] = pr.solve(billet(SHAPES[shape]), pr.Numerics(solver=solver))
    direct = found.pop("superlu")
    assert direct.statistics.krylov == 0
    for other in found.values():
        assert np.allclose(other.force("t"), direct.force("t"), rtol=1e-8, atol=1e-8 * abs(direct.force("t").y))
        assert other.statistics.iterations <= 1.3 * direct.statistics.iterations + 1
        assert other.statistics.krylov > 0


def test_steps_are_solved_as_far_as_newton_uses_them(monkeypatch):
    """What GMRES may leave is a tenth of the relative residual, between 1e-7 and 1e-4; the true residual is no more than that."""
    asked, step = [], iterative.Iterative.step

    def watched(self, values, b, share, changed=None):
        x = step(self, values, b, share, changed)
        r = self._tangent(values) @ (x / self._scaled(np.ones_like(b))) - self._scaled(b)
        asked.append((share, np.linalg.norm(r) / np.linalg.norm(self._scaled(b))))
        return x

    monkeypatch.setattr(iterative.Iterative, "step", watched)
    list(pr.solve(billet(n=3), pr.Numerics(solver="ldlt")))
    policy, shares = Policy(), [share for share, _ in asked]
    assert all(policy.min_forcing <= share <= policy.max_forcing for share in shares) and len(set(shares)) > 1
    assert all(left <= 2.0 * share for share, left in asked)


def test_contact_steps_in_space_are_for_few_points(monkeypatch):
    """By GMRES each point of a contact step costs a solution: more points than a few are left to Newton's iteration."""
    columns, responses = [], Reduced.responses

    def counted(self, loads, of):
        columns.append((self.factorisation.iterates, loads.shape[0]))
        return responses(self, loads, of)

    monkeypatch.setattr(Reduced, "responses", counted)
    hard = replace(billet(n=3).steps[0], move={"t": pr.Motion(y=-0.6)}, increments=1)
    forces = []
    for solver in ("superlu", "ldlt"):
        columns.clear()
        *_, last = pr.solve(replace(billet(n=3), steps=(hard,)), pr.Numerics(solver=solver), policy=Policy(few_candidates=8))
        forces.append(last.force("t").y)
        many = max((count for _, count in columns), default=0)
        assert many > 8 if solver == "superlu" else many <= 8
    assert forces[1] == pytest.approx(forces[0], rel=0.01)


def test_a_useless_p_ends_in_lu(monkeypatch, caplog):
    """With a P that has nothing to do with A no answer is wrong: LU of A takes over, and the log says so, once as a warning."""
    problem = billet(n=3)
    *_, right = pr.solve(problem, pr.Numerics(solver="superlu"))

    def broken(self, A, more, apart=False):
        return np.random.default_rng(0).standard_normal(A.nnz)

    monkeypatch.setattr(iterative.Iterative, "_symmetric_values", broken)
    for solver in ("ldlt", "multigrid"):
        caplog.clear()
        with caplog.at_level(logging.INFO, "prensa"):
            *_, found = pr.solve(problem, pr.Numerics(solver=solver))
        assert found.force("t").y == pytest.approx(right.force("t").y, rel=1e-8)
        assert any("LU of the tangent takes over" in r.getMessage() for r in caplog.records)
        warned = {r.getMessage() for r in caplog.records if r.levelno == logging.WARNING}
        assert any("LU of the tangent took over" in w for w in warned)


def test_too_many_cycles_turn_to_ldlt(sliding, caplog):
    """Multigrid that needs more iterations than allowed hands over to LDLᵀ, for the rest of the attempt alone."""
    system, reduced, matrix, b = sliding["cubes"]
    policy = Policy(multigrid_coarsest=60, krylov_max_iterations=8)
    f = Reduced.of(system, reduced.fixed, pr.Numerics(solver="multigrid"), policy=policy).factorisation
    x = f.step(matrix, b, 1e-6)
    A = reduced.restriction.sparse(matrix)
    assert np.linalg.norm(A @ x - b) <= 2e-6 * np.linalg.norm(b)
    assert f.name == "ldlt" and "8 iterations" in f.fell_back[0]
    assert "multigrid did not solve all systems; LDLᵀ of the symmetric part took over" in caplog.text
    f.begin()
    assert f.name == "multigrid" and not f.fell_back


def test_a_run_whose_multigrid_fails_is_solved_by_ldlt_and_says_so(monkeypatch, tmp_path):
    """With cycles that correct nothing LDLᵀ solves every step to its share; forces are those of LU, log and summary say so."""
    problem, left, step = billet(n=4), [], iterative.Iterative.step
    *_, right = pr.solve(problem, pr.Numerics(solver="superlu"))

    def watched(self, values, b, share, changed=None):
        x = step(self, values, b, share, changed)
        scale = self._scaled(np.ones_like(b))
        r = self._tangent(values) @ (x / scale) - scale * b
        left.append((self.name, np.linalg.norm(r) / np.linalg.norm(scale * b) / share))
        return x

    monkeypatch.setattr(iterative.Iterative, "step", watched)
    monkeypatch.setattr(Multigrid, "__call__", lambda self, r: r)
    case = pr.Case(problem, pr.Numerics(solver="multigrid"), pr.Output(pictures=False, report=False))
    found = pr.run(case, tmp_path / "out", quiet=True)
    assert left and {name for name, _ in left} == {"ldlt"} and all(share <= 2.0 for _, share in left)
    assert found.history["t.fy"][-1] == pytest.approx(right.force("t").y, rel=1e-8)
    said = "linear solver: multigrid did not solve all systems; LDLᵀ of the symmetric part took over where it did not"
    assert found.summary["linear_solver"]["solver"] == "multigrid" and found.summary["warnings"].count(said) == 1
    written = (tmp_path / "out" / "run.log").read_text(encoding="utf-8")
    assert written.count("multigrid does not lead to a solution in 100 iterations; LDLᵀ of the symmetric part takes over") >= 2
    assert "LU of the tangent" not in written


@pytest.mark.parametrize("solver", ["ldlt", "multigrid"])
def test_factors_of_an_earlier_matrix_give_way_to_new_ones(sliding, solver):
    """Where factors of a matrix before do not solve for a load those of the matrix itself do: no way is given up for it."""
    system, reduced, matrix, b = sliding["cubes"]
    f = Reduced.of(system, reduced.fixed, pr.Numerics(solver=solver), policy=Policy(multigrid_coarsest=60)).factorisation
    f.step(matrix, b, 1e-5)
    # the same system in other units of each unknown: easy for its own factors, hopeless for those of before
    d, structure = 10.0 ** np.random.default_rng(3).uniform(-1.5, 1.5, len(b)), f.direct.structure
    both = d[structure.indices] * np.repeat(d, np.diff(structure.indptr))
    other = matrix * np.concatenate([both, both[f.part.places], np.zeros(f.part.size - len(f.part.places))])
    f.follow(other, 0)
    x = f.solve_with_factors(b)
    A = reduced.restriction.sparse(other)
    assert np.linalg.norm(A @ x - b) <= 1e-6 * np.linalg.norm(b)
    assert f.name == solver and not f.fell_back


def test_a_matrix_s_own_factors_may_take_more_iterations_than_earlier_ones(sliding):
    """Own factors go on beyond the iterations at which those of an earlier matrix are given up; LU of A costs more."""
    system, reduced, matrix, b = sliding["cubes"]
    policy = Policy(ldlt_max_iterations=2)
    f = Reduced.of(system, reduced.fixed, pr.Numerics(solver="ldlt"), policy=policy).factorisation
    f.step(matrix, b, 1e-6)
    first = f.krylov_iterations
    assert first > 2 and f.name == "ldlt"
    f.step(matrix, b, 1e-6, changed=0)
    assert f.krylov_iterations - first <= 2 + first and f.name == "ldlt" and not f.fell_back


def test_a_singular_matrix_fails_in_words(sliding):
    """A matrix that no solver can factor is refused, as is one with entries that are not numbers."""
    _, reduced, matrix, b = sliding["cubes"]
    f = reduced.factorisation
    for values in (np.zeros_like(matrix), np.full_like(matrix, np.nan)):
        f.begin()
        with pytest.raises(ArithmeticError):
            f.solve(values, b)
    f.begin()


def test_factors_without_room_are_refused_in_words(sliding, monkeypatch):
    """Where neither LDLᵀ nor LU has room in the machine the system is refused, before anything is factored."""
    _, reduced, matrix, b = sliding["cubes"]
    monkeypatch.setattr(iterative, "machine_memory", lambda: 1e3)
    f = reduced.factorisation
    f.begin()
    with pytest.raises(ArithmeticError, match=r"are more than the 1e-06 GB of this machine"):
        f.step(matrix, b, 1e-5)
    f.begin()


def test_few_unknowns_of_tools_are_eliminated(sliding):
    """Unknowns without a node, as of a tool that is free to move, are solved for with multigrid of the nodes' blocks."""
    system, reduced, matrix, b = sliding["cubes"]
    f = reduced.factorisation
    p = f._symmetric_values(f._tangent(matrix), matrix[f._entries :])
    where, structure = geometry_of(system, reduced.free), f.direct.structure
    at = where.at.copy()
    at[-2:] = -1  # two of the nodes' unknowns stand for those of a tool
    free = where.nodes.free.copy()
    free.ravel()[where.at[-2:]] = False
    whole = where._replace(at=at, nodes=where.nodes._replace(free=free))
    cycle = NodalMatrix(structure.indptr, structure.indices, whole, Policy(multigrid_coarsest=60)).cycle(p)
    x = krylov(reduced.restriction.sparse(p), cycle, b, 60, 1e-8, least=60)
    assert x is not None


def column(elements=(2, 16, 2)):
    """A slender elastic column between a support and a plate on which it cannot slide."""
    p = billet((1.0, 16.0, 1.0), 2, 0.0, pr.Elastic(1000.0, 0.3))
    body = pr.Body(pr.Box((1.0, 16.0, 1.0), elements), pr.Elastic(1000.0, 0.3), "h8")
    return replace(p, bodies={"b": body}, fixed={"b.bottom": "xyz", "b.top": "xz"}, contact_geometry="current")


def test_modes_of_a_column_are_those_of_the_matrix():
    """Beyond a buckling load the negative ones of the four softest modes are those of the dense matrix; LDLᵀ, multigrid."""
    system = discretise(column())
    plan, state = plan_step(system, 0, np.zeros(system.ndof)), system.initial()
    for press in (0.001, 0.015):
        u = np.zeros(system.ndof)
        system.displacement(u)[:, 1] = -press * system.X[:, 1]
        e = system.evaluate(system.context(state, plan, press), u, state.lam)
        for solver in ("ldlt", "multigrid"):
            reduced = Reduced.of(system, plan.fixed, pr.Numerics(solver=solver), policy=Policy(multigrid_coarsest=60))
            matrix = reduced.matrix(e, -e.r)
            exact = spectrum(reduced.restriction.sparse(matrix))
            exact = exact[np.argsort(np.abs(exact))[:4]]
            reduced.step(matrix, -e.r, 1.0)
            modes = softest_modes(system, reduced, Policy(), exactly=True)
            assert modes is not None and modes.negative == (exact < 0).sum() == (2 if press > 0.01 else 0), (press, solver)
            assert modes.least == pytest.approx(exact[exact < 0].max() if modes.negative else exact.min(), rel=0.05)
            # pivots of P tell where P is the symmetric part of A: here, where nothing slides
            assert reduced.factorisation.positive == (solver == "ldlt" and press < 0.01)


def test_a_run_goes_on_to_the_same_bits():
    """From a committed state increments have the bits of the run that was not stopped."""
    problem, numerics = billet(n=3, increments=3), pr.Numerics(solver="ldlt")
    first, *_, last = pr.solve(problem, numerics)
    *_, again = pr.solve(problem, numerics, start=first.state)
    assert np.array_equal(again.state.u, last.state.u)


def test_chosen_by_size_and_refused_in_the_plane():
    """LU of small systems, LDLᵀ and multigrid of larger ones, as asked for otherwise; in the plane a line and a remedy."""
    auto, policy = pr.Numerics(), Policy()
    ways = [iterative.ways_of(auto, n, policy) for n in (9_000, 20_000, 200_000)]
    assert ways == [(), ("ldlt",), ("multigrid", "ldlt")]
    assert iterative.ways_of(pr.Numerics(solver="rslab"), 200_000) == ()
    assert iterative.ways_of(pr.Numerics(solver="multigrid"), 100) == ("multigrid", "ldlt")
    flat = replace(billet(), space="plane strain", bodies={"b": pr.Body(pr.Rectangle((4.0, 4.0), (2, 2)), STEEL)},
                   fixed={"b.bottom": "y", "b.left": "x"})  # fmt: skip
    with pytest.raises(ArgumentError, match=r"'numerics.solver' is 'ldlt', which is of 'space: solid'"):
        pr.solve(flat, pr.Numerics(solver="ldlt"))
    text = dump(pr.Case(flat, pr.Numerics(solver="rslab"))).replace("rslab", "multigrid")
    with pytest.raises(CaseError, match=r"'numerics.solver' is 'multigrid', which is of 'space: solid'"):
        loads(text, "case.yaml")
