"""Threads share the work and nothing else: results are the same bits with any number of them."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import threading
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import ThreadpoolController

import prensa as pr
from prensa import analysis
from prensa.elements.element import Why
from prensa.linear import threads as of_threads
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from prensa.policy import DEFAULT
from prensa.solver import time_stepping
from prensa.solver.first_matrix import Ahead
from prensa.system import assembly
from prensa.system.planning import plan_step
from prensa.system.system import System
from prensa.verify.forming import upsetting


@pytest.fixture(autouse=True)
def many_chunks(monkeypatch):
    """Chunks so small that these meshes have more of them than threads."""
    monkeypatch.setattr(assembly, "CHUNK", 7)


def evaluated(problem: pr.Problem, count: int, noise: float):
    """The evaluation of a disturbed state by so many threads."""
    system = pr.discretise(problem)
    state = system.initial()
    c = system.context(state, plan_step(system, 0, state.step_start), 0.01)
    u = state.u.copy()
    u[: 2 * system.nodes] += noise * np.random.default_rng(0).standard_normal(2 * system.nodes)
    return system.evaluate(replace(c, threads=count), u, state.lam)


@pytest.mark.parametrize("element", ["q4_fbar", "q4", "q4_enhanced", "t6"])
def test_evaluations_do_not_depend_on_the_threads(element):
    """Residual, matrix, history and scale are the same bits with one, two and five threads, for every kind of element."""
    problem = upsetting((8, 6), 0.1)
    billet = replace(problem.bodies["billet"], element=element)
    one, *more = (evaluated(replace(problem, bodies={"billet": billet}), count, 0.02) for count in (1, 2, 5))
    assert one.failed is None
    for other in more:
        assert np.array_equal(one.r, other.r) and np.array_equal(one.data, other.data) and one.scale == other.scale
        assert all(np.array_equal(a, b) for a, b in zip(one.history, other.history))


def test_the_first_element_that_fails_is_reported_whoever_finds_it():
    """Where several elements turn inside out, the first of them is named with any number of threads."""
    one, *more = (evaluated(upsetting((8, 6), 0.1), count, 3.0) for count in (1, 2, 5))
    assert one.failed is not None and one.failed.why is Why.INVERTED
    assert all(other.failed == one.failed for other in more)


def test_runs_and_resumed_runs_do_not_depend_on_the_threads(tmp_path):
    """Every increment has the same displacements and forces, and a run that is resumed goes on bit for bit with other threads."""
    problem = upsetting((8, 6), 0.1, increments=4, reductions=(0.1,))
    runs = [list(pr.solve(problem, pr.Numerics(threads=count))) for count in (1, 2)]
    for a, b in zip(*runs, strict=True):
        assert np.array_equal(a.state.u, b.state.u) and a.force("punch").y == b.force("punch").y
    path = write_checkpoint(tmp_path / "checkpoint.h5", pr.Case(problem), runs[0][1].state)
    _, state = read_checkpoint(path)
    *_, last = pr.solve(problem, pr.Numerics(threads=2), state)
    assert np.array_equal(last.state.u, runs[0][-1].state.u)


@pytest.mark.parametrize(
    ("running", "limit", "unknowns", "threads"),
    [
        (1, "", 10**5, 4),  # nothing but this process
        (3, "", 10**5, 2),
        (9, "", 10**5, 1),
        (1, "2", 10**5, 2),
        (1, "1", 10**5, 1),
        (1, "", 100, 1),
    ],
)
def test_auto_takes_the_cores_that_are_free(monkeypatch, tmp_path, running, limit, unknowns, threads):
    """One thread for every core on which nothing runs, no more than OMP_NUM_THREADS, one for small problems; never none."""
    (tmp_path / "loadavg").write_text(f"0.50 0.40 0.30 {running}/123 4567\n")
    monkeypatch.setattr(of_threads, "LOAD", tmp_path / "loadavg")
    monkeypatch.setattr(of_threads.os, "sched_getaffinity", lambda _: set(range(4)), raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", limit)
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    assert of_threads.threads_of(pr.Numerics(), unknowns, DEFAULT) == threads
    assert of_threads.threads_of(pr.Numerics(threads=3), unknowns, DEFAULT) == 3


def test_auto_is_one_thread_where_others_share_out_the_cores(monkeypatch):
    """Under a test runner, and in a process that another one of Python has started, ``auto`` is one thread."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setattr(of_threads, "free_cores", lambda: 4)
    assert of_threads.threads_of(pr.Numerics(), 10**5) == 1
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    assert of_threads.threads_of(pr.Numerics(), 10**5) == 4
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: object())
    assert of_threads.threads_of(pr.Numerics(), 10**5) == 1


def test_the_first_matrix_is_made_by_another_thread_meanwhile(monkeypatch):
    """With two threads the first step takes the matrix that another thread has analysed: nothing is analysed twice."""
    made = []

    class Noted(Ahead):
        def matrix(self):
            made.append(super().matrix())
            assert super().matrix() is None  # handed over
            return made[-1]

    monkeypatch.setattr(analysis, "Ahead", Noted)
    taken, prepare = [], time_stepping.TimeStepping.prepare

    def noted(self, plan):
        prepare(self, plan)
        taken.append(self.reduced)

    monkeypatch.setattr(time_stepping.TimeStepping, "prepare", noted)
    problem = upsetting((8, 6), 0.1, increments=1, reductions=(0.02,))
    for count in (1, 2):
        list(pr.solve(problem, pr.Numerics(threads=count)))
    assert len(made) == 1 and taken[1] is made[0] and taken[0] is not taken[1]


