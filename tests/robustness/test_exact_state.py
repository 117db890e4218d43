"""Run ≡ run with increments rejected and retried ≡ forked ≡ resumed ≡ killed and resumed, bit for bit, on one thread."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import prensa as pr
from prensa.errors import SolveError
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from prensa.output.run import resume, run
from prensa.policy import Policy
from prensa.solver import increment_solver
from prensa.system.discretise import discretise
from problems import pressed_block, single_block, stroke, upset_block
from states import same

FRICTION = (
    None, pr.Coulomb(0.3), pr.Coulomb(3.0), pr.Coulomb(pr.MuExponential(0.1, 0.4, 0.05)), pr.Shear(0.4, k=20.0),
    pr.Coulomb(pr.MuExponential(0.4, 0.2, 1.0)),
)  # fmt: skip
MATERIALS = (
    pr.Elastic(1000.0, 0.3), pr.J2(1000.0, 0.3, pr.Swift(20.0, 0.01, 0.2)),
    pr.J2(1000.0, 0.3, pr.JohnsonCook(5.0, 5.0, 0.5, 0.02, 0.1)),
)  # fmt: skip
ENFORCEMENT = (pr.Penalty(), pr.Augmented(), pr.Exact())
MODES = (("small", "reference"), ("small", "current"), ("finite", "current"))


@st.composite
def problems(draw, linear: bool = False) -> pr.Problem:
    """A small block pressed, then slid or released, by a tool that moves or is pushed; linear: all but the contact is linear."""
    axi = draw(st.booleans())
    kinematics, geometry = draw(st.sampled_from(MODES[:2] if linear else MODES))
    material = draw(st.sampled_from(MATERIALS[:1] if linear else MATERIALS))
    tool = draw(st.sampled_from((pr.Plane(touching="b.top"), pr.Circle(radius=2.0, touching="b.top"))))
    first = draw(st.sampled_from(({"move": {"t": pr.Motion(y=-0.06)}}, {"push": {"t": pr.Push(y=-8.0)}})))
    second = {"move": {"t": pr.Motion(**({"y": -0.02} if axi else {"x": 0.03}))}}
    increments = draw(st.sampled_from((1, 3, None)))
    return pressed_block(
        pr.Step("one", increments=increments, **first), pr.Step("two", increments=increments, **second),
        tools={"t": tool}, material=material, size=(2, 1), n=(6, 3), friction=draw(st.sampled_from(FRICTION)),
        enforcement=draw(st.sampled_from(ENFORCEMENT)), space="axisymmetric" if axi else "plane strain",
        kinematics=kinematics, contact_geometry=geometry,
    )  # fmt: skip


NARROW = Policy(columns_at_once=4)  # so that contact of these small bodies grows out of the columns made at once


def solved(problem, start=None, condense=False, policy=NARROW) -> list:
    """Committed states; a run that is given up counts up to there."""
    states = []
    try:
        states.extend(
            inc.state for inc in pr.solve(discretise(problem), pr.Numerics(condense=condense), start, policy=policy)
        )
    except SolveError as error:
        assert "What to try" in str(error)
    return states


def all_same(a, b) -> bool:
    return len(a) == len(b) and all(map(same, a, b))


HYPOTHESIS = settings(
    max_examples=25, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)  # fmt: skip


@pytest.mark.slow
@HYPOTHESIS
@given(problem=problems(), share=st.floats(0.0, 1.0))
def test_forked_and_resumed_runs_are_the_run(problem, share, tmp_path):
    """From any committed state, at hand or read back from a checkpoint, every later state has the same bits."""
    continued(problem, share, tmp_path, condense=False)


@pytest.mark.slow
@HYPOTHESIS
@given(problem=problems(linear=True), share=st.floats(0.0, 1.0))
def test_condensed_runs_that_are_forked_and_resumed_are_the_run(problem, share, tmp_path):
    """The same where bodies are condensed, whatever columns had been made before."""
    continued(problem, share, tmp_path, condense=True)


def continued(problem, share, folder, condense) -> None:
    states = solved(problem, condense=condense)
    if not states:
        return
    k = min(int(share * len(states)), len(states) - 1)
    assert all_same(solved(problem, states[k], condense), states[k + 1 :])
    path = write_checkpoint(folder / "checkpoint.h5", pr.Case(problem), states[k])
    case, state = read_checkpoint(path)
    assert same(state, states[k])
    assert all_same(solved(case.problem, state, condense), states[k + 1 :])


@pytest.mark.slow
@HYPOTHESIS
@given(problem=problems(), seed=st.integers(0, 2**32 - 1))
def test_increments_rejected_and_retried_change_nothing(problem, seed):
    """Attempts that are thrown away, at the same size or at others, leave no trace in what follows."""
    retried(problem, seed, condense=False)


@pytest.mark.slow
@HYPOTHESIS
@given(problem=problems(linear=True), seed=st.integers(0, 2**32 - 1))
def test_condensed_increments_rejected_and_retried_change_nothing(problem, seed):
    """The same where bodies are condensed: the columns that such attempts made change nothing."""
    retried(problem, seed, condense=True)


def retried(problem, seed, condense) -> None:
    states = solved(problem, condense=condense)
    rng = np.random.default_rng(seed)
    attempt = increment_solver.attempt

    def twice(eq, *args):
        c = eq.context
        for share in (1.0, float(rng.uniform(0.1, 0.9)))[: rng.integers(3)]:
            now = c.state.clock.time
            other = eq.system.context(c.state, c.plan, now + share * (c.time - now))
            attempt(replace(eq, context=other), *args)
        return attempt(eq, *args)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(increment_solver, "attempt", twice)
        assert all_same(solved(problem, condense=condense), states)


# ------------------------------------------------------------------------------------------------------------- SIGKILL
KILLS = 20


def small() -> pr.Case:
    problem = upset_block(
        stroke(-0.2, increments=12), stroke(-0.19, increments=6, name="back"),
        material=pr.J2(1000.0, 0.3, pr.Voce(5.0, 5.0, 8.0)), size=(2, 1), n=(6, 4), sides=("top", "right"),
        friction=pr.Coulomb(0.3),
    )  # fmt: skip
    return pr.Case(problem, output=pr.Output(pictures=False, report=False))


def results(folder: Path) -> dict[str, bytes]:
    """Everything a run leaves but what depends on its wall time, the state array by array."""
    out = {
        str(p.relative_to(folder)): p.read_bytes()
        for p in folder.rglob("*")
        if p.is_file() and p.suffix in (".csv", ".vtu", ".pvd")
    }
    _, state = read_checkpoint(folder / "checkpoint.h5")
    return out | {k: a.tobytes() for k, a in state.arrays().items()}


def killed(work, after: float) -> bool:
    """Run *work* in a process of its own and kill it after so many seconds; whether it was still at work."""
    child = os.fork()
    if child == 0:
        try:
            work()
        finally:
            os._exit(0)
    end = time.monotonic() + after
    while time.monotonic() < end:
        if os.waitpid(child, os.WNOHANG)[0]:
            return False
        time.sleep(0.001)
    os.kill(child, signal.SIGKILL)
    return bool(os.WIFSIGNALED(os.waitpid(child, 0)[1]))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")
# pytest-xdist has threads of its own in every process; the child touches none of them
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded, use of fork:DeprecationWarning")
@pytest.mark.slow
def test_a_run_killed_at_random_moments_ends_the_same(tmp_path):
    """SIGKILL at 20 random moments of runs and of resumed runs: whatever was on the disk, the end is the same, bit for bit."""
    rng = np.random.default_rng(20)
    run(small(), tmp_path / "warm", quiet=True)
    begun = time.monotonic()
    run(small(), tmp_path / "whole", quiet=True)
    whole, length = results(tmp_path / "whole"), time.monotonic() - begun
    kills, folders = 0, 0
    while kills < KILLS and folders < 4 * KILLS:
        folder = tmp_path / str(folders)
        folders += 1
        alive = killed(partial(run, small(), folder, quiet=True), rng.uniform(0, length))
        kills += alive
        while alive and (folder / "checkpoint.h5").exists() and rng.random() < 0.5:
            alive = killed(partial(resume, folder, quiet=True), rng.uniform(0, length))
            kills += alive
        if (folder / "checkpoint.h5").exists():
            resume(folder, quiet=True)
        else:
            run(small(), folder, quiet=True)
        ended = results(folder)
        assert sorted(ended) == sorted(whole)
        assert [name for name in whole if ended[name] != whole[name]] == []
    assert kills >= KILLS


def test_factors_of_earlier_attempts_are_not_used():
    """A run that starts within the tolerance is improved with factors of its own: a resumed one has no others."""
    improved = Policy(fine_residual=1e-30)  # whatever is converged is improved once more
    problem = single_block(
        pr.Step("one", increments=7), size=(2, 1), n=(6, 3), fixed={"b.bottom": "xy"}, kinematics="small",
        loads={"b.top": pr.Load(pressure=1.0, follower=False)},
    )  # fmt: skip
    states = solved(problem, policy=improved)
    for k in range(len(states) - 1):
        assert all_same(solved(problem, states[k], policy=improved), states[k + 1 :])
