"""Accuracy of increments, and what the expectation of a turning flow may change: time, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.policy import Policy
from prensa.system.system import System
from prensa.verify.balance import imbalance, loaded_block
from prensa.verify.enforcement import enforced
from prensa.verify.forming import upsetting
from prensa_bench.robustness import drawn

FORCES_BALANCE = 1e-10  # over the largest force of a run: a tenth of Newton's tolerance, which is over all forces inside
BILLET = upsetting((12, 9), 0.3, reductions=(0.1, 0.2, 0.3))


def counted(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Evaluations from now on, each by whether it made a matrix."""
    made, evaluate = [], System.evaluate

    def counting(self, c, u, lam, stiffness=True, **overrides):
        made.append(stiffness)
        return evaluate(self, c, u, lam, stiffness, **overrides)

    monkeypatch.setattr(System, "evaluate", counting)
    return made


def test_tools_that_are_moved_need_the_digits_of_sums_alone(monkeypatch):
    """Fewer evaluations; forces balance to 1e-9 in every increment and are those of a hundred times less left to 1e-9."""
    made, found = counted(monkeypatch), []
    for policy in (Policy(fine_residual=1e-12, fine_ratio_moved_tools=1.0), Policy(fine_ratio_moved_tools=1.0), Policy()):
        made.clear()
        system = pr.discretise(BILLET)
        increments = list(pr.solve(system, policy=policy))
        forces = np.array([inc.force("punch").y for inc in increments])
        assert max(imbalance(system, inc)[0] for inc in increments) <= 1e-9
        found.append((len(made), forces))
    (_, best), (before, _), (now, forces) = found
    assert now < before
    np.testing.assert_allclose(forces, best, rtol=0, atol=1e-9 * np.abs(best).max())


def test_forces_between_tools_balance_beyond_the_tolerance():
    """Of a random forging: 2e-11 of the largest force is missed; within the tolerance alone it was 2e-9."""
    system = pr.discretise(drawn("posed", 5, 1).problem)
    missed, largest = 0.0, 0.0
    for inc in pr.solve(system):
        force = max(abs(inc.force(tool).y) for tool in inc.tools)
        largest = max(largest, force)
        missed = max(missed, imbalance(system, inc)[0] * force)
    assert missed <= FORCES_BALANCE * largest


PUSHED = loaded_block("finite", "current", 1.0, 1.0)


@pytest.mark.parametrize("problem", [PUSHED, enforced(BILLET, pr.Exact())], ids=["pushed", "exact"])
def test_tools_that_find_their_place_by_forces_need_all_digits(problem):
    """With pushed tools and loads, and with multipliers, nothing is left that was taken away before: the same bits."""
    strict, usual = (last(problem, Policy(fine_ratio_moved_tools=moved)) for moved in (1.0, 10.0))
    assert np.array_equal(strict.state.u, usual.state.u)


def last(problem: pr.Problem, policy: Policy | None = None) -> pr.Increment:
    """The last increment of a run."""
    *_, increment = pr.solve(problem, policy=policy)
    return increment
