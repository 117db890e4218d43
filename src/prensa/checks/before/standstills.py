"""Steps in which nothing changes: totals of the step before, written again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding
from prensa.model.fields import motions_in
from prensa.model.problem import Step
from prensa.system.moments import stages
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array


def standstills(system: System) -> Iterator[Finding]:
    """Steps that are to change something and in which nothing changes."""
    for plan, before, start, known, *_ in stages(system):
        # What an earlier step may have left anywhere cannot be known to stand still.
        if before is not None and known[plan.fixed].all():
            yield from _standstill(system, plan, start, before)


def _standstill(system: System, plan: StepPlan, at_start: Array, before: StepPlan) -> Iterator[Finding]:
    """A step that is to change something and in which nothing changes: totals of the step before, written again."""
    step = system.problem.steps[plan.number]
    written = next(_repeated(step, plan, system.problem.space), None) or _nothing(step, plan)
    rests = step.duration is not None  # time is to pass
    if written is None or rests or not _unchanged(plan, before) or plan.friction != before.friction:
        return
    start = np.concatenate([at_start[plan.fixed], [mount(plan.t0) for _, mount in before.springs.values()]])
    for t in [*plan.corners(), plan.t1]:
        if not np.allclose(plan.motion(float(t)), start, rtol=NO_DIFFERENCE, atol=0.0):
            return
    yield Finding(*written)


def _repeated(step: Step, plan: StepPlan, space: str | None) -> Iterator[tuple[str, str]]:
    """Path and words of each number of a step that says nothing new if nothing changes in it."""
    for name, motion in step.move.items():
        for axis in motions_in(space):
            if isinstance(value := getattr(motion, axis), float) and value:
                yield (
                    f"steps.{plan.number}.move.{name}.{axis}",
                    f"step {plan.name!r} moves nothing: tool {name!r} is at {axis} = {value:g} already; 'move' is measured "
                    f"from the initial place: write {2 * value:g}, or 'by: {{{name}: {{{axis}: {value:g}}}}}' for as much "
                    "again",
                )
    for name, support in step.fixed.items():
        for axis in "xyz":
            if isinstance(value := getattr(support, axis), float) and value:
                yield (
                    f"steps.{plan.number}.fixed.{name}.{axis}",
                    f"step {plan.name!r} moves nothing: {name!r} is at {axis} = {value:g} already; 'fixed' is measured from "
                    f"the initial place: write {2 * value:g}, or 'by: {{{name}: {{{axis}: {value:g}}}}}' for as much again",
                )
    for kind, what in (("push", "push"), ("loads", "load")):
        for name, entry in getattr(step, kind).items():
            for axis, value in vars(entry).items():
                if isinstance(value, float) and value:
                    yield (
                        f"steps.{plan.number}.{kind}.{name}.{axis}",
                        f"step {plan.name!r} changes nothing: the {what} {axis} = {value:g} of {name!r} is there already; it is "
                        f"the total {what}, not what is added: write {2 * value:g} for twice as much, or leave the step out",
                    )


def _nothing(step: Step, plan: StepPlan) -> tuple[str, str] | None:
    """Path and words of a step that says nothing at all."""
    bare = Step(step.name, increments=step.increments)
    return None if step != bare else (
        f"steps.{plan.number}",
        f"step {step.name!r} is empty, so nothing changes: motions have to be given in every step; give them, or a 'duration' "
        "if time is to pass, or leave the step out",
    )  # fmt: skip


def _unchanged(plan: StepPlan, before: StepPlan) -> bool:
    """Whether supports, forces and loads of a step are those with which the one before ended, and stay so."""

    def levels(p: StepPlan, t: float) -> Array:
        amplitudes = [p.push[dof] for dof in sorted(p.push)]
        amplitudes += [c for _, ld in sorted(p.loads.items()) for c in ld.courses.values()]
        amplitudes += [c for _, pair in sorted(p.body_force.items()) for c in pair]
        return np.array([c(t) for c in amplitudes])

    same = np.array_equal(plan.fixed, before.fixed) and list(plan.springs) == list(before.springs)
    if not same or plan.loads.keys() != before.loads.keys() or plan.body_force.keys() != before.body_force.keys():
        return False
    if plan.push.keys() != before.push.keys():
        return False
    last = levels(before, before.t1)
    return all(np.array_equal(levels(plan, float(t)), last) for t in [*plan.corners(), plan.t1])
