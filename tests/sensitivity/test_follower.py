"""Derivatives that another thread finds while the run goes on: the same bits, the same order, the same errors."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest
from test_derivatives import EXACT, RELEASED_BETWEEN, TWO_STEPS, lip

import prensa as pr
from prensa.errors import PrensaError, SolveError
from prensa.linear.factorisations import Factorisation
from prensa.model.schema import loads
from prensa.policy import Policy
from prensa.result.increment import Increment
from prensa.sensitivity import direct, increments
from prensa.timer import Timer
from rings import FLOW, ring

FOLLOWED = Policy(pipeline_from_dofs=0)
NONE = Policy(pipeline_from_dofs=10**9)
TWO = pr.Numerics(threads=2)
PATHS = ["friction.mu", f"{FLOW}.K", "bodies.ring.mesh.size.1"]
STEPS_PATHS = ["friction.mu", "tools.roll.radius", "bodies.block.material.flow.K", "steps.1.move.roll.x"]
CASES = {
    "closed": (ring, PATHS),
    "exact": (lambda: ring(EXACT), PATHS),
    "by differences": (lambda: ring("bodies.ring.element=q8"), PATHS),
    "lagged": (ring, PATHS),
    "steps": (lambda: loads(TWO_STEPS).problem, STEPS_PATHS),
    "released": (lambda: loads(RELEASED_BETWEEN).problem, STEPS_PATHS[:3]),
    "plane at a line of symmetry": (lip, ["bodies.d.material.flow.s0"]),
}  # fmt: skip


def contents(increment: Increment) -> dict[str, Any]:
    """Everything that an increment says of derivatives."""
    found = increment.derivatives
    assert found is not None
    names = list(increment.tools)
    return {
        "number": increment.number, "flat": found.flat, "switched": found.switched, "at_kinks": found.at_kinks,
        "forces": [increment.derivative(lambda i, name=name: i.force(name).y) for name in names],
        "measure": increment.derivative(f"{names[0]}.force.y"),
    }  # fmt: skip


def arrays(increment: Increment) -> dict[str, Any]:
    """The committed state, its derivatives by parameter too."""
    state = increment.state
    carried = {f"{path}.{k}": v for path, by in state.derivatives.items() for k, v in by.items()}
    return state.arrays() | carried


@pytest.mark.parametrize("case", CASES)
def test_followed_runs_have_the_same_derivatives(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Increments, states and derivatives are those that one thread finds, bit for bit, and it is another thread that looks."""
    make, paths = CASES[case]
    finders, find = set(), increments.Differentiation.of

    def noted(self: Any, *args: Any) -> Any:
        finders.add(threading.current_thread().name.partition("_")[0])
        return find(self, *args)

    monkeypatch.setattr(increments.Differentiation, "of", noted)
    iteration: Any = "paper" if case == "lagged" else "newton"
    runs = []
    for threads, policy in ((1, NONE), (2, FOLLOWED)):
        numerics = pr.Numerics(threads=threads, iteration=iteration)
        runs.append(list(pr.solve(make(), numerics, derivatives=paths, policy=policy)))
    assert finders == {"MainThread", "derivatives"}
    for one, other in zip(*runs, strict=True):
        assert contents(one) == contents(other)
        for (name, a), (same, b) in zip(arrays(one).items(), arrays(other).items(), strict=True):
            assert name == same and np.array_equal(a, b), name


def test_followed_runs_are_resumed_bit_for_bit() -> None:
    """From a state in the middle, and with one thread from there on."""
    problem = ring()
    whole = list(pr.solve(problem, TWO, derivatives=PATHS, policy=FOLLOWED))
    for numerics, policy in ((TWO, FOLLOWED), (pr.Numerics(threads=1), NONE)):
        rest = list(pr.solve(problem, numerics, whole[2].state, derivatives=PATHS, policy=policy))
        assert [contents(i) for i in rest] == [contents(i) for i in whole[3:]]


def test_the_next_increment_is_solved_before_one_is_reported() -> None:
    """The run is one increment ahead of what is reported, and no more."""
    solved: list[int] = []

    def monitor(progress: pr.Progress) -> None:
        if progress.event == "accepted":
            solved.append(progress.number)

    ahead = []
    for increment in pr.solve(ring(), TWO, monitor=monitor, derivatives=PATHS, policy=FOLLOWED):
        ahead.append(solved[-1] - increment.number)
    assert ahead == [1, 1, 1, 1, 1, 0]


