"""Equations of an increment, for tests of how they are solved."""

from __future__ import annotations

from contextlib import nullcontext

import prensa as pr
from prensa.linear.reduction import Reduced
from prensa.policy import Policy
from prensa.solver.equilibrium import Equilibrium, Reporter
from prensa.system.planning import plan_step


def of_first_increment(problem: pr.Problem, policy: Policy | None = None, may_go_far: bool = False) -> Equilibrium:
    """The equations at the end of the first step, reached in one increment."""
    system, policy = pr.discretise(problem), policy or Policy()
    state = system.initial()
    plan = plan_step(system, 0, state.step_start)
    report = Reporter(lambda *_: None, lambda _: nullcontext())
    reduced = Reduced.of(system, plan.fixed, pr.Numerics(), policy=policy)
    context = system.context(state, plan, 1.0)
    return Equilibrium(system, context, reduced, pr.Numerics(), policy, report, may_go_far=may_go_far)
