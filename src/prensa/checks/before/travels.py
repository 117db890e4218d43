"""Travels that are to end a step and that nothing in it reaches."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.errors import Finding
from prensa.model.fields import motions_in
from prensa.system.moments import stages
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array, Flags


def travels(system: System) -> Iterator[Finding]:
    """Travels that are to end a step and that lie beyond what it prescribes."""
    for plan, _, start, known, *_ in stages(system):
        yield from _never_there(system, plan, start, known)


def _never_there(system: System, plan: StepPlan, at_start: Array, known: Flags) -> Iterator[Finding]:
    """Travels that are to end a step and that lie beyond what it prescribes."""
    until = system.problem.steps[plan.number].until
    for name, target in until.travel.items() if until is not None else ():
        first = system.tool_dof(list(system.problem.tools).index(name))
        for i, axis in enumerate(motions_in(system.problem.space)):
            value, dof = getattr(target, axis, None), first + i
            if value is None or dof not in plan.fixed or not known[dof]:
                continue
            where = int(np.searchsorted(plan.fixed, dof))
            way = np.array([plan.values(float(t))[where] for t in [plan.t0, *plan.corners(), plan.t1]])
            start = float(at_start[dof])
            if not min(way.min(), start) <= value <= max(way.max(), start):
                aside = "let it go further" if value * way[-1] > 0.0 else "check the sign, which is as in history.csv"
                remedy = aside if np.ptp(way) else "the step does not move it in that direction; name a component that it moves"
                yield Finding(
                    f"steps.{plan.number}.until.travel.{name}.{axis}",
                    f"tool {name!r} never reaches {axis} = {value:g}: step {plan.name!r} moves it from {start:.6g} to "
                    f"{way[-1]:.6g}; {remedy}",
                )