def test_what_cannot_be_prepared_is_reported_as_with_one_thread():
    """A description that is refused is refused in the same words, whoever has begun with its matrix."""
    fixed = {"billet.bottom": "y", "billet.left": "x", "billet.right": pr.Fixed(y=0.5)}
    problem = replace(upsetting((4, 3), 0.1), fixed=fixed)
    words = []
    for count in (1, 2):
        with pytest.raises(pr.PrensaError) as caught:
            list(pr.solve(problem, pr.Numerics(threads=count)))
        words.append(str(caught.value))
    assert words[0] == words[1]


SOLVED_BY_THREADS = """
import threading
import numpy as np
from scipy.sparse import csc_matrix, diags_array, eye_array, kron
from prensa.linear.factorisations import Factorisation

line = diags_array([-np.ones(19), 2.1 * np.ones(20), -np.ones(19)], offsets=[-1, 0, 1])
a = csc_matrix(kron(line, eye_array(20)) + kron(eye_array(20), line))
a.sort_indices()

def solve():
    for _ in range(3):
        Factorisation(400, a.indptr, a.indices, "rslab").solve(a.data, np.ones(400))

for _ in range(5):
    thread = threading.Thread(target=solve)
    thread.start()
    thread.join()
print("solved")
"""


def test_threads_that_end_leave_the_solver_usable():
    """One thread after the other solves and ends, in a process that has not loaded rslab before: none crashes."""
    pytest.importorskip("rslab")
    done = subprocess.run([sys.executable, "-c", SOLVED_BY_THREADS], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (0, "solved\n"), done.stderr


@pytest.fixture
def controller():
    """Of NumPy's threads, where it has OpenBLAS or BLIS."""
    found = ThreadpoolController().select(internal_api=["openblas", "blis"])
    if not found.info():
        pytest.skip("NumPy has another BLAS here")
    return found


def test_numpy_takes_one_thread_within_increments(monkeypatch, controller):
    """Between increments, and after them, it takes what it took before."""

    def counts():
        return {library["filepath"]: library["num_threads"] for library in controller.info()}

    within, between, evaluate = [], [], System.evaluate

    def seen(*args, **kwargs):
        within.append(counts())
        return evaluate(*args, **kwargs)

    monkeypatch.setattr(System, "evaluate", seen)
    with controller.limit(limits=2):
        before = counts()
        for _ in pr.solve(upsetting((4, 3), 0.1, reductions=(0.05,))):
            between.append(counts())
        assert counts() == before and all(now == before for now in between)
    assert within and all(set(now.values()) == {1} for now in within[1:])


def test_the_last_one_that_leaves_sets_numpy_back(controller):
    """Runs that overlap in several threads of Python leave it as it was before the first."""
    with controller.limit(limits=2):
        first, second = of_threads.ONE_OF_BLAS, of_threads.ONE_OF_BLAS
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert {library["num_threads"] for library in controller.info()} == {1}
        second.__exit__(None, None, None)
        assert {library["num_threads"] for library in controller.info()} == {2}


def test_numpy_takes_one_thread_whichever_thread_asks_first(controller):
    """A thread that set NumPy's number before, and lives on, keeps no other one from it: threadpoolctl would let it."""
    ready, done = threading.Event(), threading.Event()

    def counts():
        return {library["num_threads"] for library in controller.info()}

    def first():
        limited = controller.limit(limits=2)
        ready.set()
        done.wait(60)
        limited.restore_original_limits()

    other = threading.Thread(target=first)
    other.start()
    ready.wait(60)
    try:
        with of_threads.ONE_OF_BLAS:
            assert counts() == {1}
        assert counts() == {2}
    finally:
        done.set()
        other.join()


def test_the_thread_that_leaves_last_sets_numpy_back(controller):
    """Also where it is not the one that came first."""
    inside, leave = threading.Event(), threading.Event()

    def stays():
        with of_threads.ONE_OF_BLAS:
            inside.set()
            leave.wait(60)

    with controller.limit(limits=2):
        other = threading.Thread(target=stays)
        with of_threads.ONE_OF_BLAS:
            other.start()
            inside.wait(60)
        assert {library["num_threads"] for library in controller.info()} == {1}
        leave.set()
        other.join()
        assert {library["num_threads"] for library in controller.info()} == {2}


@pytest.mark.parametrize(
    ("numerics", "unknowns", "expected"),
    [
        (pr.Numerics(), 1000, (1, False)),  # two would wait for each other
        (pr.Numerics(), 2000, (1, True)),
        (pr.Numerics(), 10**4, (3, True)),
        (pr.Numerics(), 10**6, (4, False)),  # no room for the factors of two increments
        (pr.Numerics(threads=1), 10**4, (1, False)),
        (pr.Numerics(threads=2), 1000, (2, False)),
        (pr.Numerics(threads=2), 10**4, (1, True)),
        (pr.Numerics(threads=3), 2000, (2, True)),
        (pr.Numerics(solver="pardiso", threads=2), 10**4, (2, False)),  # its factors are overwritten
    ],
)
def test_one_thread_follows_with_derivatives(monkeypatch, numerics, unknowns, expected):
    """One of the threads that are asked for, or of the cores that are free."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    monkeypatch.setattr(of_threads, "free_cores", lambda: 4)
    monkeypatch.setattr(of_threads, "available", lambda solver: ["rslab"] if solver == "auto" else [solver])
    assert of_threads.threads_with_follower(numerics, unknowns) == expected
    monkeypatch.setattr(of_threads, "free_cores", lambda: 1)
    if numerics.threads == "auto":
        assert of_threads.threads_with_follower(numerics, unknowns) == (1, False)