def test_errors_come_after_what_went_well() -> None:
    """A run that fails yields all increments before, and its error has the last of them with its derivatives."""
    problem = ring("steps.0={name: press, move: {die: {y: -2.6}}}")
    seen, errors = list[list[int]](), list[SolveError]()
    for threads, policy in ((1, NONE), (2, FOLLOWED)):
        numerics = pr.Numerics(threads=threads, max_iterations=5)
        seen.append([])
        with pytest.raises(SolveError) as caught:
            for increment in pr.solve(problem, numerics, derivatives=PATHS, policy=policy, times=[0.03, 0.06, 0.09, 1.0]):
                seen[-1].append(increment.number)
        errors.append(caught.value)
    assert seen == [[1, 2, 3], [1, 2, 3]]
    assert str(errors[0]) == str(errors[1])
    one, other = (error.last for error in errors)
    assert isinstance(one, Increment) and isinstance(other, Increment)
    assert contents(one) == contents(other) and other.state.derivatives.keys() == set(PATHS)


def test_derivatives_that_cannot_be_found_are_reported_in_their_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    """What goes wrong beside an increment is reported after the increments before it, whatever the run is doing meanwhile."""
    find = increments.Differentiation.of

    def fails(self: Any, c: Any, *args: Any) -> Any:
        if c.state.clock.number == 3:
            raise PrensaError("beside the fourth")
        return find(self, c, *args)

    monkeypatch.setattr(increments.Differentiation, "of", fails)
    seen = []
    with pytest.raises(PrensaError, match="beside the fourth"):
        for increment in pr.solve(ring(), TWO, derivatives=PATHS, policy=FOLLOWED):
            seen.append(increment.number)
    assert seen == [1, 2, 3]


def test_doubts_are_reported_as_with_one_thread(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """A derivative that is not exact is reported once a parameter, by the thread that runs, before its increment."""
    right = direct.Columns.solve
    monkeypatch.setattr(direct.Columns, "solve", lambda self, b: 1.001 * right(self, b))
    increment = next(iter(pr.solve(ring(), TWO, derivatives=PATHS[:2], policy=FOLLOWED)))
    assert increment.number == 1
    assert sum("is not exact" in r.getMessage() for r in caplog.records) == 2
    assert all(r.threadName == "MainThread" for r in caplog.records)


def test_a_run_that_is_left_has_no_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """The thread ends with the run, however that ends."""

    def following() -> list[str]:
        return [t.name for t in threading.enumerate() if t.name.startswith("derivatives")]

    run = pr.solve(ring(), TWO, derivatives=PATHS, policy=FOLLOWED)
    next(run)
    assert len(following()) == 1
    run.close()  # type: ignore[attr-defined]
    assert not following()
    list(pr.solve(ring(), TWO, derivatives=PATHS, policy=FOLLOWED))
    assert not following()


def test_time_for_derivatives_is_that_for_which_the_run_waits() -> None:
    """A timer has what derivatives take with one thread, and what they hold the run up with two."""
    timer = Timer()
    list(pr.solve(ring(), TWO, timer=timer, derivatives=PATHS, policy=FOLLOWED))
    assert timer.seconds["derivatives"] > 0.0


def test_factors_apart_are_their_own() -> None:
    """What is made with factors apart leaves those of the run as they are."""
    pytest.importorskip("rslab")
    n, rng = 40, np.random.default_rng(3)
    indptr, indices = np.arange(0, n * n + 1, n, dtype=np.int32), np.tile(np.arange(n, dtype=np.int32), n)
    first, second = (rng.standard_normal((n, n)) + 9.0 * np.eye(n) for _ in range(2))
    b = rng.standard_normal(n)
    factors = Factorisation(n, indptr, indices, "rslab")
    factors.solve(first.T.ravel(), b)
    apart = factors.detach()
    assert np.array_equal(apart.solve_with_factors(b), factors.solve_with_factors(b))
    x = apart.solve(second.T.ravel(), b)
    assert first @ factors.solve_with_factors(b) == pytest.approx(b) and second @ x == pytest.approx(b)
    large = Factorisation(n, indptr, indices, "rslab", policy=Policy(detach_max_unknowns=n - 1))
    assert large.detach() is large


def test_factors_of_a_far_matrix_are_replaced_in_single_precision() -> None:
    """Where Newton's factors lead nowhere, those of the matrix at the solution do, and the run keeps its own."""
    pytest.importorskip("rslab")
    problem = ring("bodies.ring.mesh.n=[12, 8]")
    every, single = Policy(single_precision_from=10**9), Policy(single_precision_from=1, same_matrix_points=100,
        gmres_max_iterations=30)
    paths = [*PATHS, f"{FLOW}.n"]
    exact = list(pr.solve(problem, derivatives=paths, policy=every))
    plain = list(pr.solve(problem, policy=single))
    made, coarse = [], Factorisation.coarse
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Factorisation, "coarse", lambda self, values: made.append(1) or coarse(self, values))
        run = list(pr.solve(problem, derivatives=paths, policy=single))
    assert made
    for a, b, c in zip(run, plain, exact, strict=True):
        assert np.array_equal(a.state.u, b.state.u)
        one, other = (i.derivative(lambda i: i.force("die").y) for i in (a, c))
        assert [one[p] for p in paths] == pytest.approx([other[p] for p in paths], rel=1e-6)
